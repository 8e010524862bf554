"""Light that comes out of the material, and light of many bounces: equations (22), (23)."""

from collections import namedtuple
from math import pi

import numpy as np

from pbrdf.kernels import jit
from pbrdf.kernels.optics.fresnel import facet_elements, select, transmission_parts

__all__ = [
    "BASE",
    "BOUNDED",
    "PAPER",
    "POLARISED_BASE",
    "Diffuse",
    "added_elements",
    "base_radiance",
    "internal_reflectance",
]

# Forms of the volume term and of the diffuse term that grows at grazing
PAPER, BASE, POLARISED_BASE = range(3)
BOUNDED = 1

# diffuse_albedo, grazing_albedo with its form, volume_albedo with its form and the
# depolarisation of the light between entrance and exit; has_more: whether there is
# more than the first
Diffuse = namedtuple(
    "Diffuse",
    "diffuse_albedo grazing_albedo grazing_form "
    "volume_albedo volume_form depolarisation has_more",
)

_nodes, _weights = np.polynomial.legendre.leggauss(16)
NODES = tuple((0.5 + 0.5 * _nodes).tolist())
WEIGHTS = tuple((0.5 * _weights).tolist())


@jit(part=True)
def internal_reflectance(n, kappa):
    """Share of diffuse light that the interface throws back inside: 1 - (1 - F_e)/n^2.

    F_e = 2 integral R(c) c dc is the reflectance for diffuse light from outside; Walsh
    1926, S. Duntley, J. Opt. Soc. Am. 32, 61 (1942).
    """
    # From the rarer side there is no critical angle and the reflectance is smooth: from
    # outside, or from inside itself where the outside is a denser liquid
    rarer = select(n < 1.0, kappa == 0.0, False)
    index = select(rarer, 1.0 / n, n)
    diffuse = 0.0
    for k in range(len(NODES)):
        c = NODES[k]
        reflected = facet_elements(c, (1.0 - c) * (1.0 + c), index, kappa)
        diffuse = diffuse + WEIGHTS[k] * 2.0 * c * reflected[0]
    return select(rarer, diffuse, 1.0 - (1.0 - diffuse) / (n * n))


@jit
def base_radiance(n, kappa, diffuse):
    """Factor of the two transmittances in the volume term. [1/sr]

    (22) with the 1/pi it lacks; a Lambertian base under the interface also spreads its
    light over n^2 times the solid angle and gets back what the interface reflects inside.
    """
    albedo = diffuse.volume_albedo
    if not diffuse.has_more:
        return 0.0
    if diffuse.volume_form == PAPER:
        return albedo / pi
    return albedo / (pi * n * n * (1.0 - albedo * internal_reflectance(n, kappa)))


@jit(part=True)
def volume_elements(way, n, kappa, diffuse, radiance):
    """Rows of T(theta_s) diag(1, p, p, p) T(theta_i), p = 1 - depolarisation.

    The mean plane refracts in the meridian planes, so no frame is turned: what comes out is
    polarised along e_p by its way out. Only element (0, 0) in the unpolarised forms.
    """
    a_i, b_i, c_i = transmission_parts(way.cos_i, n, kappa)
    a_s, b_s, c_s = transmission_parts(way.cos_s, n, kappa)
    if diffuse.volume_form != POLARISED_BASE:
        return radiance * a_s * a_i, 0.0, 0.0, 0.0, 0.0
    kept = 1.0 - diffuse.depolarisation
    return (
        radiance * (a_s * a_i + kept * b_s * b_i),
        radiance * (a_s * b_i + kept * b_s * a_i),
        radiance * (b_s * a_i + kept * a_s * b_i),
        radiance * (b_s * b_i + kept * a_s * a_i),
        radiance * kept * c_s * c_i,
    )


@jit(forceinline=True)
def added_elements(way, n, kappa, diffuse, radiance):
    """Sum of (22) and (23), added to the elements 00, 01, 10, 11 and to 22 and 33. [1/sr]

    (23) divides by cos_i cos_s and reflects more than it receives at grazing; the bounded
    form of the Beard-Maxwell model is 2 rho/(cos_i + cos_s).
    """
    lambertian = diffuse.diffuse_albedo / pi
    if not diffuse.has_more:
        return lambertian, 0.0, 0.0, 0.0, 0.0
    grazing = diffuse.grazing_albedo / pi
    if diffuse.grazing_form == BOUNDED:
        grazing = 2.0 * grazing / (way.cos_i + way.cos_s)
    else:
        grazing = grazing / (way.cos_i * way.cos_s)
    m00, m01, m10, m11, m22 = volume_elements(way, n, kappa, diffuse, radiance)
    return m00 + grazing + lambertian, m01, m10, m11, m22
