"""What an interface or an opaque surface does to a beam: direction, frame and matrix.

The matrix of the beam is kept in its frame (e_s, e_p = k x e_s). Meeting a surface turns
the frame into the plane of incidence; e_s is then the same for the incident, the reflected
and the refracted beam.
"""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.bodies.beams import KX, KY, KZ, MUELLER, SX, SY, SZ
from pbrdf.kernels.optics.frames import PARALLEL, axis_of_exit, turn_frame
from pbrdf.kernels.optics.light import (
    cosine_of_hit,
    direction_about,
    mirror_image,
    reflected,
    returned,
    turned,
)
from pbrdf.kernels.optics.vectors import Vec, cross, dot, scaled, unit

# Rows of the matrix of a beam, in its row of the stack
ROW_I, ROW_Q, ROW_U, ROW_V = MUELLER, MUELLER + 4, MUELLER + 8, MUELLER + 12


@jit(forceinline=True)
def way_of_beam(state, top):
    """Direction of the beam."""
    return Vec(state[top, KX], state[top, KY], state[top, KZ])


@jit(forceinline=True)
def axis_of_beam(state, top):
    """Axis s of the beam."""
    return Vec(state[top, SX], state[top, SY], state[top, SZ])


@jit(forceinline=True)
def set_direction(state, top, k):
    """Give the beam a direction, as a unit vector."""
    state[top, KX], state[top, KY], state[top, KZ] = unit(k)


@jit(forceinline=True)
def set_axis(state, top, s):
    """Give the beam its s axis."""
    state[top, SX], state[top, SY], state[top, SZ] = s


@jit(forceinline=True)
def turn_columns(state, top, columns, c2, s2):
    """Turn the frame of the outgoing Stokes vector."""
    for column in range(columns):
        state[top, ROW_Q + column], state[top, ROW_U + column] = turned(
            c2, s2, state[top, ROW_Q + column], state[top, ROW_U + column]
        )


@jit(forceinline=True)
def scale_columns(state, top, columns, factor):
    """Weaken or strengthen the beam."""
    for row in range(4):
        for column in range(columns):
            state[top, MUELLER + 4 * row + column] *= factor


@jit(forceinline=True)
def apply_elements(state, top, columns, elements):
    """Reflect or refract the matrix of the beam."""
    for column in range(columns):
        (
            state[top, ROW_I + column], state[top, ROW_Q + column],
            state[top, ROW_U + column], state[top, ROW_V + column],
        ) = reflected(
            elements, state[top, ROW_I + column], state[top, ROW_Q + column],
            state[top, ROW_U + column], state[top, ROW_V + column],
        )  # fmt: skip


@jit(forceinline=True)
def come_out(state, top, columns, a_in, b_in, a_out, b_out, base):
    """Take a beam through the interface to the diffuse base, and out again."""
    for column in range(columns):
        state[top, ROW_I + column], state[top, ROW_Q + column] = returned(
            base, a_in, b_in, a_out, b_out,
            state[top, ROW_I + column], state[top, ROW_Q + column],
        )  # fmt: skip
        state[top, ROW_U + column] = 0.0
        state[top, ROW_V + column] = 0.0


@jit(forceinline=True)
def meet(state, top, columns, normal):
    """Turn the frame into the plane of incidence; returns the cosine of incidence.

    The normal looks towards the beam.
    """
    k = way_of_beam(state, top)
    w = cross(k, normal)
    c2, s2 = turn_frame(k, axis_of_beam(state, top), w)
    square = dot(w, w)
    if square > PARALLEL:
        set_axis(state, top, scaled(w, 1.0 / math.sqrt(square)))
        turn_columns(state, top, columns, c2, s2)
    return min(cosine_of_hit(k, normal), 1.0)


@jit(forceinline=True)
def reflect_beam(state, top, normal, cos_in):
    """Turn the beam to its mirror direction."""
    set_direction(state, top, mirror_image(way_of_beam(state, top), normal, cos_in))


@jit(forceinline=True)
def refract_beam(state, top, normal, cos_in, ratio):
    """Turn the beam to its direction behind an interface of relative index `ratio`."""
    # Snell: what lies along the interface shrinks by the ratio
    cos_out = math.sqrt((ratio - 1.0) * (ratio + 1.0) + cos_in * cos_in) / ratio
    along = cos_in / ratio - cos_out
    k = way_of_beam(state, top)
    set_direction(
        state, top,
        Vec(
            k.x / ratio + along * normal.x,
            k.y / ratio + along * normal.y,
            k.z / ratio + along * normal.z,
        ),
    )  # fmt: skip


@jit(forceinline=True)
def send_out(state, top, normal, sine, cosine, draw):
    """Send the beam out at an angle to a normal, at a random azimuth about it.

    Its frame is then that of the plane of exit, e_s along k x n.
    """
    k = unit(direction_about(normal, sine, cosine, draw))
    state[top, KX], state[top, KY], state[top, KZ] = k
    set_axis(state, top, axis_of_exit(k, normal))
