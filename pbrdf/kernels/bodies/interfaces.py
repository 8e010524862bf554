"""What an interface or an opaque surface does to a beam: direction, frame and matrix.

The matrix of the beam is kept in its frame (e_s, e_p = k x e_s). Meeting a surface turns
the frame into the plane of incidence; e_s is then the same for the incident, the reflected
and the refracted beam.
"""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.bodies.beams import KX, KY, KZ, MUELLER, SX, SY, SZ
from pbrdf.kernels.optics.frames import PARALLEL, turn_frame

# Smallest cosine of incidence: rounding may leave a grazing beam parallel to a surface
GRAZING = 1e-15
TWO_PI = 2.0 * math.pi


@jit(forceinline=True)
def set_direction(state, top, k_x, k_y, k_z):
    """Give the beam a direction, as a unit vector."""
    scale = 1.0 / math.sqrt(k_x * k_x + k_y * k_y + k_z * k_z)
    state[top, KX] = k_x * scale
    state[top, KY] = k_y * scale
    state[top, KZ] = k_z * scale


@jit(forceinline=True)
def turn_columns(state, top, columns, c2, s2):
    """Turn the frame of the outgoing Stokes vector, paper eq. (11)."""
    for column in range(columns):
        q = state[top, MUELLER + 4 + column]
        u = state[top, MUELLER + 8 + column]
        state[top, MUELLER + 4 + column] = c2 * q + s2 * u
        state[top, MUELLER + 8 + column] = c2 * u - s2 * q


@jit(forceinline=True)
def scale_columns(state, top, columns, factor):
    """Weaken or strengthen the beam."""
    for row in range(4):
        for column in range(columns):
            state[top, MUELLER + 4 * row + column] *= factor


@jit(forceinline=True)
def apply_elements(state, top, columns, a, b, c, d):
    """Multiply by [[a, b], [b, a]] and [[c, -d], [d, c]], paper eq. (10)."""
    for column in range(columns):
        i = state[top, MUELLER + column]
        q = state[top, MUELLER + 4 + column]
        u = state[top, MUELLER + 8 + column]
        v = state[top, MUELLER + 12 + column]
        state[top, MUELLER + column] = a * i + b * q
        state[top, MUELLER + 4 + column] = b * i + a * q
        state[top, MUELLER + 8 + column] = c * u - d * v
        state[top, MUELLER + 12 + column] = d * u + c * v


@jit(forceinline=True)
def meet(state, top, columns, n_x, n_y, n_z):
    """Turn the frame into the plane of incidence; returns the cosine of incidence.

    The normal looks towards the beam.
    """
    k_x, k_y, k_z = state[top, KX], state[top, KY], state[top, KZ]
    w_x = k_y * n_z - k_z * n_y
    w_y = k_z * n_x - k_x * n_z
    w_z = k_x * n_y - k_y * n_x
    c2, s2 = turn_frame(
        k_x, k_y, k_z, state[top, SX], state[top, SY], state[top, SZ], w_x, w_y, w_z
    )
    square = w_x * w_x + w_y * w_y + w_z * w_z
    if square > PARALLEL:
        scale = 1.0 / math.sqrt(square)
        state[top, SX] = w_x * scale
        state[top, SY] = w_y * scale
        state[top, SZ] = w_z * scale
        turn_columns(state, top, columns, c2, s2)
    return min(max(-(k_x * n_x + k_y * n_y + k_z * n_z), GRAZING), 1.0)


@jit(forceinline=True)
def reflect_beam(state, top, n_x, n_y, n_z, cos_in):
    """Turn the beam to its mirror direction."""
    set_direction(
        state, top,
        state[top, KX] + 2.0 * cos_in * n_x,
        state[top, KY] + 2.0 * cos_in * n_y,
        state[top, KZ] + 2.0 * cos_in * n_z,
    )  # fmt: skip


@jit(forceinline=True)
def refract_beam(state, top, n_x, n_y, n_z, cos_in, ratio):
    """Turn the beam to its direction behind an interface of relative index `ratio`."""
    # Snell: what lies along the interface shrinks by the ratio
    cos_out = math.sqrt((ratio - 1.0) * (ratio + 1.0) + cos_in * cos_in) / ratio
    along = cos_in / ratio - cos_out
    set_direction(
        state, top,
        state[top, KX] / ratio + along * n_x,
        state[top, KY] / ratio + along * n_y,
        state[top, KZ] / ratio + along * n_z,
    )  # fmt: skip


@jit(forceinline=True)
def send_out(state, top, n_x, n_y, n_z, sine, cosine, draw):
    """Send the beam out at an angle to a normal, at a random azimuth about it.

    Its frame is then that of the plane of exit, e_s along k x n.
    """
    # Axes across the normal (Duff et al. 2017)
    sign = 1.0 if n_z >= 0.0 else -1.0
    share = -1.0 / (sign + n_z)
    mixed = n_x * n_y * share
    a = sine * math.cos(TWO_PI * draw)
    b = sine * math.sin(TWO_PI * draw)
    b1_x, b1_y, b1_z = 1.0 + sign * n_x * n_x * share, sign * mixed, -sign * n_x
    b2_x, b2_y, b2_z = mixed, sign + n_y * n_y * share, -n_y
    set_direction(
        state, top,
        a * b1_x + b * b2_x + cosine * n_x,
        a * b1_y + b * b2_y + cosine * n_y,
        a * b1_z + b * b2_z + cosine * n_z,
    )  # fmt: skip
    # k x n, of length sine; along the normal every axis across it serves
    s_x, s_y, s_z = b1_x, b1_y, b1_z
    if sine > 0.0:
        s_x = (b * b1_x - a * b2_x) / sine
        s_y = (b * b1_y - a * b2_y) / sine
        s_z = (b * b1_z - a * b2_z) / sine
    state[top, SX] = s_x
    state[top, SY] = s_y
    state[top, SZ] = s_z
