"""Light among transparent bodies and films on an opaque height field.

A beam goes from event to event: it enters or leaves a body or the film, or meets something
opaque. At an interface both parts are followed while each is strong; else one of them is
chosen by chance, with the probability of its share of the light, so that the beam carries
on at full strength and all elements of its matrix stay unbiased.
"""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.beams import (
    CELL_I,
    CELL_J,
    EVENTS,
    FACET,
    FREE,
    KX,
    KY,
    KZ,
    LEFT,
    MUELLER,
    N_INSIDE,
    NOTHING,
    START,
    SX,
    SY,
    SZ,
    X,
    Y,
    Z,
    copy_beam,
)
from pbrdf.kernels.binning import bin_of_direction
from pbrdf.kernels.bodies import HIT_T
from pbrdf.kernels.entry import entry_line, first_ray, line_beam, wrap_into
from pbrdf.kernels.events import (
    ASIDE,
    ASTRAY,
    BODY_IN,
    GROUND,
    HIT_BODY,
    OUT,
    cross,
    medium_of,
    move_beam,
    next_event,
    normal_at,
    set_rate,
)
from pbrdf.kernels.fresnel import reflection_elements, transmission_elements
from pbrdf.kernels.interfaces import (
    apply_elements,
    meet,
    reflect_beam,
    refract_beam,
    scale_columns,
    scatter_about,
    turn_columns,
)
from pbrdf.kernels.random import uniform_pair
from pbrdf.kernels.shading import (
    ABSORBED,
    LEAKED,
    N_ESCAPED,
    N_LEAKED,
    N_MISMATCH,
    N_ORDERS,
    N_SEGMENTS,
    N_SIDE,
    N_TRUNCATED,
    SIDEWAYS,
    TRUNCATED,
)
from pbrdf.kernels.transport import exit_turn

MAX_STEPS = 10_000_000  # of one ray with all its parts
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
def meet_solid(
    world, w, state, top, kind, hit, columns, stream, number, event, energy
):  # fmt: skip
    """Reflect at something opaque and scatter at the base under it; returns the new top."""
    media = world.media
    if kind == GROUND:
        labels = world.terrain.labels
        solid = 0
        if labels.size > 0:
            solid = int(labels[int(state[top, CELL_I]), int(state[top, CELL_J])])
    else:
        solid = media.solid[w, world.bodies.medium[int(hit[HIT_BODY])]]
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
        a_in, b_in, _, _ = transmission_elements(cos_in, n, kappa)
        cos_out = scatter_about(state, top + 1, n_x, n_y, n_z, draw_a, draw_b)
        a_out, b_out, _, _ = transmission_elements(cos_out, n, kappa)
        for column in range(columns):
            inside = base * (
                a_in * state[top, MUELLER + column]
                + b_in * state[top, MUELLER + 4 + column]
            )
            state[top + 1, MUELLER + column] = a_out * inside
            state[top + 1, MUELLER + 4 + column] = b_out * inside
            state[top + 1, MUELLER + 8 + column] = 0.0
            state[top + 1, MUELLER + 12 + column] = 0.0
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
def deposit(state, top, columns, w, cos_phi_i, sin_phi_i, tally):
    """Add the matrix of a beam that leaves the scene to its bin."""
    k_x, k_y, k_z = state[top, KX], state[top, KY], state[top, KZ]
    c2, s2 = exit_turn(
        k_x, k_y, k_z, state[top, SX], state[top, SY], state[top, SZ],
        cos_phi_i, sin_phi_i,
    )  # fmt: skip
    turn_columns(state, top, columns, c2, s2)
    i_theta, i_dphi = bin_of_direction(
        k_x, k_y, k_z, cos_phi_i, sin_phi_i, tally.zenith, tally.azimuth
    )
    order = int(min(state[top, EVENTS], tally.flux.shape[1])) - 1
    tally.counts[N_ESCAPED] += 1
    tally.counts[N_ORDERS + order] += 1
    for row in range(columns):
        for column in range(columns):
            tally.flux[w, order, i_theta, i_dphi, row, column] += state[
                top, MUELLER + 4 * row + column
            ]


@jit(forceinline=True)
def end_beam(state, top, kind, columns, w, cos_phi_i, sin_phi_i, tally):
    """Book what has become of a beam that goes no further."""
    if kind == OUT and state[top, EVENTS] > 0.0 and state[top, KZ] > 0.0:
        deposit(state, top, columns, w, cos_phi_i, sin_phi_i, tally)
    elif kind == ASIDE:
        tally.counts[N_SIDE] += 1
        tally.energy[w, SIDEWAYS] += state[top, MUELLER]
    elif kind < OUT:
        tally.counts[N_TRUNCATED] += 1
        tally.energy[w, TRUNCATED] += state[top, MUELLER]
    else:
        tally.counts[N_LEAKED] += 1
        tally.energy[w, LEAKED] += state[top, MUELLER]
        if kind == ASTRAY:
            tally.counts[N_MISMATCH] += 1


