"""Amplitudes with which a rough interface turns one plane wave into another.

Lengths are in units of 1/k, so that lateral wave vectors are sines and normal ones cosines.
Directions are those of propagation. Every kernel b of first-order theory is returned as
B = b cos(theta_s) cos(theta_i), which stays finite at grazing: first order of the heights
is an amplitude 2i B h(K) / cos(theta_s). Elements are ordered (ss, sp, ps, pp), out before
in.
"""

from collections import namedtuple
from math import sqrt

import numpy as np

from pbrdf.kernels import jit
from pbrdf.kernels.optics.fresnel import wave_normal

__all__ = [
    "LEAST_COSINE",
    "Medium",
    "Ray",
    "difference",
    "first_order",
    "lateral_ray",
    "medium_of",
    "tangent_plane",
    "turn_between",
    "turned",
]

# Lateral wave vector as its length and azimuth, and the normal component: sin, cos of the
# zenith, cos and sin of the azimuth of propagation
Ray = namedtuple("Ray", "sin cos along across")

# n, kappa, eps = (n + i kappa)^2, and whether it is the perfect conductor (n, kappa and eps
# are not read then)
Medium = namedtuple("Medium", "n kappa eps perfect")

# Least cosine of a ray: on the horizon itself some ratios would be 0/0
LEAST_COSINE = 1e-9

# Below this sin^2 of twice the local incidence its plane has no direction
PLANELESS = 1e-22


@jit(forceinline=True)
def medium_of(n, kappa):
    """Medium of an index; n = inf is the perfect conductor."""
    perfect = n == np.inf
    real = 1.0 if perfect else n
    index = complex(real, kappa)
    return Medium(real, kappa, index * index, perfect)


@jit(forceinline=True)
def times(factor, z):
    """Return a real multiple of z; a product of types would be one of complex numbers."""
    return complex(factor * z.real, factor * z.imag)


@jit(forceinline=True)
def blend(a, x, b, y):
    """Return a x + b y with real a and b."""
    return complex(a * x.real + b * y.real, a * x.imag + b * y.imag)


@jit(forceinline=True)
def inverse(z):
    """1/z, which no guard against zero slows down: no caller has one."""
    scale = 1.0 / (z.real * z.real + z.imag * z.imag)
    return complex(scale * z.real, -scale * z.imag)


@jit(forceinline=True)
def lateral_ray(x, y):
    """Ray of a lateral wave vector; behind the horizon it is laid on it."""
    length = sqrt(x * x + y * y)
    if length == 0.0:
        return Ray(0.0, 1.0, 1.0, 0.0)
    lateral = min(length, 1.0)
    cosine = max(sqrt((1.0 - lateral) * (1.0 + lateral)), LEAST_COSINE)
    return Ray(lateral, cosine, x / length, y / length)


@jit(forceinline=True)
def turn_between(ray_in, ray_out):
    """Cosine and sine of the azimuth from one ray to another."""
    return (
        ray_out.along * ray_in.along + ray_out.across * ray_in.across,
        ray_out.across * ray_in.along - ray_out.along * ray_in.across,
    )


@jit(forceinline=True)
def normal_inside(ray, medium):
    """Return the normal component behind the interface, sqrt(eps - sin^2)."""
    real, imag = wave_normal(ray.cos, medium.n, medium.kappa)
    return complex(real, imag)


@jit(forceinline=True)
def first_order(ray_in, ray_out, medium):
    """Small-perturbation kernel of Rice in all four elements, times both cosines.

    S. O. Rice, Commun. Pure Appl. Math. 4, 351 (1951); J. M. Elson and J. M. Bennett, Opt.
    Eng. 18, 116 (1979). At equal lateral vectors it is minus Fresnel's amplitude.
    """
    turn, side = turn_between(ray_in, ray_out)
    cos_s, cos_i = ray_out.cos, ray_in.cos
    if medium.perfect:
        return (
            complex(turn * cos_s * cos_i, 0.0),
            complex(-side * cos_s, 0.0),
            complex(-side * cos_i, 0.0),
            complex(ray_out.sin * ray_in.sin - turn, 0.0),
        )
    eps = medium.eps
    in_s, in_i = normal_inside(ray_out, medium), normal_inside(ray_in, medium)
    # Waves that an s or p field drives, out and in
    out_s, out_p = inverse(in_s + cos_s), inverse(blend(cos_s, eps, 1.0, in_s))
    into_s, into_p = inverse(in_i + cos_i), inverse(blend(cos_i, eps, 1.0, in_i))
    excess = times(cos_s * cos_i, eps - 1.0)
    along = blend(ray_out.sin * ray_in.sin, eps, -turn, in_s * in_i)
    from_s, from_p = excess * into_s, excess * into_p
    return (
        times(turn, out_s * from_s),
        times(-side, in_i * out_s * from_p),
        times(-side, in_s * out_p * from_s),
        along * out_p * from_p,
    )


