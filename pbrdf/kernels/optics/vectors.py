"""Vectors in space as named tuples, which the compiler keeps in registers."""

import math
from collections import namedtuple

from pbrdf.kernels import jit

Vec = namedtuple("Vec", "x y z")


@jit(forceinline=True)
def dot(a, b):
    """Scalar product."""
    return a.x * b.x + a.y * b.y + a.z * b.z


@jit(forceinline=True)
def cross(a, b):
    """Vector product."""
    return Vec(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


@jit(forceinline=True)
def scaled(a, factor):
    """Vector times a number."""
    return Vec(a.x * factor, a.y * factor, a.z * factor)


@jit(forceinline=True)
def opposite(a):
    """Vector the other way."""
    return Vec(-a.x, -a.y, -a.z)


@jit(forceinline=True)
def moved(a, factor, b):
    """Return a + factor b."""
    return Vec(a.x + factor * b.x, a.y + factor * b.y, a.z + factor * b.z)


@jit(forceinline=True)
def combined(p, a, q, b, r, c):
    """Return p a + q b + r c."""
    return Vec(
        p * a.x + q * b.x + r * c.x,
        p * a.y + q * b.y + r * c.y,
        p * a.z + q * b.z + r * c.z,
    )


@jit(forceinline=True)
def unit(a):
    """Vector of length 1 along a."""
    return scaled(a, 1.0 / math.sqrt(a.x * a.x + a.y * a.y + a.z * a.z))


@jit(forceinline=True)
def axes_across(a):
    """Two unit vectors across a unit vector (Duff et al. 2017)."""
    sign = 1.0 if a.z >= 0.0 else -1.0
    share = -1.0 / (sign + a.z)
    mixed = a.x * a.y * share
    return (
        Vec(1.0 + sign * a.x * a.x * share, sign * mixed, -sign * a.x),
        Vec(mixed, sign + a.y * a.y * share, -a.y),
    )
