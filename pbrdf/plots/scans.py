"""A scan beside its models: a panel an incidence and wavelength, residuals below."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from pbrdf.plots.sheet import COLOURS, SIZE, lay_out, new_figure, small, width

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["scan_figure"]

# The ratio keeps its sign: noise lifts a DOLP, which has none
_QUANTITIES = {"M00": "M00 [1/sr]", "M10": "M10 [1/sr]", "m10": "M10/M00 [1]"}
# Label, line style, colour and marker of each model
_MODELS = {
    "monte_carlo": ("Monte Carlo", "-", COLOURS[0], "o"),
    "analytic": ("analytical", "--", COLOURS[1], "x"),
    "waves": ("waves", "-.", COLOURS[2], "+"),
}
# A taller sheet than this many panels is cut, and says so
_MOST = 12
# A sheet wider than this has a column for each quantity [in]
_WIDE = 4.5
# Residuals beyond this are drawn logarithmically, with their sign
_FAR = 20.0


def scan_figure(
    measured: xr.Dataset,
    curves: xr.Dataset | None = None,
    *,
    width_mm: float = 170.0,
    label: str = "measured",
) -> "Figure":
    """Draw M00, M10 and their ratio against view angle: measured, analytical, Monte Carlo.

    Each incidence and wavelength has its own panels. Below, what the readings show beyond
    each curve: in standard errors (of reading and simulation) with a band of +-2, or where
    the scan gives no errors relative to the curve (M00) or as a difference. A scan that has
    a DOLP only is drawn with that.

    Parameters
    ----------
    measured : Dataset, dim geometry
        In-plane rows with theta_view [rad], theta_i [rad] and any of the quantities.
    curves : Dataset, dims theta_i, theta_view, optional
        `analytic_*`, `waves_*`, `monte_carlo_*`, `monte_carlo_*_stderr` of each quantity.
    width_mm : float
        Width that the figure is printed at; below 115 mm the quantities stand in a column.
        [mm]
    label : str
        What the rows are called, where they are no readings.
    """
    from matplotlib import rc_context

    with rc_context(small()):
        figure = _drawn(_in_the_plane(measured), curves, width(width_mm), label)
    lay_out(figure)
    return figure


def _in_the_plane(measured: xr.Dataset) -> xr.Dataset:
    """Leave out other azimuths at the zenith, which lies in every plane."""
    if "dphi" not in measured.coords:
        return measured
    apart = np.abs(np.sin(measured.dphi.values)) > 1e-6
    upright = np.abs(measured.theta_view.values) < 1e-6
    apart = np.broadcast_to(apart, upright.shape)
    # A scan may have no other row there
    if not (upright & ~apart).any():
        return measured
    return measured.isel(geometry=np.flatnonzero(~(upright & apart)))


def _drawn(
    measured: xr.Dataset, curves: xr.Dataset | None, inches: float, label: str
) -> "Figure":
    measured, names = _with_ratio(measured)
    names = {name: label for name, label in names.items() if name in measured}
    panels = list(_panels(measured))
    columns = len(names) if inches > _WIDE else 1
    most = _MOST * columns // max(len(names), 1)
    left_out = max(0, len(panels) - most)
    if left_out:
        keep = np.linspace(0, len(panels) - 1, most).round().astype(int)
        panels = [panels[k] for k in keep]
    per = 1 if curves is None else 2
    blocks = [(*panel, name) for panel in panels for name in names]
    rows = -(-len(blocks) // columns)
    heights = ([1.5, 0.95] if columns > 1 else [1.05, 0.65])[:per] * rows
    figure, axes = new_figure(
        per * rows, columns, (inches, sum(heights) + 0.5), height_ratios=heights
    )
    for number, (title, scan, name) in enumerate(blocks):
        row, column = divmod(number, columns)
        upper = axes[per * row, column]
        if curves is not None:
            angle = float(scan.theta_i.values[0])
            curve = curves.sel(theta_i=angle, method="nearest", tolerance=1e-6)
            _draw_curves(upper, name, curve)
            _draw_residuals(axes[per * row + 1, column], name, scan, curve)
            upper.tick_params(labelbottom=False)
        _draw_points(upper, name, scan, label)
        upper.set_title(f"{names[name]}" + ("\n" if columns > 1 else ", ") + title)
        if name == "M00" and _spans_decades(scan[name].values):
            # Down to the readings: a model may fall for ever
            lit = scan[name].values[scan[name].values > 0.0]
            upper.set(yscale="log", ylim=(0.3 * lit.min(), None))
        if name == "m10":
            # Where there is no light, noise over noise is no polarisation
            low, high = upper.get_ylim()
            upper.set_ylim(max(low, -1.1), min(high, 1.1))
    for axis in axes.flat:
        axis.set(xlim=(-90, 90), xticks=range(-90, 91, 45))
    for axis in axes[-1]:
        axis.set_xlabel("view angle [deg], + forward")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, frameon=False)
    missing = [n for n in _QUANTITIES if n not in names and n != "m10"]
    _note(figure, missing, left_out, len(panels))
    return figure


def _note(figure: "Figure", missing: list[str], left_out: int, drawn: int) -> None:
    """Say below the figure what it does not show."""
    notes = [f"not measured: {', '.join(missing)}"] if missing else []
    if left_out > 0:
        notes.append(f"{drawn} of {drawn + left_out} cuts are drawn")
    if notes:
        figure.supxlabel("; ".join(notes), fontsize=SIZE)


def _panels(measured: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield title and rows of each incidence and wavelength."""
    size = measured.sizes["geometry"]
    waves = np.full(size, -1.0)
    if "wavelength" in measured.coords:
        given = np.broadcast_to(measured.wavelength.values, (size,))
        waves = np.nan_to_num(given.round(9), nan=-1.0)
    theta_i = np.broadcast_to(measured.theta_i.values, (size,)).round(7)
    for wave, angle in np.unique(np.stack([waves, theta_i], axis=1), axis=0):
        rows = np.flatnonzero((waves == wave) & (theta_i == angle))
        title = f"incidence {np.rad2deg(angle):.4g}°"
        title += f", {wave:.4g} µm" if wave > 0 else ""
        yield title, measured.isel(geometry=rows)


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
        names = {name: label for name, label in _QUANTITIES.items() if name != "m10"}
        return measured, names | {"DOLP": "DOLP [1]"}
    return measured, _QUANTITIES


