"""Surface profiles z(x): the container and the reader of text files."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from data_io.mending.faults import Mend
from data_io.mending.profile_faults import find_profile_faults
from data_io.text.files import TEXT_SUFFIXES, is_text
from data_io.text.text import Line, Rows, find_delimiter, read_numbers, split_header
from data_io.topography.columns import (
    Columns,
    column_sizes,
    name_columns,
    profile_columns,
    table_width,
)
from data_io.topography.header_fields import profile_step
from data_io.topography.instruments import INSTRUMENT_SUFFIXES, read_instrument_profile
from data_io.topography.measurement_standard import (
    is_measurement_standard,
    read_measurement_standard,
)
from data_io.topography.plausible import check_heights, check_profile_scale
from data_io.topography.x3p import is_x3p, read_x3p
from pbrdf.errors import DataFileError, real_array, require
from pbrdf.files import complete_file


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Profile:
    """Heights z over rising positions x, evenly spaced or not.

    Parameters
    ----------
    x : array_like, shape (n,)
        Positions, strictly rising. [um]
    z : array_like, shape (n,)
        Heights. [um] Points whose position or height a mask hides are left out.
    slope : array_like, shape (n,), optional
        Slopes dz/dx that were measured, of which the heights are the integral. [1]

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
    slope: np.ndarray | None

    def __init__(
        self,
        x: npt.ArrayLike,
        z: npt.ArrayLike,
        *,
        slope: npt.ArrayLike | None = None,
    ) -> None:
        cure = "Leave missing points out; a profile may be unevenly spaced."
        pairs = (("x", x), ("z", z))
        hidden = [np.ma.getmaskarray(np.ma.asanyarray(values)) for _, values in pairs]
        if any(mask.any() for mask in hidden) and hidden[0].shape == hidden[1].shape:
            known = ~(hidden[0] | hidden[1])
            pairs = tuple((name, real_array(name, one)[known]) for name, one in pairs)  # type: ignore[assignment]
            slope = None if slope is None else real_array("slope", slope)[known]
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
        slopes = None
        if slope is not None:
            slopes = require("slope", slope, np.isfinite, "be finite [1]", cure).copy()
            if slopes.shape != arrays[0].shape:
                msg = f"slope must have shape {arrays[0].shape} as x, got {slopes.shape}."
                raise ValueError(msg)
            slopes.setflags(write=False)
        object.__setattr__(self, "slope", slopes)
        for name, array in zip(("x", "z"), arrays, strict=True):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @classmethod
    def from_slope(cls, x: npt.ArrayLike, slope: npt.ArrayLike) -> "Profile":
        """Profile of measured slopes; heights are their integral, by the trapezium rule.

        Examples
        --------
        >>> Profile.from_slope([0.0, 1.0, 3.0], [0.1, 0.3, 0.1]).z.round(3)
        array([0. , 0.2, 0.6])
        """
        position, slopes = np.asarray(x, dtype=float), np.asarray(slope, dtype=float)
        rises = np.diff(position) * (slopes[1:] + slopes[:-1]) / 2
        heights = np.concatenate([[0.0], np.cumsum(rises)])
        return cls(position, heights, slope=slopes)

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


class MendedProfile(Profile):
    """A profile in which faults were found, with the profile as it was.

    Parameters
    ----------
    x, z, slope
        As of `Profile`, without the points that were left out.
    mends : tuple of Mend
        What was found; places are those of `raw`.
    raw : Profile
        As it was measured.
    """

    mends: tuple[Mend, ...]
    raw: Profile

    def __init__(self, profile: Profile, *, mends: tuple[Mend, ...], raw: Profile) -> None:
        super().__init__(profile.x, profile.z, slope=profile.slope)
        object.__setattr__(self, "mends", mends)
        object.__setattr__(self, "raw", raw)


def mend_profile(
    profile: Profile, *, kinds: str | Sequence[str] = "all", name: str = "profile"
) -> Profile:
    """Leave out points that stand for missing ones or jumped, and say which.

    Parameters
    ----------
    profile : Profile
        As measured; of a profile of slopes these are looked at, and integrated again.
    kinds : str or sequence of str
        ``all``, ``none``, or some of sentinels and spikes, as in `data_io.mend_map`. What
        is found but not asked for is named and left.
    name : str
        Of the profile, for the warning.

    Returns
    -------
    Profile
        The same if nothing was found, else a `MendedProfile`.

    Raises
    ------
    ValueError
        If a kind is unknown.

    Warns
    -----
    MendWarning
        For each kind that was found.
    """
    return _mended(profile, kinds, name)


def _mended(profile: Profile, kinds: str | Sequence[str], name: str) -> Profile:
    """Leave out what is at fault, for the public functions that were called."""
    values = profile.z if profile.slope is None else profile.slope
    mends = find_profile_faults(profile.x, values, kinds=kinds, name=name)
    if not mends:
        return profile
    kept = ~np.logical_or.reduce([one.where & one.mended for one in mends])
    if profile.slope is None:
        left = Profile(profile.x[kept], profile.z[kept])
    else:
        left = Profile.from_slope(profile.x[kept], profile.slope[kept])
    return MendedProfile(left, mends=mends, raw=profile)


