"""What a person looks at in a picture: its edges drawn in, and the scale bar."""

from pathlib import Path

import numpy as np
from scipy import ndimage

from data_io.micrograph_levels import find_annotation_band
from pbrdf.errors import DataFileError

GOOD, POOR, OVERHANG = np.array([[0.1, 0.9, 0.2], [1.0, 0.1, 0.1], [1.0, 0.2, 1.0]])


def draw_edge(
    picture: np.ndarray, pixels: np.ndarray, quality: np.ndarray, overhang: np.ndarray
) -> None:
    """Draw an edge into a colour picture, as thin as its size allows.

    Parameters
    ----------
    picture : ndarray, shape (rows, columns, 3)
        Colours in [0, 1], written into.
    pixels : ndarray, shape (n, 2)
        Rows and columns of the edge.
    quality : ndarray, shape (n,)
        1 is drawn green, 0 red.
    overhang : ndarray of bool, shape (n,)
        Drawn magenta.
    """
    colour = quality[:, None] * GOOD + (1 - quality[:, None]) * POOR
    colour[overhang] = OVERHANG
    rows, columns = picture.shape[:2]
    thickness = max(1, round(min(rows, columns) / 700))
    for shift in np.ndindex(thickness, thickness):
        row, column = (pixels + np.array(shift) - thickness // 2).round().astype(int).T
        picture[row.clip(0, rows - 1), column.clip(0, columns - 1)] = colour


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
