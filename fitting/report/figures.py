"""Figures of a surface, of a scan beside its models, and of a simulated hemisphere."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fitting.statistics.histogram import Histogram

__all__ = ["hemisphere_figure", "histogram_figure", "new_figure", "scan_figure"]

# Colours that stay apart in print and for colour-blind eyes (Okabe and Ito)
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
# The ratio keeps its sign: noise lifts a DOLP, which has none
QUANTITIES = {"M00": "M00 [1/sr]", "M10": "M10 [1/sr]", "m10": "M10/M00 [1]"}
# Label, line style, and colour where one incidence leaves colours for the models
MODELS = {
    "monte_carlo": ("Monte Carlo", "-", COLOURS[0]),
    "analytic": ("analytical", "--", COLOURS[1]),
}


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


def scan_figure(measured: xr.Dataset, curves: xr.Dataset | None = None) -> "Figure":
    """Draw M00, M10 and their ratio against view angle: measured, analytical, Monte Carlo.

    A scan that has a DOLP only is drawn with that.

    Parameters
    ----------
    measured : Dataset, dim geometry
        In-plane rows with theta_view [rad], theta_i [rad] and any of the quantities.
    curves : Dataset, dims theta_i, theta_view, optional
        `analytic_*`, `monte_carlo_*` and `monte_carlo_*_stderr` of each quantity.
    """
    measured, quantities = _with_ratio(measured)
    incidences = np.unique(measured.theta_i.values.round(9))
    rows = 1 if curves is None else 2
    decades = "M00" in measured and _spans_decades(measured["M00"].values)
    figure, axes = new_figure(rows, len(quantities), (4.3 * len(quantities), 2.8 * rows))
    for column, (name, label) in enumerate(quantities.items()):
        upper = axes[0, column]
        for position, theta_i in enumerate(incidences):
            scan = measured.isel(geometry=np.abs(measured.theta_i.values - theta_i) < 1e-8)
            colour = COLOURS[position % len(COLOURS)] if incidences.size > 1 else None
            if curves is not None:
                curve = curves.sel(theta_i=theta_i, method="nearest")
                _draw_curves(upper, name, curve, colour)
                relative = decades and name == "M00"
                _draw_residuals(axes[1, column], name, scan, curve, colour, relative)
            _draw_points(upper, name, scan, colour)
        upper.set_title(label, fontsize="medium")
        if name not in measured:
            upper.text(
                0.5, 0.96, "not measured", transform=upper.transAxes, ha="center", va="top",
                fontsize="small", style="italic",
            )  # fmt: skip
            if rows == 2:
                axes[1, column].set_visible(False)
        elif name == "M00" and decades:
            upper.set_yscale("log")
    for axis in axes.flat:
        axis.set(xlim=(-90, 90), xticks=range(-90, 91, 30))
    for axis in axes[-1]:
        axis.set_xlabel("view angle [deg], + forward")
    if rows == 2:
        axes[1, 0].set_ylabel("measured / model - 1" if decades else "measured - model")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    columns = min(len(labels), 6)
    figure.legend(
        handles, labels, loc="outside upper center", ncols=columns, frameon=False,
        fontsize="small",
    )  # fmt: skip
    return figure


def hemisphere_figure(simulation: xr.Dataset, theta_i: float) -> "Figure":
    """Draw M00, M10 and DOLP of a simulation over the hemisphere, forward to the right.

    Parameters
    ----------
    simulation : Dataset
        What `pbrdf.simulate` returns.
    theta_i : float
        Which incidence; the nearest one is drawn. [rad]
    """
    from matplotlib.figure import Figure

    here = simulation.brdf_total.sel(theta_i=theta_i, method="nearest")
    here = here.transpose("theta_s", "dphi", "stokes_out", "stokes_in")
    step = here.theta_s.values[0]
    zenith = np.rad2deg(np.append(here.theta_s.values - step, np.pi / 2))
    # Bins are centred on dphi = 0; forward, dphi = pi, is drawn to the right
    width = 2.0 * np.pi / here.dphi.size
    azimuth = np.append(here.dphi.values, 2.0 * np.pi) - 0.5 * width + np.pi
    panels = list(_hemisphere_panels(here))
    figure = Figure(figsize=(4.2 * len(panels), 3.9), layout="constrained")
    for column, (title, values, colours, limits) in enumerate(panels):
        axis = figure.add_subplot(1, len(panels), column + 1, projection="polar")
        image = axis.pcolormesh(
            azimuth, zenith, values, cmap=colours, vmin=limits[0], vmax=limits[1]
        )
        axis.set(title=title, xticklabels=[], yticks=(30, 60), rlabel_position=90)
        axis.grid(alpha=0.3)
        figure.colorbar(image, ax=axis, shrink=0.75)
    angle = np.rad2deg(float(here.theta_i))
    figure.suptitle(f"incidence {angle:.4g}°, source on the left", fontsize="medium")
    return figure


def _hemisphere_panels(
    brdf: xr.DataArray,
) -> Iterator[tuple[str, np.ndarray, str, tuple[float, float]]]:
    """Yield title, values, colour map and limits of each panel."""
    m00 = brdf.sel(stokes_out="I", stokes_in="I").values
    yield "M00 [1/sr]", m00, "viridis", (0.0, float(np.percentile(m00, 99.5)))
    if "Q" not in brdf.stokes_out.values:
        return
    m10 = brdf.sel(stokes_out="Q", stokes_in="I").values
    m20 = brdf.sel(stokes_out="U", stokes_in="I").values
    reach = float(np.percentile(np.abs(m10), 99.5))
    yield "M10 [1/sr]", m10, "RdBu_r", (-reach, reach)
    with np.errstate(invalid="ignore"):
        yield "DOLP [1]", np.hypot(m10, m20) / m00, "viridis", (0.0, 1.0)


def _with_ratio(measured: xr.Dataset) -> tuple[xr.Dataset, dict[str, str]]:
    """Return the scan with M00, M10 and their ratio where they follow; what to draw."""
    if {"I_s", "I_p"} <= set(measured.data_vars) and "M00" not in measured:
        error = {}
        if {"I_s_stderr", "I_p_stderr"} <= set(measured.data_vars):
            both = np.hypot(measured.I_s_stderr, measured.I_p_stderr)
            error = {"M00_stderr": both, "M10_stderr": both}
        measured = measured.assign(
            M00=measured.I_s + measured.I_p, M10=measured.I_s - measured.I_p, **error
        )
    if "m10" not in measured and {"M00", "M10"} <= set(measured.data_vars):
        lit = measured.M00.where(measured.M00 > 0.0)
        measured = measured.assign(m10=measured.M10 / lit)
        if "M10_stderr" in measured:
            measured["m10_stderr"] = measured.M10_stderr / lit
    if "DOLP" in measured and "m10" not in measured:
        names = {name: label for name, label in QUANTITIES.items() if name != "m10"}
        return measured, names | {"DOLP": "DOLP [1]"}
    return measured, QUANTITIES


def _spans_decades(values: np.ndarray) -> bool:
    values = values[values > 0.0]
    return bool(values.size) and float(values.max() / np.median(values)) > 30.0


def _models_of(curve: xr.Dataset) -> dict[str, tuple[str, str, str]]:
    return {model: look for model, look in MODELS.items() if f"{model}_M00" in curve}


def _incidence(dataset: xr.Dataset) -> str:
    return f"{np.rad2deg(float(np.mean(dataset.theta_i))):.4g}°"


def _draw_curves(axis: "Axes", name: str, curve: xr.Dataset, colour: str | None) -> None:
    """Draw both models of one incidence, with the 95 % band of the simulation."""
    view = np.rad2deg(curve.theta_view.values)
    for model, (label, style, own) in _models_of(curve).items():
        value = curve[f"{model}_{name}"]
        axis.plot(
            view, value, style, color=colour or own, linewidth=1.3,
            label=f"{label} {_incidence(curve)}",
        )  # fmt: skip
        if f"{model}_{name}_stderr" in curve:
            error = 1.96 * curve[f"{model}_{name}_stderr"]
            axis.fill_between(
                view,
                value - error,
                value + error,
                color=colour or own,
                alpha=0.2,
                linewidth=0,
            )


def _draw_points(axis: "Axes", name: str, scan: xr.Dataset, colour: str | None) -> None:
    if name not in scan:
        return
    error = scan[f"{name}_stderr"].values if f"{name}_stderr" in scan else None
    axis.errorbar(
        np.rad2deg(scan.theta_view.values), scan[name].values, error,
        fmt="o", markersize=2.6, elinewidth=0.7, color=colour or "0.3", mfc="white",
        mew=0.8, label=f"measured {_incidence(scan)}", zorder=3,
    )  # fmt: skip


def _draw_residuals(
    axis: "Axes",
    name: str,
    scan: xr.Dataset,
    curve: xr.Dataset,
    colour: str | None,
    relative: bool,
) -> None:
    """Draw what the points of one incidence show beyond each model."""
    axis.axhline(0.0, color="0.4", linewidth=0.8)
    if name not in scan:
        return
    at = scan.theta_view.values
    for model, (_, style, own) in _models_of(curve).items():
        there = np.interp(at, curve.theta_view.values, curve[f"{model}_{name}"].values)
        lacking = scan[name].values - there
        axis.plot(
            np.rad2deg(at), lacking / there if relative else lacking, style,
            color=colour or own, linewidth=1.0,
            marker="." if style == "-" else None, markersize=3,
        )  # fmt: skip
