"""Files in the instruments' own formats, by way of the package SurfaceTopography.

It reads about forty formats (SUR, OPD, PLUX, AL3D, VK, Gwyddion, AFM and others) and is an
optional dependency, the extra ``pbrdf[formats]``.
"""

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from data_io._text import LENGTH_UNITS, normalise_unit
from pbrdf.errors import DataFileError
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
    ".gwy",
    ".spm",
}


def read_instrument_map(path: str | Path) -> HeightMap:
    """Read the height map of an instrument's file; missing points become NaN. [um]

    Raises
    ------
    DataFileError
        If SurfaceTopography is not installed or cannot read the file, or if the file holds
        a profile or names no length unit.
    """
    topography = _open(Path(path))
    if topography.dim != 2:
        problem = "expected a map, got a profile"
        raise DataFileError(path, problem, "Read it with read_profile.")
    factor = _factor(path, topography)
    size_x, size_y = topography.physical_sizes
    nx, ny = topography.nb_grid_pts
    heights = np.ma.filled(np.ma.asarray(topography.heights(), dtype=np.float64), np.nan)
    # The package lists heights[x, y], as HeightMap does
    return HeightMap(heights * factor, (size_x / nx * factor, size_y / ny * factor))


def read_instrument_profile(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """Read positions and heights of a profile in an instrument's format. [um]"""
    topography = _open(Path(path))
    if topography.dim != 1:
        problem = "expected a profile, got a map"
        raise DataFileError(path, problem, "Read it with read_height_map.")
    factor = _factor(path, topography)
    x, z = topography.positions_and_heights()
    return np.asarray(x) * factor, np.ma.filled(np.ma.asarray(z, float), np.nan) * factor


def _open(path: Path) -> Any:
    """Open the default channel of a file, which holds the heights."""
    try:
        with warnings.catch_warnings():
            # It reports the absence of MPI, which nothing here needs
            warnings.simplefilter("ignore", ImportWarning)
            import SurfaceTopography
    except ImportError as error:
        problem = f"expected a text, .npy or .x3p file, got {path.suffix or 'no extension'}"
        cure = "For instrument formats install the extra: pip install 'pbrdf[formats]'."
        raise DataFileError(path, problem, cure) from error
    try:
        return SurfaceTopography.read_topography(str(path))
    # Forty parsers of damaged binary input fail in every way there is
    except Exception as error:
        reason = (str(error).strip().splitlines() or [type(error).__name__])[0]
        problem = f"expected a height map in a known format, got: {reason}"
        cure = "Check that the file is complete, or export text or x3p."
        raise DataFileError(path, problem, cure) from error


def _factor(path: str | Path, topography: Any) -> float:
    """Return the size of the file's unit, common to x, y and z. [um]"""
    unit = topography.unit
    if unit is None or normalise_unit(unit) not in LENGTH_UNITS:
        problem = f"expected heights in a length unit, the file says {unit}"
        cure = "Export the height channel, with its unit, as text or x3p."
        raise DataFileError(path, problem, cure)
    return LENGTH_UNITS[normalise_unit(unit)]
