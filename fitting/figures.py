"""Figures of a surface, and of a scan beside its models."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fitting.statistics_histogram import Histogram

__all__ = ["histogram_figure", "new_figure", "scan_figure"]

# Colours that stay apart in print and for colour-blind eyes (Okabe and Ito)
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
QUANTITIES = {"M00": "M00 [1/sr]", "M10": "M10 [1/sr]", "DOLP": "DOLP [1]"}


def new_figure(rows: int, columns: int, size: tuple[float, float]) -> "tuple[Figure, Any]":
    """Return a figure that belongs to no window system, and its axes as a 2-D array."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False)
    for axis in axes.flat:
        axis.spines[["top", "right"]].set_visible(False)
        axis.grid(alpha=0.25, linewidth=0.6)
    return figure, axes


def histogram_figure(histograms: "Sequence[Histogram]") -> "Figure":
    """Draw densities beside the Gaussian of the rms that was measured."""
    figure, axes = new_figure(1, len(histograms), (4.6 * len(histograms), 3.4))
    for axis, histogram in zip(axes.flat, histograms, strict=True):
        axis.stairs(
            histogram.density,
            histogram.edges,
            fill=True,
            color=COLOURS[5],
            alpha=0.55,
            label="measured",
        )
        x = np.linspace(histogram.edges[0], histogram.edges[-1], 400)
        label = f"Gaussian, rms {histogram.rms:.3g}"
        axis.plot(x, histogram.gaussian(x), color=COLOURS[1], label=label)
        axis.set(xlabel=f"{histogram.quantity} [{histogram.units}]", ylabel="density")
        axis.set_ylim(0.0, 1.3 * max(histogram.density.max(), histogram.gaussian(x).max()))
        axis.legend(frameon=False, fontsize="small", loc="upper left")
    return figure


def scan_figure(measured: xr.Dataset, curves: xr.Dataset) -> "Figure":
    """Draw M00, M10 and DOLP against view angle: measured, analytical and Monte Carlo.

    Parameters
    ----------
    measured : Dataset, dim geometry
        In-plane rows with theta_view [rad], theta_i [rad] and any of the quantities.
    curves : Dataset, dims theta_i, theta_view
        `analytic_*`, `monte_carlo_*` and `monte_carlo_*_stderr` of each quantity.
    """
    spread = _spans_decades(measured, curves)
    figure, axes = new_figure(2, len(QUANTITIES), (4.3 * len(QUANTITIES), 5.6))
    for column, (name, label) in enumerate(QUANTITIES.items()):
        upper, lower = axes[:, column]
        for colour, theta_i in zip(
            _cycle(curves.theta_i.size), curves.theta_i, strict=True
        ):
            scan = measured.isel(
                geometry=np.abs(measured.theta_i.values - float(theta_i)) < 1e-9
            )
            _draw_scan(upper, lower, name, scan, curves.sel(theta_i=theta_i), colour)
        upper.set_title(label, fontsize="medium")
        if name not in measured:
            upper.text(
                0.5,
                0.96,
                "not measured",
                transform=upper.transAxes,
                ha="center",
                va="top",
                fontsize="small",
                style="italic",
            )
        if name == "M00" and spread:
            upper.set_yscale("log")
        lower.axhline(0.0, color="0.4", linewidth=0.8)
        lower.set(xlabel="view angle [deg], + forward", xlim=(-90, 90))
        upper.set(xlim=(-90, 90))
        for axis in (upper, lower):
            axis.set_xticks(range(-90, 91, 30))
    axes[1, 0].set_ylabel("measured - model")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        loc="outside upper center",
        ncols=min(len(labels), 6),
        frameon=False,
        fontsize="small",
    )
    return figure


def _cycle(count: int) -> list[str]:
    return [COLOURS[index % len(COLOURS)] for index in range(count)]


def _spans_decades(measured: xr.Dataset, curves: xr.Dataset) -> bool:
    values = measured["M00"].values if "M00" in measured else curves["analytic_M00"].values
    values = values[values > 0.0]
    return bool(values.size) and float(values.max() / np.median(values)) > 30.0


def _draw_scan(
    upper: "Axes",
    lower: "Axes",
    name: str,
    scan: xr.Dataset,
    curve: xr.Dataset,
    colour: str,
) -> None:
    """Draw one incidence: points, both models, and what the points lack of each model."""
    incidence = f"{np.rad2deg(float(curve.theta_i)):.4g}°"
    view = np.rad2deg(curve.theta_view.values)
    models = {"monte_carlo": ("Monte Carlo", "-"), "analytic": ("analytical", "--")}
    for model, (label, style) in models.items():
        if f"{model}_{name}" not in curve:
            continue
        upper.plot(
            view,
            curve[f"{model}_{name}"],
            style,
            color=colour,
            linewidth=1.3,
            label=f"{label} {incidence}",
        )
        if f"{model}_{name}_stderr" in curve:
            value, error = curve[f"{model}_{name}"], 1.96 * curve[f"{model}_{name}_stderr"]
            upper.fill_between(
                view, value - error, value + error, color=colour, alpha=0.2, linewidth=0
            )
    if name not in scan or not scan.sizes["geometry"]:
        return
    at = np.rad2deg(scan.theta_view.values)
    error = scan[f"{name}_stderr"].values if f"{name}_stderr" in scan else None
    upper.errorbar(
        at,
        scan[name],
        error,
        fmt="o",
        markersize=2.6,
        elinewidth=0.7,
        color=colour,
        mfc="white",
        mew=0.8,
        label=f"measured {incidence}",
        zorder=3,
    )
    for model, (_, style) in models.items():
        if f"{model}_{name}" not in curve:
            continue
        order = np.argsort(at)
        model_here = np.interp(at[order], view, curve[f"{model}_{name}"])
        lower.plot(
            at[order],
            scan[name].values[order] - model_here,
            style,
            color=colour,
            linewidth=1.0,
            marker="." if style == "-" else None,
            markersize=3,
        )
