"""Files in the instruments' own formats, by way of the package SurfaceTopography.

It reads about forty formats (SUR, OPD, PLUX, AL3D, VK, Gwyddion, AFM and others) and is an
optional dependency, the extra ``pbrdf[formats]``.
"""

import re
import struct
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from data_io.micrograph.levels import unheard
from data_io.text.files import NotAMapError, read_bytes
from data_io.text.units import LENGTH_UNITS, normalise_unit, unit_factor
from data_io.topography.channels import choose_channel
from data_io.topography.formats.sur import plain_sur
from data_io.topography.plausible import ScaleWarning, check_scale, with_spacing
from pbrdf.errors import DataFileError
from pbrdf.files.hdf5 import opened
from pbrdf.surface.heightmap import HeightMap

# Binary formats that may hold a profile as well
INSTRUMENT_SUFFIXES = {
    ".sur",
    ".pro",
    ".sdf",
    ".opd",
    ".vk3",
    ".vk4",
    ".vk6",
    ".vk7",
    ".plux",
    ".gwy",
    ".spm",
}


# Of tables that the package is given
_LONGEST_LINE, _MOST_ROWS = 100_000, 20_000
_NUMBERS = re.compile(rb"^[ \t]*[-+.]?\d", re.MULTILINE)
_NO_HEIGHT = 1e30
_NANO_PER_MILLI = 1e-6
_PARK_TAG = 50432
# What tifffile raises of pictures that are damaged, or none
_NO_TIFF = (OSError, ValueError, TypeError, LookupError, ArithmeticError, struct.error)


def read_instrument_map(
    path: str | Path,
    *,
    spacing: float | tuple[float, float] | None = None,
    unit: str | None = None,
    channel: int | str | None = None,
) -> HeightMap:
    """Read the height map of an instrument's file; missing points become NaN. [um]

    Parameters
    ----------
    path : str or Path
        The file.
    spacing : float or (float, float), optional
        Grid steps, only for a file that names none. [um]
    unit : str, optional
        Length unit, only for a file that names none.
    channel : int or str, optional
        Which channel of the file, by number or name; the first of heights by default.

    Raises
    ------
    DataFileError
        If SurfaceTopography is not installed or cannot read the file, or if the file holds
        a profile or lacks grid steps or unit.
    """
    path = Path(path)
    topography, factor, stated = _read(path, spacing, unit, channel)
    if topography.dim != 2 or min(topography.nb_grid_pts) < 2:
        raise NotAMapError(path, int(np.prod(topography.nb_grid_pts)))
    size_x, size_y = topography.physical_sizes
    nx, ny = topography.nb_grid_pts
    # The package lists heights[x, y], as HeightMap does
    heights = _filled(topography.heights()) * factor
    if not np.isfinite(heights).any():
        problem = "expected heights, every point is marked missing"
        raise DataFileError(path, problem, "Export the map again.")
    found = HeightMap(heights, (size_x / nx * factor, size_y / ny * factor))
    if spacing is not None and not stated:
        return with_spacing(path, found, spacing)
    try:
        return check_scale(path, found, stated=stated)
    except DataFileError:
        if path.suffix.lower() != ".nms":
            raise
    # The package takes the pitch of NanoFocus for millimetres; newer files have nanometres
    dx, dy = (step * _NANO_PER_MILLI for step in found.spacing)
    nearer = check_scale(path, HeightMap(heights, (dx, dy)), stated=False)
    msg = (
        f"{path.name}: the pitch in its header, {1e3 * dx:g}, is taken as nanometres: "
        f"a pixel of {dx:g} um, not of {dx / _NANO_PER_MILLI:g} um."
    )
    warnings.warn(msg, ScaleWarning, stacklevel=4)
    return nearer


