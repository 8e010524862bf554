"""Height maps: NumPy arrays, text matrices, x, y, z lists, x3p, and instrument formats."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from data_io.mending.faults import mend as mend_map
from data_io.text.files import TEXT_SUFFIXES, NotAMapError, read_bytes
from data_io.text.units import unit_factor, warn_missing_unit
from data_io.topography.columns import Columns
from data_io.topography.formats.instruments import is_park_tiff, read_instrument_map
from data_io.topography.formats.measurement_standard import (
    is_measurement_standard,
    read_measurement_standard,
)
from data_io.topography.formats.sdf import is_text_sdf, read_text_sdf
from data_io.topography.formats.x3p import is_x3p, read_x3p_map
from data_io.topography.height_picture import PICTURES, read_height_picture
from data_io.topography.height_text import Spacing, build_map, known_steps, read_text_map
from data_io.topography.mesh_map import MESHES, read_mesh_map
from data_io.topography.plausible import check_heights, check_scale, with_spacing
from pbrdf.errors import DataFileError
from pbrdf.files import read_array
from pbrdf.surface.heightmap import HeightMap

_NPY_MAGIC = b"\x93NUMPY"


def read_height_map(
    path: str | Path,
    *,
    spacing: Spacing | None = None,
    unit: str | None = None,
    channel: int | str | None = None,
    columns: Columns | None = None,
    block: int | None = None,
    um_per_level: float | None = None,
    mend: str | Sequence[str] = "all",
) -> HeightMap:
    r"""Read a height map and turn it into micrometres, axes (x, y).

    Files list rows of constant y, the first row at y = 0, and along a row x rises; the
    result has ``heights[i, j]`` at x = i dx, y = j dy, that is the transposed matrix. NaN
    marks missing points and survives.

    Parameters
    ----------
    path : str or Path
        A ``.npy`` array; a text matrix; a text list with columns x, y, z on a regular grid;
        an ``.x3p`` file; text SDF; a mesh (STL, PLY, OBJ); a picture of heights; or an
        instrument's own format (SUR, OPD, PLUX, AL3D, VK, Gwyddion, AFM and others, with
        the extra ``pbrdf[formats]``).
    spacing : float or (float, float), optional
        Grid steps dx, dy, only for a file that names none, or none that can be. [um]
    unit : str, optional
        Length unit, only for a file that names none: of the heights of a matrix, of all
        three columns of a list. Default um.
    channel : int or str, optional
        Number or name of the channel, only for an instrument's own format; by default the
        first that holds heights.
    columns : str or sequence of int or str, optional
        Numbers, from 1, or names of the columns x, y, z of a text list.
    block : int, optional
        Which of several blocks of data in a text file, from 1.
    um_per_level : float, optional
        Of a picture whose grey levels are heights (16-bit PNG, 32-bit TIFF): the height of
        one level. [um]
    mend : str or sequence of str
        Which faults to mend: ``all``, ``none``, or some of sentinels, lines, offsets,
        spikes, terraces; see `data_io.mend_map`. All that are found are named.

    Returns
    -------
    HeightMap
        Not periodic; NaN where nothing was measured. A `data_io.MendedMap` if faults were
        found.

    Raises
    ------
    DataFileError
        If the file is damaged, contradicts the arguments, or lacks what is needed.

    Warns
    -----
    ChannelWarning
        If an instrument's file has several channels of lengths; it names the one taken.
    CoordinatesWarning
        If the first row or column of a matrix rises evenly: it is left out.
    MendWarning
        For every kind of fault in the heights.
    OverhangWarning
        If a mesh hangs over itself.
    ScaleWarning
        If field, pixel or slopes can hardly be those of a surface but the caller gave them;
        a file that says so by itself is refused, unless `spacing` corrects it.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "map.csv"
    ...     _ = path.write_text("# spacing_um = 0.5\n# unit = nm\n0,10,0\n20,nan,0\n")
    ...     read_height_map(path).heights
    array([[0.  , 0.02],
           [0.01,  nan],
           [0.  , 0.  ]])
    """
    path = Path(path)
    found = _read_any(
        path, spacing, unit, channel=channel, columns=columns, block=block,
        um_per_level=um_per_level,
    )  # fmt: skip
    # What the caller says of its scale is the caller's to judge
    stated = not (spacing is None and unit is None and um_per_level is None)
    check_scale(path, found, stated=stated)
    mended = mend_map(found, kinds=mend, name=path.name)
    if mend != "none":
        check_heights(path, mended.heights)
    return mended


def _read_any(
    path: Path,
    spacing: Spacing | None,
    unit: str | None,
    *,
    channel: int | str | None,
    columns: Columns | None,
    block: int | None,
    um_per_level: float | None,
) -> HeightMap:
    """Read a map of any format, as it is."""
    content_start = read_bytes(path, 8)
    suffix = path.suffix.lower()
    if um_per_level is not None:
        return _read_picture(path, spacing, unit, um_per_level)
    if content_start.startswith(_NPY_MAGIC):
        return _read_npy(path, spacing, unit)
    if suffix == ".x3p" or is_x3p(path):
        return _self_describing(path, read_x3p_map, spacing, unit)
    if is_text_sdf(path):
        return _self_describing(path, read_text_sdf, spacing, unit)
    if is_measurement_standard(path):
        raise NotAMapError(path, read_measurement_standard(path)[0].size)
    if suffix in MESHES:
        return _read_mesh(path, spacing, unit)
    if suffix in PICTURES and not is_park_tiff(path):
        problem = "expected the height of a grey level, a picture has none"
        cure = "Give um_per_level= and spacing=, in um."
        raise DataFileError(path, problem, cure)
    if suffix in TEXT_SUFFIXES and channel is None:
        return _read_any_text(path, spacing, unit, columns, block)
    if suffix == ".npy":
        problem = "expected a NumPy array, the file does not start like one"
        raise DataFileError(path, problem, "Write it with numpy.save.")
    return read_instrument_map(path, spacing=spacing, unit=unit, channel=channel)


def _read_picture(
    path: Path, spacing: Spacing | None, unit: str | None, um_per_level: float
) -> HeightMap:
    if unit is not None:
        problem = "expected no unit argument, um_per_level gives the size of a level"
        raise DataFileError(path, problem, "Leave the argument out.")
    rows = read_height_picture(path, um_per_level)
    return build_map(path, rows, known_steps(path, spacing))


def _read_mesh(path: Path, spacing: Spacing | None, unit: str | None) -> HeightMap:
    if unit is None:
        warn_missing_unit(path, stacklevel=5)
    steps = None if spacing is None else known_steps(path, spacing)
    return read_mesh_map(path, unit_factor(unit or "um"), steps)


def _self_describing(
    path: Path,
    reader: Callable[[Path], HeightMap],
    spacing: Spacing | None,
    unit: str | None,
) -> HeightMap:
    """Read a file that names its scale, which the caller may correct and not contradict."""
    if unit is not None:
        problem = "expected no unit argument, the format names its own"
        raise DataFileError(path, problem, "Leave the argument out.")
    found = reader(path)
    return found if spacing is None else with_spacing(path, found, spacing)


def _read_npy(path: Path, spacing: Spacing | None, unit: str | None) -> HeightMap:
    rows = read_array(path)
    if rows.dtype.kind not in "fiu":
        problem = f"expected real heights, got dtype {rows.dtype}"
        raise DataFileError(path, problem, "Save a two-dimensional float array.")
    factor = unit_factor(unit or "um")
    # A damaged number may be beyond all bounds, which `build_map` refuses by name
    with np.errstate(over="ignore", invalid="ignore"):
        heights = rows.astype(np.float64) * factor
    return build_map(path, heights, known_steps(path, spacing))


def _read_any_text(
    path: Path,
    spacing: Spacing | None,
    unit: str | None,
    columns: Columns | None,
    block: int | None,
) -> HeightMap:
    """Read a text file, or one of an instrument that writes text of its own layout."""
    try:
        return read_text_map(path, spacing, unit, columns=columns, block=block)
    except DataFileError as fault:
        if not all(given is None for given in (spacing, unit, columns, block)):
            raise
        try:
            return read_instrument_map(path)
        except DataFileError:
            raise fault from None
