"""The facet that mirrors one direction into another: tilt, incidence and frame rotations.

Equations (12) to (16) of the paper with (13) as the double angle it must be, (16) taken at
the local incidence beta, and the rotations from dot products of frame vectors instead of
the arccos of (14), (15), which loses their sign and all digits near zero.

Everything is written in the half difference d of the zeniths and half the azimuth h:

    sin^2 beta = sin^2 d + sin(theta_i) sin(theta_s) sin^2 h

is a sum of positive terms, so retro-reflection costs no digits; neither do normal
incidence and grazing, where sines and cosines enter as themselves.
"""

from collections import namedtuple
from math import sqrt

from pbrdf.kernels import jit
from pbrdf.kernels.optics.elementary import cos, sin
from pbrdf.kernels.optics.fresnel import select

__all__ = [
    "Directions",
    "Facet",
    "directions",
    "fill_rotations",
    "frame_rotations",
    "mirror_facet",
    "rotated_elements",
]

# Squared sine of 2 beta below which the plane of incidence is undefined
DEGENERATE = 1e-290

# Named tuples are what Numba compiles; typed classes are not
Directions = namedtuple(
    "Directions", "cos_i sin_i cos_s sin_s sin_d cos_d sin_h cos_h cos_phi sin_phi"
)
Facet = namedtuple("Facet", "slope_x slope_y tan2_tilt cos_beta sin2_beta")


@jit(forceinline=True)
def directions(theta_i, theta_s, dphi, cos_phi, sin_phi):
    """Sines and cosines of the zeniths, d = (theta_i - theta_s)/2 and h = dphi/2."""
    sin_d = sin(0.5 * (theta_i - theta_s))
    return Directions(
        cos(theta_i),
        sin(theta_i),
        cos(theta_s),
        sin(theta_s),
        sin_d,
        sqrt(1.0 - sin_d * sin_d),
        sin(0.5 * dphi),
        cos(0.5 * dphi),
        cos_phi,
        sin_phi,
    )


@jit(forceinline=True)
def mirror_facet(way):
    """Slopes, squared tangent of the tilt and local incidence of the mirroring facet.

    The half vector over its z component gives the slopes along and across the plane of
    incidence; the first is tan d + 2 sin(theta_s) cos^2 h / (cos(theta_i) + cos(theta_s)).
    """
    sum_cos = way.cos_i + way.cos_s
    across = 2.0 * way.sin_s * way.cos_h / sum_cos
    along = way.sin_d / way.cos_d + across * way.cos_h
    across = across * way.sin_h
    tan2_tilt = along * along + across * across

    # The half vector is twice cos(beta) long: equation (12)
    cos_beta = 0.5 * sum_cos * sqrt(1.0 + tan2_tilt)
    sin2_beta = way.sin_d * way.sin_d + way.sin_i * way.sin_s * way.sin_h * way.sin_h

    # A normal leans downhill: the surface gradient is minus the normal's lean
    slope_x = across * way.sin_phi - along * way.cos_phi
    slope_y = -along * way.sin_phi - across * way.cos_phi
    return Facet(slope_x, slope_y, tan2_tilt, cos_beta, sin2_beta)


@jit(forceinline=True)
def double_angle(cosine, sine, cos_limit, sin_limit):
    """Double angle of the direction (cosine, sine) of any length; a limit if it is zero."""
    norm = cosine * cosine + sine * sine
    defined = norm > DEGENERATE
    safe = select(defined, norm, 1.0)
    cos_2a = (cosine - sine) * (cosine + sine) / safe
    sin_2a = 2.0 * cosine * sine / safe
    return select(defined, cos_2a, cos_limit), select(defined, sin_2a, sin_limit)


@jit(forceinline=True)
def frame_rotations(way):
    """Double angles, as cos and sin, from the incident frame and from the scattered frame.

    Times sin(2 beta), the facet's e_s has the components (x, y) along the beam's e_s and
    e_p: x_i = sin(theta_i - theta_s) + 2 cos(theta_i) sin(theta_s) sin^2 h,
    y_i = sin(theta_s) sin(dphi), and the same with i and s exchanged.
    """
    sin_diff = 2.0 * way.sin_d * way.cos_d
    versine = 2.0 * way.sin_h * way.sin_h
    sin_dphi = 2.0 * way.sin_h * way.cos_h
    cos_dphi = 1.0 - versine

    # In exact retro-reflection only the sum of both angles matters: pi - dphi
    cos_2i, sin_2i = double_angle(
        sin_diff + way.cos_i * way.sin_s * versine, way.sin_s * sin_dphi, 1.0, 0.0
    )
    cos_2s, sin_2s = double_angle(
        way.sin_i * way.cos_s * versine - sin_diff,
        way.sin_i * sin_dphi,
        2.0 * cos_dphi * cos_dphi - 1.0,
        -2.0 * sin_dphi * cos_dphi,
    )
    return cos_2i, sin_2i, cos_2s, sin_2s


@jit(forceinline=True)
def rotated_elements(way, a, b, c, d):
    """Rows of F' = R(-alpha_s) F(beta) R(alpha_i), equation (16)."""
    cos_2i, sin_2i, cos_2s, sin_2s = frame_rotations(way)
    return (
        (a, b * cos_2i, b * sin_2i, 0.0),
        (
            b * cos_2s,
            a * cos_2s * cos_2i + c * sin_2s * sin_2i,
            a * cos_2s * sin_2i - c * sin_2s * cos_2i,
            d * sin_2s,
        ),
        (
            b * sin_2s,
            a * sin_2s * cos_2i - c * cos_2s * sin_2i,
            a * sin_2s * sin_2i + c * cos_2s * cos_2i,
            -d * cos_2s,
        ),
        (0.0, -d * sin_2i, d * cos_2i, c),
    )


@jit(part=True)
def write_rotation(cos_2a, sin_2a, out):
    """Write the Mueller rotation R(a), equation (11)."""
    out[:, :] = 0.0
    out[0, 0] = out[3, 3] = 1.0
    out[1, 1] = out[2, 2] = cos_2a
    out[1, 2] = sin_2a
    out[2, 1] = -sin_2a


@jit
def fill_rotations(theta_i, theta_s, dphi, turn_i, turn_s):
    """Fill R(alpha_i) and R(alpha_s), from the meridian frames into that of the facet."""
    for k in range(theta_i.size):
        way = directions(theta_i[k], theta_s[k], dphi[k], 1.0, 0.0)
        cos_2i, sin_2i, cos_2s, sin_2s = frame_rotations(way)
        write_rotation(cos_2i, sin_2i, turn_i[k])
        write_rotation(cos_2s, sin_2s, turn_s[k])
