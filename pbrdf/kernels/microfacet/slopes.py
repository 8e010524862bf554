"""Densities of facet slopes, and the mean slope that a ray meets.

Every law is a function f(r^2) of the squared slope r^2, stretched along the two axes
where it is anisotropic: r^2 = (sy/sx) zx^2 + (sx/sy) zy^2, which conserves area. The facet
density of equation (17) is f / cos^4(tilt).
"""

from collections import namedtuple
from math import atan2, log, nan, pi, sqrt

import numpy as np

from pbrdf.kernels import jit
from pbrdf.kernels.optics.elementary import erf, exp
from pbrdf.kernels.optics.fresnel import TINY, select

__all__ = [
    "EXPONENTIAL",
    "GAUSSIAN",
    "MODIFIED_CAUCHY",
    "MODIFIED_GAUSSIAN",
    "TROWBRIDGE_REITZ",
    "Roughness",
    "mean_overhang",
    "slope_along",
    "slope_density",
    "slope_norm",
    "steepness",
]

GAUSSIAN, MODIFIED_GAUSSIAN, MODIFIED_CAUCHY, EXPONENTIAL, TROWBRIDGE_REITZ = range(5)

# law: one of the above; slope_x, slope_y: per-axis scale; isotropic: whether known equal;
# norm: from `slope_norm`
Roughness = namedtuple("Roughness", "law slope_x slope_y isotropic norm")

SQRT_3 = sqrt(3.0)
SQRT_PI = sqrt(pi)

# Gauss-Legendre rule on (0, 1) for the integral over slopes
_nodes, _weights = np.polynomial.legendre.leggauss(64)
NODES = tuple((0.5 + 0.5 * _nodes).tolist())
WEIGHTS = tuple((0.5 * _weights).tolist())


@jit(part=True)
def scaled_erfc(x):
    """exp(x^2) erfc(x) for x > 0: directly if small, else by its continued fraction."""
    small = select(x < 1.5, x, 1.5)
    large = select(x < 1.5, 1.5, x)
    fraction = large
    for k in range(100, 0, -1):
        fraction = large + 0.5 * k / fraction
    direct = exp(small * small) * (1.0 - erf(small))
    return select(x < 1.5, direct, 1.0 / (SQRT_PI * fraction))


@jit
def slope_norm(law, slope_x, slope_y):
    """Factor that makes the density integrate to 1 over all slopes: equation (18)."""
    variance = slope_x * slope_y
    if law == MODIFIED_GAUSSIAN:
        # <1/sqrt(1 + r^2)> over the Gaussian
        x = 1.0 / sqrt(2.0 * variance)
        return 1.0 / (SQRT_PI * x * scaled_erfc(x))
    if law == MODIFIED_CAUCHY:
        # integral of u^2/(variance u^2 + 1 - u^2) over u = cos(tilt) in (0, 1)
        gap = 1.0 - variance
        root = sqrt(abs(gap) + TINY)
        atanh = 0.5 * log((1.0 + root) / abs(1.0 - root))
        wide = atan2(root, 1.0)
        mean = select(gap > 0.0, atanh / root - 1.0, 1.0 - wide / root) / (abs(gap) + TINY)
        # Both forms are 0/0 at variance 1: the series there
        series = 1.0 / 3.0 + gap * (
            0.2 + gap * (1.0 / 7.0 + gap * (1.0 / 9.0 + gap / 11.0))
        )
        return 1.0 / (2.0 * pi * select(abs(gap) < 1e-3, series, mean))
    return 1.0 + 0.0 * variance


@jit(forceinline=True)
def radial_density(rough, r2):
    """Density f(r^2) of the stretched slope, per unit slope area."""
    variance = rough.slope_x * rough.slope_y
    if rough.law == GAUSSIAN:
        return exp(-0.5 * r2 / variance) / (2.0 * pi * variance)
    if rough.law == MODIFIED_GAUSSIAN:
        gauss = exp(-0.5 * r2 / variance) / (2.0 * pi * variance)
        return rough.norm * gauss / sqrt(1.0 + r2)
    if rough.law == MODIFIED_CAUCHY:
        return rough.norm / ((variance + r2) * (1.0 + r2) * sqrt(1.0 + r2))
    if rough.law == EXPONENTIAL:
        decay = exp(-SQRT_3 * sqrt(r2 / variance + TINY))
        return 1.5 * decay / (pi * variance)
    if rough.law == TROWBRIDGE_REITZ:
        width2 = 2.0 * variance
        return width2 / (pi * (width2 + r2) * (width2 + r2))
    # A law that is named in a table and written nowhere
    return nan


@jit(forceinline=True)
def slope_density(rough, facet):
    """Probability density of the facet's slopes, per unit slope area."""
    if rough.isotropic:
        return radial_density(rough, facet.tan2_tilt)
    stretch = rough.slope_y / rough.slope_x
    r2 = facet.slope_x * facet.slope_x * stretch + facet.slope_y * facet.slope_y / stretch
    return radial_density(rough, r2)


@jit(forceinline=True)
def slope_along(rough, cos_phi, sin_phi):
    """Scale of the slopes along an azimuth."""
    if rough.isotropic:
        return rough.slope_x
    x = rough.slope_x * cos_phi
    y = rough.slope_y * sin_phi
    return sqrt(x * x + y * y)


@jit(part=True)
def overhang_integral(rough, cot):
    """Overhang of any radial law: (2/a) integral f(a^2 + x^2) (x - a atan(x/a)) x dx."""
    # Stretch x = scale z/(1 - z) so that core and tail both fall within (0, 1)
    scale = 2.0 * sqrt(rough.slope_x * rough.slope_y)
    total = 0.0
    for k in range(len(NODES)):
        rest = 1.0 - NODES[k]
        x = scale * NODES[k] / rest
        lever = x * (x - cot * atan2(x, cot)) * scale / (rest * rest)
        total = total + WEIGHTS[k] * lever * radial_density(rough, cot * cot + x * x)
    return 2.0 * total / cot


@jit(forceinline=True)
def steepness(cos_theta, sin_theta, slope):
    """Smith's nu = cot(theta) / (sqrt(2) slope) of a ray over Gaussian slopes."""
    return cos_theta / (sqrt(2.0) * slope * sin_theta + 1e-30)


@jit(forceinline=True)
def mean_overhang(rough, cos_theta, sin_theta, slope):
    """Smith's Lambda = <max(z' - cot theta, 0)> / cot theta for slopes z' along the ray.

    Closed forms: B. Smith, IEEE Trans. Antennas Propag. 15, 668 (1967), Gaussian; B. Walter
    et al., Microfacet models for refraction (2007), Trowbridge-Reitz.
    """
    if rough.law == GAUSSIAN:
        nu = steepness(cos_theta, sin_theta, slope)
        return 0.5 * (exp(-nu * nu) / (nu * SQRT_PI) + erf(nu) - 1.0)
    cot = cos_theta / (sin_theta + 1e-30)
    if rough.law == TROWBRIDGE_REITZ:
        x = 2.0 * slope * slope / (cot * cot)
        # sqrt(1 + x) - 1 without its cancellation
        return 0.5 * x / (1.0 + sqrt(1.0 + x))
    # A stretched law along this azimuth is the isotropic one with the ray scaled
    return overhang_integral(rough, cot * sqrt(rough.slope_x * rough.slope_y) / slope)
