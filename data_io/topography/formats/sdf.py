"""Text files of ISO 25178-71 (SDF), also under their older names (BCR)."""

import re
from pathlib import Path

import numpy as np

from data_io.text.files import read_bytes
from pbrdf.errors import DataFileError
from pbrdf.surface.heightmap import HeightMap

_MAGIC = re.compile(rb"^\s*a(?:ISO|BCR|NIST)-\d")
_METRE = 1e6
_NO_HEIGHT = 1e30


def is_text_sdf(path: Path) -> bool:
    """Tell whether a file is SDF in text, whatever its name."""
    return bool(_MAGIC.match(read_bytes(path, 40)))


def read_text_sdf(path: Path) -> HeightMap:
    """Read an SDF file in text: steps and heights in metres, BAD where missing. [um]

    Raises
    ------
    DataFileError
        If a field is missing or the number of heights is another than the header says.
    """
    text = read_bytes(path).decode("latin-1")
    parts = re.split(r"^\s*\*\s*$", text, flags=re.MULTILINE)
    fields = dict(re.findall(r"^\s*(\w+)\s*=\s*(\S+)\s*$", parts[0], flags=re.MULTILINE))
    names = ("NumPoints", "NumProfiles", "Xscale", "Yscale", "Zscale")
    try:
        nx, ny = (int(fields[name]) for name in names[:2])
        dx, dy, size = (float(fields[name]) * _METRE for name in names[2:])
        words = parts[1].split() if len(parts) > 1 else []
        heights = np.array([_height(word) for word in words])
    except (KeyError, ValueError) as error:
        problem = f"expected {', '.join(names)} and heights, got a fault at {error}"
        raise DataFileError(path, problem, "Export the file again.") from error
    if heights.size != nx * ny or min(nx, ny) < 2:
        problem = f"expected {nx} x {ny} heights of a map, got {heights.size}"
        raise DataFileError(path, problem, "The file is truncated, or a profile.")
    if not (dx > 0 and dy > 0 and np.isfinite(heights).any()):
        problem = (
            f"expected steps above 0 and heights, got {dx / _METRE} and {dy / _METRE} m"
        )
        raise DataFileError(path, problem, "Export the file again.")
    return HeightMap(heights.reshape(ny, nx).T * size, (dx, dy))


def _height(word: str) -> float:
    value = np.nan if word.upper() in ("BAD", "INVALID", "NAN") else float(word)
    # Some programs write the greatest number there is
    return value if abs(value) < _NO_HEIGHT else np.nan
