"""Profiles in tables of text."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from data_io.text.text import Line, Rows, find_delimiter, read_numbers, split_header
from data_io.topography.columns import Columns, column_sizes, profile_columns
from data_io.topography.header_fields import profile_step
from data_io.topography.profile import Profile
from pbrdf.errors import DataFileError


def read_text_profile(
    path: str | Path,
    unit: str | tuple[str, str] | None,
    columns: Columns | None,
    spacing: float | None,
    block: int | None,
) -> Profile:
    """Read a profile from a table of text."""
    header, data = split_header(path, block)
    chosen = profile_columns(path, header, data, columns, unit_given=unit is not None)
    used = [c for c in (chosen.position, chosen.value) if c is not None]
    if chosen.position is None and chosen.is_slope:
        problem = "expected positions beside slopes, found none"
        raise DataFileError(path, problem, "Export them with their positions.")
    names = [""] * (max(c.place for c in used) + 1)
    for column, axis in zip(used[::-1], "zx", strict=False):
        names[column.place] = column.name or axis
    # The first column alone may end a row; blanks are gaps
    rows = read_numbers(path, data, names, gaps=True, columns=[c.place for c in used])
    size_x, size_z, kind = column_sizes(path, header, unit, chosen)
    value = rows[:, -1] * size_z
    if kind == "angle":
        value = np.tan(value)
    if chosen.position is None:
        x = np.arange(value.size) * _step(path, header, spacing)
    elif spacing is not None:
        problem = "expected no spacing argument, the file has a column of positions"
        raise DataFileError(path, problem, "Leave the argument out.")
    else:
        place = _last_place(data, chosen.position.place)
        x = even_positions(rows[:, 0] * size_x, place * size_x)
    known = np.isfinite(value) | ~np.isfinite(x)
    lines = [line for line, kept in zip(data.numbers, known, strict=True) if kept]
    return build_profile(
        path, x[known], value[known], lines=lines, is_slope=kind != "length"
    )


def _step(path: str | Path, header: list[Line], spacing: float | None) -> float:
    """Return the distance of points of a single column, from the header or the caller."""
    found = profile_step(path, header)
    step = found if spacing is None else spacing
    if step is None:
        problem = "expected positions or the distance of points, the file names none"
        cure = "Give spacing= in um, or in the file the line '# spacing_um = ...'."
        raise DataFileError(path, problem, cure)
    if found is not None and spacing is not None and not np.isclose(found, spacing):
        problem = f"expected the spacing given, {spacing} um, the header says {found} um"
        raise DataFileError(path, problem, "Leave the argument out or mend the header.")
    return float(step)


def _last_place(data: Rows, column: int) -> float:
    """Return the finest last digit that a column is printed with; 0 for exponents."""
    delimiter = find_delimiter(data.first)
    most = 0
    for text in data.texts[:1000]:
        cells = text.strip().split(delimiter)
        cell = cells[column] if column < len(cells) else ""
        if "e" in cell.lower():
            return 0.0
        most = max(most, len(cell.strip().partition(".")[2]))
    return 10.0**-most


def even_positions(x: np.ndarray, place: float) -> np.ndarray:
    """Return positions without the rounding of their digits, where they lie on a grid.

    A file with one decimal lists steps of 0.156 um as 0, 0.2, 0.3, 0.5. If all positions
    lie within half their last digit, `place`, of an even grid, that grid is meant.
    """
    if x.size < 10 or not np.isfinite(x).all():
        return x
    typical = float(np.median(np.abs(np.diff(x))))
    if typical <= 0:
        return x
    steps = np.unique(np.round(np.abs(np.diff(x)) / typical, 6)) * typical
    if steps.size not in (2, 3):
        return x
    # Steps differ by the last digit and by nothing else
    digit = float(np.diff(steps).min())
    if not np.isclose(digit, place, rtol=1e-3):
        return x
    number = np.arange(x.size)
    slope, start = np.polyfit(number, x, 1)
    grid = x[0] + slope * number
    rounded = np.abs(x - start - slope * number).max() < 0.51 * digit + 1e-9 * abs(slope)
    return grid if rounded and 0.02 < digit / abs(slope) < 1.01 else x


def build_profile(
    path: str | Path,
    x: np.ndarray,
    value: np.ndarray,
    *,
    lines: Sequence[int] | None = None,
    is_slope: bool = False,
) -> Profile:
    """Make a Profile of file content, naming the line of a point that does not fit."""

    def place(i: int) -> int | None:
        return lines[i] if lines else None

    for name, values in (("x", x), ("z", value)):
        missing = np.flatnonzero(~np.isfinite(values))
        if missing.size:
            raise DataFileError(
                path,
                f"expected a number, got {values[missing[0]]}",
                "Leave the row out; a profile may be unevenly spaced.",
                line=place(int(missing[0])),
                column=name,
            )
    if x.size < 3:
        problem = f"expected at least 3 points, got {x.size}"
        raise DataFileError(path, problem, "The file is truncated, or not a profile.")
    falling = bool(x[0] > x[-1])
    steps = np.diff(-x if falling else x)
    wrong = np.flatnonzero(steps <= 0)
    if wrong.size:
        i = int(wrong[0]) + 1
        problem = f"expected x to go one way, got {x[i]:.9g} um after {x[i - 1]:.9g} um"
        cure = (
            "Sort the points, merge equal ones, and cut re-entrant parts (overhangs) out."
        )
        raise DataFileError(path, problem, cure, line=place(i), column="x")
    if falling:
        x, value = x[::-1], value[::-1]
    return Profile.from_slope(x, value) if is_slope else Profile(x, value)
