"""Surfaces whose slopes are known and not Gaussian."""

from collections.abc import Callable

import numpy as np

from pbrdf import HeightMap

Array = np.ndarray
# The point spread of the field below over its correlation length
_FIELD = np.pi**2 / 2


def _crater(g: Array) -> Array:
    return -(np.maximum(g - 0.8, 0) ** 2) - 0.15 * g


# Heights made of a Gaussian field of unit variance
KINDS: dict[str, Callable[[Array], Array]] = {
    "grains": lambda g: np.exp(0.6 * g),
    "pits": _crater,
    "ridges": lambda g: np.sqrt(0.15 + g**2),
}


def true_surface(
    kind: str, *, slope_rms: float, corr_length: float, nodes: int, step: float, seed: int
) -> HeightMap:
    """Return a periodic surface of a kind, of given rms slope per axis.

    Parameters
    ----------
    corr_length : float
        Of the Gaussian field that it is made of. [um]
    """
    rng = np.random.default_rng(seed)
    f = np.hypot(np.fft.fftfreq(nodes, step)[:, None], np.fft.fftfreq(nodes, step))
    white = np.fft.fft2(rng.standard_normal((nodes, nodes)))
    field = np.fft.ifft2(white * np.exp(-_FIELD * (f * corr_length) ** 2)).real
    heights = KINDS[kind](field / field.std())
    slopes = [(np.roll(heights, -1, axis) - heights) / step for axis in (0, 1)]
    scale = slope_rms / np.sqrt(np.mean(np.square(slopes)))
    return HeightMap((heights - heights.mean()) * scale, step, periodic=True)
