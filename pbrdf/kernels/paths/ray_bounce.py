"""One bounce of a ray: direction, frame and incidence at a facet, by a mirror or a base."""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.optics.frames import axis_of_exit, kept_axis, turn_frame
from pbrdf.kernels.optics.light import (
    cosine_law,
    cosine_of_hit,
    direction_about,
    mirror_image,
    near_unit,
)
from pbrdf.kernels.optics.vectors import Vec, cross


@jit(forceinline=True)
def normal_of_slopes(slope_x, slope_y):
    """Give the unit normal of a facet of a height field, and 1 / n_z."""
    length = math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    n_z = 1.0 / length
    return Vec(-slope_x * n_z, -slope_y * n_z, n_z), length


@jit(forceinline=True)
def mirror_at(k, normal):
    """Reflect a beam at a unit normal.

    Returns the new direction, the s axis k x n, the same before and after (not of unit
    length: only its direction counts), and the cosine of incidence.
    """
    cos_beta = cosine_of_hit(k, normal)
    return near_unit(mirror_image(k, normal, cos_beta)), cross(k, normal), cos_beta


@jit(forceinline=True)
def bounce_at(k, s, normal):
    """Reflect a beam and its frame at a unit normal.

    Returns the new direction, the new s axis, the cosine of incidence and the turn of the
    frame into the plane of incidence.
    """
    r, w, cos_beta = mirror_at(k, normal)
    turn = turn_frame(k, s, w)
    return r, kept_axis(s, w), cos_beta, turn


@jit(part=True)
def scatter_at(normal, draw_a, draw_b):
    """Direction spread as the cosine about a unit normal, from two uniform numbers.

    Returns the direction, its s axis and the cosine of exit.
    """
    sine, cosine = cosine_law(draw_a)
    k = direction_about(normal, sine, cosine, draw_b)
    return k, axis_of_exit(k, normal), cosine
