"""The size of a pixel: from the caller, or from the scale bar in the picture."""

from pathlib import Path

import numpy as np
from scipy import ndimage

from data_io.micrograph.levels import find_annotation_band
from pbrdf.errors import DataFileError, require


def pixel_size(
    path: str | Path,
    grey: np.ndarray,
    um_per_pixel: float | None,
    scale_bar_um: float | None,
) -> float:
    """Return the size of a pixel from the caller or from the scale bar. [um]"""
    cure = "Give the size of a pixel in um: 0.05 to 5 for light, less for electrons."
    if um_per_pixel is not None:
        rule = "lie in [1e-05, 1000] um"
        return float(
            require(
                "um_per_pixel", um_per_pixel, lambda v: (v >= 1e-5) & (v <= 1e3), rule, cure
            )
        )
    if scale_bar_um is None:
        problem = "expected a scale, got neither um_per_pixel nor scale_bar_um"
        raise DataFileError(path, problem, cure)
    length = float(
        require(
            "scale_bar_um",
            scale_bar_um,
            lambda v: (v > 0) & (v < 1e6),
            "be positive [um]",
            cure,
        )
    )
    return length / find_scale_bar(path, grey)


def find_scale_bar(path: str | Path, grey: np.ndarray) -> float:
    """Return the length of the scale bar: the longest thin straight bar of full contrast.

    Parameters
    ----------
    path : str or Path
        The picture's file, for messages.
    grey : ndarray, shape (rows, columns)
        Grey levels in [0, 1].

    Returns
    -------
    float
        Distance of the bar's ends. [pixels]

    Raises
    ------
    DataFileError
        If there is no such bar.
    """
    rows, columns = grey.shape
    top, bottom = find_annotation_band(grey)
    # With a text band the bar is in it; else anywhere
    band = grey[bottom:] if bottom < rows else grey[:top] if top > 0 else grey
    best = 0
    for mark in (band > 0.85, band < 0.15):
        labels, _ = ndimage.label(mark, structure=[[0, 0, 0], [1, 1, 1], [0, 0, 0]])
        for box in ndimage.find_objects(labels):
            length = box[1].stop - box[1].start
            if not 0.04 * columns < length < 0.8 * columns or length <= best:
                continue
            row = box[0].start
            # A bar is thin: a few rows above and below are ground again in most columns
            reach = max(6, rows // 60)
            above, below = row - reach, row + reach
            if above < 0 or below >= band.shape[0]:
                continue
            middle = mark[:, box[1]]
            if middle[above].mean() < 0.2 and middle[below].mean() < 0.2:
                best = length
    if best == 0:
        problem = "expected a scale bar, found no thin horizontal bar in black or white"
        raise DataFileError(path, problem, "Give um_per_pixel= instead.")
    return float(best)
