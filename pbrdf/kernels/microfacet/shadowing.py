"""Shadowing and masking factors, from 0 (hidden) to 1."""

from collections import namedtuple
from math import atan2, nan, sqrt

from pbrdf.kernels import jit
from pbrdf.kernels.microfacet.slopes import mean_overhang, slope_along, steepness
from pbrdf.kernels.optics.elementary import erf, exp
from pbrdf.kernels.optics.fresnel import TINY, select

__all__ = [
    "MAXWELL_BEARD",
    "NONE",
    "SMITH",
    "SMITH_CORRELATED",
    "SMITH_DIRECTION",
    "SMITH_UNCORRELATED",
    "TORRANCE_SPARROW",
    "Shadowing",
    "combined_overhangs",
    "shadowing_factor",
]

(
    NONE,
    MAXWELL_BEARD,
    TORRANCE_SPARROW,
    SMITH,
    SMITH_UNCORRELATED,
    SMITH_CORRELATED,
    SMITH_DIRECTION,
) = range(7)

# rule: one of the above; omega, tau: constants of Maxwell and Beard in radians
Shadowing = namedtuple("Shadowing", "rule omega tau")


@jit(part=True)
def maxwell_beard(facet, omega, tau):
    """Empirical equation (21): (1 + tilt/Omega exp(-2 beta/tau))/(1 + tilt/Omega)."""
    tilt = atan2(sqrt(facet.tan2_tilt + TINY), 1.0)
    beta = atan2(sqrt(facet.sin2_beta + TINY), facet.cos_beta)
    ratio = tilt / omega
    return (1.0 + ratio * exp(-2.0 * beta / tau)) / (1.0 + ratio)


@jit
def torrance_sparrow(way, facet):
    """Symmetric V-groove: min(1, 2 cos(tilt) cos(theta)/cos(beta)) over both directions."""
    # cos(tilt)/cos(beta) = 2/(sum_cos (1 + tan^2 tilt))
    lower = select(way.cos_i < way.cos_s, way.cos_i, way.cos_s)
    open_part = 4.0 * lower / ((way.cos_i + way.cos_s) * (1.0 + facet.tan2_tilt))
    return select(open_part < 1.0, open_part, 1.0)


@jit(part=True)
def facing_up(cos_theta, sin_theta, slope):
    """Numerator 1 - erfc(nu)/2 of Smith 1967: the part of the facets turned to the ray."""
    return 0.5 * (1.0 + erf(steepness(cos_theta, sin_theta, slope)))


@jit(part=True)
def direction_weight(way):
    """How far the two hidings are independent: 0 at one azimuth, 4.41 d/(4.41 d + 1) at d.

    B. van Ginneken, M. Stavridi, J. Koenderink, Appl. Opt. 37, 130 (1998).
    """
    azimuth = 2.0 * atan2(abs(way.sin_h), abs(way.cos_h))
    return 4.41 * azimuth / (4.41 * azimuth + 1.0)


@jit(forceinline=True)
def combined_overhangs(rule, way, lambda_i, lambda_s):
    """Statistical factor of both Lambda, without Smith's numerator of 1967."""
    if rule == SMITH_CORRELATED:
        return 1.0 / (1.0 + lambda_i + lambda_s)
    if rule == SMITH_DIRECTION:
        larger = select(lambda_i > lambda_s, lambda_i, lambda_s)
        smaller = select(lambda_i > lambda_s, lambda_s, lambda_i)
        return 1.0 / (1.0 + larger + direction_weight(way) * smaller)
    # That of 1967 has numerators of its own on top
    if rule in (SMITH, SMITH_UNCORRELATED):
        return 1.0 / ((1.0 + lambda_i) * (1.0 + lambda_s))
    # A rule that is named in a table and written nowhere
    return nan


@jit(forceinline=True)
def smith_factor(rule, way, rough):
    """Statistical factors built on Smith's Lambda of the two directions."""
    sin_dphi = 2.0 * way.sin_h * way.cos_h
    cos_dphi = 1.0 - 2.0 * way.sin_h * way.sin_h
    slope_i = slope_along(rough, way.cos_phi, way.sin_phi)
    slope_s = slope_along(
        rough,
        way.cos_phi * cos_dphi - way.sin_phi * sin_dphi,
        way.sin_phi * cos_dphi + way.cos_phi * sin_dphi,
    )
    lambda_i = mean_overhang(rough, way.cos_i, way.sin_i, slope_i)
    lambda_s = mean_overhang(rough, way.cos_s, way.sin_s, slope_s)
    both = combined_overhangs(rule, way, lambda_i, lambda_s)
    if rule != SMITH:
        return both
    up_i = facing_up(way.cos_i, way.sin_i, slope_i)
    return both * up_i * facing_up(way.cos_s, way.sin_s, slope_s)


@jit(forceinline=True)
def shadowing_factor(shadow, way, facet, rough):
    """Fraction of the facets that both the source and the detector see."""
    if shadow.rule == NONE:
        return 1.0
    if shadow.rule == MAXWELL_BEARD:
        return maxwell_beard(facet, shadow.omega, shadow.tau)
    if shadow.rule == TORRANCE_SPARROW:
        return torrance_sparrow(way, facet)
    return smith_factor(shadow.rule, way, rough)
