"""Height maps in text files: matrices, and lists of x, y, z."""

import warnings
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from data_io.text.text import Line, Rows, find_delimiter, read_numbers, split_header
from data_io.text.units import axis_units, sole_unit, unit_factor, warn_missing_unit
from data_io.topography.column_names import Column, name_columns, table_width
from data_io.topography.columns import Columns, asked_columns
from data_io.topography.header_fields import matrix_header
from data_io.topography.plausible import with_spacing
from pbrdf.errors import DataFileError
from pbrdf.surface.heightmap import HeightMap

# A map of fewer rows or columns is too small to tell what they are
_FEWEST_LINES = 8
Spacing = float | tuple[float, float]


class CoordinatesWarning(UserWarning):
    """A first row or column of a matrix was taken for positions, and not for heights."""


def known_steps(
    path: Path, spacing: Spacing | None, header: Sequence[Line] = ()
) -> tuple[float, float]:
    """Return (dx, dy) given by the caller, or say that they are missing."""
    if spacing is None:
        for line in header:
            name, _, value = line.text.strip().partition(" ")
            # ESRI grids
            if name.lower() == "cellsize":
                problem = f"expected a step with its unit, got cellsize {value.strip()!r}"
                cure = "Give spacing= in um; such grids name no unit."
                raise DataFileError(path, problem, cure, line=line.number)
        problem = "expected a grid spacing, the file names none"
        cure = "Give spacing= in um, or in a text file the line '# spacing_um = ...'."
        raise DataFileError(path, problem, cure)
    dx, dy = np.broadcast_to(spacing, (2,))
    return float(dx), float(dy)


# Beyond any marker of missing points, whose largest is that of single precision. [um]
MOST_HEIGHT = 1e60


def build_map(path: Path, rows: np.ndarray, steps: tuple[float, float]) -> HeightMap:
    """Make a HeightMap of rows of constant y. [um]"""
    if rows.ndim != 2 or min(rows.shape) < 2:
        problem = f"expected a matrix of at least 2 x 2 heights, got shape {rows.shape}"
        raise DataFileError(path, problem, "A single line of heights is a profile.")
    # Some programs write infinity for what was not measured
    rows = np.where(np.isinf(rows), np.nan, rows)
    highest = float(np.nanmax(np.abs(rows), initial=0.0))
    if highest > MOST_HEIGHT:
        problem = f"expected heights, got values of up to {highest:.3g} um"
        raise DataFileError(
            path, problem, "The file is damaged, or of another number type."
        )
    if np.isnan(rows).all():
        problem = "expected heights, every point is marked missing"
        raise DataFileError(path, problem, "Export the map again.")
    try:
        return HeightMap(rows.T, steps)
    except ValueError as error:
        problem, _, cure = str(error).partition(". ")
        raise DataFileError(path, problem, cure) from error


def read_text_map(
    path: Path,
    spacing: Spacing | None,
    unit: str | None,
    *,
    columns: Columns | None = None,
    block: int | None = None,
) -> HeightMap:
    """Read a matrix of heights, or a list of x, y, z."""
    header, data = _one_of(path, block)
    if header and header[0].text.startswith("Zygo"):
        problem = "expected positions in a unit of length, a file of Zygo's counts pixels"
        raise DataFileError(
            path, problem, "Export it as x3p, or give the binary .dat file."
        )
    named = name_columns(header, data)
    if columns is not None:
        axes = asked_columns(path, columns, named, table_width(data))
        if len(axes) != 3:
            problem = f"expected three columns x, y, z for a map, got {len(axes)}"
            raise DataFileError(path, problem, "Two columns are a profile: --kind profile.")
        return _read_list(path, header, data, axes, spacing, unit)
    try:
        found = _axes(named)
    except ValueError as error:
        cure = "Choose by columns='1,2,4'."
        raise DataFileError(path, str(error), cure, line=header[-1].number) from None
    if found is not None:
        return _read_list(path, header, data, found, spacing, unit)
    width = table_width(data)
    full = len(data.first.cells(find_delimiter(data.first)))
    rows = read_numbers(
        path, data, gaps=True, columns=None if width == full else range(width)
    )
    rows = _without_coordinates(path, rows)
    steps, factor = matrix_header(path, header, rows.shape)
    # Three columns of unknown spacing are no map but x, y, z
    if rows.shape[1] == 3 and steps is None and spacing is None:
        plain = [Column(i, "", "xyz"[i], None) for i in range(3)]
        return _read_list(path, header, data, plain, spacing, unit)
    if factor is not None and unit is not None and factor != unit_factor(unit):
        problem = f"expected the unit that was given, {unit}, the header says another"
        raise DataFileError(path, problem, "Leave the argument out or mend the header.")
    size = unit_factor(unit or "um") if factor is None else factor
    if steps is None or spacing is None or np.allclose(steps, spacing):
        found_map = build_map(
            path, rows * size, steps or known_steps(path, spacing, header)
        )
    else:
        found_map = with_spacing(path, build_map(path, rows * size, steps), spacing)
    if factor is None and unit is None:
        warn_missing_unit(path, stacklevel=6, example="# unit = nm")
    return found_map


