"""What a facet does to light: direction, frame and Stokes vector, in every route.

Each function takes and gives plain numbers. The route that calls it keeps the matrix of a
path as it likes and applies them to its columns: every column is the Stokes vector that a
unit of one element at the source has become.
"""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.optics.vectors import axes_across, combined, dot, moved, scaled

# Smallest cosine of a hit: rounding may leave a grazing ray parallel to the facet it meets
GRAZING = 1e-15


@jit(forceinline=True)
def turned(c2, s2, q, u):
    """Q and U in a frame turned about the beam, paper eq. (11)."""
    return c2 * q + s2 * u, c2 * u - s2 * q


@jit(forceinline=True)
def reflected(elements, i, q, u, v):
    """Stokes vector after [[A, B], [B, A]] and [[C, -D], [D, C]], paper eq. (10)."""
    a, b, c, d = elements
    return a * i + b * q, b * i + a * q, c * u - d * v, d * u + c * v


@jit(forceinline=True)
def returned(strength, a_in, b_in, a_out, b_out, i, q):
    """I and Q after the base: in through the interface, depolarised, out through it."""
    inside = strength * (a_in * i + b_in * q)
    return a_out * inside, b_out * inside


@jit(forceinline=True)
def cosine_of_hit(k, normal):
    """Cosine of incidence of a beam on a facet whose normal looks towards it."""
    return max(-dot(k, normal), GRAZING)


@jit(forceinline=True)
def mirror_image(k, normal, cosine):
    """Vector k after a mirror of this unit normal, with cosine = -(k . normal)."""
    return moved(k, 2.0 * cosine, normal)


@jit(forceinline=True)
def near_unit(k):
    """Bring a vector that is of unit length but for rounding nearer to it.

    One step of Newton's rule for 1 / sqrt(k . k): it keeps a direction a unit vector over
    any number of bounces.
    """
    return scaled(k, 1.5 - 0.5 * dot(k, k))


@jit(forceinline=True)
def cosine_law(draw):
    """Sine and cosine of a direction spread as the cosine about a normal."""
    return math.sqrt(draw), max(math.sqrt(1.0 - draw), GRAZING)


@jit(forceinline=True)
def direction_about(normal, sine, cosine, draw):
    """Direction at an angle to a unit normal, at a random azimuth about it."""
    first, second = axes_across(normal)
    azimuth = math.tau * draw
    return combined(
        sine * math.cos(azimuth), first, sine * math.sin(azimuth), second, cosine, normal
    )
