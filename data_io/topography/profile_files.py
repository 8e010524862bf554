"""Files of profiles: text, x3p and the formats of instruments."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from data_io.mending.faults import warn_of
from data_io.mending.profile_faults import find_profile_faults
from data_io.text.files import TEXT_SUFFIXES, is_text
from data_io.text.text import split_header
from data_io.topography.column_names import name_columns, table_width
from data_io.topography.columns import Columns
from data_io.topography.formats.instruments import (
    INSTRUMENT_SUFFIXES,
    read_instrument_profile,
)
from data_io.topography.formats.measurement_standard import (
    is_measurement_standard,
    read_measurement_standard,
)
from data_io.topography.formats.x3p import is_x3p, read_x3p
from data_io.topography.plausible import check_heights, check_profile_scale
from data_io.topography.profile import MendedProfile, Profile
from data_io.topography.profile_text import build_profile, read_text_profile
from pbrdf.errors import DataFileError
from pbrdf.files import complete_file


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
    mended = _mended(profile, kinds)
    _warn_of_faults(name, mended)
    return mended


def _mended(profile: Profile, kinds: str | Sequence[str]) -> Profile:
    values = profile.z if profile.slope is None else profile.slope
    mends = find_profile_faults(profile.x, values, kinds=kinds)
    if not mends:
        return profile
    kept = ~np.logical_or.reduce([one.where & one.mended for one in mends])
    if profile.slope is None:
        left = Profile(profile.x[kept], profile.z[kept])
    else:
        left = Profile.from_slope(profile.x[kept], profile.slope[kept])
    return MendedProfile(left, mends=mends, raw=profile)


def _warn_of_faults(name: str, mended: Profile) -> None:
    """Warn of what was found, where the public function was called."""
    for one in mended.mends if isinstance(mended, MendedProfile) else ():
        warn_of(name, one, stacklevel=4)


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
    mended = _mended(found, mend)
    _warn_of_faults(path.name, mended)
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