def _one_of(path: Path, block: int | None) -> tuple[list[Line], Rows]:
    """Return header and data of one map, of those that follow each other in a file."""
    try:
        header, data = split_header(path)
    except DataFileError:
        return split_header(path, block)
    numbers = np.asarray(data.numbers)
    starts = np.concatenate([[0], np.flatnonzero(np.diff(numbers) > 1) + 1, [numbers.size]])
    lengths = np.diff(starts)
    alike = lengths.size > 1 and lengths.min() == lengths.max() >= _FEWEST_LINES
    # Lists have such gaps between their scans
    if not alike or table_width(data) < _FEWEST_LINES:
        return (header, data) if block is None else split_header(path, block)
    if block is None:
        places = ", ".join(
            f"lines {numbers[a]} to {numbers[b - 1]}" for a, b in pairwise(starts[:7])
        )
        problem = f"expected one map, found {lengths.size} of equal size: {places}"
        raise DataFileError(path, problem, "Choose one by block=1.")
    if block > lengths.size:
        problem = f"expected a block of data from 1 to {lengths.size}, got {block}"
        raise DataFileError(path, problem, "Choose another by block=.")
    chosen = slice(starts[block - 1], starts[block])
    return header, Rows(data.numbers[chosen], data.texts[chosen])


def _without_coordinates(path: Path, rows: np.ndarray) -> np.ndarray:
    """Leave out a first row or column that counts evenly, as no heights do, with a word."""
    if min(rows.shape) < _FEWEST_LINES:
        return rows
    left, top = _counts(rows.T), _counts(rows)
    if not (left or top):
        return rows
    named = ["first column"] * left + ["first row"] * top
    lines = f"values of the {' and of the '.join(named)}"
    step = rows[2, 0] - rows[1, 0] if left else rows[0, 2] - rows[0, 1]
    warnings.warn(
        f"{path.name}: {lines} rise or fall evenly, by {step:g}: taken for positions or "
        "numbers of lines, not for heights.",
        CoordinatesWarning,
        stacklevel=5,
    )
    return rows[int(top) :, int(left) :]


def _counts(rows: np.ndarray) -> bool:
    """Tell whether the first row rises or falls evenly, and no other does."""
    # The corner belongs to either
    steps = np.diff(rows[:, 1:], axis=1)
    known = np.logical_and.reduce(np.isfinite(steps), axis=1)
    steps = np.where(known[:, None], steps, 0.0)
    apart: np.ndarray = np.abs(steps - steps[:, :1]).max(axis=1)
    even = np.logical_and(known, apart <= 1e-6 * np.abs(steps).mean(axis=1))
    return bool(even[0] and steps[0, 0] != 0 and not even[1:].any())


def _axes(columns: list[Column] | None) -> list[Column] | None:
    """Return the columns x, y, z of a list, or None for a matrix.

    Raises
    ------
    ValueError
        If there are several of a kind.
    """
    found = {axis: [c for c in columns or [] if c.role == axis] for axis in "xyz"}
    if not all(found.values()):
        return None
    for axis, several in found.items():
        if len(several) > 1:
            named = ", ".join(f"{c.name!r} ({c.place + 1})" for c in several)
            msg = f"expected one column {axis}, found {len(several)}: {named}"
            raise ValueError(msg)
    return [found[axis][0] for axis in "xyz"]


