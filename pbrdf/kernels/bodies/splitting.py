"""How a beam comes apart at a surface, and how it is weakened on its way.

At an interface both parts are followed while each is strong; else one of them is chosen by
chance, with the probability of its share of the light, so that the beam carries on at full
strength and all elements of its matrix stay unbiased.
"""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.bodies.beams import CELL_I, CELL_J, EVENTS, MUELLER, copy_beam
from pbrdf.kernels.bodies.events import (
    BODY_IN,
    GROUND,
    HIT_BODY,
    cross,
    medium_of,
    normal_at,
    set_rate,
)
from pbrdf.kernels.bodies.interfaces import (
    apply_elements,
    meet,
    reflect_beam,
    refract_beam,
    scale_columns,
    scatter_about,
)
from pbrdf.kernels.optics.fresnel import reflection_elements, transmission_elements
from pbrdf.kernels.paths.random import uniform_pair
from pbrdf.kernels.paths.shading import ABSORBED

# Both parts of a beam are followed while the weaker has this share of the ray; a part below
# the second share goes on by chance only
SPLIT = 0.01
WEAK = 1e-3
CROWDED = -9


@jit(forceinline=True)
def meet_interface(world, w, state, top, kind, hit, columns, stream, number, event):
    """Reflect and refract at the surface of a transparent body; returns the new top.

    Within one medium nothing happens. CROWDED says that the beam is in too many bodies.
    """
    media = world.media
    before = medium_of(world, state, top)
    copy_beam(state, top, top + 1)
    if not cross(world, state, top + 1, kind, hit):
        return CROWDED
    after = medium_of(world, state, top + 1)
    ratio = media.n[w, after] / media.n[w, before]
    n_x, n_y, n_z = normal_at(world, state, top, kind, hit)
    if before == after or ratio == 1.0:
        copy_beam(state, top + 1, top)
        set_rate(state, top, n_x, n_y, n_z)
        return top

    state[top, EVENTS] += 1.0
    cos_in = meet(state, top, columns, n_x, n_y, n_z)
    a, b, c, d = reflection_elements(cos_in, ratio, 0.0)
    a_t, b_t, c_t, d_t = 0.0, 0.0, 0.0, 0.0
    if (ratio - 1.0) * (ratio + 1.0) + cos_in * cos_in > 0.0:
        a_t, b_t, c_t, d_t = transmission_elements(cos_in, ratio, 0.0)
    i, q = state[top, MUELLER], state[top, MUELLER + 4]
    reflected = a * i + b * q
    refracted = a_t * i + b_t * q
    both = min(reflected, refracted) >= SPLIT
    share = reflected / (reflected + refracted)
    keeps = False
    if not both:
        draw, _ = uniform_pair(stream, number, event)
        keeps = draw < share
    if both or not keeps:
        # The refracted part, on the far side
        further = top + 1 if both else top
        copy_beam(state, top, further)
        cross(world, state, further, kind, hit)
        refract_beam(state, further, n_x, n_y, n_z, cos_in, ratio)
        apply_elements(state, further, columns, a_t, b_t, c_t, d_t)
        if not both:
            scale_columns(state, further, columns, 1.0 / (1.0 - share))
        set_rate(state, further, n_x, n_y, n_z)
    if both or keeps:
        reflect_beam(state, top, n_x, n_y, n_z, cos_in)
        apply_elements(state, top, columns, a, b, c, d)
        if not both:
            scale_columns(state, top, columns, 1.0 / share)
        set_rate(state, top, n_x, n_y, n_z)
    return top + 1 if both else top


@jit(forceinline=True)
def come_out(state, top, columns, cos_in, cos_out, n, kappa, base):
    """Take a beam through the interface to the diffuse base, and out again."""
    a_in, b_in, _, _ = transmission_elements(cos_in, n, kappa)
    a_out, b_out, _, _ = transmission_elements(cos_out, n, kappa)
    for column in range(columns):
        inside = base * (
            a_in * state[top, MUELLER + column] + b_in * state[top, MUELLER + 4 + column]
        )
        state[top, MUELLER + column] = a_out * inside
        state[top, MUELLER + 4 + column] = b_out * inside
        state[top, MUELLER + 8 + column] = 0.0
        state[top, MUELLER + 12 + column] = 0.0


@jit(forceinline=True)
def solid_at(world, w, state, top, kind, hit):
    """Solid that has just been met; -1 at the surface of something transparent."""
    if kind == GROUND:
        labels = world.terrain.labels
        if labels.size == 0:
            return 0
        return int(labels[int(state[top, CELL_I]), int(state[top, CELL_J])])
    if kind == BODY_IN:
        return world.media.solid[w, world.bodies.medium[int(hit[HIT_BODY])]]
    return -1


@jit(forceinline=True)
def meet_solid(
    world, w, state, top, kind, solid, hit, columns, stream, number, event, energy
):  # fmt: skip
    """Reflect at something opaque and scatter at the base under it; returns the new top."""
    media = world.media
    arriving = state[top, MUELLER]
    if media.black[solid]:
        energy[w, ABSORBED] += arriving
        return top - 1
    medium = medium_of(world, state, top)
    n_x, n_y, n_z = normal_at(world, state, top, kind, hit)
    state[top, EVENTS] += 1.0
    cos_in = meet(state, top, columns, n_x, n_y, n_z)
    n = media.solid_n[w, solid] / media.n[w, medium]
    kappa = media.solid_kappa[w, solid] / media.n[w, medium]
    base = media.base[w, solid, medium]
    scattered = 0.0
    if base > 0.0:
        draw_a, draw_b = uniform_pair(stream, number, event)
        copy_beam(state, top, top + 1)
        cos_out = scatter_about(state, top + 1, n_x, n_y, n_z, draw_a, draw_b)
        come_out(state, top + 1, columns, cos_in, cos_out, n, kappa, base)
        set_rate(state, top + 1, n_x, n_y, n_z)
        scattered = state[top + 1, MUELLER]
    a, b, c, d = reflection_elements(cos_in, n, kappa)
    apply_elements(state, top, columns, a, b, c, d)
    energy[w, ABSORBED] += arriving - state[top, MUELLER] - scattered
    if state[top, MUELLER] > 0.0:
        reflect_beam(state, top, n_x, n_y, n_z, cos_in)
        set_rate(state, top, n_x, n_y, n_z)
        return top + 1 if scattered > 0.0 else top
    if scattered > 0.0:
        copy_beam(state, top + 1, top)
        return top
    return top - 1


@jit(forceinline=True)
def absorb_on_the_way(world, w, state, top, columns, distance, energy):
    """Weaken the beam by the medium it has crossed, Beer and Lambert."""
    absorption = world.media.absorption[w, medium_of(world, state, top)]
    if absorption > 0.0:
        arriving = state[top, MUELLER]
        scale_columns(state, top, columns, math.exp(-absorption * distance))
        energy[w, ABSORBED] += arriving - state[top, MUELLER]


@jit(forceinline=True)
def survives(state, top, columns, stream, number, event):
    """Whether a beam goes on; a weak one by chance, at the strength of the threshold."""
    strength = state[top, MUELLER]
    if strength >= WEAK:
        return True
    _, draw = uniform_pair(stream, number, event)
    if draw * WEAK >= strength:
        return False
    scale_columns(state, top, columns, WEAK / strength)
    return True
