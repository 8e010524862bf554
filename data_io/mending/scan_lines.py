"""Scan lines that were lost, and offsets between them.

An instrument that scans line by line may lose a line (it repeats its neighbour, is flat, or
is of another place) and drifts from one line to the next. Offsets are told from grooves by
their order: those of a drift are independent from line to line, so that their differences
alternate; grooves go on.
"""

import numpy as np
from scipy import ndimage

Array = np.ndarray

# Differences of a lost line to both neighbours over the usual
_LOST = 8.0
# The same of a line without any height of its own
_FLAT = 2.0
# Variance of the mean differences of lines over that of chance, where a drift counts
_DRIFT = 6.0
# Correlation of neighbouring differences: -1/2 for independent offsets, above 0 for grooves
_ALTERNATING = -0.25
# Product of the steps half a line apart over that an eighth apart
_CONSTANT = 0.75
_TO_RMS = 1.4826


def find_lost_lines(heights: Array) -> Array:
    """Return the numbers of lines (second axis) that hold no measurement of their own."""
    if heights.shape[1] < 8:
        return np.zeros(0, dtype=int)
    steps = np.diff(heights, axis=1)
    pairs = np.isfinite(steps).sum(axis=0)
    known = pairs > heights.shape[0] / 2
    size = np.sqrt(np.nansum(steps**2, axis=0) / np.maximum(pairs, 1))
    usual = float(np.median(size[known])) if known.any() else 0.0
    if usual == 0:
        return np.zeros(0, dtype=int)
    high = np.max(np.where(np.isnan(heights), -np.inf, heights), axis=0)
    low = np.min(np.where(np.isnan(heights), np.inf, heights), axis=0)
    spread = np.where(np.isfinite(high), high - low, np.inf)
    lost: set[int] = set()
    # Where every line is flat the surface is of grooves
    if np.median(spread) > 1e-6 * np.nanmax(spread[np.isfinite(spread)], initial=0.0):
        beside = np.pad(size, 1, constant_values=np.inf)
        jumps = np.minimum(beside[:-1], beside[1:]) > _FLAT * usual
        lost = set(np.flatnonzero(jumps & (spread <= 1e-9 * np.median(spread))).tolist())
    # The later of two equal lines is the copy
    lost |= {int(j) + 1 for j in np.flatnonzero(known & (size < 1e-9 * usual))}
    # A single tall point makes no line lost, so here most of each line counts
    most = np.nan_to_num(np.nanmedian(np.abs(np.where(known, steps, 0.0)), axis=0))
    usual = _TO_RMS * float(np.median(most[known]))
    for j in range(1, heights.shape[1] - 1):
        over = heights[:, j + 1] - heights[:, j - 1]
        over = over[np.isfinite(over)]
        across = np.median(np.abs(over)) if over.size else np.inf
        if _TO_RMS * min(most[j - 1], most[j]) > _LOST * max(usual, _TO_RMS * across / 2):
            lost.add(j)
    found = np.array(sorted(lost), dtype=int)
    # Where half the lines are alike the surface is of grooves, or drawn
    return found if found.size <= 0.2 * heights.shape[1] else np.zeros(0, dtype=int)


def line_offsets(heights: Array) -> Array | None:
    """Return the offset of each line (second axis), or None if there is no drift. [um]

    Offsets are the summed medians of the differences of neighbouring lines, without their
    slow part, which is the surface's.
    """
    if min(heights.shape) < 16:
        return None
    steps = np.diff(heights, axis=1)
    known = np.isfinite(steps)
    if (known.sum(axis=0) < 8).any():
        return None
    between = np.asarray(np.nanmedian(steps, axis=0))
    drift = _spread(between) ** 2
    reach = float(np.nanmax(heights) - np.nanmin(heights))
    if drift <= max(
        _DRIFT * _chance(np.where(known, steps - between, 0.0)), 1e-18 * reach**2
    ):
        return None
    if not _whole_lines(np.where(known, steps - np.median(between), 0.0)):
        return None
    centred = between - np.median(between)
    alternating = float(np.mean(centred[1:] * centred[:-1]) / np.mean(centred**2))
    if alternating > _ALTERNATING:
        return None
    summed = np.concatenate([[0.0], np.cumsum(between)])
    slow = max(_fall(heights) / 4, 2.0)
    trend = np.polynomial.Polynomial.fit(np.arange(summed.size), summed, 1)
    summed = summed - trend(np.arange(summed.size))
    return summed - ndimage.gaussian_filter1d(summed, slow, mode="nearest")


def _chance(steps: Array) -> float:
    """Variance that the mean step of a line has by chance. [um²]

    The steps of one line are as many independent ones as their autocorrelation allows.
    """
    variance = float(np.mean(steps**2))
    n = steps.shape[0]
    total = 1.0
    for lag in range(1, n // 2):
        rho = float(np.mean(steps[lag:] * steps[:-lag])) / max(variance, 1e-300)
        if rho < 0.05:
            break
        total += 2 * rho
    # A median scatters by pi/2 more than a mean
    return np.pi / 2 * variance * total / n


def _whole_lines(steps: Array) -> bool:
    """Tell whether steps between lines hold from end to end, and do not wander."""
    n = steps.shape[0]
    near, far = (float(np.mean(steps[lag:] * steps[:-lag])) for lag in (n // 8, n // 2))
    return far > _CONSTANT * near


def _spread(values: Array) -> float:
    return _TO_RMS * float(np.median(np.abs(values - np.median(values))))


def _fall(heights: Array) -> float:
    """Lag along a line where its autocorrelation has fallen to 1/e. [steps]"""
    lines = heights - np.nanmean(heights, axis=0)
    variance = float(np.nanmean(lines**2))
    for lag in range(1, heights.shape[0] // 3):
        if np.nanmean(lines[lag:] * lines[:-lag]) < variance * np.exp(-1):
            return float(lag)
    return heights.shape[0] / 3
