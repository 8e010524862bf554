"""Which columns of a table hold a profile, and in which units.

It comes from the names over the columns and their units, or from the caller.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from data_io.text.text import Line, Rows
from data_io.text.units import (
    axis_units,
    header_units,
    normalise_unit,
    sole_unit,
    unit_kind,
    unit_size,
    warn_missing_unit,
)
from data_io.topography.column_names import Column, name_columns, table_width
from pbrdf.errors import DataFileError

Columns = str | Sequence[str | int]

_NO_HEIGHTS = re.compile(
    r"\b(slopes?|gradients?|steigung|neigung|intensity|[uµμnm]rad|arcsec)\b", re.IGNORECASE
)
# What units of slopes measure
SLOPES = ("angle", "ratio")
ASK = "Say which columns hold position and height by columns='1,2'."


@dataclass(frozen=True)
class ProfileColumns:
    """Where a profile stands in a table: position (None if evenly spaced) and value."""

    position: Column | None
    value: Column

    @property
    def is_slope(self) -> bool:
        """Whether the values are slopes, by their name or by their unit."""
        return self.value.role == "slope" or self.value.kind in SLOPES


def profile_columns(
    path: str | Path,
    header: list[Line],
    data: Rows,
    asked: Columns | None,
    *,
    unit_given: bool,
) -> ProfileColumns:
    """Find the columns of a profile by their names and units, or take those asked for.

    Raises
    ------
    DataFileError
        If the names do not say which columns hold the profile, or say that there is none.
    """
    columns = name_columns(header, data)
    width = table_width(data)
    if asked is not None:
        chosen = asked_columns(path, asked, columns, width)
        if len(chosen) > 2:
            problem = f"expected one or two columns for a profile, got {len(chosen)}"
            raise DataFileError(path, problem, ASK)
        value = chosen[-1]
        return ProfileColumns(chosen[0] if len(chosen) == 2 else None, value)
    line = header[-1].number if header else None
    if columns is None:
        said = next((m for h in header if (m := _NO_HEIGHTS.search(h.text))), None)
        if said and not unit_given:
            problem = f"expected columns with names, the header speaks of {said[0]!r} only"
            cure = "Head the columns, or say: columns='1,2' unit=('mm', 'urad')."
            raise DataFileError(path, problem, cure, line=line)
        plain = [Column(i, "", "", None) for i in range(width)]
        if width == 1:
            return ProfileColumns(None, plain[0])
        if width == 2:
            return ProfileColumns(plain[0], plain[1])
        problem = f"expected two columns, x and z, got {width} without names"
        cure = (
            "Head them x and z, or name them by columns=; commas separate columns, "
            "not decimals."
        )
        raise DataFileError(path, problem, cure, line=data.numbers[0])
    return _named(path, columns, line)


def _named(path: str | Path, columns: list[Column], line: int | None) -> ProfileColumns:
    """Choose position and value among columns with names."""
    kept = [c for c in columns if c.role not in ("index", "other")]
    heights = [c for c in kept if c.role == "z"]
    # Of several, those in counts or volts are none
    heights = [c for c in heights if c.kind != "other"] or heights
    slopes = [c for c in kept if c.role == "slope"]
    sides = {axis: [c for c in kept if c.role == axis] for axis in ("x", "y")}
    if not heights and not slopes and sides["x"] and sides["y"]:
        heights, sides["y"] = sides["y"], []
    positions = sides["x"] or sides["y"]
    nameless = [c for c in kept if not c.role]
    if len(columns) == 2 and not slopes:
        # One name says what the other must be, unless its unit says otherwise
        if not heights and positions and len(nameless) == 1 and nameless[0].unit:
            heights = nameless
        elif heights and not positions and nameless:
            positions = nameless
        elif len(nameless) == 2 and all(c.unit for c in nameless):
            positions, heights = nameless[:1], nameless[1:]
    values = heights or slopes
    for axis, found in (("x", positions), ("z", values)):
        if len(found) > 1:
            named = ", ".join(f"{c.name!r} ({c.place + 1})" for c in found)
            problem = f"expected one column {axis}, found {len(found)}: {named}"
            raise DataFileError(
                path, problem, "Choose by columns=, or remove the others.",
                line=line, column=axis,
            )  # fmt: skip
    if not values:
        named = ", ".join(repr(c.name) for c in columns)
        problem = f"expected a column of heights or slopes, the header names {named}"
        raise DataFileError(path, problem, ASK, line=line)
    chosen = ProfileColumns(positions[0] if positions else None, values[0])
    if chosen.position is None and any(c.role not in ("index", "z") for c in columns):
        named = ", ".join(repr(c.name) for c in columns)
        problem = f"expected a column of positions, the header names {named}"
        raise DataFileError(path, problem, ASK, line=line)
    _check_units(path, chosen, line)
    return chosen


def _check_units(path: str | Path, chosen: ProfileColumns, line: int | None) -> None:
    """Refuse units that contradict what the names say."""
    wanted = {"slope": (SLOPES, "a unit of angle, such as urad")}
    length = (("length",), "a length unit")
    pairs = [(chosen.value, wanted.get(chosen.value.role, length))]
    if chosen.position is not None:
        pairs.insert(0, (chosen.position, length))
    for column, (kinds, words) in pairs:
        slopes = column is chosen.value and column.role != "z" and column.kind in SLOPES
        if column.unit and column.kind not in kinds and not slopes:
            problem = f"expected {words}, got {column.unit!r}"
            cure = "Convert the column and head it with its unit, or choose by columns=."
            if normalise_unit(column.unit) == "in":
                cure = "Inches are written 'inch' here. Head the column so."
            raise DataFileError(path, problem, cure, line=line, column=column.name)


def asked_columns(
    path: str | Path, asked: Columns, columns: list[Column] | None, width: int
) -> list[Column]:
    """Return the columns asked for by number, from 1, or by name.

    Raises
    ------
    DataFileError
        If the table has no such column.
    """
    wanted = asked.split(",") if isinstance(asked, str) else list(asked)
    plain = columns or [Column(i, "", "", None) for i in range(width)]
    found = []
    for word in wanted:
        text = str(word).strip()
        named = [c for c in plain if c.name.lower() == text.lower()]
        if not named and text.isdigit() and 1 <= int(text) <= width:
            named = [plain[int(text) - 1]]
        if len(named) != 1:
            known = ", ".join(f"{c.place + 1} {c.name!r}".strip() for c in plain)
            problem = f"expected a column of the table, got {text!r}"
            raise DataFileError(path, problem, f"It has {known}.")
        found.append(named[0])
    return found


def stated_units(path: str | Path, header: list[Line]) -> tuple[str | None, str | None]:
    """Return the length units of x and z that lines of the header name in words."""
    texts = [line.text for line in header]
    by_axis = axis_units(path, texts)
    value = by_axis.get("z", by_axis.get("y"))
    if "x" in by_axis and value:
        return by_axis["x"], value
    for text in reversed(texts):
        units = header_units(text)
        if len(units) == 2:
            return units[0], units[1]
    common = sole_unit(path, texts)
    # The unit of one axis says nothing of the other
    return (by_axis.get("x"), value) if by_axis else (common, common)


def column_sizes(
    path: str | Path,
    header: list[Line],
    unit: str | tuple[str, str] | None,
    chosen: ProfileColumns,
) -> tuple[float, float, str]:
    """Return the size of the units of x [um] and of z [um] or slope, and what that is.

    It is ``length``, or for slopes ``angle`` [rad] or ``ratio`` [1].

    Raises
    ------
    DataFileError
        If a unit is missing, or contradicts the one given.
    """
    line = header[-1].number if header else None
    position, value = chosen.position, chosen.value
    named = (position.unit if position else None, value.unit)
    if not any(named):
        named = stated_units(path, header)
    pair = named if unit is None else _given_units(path, unit, named, line)
    kind = unit_kind(pair[1] or "")
    is_slope = value.role == "slope" or kind in SLOPES
    _check_kinds(path, pair, value, is_slope=is_slope, line=line)
    missing = [name is None for name in pair]
    if position is None:
        missing = missing[1:]
    if any(missing) and not all(missing):
        problem = f"expected a unit for both columns, the header names {pair[0] or pair[1]}"
        cure = "Head the columns, for example x_mm,z_um, or give unit=('mm', 'um')."
        raise DataFileError(path, problem, cure, line=line)
    if all(missing):
        warn_missing_unit(path, stacklevel=6)
    sizes = unit_size(pair[0] or "um"), unit_size(pair[1] or "um")
    return *sizes, kind if is_slope else "length"


def _given_units(
    path: str | Path,
    unit: str | tuple[str, str],
    named: tuple[str | None, str | None],
    line: int | None,
) -> tuple[str, str]:
    """Return the units that the caller gave, which may not contradict the header."""
    pair = (unit, unit) if isinstance(unit, str) else unit
    for stated, wanted in zip(named, pair, strict=True):
        if unit_size(wanted) and stated and unit_size(stated) != unit_size(wanted):
            words = ", ".join(name or "none" for name in named)
            problem = f"expected the unit given, {unit}, the header says {words}"
            cure = "Leave the argument out or mend the header."
            raise DataFileError(path, problem, cure, line=line)
    return pair


def _check_kinds(
    path: str | Path,
    pair: tuple[str | None, str | None],
    value: Column,
    *,
    is_slope: bool,
    line: int | None,
) -> None:
    """Refuse positions in radians, slopes in micrometres, heights in radians."""
    if unit_kind(pair[0] or "") in SLOPES:
        problem = f"expected positions in a length unit, got {pair[0]!r}"
        raise DataFileError(path, problem, ASK, line=line)
    angle = unit_kind(pair[1] or "") in SLOPES
    if is_slope and not angle:
        problem = f"expected slopes in a unit of angle, got {pair[1] or 'none'}"
        cure = (
            "Head the column, for example slope_urad, or give unit=('mm', 'urad'), for "
            "plain ratios unit=('mm', 'mm/mm')."
        )
        raise DataFileError(path, problem, cure, line=line, column=value.name)
    if value.role == "z" and angle:
        problem = f"expected heights in a length unit, got {pair[1]!r}"
        raise DataFileError(path, problem, ASK, line=line, column=value.name)
