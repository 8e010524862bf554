"""One bounce of a ray: direction, frame and incidence at a facet, by a mirror or a base."""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.optics.frames import PARALLEL, turn_frame
from pbrdf.kernels.terrain.entry import TWO_PI

# Smallest cosine of a hit: rounding may leave a grazing ray parallel to the facet it meets
GRAZING = 1e-15


@jit(forceinline=True)
def normal_of_slopes(slope_x, slope_y):
    """Give the unit normal of a facet of a height field, and 1 / n_z."""
    length = math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    n_z = 1.0 / length
    return -slope_x * n_z, -slope_y * n_z, n_z, length


@jit(forceinline=True)
def reflect_at(k_x, k_y, k_z, n_x, n_y, n_z):
    """Mirror direction at a unit normal and the cosine of incidence."""
    cos_beta = max(-(k_x * n_x + k_y * n_y + k_z * n_z), GRAZING)
    r_x = k_x + 2.0 * cos_beta * n_x
    r_y = k_y + 2.0 * cos_beta * n_y
    r_z = k_z + 2.0 * cos_beta * n_z
    # Keep the direction a unit vector over any number of bounces: one step of Newton's
    # rule for 1 / sqrt(r . r), which is 1 but for rounding
    scale = 1.5 - 0.5 * (r_x * r_x + r_y * r_y + r_z * r_z)
    return r_x * scale, r_y * scale, r_z * scale, cos_beta


@jit(forceinline=True)
def mirror_at(k_x, k_y, k_z, n_x, n_y, n_z):
    """Reflect a beam at a unit normal.

    Returns the new direction, the s axis k x n, the same before and after (not of unit
    length: only its direction counts), and the cosine of incidence.
    """
    r_x, r_y, r_z, cos_beta = reflect_at(k_x, k_y, k_z, n_x, n_y, n_z)
    w_x = k_y * n_z - k_z * n_y
    w_y = k_z * n_x - k_x * n_z
    w_z = k_x * n_y - k_y * n_x
    return r_x, r_y, r_z, w_x, w_y, w_z, cos_beta


@jit(forceinline=True)
def mirror(k_x, k_y, k_z, slope_x, slope_y):
    """Reflect a beam at a facet of a height field, as `mirror_at`.

    The speed at which the ray leaves the facet upwards comes before the cosine.
    """
    n_x, n_y, n_z, length = normal_of_slopes(slope_x, slope_y)
    r_x, r_y, r_z, w_x, w_y, w_z, cos_beta = mirror_at(k_x, k_y, k_z, n_x, n_y, n_z)
    # It leaves the plane as fast as it came, cos(beta) along the normal
    return r_x, r_y, r_z, w_x, w_y, w_z, cos_beta * length, cos_beta


@jit(forceinline=True)
def new_axis(s_x, s_y, s_z, w_x, w_y, w_z):
    """Axis w of a facet, or the old s axis where the beam met the facet head-on."""
    if w_x * w_x + w_y * w_y + w_z * w_z > PARALLEL:
        return w_x, w_y, w_z
    return s_x, s_y, s_z


@jit(forceinline=True)
def bounce_at(k_x, k_y, k_z, s_x, s_y, s_z, n_x, n_y, n_z):
    """Reflect a beam and its frame at a unit normal.

    Returns the new direction, the new s axis, the cosine of incidence and the turn of the
    frame into the plane of incidence.
    """
    r_x, r_y, r_z, w_x, w_y, w_z, cos_beta = mirror_at(k_x, k_y, k_z, n_x, n_y, n_z)
    c2, s2 = turn_frame(k_x, k_y, k_z, s_x, s_y, s_z, w_x, w_y, w_z)
    s_x, s_y, s_z = new_axis(s_x, s_y, s_z, w_x, w_y, w_z)
    return r_x, r_y, r_z, s_x, s_y, s_z, cos_beta, c2, s2


@jit(forceinline=True)
def exit_turn(k_x, k_y, k_z, s_x, s_y, s_z, cos_phi_i, sin_phi_i):
    """Turn of the frame to the meridian plane of the exit direction, e_s = z x k."""
    m_x = -k_y
    m_y = k_x
    if k_x * k_x + k_y * k_y < PARALLEL:
        # Straight up: the azimuth of the source stands for that of the detector
        m_x = -sin_phi_i
        m_y = cos_phi_i
    return turn_frame(k_x, k_y, k_z, s_x, s_y, s_z, m_x, m_y, 0.0)


@jit
def scatter_at(n_x, n_y, n_z, draw_a, draw_b):
    """Direction spread as the cosine about a unit normal, from two uniform numbers.

    Returns the direction, its s axis k x n and the cosine of exit.
    """
    # Axes across the normal (Duff et al. 2017)
    sign = 1.0 if n_z >= 0.0 else -1.0
    share = -1.0 / (sign + n_z)
    mixed = n_x * n_y * share
    sine = math.sqrt(draw_a)
    cosine = max(math.sqrt(1.0 - draw_a), GRAZING)
    a = sine * math.cos(TWO_PI * draw_b)
    b = sine * math.sin(TWO_PI * draw_b)
    k_x = a * (1.0 + sign * n_x * n_x * share) + b * mixed + cosine * n_x
    k_y = a * (sign * mixed) + b * (sign + n_y * n_y * share) + cosine * n_y
    k_z = -a * (sign * n_x) - b * n_y + cosine * n_z
    s_x = k_y * n_z - k_z * n_y
    s_y = k_z * n_x - k_x * n_z
    s_z = k_x * n_y - k_y * n_x
    square = s_x * s_x + s_y * s_y + s_z * s_z
    if square > PARALLEL:
        scale = 1.0 / math.sqrt(square)
        s_x *= scale
        s_y *= scale
        s_z *= scale
    else:
        # Along the normal every axis across it serves
        s_x, s_y, s_z = 1.0 + sign * n_x * n_x * share, sign * mixed, -sign * n_x
    return k_x, k_y, k_z, s_x, s_y, s_z, cosine
