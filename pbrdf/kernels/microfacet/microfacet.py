"""The Mueller BRDF of a rough surface made of Fresnel facets, equation (20)."""

from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.microfacet.facet import directions, mirror_facet, rotated_elements
from pbrdf.kernels.microfacet.shadowing import (
    SMITH_CORRELATED,
    TORRANCE_SPARROW,
    Shadowing,
    combined_overhangs,
    shadowing_factor,
)
from pbrdf.kernels.microfacet.slopes import GAUSSIAN, Roughness, slope_density
from pbrdf.kernels.optics.elementary import cos, sin
from pbrdf.kernels.optics.fresnel import facet_elements
from pbrdf.kernels.optics.volume import Diffuse, added_elements, base_radiance

__all__ = [
    "Surface",
    "fill_brdf",
    "fill_facet_slopes",
    "fill_tabulated",
    "microfacet_brdf",
]

# rough, shadow, diffuse: the namedtuples of their modules
Surface = namedtuple("Surface", "rough shadow specular_gain diffuse")


@jit(forceinline=True)
def facet_density(way, facet, rough):
    """Lit facet area that mirrors one direction to the other: P / (4 cos_i cos_s). [1/sr]

    P = f/cos^4(tilt), the form in which (17), (18) and (20) agree with one another.
    """
    inv_cos2 = 1.0 + facet.tan2_tilt
    density = slope_density(rough, facet) * inv_cos2 * inv_cos2
    return density / (4.0 * way.cos_i * way.cos_s)


@jit(forceinline=True)
def brdf_rows(way, facet, strength, n, kappa, diffuse, radiance):
    """Rows of strength times F', plus the terms (22) and (23). [1/sr]"""
    a, b, c, d = facet_elements(facet.cos_beta, facet.sin2_beta, n, kappa)
    first, second, third, fourth = rotated_elements(
        way, strength * a, strength * b, strength * c, strength * d
    )
    m00, m01, m10, m11, m22 = added_elements(way, n, kappa, diffuse, radiance)
    return (
        (first[0] + m00, first[1] + m01, first[2], first[3]),
        (second[0] + m10, second[1] + m11, second[2], second[3]),
        (third[0], third[1], third[2] + m22, third[3]),
        (fourth[0], fourth[1], fourth[2], fourth[3] + m22),
    )


@jit(forceinline=True)
def microfacet_brdf(way, n, kappa, surface, radiance):
    """Rows of the Mueller BRDF of equation (24); radiance from `base_radiance`. [1/sr]"""
    facet = mirror_facet(way)
    strength = surface.specular_gain * facet_density(way, facet, surface.rough)
    strength = strength * shadowing_factor(surface.shadow, way, facet, surface.rough)
    return brdf_rows(way, facet, strength, n, kappa, surface.diffuse, radiance)


@jit(forceinline=True)
def write_rows(rows, k, out):
    """Write the rows of matrix k.

    Into a flat array, at distances that the compiler knows: only then does it see that no
    two geometries share an element, and computes several at once.
    """
    first, second, third, fourth = rows
    m = 16 * k
    out[m], out[m + 1], out[m + 2], out[m + 3] = first
    out[m + 4], out[m + 5], out[m + 6], out[m + 7] = second
    out[m + 8], out[m + 9], out[m + 10], out[m + 11] = third
    out[m + 12], out[m + 13], out[m + 14], out[m + 15] = fourth


@jit(forceinline=True)
def is_usual(surface):
    """Whether `usual_surface` says the same as the surface."""
    return (
        surface.rough.law == GAUSSIAN
        and surface.rough.isotropic
        and surface.shadow.rule == SMITH_CORRELATED
        and not surface.diffuse.has_more
    )


@jit(forceinline=True)
def usual_surface(surface):
    """Name the default forms by constants, so that compiling removes all other branches."""
    slope = surface.rough.slope_x
    return Surface(
        Roughness(GAUSSIAN, slope, slope, True, 1.0),
        Shadowing(SMITH_CORRELATED, 0.0, 0.0),
        surface.specular_gain,
        Diffuse(surface.diffuse.diffuse_albedo, 0.0, 0, 0.0, 0, 0.0, False),
    )


@jit(forceinline=True)
def fill_alike(theta_i, theta_s, dphi, phi_i, n, kappa, surface, out):
    """Fill the matrices of one source azimuth and one index."""
    cos_phi, sin_phi = cos(phi_i), sin(phi_i)
    radiance = base_radiance(n, kappa, surface.diffuse)
    for k in range(theta_i.size):
        way = directions(theta_i[k], theta_s[k], dphi[k], cos_phi, sin_phi)
        write_rows(microfacet_brdf(way, n, kappa, surface, radiance), k, out)


@jit
def fill_brdf(theta_i, theta_s, dphi, phi_i, n, kappa, surface, out):
    """Fill out[16 k:] with the matrix of geometry k; arrays of length 1 hold for all."""
    if phi_i.size == 1 and n.size == 1:
        if is_usual(surface):
            surface = usual_surface(surface)
            fill_alike(theta_i, theta_s, dphi, phi_i[0], n[0], kappa[0], surface, out)
        else:
            fill_alike(theta_i, theta_s, dphi, phi_i[0], n[0], kappa[0], surface, out)
        return
    each_phi = 1 if phi_i.size > 1 else 0
    each_index = 1 if n.size > 1 else 0
    for k in range(theta_i.size):
        phi, m = phi_i[k * each_phi], k * each_index
        way = directions(theta_i[k], theta_s[k], dphi[k], cos(phi), sin(phi))
        radiance = base_radiance(n[m], kappa[m], surface.diffuse)
        write_rows(microfacet_brdf(way, n[m], kappa[m], surface, radiance), k, out)


@jit
def fill_facet_slopes(theta_i, theta_s, dphi, phi_i, out):
    """Fill out[:, k] with the slopes of the mirroring facet of geometry k."""
    for k in range(theta_i.size):
        way = directions(theta_i[k], theta_s[k], dphi[k], cos(phi_i[k]), sin(phi_i[k]))
        facet = mirror_facet(way)
        out[0, k] = facet.slope_x
        out[1, k] = facet.slope_y


@jit
def fill_tabulated(
    theta_i, theta_s, dphi, n, kappa, density, lambda_i, lambda_s, surface, out
):
    """Fill out[16 k:] as `fill_brdf`, with slope density and both Smith's Lambda given."""
    for k in range(theta_i.size):
        way = directions(theta_i[k], theta_s[k], dphi[k], 1.0, 0.0)
        facet = mirror_facet(way)
        inv_cos2 = 1.0 + facet.tan2_tilt
        lit = density[k] * inv_cos2 * inv_cos2 / (4.0 * way.cos_i * way.cos_s)
        rule = surface.shadow.rule
        if rule > TORRANCE_SPARROW:
            seen = combined_overhangs(rule, way, lambda_i[k], lambda_s[k])
        else:
            seen = shadowing_factor(surface.shadow, way, facet, surface.rough)
        radiance = base_radiance(n[k], kappa[k], surface.diffuse)
        strength = surface.specular_gain * lit * seen
        rows = brdf_rows(way, facet, strength, n[k], kappa[k], surface.diffuse, radiance)
        write_rows(rows, k, out)
