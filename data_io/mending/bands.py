"""Terraces of a map: bands of equal heights left by a digitised picture or 8-bit export."""

from dataclasses import dataclass

import numpy as np

from data_io.mending.comb import find_comb

Array = np.ndarray

# Fewer levels are a surface of steps, or one that was drawn
FEWEST_LEVELS = 6
# Equal heights of neighbours, as a share; noise and slopes of a finer step leave few
LEAST_EQUAL = 0.1
# Share of heights on plateaus; blur of a picture leaves others at their rims
_ON_PLATEAUS = 0.25
_MOST_LEVELS = 1000
# Heights that a blurred rim may take between two plateaus
_RIM = 12
# Steps between the terraces of crystals are lower; pictures smear none so narrow [um]
_LATTICE = 0.002
# Heights of blurred rims can be as many as to pass for levels: of many, or of a few beside
# even ones, nearly all of which are among them to this [1], [1], [steps]
_COARSER = 0.8
_SHARED, _AT_LEVEL = 0.9, 0.15


@dataclass(frozen=True, eq=False)
class Bands:
    """Levels of a terraced map, and the band of heights that each stands for.

    Parameters
    ----------
    levels : ndarray, shape (n,)
        Rising. [um]
    edges : ndarray, shape (n + 1,)
        Between neighbouring levels, and half a band beyond the first and last. [um]
    equal : float
        Share of neighbouring heights that are equal, or of the same band if `smeared`. [1]
    smeared : bool
        Heights crowd at the levels, as in a picture that was blurred or got noise after
        digitisation.
    """

    levels: Array
    edges: Array
    equal: float
    smeared: bool = False

    @property
    def width(self) -> float:
        """Mean width of the bands. [um]"""
        return float(np.mean(np.diff(self.edges)))

    @property
    def may_be_real(self) -> bool:
        """Whether they may be terraces of a crystal, measured with noise."""
        return self.smeared and self.width < _LATTICE

    def __str__(self) -> str:
        words = "of one band, blurred or with noise" if self.smeared else "equal"
        return (
            f"{self.equal:.0%} of neighbouring heights are {words}, in "
            f"{self.levels.size} bands of {self.width:.3g} um"
        )

    def limits(self, heights: Array) -> tuple[Array, Array]:
        """Lowest and highest true height at every node, infinite where missing. [um]

        A height between two plateaus, as blur leaves it, counts to the nearer one.
        """
        known = np.isfinite(heights)
        place = _place(self.edges, np.where(known, heights, 0.0))
        low = np.where(known, self.edges[place], -np.inf)
        return low, np.where(known, self.edges[place + 1], np.inf)


def equal_neighbours(heights: Array) -> float:
    """Share of pairs of neighbouring heights that are equal, along the axis of fewer.

    Grooves are equal along one axis without being bands.
    """
    shares = []
    for axis in range(heights.ndim):
        difference = np.diff(heights, axis=axis)
        known = np.isfinite(difference)
        equal = np.abs(difference[known]) <= _tolerance(heights)
        shares.append(float(equal.mean()) if equal.size else 0.0)
    return min(shares)


def _tolerance(heights: Array) -> float:
    """Heights that differ by rounding of the file are one. [um]"""
    return 1e-6 * float(np.nanmax(heights) - np.nanmin(heights))


def find_bands(heights: Array) -> Bands | None:
    """Find the levels of a terraced map; None if its heights are not in bands.

    A level is a height that neighbours share; a quarter of all heights must lie on levels,
    of which there are at least six, and a tenth of all neighbours must be equal. Where
    blur or noise came after digitisation, levels are even, and heights crowd at them.

    Parameters
    ----------
    heights : ndarray, shape (nx, ny)
        As measured, before any form is removed; NaN where missing. [um]

    Examples
    --------
    >>> x = np.arange(60.0)
    >>> find_bands(np.round(8 * np.sin(x / 7) + np.cos(x[:, None] / 5))).width
    1.0
    >>> find_bands(np.sin(x / 7) + np.cos(x[:, None] / 5)) is None
    True
    """
    known = heights[np.isfinite(heights)]
    if known.size < 100 or np.ptp(known) == 0:
        return None
    sharp = _sharp_bands(heights, known)
    comb = find_comb(heights)
    if comb is None or comb.size < FEWEST_LEVELS:
        return sharp
    if sharp is not None and not _passes_for_more(sharp.levels, comb):
        return sharp
    edges = _edges(comb)
    equal = equal_neighbours(np.where(np.isfinite(heights), _place(edges, heights), np.nan))
    return Bands(comb, edges, equal, smeared=True) if equal >= LEAST_EQUAL else None