def read_instrument_profile(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """Read positions and heights of a profile in an instrument's format. [um]"""
    topography, factor, _ = _read(Path(path), None, None, None)
    if topography.dim == 1:
        x, z = topography.positions_and_heights()
        return np.asarray(x) * factor, _filled(z) * factor
    if topography.nb_grid_pts[1] != 1:
        problem = "expected a profile, got a map"
        raise DataFileError(path, problem, "Read it with read_height_map.")
    z = _filled(topography.heights())[:, 0]
    step = topography.physical_sizes[0] / z.size
    return np.arange(z.size) * step * factor, z * factor


def _filled(heights: Any) -> np.ndarray:
    """Return heights with NaN for what the file marks as missing."""
    filled = np.ma.filled(np.ma.asarray(heights, dtype=np.float64), np.nan)
    # Some programs write the greatest number there is
    return np.where(np.abs(filled) < _NO_HEIGHT, filled, np.nan)


def _read(
    path: Path,
    spacing: float | tuple[float, float] | None,
    unit: str | None,
    channel: int | str | None,
) -> tuple[Any, float, bool]:
    """Return the wanted channel of a file, its unit [um], and whether steps were given."""
    reader = _open(path)
    with _faults(path):
        channels = [c for c in reader.channels if c.dim in (1, 2)]
    chosen = choose_channel(path, channels, channel)
    # The reader of another format may take a file for its own
    if np.prod(chosen.nb_grid_pts, dtype=float) > 1000 * path.stat().st_size:
        raise _unreadable(path, ValueError(f"{chosen.nb_grid_pts} points in a small file"))
    missing = chosen.unit is None and unit is None
    bare = chosen.physical_sizes is None and spacing is None
    if missing or bare:
        wanted = " and ".join([*["a length unit"] * missing, *["steps"] * bare])
        problem = f"expected {wanted}, the file names none"
        raise DataFileError(path, problem, "Give unit= and spacing= in um.")
    factor = _factor(path, chosen.unit, unit)
    sizes = None
    stated = spacing is not None and chosen.physical_sizes is None
    if stated:
        steps = np.broadcast_to(np.asarray(spacing), (chosen.dim,)) / factor
        sizes = tuple(float(n * d) for n, d in zip(chosen.nb_grid_pts, steps, strict=True))
    with _faults(path):
        found = reader.topography(channel_index=chosen.index, physical_sizes=sizes)
    return found, factor, stated


def is_park_tiff(path: Path) -> bool:
    """Tell whether a TIFF file is of a Park microscope, its heights in private tags."""
    if path.suffix.lower() not in (".tif", ".tiff"):
        return False
    import tifffile

    try:
        with unheard(), tifffile.TiffFile(path) as content:
            tags = getattr(content.pages[0], "tags", ())
            return any(tag.code == _PARK_TAG for tag in tags)
    except _NO_TIFF:
        return False


def _open(path: Path) -> Any:
    """Open a file; nothing but its header is read."""
    try:
        with warnings.catch_warnings():
            # It reports the absence of MPI, which nothing here needs
            warnings.simplefilter("ignore", ImportWarning)
            import SurfaceTopography
    except ImportError as error:
        problem = f"expected a text, .npy or .x3p file, got {path.suffix or 'no extension'}"
        cure = "For instrument formats install the extra: pip install 'pbrdf[formats]'."
        raise DataFileError(path, problem, cure) from error
    if h5py.is_hdf5(path):
        # Its data could lie in any file that can be read here
        with opened(path):
            pass
    with _faults(path):
        sur = plain_sur(path)
        if sur is not None:
            return SurfaceTopography.open_topography(sur, format="sur")
        return _open_detected(path)


def _open_detected(path: Path) -> Any:
    """Open a file by the first reader of the package that takes it.

    The package does the same, but gives its readers of tables every file: one of zeros or
    of words they read many times over.
    """
    from SurfaceTopography import open_topography
    from SurfaceTopography.Exceptions import CannotDetectFileFormat
    from SurfaceTopography.IO import MagicMatch, readers

    content = read_bytes(path)
    start, lines = content[:512], content.split(b"\n")
    text = b"\0" not in content and path.suffix.lower() not in INSTRUMENT_SUFFIXES
    text = text and max(map(len, lines)) < _LONGEST_LINE
    text = text and _NUMBERS.search(content) is not None
    # Of a matrix each line is a row
    tables = {"xyz": text, "asc": text and len(lines) < _MOST_ROWS}
    for reader in readers:
        name = reader.format()
        if reader.can_read(start) == MagicMatch.NO or not tables.get(name, True):
            continue
        # Forty parsers of other formats fail in every way there is
        with suppress(Exception):
            return open_topography(str(path), format=name)
    raise CannotDetectFileFormat


@contextmanager
def _faults(path: Path) -> Iterator[None]:
    """Turn whatever goes wrong in the package into a DataFileError."""
    try:
        with warnings.catch_warnings():
            # The hour of the measurement is of no concern
            warnings.filterwarnings("ignore", message="tzname")
            with unheard():
                yield
    except DataFileError:
        raise
    # Forty parsers of damaged binary input fail in every way there is
    except Exception as error:
        raise _unreadable(path, error) from error


def _unreadable(path: Path, error: Exception) -> DataFileError:
    """Return what to tell of a file that the package does not read."""
    if type(error).__name__ == "CannotDetectFileFormat":
        reason = "a file that no reader recognises"
    else:
        text = " ".join(str(error).split()).rstrip(".")
        reason = f"a fault on reading: {text[:200] or type(error).__name__}"
    problem = f"expected a height map in a known format, got {reason}"
    return DataFileError(
        path, problem, "Check that the file is complete, or export text or x3p."
    )


def _factor(path: Path, found: Any, given: str | None) -> float:
    """Return the size of the file's unit, common to x, y and z. [um]"""
    if found is None and given is not None:
        return unit_factor(given)
    if isinstance(found, str) and normalise_unit(found) in LENGTH_UNITS:
        if given is None:
            return LENGTH_UNITS[normalise_unit(found)]
        problem = f"expected no unit argument, the file says {found}"
        raise DataFileError(path, problem, "Leave the argument out.")
    problem = f"expected heights in a length unit, the file says {found}"
    cure = "Export the height channel, with its unit, as text or x3p."
    if found is None:
        problem, cure = "expected a length unit, the file names none", "Give unit=."
    raise DataFileError(path, problem, cure)
