"""Pictures whose grey levels are heights: 8 and 16-bit PNG, 16 and 32-bit TIFF."""

from pathlib import Path

import numpy as np

from data_io.micrograph.levels import check_pixels, decoded
from data_io.text.files import read_bytes
from pbrdf.errors import DataFileError

PICTURES = {".png", ".tif", ".tiff", ".bmp", ".jpg", ".jpeg"}


def read_height_picture(path: Path, um_per_level: float) -> np.ndarray:
    """Read the rows of a picture of heights. [um]

    Parameters
    ----------
    path : Path
        The picture; its first row is y = 0, as of other maps.
    um_per_level : float
        Height of one grey level; of a picture of floating numbers, the size of their
        unit. [um]

    Raises
    ------
    DataFileError
        If it is no picture, or one of colours.
    """
    if not np.isfinite(um_per_level) or um_per_level <= 0:
        msg = f"um_per_level must be positive [um], got {um_per_level}. Give a height."
        raise ValueError(msg)
    check_pixels(path, len(read_bytes(path)))
    try:
        levels = decoded(path)
    # Decoders of damaged pictures fail in every way there is
    except Exception as error:
        reason = " ".join(str(error).split())[:150] or type(error).__name__
        problem = f"expected a picture, got a fault on reading: {reason}"
        raise DataFileError(path, problem, "Check that the file is complete.") from error
    if levels.ndim == 3 and levels.shape[2] in (3, 4):
        grey = levels[..., 0]
        if not all((levels[..., k] == grey).all() for k in (1, 2)):
            problem = "expected grey levels that are heights, got colours"
            cure = "Export heights as 16-bit grey PNG, 32-bit TIFF or text."
            raise DataFileError(path, problem, cure)
        levels = grey
    if levels.ndim != 2:
        problem = f"expected one picture, got an array of shape {levels.shape}"
        raise DataFileError(path, problem, "Export one page, in grey.")
    return levels.astype(np.float64) * um_per_level
