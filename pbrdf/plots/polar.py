"""The hemisphere in polar plots: forward to the right, the source on the left."""

from collections.abc import Hashable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from pbrdf.derived.elements import folded, mueller
from pbrdf.derived.places import choose, in_words
from pbrdf.plots.disc import colour_bar, draw_disc
from pbrdf.plots.limits import look_of
from pbrdf.plots.panels import Panel, rows_of
from pbrdf.plots.sheet import (
    beam_of,
    in_lines,
    lay_out,
    point_of,
    scene_of,
    small,
    title_of,
    width,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["hemisphere"]

_BINS = ("theta_s", "dphi", "stokes_out", "stokes_in")
# Width over height of a panel with its colour bar
_SHAPE = 0.80
# Narrowest panel whose labels do not run into each other [in]
_LEAST = 40.0 / 25.4
# So many letters fit above a panel [1/in]
_LETTERS = 16.0
_Look = tuple[Panel, Any]


def hemisphere(
    result: xr.Dataset,
    elements: Sequence[str] = ("M00", "M10", "DOLP"),
    *,
    errors: bool = False,
    minus: Hashable | None = None,
    scale: str = "auto",
    fold: bool = True,
    width_mm: float = 170.0,
    places: Mapping[str, Any] | None = None,
    **further: Any,
) -> "Figure":
    """Draw elements of a result over the hemisphere.

    Cells that are smaller than two standard errors are hatched; cells of which nothing is
    known are grey, as DOLP and AOLP are where M00 is below two standard errors. The largest
    value sets the scale of those known to a fifth of themselves and those of the bins that
    carry the light, a fifth or more of what the brightest one does.

    Parameters
    ----------
    result : Dataset
        Of `simulate` or `compare_dew`; a comparison is drawn with a column a state.
    elements : sequence of str
        M00 ... M33, DOLP, AOLP.
    errors : bool
        Add a panel with the standard error of each, of a difference too.
    minus : str, optional
        Of a comparison: add rows of every other state minus this one, as "dry".
    scale : {"auto", "linear", "log", "symlog"}
        Of the colours of M00 ... M33; auto is logarithmic where decades are spanned.
    fold : bool
        Average with the mirror image where the scene is isotropic; the title says so.
    width_mm : float
        Width that the figure is printed at, 85 or 170; letters stay 7 pt. [mm]
    places : mapping, optional
        theta_i [rad], wavelength [um] and further dimensions, as computed. Also as
        keyword arguments.

    Returns
    -------
    Figure

    Raises
    ------
    ValueError
        If a place was not computed, or must be chosen and is not.
    """
    from matplotlib import rc_context

    here = choose(result, {**(places or {}), **further})
    value, _ = mueller(here)
    open_ends = [d for d in value.dims if d not in (*_BINS, "state")]
    for name in [d for d in open_ends if value.sizes[d] == 1]:
        here = here.isel({name: 0})
        open_ends.remove(name)
    if open_ends:
        listed = "; ".join(
            f"{d} of {', '.join(in_words(str(d), v) for v in result[d].values)}"
            for d in open_ends
        )
        msg = f"a hemisphere must be chosen by {listed}."
        raise ValueError(msg)
    here, mirrored = folded(here) if fold else (here, False)
    rows = rows_of(here, elements, errors, minus)
    inches = width(width_mm)
    # No narrower than labels need
    fit = max(1, int(inches / _LEAST))
    looks = _shared_looks(rows, scale)
    drawn = [
        list(zip(row, look, strict=True)) for row, look in zip(rows, looks, strict=True)
    ]
    if "state" in mueller(here)[0].dims:
        drawn = [row[k : k + fit] for row in drawn for k in range(0, len(row), fit)]
    else:
        drawn = [row[k : k + fit] for k in range(0, len(rows[0]), fit) for row in drawn]
    with rc_context(small()):
        figure = _drawn(here, drawn, inches)
        note = "★ source   + specular   hatched: below 2 standard errors"
        note = note if inches > 4.5 else note.replace("   hatched", ", hatched")
        heading = [
            title_of(here) + (", folded about the plane" if mirrored else ""),
            point_of(here),
            scene_of(here),
            beam_of(here).replace(" (dotted)", ""),
            note,
        ]
        figure.suptitle(in_lines(heading, inches))
    # Its ticks are the same at any size
    lay_out(figure, rounds=1)
    return figure


def _drawn(here: xr.Dataset, rows: list[list[_Look]], inches: float) -> "Figure":
    from matplotlib.figure import Figure

    columns = max(len(row) for row in rows)
    side = inches / columns
    figure = Figure(
        figsize=(inches, side / _SHAPE * len(rows) + 0.55), layout="constrained"
    )
    incidence = float(np.rad2deg(here.theta_i))
    for number, row in enumerate(rows):
        # A difference stands below what it is of; the state that is taken off has none
        apart = "difference" in row[0][0].name
        offset = columns - len(row) if apart else 0
        axes, images = [], []
        for place, (panel, look) in enumerate(row):
            at = number * columns + place + offset + 1
            axis = figure.add_subplot(len(rows), columns, at, projection="polar")
            shown = panel._replace(title=_in_lines(panel.title, _LETTERS * side))
            images.append(draw_disc(axis, shown, look, incidence))
            axes.append(axis)
        if _shared([panel for panel, _ in row], rows, row[0][1]):
            # Rows on one scale have the same labels
            alike = [len(one) for one in rows if one[0][1] is row[0][1]]
            room = side * min(alike)
            colour_bar(figure, axes, images[0], row[0][1], min(alike), room)
        else:
            for axis, image, (_, look) in zip(axes, images, row, strict=True):
                colour_bar(figure, [axis], image, look, 1, side)
    return figure


def _in_lines(title: str, room: float) -> str:
    """Break a title that is wider than its panel."""
    if len(title) <= room:
        return title
    lines = title.replace(", ", ",\n").replace(" minus ", "\nminus ").split("\n")
    return "\n".join(lines)


def _alike(row: list[Panel]) -> bool:
    """Whether the panels of a row show one element, on one scale."""
    return len(row) > 1 and len({panel.name for panel in row}) == 1


def _shared(row: list[Panel], rows: list[list[_Look]], look: Any) -> bool:
    """Whether a row has one bar: of one scale, or the rest of a row that has."""
    return _alike(row) or sum(one[0][1] is look for one in rows) > 1


def _shared_looks(rows: list[list[Panel]], scale: str) -> list[list[Any]]:
    """Panels of a row that show one element share limits and colours."""
    looks = []
    for row in rows:
        if not _alike(row):
            looks.append(
                [look_of(p.name, p.value, p.error, scale, bright=p.bright) for p in row]
            )
            continue
        values = np.stack([p.value for p in row])
        error, bright = _stacked([p.error for p in row]), _stacked([p.bright for p in row])
        look = look_of(row[0].name, values, error, scale, bright=bright)
        looks.append([look] * len(row))
    return looks


def _stacked(arrays: list[np.ndarray | None]) -> np.ndarray | None:
    kept = [one for one in arrays if one is not None]
    return np.stack(kept) if len(kept) == len(arrays) else None
