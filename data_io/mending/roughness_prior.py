r"""Autocorrelation of the true surface under a terraced map, from its own increments.

The mean square increment of Gaussian heights rounded to a step q is known in closed form,

.. math::
   D_q = D + \frac{q^2}{6}
       - \frac{q^2}{\pi^2} \sum_k \frac{1}{k^2} e^{-2 \pi^2 k^2 D / q^2}

with D that of the heights before rounding. A Matérn form, with noise before rounding, is
fitted to the increments along rows, columns and both diagonals.
"""

from dataclasses import dataclass

import numpy as np
import scipy.fft
from scipy import ndimage, optimize, special

Array = np.ndarray

# Matérn forms smoother than this are Gaussian
_SMOOTHEST = 20.0
_DIRECTIONS = np.array([[1, 0], [0, 1], [1, 1], [1, -1]])


@dataclass(frozen=True, eq=False)
class Prior:
    """Random surface in steps of the grid.

    Parameters
    ----------
    variance : float
        Of the heights. [um²]
    smoothness : float
        Of the Matérn form; 20 and more is Gaussian.
    metric : ndarray, shape (2, 2)
        Squared distance of (i, j) steps is their product with it, in correlation lengths.
    noise : float
        Variance of white noise before rounding. [um²]
    """

    variance: float
    smoothness: float
    metric: Array
    noise: float

    @property
    def longest(self) -> float:
        """Longest correlation length over all directions. [steps]"""
        return float(1 / np.sqrt(np.linalg.eigvalsh(self.metric)[0]))

    def correlation_to_nearest(self, known: Array) -> Array:
        """Autocorrelation of every node's height with the nearest known one."""
        if known.all():
            return np.ones(known.shape)
        distance = ndimage.distance_transform_edt(
            ~known, sampling=np.sqrt(np.diag(self.metric))
        )
        return correlation(distance, self.smoothness)

    def spectrum(self, shape: tuple[int, int]) -> Array:
        """Power of each coefficient of `rfft2`, over the number of nodes. [um²]"""
        i, j = (np.minimum(np.arange(n), n - np.arange(n)) * 1.0 for n in shape)
        signed_i = np.where(np.arange(shape[0]) > shape[0] / 2, -i, i)[:, None]
        signed_j = np.where(np.arange(shape[1]) > shape[1] / 2, -j, j)
        m = self.metric
        square = m[0, 0] * signed_i**2 + m[1, 1] * signed_j**2
        square = square + 2 * m[0, 1] * signed_i * signed_j
        rho = correlation(np.sqrt(np.maximum(square, 0)), self.smoothness)
        power = scipy.fft.rfft2(rho, workers=1).real
        # What the torus cuts off a long correlation would be negative
        return self.variance * np.maximum(power, 1e-12 * power.max())


def correlation(distance: Array, smoothness: float) -> Array:
    """Matérn autocorrelation at a distance in correlation lengths, exp(-r²) if smooth."""
    if smoothness >= _SMOOTHEST:
        return np.exp(-(distance**2))
    scaled = np.maximum(2 * np.sqrt(smoothness) * distance, 1e-10)
    log = (1 - smoothness) * np.log(2) - special.gammaln(smoothness)
    bessel = special.kve(smoothness, scaled)
    with np.errstate(divide="ignore"):
        log = log + smoothness * np.log(scaled) + np.log(bessel) - scaled
    return np.where(distance < 1e-9, 1.0, np.exp(np.minimum(log, 0.0)))


def rounded(increment: Array, step: float) -> Array:
    """Mean square increment of heights rounded to a step, from that before. [um²]"""
    k = np.arange(1, 201)[:, None]
    decay = np.exp(-2 * (np.pi * k / step) ** 2 * increment)
    return increment + step**2 * (1 / 6 - np.sum(decay / k**2, axis=0) / np.pi**2)


def fit_prior(heights: Array, step: float) -> Prior:
    """Fit the surface under a map in bands.

    Parameters
    ----------
    heights : ndarray, shape (nx, ny)
        In bands; NaN where missing. [um]
    step : float
        Mean width of the bands. [um]
    """
    variance = float(np.nanvar(heights))
    lags, squares = _increments(heights, variance)

    def model(p: Array) -> Array:
        metric = _metric(p)
        distance = np.sqrt(np.einsum("ni,ij,nj->n", lags, metric, lags))
        rho = correlation(distance, _smoothness(p[4]))
        before = 2 * np.exp(p[0]) * (1 - rho) + 2 * step**2 * np.exp(p[5])
        return np.log(rounded(before, step) / squares)

    first = _first_length(lags, squares, variance)
    # From a smooth and from a jagged surface
    starts = [
        np.array([np.log(variance), *(-np.log(first),) * 2, 0.0, smooth, -4.0])
        for smooth in (2.5, -0.5)
    ]
    fits = [optimize.least_squares(model, start, max_nfev=80) for start in starts]
    p = min(fits, key=lambda fit: float(fit.cost)).x
    return Prior(
        float(np.exp(p[0])), _smoothness(p[4]), _metric(p), step**2 * float(np.exp(p[5]))
    )


def _smoothness(logit: float) -> float:
    """Smoothness from 0.5 to Gaussian over the whole line."""
    return 0.5 + (_SMOOTHEST - 0.45) / (1 + np.exp(-logit))


def _metric(p: Array) -> Array:
    a, b = np.exp(2 * np.clip(p[1:3], -12, 5))
    c = np.tanh(p[3]) * 0.999 * np.sqrt(a * b)
    return np.array([[a, c], [c, b]])


def _increments(heights: Array, variance: float) -> tuple[Array, Array]:
    """Return lags [steps] and mean square increments up to half the variance or so."""
    lags, squares = [], []
    for direction in _DIRECTIONS:
        reach = min(n // 3 for n, d in zip(heights.shape, direction, strict=True) if d)
        for k in np.unique(np.round(np.geomspace(1, max(reach, 2), 24)).astype(int)):
            i, j = int(k * direction[0]), int(k * direction[1])
            nx, ny = heights.shape
            ahead = heights[i:, max(j, 0) : ny + min(j, 0)]
            behind = heights[: nx - i, max(-j, 0) : ny - max(j, 0)]
            square = float(np.nanmean((ahead - behind) ** 2))
            if square > 0:
                lags.append((i, j))
                squares.append(square)
            if square > 1.2 * variance:
                break
    return np.array(lags, dtype=float), np.array(squares)


def _first_length(lags: Array, squares: Array, variance: float) -> float:
    """Return the lag where the increments reach 1 - 1/e of their height. [steps]"""
    distance = np.hypot(*lags.T)
    near = np.abs(np.log(squares / (2 * variance * (1 - np.exp(-1)))))
    return float(distance[np.argmin(near)])
