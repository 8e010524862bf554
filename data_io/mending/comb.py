"""Bands of smeared heights: a picture that was blurred, or got noise, after digitisation.

The heights crowd at even levels, so the mean of exp(2πi z / q) is large where q is their
distance. Where that is chance, as at crests of equal height, other parts of the map have
other phases.
"""

import numpy as np
import scipy.fft
from scipy import special

Array = np.ndarray

# Bands over the range of the heights
_FEWEST, _MOST = 5.5, 140.0
# Mean of the phase factor: over the whole map, and of the agreement between parts,
# in its standard errors
_LEAST_CROWDING = 0.15
_LEAST_AGREEMENT = 6.0
_PARTS = 8
# What a smooth density of heights gives at fewer bands, as a share of the peak of a comb
_MOST_BESIDE = 0.5
# Heights on plateaus tell the step better, if so many are so flat [steps]
_LEAST_FLAT = 0.01
_FLAT = 0.1
# A finer comb passes through the same levels
_AS_HIGH = 0.7
_GRID = 8192
# Steps of two levels and more, as a share of all steps, beyond those of random slopes
_MOST_JUMPS = 0.05


def find_comb(heights: Array) -> Array | None:
    """Return evenly spaced levels at which the heights of a map crowd, or None. [um]

    Parameters
    ----------
    heights : ndarray, shape (nx, ny)
        NaN where missing. [um]
    """
    known = heights[np.isfinite(heights)]
    low, high = np.quantile(known, [0.0005, 0.9995])
    if high <= low:
        return None
    cycles, crowding = _crowding(known, low, high)
    best = _peak(cycles, crowding, _FEWEST, _MOST)
    beside = (cycles >= 3) & (cycles <= best - 2)
    height = float(np.interp(best, cycles, crowding))
    if height < _LEAST_CROWDING or crowding[beside].max(initial=0) > _MOST_BESIDE * height:
        return None
    step = (high - low) / best
    phase = np.exp(2j * np.pi * heights / step)
    whole = np.nanmean(phase)
    if not _parts_agree(phase, whole):
        return None
    # Blur draws the rims of the outer bands inwards, and their plateaus not
    flat = _flat(heights, step)
    if flat.size > _LEAST_FLAT * known.size:
        step = (high - low) / _peak(*_crowding(flat, low, high), 0.94 * best, 1.06 * best)
        whole = np.mean(np.exp(2j * np.pi * flat / step))
    first = step * np.angle(whole) / (2 * np.pi)
    numbers = np.rint((heights - first) / step)
    if _jumps(numbers):
        return None
    # A level beyond the last that more than a few heights reach is an outlier's
    found = np.unique(numbers[np.isfinite(numbers)])
    return first + step * np.arange(found[0], found[-1] + 1)


def _crowding(heights: Array, low: float, high: float) -> tuple[Array, Array]:
    """Return numbers of steps from `low` to `high`, and the mean phase factor for each."""
    counts, _ = np.histogram(heights, _GRID, range=(low, high))
    factor = np.abs(scipy.fft.rfft(counts, 8 * _GRID)) / max(counts.sum(), 1)
    return np.arange(factor.size) / 8, factor


def _peak(cycles: Array, factor: Array, fewest: float, most: float) -> float:
    """Return the number of steps that most heights crowd at; the least of its like."""
    judged = (cycles >= fewest) & (cycles <= most)
    cycles, factor = cycles[judged], factor[judged]
    peaks = np.flatnonzero(factor >= _AS_HIGH * factor.max())
    coarsest = peaks[cycles[peaks] < cycles[peaks[0]] + 1]
    best = int(coarsest[factor[coarsest].argmax()])
    top = factor[max(best - 1, 0) : best + 2]
    shift = 0.0
    # The top of a parabola through three points
    if top.size == 3 and 2 * top[1] > top[0] + top[2]:
        shift = (top[2] - top[0]) / (2 * (2 * top[1] - top[0] - top[2]))
    return float(cycles[best] + shift / 8)


def _flat(heights: Array, step: float) -> Array:
    """Return the heights that differ little from the next ones along both axes. [um]"""
    here = heights[1:-1, 1:-1]
    flat = np.ones(here.shape, dtype=bool)
    for near in (
        heights[:-2, 1:-1],
        heights[2:, 1:-1],
        heights[1:-1, :-2],
        heights[1:-1, 2:],
    ):
        flat &= np.abs(near - here) < _FLAT * step
    return here[flat]


def _parts_agree(phase: Array, whole: complex) -> bool:
    """Tell whether the parts of the map crowd at the same levels."""
    agreement = (phase * np.conj(whole) / abs(whole)).real
    # Along each axis: grooves are alike along one
    for axis in (0, 1):
        parts = np.array_split(agreement, _PARTS, axis=axis)
        means = np.array([np.nanmean(part) for part in parts if np.isfinite(part).any()])
        if means.size < _PARTS // 2:
            return False
        error = means.std(ddof=1) / np.sqrt(means.size)
        if means.mean() <= _LEAST_AGREEMENT * error:
            return False
    return True


def _jumps(numbers: Array) -> bool:
    """Tell whether neighbours skip levels more often than those of a random surface.

    Structures with several flat levels do, which are no fault of the map.
    """
    for axis in (0, 1):
        steps = np.abs(np.diff(numbers, axis=axis))
        steps = steps[np.isfinite(steps)]
        unequal = float(np.mean(steps > 0))
        if unequal == 0:
            continue
        expected = _share_of_jumps(unequal)
        if np.mean(steps > 1) / unequal > 3 * expected + _MOST_JUMPS:
            return True
    return False


def _share_of_jumps(unequal: float) -> float:
    """Return the share of steps over two levels and more, of normal increments."""
    sd = np.geomspace(0.02, 50, 200)

    def within(reach: float) -> Array:
        """Chance that heights of a normal increment differ by less than `reach` levels."""
        # The mean of max(0, reach - |d|) over the normal d
        z = reach / sd
        return reach * (2 * special.ndtr(z) - 1) - sd * np.sqrt(2 / np.pi) * (
            1 - np.exp(-(z**2) / 2)
        )

    steps = 1 - within(1.0)
    jumps = 1 - (within(2.0) - within(1.0))
    return float(np.interp(unequal, steps, jumps / np.maximum(steps, 1e-12)))