def _read_list(
    path: Path,
    header: list[Line],
    data: Rows,
    axes: list[Column],
    spacing: Spacing | None,
    unit: str | None,
) -> HeightMap:
    """Put a list of x, y, z, in any order, on its regular grid."""
    names = [c.name or "xyz"[i] for i, c in enumerate(axes)]
    places = [c.place for c in axes]
    columns = read_numbers(path, data, names, gaps=True, columns=places)
    units = _list_units(path, header, axes)
    if not units and unit is None:
        warn_missing_unit(path, stacklevel=7, example="x_um,y_um,z_um")
    if units and unit is not None:
        problem = f"expected no unit argument, the header says {', '.join(units)}"
        cure = "Leave the argument out."
        raise DataFileError(path, problem, cure, line=header[-1].number)
    factors = [unit_factor(name) for name in (units or [unit or "um"])]
    columns = columns * np.broadcast_to(factors, (3,))
    lines = data.numbers
    (i, dx, nx), (j, dy, ny) = (
        _grid_index(path, columns[:, k], lines, "xy"[k]) for k in range(2)
    )
    node = j * nx + i
    if nx * ny > 20 * len(lines) + 1000:
        problem = f"expected points on a grid, {len(lines)} points span {nx} x {ny} nodes"
        cure = "If the columns are no x, y, z, name them by columns=."
        raise DataFileError(path, problem, cure)
    order = np.argsort(node, kind="stable")
    repeats = np.flatnonzero(np.diff(node[order]) == 0)
    if repeats.size:
        first, second = (lines[order[repeats[0] + k]] for k in range(2))
        problem = f"expected one height a position, line {first} has the same x and y"
        raise DataFileError(path, problem, "Keep one of them.", line=second)
    rows = np.full(nx * ny, np.nan)
    rows[node] = columns[:, 2]
    found = build_map(path, rows.reshape(ny, nx), (dx, dy))
    return found if spacing is None else with_spacing(path, found, spacing)


def _list_units(path: Path, header: list[Line], axes: list[Column]) -> list[str]:
    """Return the units of x, y, z that the header names: none, one for all, or three."""
    if not header:
        return []
    for column in axes:
        if column.unit and column.kind != "length":
            problem = f"expected a length unit, got {column.unit!r}"
            cure = "Convert the column, or choose others by columns='1,2,4'."
            raise DataFileError(
                path, problem, cure, line=header[-1].number, column=column.name
            )
    named = [column.unit for column in axes if column.unit]
    if len(named) == 3:
        return named
    found = {c.role: c.unit for c in axes if c.unit and c.role in ("x", "y", "z")}
    texts = [line.text for line in header]
    by_axis = axis_units(path, texts) | found
    if len(by_axis) == 3:
        return [by_axis[axis] for axis in "xyz"]
    if by_axis or named:
        said = ", ".join(f"{axis} in {unit}" for axis, unit in by_axis.items())
        problem = f"expected a unit for each of x, y, z, the header says {said or named}"
        cure = "Head the columns x_um,y_um,z_um, or another unit of each."
        raise DataFileError(path, problem, cure, line=header[-1].number)
    common = sole_unit(path, texts)
    return [common] if common else []


def _grid_index(
    path: Path, values: np.ndarray, lines: Sequence[int], axis: str
) -> tuple[np.ndarray, float, int]:
    """Return grid index of each coordinate, grid step and number of nodes."""
    if not np.isfinite(values).all():
        line = lines[int(np.argmin(np.isfinite(values)))]
        problem = "expected a position, got nan"
        raise DataFileError(path, problem, "Leave the row out.", line=line, column=axis)
    span = np.ptp(values)
    # Printed positions of one node agree only to their digits: a hundredth of the mean
    # step of as many distinct values as there may be tells nodes apart
    levels = np.unique(values)
    apart = np.diff(levels) > 1e-3 * span / np.sqrt(values.size)
    count = 1 + int(apart.sum())
    if count < 2:
        problem = f"expected at least two values of {axis}, got one"
        raise DataFileError(path, problem, "One line of points is a profile.", column=axis)
    step = span / (count - 1)
    position = (values - values.min()) / step
    index = np.rint(position).astype(np.int64)
    off = np.abs(position - index)
    if off.max() > 0.05:
        line = lines[int(np.argmax(off))]
        problem = f"expected {axis} on a regular grid of step {step:.6g} um"
        cure = "Resample the points to a regular grid; gaps may stay empty."
        raise DataFileError(path, problem, cure, line=line, column=axis)
    return index, float(step), count
