"""Height maps: NumPy arrays, text matrices, x, y, z lists, x3p, and instrument formats."""

from pathlib import Path

import numpy as np

from data_io.text.files import read_bytes
from data_io.text.units import unit_factor
from data_io.topography.columns import Columns
from data_io.topography.height_text import Spacing, build_map, known_steps, read_text_map
from data_io.topography.instruments import read_instrument_map
from data_io.topography.x3p import read_x3p_map
from pbrdf.errors import DataFileError
from pbrdf.files import read_array
from pbrdf.surface.heightmap import HeightMap

_NPY_MAGIC = b"\x93NUMPY"
_TEXT_SUFFIXES = {".csv", ".txt", ".asc", ".dat", ".tsv", ".xyz"}


def read_height_map(
    path: str | Path,
    *,
    spacing: Spacing | None = None,
    unit: str | None = None,
    channel: int | str | None = None,
    columns: Columns | None = None,
    block: int | None = None,
) -> HeightMap:
    r"""Read a height map and turn it into micrometres, axes (x, y).

    Files list rows of constant y, the first row at y = 0, and along a row x rises; the
    result has ``heights[i, j]`` at x = i dx, y = j dy, that is the transposed matrix. NaN
    marks missing points and survives.

    Parameters
    ----------
    path : str or Path
        A ``.npy`` array; a text matrix; a text list with columns x, y, z on a regular grid;
        an ``.x3p`` file; or an instrument's own format (SUR, OPD, PLUX, AL3D, VK, Gwyddion,
        AFM and others, with the extra ``pbrdf[formats]``).
    spacing : float or (float, float), optional
        Grid steps dx, dy, only for a file that names none. [um]
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

    Returns
    -------
    HeightMap
        Not periodic; NaN where nothing was measured.

    Raises
    ------
    DataFileError
        If the file is damaged, contradicts the arguments, or lacks what is needed.

    Warns
    -----
    ChannelWarning
        If an instrument's file has several channels of lengths; it names the one taken.

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
    content_start = read_bytes(path)[:8]
    if content_start.startswith(_NPY_MAGIC):
        return _read_npy(path, spacing, unit)
    if path.suffix.lower() == ".x3p":
        _refuse_arguments(path, spacing, unit)
        return read_x3p_map(path)
    if path.suffix.lower() in _TEXT_SUFFIXES and channel is None:
        return _read_any_text(path, spacing, unit, columns, block)
    if path.suffix.lower() == ".npy":
        problem = "expected a NumPy array, the file does not start like one"
        raise DataFileError(path, problem, "Write it with numpy.save.")
    return read_instrument_map(path, spacing=spacing, unit=unit, channel=channel)


def _refuse_arguments(path: Path, spacing: Spacing | None, unit: str | None) -> None:
    """Refuse to override what a self-describing file says."""
    if spacing is not None or unit is not None:
        problem = "expected no spacing and no unit argument, the format names its own"
        raise DataFileError(path, problem, "Leave the arguments out.")


def _read_npy(path: Path, spacing: Spacing | None, unit: str | None) -> HeightMap:
    rows = read_array(path)
    if rows.dtype.kind not in "fiu":
        problem = f"expected real heights, got dtype {rows.dtype}"
        raise DataFileError(path, problem, "Save a two-dimensional float array.")
    factor = unit_factor(unit or "um")
    return build_map(path, rows.astype(np.float64) * factor, known_steps(path, spacing))


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