@jit(forceinline=True)
def tangent_plane(ray_in, ray_out, medium):
    """Kirchhoff kernel with Fresnel at the facet that mirrors, times both cosines.

    -(Q/2k)^2 R_out diag(r_s, r_p) R_in; Q/2k is the cosine of the local incidence.
    """
    turn, side = turn_between(ray_in, ray_out)
    cos_i, sin_i, cos_s, sin_s = ray_in.cos, ray_in.sin, ray_out.cos, ray_out.sin
    cos2 = 0.5 * (1.0 + cos_i * cos_s - sin_i * sin_s * turn)
    sin2 = 0.5 * (1.0 - cos_i * cos_s + sin_i * sin_s * turn)
    r_s, r_p = facet_amplitudes(sqrt(max(cos2, 0.0)), sin2, medium)

    # Frame vectors of each ray seen from the other ray
    out_s, out_p = -sin_i * side, -(cos_s * sin_i * turn + sin_s * cos_i)
    in_s, in_p = sin_s * side, cos_i * sin_s * turn + sin_i * cos_s
    plane = out_s * out_s + out_p * out_p
    if plane < PLANELESS:
        # Straight back: the field keeps its direction and takes r_s
        scale = times(-cos2, r_s)
        return (
            times(turn, scale),
            times(-side * cos_i, scale),
            times(-side * cos_s, scale),
            times(sin_s * sin_i - cos_s * cos_i * turn, scale),
        )
    scale = -cos2 / plane
    pp, ss = scale * out_p * in_p, scale * out_s * in_s
    ps, sp = scale * out_p * in_s, scale * out_s * in_p
    return (
        blend(-pp, r_s, -ss, r_p),
        blend(ps, r_s, -sp, r_p),
        blend(sp, r_s, -ps, r_p),
        blend(-ss, r_s, -pp, r_p),
    )


@jit(forceinline=True)
def facet_amplitudes(cos_beta, sin2_beta, medium):
    """Fresnel's r_s, r_p in the forms in which nothing cancels."""
    if medium.perfect:
        return complex(-1.0, 0.0), complex(1.0, 0.0)
    real, imag = wave_normal(cos_beta, medium.n, medium.kappa)
    inside = complex(real, imag)
    forward = cos_beta + inside
    # An index-matched facet at grazing reflects nothing; it would be 0/0
    r_s = (1.0 - medium.eps) * inverse(forward * forward + 1e-300)
    bend = times(cos_beta, inside)
    r_p = r_s * (sin2_beta - bend) * inverse(sin2_beta + bend)
    return r_s, r_p


@jit(forceinline=True)
def difference(ray_in, ray_out, medium):
    """First-order less tangent-plane kernel, in the frames of the two rays."""
    rice = first_order(ray_in, ray_out, medium)
    plane = tangent_plane(ray_in, ray_out, medium)
    return (
        rice[0] - plane[0],
        rice[1] - plane[1],
        rice[2] - plane[2],
        rice[3] - plane[3],
    )


@jit(forceinline=True)
def turned(jones, ray_in, ray_out, come, to):
    """Jones matrix from `come` to `to`, in the frames of the azimuths of two other rays."""
    ss, sp, ps, pp = jones
    cos_o, sin_o = turn_between(ray_out, to)
    ss, ps = blend(cos_o, ss, -sin_o, ps), blend(sin_o, ss, cos_o, ps)
    sp, pp = blend(cos_o, sp, -sin_o, pp), blend(sin_o, sp, cos_o, pp)
    cos_n, sin_n = turn_between(ray_in, come)
    ss, sp = blend(cos_n, ss, sin_n, sp), blend(cos_n, sp, -sin_n, ss)
    ps, pp = blend(cos_n, ps, sin_n, pp), blend(cos_n, pp, -sin_n, ps)
    return ss, sp, ps, pp