@jit(forceinline=True)
def launch_beam(state, x, y, z, beam, columns):
    """Start a beam of unit matrix in the air, of the light that `line_beam` tells."""
    _, _, sin_t, cos_t, cos_b, sin_b, s_x, s_y, s_z = beam
    state[0, X] = x
    state[0, Y] = y
    state[0, Z] = z
    state[0, KX] = -sin_t * cos_b
    state[0, KY] = -sin_t * sin_b
    state[0, KZ] = -cos_t
    state[0, SX] = s_x
    state[0, SY] = s_y
    state[0, SZ] = s_z
    state[0, START] = FREE
    state[0, FACET] = -1.0
    state[0, EVENTS] = 0.0
    state[0, LEFT] = NOTHING
    state[0, N_INSIDE] = 0.0
    for element in range(16):
        state[0, MUELLER + element] = 0.0
    for row in range(columns):
        state[0, MUELLER + 5 * row] = 1.0


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


@jit(forceinline=True)
def follow_beam(
    world, w, top, stream, number, step, cos_phi, sin_phi, max_events, columns, room, tally
):  # fmt: skip
    """Take the beam at the top of the stack to its next event; returns the new top."""
    state, hit = room.state, room.hit
    kind = next_event(world, state, top, hit)
    if kind < OUT:
        absorb_on_the_way(world, w, state, top, columns, hit[HIT_T], tally.energy)
    if kind >= OUT or state[top, EVENTS] >= max_events:
        end_beam(state, top, kind, columns, w, cos_phi, sin_phi, tally)
        return top - 1

    move_beam(world, state, top, kind, hit)
    opaque = kind == GROUND
    if kind == BODY_IN:
        opaque = world.media.solid[w, world.bodies.medium[int(hit[HIT_BODY])]] >= 0
    if opaque:
        new = meet_solid(
            world, w, state, top, kind, hit, columns, stream, number, 2 * step,
            tally.energy,
        )  # fmt: skip
    else:
        new = meet_interface(
            world, w, state, top, kind, hit, columns, stream, number, 2 * step
        )
        if new == CROWDED:
            end_beam(state, top, ASTRAY, columns, w, cos_phi, sin_phi, tally)
            return top - 1
    if new >= 0 and not survives(state, new, columns, stream, number, 2 * step + 1):
        return new - 1
    return new


@jit(forceinline=True)
def trace_beams(
    world, w, number, source, cos_phi, sin_phi, max_events, columns, room, tally
):  # fmt: skip
    """Follow one ray and all its parts until their light has left or is lost."""
    top = 0
    step = 0
    while top >= 0:
        top = follow_beam(
            world, w, top, source.stream, number, step, cos_phi, sin_phi, max_events,
            columns, room, tally,
        )  # fmt: skip
        step += 1
        if step == MAX_STEPS and top >= 0:
            end_beam(room.state, top, ASTRAY, columns, w, cos_phi, sin_phi, tally)
            break
    tally.counts[N_SEGMENTS] += step


@jit(allocates=False)
def trace_among_bodies(world, source, z_start, max_events, columns, room, tally):
    """Trace rays of one incident direction over a scene with bodies or a film.

    The rays start in a plane above everything; see `pbrdf.kernels.transport.trace_batch`.
    """
    terrain = world.terrain
    launch = source.launch
    for line in range(source.n_lines):
        start_x, start_y, speed_x, speed_y, length, _, offset, cos_phi, sin_phi = (
            entry_line(line, source, terrain.pitch_x, terrain.pitch_y)
        )
        beam = line_beam(line, source)
        first = first_ray(line, source)
        rays = first_ray(line + 1, source) - first
        for ray in range(rays):
            s = length * ((ray + offset) / rays)
            x = wrap_into(start_x + speed_x * s, launch[0], launch[2])
            y = wrap_into(start_y + speed_y * s, launch[1], launch[3])
            for w in range(tally.energy.shape[0]):
                launch_beam(
                    room.state, x * terrain.pitch_x, y * terrain.pitch_y, z_start,
                    beam, columns,
                )  # fmt: skip
                trace_beams(
                    world, w, first + ray, source, cos_phi, sin_phi, max_events,
                    columns, room, tally,
                )  # fmt: skip
