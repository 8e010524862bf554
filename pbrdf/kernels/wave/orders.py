"""Sums over the orders of scattering, for heights of any number of wavelengths.

Order n of a Gaussian surface has the Poisson weight e^{-g} g^n/n!, g = q^2 h^2, and the
spectrum of the n-th power of the autocorrelation. With few orders the sum is taken term by
term; with many, its terms are a smooth bell and every s-th of them gives the sum to
exp(-2 pi^2 (width/s)^2). Nothing overflows, and the two meet to rounding.
"""

from math import exp, log, log1p, sqrt

import numpy as np

from pbrdf.kernels import jit

__all__ = ["EXPONENTIAL", "GAUSSIAN", "fill_moments"]

# Autocorrelations whose powers have spectra in closed form
GAUSSIAN, EXPONENTIAL = range(2)

# Half-width of a window in standard deviations, and terms in one: both leave 1e-15
REACH, TERMS_IN_WIDTH = 8.5, 1.3
LEAST_EXPONENT = -745.0
TWO_PI = 2.0 * np.pi


@jit
def heaviest_order(g, kappa):
    """Order where g^n/n! exp(-kappa/n) is largest, from n^2 ln(n/g) = kappa."""
    target = 2.0 * kappa / (g * g)
    # Newton's steps for y ln y = target, y = (n/g)^2
    y = 1.0 + target / (1.0 + log1p(target))
    for _ in range(8):
        y = (y + target) / (1.0 + log(y))
    return g * sqrt(y)


@jit
def poisson_weight(n, g):
    """e^{-g} g^n/n! to full accuracy for n above 10 or so.

    C. Loader, Fast and Accurate Computation of Binomial Probabilities (2000).
    """
    t = (n - g) / g
    if abs(t) < 0.03:
        # (1+t) ln(1+t) - t as a series, where it would cancel
        deviance, power = 0.0, t
        for k in range(2, 12):
            power = -power * t
            deviance -= power / (k * (k - 1))
    else:
        deviance = (1.0 + t) * log(n / g) - t
    n2 = n * n
    stirling = (1.0 / 12 - (1.0 / 360 - (1.0 / 1260 - 1.0 / 1680 / n2) / n2) / n2) / n
    exponent = -g * deviance - stirling
    return 0.0 if exponent < LEAST_EXPONENT else exp(exponent) / sqrt(TWO_PI * n)


@jit(forceinline=True)
def spectrum_of_order(law, dimensions, n, kappa):
    """Spectrum of the n-th power over that of a unit length; kappa = (K l)^2/4."""
    if law == GAUSSIAN:
        exponent = -kappa / n
        bell = 0.0 if exponent < LEAST_EXPONENT else exp(exponent)
        return bell * (sqrt(np.pi / n) if dimensions == 1 else np.pi / n)
    square = n * n + 4.0 * kappa
    return 2.0 * n / square if dimensions == 1 else TWO_PI * n / (square * sqrt(square))


@jit
def order_moments(law, dimensions, g, kappa):
    """Sum weight, spectrum and n^2, n, 1, 1/n or 1/n^2 over n, the length being 1."""
    middle = max(heaviest_order(g, kappa) if law == GAUSSIAN else g, 1.0)
    width = 1.0 / sqrt(1.0 / middle + (2.0 * kappa / middle**3 if law == GAUSSIAN else 0.0))
    last = middle + REACH * width + 14.0
    first, step = 1.0, 1.0
    if middle - REACH * width > 12.0:
        step = max(np.floor(width / TERMS_IN_WIDTH), 1.0)
        first = np.floor(middle - REACH * width)
    term_by_term = first == 1.0
    weight = exp(-g) if g < 700.0 else 0.0
    rising, mean, total, falling, steep = 0.0, 0.0, 0.0, 0.0, 0.0
    n = first
    while n <= last:
        weight = weight * g / n if term_by_term else poisson_weight(n, g)
        term = step * weight * spectrum_of_order(law, dimensions, n, kappa)
        total += term
        mean += n * term
        rising += n * n * term
        falling += term / n
        steep += term / (n * n)
        n += step
    return rising, mean, total, falling, steep


@jit
def fill_moments(law, dimensions, height, length, spacing, rise, out):
    """Fill out[:, k] with the moments of geometry k.

    height and length are k h and k l; `spacing` is the lateral wave vector K/k, `rise` the
    normal one q/k.
    """
    for k in range(spacing.size):
        g = (rise[k] * height[k]) ** 2
        kappa = 0.25 * (spacing[k] * length[k]) ** 2
        unit = length[k] if dimensions == 1 else length[k] * length[k]
        moments = order_moments(law, dimensions, g, kappa)
        for j in range(5):
            out[j, k] = unit * moments[j]
