"""A dosing needle that enters a picture from the top."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

# A needle ends where it is wider than this many times its median width: at the drop
WIDENING = 1.4


@dataclass(frozen=True)
class Needle:
    """Columns whose outline a needle may have touched."""

    left: float
    right: float


def erase_needle(grey: np.ndarray, threshold: float) -> tuple[np.ndarray, Needle | None]:
    """Return the picture without the needle at its top, and where that was.

    It is dark, at most a third of the picture wide, longer than half its width, and of even
    width down to where it ends, in the air or in the drop. Its place takes the tones beside
    it.
    """
    dark = ndimage.gaussian_filter(grey, 1.0) <= threshold
    columns = grey.shape[1]
    for box in ndimage.find_objects(ndimage.label(dark[0])[0]):
        left, right = box[0].start, box[0].stop
        if left > 0 and right < columns and right - left < columns / 3:
            edges = _follow(dark, left, right)
            width = np.median(edges[:, 1] - edges[:, 0])
            if len(edges) >= max(10, 0.5 * width) and len(edges) < len(grey) - 1:
                break
    else:
        return grey, None
    margin = int(4 + 0.2 * width)
    clean = grey.copy()
    for row, (left, right) in enumerate(edges):
        first, last = max(left - margin, 0), min(right + margin, columns - 1)
        share = np.linspace(0, 1, last - first + 1)
        clean[row, first : last + 1] = (1 - share) * grey[row, first] + share * grey[
            row, last
        ]
    # The smoothing of the picture carries what was cut a little further
    reach = margin + 6
    return clean, Needle(edges[:, 0].min() - reach, edges[:, 1].max() + reach)


def _follow(dark: np.ndarray, left: int, right: int) -> np.ndarray:
    """Return first column and last plus one of the dark run in each row, from the top."""
    edges = [(left, right)]
    for row in dark[1:]:
        middle = (left + right) // 2
        if not row[middle]:
            break
        before, after = np.flatnonzero(~row[:middle]), np.flatnonzero(~row[middle:])
        left = int(before[-1]) + 1 if before.size else 0
        right = middle + int(after[0]) if after.size else row.size
        width = np.median([b - a for a, b in edges[-50:]])
        if right - left > WIDENING * width + 2:
            break
        edges.append((left, right))
    return np.array(edges)