def _spans_decades(values: np.ndarray) -> bool:
    values = values[values > 0.0]
    return bool(values.size) and float(values.max() / np.median(values)) > 30.0


def _models_of(curve: xr.Dataset) -> dict[str, tuple[str, str, str, str]]:
    return {model: look for model, look in _MODELS.items() if f"{model}_M00" in curve}


def _draw_curves(axis: "Axes", name: str, curve: xr.Dataset) -> None:
    """Draw both models of one incidence, with the 95 % band of the simulation."""
    view = np.rad2deg(curve.theta_view.values)
    for model, (label, style, colour, _) in _models_of(curve).items():
        value = curve[f"{model}_{name}"]
        axis.plot(view, value, style, color=colour, linewidth=1.3, label=label)
        if f"{model}_{name}_stderr" in curve:
            error = 1.96 * curve[f"{model}_{name}_stderr"]
            axis.fill_between(
                view, value - error, value + error, color=colour, alpha=0.2, linewidth=0
            )


def _draw_points(axis: "Axes", name: str, scan: xr.Dataset, label: str) -> None:
    error = scan[f"{name}_stderr"].values if f"{name}_stderr" in scan else None
    axis.errorbar(
        np.rad2deg(scan.theta_view.values), scan[name].values, error,
        fmt="o", markersize=2.6, elinewidth=0.7, color="0.3", mfc="white", mew=0.8,
        label=label, zorder=3,
    )  # fmt: skip


def residuals(
    name: str, scan: xr.Dataset, curve: xr.Dataset, model: str
) -> tuple[np.ndarray, str]:
    """Return what readings show beyond a curve, and the unit of it.

    In standard errors of reading and simulation where the scan gives errors; without them
    relative to the curve for M00, and as the difference for others.
    """
    at, view = scan.theta_view.values, curve.theta_view.values

    def there(key: str) -> Any:
        return np.interp(at, view, curve[key].values, left=np.nan, right=np.nan)

    value = there(f"{model}_{name}")
    lacking = scan[name].values - value
    if f"{name}_stderr" in scan:
        error = scan[f"{name}_stderr"].values
        if f"{model}_{name}_stderr" in curve:
            error = np.hypot(error, there(f"{model}_{name}_stderr"))
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.where(error > 0, lacking / error, np.nan)
        if np.isfinite(found).any():
            return found, "standard errors"
    if name == "M00":
        return lacking / value, "measured / model - 1"
    return lacking, "measured - model"


def _draw_residuals(axis: "Axes", name: str, scan: xr.Dataset, curve: xr.Dataset) -> None:
    """Draw points, with a band of two standard errors where these are known."""
    axis.axhline(0.0, color="0.4", linewidth=0.8)
    view = np.rad2deg(scan.theta_view.values)
    far, unit = 0.0, ""
    for model, (_, _, colour, marker) in _models_of(curve).items():
        found, unit = residuals(name, scan, curve, model)
        axis.plot(view, found, marker, color=colour, markersize=3.0, mew=0.8)
        known = np.abs(found[np.isfinite(found)])
        far = max(far, float(known.max())) if known.size else far
    if unit == "standard errors":
        axis.axhspan(-2.0, 2.0, color="0.5", alpha=0.18, linewidth=0)
        if far > _FAR:
            axis.set_yscale("symlog", linthresh=2.0)
            top = 2.0 * far
            decades = [10.0**k for k in range(1, 9) if 10.0**k < top]
            axis.set_yticks([*(-d for d in decades[::-1]), -2, 2, *decades])
            axis.set_ylim(-top, top)
        else:
            axis.set_ylim(-max(3.0, 1.1 * far), max(3.0, 1.1 * far))
    axis.set_ylabel("std. errors" if unit == "standard errors" else unit)
