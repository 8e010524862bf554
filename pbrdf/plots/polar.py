"""The hemisphere in polar plots: forward to the right, the source on the left."""

from collections.abc import Hashable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from pbrdf.derived.elements import Element, element, folded, mueller
from pbrdf.derived.places import choose, in_words
from pbrdf.plots.disc import Panel, colour_bar, draw_disc
from pbrdf.plots.limits import look_of
from pbrdf.plots.sheet import beam_of, lay_out, scene_of, small, title_of, width

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
    known are grey. The largest value that is known to a fifth of itself sets the scale.

    Parameters
    ----------
    result : Dataset
        Of `simulate` or `compare_dew`; a comparison is drawn with a column a state.
    elements : sequence of str
        M00 ... M33, DOLP, AOLP.
    errors : bool
        Add a panel with the standard error of each.
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
    rows = _rows(here, elements, errors, minus)
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
        heading = "\n".join(
            line
            for line in (
                title_of(here) + (", folded about the plane" if mirrored else ""),
                scene_of(here),
                beam_of(here).replace(" (dotted)", ""),
                note if inches > 4.5 else note.replace("   hatched", "\nhatched"),
            )
            if line
        )
        figure.suptitle(heading)
    # Its ticks are the same at any size
    lay_out(figure, rounds=1)
    return figure


def _rows(
    here: xr.Dataset, elements: Sequence[str], errors: bool, minus: Hashable | None
) -> list[list[Panel]]:
    """Panels (name, title, values, errors), row by row."""
    found = {name: element(here, name) for name in elements}
    if "state" not in mueller(here)[0].dims:
        if minus is not None:
            msg = f"minus must be left out of a result without states, got {minus!r}."
            raise ValueError(msg)
        rows = [[_panel(name, name, one) for name, one in found.items()]]
        if errors:
            rows.append([_error_panel(n, f"error of {n}", one) for n, one in found.items()])
        return rows
    states = [str(s) for s in here.state.values]
    rows = []
    for name, one in found.items():
        parts = {s: _at(one, state=s) for s in states}
        rows.append([_panel(name, f"{name}, {s}", p) for s, p in parts.items()])
        if errors:
            rows.append(
                [_error_panel(name, f"error of {name}, {s}", p) for s, p in parts.items()]
            )
        if minus is not None:
            if minus not in parts:
                msg = f"minus must be one of {', '.join(states)}, got {minus!r}."
                raise ValueError(msg)
            base = parts[str(minus)]
            rows.append(
                [
                    _panel("difference", f"{name}, {s} minus {minus}", _difference(p, base))
                    for s, p in parts.items()
                    if s != minus
                ]
            )
    return rows


def _at(one: Element, **place: Any) -> Element:
    error = None if one.stderr is None else one.stderr.sel(place)
    return Element(one.value.sel(place), error)


def _difference(one: Element, base: Element) -> Element:
    """Subtract; errors are taken as independent, which common surfaces make too large."""
    error: Any = None
    if one.stderr is not None and base.stderr is not None:
        error = np.hypot(one.stderr, base.stderr)
    return Element((one.value - base.value).assign_attrs(one.value.attrs), error)


def _panel(name: str, title: str, one: Element) -> Panel:
    value = one.value.transpose("theta_s", "dphi").values
    error = None if one.stderr is None else one.stderr.transpose("theta_s", "dphi").values
    if one.value.attrs.get("units") == "rad":
        value = np.rad2deg(value)
        error = None if error is None else np.rad2deg(error)
    unit = {"sr-1": "1/sr", "rad": "deg"}.get(str(one.value.attrs["units"]), "1")
    return name, f"{title} [{unit}]", value, error


def _error_panel(name: str, title: str, one: Element) -> Panel:
    if one.stderr is None:
        msg = f"the result holds no errors of {name}. Leave errors out."
        raise ValueError(msg)
    _, heading, _, error = _panel(name, title, one)
    assert error is not None
    return f"error of {name}", heading, error, None


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
        offset = columns - len(row) if row[0][0][0] == "difference" else 0
        axes, images = [], []
        for place, ((name, title, value, error), look) in enumerate(row):
            at = number * columns + place + offset + 1
            axis = figure.add_subplot(len(rows), columns, at, projection="polar")
            words = title.replace(", ", ",\n") if len(title) > _LETTERS * side else title
            images.append(draw_disc(axis, (name, words, value, error), look, incidence))
            axes.append(axis)
        if _alike([panel for panel, _ in row]):
            colour_bar(figure, axes, images[0], row[0][1])
        else:
            for axis, image, (_, look) in zip(axes, images, row, strict=True):
                colour_bar(figure, [axis], image, look)
    return figure


def _alike(row: list[Panel]) -> bool:
    """Whether the panels of a row show one element, on one scale."""
    return len(row) > 1 and len({name for name, *_ in row}) == 1


def _shared_looks(rows: list[list[Panel]], scale: str) -> list[list[Any]]:
    """Panels of a row that show one element share limits and colours."""
    looks = []
    for row in rows:
        if not _alike(row):
            looks.append([look_of(n, v, e, scale) for n, _, v, e in row])
            continue
        values = np.stack([v for _, _, v, _ in row])
        kept = [e for *_, e in row if e is not None]
        error = np.stack(kept) if len(kept) == len(row) else None
        looks.append([look_of(row[0][0], values, error, scale)] * len(row))
    return looks
