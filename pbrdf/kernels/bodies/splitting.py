"""How a beam comes apart at a surface, and how it is weakened on its way.

At an interface both parts are followed while each is strong; else one of them is chosen by
chance, with the probability of its share of the light, so that the beam carries on at full
strength and all elements of its matrix stay unbiased.
"""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.bodies.beams import EVENTS, INDEX, MUELLER, copy_beam
from pbrdf.kernels.bodies.events import cross, normal_at, set_rate
from pbrdf.kernels.bodies.interfaces import (
    apply_elements,
    come_out,
    meet,
    reflect_beam,
    refract_beam,
    scale_columns,
    send_out,
)
from pbrdf.kernels.bodies.media import (
    absorption_along,
    both_elements,
    index_along,
    least_way,
    leave_base,
    medium_behind,
    medium_of,
    same_index,
    solid_elements,
)
from pbrdf.kernels.paths.random import pair_of
from pbrdf.kernels.paths.shading import ABSORBED

# Both parts of a beam are followed while the weaker has this share of the ray; a part below
# the second share goes on by chance only
SPLIT = 0.01
WEAK = 1e-3
# Light this weak is below the rounding of what it would be added to, and is not followed
GONE = 1e-16
CROWDED = -9


@jit(forceinline=True)
def meet_interface(world, w, state, top, kind, hit, columns, draw, energy):
    """Reflect and refract at the surface of a body or film; returns the new top.

    Within one medium nothing happens. CROWDED says that the beam is in too many bodies.
    """
    media = world.media
    before = medium_of(world, state, top)
    after = medium_behind(world, state, top, kind, hit)
    normal = normal_at(world, state, top, kind, hit)
    if same_index(media, w, before, after):
        if not cross(world, state, top, kind, hit):
            return CROWDED
        set_rate(state, top, normal)
        return top

    state[top, EVENTS] += 1.0
    cos_in = meet(state, top, columns, normal)
    index = index_along(media, w, before, state, top)
    back, through, ratio = both_elements(media, w, before, after, index, cos_in)
    i, q = state[top, MUELLER], state[top, MUELLER + 4]
    reflected = back[0] * i + back[1] * q
    refracted = through[0] * i + through[1] * q
    if media.absorption[w, after] > 0.0:
        copy_beam(state, top, top + 1)
        refract_beam(state, top + 1, normal, cos_in, ratio)
        way = least_way(world, state, top + 1, kind, hit)
        if way * absorption_along(media, w, after, ratio * index) >= world.deep:
            ratio = 0.0
    if ratio == 0.0:
        # Nothing leaves the interface, or nothing that does will come out again
        energy[w, ABSORBED] += refracted
        refracted = 0.0
    if reflected + refracted <= 0.0:
        return top - 1
    both = min(reflected, refracted) >= SPLIT
    share = reflected / (reflected + refracted)
    keeps = False
    if not both:
        chance, _ = pair_of(draw)
        keeps = chance < share
    if both or not keeps:
        # The refracted part, on the far side
        further = top + 1 if both else top
        if both:
            copy_beam(state, top, further)
        if not cross(world, state, further, kind, hit):
            return CROWDED
        refract_beam(state, further, normal, cos_in, ratio)
        state[further, INDEX] = ratio * index
        apply_elements(state, further, columns, through)
        if not both:
            scale_columns(state, further, columns, 1.0 / (1.0 - share))
        set_rate(state, further, normal)
    if both or keeps:
        reflect_beam(state, top, normal, cos_in)
        apply_elements(state, top, columns, back)
        if not both:
            scale_columns(state, top, columns, 1.0 / share)
        set_rate(state, top, normal)
    return top + 1 if both else top


@jit(forceinline=True)
def meet_solid(world, w, state, top, kind, solid, hit, columns, draw, energy):
    """Reflect at something opaque and scatter at the base under it; returns the new top."""
    media = world.media
    arriving = state[top, MUELLER]
    if media.black[solid]:
        energy[w, ABSORBED] += arriving
        return top - 1
    medium = medium_of(world, state, top)
    normal = normal_at(world, state, top, kind, hit)
    state[top, EVENTS] += 1.0
    cos_in = meet(state, top, columns, normal)
    back, (a_in, b_in) = solid_elements(
        media, w, solid, medium, index_along(media, w, medium, state, top), cos_in
    )
    base = media.base[w, solid, medium]
    scattered = 0.0
    if base > 0.0:
        draw_a, draw_b = pair_of(draw)
        copy_beam(state, top, top + 1)
        index, sine, cos_out, weight = leave_base(media, w, solid, medium, draw_a)
        send_out(state, top + 1, normal, sine, cos_out, draw_b)
        state[top + 1, INDEX] = index
        _, (a_out, b_out) = solid_elements(media, w, solid, medium, index, cos_out)
        come_out(state, top + 1, columns, a_in, b_in, a_out, b_out, base * weight)
        set_rate(state, top + 1, normal)
        scattered = state[top + 1, MUELLER]
    apply_elements(state, top, columns, back)
    energy[w, ABSORBED] += arriving - state[top, MUELLER] - scattered
    if state[top, MUELLER] > 0.0:
        reflect_beam(state, top, normal, cos_in)
        set_rate(state, top, normal)
        return top + 1 if scattered > 0.0 else top
    if scattered > 0.0:
        copy_beam(state, top + 1, top)
        return top
    return top - 1


@jit(forceinline=True)
def arrives(world, w, state, top, columns, distance, energy):
    """Weaken the beam by the medium it has crossed, Beer and Lambert; False: it is gone."""
    media = world.media
    medium = medium_of(world, state, top)
    if media.absorption[w, medium] == 0.0:
        return True
    arriving = state[top, MUELLER]
    absorption = absorption_along(media, w, medium, state[top, INDEX])
    scale_columns(state, top, columns, math.exp(-absorption * distance))
    if state[top, MUELLER] < GONE:
        energy[w, ABSORBED] += arriving
        return False
    energy[w, ABSORBED] += arriving - state[top, MUELLER]
    return True


@jit(forceinline=True)
def survives(state, top, columns, draw):
    """Whether a beam goes on; a weak one by chance, at the strength of the threshold."""
    strength = state[top, MUELLER]
    if strength >= WEAK:
        return True
    _, chance = pair_of(draw)
    if chance * WEAK >= strength:
        return False
    scale_columns(state, top, columns, WEAK / strength)
    return True
