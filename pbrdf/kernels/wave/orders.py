"""Sums over the orders of scattering, for heights of any number of wavelengths.

Order n of a Gaussian surface has the Poisson weight e^{-g} g^n/n!, g = q^2 h^2, and the
spectrum of the n-th power of the autocorrelation. With few orders the sum is taken term by
term; with many, its terms are a smooth bell and every s-th of them gives the sum to
exp(-2 pi^2 (width/s)^2). Nothing overflows, and the two meet to rounding.
"""

from math import exp, log, log1p, sqrt, tau

import numpy as np

from pbrdf.kernels import jit
from pbrdf.kernels.optics.elementary import exp as fast_exp

__all__ = ["EXPONENTIAL", "GAUSSIAN", "fill_moments"]

# Autocorrelations whose powers have spectra in closed form
GAUSSIAN, EXPONENTIAL = range(2)

# Half-width of a window in standard deviations, and terms in one: both leave 1e-15
REACH, TERMS_IN_WIDTH = 8.5, 1.3
LEAST_EXPONENT = -745.0
# Heaviest order below which sums surely begin at the first
COARSE = 12.0
# Orders whose spectra are found together
TOGETHER = 64


@jit(part=True)
def heaviest_order(g, kappa):
    """Order where g^n/n! exp(-kappa/n) is largest, from n^2 ln(n/g) = kappa.

    To 2 % where it is small, as the end of a sum term by term needs no more; else to far
    less than the width of the bell.
    """
    target = 2.0 * kappa / (g * g)
    if target < 0.1:
        return g * (1.0 + 0.5 * target)
    # Newton's steps for y ln y = target, y = (n/g)^2; they come from above
    y = 1.0 + target / (1.0 + log1p(target))
    y = (y + target) / (1.0 + log(y))
    if g * sqrt(y) > COARSE:
        for _ in range(2):
            y = (y + target) / (1.0 + log(y))
    return g * sqrt(y)


@jit(part=True)
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
    return 0.0 if exponent < LEAST_EXPONENT else exp(exponent) / sqrt(tau * n)


@jit(forceinline=True)
def spectrum_of_order(law, dimensions, inverse, kappa):
    """Spectrum of the power n = 1/inverse over that of a unit length; kappa = (K l)^2/4."""
    if law == GAUSSIAN:
        bell = fast_exp(-kappa * inverse)
        return bell * (sqrt(np.pi * inverse) if dimensions == 1 else np.pi * inverse)
    fall = 1.0 / (1.0 + 4.0 * kappa * inverse * inverse)
    if dimensions == 1:
        return 2.0 * inverse * fall
    return tau * inverse * inverse * fall * sqrt(fall)


@jit(forceinline=True)
def window(law, g, kappa):
    """First and last order and the step of a sum that leaves nothing out."""
    gaussian = law == GAUSSIAN
    middle = max(heaviest_order(g, kappa) if gaussian else g, 1.0)
    curvature = 1.0 / middle
    if gaussian:
        curvature *= 1.0 + 2.0 * kappa / (middle * middle)
    width = 1.0 / sqrt(curvature)
    first, last = np.floor(middle - REACH * width), middle + REACH * width + 14.0
    if first < 12.0:
        return 1.0, last, 1.0
    return first, last, max(np.floor(width / TERMS_IN_WIDTH), 1.0)


@jit(forceinline=True)
def summed(moments, n, inverse, term):
    """Moments of n^2, n, 1, 1/n, 1/n^2 with those of one more term."""
    rising, mean, total, falling, steep = moments
    less, more = term * inverse, term * n
    return (
        rising + n * more,
        mean + more,
        total + term,
        falling + less,
        steep + less * inverse,
    )


@jit(part=True)
def next_spectra(law, dimensions, start, count, kappa, inverses, spectra):
    """Fill 1/n and the spectra of some orders from `start` on.

    Each loop knows its law but not its length, so that it becomes vector instructions.
    """
    for k in range(count):
        inverses[k] = 1.0 / (start + k)
    if law == GAUSSIAN:
        for k in range(count):
            spectra[k] = spectrum_of_order(GAUSSIAN, 2, inverses[k], kappa)
        if dimensions == 1:
            for k in range(count):
                spectra[k] /= sqrt(np.pi * inverses[k])
    elif dimensions == 1:
        for k in range(count):
            spectra[k] = spectrum_of_order(EXPONENTIAL, 1, inverses[k], kappa)
    else:
        for k in range(count):
            spectra[k] = spectrum_of_order(EXPONENTIAL, 2, inverses[k], kappa)


@jit(part=True)
def order_moments(law, dimensions, g, kappa, inverses, spectra):
    """Sum weight, spectrum and n^2, n, 1, 1/n or 1/n^2 over n, the length being 1."""
    first, last, step = window(law, g, kappa)
    moments = 0.0, 0.0, 0.0, 0.0, 0.0
    if first > 1.0:
        n = first
        while n <= last:
            inverse = 1.0 / n
            spectrum = spectrum_of_order(law, dimensions, inverse, kappa)
            term = step * poisson_weight(n, g) * spectrum
            moments = summed(moments, n, inverse, term)
            n += step
        return moments
    weight, end = exp(-g), np.int64(last) + 1
    for start in range(1, end, TOGETHER):
        count = min(TOGETHER, end - start)
        next_spectra(law, dimensions, start, count, kappa, inverses, spectra)
        for k in range(count):
            weight *= g * inverses[k]
            term = weight * spectra[k]
            moments = summed(moments, float(start + k), inverses[k], term)
    return moments


@jit
def fill_moments(law, dimensions, height, length, spacing, rise, out):
    """Fill out[:, k] with the moments of geometry k.

    height and length are k h and k l; `spacing` is the lateral wave vector K/k, `rise` the
    normal one q/k.
    """
    inverses, spectra = np.empty(TOGETHER), np.empty(TOGETHER)
    for k in range(spacing.size):
        g = (rise[k] * height[k]) ** 2
        kappa = 0.25 * (spacing[k] * length[k]) ** 2
        unit = length[k] if dimensions == 1 else length[k] * length[k]
        moments = order_moments(law, dimensions, g, kappa, inverses, spectra)
        for j in range(5):
            out[j, k] = unit * moments[j]
