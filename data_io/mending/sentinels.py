"""Numbers that stand for missing data, and single points that jumped.

A sentinel is a value far from all other heights (-9999, 0 where heights are 50), or a
patch of one value whose rim jumps as no other neighbours do. A spike is one point that
leaves the plane of its neighbours by twelve times what is usual on the map, and five times
what is nearby; the surface beside it bends the other way, as it does not at a resolved top.
"""

import numpy as np
from scipy import ndimage

Array = np.ndarray

# Beyond the rest by this many times the rest's own reach
_FAR = 5.0
# Jumps at the rim of a patch over those between other neighbours
_JUMP = 5.0
_SMALLEST_PATCH = 6
_FEWEST_VALUES = 40
_SPIKE = 12.0
_SPIKE_NEARBY = 5.0
# More spikes than this share, and than so many, are the texture itself
_MOST_SPIKES = 0.005
_FEW_SPIKES = 2
_TO_RMS = 1.4826


def find_sentinels(heights: Array) -> tuple[Array, list[float]]:
    """Find heights that stand for missing data.

    Parameters
    ----------
    heights : ndarray
        Of a map or a profile; NaN is missing already. [um]

    Returns
    -------
    ndarray of bool, list of float
        Where they are, and the values. [um]

    Examples
    --------
    >>> z = np.append(np.sin(np.arange(30.0)), -9999.0)
    >>> find_sentinels(z)[1]
    [-9999.0]
    """
    missing = np.isnan(heights)
    found: list[float] = []
    while len(found) < 4:
        value = _far_value(heights[~missing])
        if value is None:
            value = _patch_value(heights, missing)
        if value is None:
            break
        missing = missing | (heights == value)
        found.append(value)
    return missing & ~np.isnan(heights), found


def _far_value(known: Array) -> float | None:
    """Return the lowest or highest value, if it is far from all the rest."""
    if known.size < 12:
        return None
    for value in (float(known.min()), float(known.max())):
        rest = known[known != value]
        if rest.size < known.size / 2:
            continue
        # Of the rest nearly all: a second sentinel may be among it
        low, middle, high = np.quantile(rest, [0.005, 0.5, 0.995])
        reach = max(high - middle, middle - low)
        gap = np.abs(rest - value).min()
        if abs(value - middle) / _FAR > reach and gap > reach > 0:
            return value
    return None


def _patch_value(heights: Array, missing: Array) -> float | None:
    """Return the value of a flat patch with a rim of jumps, where the rest is not flat."""
    known = heights[~missing]
    values, counts = np.unique(known, return_counts=True)
    if values.size < max(known.size / 4, _FEWEST_VALUES):
        return None
    value = float(values[np.argmax(counts)])
    patch = (heights == value) & ~missing
    labels, n = ndimage.label(patch)
    if n == 0 or np.bincount(labels.ravel())[1:].max() < _SMALLEST_PATCH:
        return None
    inside, rim = [], []
    for axis in range(heights.ndim):
        jumps = np.abs(np.diff(heights, axis=axis))
        here = np.moveaxis(patch, axis, 0)
        ends = np.moveaxis(here[1:] != here[:-1], 0, axis)
        both = np.moveaxis(~here[1:] & ~here[:-1], 0, axis)
        inside.append(jumps[both & np.isfinite(jumps)])
        rim.append(jumps[ends & np.isfinite(jumps)])
    others, edges = np.concatenate(inside), np.concatenate(rim)
    if others.size == 0 or edges.size == 0:
        return None
    usual = float(np.median(others))
    if usual > 0 and np.median(edges) > _JUMP * usual:
        return value
    return None


