"""What the header of a profile says: which columns are x and z, and their units."""

import re
from pathlib import Path

from data_io.text.text import Line, column_names, find_delimiter
from data_io.text.units import (
    axis_units,
    column_unit,
    header_units,
    sole_unit,
    unit_factor,
    warn_missing_unit,
)
from pbrdf.errors import DataFileError


def find_columns(
    path: str | Path, header: list[Line], first: Line
) -> tuple[list[str] | None, int, int]:
    """Return the column names, if the header has them, and which columns are x and z."""
    width = len(first.cells(find_delimiter(first)))
    names = column_names(header, first)
    axes = column_axes(names)
    for axis in ("x", "z"):
        if axes.count(axis) > 1:
            problem = f"expected one column {axis}, found {axes.count(axis)}"
            cure = "Remove or rename the others."
            raise DataFileError(path, problem, cure, line=header[-1].number, column=axis)
    if "x" in axes and "z" in axes:
        return names, axes.index("x"), axes.index("z")
    if width == 2:
        return names, 0, 1
    problem = f"expected two columns, x and z, got {width}"
    cure = "Keep two columns or head them x and z; commas separate columns, not decimals."
    raise DataFileError(path, problem, cure, line=first.number)


def column_axes(names: list[str] | None) -> list[str]:
    """Return the first words of column names: of "x_um", "Z [nm]" and "x/mm" x, z, x."""
    return [re.split(r"[_\s\[(/]", name.lower(), maxsplit=1)[0] for name in names or []]


def find_factors(
    path: str | Path,
    header: list[Line],
    unit: str | tuple[str, str] | None,
    names: list[str] | None,
    column_x: int,
    column_z: int,
) -> tuple[float, float]:
    """Return the size of the units of x and z. [um]"""
    given = None
    if unit is not None:
        pair = (unit, unit) if isinstance(unit, str) else unit
        given = unit_factor(pair[0]), unit_factor(pair[1])
    found = _named_units(path, header, names, column_x, column_z)
    if given is None and None in found and any(found):
        problem = (
            f"expected a unit for both columns, the header names {found[0] or found[1]}"
        )
        cure = "Head the columns, for example x_mm,z_um, or give unit=."
        raise DataFileError(path, problem, cure, line=header[-1].number)
    if found == (None, None):
        if given is None:
            warn_missing_unit(path, stacklevel=4)
            return 1.0, 1.0
        return given
    factors = [unit_factor(name) if name else None for name in found]
    if given is None:
        return factors[0] or 1.0, factors[1] or 1.0
    for factor, wanted in zip(factors, given, strict=True):
        if factor not in (None, wanted):
            stated = ", ".join(name or "none" for name in found)
            problem = f"expected the unit given, {unit}, the header says {stated}"
            cure = "Leave the argument out or mend the header."
            raise DataFileError(path, problem, cure, line=header[-1].number)
    return given


def _named_units(
    path: str | Path,
    header: list[Line],
    names: list[str] | None,
    column_x: int,
    column_z: int,
) -> tuple[str | None, str | None]:
    """Return the units of x and z that the header names, None where it does not."""
    if names is not None:
        at = header[-1].number
        in_x, in_z = (column_unit(path, names[k], at) for k in (column_x, column_z))
        if in_x or in_z:
            return in_x, in_z
    texts = [line.text for line in header]
    by_axis = axis_units(texts)
    if by_axis:
        return by_axis.get("x"), by_axis.get("z", by_axis.get("y"))
    for text in reversed(texts):
        units = header_units(text)
        if len(units) == 2:
            return units[0], units[1]
    common = sole_unit(path, texts)
    return common, common
