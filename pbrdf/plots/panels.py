"""What the panels of a figure of hemispheres show: elements, errors, differences."""

from collections.abc import Hashable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from pbrdf.derived.elements import Element, element, mueller
from pbrdf.plots.sheet import state_words

__all__ = ["Panel", "rows_of"]

# Cells that send out so much of what the brightest one does carry the light
_CARRIES = 0.2


class Panel(NamedTuple):
    """A hemisphere, each array of shape (theta_s, dphi); `bright` cells carry the light."""

    name: str
    title: str
    value: np.ndarray
    error: np.ndarray | None
    bright: np.ndarray | None


class _Part(NamedTuple):
    """An element of one state, and where that state is bright."""

    value: xr.DataArray
    stderr: xr.DataArray | None
    bright: xr.DataArray

    def of(self, state: str) -> "_Part":
        """Return that of one state."""
        error = None if self.stderr is None else self.stderr.sel(state=state)
        return _Part(self.value.sel(state=state), error, self.bright.sel(state=state))


def rows_of(
    here: xr.Dataset, elements: Sequence[str], errors: bool, minus: Hashable | None
) -> list[list[Panel]]:
    """Return the panels of one hemisphere, or of its states, row by row.

    Raises
    ------
    ValueError
        If the result has no such element, state or error.
    """
    bright = _bright(here)
    found = {name: _Part(*_known(name, element(here, name)), bright) for name in elements}
    if "state" in mueller(here)[0].dims:
        return list(_rows_of_states(here, found, errors, minus))
    if minus is not None:
        msg = f"minus must be left out of a result without states, got {minus!r}."
        raise ValueError(msg)
    rows = [[_panel(name, name, one) for name, one in found.items()]]
    if errors:
        rows.append([_error_panel(n, f"error of {n}", one) for n, one in found.items()])
    return rows


def _rows_of_states(
    here: xr.Dataset, found: dict[str, _Part], errors: bool, minus: Hashable | None
) -> Iterator[list[Panel]]:
    """Yield a row an element, one of its errors, one of differences and one of theirs."""
    words = state_words(here)
    if minus is not None and minus not in words:
        msg = f"minus must be one of {', '.join(words)}, got {minus!r}."
        raise ValueError(msg)
    for name, one in found.items():
        parts = {s: one.of(s) for s in words}
        titles = {s: f"{name}, {words[s]}" for s in words}
        yield [_panel(name, titles[s], p) for s, p in parts.items()]
        if errors:
            yield [_error_panel(name, f"error of {titles[s]}", parts[s]) for s in parts]
        if minus is None:
            continue
        base = parts[str(minus)]
        rest = {
            f"{titles[s]} minus {words[str(minus)]}": _difference(p, base)
            for s, p in parts.items()
            if s != minus
        }
        yield [_panel(f"difference of {name}", title, p) for title, p in rest.items()]
        if errors:
            yield [
                _error_panel(f"difference of {name}", f"error of {title}", p)
                for title, p in rest.items()
            ]


def _bright(here: xr.Dataset) -> xr.DataArray:
    """Return where the hemisphere of a state sends most of its light, beyond its error."""
    m00 = element(here, "M00")
    flux = m00.value * np.sin(2.0 * m00.value.theta_s)
    if m00.stderr is not None:
        flux = flux.where(m00.value >= 2.0 * m00.stderr, 0.0)
    return (flux > 0.0) & (flux >= _CARRIES * flux.max(("theta_s", "dphi")))


def _known(name: str, one: Element) -> Element:
    """Leave out polarisation of which nothing is known, where M00 is lost in its error."""
    if name[0] == "M" or one.stderr is None:
        return one
    return Element(one.value.where(one.stderr.notnull()), one.stderr)


def _difference(one: _Part, base: _Part) -> _Part:
    """Subtract; errors are taken as independent, which common surfaces make too large."""
    error: Any = None
    if one.stderr is not None and base.stderr is not None:
        error = np.hypot(one.stderr, base.stderr)
    change = one.value - base.value
    if one.value.attrs.get("units") == "rad":
        # Directions of a line: the shorter way round
        change = (change + np.pi / 2) % np.pi - np.pi / 2
    return _Part(change.assign_attrs(one.value.attrs), error, one.bright & base.bright)


def _panel(name: str, title: str, one: _Part) -> Panel:
    order = ("theta_s", "dphi")
    value = one.value.transpose(*order).values
    error = None if one.stderr is None else one.stderr.transpose(*order).values
    if one.value.attrs.get("units") == "rad":
        value = np.rad2deg(value)
        error = None if error is None else np.rad2deg(error)
    unit = {"sr-1": "1/sr", "rad": "deg"}.get(str(one.value.attrs["units"]), "1")
    bright = one.bright.transpose(*order).values
    return Panel(name, f"{title} [{unit}]", value, error, bright)


def _error_panel(name: str, title: str, one: _Part) -> Panel:
    if one.stderr is None:
        msg = f"the result holds no errors of {name}. Leave errors out."
        raise ValueError(msg)
    shown = _panel(name, title, one)
    assert shown.error is not None
    return Panel(f"error of {name}", shown.title, shown.error, None, None)
