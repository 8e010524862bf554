"""Pieces of material in a flattened picture, and their sides that face the outside.

Everything here works on pictures whose edges run along the columns' index; `phase` is 1 in
the material and 0 outside.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage


@dataclass(frozen=True, kw_only=True)
class Body:
    """One side of a connected piece of material.

    Parameters
    ----------
    columns : ndarray of int, shape (n,)
        Consecutive picture columns.
    border : ndarray of int, shape (n,)
        First row of material in each, counted from the outside.
    overhang : ndarray of bool, shape (n,)
        True where there is a cavity under the outermost material.
    upside_down : bool
        True for the lower side, whose rows are counted from the picture's bottom.
    """

    columns: np.ndarray
    border: np.ndarray
    overhang: np.ndarray
    upside_down: bool


def segment(phase: np.ndarray, noise: float) -> np.ndarray:
    """Return the mask of the bright phase, smoothed just enough to quench the grain."""
    # Smoothing by s pixels divides white noise by 2 sqrt(pi) s; 10 % of the step is safe
    width = float(np.clip(noise / (0.1 * 2 * np.sqrt(np.pi)), 1.0, 6.0))
    return ndimage.gaussian_filter(phase, width) > 0.5


def drop_dust(mask: np.ndarray, min_span: float) -> np.ndarray:
    """Fill pieces and holes that span less than this part of rows and of columns."""
    rows, columns = mask.shape
    cleaned = mask.copy()
    for value in (True, False):
        labels, count = ndimage.label(cleaned == value)
        small = np.zeros(count + 1, dtype=bool)
        for index, box in enumerate(ndimage.find_objects(labels), start=1):
            height, width = (side.stop - side.start for side in box)
            small[index] = height < min_span * rows and width < min_span * columns
        cleaned[small[labels]] = not value
    return cleaned


def erase_dust(phase: np.ndarray, mask: np.ndarray, cleaned: np.ndarray) -> np.ndarray:
    """Set dropped dust and its blurred rim to the level of the phase around it."""
    dust = ndimage.binary_dilation(mask != cleaned, iterations=4)
    # Near the edge itself the rim cannot be told from the edge
    share = ndimage.gaussian_filter(cleaned.astype(np.float32), 2.0)
    dust &= np.abs(share - 0.5) > 0.499
    return np.where(dust, cleaned.astype(float), phase)


def find_bodies(material: np.ndarray, min_columns: int) -> list[Body]:
    """Return the sides of all pieces that span `min_columns` inside the picture."""
    bodies = []
    labels, count = ndimage.label(material)
    for label in range(1, count + 1):
        piece = labels == label
        for upside_down in (False, True):
            body = _side(piece[::-1] if upside_down else piece, min_columns, upside_down)
            if body is not None:
                bodies.append(body)
    return bodies


def _side(piece: np.ndarray, min_columns: int, upside_down: bool) -> Body | None:
    """Return the upper side of one piece, or None if it is not in the picture."""
    rows, columns = piece.shape
    present = piece.any(axis=0)
    border = piece.argmax(axis=0)
    # Where the piece touches the frame its border is the frame's, not the sample's
    usable = present & (border > 1)
    runs, count = ndimage.label(usable)
    if count == 0:
        return None
    lengths = np.bincount(runs)[1:]
    span = np.flatnonzero(runs == 1 + int(lengths.argmax()))
    if span.size < min_columns:
        return None
    border = border[span]
    start, stop = _trim_ends(border, span[0] == 0, span[-1] == columns - 1)
    if stop - start < min_columns:
        return None
    # Cavities nearer to this side than to the other
    column = piece[:, span]
    lowest = rows - 1 - column[::-1].argmax(axis=0)
    index = np.arange(rows)[:, None]
    upper_half = (index > border) & (index < (border + lowest) / 2)
    overhang = (upper_half & ~column).any(axis=0)
    part = slice(start, stop)
    return Body(
        columns=span[part],
        border=border[part],
        overhang=overhang[part],
        upside_down=upside_down,
    )


def _trim_ends(
    border: np.ndarray, starts_at_frame: bool, ends_at_frame: bool
) -> tuple[int, int]:
    """Return the part of a side before its rounded ends, if it ends inside the picture."""
    n = border.size
    if starts_at_frame and ends_at_frame:
        return 0, n
    index = np.arange(n)
    core = slice(n // 10, n - n // 10)
    line = np.polyfit(index[core], border[core], 1)
    distance = np.abs(border - np.polyval(line, index))
    limit = 4 * 1.4826 * np.median(distance) + 2
    good = np.flatnonzero(distance <= limit)
    margin = max(4, n // 30)
    start = 0 if starts_at_frame else int(good[0]) + margin
    stop = n if ends_at_frame else int(good[-1]) + 1 - margin
    return start, stop


def clearance_of(material: np.ndarray, body: Body) -> np.ndarray:
    """Rows around a border that hold no other edge, a third of them for each window."""
    image = (material[::-1] if body.upside_down else material)[:, body.columns]
    index = np.arange(image.shape[0])[:, None]
    far = 10 * image.shape[0]
    below = ~image & (index > body.border)
    above = image & (index < body.border)
    thickness = np.where(below.any(axis=0), below.argmax(axis=0) - body.border, far)
    last_above = image.shape[0] - 1 - above[::-1].argmax(axis=0)
    gap = np.where(above.any(axis=0), body.border - last_above, far)
    return ndimage.minimum_filter1d(np.minimum(thickness, gap), 9) // 3
