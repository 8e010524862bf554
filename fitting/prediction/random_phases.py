"""Other surfaces with the heights and the spectrum of a map, their phases at random."""

import numpy as np
import scipy.fft

from pbrdf.surface.heightmap import HeightMap
from pbrdf.surface.mend import mirror_edges

Array = np.ndarray

# Rounds after which heights and spectrum agree to a per cent
_ROUNDS = 12


def redrawn(surface: HeightMap, *, seed: int) -> HeightMap:
    """Draw a surface with the autocorrelation and the height distribution of a map.

    Heights in a random order take the amplitudes of the map's Fourier components and the
    distribution of its heights in turn (T. Schreiber and A. Schmitz, Phys. Rev. Lett. 77,
    635, 1996). The spectrum has the last word, for slopes come from it. A map with rims is
    mirrored at them first, so that they are no steps, and cut out again. Differences of its
    reflectance from that of the map itself are those of the order of its heights: pits and
    ridges, and places that are rougher than others.

    Parameters
    ----------
    surface : HeightMap
        Without holes and level. [um]

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> pits = HeightMap(-np.square(rng.standard_normal((64, 64))), 1.0, periodic=True)
    >>> other = redrawn(pits, seed=2)
    >>> bool(abs(other.heights.std() / pits.heights.std() - 1) < 1e-6)
    True
    """
    heights = surface.heights if surface.periodic else mirror_edges(surface.heights)
    amplitude = np.abs(scipy.fft.rfft2(heights, workers=1))
    ranked = np.sort(heights, axis=None)
    rng = np.random.default_rng(seed)
    drawn = rng.permutation(ranked).reshape(heights.shape)
    for _ in range(_ROUNDS):
        waves = scipy.fft.rfft2(_ranked_as(drawn, ranked), workers=1)
        turned = amplitude * np.exp(1j * np.angle(waves))
        drawn = scipy.fft.irfft2(turned, s=heights.shape, workers=1)
    inside = tuple(slice(n) for n in surface.shape)
    return HeightMap(drawn[inside], surface.spacing, periodic=surface.periodic)


def _ranked_as(values: Array, ranked: Array) -> Array:
    """Return `ranked` in the order of some values."""
    result = np.empty(values.size)
    result[np.argsort(values, axis=None)] = ranked
    return result.reshape(values.shape)
