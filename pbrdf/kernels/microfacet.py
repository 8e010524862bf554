"""The Mueller BRDF of a rough surface made of Fresnel facets, equation (20)."""

from collections import namedtuple
from math import cos, pi, sin

from . import jit
from .facet import directions, mirror_facet, rotated_elements
from .fresnel import facet_elements
from .shadowing import shadowing_factor
from .slopes import slope_density

__all__ = ["Surface", "fill_brdf", "microfacet_brdf", "specular_elements"]

# rough, shadow: the namedtuples of their modules; gain, diffuse: factors of the terms
Surface = namedtuple("Surface", "rough shadow specular_gain diffuse_albedo")


@jit
def facet_density(way, facet, rough):
    """Lit facet area that mirrors one direction to the other: P / (4 cos_i cos_s). [1/sr]

    P = f/cos^4(tilt), the form in which (17), (18) and (20) agree with one another.
    """
    inv_cos2 = 1.0 + facet.tan2_tilt
    density = slope_density(rough, facet) * inv_cos2 * inv_cos2
    return density / (4.0 * way.cos_i * way.cos_s)


@jit
def specular_elements(way, n, kappa, surface):
    """Sixteen elements of the specular term of equation (20). [1/sr]"""
    facet = mirror_facet(way)
    strength = surface.specular_gain * facet_density(way, facet, surface.rough)
    strength = strength * shadowing_factor(surface.shadow, way, facet, surface.rough)
    a, b, c, d = facet_elements(facet.cos_beta, facet.sin2_beta, n, kappa)
    return rotated_elements(way, strength * a, strength * b, strength * c, strength * d)


@jit
def microfacet_brdf(way, n, kappa, surface):
    """Rows of the Mueller BRDF of equation (24). [1/sr]"""
    first, second, third, fourth = specular_elements(way, n, kappa, surface)
    # Unpolarised light adds to element (0, 0) only
    total = first[0] + surface.diffuse_albedo / pi
    return (total, first[1], first[2], first[3]), second, third, fourth


@jit
def fill_brdf(theta_i, theta_s, dphi, phi_i, n, kappa, surface, out):
    """Fill out[k] with the matrix of geometry k; arrays of length 1 hold for all."""
    each_phi = 1 if phi_i.size > 1 else 0
    each_index = 1 if n.size > 1 else 0
    cos_phi, sin_phi = cos(phi_i[0]), sin(phi_i[0])
    for k in range(theta_i.size):
        if each_phi:
            cos_phi, sin_phi = cos(phi_i[k]), sin(phi_i[k])
        way = directions(theta_i[k], theta_s[k], dphi[k], cos_phi, sin_phi)
        m = k * each_index
        rows = microfacet_brdf(way, n[m], kappa[m], surface)
        for i in range(4):
            for j in range(4):
                out[k, i, j] = rows[i][j]
