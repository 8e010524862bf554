"""Surface profiles z(x): the container and the reader of text files."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from data_io.text.files import ZIP_MAGIC, read_bytes
from data_io.text.text import column_names, find_delimiter, read_numbers, split_header
from data_io.text.write import complete_file
from data_io.topography.instruments import INSTRUMENT_SUFFIXES, read_instrument_profile
from data_io.topography.profile_header import column_axes, find_columns, find_factors
from data_io.topography.x3p import read_x3p
from pbrdf.errors import DataFileError, real_array, require


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Profile:
    """Heights z over rising positions x, evenly spaced or not.

    Parameters
    ----------
    x : array_like, shape (n,)
        Positions, strictly rising. [um]
    z : array_like, shape (n,)
        Heights. [um] Points whose position or height a mask hides are left out.

    Raises
    ------
    TypeError
        If the arrays are complex or no numbers.
    ValueError
        If the arrays differ in shape, hold fewer than three points or non-finite values, or
        x does not rise.

    Examples
    --------
    >>> Profile([0.0, 1.0, 2.5], [0.1, 0.0, 0.3])
    Profile(3 points, length 2.5 um, unevenly spaced)
    """

    x: np.ndarray
    z: np.ndarray

    def __init__(self, x: npt.ArrayLike, z: npt.ArrayLike) -> None:
        cure = "Leave missing points out; a profile may be unevenly spaced."
        pairs = (("x", x), ("z", z))
        hidden = [np.ma.getmaskarray(np.ma.asanyarray(values)) for _, values in pairs]
        if any(mask.any() for mask in hidden) and hidden[0].shape == hidden[1].shape:
            known = ~(hidden[0] | hidden[1])
            pairs = tuple((name, real_array(name, one)[known]) for name, one in pairs)  # type: ignore[assignment]
        arrays = [
            require(name, values, np.isfinite, "be finite [um]", cure).copy()
            for name, values in pairs
        ]
        if arrays[0].ndim != 1 or arrays[0].shape != arrays[1].shape:
            msg = (
                f"x and z must be one-dimensional and of one length, got shapes "
                f"{arrays[0].shape} and {arrays[1].shape}. Give one height a position."
            )
            raise ValueError(msg)
        if arrays[0].size < 3:
            msg = f"x must have at least 3 points, got {arrays[0].size}. Measure more."
            raise ValueError(msg)
        rising = np.diff(arrays[0]) > 0
        if not rising.all():
            i = int(np.argmin(rising)) + 1
            msg = (
                f"x must rise strictly [um], got {arrays[0][i]:.9g} after "
                f"{arrays[0][i - 1]:.9g} at index {i}. Sort points and merge equal ones."
            )
            raise ValueError(msg)
        for name, array in zip(("x", "z"), arrays, strict=True):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def size(self) -> int:
        """Number of points."""
        return self.x.size

    @property
    def length(self) -> float:
        """Distance from the first to the last point. [um]"""
        return float(self.x[-1] - self.x[0])

    @property
    def spacing(self) -> float:
        """Mean distance of neighbouring points. [um]"""
        return self.length / (self.size - 1)

    @property
    def evenly_spaced(self) -> bool:
        """True if every step agrees with the mean step to 1 %.

        Files print positions with few digits, so exact equality would reject them.
        """
        return bool(np.abs(np.diff(self.x) / self.spacing - 1).max() < 0.01)

    def __repr__(self) -> str:
        kind = "evenly" if self.evenly_spaced else "unevenly"
        return f"Profile({self.size} points, length {self.length:.6g} um, {kind} spaced)"


def read_profile(path: str | Path, *, unit: str | tuple[str, str] | None = None) -> Profile:
    r"""Read a surface profile from a text file of two columns, or an instrument's own file.

    Comma, semicolon, tab and space separate columns; decimals have a point, or a comma if
    none separates columns; lines that start with # or % are comments. Units come from the
    header (``x_um,z_um`` or ``x [mm]  z [nm]``) or from the caller. Columns headed x and z
    may stand in any order and among others. A scan written from right to left is turned
    round.

    Parameters
    ----------
    path : str or Path
        The file.
    unit : str or (str, str), optional
        Length unit of both columns, or of x and of z: nm, um, mm, m. Only for a file that
        names none; without it such a file is taken as micrometres, with a warning.

    Returns
    -------
    Profile
        Positions and heights. [um]

    Raises
    ------
    DataFileError
        Naming line and column of the first fault.

    Warns
    -----
    MissingUnitWarning
        If neither the file nor the caller names a unit.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "edge.csv"
    ...     _ = path.write_text("x_nm,z_nm\n0,10\n500,40\n1000,20\n")
    ...     read_profile(path)
    Profile(3 points, length 1 um, evenly spaced)
    """
    suffix = Path(path).suffix.lower()
    if read_bytes(path)[:4] == ZIP_MAGIC and suffix not in INSTRUMENT_SUFFIXES:
        return _read_x3p_profile(path)
    if suffix in INSTRUMENT_SUFFIXES:
        x, z = read_instrument_profile(path)
        return build_profile(path, x[np.isfinite(z)], z[np.isfinite(z)])
    header, data = split_header(path)
    names, column_x, column_z = find_columns(path, header, data.first)
    block = read_numbers(path, data, names)
    factor_x, factor_z = find_factors(path, header, unit, names, column_x, column_z)
    return build_profile(
        path,
        block[:, column_x] * factor_x,
        block[:, column_z] * factor_z,
        lines=data.numbers,
    )


def holds_profile(path: str | Path) -> bool:
    """Tell whether a text file is a profile, and not a height map, by its columns.

    A profile has one or two columns, or columns headed x and z and none headed y.

    Raises
    ------
    DataFileError
        If the file is no text, or holds no numbers.
    """
    header, data = split_header(path)
    if len(data.first.cells(find_delimiter(data.first))) <= 2:
        return True
    axes = column_axes(column_names(header, data.first))
    return {"x", "z"} <= set(axes) and "y" not in axes


def write_profile(profile: Profile, path: str | Path) -> None:
    """Write a profile as the project's CSV, columns ``x_um,z_um``, with every digit.

    Parameters
    ----------
    profile : Profile
        Positions and heights. [um]
    path : str or Path
        The file; it appears complete or not at all.
    """
    rows = zip(profile.x.tolist(), profile.z.tolist(), strict=True)
    with complete_file(path) as temporary, temporary.open("w", encoding="utf-8") as stream:
        stream.write("x_um,z_um\n")
        stream.writelines(f"{x!r},{z!r}\n" for x, z in rows)


def _read_x3p_profile(path: str | Path) -> Profile:
    """Read an x3p file of one line."""
    content = read_x3p(path)
    if content.rows.shape[0] != 1:
        problem = f"expected a profile, got a map of {content.rows.shape[0]} lines"
        raise DataFileError(path, problem, "Read it with read_height_map.")
    z = content.rows[0]
    measured = np.isfinite(z)
    return build_profile(
        path, (np.arange(z.size) * content.steps[0])[measured], z[measured]
    )


def build_profile(
    path: str | Path, x: np.ndarray, z: np.ndarray, *, lines: Sequence[int] | None = None
) -> Profile:
    """Make a Profile of file content, naming the line of a point that does not fit."""

    def place(i: int) -> int | None:
        return lines[i] if lines else None

    for name, values in (("x", x), ("z", z)):
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
    return Profile(x[::-1], z[::-1]) if falling else Profile(x, z)