def read_profile(
    path: str | Path,
    *,
    unit: str | tuple[str, str] | None = None,
    columns: Columns | None = None,
    spacing: float | None = None,
    block: int | None = None,
    mend: str | Sequence[str] = "all",
) -> Profile:
    r"""Read a surface profile from a table of text, or an instrument's own file.

    Comma, semicolon, tab and space separate columns; decimals have a point, or a comma if
    none separates columns; lines that start with # or % are comments. What the columns are
    comes from their names and units (``x_um,z_um`` or ``x [mm]  z [nm]``) or from the
    caller: numbers of rows and further columns are passed over, and what the header calls
    no height is never taken for one. Points without height are left out. A scan written
    from right to left is turned round.

    Parameters
    ----------
    path : str or Path
        The file.
    unit : str or (str, str), optional
        Unit of both columns, or of x and of z: nm, um, mm, m; for a profile of slopes the
        second is rad, mrad, urad. Only for a file that names none; without it such a file
        is taken as micrometres, with a warning.
    columns : str or sequence of int or str, optional
        Numbers, from 1, or names of the columns of position and height (or slope); a
        single one for heights that are evenly spaced.
    spacing : float, optional
        Distance of points, only for a single column whose header names none. [um]
    block : int, optional
        Which of several blocks of data, from 1.
    mend : str or sequence of str
        Which faults to mend: ``all``, ``none``, or some of sentinels and spikes; see
        `data_io.mend_profile`. All that are found are named.

    Returns
    -------
    Profile
        Positions and heights [um], a `data_io.MendedProfile` if faults were found. A file
        of slopes gives `Profile.slope`, and the heights are their integral.

    Raises
    ------
    DataFileError
        Naming line and column of the first fault.

    Warns
    -----
    MendWarning
        For every kind of fault in the heights.
    MissingUnitWarning
        If neither the file nor the caller names a unit.
    ScaleWarning
        If length, step or slopes can hardly be those of a surface.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "edge.csv"
    ...     _ = path.write_text("No.,x_nm,z_nm\n1,0,10\n2,500,40\n3,1000,20\n")
    ...     read_profile(path)
    Profile(3 points, length 1 um, evenly spaced)
    """
    path = Path(path)
    found = _read_any(path, unit, columns, spacing, block)
    check_profile_scale(path, found.x, found.z)
    mended = _mended(found, mend, path.name)
    if mend != "none":
        check_heights(path, mended.z)
    return mended


def _read_any(
    path: Path,
    unit: str | tuple[str, str] | None,
    columns: Columns | None,
    spacing: float | None,
    block: int | None,
) -> Profile:
    """Read a profile of any format, as it is."""
    if is_x3p(path):
        return _read_x3p_profile(path)
    if is_measurement_standard(path):
        return build_profile(path, *read_measurement_standard(path))
    suffix = path.suffix.lower()
    if suffix in INSTRUMENT_SUFFIXES or not (suffix in TEXT_SUFFIXES or is_text(path)):
        x, z = read_instrument_profile(path)
        return build_profile(path, x[np.isfinite(z)], z[np.isfinite(z)])
    return read_text_profile(path, unit, columns, spacing, block)


def holds_profile(
    path: str | Path, *, columns: Columns | None = None, block: int | None = None
) -> bool:
    """Tell whether a text file is a profile, and not a height map, by its columns.

    A profile has one or two columns, or columns that are named position and height, or
    slope, and none that is a second position.

    Raises
    ------
    DataFileError
        If the file is no text, or holds no numbers.
    """
    header, data = split_header(path, block)
    if columns is not None:
        wanted = columns.split(",") if isinstance(columns, str) else columns
        return len(wanted) <= 2
    if table_width(data) <= 2:
        return True
    roles = {column.role for column in name_columns(header, data) or []}
    return bool(roles & {"z", "slope"}) and not {"x", "y", "z"} <= roles


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
    if chosen.position is None and chosen.value.kind == "angle":
        problem = "expected positions beside slopes, found none"
        raise DataFileError(path, problem, "Export them with their positions.")
    names = [""] * (max(c.place for c in used) + 1)
    for column, axis in zip(used[::-1], "zx", strict=False):
        names[column.place] = column.name or axis
    # The first column alone may end a row; blanks are gaps
    rows = read_numbers(path, data, names, gaps=True, columns=[c.place for c in used])
    size_x, size_z, is_slope = column_sizes(path, header, unit, chosen)
    value = rows[:, -1] * size_z
    if is_slope:
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
    return build_profile(path, x[known], value[known], lines=lines, is_slope=is_slope)


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