def _passes_for_more(sharp: Array, comb: Array) -> bool:
    """Tell whether heights of blurred rims are among the levels that heights take exactly.

    Blur, and rounding to the colours of a picture, split a level or put one between two.
    """
    if comb.size <= _COARSER * sharp.size:
        return True
    step = comb[1] - comb[0]
    apart = np.abs(comb - sharp[_nearest(sharp, comb)])
    return comb.size < sharp.size and bool(np.mean(apart < _AT_LEVEL * step) > _SHARED)


def _sharp_bands(heights: Array, known: Array) -> Bands | None:
    """Find levels that heights take exactly."""
    equal = equal_neighbours(heights)
    if equal < LEAST_EQUAL:
        return None
    levels = _plateaus(heights)
    if not FEWEST_LEVELS <= levels.size <= _MOST_LEVELS:
        return None
    near = np.abs(known - levels[_nearest(levels, known)])
    if np.mean(near <= 2 * _tolerance(heights)) < _ON_PLATEAUS:
        return None
    return Bands(levels, _edges(levels), equal)


def _plateaus(heights: Array) -> Array:
    """Return the heights that many neighbours share, each once. [um]"""
    tolerance = _tolerance(heights)
    shared = []
    for axis in range(heights.ndim):
        difference = np.diff(heights, axis=axis)
        first = heights[:-1] if axis == 0 else heights[:, :-1]
        shared.append(first[np.abs(difference) <= tolerance])
    values = np.sort(np.concatenate(shared))
    starts = np.concatenate([[0], np.flatnonzero(np.diff(values) > 2 * tolerance) + 1])
    counts = np.diff(np.concatenate([starts, [values.size]]))
    found = values[starts + counts // 2]
    known = np.sort(heights[np.isfinite(heights)])
    ends = [np.searchsorted(known, found + side * 2 * tolerance) for side in (-1, 1)]
    return found[~_between_plateaus(counts, counts / np.maximum(ends[1] - ends[0], 1))]


def _between_plateaus(counts: Array, shared: Array) -> Array:
    """Tell which heights are blurred rims of the bands on either side.

    They are rarer than others on both sides of them, much rarer or less often shared with
    a neighbour. Beyond the last of the others they are bands that few nodes reach.

    Parameters
    ----------
    counts : ndarray, shape (n,)
        Neighbours that share each height.
    shared : ndarray, shape (n,)
        The same for each node of that height.
    """
    places = np.pad(np.arange(counts.size), _RIM, constant_values=counts.size)
    window = np.lib.stride_tricks.sliding_window_view(places, _RIM)
    counted, often = np.append(counts, 0), np.append(shared, 0.0)
    sides = []
    for near in (window[: counts.size], window[_RIM + 1 :]):
        most = np.take_along_axis(near, counted[near].argmax(axis=1)[:, None], axis=1)[:, 0]
        sides.append((counted[most], often[most]))
    rarer = np.minimum(sides[0][0], sides[1][0]) / np.maximum(counts, 1)
    lonelier = np.minimum(sides[0][1], sides[1][1]) > 2 * shared
    enough = np.minimum(sides[0][0], sides[1][0]) > counts + 10
    return np.asarray(enough & ((rarer > 4) | ((rarer > 1.5) & lonelier)))


def _place(edges: Array, values: Array) -> Array:
    """Return the band of each value."""
    return np.searchsorted(edges[1:-1], values)


def _nearest(levels: Array, values: Array) -> Array:
    """Return the place of the nearest level of each value."""
    return np.searchsorted((levels[1:] + levels[:-1]) / 2, values)


def _edges(levels: Array) -> Array:
    """Return the limits of the bands: half way, but no wider than others nearby."""
    gaps = np.diff(levels)
    # A level that no node has is no reason to make its neighbours wider
    usual = np.array([np.median(gaps[max(i - 4, 0) : i + 5]) for i in range(gaps.size)])
    half = np.minimum(gaps, 1.5 * usual) / 2
    middle = (levels[1:] + levels[:-1]) / 2
    middle = np.where(gaps > 1.5 * usual, levels[:-1] + half, middle)
    first, last = levels[0] - half[0], levels[-1] + half[-1]
    return np.concatenate([[first], middle, [last]])
