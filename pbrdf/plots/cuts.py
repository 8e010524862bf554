"""Cuts of a result in the plane of incidence, with bands of two standard errors."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from pbrdf.derived.elements import element, mueller
from pbrdf.derived.places import choose, in_words
from pbrdf.derived.plane import in_plane
from pbrdf.plots.limits import reach_of
from pbrdf.plots.sheet import (
    COLOURS,
    beam_of,
    in_lines,
    new_figure,
    point_of,
    scene_of,
    small,
    state_words,
    width,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["plane_cuts"]

# What a dimension is called on the sheet
_SPOKEN = {
    "theta_i": "incidence", "wavelength": "wavelength", "phi_i": "azimuth of the source",
    "state": "state",
}  # fmt: skip
# Less of the values than this part beyond three errors is chance
_CHANCE = 0.02
_CURVES = ("theta_view", "stokes_out", "stokes_in")


def plane_cuts(
    result: xr.Dataset,
    elements: Sequence[str] = ("M00", "M10", "DOLP"),
    *,
    scale: str = "auto",
    width_mm: float = 170.0,
    places: Mapping[str, Any] | None = None,
    **further: Any,
) -> "Figure":
    """Draw elements in the plane of incidence against view angle, forward to the right.

    Every incidence, wavelength and state that is not chosen is a curve. Bands are two
    standard errors; a line breaks where nothing is known.

    Parameters
    ----------
    result : Dataset
        Of `simulate` or `compare_dew`.
    elements, scale, width_mm, places
        As of `hemisphere`.
    """
    from matplotlib import rc_context

    here = choose(result, {**(places or {}), **further})
    single = [d for d in mueller(here)[0].dims if d in _SPOKEN and here.sizes[d] == 1]
    # What has one value stands in the title
    here = here.isel(dict.fromkeys(single, 0))
    cut = in_plane(here)
    curves = [str(d) for d in mueller(cut)[0].dims if d not in _CURVES]
    with rc_context(small()):
        inches = width(width_mm)
        columns = min(len(elements), 3 if inches > 4.5 else 1)
        columns = 2 if columns == 3 and len(elements) == 4 else columns
        rows = -(-len(elements) // columns)
        figure, axes = new_figure(rows, columns, (inches, 2.1 * rows + 0.6))
        for axis in axes.flat[len(elements) :]:
            axis.set_visible(False)
        for axis, name in zip(axes.flat, elements, strict=False):
            value, error = _draw_curves(axis, name, here, cut, curves)
            _scaled(axis, name, value, error, scale)
            unit = {"DOLP": "1", "AOLP": "deg"}.get(name, "1/sr")
            axis.set_title(f"{name} [{unit}]")
            axis.set(
                xlim=(-90, 90),
                xticks=range(-90, 91, 30),
                xlabel="view angle [deg], + forward",
            )
        handles, labels = axes.flat[0].get_legend_handles_labels()
        if len(labels) > 1:
            figure.legend(
                handles, labels, loc="outside lower center", ncols=4 if inches > 4.5 else 2,
                frameon=False, title=" and ".join(_SPOKEN.get(d, d) for d in curves),
            )  # fmt: skip
        chosen = [
            f"{spoken} {in_words(name, here[name].values, 4)}"
            for name, spoken in _SPOKEN.items()
            if name in here.coords and here[name].ndim == 0
        ]
        note = "★ source   + specular   bands: 2 standard errors"
        lines = [", ".join(chosen), point_of(here), scene_of(here), beam_of(here), note]
        figure.suptitle(in_lines(lines, inches))
    return figure


def _draw_curves(
    axis: Any, name: str, here: xr.Dataset, cut: xr.Dataset, curves: list[str]
) -> tuple[np.ndarray, np.ndarray | None]:
    """Draw an element with its bands; return values and errors (one each curve, view)."""
    found = element(cut, name)
    factor = 180 / np.pi if name == "AOLP" else 1.0
    order = (*curves, "theta_view")
    value = factor * found.value.transpose(*order).values
    error = None
    if found.stderr is not None:
        error = factor * found.stderr.transpose(*order).values
        if name in ("DOLP", "AOLP"):
            # Unknown where M00 is lost in its error
            value = np.where(np.isfinite(error), value, np.nan)
    words = state_words(here) if "state" in here.dims else {}
    view = np.rad2deg(cut.theta_view.values)
    for k, place in enumerate(np.ndindex(value.shape[:-1])):
        label = ", ".join(
            words.get(str(cut[d].values[i]), in_words(d, cut[d].values[i], 4))
            for d, i in zip(curves, place, strict=True)
        )
        colour = COLOURS[k % len(COLOURS)]
        style = ("-", "--", ":", "-.")[k // len(COLOURS) % 4]
        # A line would run from 90 to -90 degrees, which are one
        style = "." if name == "AOLP" else style
        axis.plot(view, value[place], style, color=colour, lw=1.0, label=label)
        at = dict(zip(curves, place, strict=True))
        _mark_incidence(axis, here, at, colour)
        _mark_beam(axis, here, at, colour)
        if error is not None and name == "AOLP":
            axis.errorbar(
                view, value[place], 2 * error[place], fmt="none", ecolor=colour,
                elinewidth=0.5, alpha=0.5,
            )  # fmt: skip
        elif error is not None:
            axis.fill_between(
                view, value[place] - 2 * error[place],
                value[place] + 2 * error[place], color=colour, alpha=0.22, lw=0,
            )  # fmt: skip
    return value, error


def _mark_incidence(
    axis: Any, here: xr.Dataset, place: dict[str, int], colour: str
) -> None:
    """Mark the source and the specular angle of a curve at the foot of the panel."""
    if "theta_i" not in here.coords:
        return
    theta = here.theta_i.isel({k: i for k, i in place.items() if k in here.theta_i.dims})
    for sign, mark in ((-1, "*"), (1, "+")):
        axis.plot(
            sign * np.rad2deg(float(theta)), 0.03, mark, color=colour, markersize=5,
            transform=axis.get_xaxis_transform(), clip_on=False, zorder=5,
        )  # fmt: skip


def _mark_beam(axis: Any, here: xr.Dataset, place: dict[str, int], colour: str) -> None:
    """Draw a dotted line where a curve has its specular beam, which has no radiance."""
    if "coherent" not in here:
        return
    beam = here.coherent.isel(stokes_out=0, stokes_in=0)
    beam = beam.isel({name: i for name, i in place.items() if name in beam.dims})
    theta = here.theta_i.isel({k: i for k, i in place.items() if k in here.theta_i.dims})
    if float(beam) > 0.0:
        axis.axvline(np.rad2deg(float(theta)), ls=":", lw=0.9, color=colour)


def _scaled(
    axis: Any, name: str, value: np.ndarray, error: np.ndarray | None, scale: str
) -> None:
    """Set the scale of the ordinate, none that magnifies what is below the errors."""
    lit = np.abs(value[np.isfinite(value) & (value != 0)])
    if name == "AOLP":
        axis.set(ylim=(-95, 95), yticks=range(-90, 91, 45))
        return
    if not lit.size:
        return
    if name == "DOLP":
        top = reach_of(value, error)
        axis.set_ylim(-0.02, min(1.05, 1.15 * max(top, float(np.percentile(lit, 98)))))
        return
    top, noise = float(lit.max()), 0.0
    if error is not None and np.isfinite(error).any():
        noise = float(np.nanmedian(error))
        if np.nanmean(np.abs(value) > 3.0 * error) < _CHANCE:
            # Nothing stands out: a linear scale does not magnify it
            half = 1.2 * max(top, 2.0 * noise)
            axis.set_ylim(-half, half)
            return
    if scale == "auto":
        wide = top > 30 * np.median(lit)
        scale = "linear" if not wide else "log" if name == "M00" else "symlog"
    if scale == "log" and np.nanmin(value) >= 0:
        axis.set_yscale("log")
        axis.set_ylim(max(float(lit.min()) / 2, top / 1e6), 2 * top)
    elif scale in ("symlog", "log"):
        low = min(max(top / 1e3, noise), top / 10)
        whole = 10.0 ** np.arange(np.ceil(np.log10(low) + 1e-9), np.log10(top) + 1e-9)
        axis.set_yscale("symlog", linthresh=low, linscale=0.5)
        signed = np.nanmin(value) < -low
        axis.set_ylim(-2 * top if signed else -low, 2 * top)
        axis.set_yticks([*(-whole[::-1] if signed else ()), 0.0, *whole])
        axis.minorticks_off()
