"""Height maps in text files: matrices, and lists of x, y, z."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from data_io.text.text import Line, Rows, column_names, read_numbers, split_header
from data_io.text.units import (
    LENGTH_UNITS,
    axis_units,
    column_unit,
    normalise_unit,
    sole_unit,
    unit_factor,
    warn_missing_unit,
)
from data_io.topography.profile_header import column_axes
from pbrdf.errors import DataFileError
from pbrdf.surface.heightmap import HeightMap

# Header fields of text matrices: "# spacing_um = 0.5", "# dx_um: 0.5", and, as Gwyddion
# writes them, "# Width: 10.0 µm", "# Height: ...", "# Value units: m"
_FIELD = re.compile(
    r"^[#%\s]*([^\W\d_][^\W\d_ ]*(?: [^\W\d_]+)*?)(?:_([A-Za-zµμ]+))?\s*[:=]\s*(.+?)\s*$"
)
# Gwyddion writes in the language of its user
_TRANSLATED = {
    "width": "breite largeur larghezza anchura largura šířka ширина",
    "height": "höhe hauteur altezza altura výška высота",
    "unit": "einheiten|unités|unità valore|unidades de valor|jednotky hodnot",
}
_ENGLISH = {
    word: key
    for key, words in _TRANSLATED.items()
    for word in re.split(r"\|" if "|" in words else " ", words)
}
_QUANTITY = re.compile(r"^([-+0-9.,eE]+)\s*([A-Za-zµμÅå]*)$")

Spacing = float | tuple[float, float]


def known_steps(path: Path, spacing: Spacing | None) -> tuple[float, float]:
    """Return (dx, dy) given by the caller, or say that they are missing."""
    if spacing is None:
        problem = "expected a grid spacing, the file names none"
        cure = "Give spacing= in um, or in a text file the line '# spacing_um = ...'."
        raise DataFileError(path, problem, cure)
    dx, dy = np.broadcast_to(spacing, (2,))
    return float(dx), float(dy)


def build_map(path: Path, rows: np.ndarray, steps: tuple[float, float]) -> HeightMap:
    """Make a HeightMap of rows of constant y. [um]"""
    if rows.ndim != 2 or min(rows.shape) < 2:
        problem = f"expected a matrix of at least 2 x 2 heights, got shape {rows.shape}"
        raise DataFileError(path, problem, "A single line of heights is a profile.")
    if np.isnan(rows).all():
        problem = "expected heights, every point is marked missing"
        raise DataFileError(path, problem, "Export the map again.")
    try:
        return HeightMap(rows.T, steps)
    except ValueError as error:
        problem, _, cure = str(error).partition(". ")
        raise DataFileError(path, problem, cure) from error


def read_text_map(path: Path, spacing: Spacing | None, unit: str | None) -> HeightMap:
    """Read a matrix of heights, or a list of x, y, z."""
    header, data = split_header(path)
    if header and header[0].text.startswith("Zygo"):
        problem = "expected positions in a unit of length, a file of Zygo's counts pixels"
        raise DataFileError(
            path, problem, "Export it as x3p, or give the binary .dat file."
        )
    names = _list_columns(header, data.first)
    if names is not None:
        return _read_list(path, header, data, names, spacing, unit)
    rows = read_numbers(path, data, gaps=True)
    steps, factor = _matrix_header(path, header, rows.shape)
    # Three columns of unknown spacing are no map but x, y, z
    if rows.shape[1] == 3 and steps is None and spacing is None:
        return _read_list(path, header, data, ["x", "y", "z"], spacing, unit)
    if steps is not None and spacing is not None and not np.allclose(steps, spacing):
        problem = f"expected the spacing given, {spacing} um, the header says {steps} um"
        raise DataFileError(path, problem, "Leave the argument out or mend the header.")
    if factor is not None and unit is not None and factor != unit_factor(unit):
        problem = f"expected the unit that was given, {unit}, the header says another"
        raise DataFileError(path, problem, "Leave the argument out or mend the header.")
    factor = unit_factor(unit or "um") if factor is None else factor
    return build_map(path, rows * factor, steps or known_steps(path, spacing))


def _list_columns(header: list[Line], first: Line) -> list[str] | None:
    """Return the column names of a list of x, y, z, or None for a matrix."""
    if not header:
        return None
    names = column_names(header, first)
    if names is None:
        text = header[-1].text.strip().lstrip("#% ")
        names = [name for name in re.split(r"[;,\t]|\s+(?![\[(])", text) if name.strip()]
    axes = column_axes(names)
    return names if axes == ["x", "y", "z"] else None


def _read_list(
    path: Path,
    header: list[Line],
    data: Rows,
    names: list[str],
    spacing: Spacing | None,
    unit: str | None,
) -> HeightMap:
    """Put a list of x, y, z, in any order, on its regular grid."""
    columns = read_numbers(path, data, names, gaps=True)
    if columns.shape[1] != 3:
        problem = f"expected three columns x, y, z, got {columns.shape[1]}"
        raise DataFileError(path, problem, "Keep three.", line=data.numbers[0])
    units = _list_units(path, header, names)
    if not units and unit is None:
        warn_missing_unit(path, stacklevel=6)
    if len(units) not in (0, 1, 3):
        problem = f"expected a unit for each of x, y, z, got {units}"
        cure = "Write x_um,y_um,z_um or another unit of each."
        raise DataFileError(path, problem, cure, line=header[-1].number)
    if units and unit is not None:
        problem = f"expected no unit argument, the header says {', '.join(units)}"
        cure = "Leave the argument out."
        raise DataFileError(path, problem, cure, line=header[-1].number)
    if spacing is not None:
        problem = "expected no spacing argument, the columns x and y give the grid"
        raise DataFileError(path, problem, "Leave the argument out.")
    factors = [unit_factor(name) for name in (units or [unit or "um"])]
    columns = columns * np.broadcast_to(factors, (3,))
    lines = data.numbers
    (i, dx, nx), (j, dy, ny) = (
        _grid_index(path, columns[:, k], lines, "xy"[k]) for k in range(2)
    )
    node = j * nx + i
    order = np.argsort(node, kind="stable")
    repeats = np.flatnonzero(np.diff(node[order]) == 0)
    if repeats.size:
        first, second = (lines[order[repeats[0] + k]] for k in range(2))
        problem = f"expected one height a position, line {first} has the same x and y"
        raise DataFileError(path, problem, "Keep one of them.", line=second)
    rows = np.full(nx * ny, np.nan)
    rows[node] = columns[:, 2]
    return build_map(path, rows.reshape(ny, nx), (dx, dy))


def _list_units(path: Path, header: list[Line], names: list[str]) -> list[str]:
    """Return the units of x, y, z that the header names: none, one for all, or three."""
    if not header:
        return []
    at = header[-1].number
    found = [unit for name in names if (unit := column_unit(path, name, at))]
    if found:
        return found
    texts = [line.text for line in header]
    by_axis = axis_units(texts)
    if by_axis:
        return [by_axis[axis] for axis in "xyz" if axis in by_axis]
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


def _matrix_header(
    path: Path, header: list[Line], shape: tuple[int, ...]
) -> tuple[tuple[float, float] | None, float | None]:
    """Return (dx, dy) and the size of the height unit that the header names. [um]"""
    found: dict[str, float] = {}
    factor = None
    for line in header:
        match = _FIELD.match(line.text)
        if not match:
            continue
        key, unit_of_name, value = match[1].strip().lower(), match[2], match[3]
        key = _ENGLISH.get(key, key)
        if key in ("unit", "units", "value units", "z unit"):
            if normalise_unit(value) not in LENGTH_UNITS:
                problem = f"expected a length unit, got {value!r}"
                cure = "Heights are needed; known units: nm, um, mm, m."
                raise DataFileError(path, problem, cure, line=line.number, column=key)
            factor = unit_factor(value)
        elif key in ("spacing", "dx", "dy", "width", "height"):
            found[key] = _length(path, line, key, unit_of_name, value)
    dx = found.get("dx", found.get("spacing"))
    dy = found.get("dy", found.get("spacing", dx))
    if dx is None and {"width", "height"} <= found.keys():
        dx, dy = found["width"] / shape[1], found["height"] / shape[0]
    return (None if dx is None or dy is None else (dx, dy)), factor


def _length(path: Path, line: Line, key: str, unit: str | None, value: str) -> float:
    """Return a positive length of the header. [um]"""
    match = _QUANTITY.match(value)
    name = unit or (match[2] if match else "")
    try:
        if match is None:
            raise ValueError(value)
        length = float(match[1].replace(",", ".")) * unit_factor(name)
    except ValueError as error:
        problem = f"expected a length with its unit, got {value!r}"
        cure = "Write for example '# spacing_um = 0.5' or '# Width: 10 um'."
        raise DataFileError(path, problem, cure, line=line.number, column=key) from error
    if not length > 0 or not np.isfinite(length):
        problem = f"expected a positive length, got {value!r}"
        raise DataFileError(path, problem, "Mend the header.", line=line.number, column=key)
    return length