def find_spikes(heights: Array, *, in_bands: bool = False) -> Array:
    """Find single points of a map that jumped.

    Parameters
    ----------
    heights : ndarray, shape (nx, ny)
        NaN where missing. [um]
    in_bands : bool
        The map was digitised from colours, of which patches may be misread: the points of
        their rims count too.

    Returns
    -------
    ndarray of bool
    """
    filled = heights.copy()
    missing = np.isnan(heights)
    if missing.all() or min(heights.shape) < 5:
        return np.zeros(heights.shape, dtype=bool)
    if missing.any():
        nearest = ndimage.distance_transform_edt(
            missing, return_distances=False, return_indices=True
        )
        filled = filled[tuple(nearest)]
    found = np.zeros(heights.shape, dtype=bool)
    sharp = found.copy()
    ring = np.array([[1, 1, 1], [1, 0, 1], [1, 1, 1]], dtype=bool)
    for _ in range(3):
        away = _from_neighbours(filled)
        usual = _TO_RMS * float(np.median(np.abs(away[~missing])))
        if usual == 0:
            break
        far = (np.abs(away) > _SPIKE * usual) & ~missing & ~found
        if not far.any():
            break
        around = ndimage.median_filter(filled, footprint=ring, mode="nearest")
        most = ndimage.maximum_filter(np.abs(away), size=3)
        alone = (np.abs(away) == most) & (np.abs(filled - around) > 0.6 * np.abs(away))
        new = far & alone
        if not new.any():
            break
        found |= new
        sharp |= new if in_bands else new & _stands_out(away, ring)
        filled = np.where(new, around, filled)
    return sharp & _unless_texture(found)


def _stands_out(away: Array, ring: Array) -> Array:
    """Tell which points leave their neighbours as no resolved top or edge does."""
    beside = ndimage.convolve(away, ring / 8.0, mode="nearest") * np.sign(away)
    nearby = ndimage.median_filter(np.abs(away), size=5, mode="nearest")
    return (beside < 0) & (np.abs(away) > _SPIKE_NEARBY * nearby)


def _from_neighbours(heights: Array) -> Array:
    """Height of each point over the mean of its four neighbours. [um]

    Beyond the edges the surface goes on as a plane, so that a slope there is none.
    """
    wide = np.pad(heights, 1, mode="reflect", reflect_type="odd")
    across = wide[:-2, 1:-1] + wide[2:, 1:-1] + wide[1:-1, :-2] + wide[1:-1, 2:]
    return heights - across / 4


def find_spikes_along(x: Array, values: Array) -> Array:
    """Find single points of a profile that jumped from both neighbours, to one side.

    Parameters
    ----------
    x, values : ndarray, shape (n,)
        Rising positions and heights, or slopes, none missing.

    Returns
    -------
    ndarray of bool

    Examples
    --------
    >>> z = np.sin(np.arange(40.0))
    >>> z[17] += 30
    >>> np.flatnonzero(find_spikes_along(np.arange(40.0), z))
    array([17])
    """
    found = np.zeros(values.shape, dtype=bool)
    if values.size < 12:
        return found
    share = (x[1:-1] - x[:-2]) / (x[2:] - x[:-2])
    away = values[1:-1] - (1 - share) * values[:-2] - share * values[2:]
    usual = _TO_RMS * float(np.median(np.abs(away)))
    # Beside a gap a bent profile is further from the line: by the product of both steps
    steps = (x[1:-1] - x[:-2]) * (x[2:] - x[1:-1])
    reach = np.maximum(steps / np.median(steps), 1)
    before, after = values[1:-1] - values[:-2], values[1:-1] - values[2:]
    least = np.minimum(np.abs(before), np.abs(after))
    # An edge jumps from one neighbour only
    alone = (before * after > 0) & (least > 0.6 * np.abs(away))
    if usual > 0:
        found[1:-1] = alone & (np.abs(away) > _SPIKE * usual * reach)
    return _unless_texture(found)


def _unless_texture(found: Array) -> Array:
    """Return the spikes, or none where they are too many to be faults."""
    few = found.sum() <= max(_MOST_SPIKES * found.size, _FEW_SPIKES)
    return found if few else np.zeros_like(found)
