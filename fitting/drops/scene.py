"""A photograph scaled by its light, and the contours in it."""

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

# Share of what is dark that is the darkest tone at least, and what of the contrast is one
# tone
_DARKEST, _ONE_TONE = 0.02, 0.25


@dataclass(frozen=True)
class Scene:
    """A picture scaled by its light: 1 on the ground, 0 at the darkest.

    `corner` is the row and column of its first pixel, `down` and `right` are its slopes,
    and `level` parts ground from substrate.
    """

    part: np.ndarray
    level: float
    corner: tuple[int, int]
    down: np.ndarray
    right: np.ndarray

    def at(self, values: np.ndarray, xy: np.ndarray) -> np.ndarray:
        """Interpolate values of each pixel at points, x to the right and y up."""
        place = np.stack([-xy[:, 1] - self.corner[0], xy[:, 0] - self.corner[1]])
        return ndimage.map_coordinates(values, place, order=1, cval=np.nan)

    def contours(self, level: float) -> list[np.ndarray]:
        """Return the long contours at one level, as points x to the right and y up."""
        from skimage.measure import find_contours

        return [
            np.stack([line[:, 1] + self.corner[1], -(line[:, 0] + self.corner[0])], axis=1)
            for line in find_contours(self.part, level)
            if len(line) >= 60
        ]

    def normals(self, xy: np.ndarray) -> np.ndarray:
        """Return the slopes at points, towards the bright side."""
        return np.stack([self.at(self.right, xy), -self.at(self.down, xy)], axis=1)


def thresholds_of(few: np.ndarray) -> list[float]:
    """Return the grey levels that may part ground from substrate, likeliest first.

    A glossy substrate that shows the drop's mirror image is nearer to the ground than to
    the drop: it is the middle one of three tones.
    """
    from skimage.filters import threshold_multiotsu, threshold_otsu

    thresholds = [float(threshold_otsu(few))]
    with suppress(ValueError):  # fewer tones than classes
        thresholds.append(float(threshold_multiotsu(few, classes=3, nbins=64)[-1]))
    return thresholds


def scale_by_light(grey: np.ndarray, step: int, threshold: float) -> Scene | None:
    """Scale a picture by the light of its ground; None without contrast."""
    few = grey[::step, ::step]
    smooth = ndimage.gaussian_filter(few, 1.0)
    bright = smooth > threshold
    if bright.all() or not bright.any():
        return None
    # Weaker light makes all tones weaker: to count from a bright substrate instead of from
    # the darkest would put one level at different shares of a border's contrast
    dark, high = smooth[~bright], np.median(few[bright])
    darkest = np.quantile(dark, _DARKEST)
    low = np.median(few[~bright][dark < darkest + _ONE_TONE * (high - darkest)])
    if high - low < 0.02:
        return None
    light = _light(few, bright, high)
    # A lamp may light only a part of a large picture
    rows, columns = (np.flatnonzero(bright.any(axis=axis)) * step for axis in (1, 0))
    top, left = max(rows[0] - 20 - step, 0), max(columns[0] - 20 - step, 0)
    part = grey[top : rows[-1] + 20 + step, left : columns[-1] + 20 + step]
    v, u = (
        2 * (np.arange(n) + start) / size - 1
        for n, start, size in zip(part.shape, (top, left), grey.shape, strict=True)
    )
    # A blurred contour at one level for all would move where the light is weaker
    lit = np.clip(_plane(light, v, u), 0.5 * high, 2 * high)
    # Where the substrate is nearly as bright as the ground, the light may cross its tone
    lit = np.maximum(lit, low + 0.3 * (high - low))
    part = (ndimage.gaussian_filter(part, 1.0) - low) / (lit - low)
    down, right = np.gradient(part)
    # Drop and image may be more than half of what is dark, and the substrate far from its
    # median
    level = max(0.5, float((threshold - low) / (high - low)))
    return Scene(part, level, (top, left), down, right)


def _light(grey: np.ndarray, bright: np.ndarray, high: float) -> np.ndarray:
    """Fit a plane to the bright ground, away from its borders; its level, if that fails."""
    ground = ndimage.binary_erosion(bright, iterations=6)
    v, u = np.nonzero(ground)
    if v.size < 100:
        return np.array([high, 0.0, 0.0])
    rows, columns = grey.shape
    terms = np.stack(
        [np.ones(v.size), 2 * (u + 0.5) / columns - 1, 2 * (v + 0.5) / rows - 1], axis=1
    )
    return np.linalg.lstsq(terms, grey[v, u], rcond=None)[0]


def _plane(light: np.ndarray, v: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Evaluate the plane at rows v and columns u, from -1 to 1 in the picture."""
    return light[0] + light[1] * u[None, :] + light[2] * v[:, None]
