"""Light among transparent bodies and films on an opaque height field.

A beam goes from event to event: it enters or leaves a body or the film, or meets something
opaque. At an interface both parts are followed while each is strong; else one of them is
chosen by chance, with the probability of its share of the light, so that the beam carries
on at full strength and all elements of its matrix stay unbiased. What the beam is inside
of is kept as a list that changes at the events and nowhere else; no point is ever tested.
"""

import math
from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.beams import (
    CELL_I,
    CELL_J,
    CELL_U,
    CELL_V,
    EVENTS,
    FACET,
    FILM,
    FREE,
    INSIDE,
    KX,
    KY,
    KZ,
    LEFT,
    MUELLER,
    N_INSIDE,
    N_STATE,
    NOTHING,
    ON_BODY,
    ON_FILM,
    ON_GROUND,
    RATE,
    START,
    SX,
    SY,
    SZ,
    X,
    Y,
    Z,
    copy_beam,
    enter_body,
    inside_slot,
    leave_body,
    move_axes,
)
from pbrdf.kernels.binning import bin_of_direction
from pbrdf.kernels.bodies import (
    FAR,
    HIT_T,
    HIT_X,
    HIT_Y,
    MISMATCH,
    NO_BODY,
    body_interval,
    body_normal,
    next_body,
)
from pbrdf.kernels.entry import entry_line, first_ray, wrap_into
from pbrdf.kernels.fresnel import reflection_elements, transmission_elements
from pbrdf.kernels.heightfield import (
    ESCAPED,
    HIT,
    LOST,
    SIDE,
    cell_counts,
    facet_slopes,
    walk_until,
)
from pbrdf.kernels.interfaces import (
    GRAZING,
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

MAX_STEPS = 10_000_000  # of a walk, and of one ray with all its parts
# Both parts of a beam are followed while the weaker has this share of the ray; a part below
# the second share goes on by chance only
SPLIT = 0.01
WEAK = 1e-3

CROWDED = -9
NO_FILM, CONFORMAL, LEVEL = 0, 1, 2
# What comes next: a facet of the ground or of the film, from above or from below; the
# surface of a body, from outside or inside; or the end of the path
GROUND, FILM_DOWN, FILM_UP, BODY_IN, BODY_OUT, OUT, ASIDE, ASTRAY = 0, 1, 2, 3, 4, 5, 6, 7
# What the next event is, after the columns of `pbrdf.kernels.bodies`
HIT_BODY, HIT_I, HIT_J, HIT_FACET, HIT_U, HIT_V, HIT_Z, N_HIT = 3, 4, 5, 6, 7, 8, 9, 10

# A film: its kind, its thickness or level [um], its medium, and the ground upside down
Film = namedtuple("Film", "kind height medium flipped")
# Transparent media, 0 the air: index and absorption [1/um] (wavelengths, media), and the
# solid that a medium is instead, or -1. Solids, first the materials of the ground: index
# (wavelengths, solids), strength of the diffuse base under each medium (wavelengths,
# solids, media), and which are black
Media = namedtuple("Media", "n absorption solid solid_n solid_kappa base black")
World = namedtuple("World", "terrain film bodies media")


@jit(forceinline=True)
def medium_of(world, state, top):
    """Medium the beam is in: of all that holds it, the one named first in the scene."""
    medium = 0
    for slot in range(int(state[top, N_INSIDE])):
        number = state[top, INSIDE + 3 * slot]
        other = world.film.medium
        if number != FILM:
            other = world.bodies.medium[int(number)]
        if medium == 0 or other < medium:
            medium = other
    return medium


@jit(allocates=False)
def next_facet(terrain, state, top, start, lift, flip, t_limit, hit):
    """Facet of a lifted or flipped height field that the beam meets before t_limit.

    `flip` is 1 above the field and -1 below it. Returns what `walk_until` says; a hit is
    written into `hit`.
    """
    k_x, k_y, k_z = state[top, KX], state[top, KY], flip * state[top, KZ]
    # A ray that rises more steeply than any facet can meet none
    if k_z >= terrain.free_slope * math.sqrt(k_x * k_x + k_y * k_y):
        return ESCAPED
    facet = -1
    rate = 0.0
    if state[top, START] == start:
        facet = int(state[top, FACET])
        i = int(state[top, CELL_I])
        j = int(state[top, CELL_J])
        u, v = state[top, CELL_U], state[top, CELL_V]
        rate = state[top, RATE]
    else:
        nx, ny = cell_counts(terrain)
        x = state[top, X] / terrain.pitch_x
        y = state[top, Y] / terrain.pitch_y
        i = min(int(x), nx - 1)
        j = min(int(y), ny - 1)
        u, v = x - i, y - j
    fate, i, j, facet, u, v, z, t = walk_until(
        terrain, i, j, facet, u, v, flip * (state[top, Z] - lift),
        k_x / terrain.pitch_x, k_y / terrain.pitch_y, k_z, rate, t_limit, MAX_STEPS,
    )  # fmt: skip
    if fate == HIT:
        hit[HIT_T] = t
        hit[HIT_I] = i
        hit[HIT_J] = j
        hit[HIT_FACET] = facet
        hit[HIT_U] = u
        hit[HIT_V] = v
        hit[HIT_Z] = flip * z + lift
    return fate


@jit(forceinline=True)
def next_surface(world, state, top, hit):
    """Surface of a body, or plane of a level film, that the beam meets next."""
    film, bodies = world.film, world.bodies
    x, y, z = state[top, X], state[top, Y], state[top, Z]
    k_x, k_y, k_z = state[top, KX], state[top, KY], state[top, KZ]
    kind = OUT
    t = FAR
    bodies_inside = 0
    in_film = False
    # The way out of every body that holds the beam
    for slot in range(int(state[top, N_INSIDE])):
        number = state[top, INSIDE + 3 * slot]
        if number == FILM:
            in_film = True
            continue
        bodies_inside += 1
        axis_x = state[top, INSIDE + 3 * slot + 1]
        axis_y = state[top, INSIDE + 3 * slot + 2]
        k = int(number)
        _, t_out = body_interval(
            bodies, k, x - axis_x, y - axis_y, z - bodies.z[k], k_x, k_y, k_z
        )
        if max(t_out, 0.0) < t:
            t = max(t_out, 0.0)
            kind = BODY_OUT
            hit[HIT_BODY] = k
            hit[HIT_X] = axis_x
            hit[HIT_Y] = axis_y
    nears = k_z > 0.0 if in_film else k_z < 0.0
    if film.kind == LEVEL and nears and state[top, START] != ON_FILM:
        t_plane = max((film.height - z) / k_z, 0.0)
        if t_plane < t:
            t = t_plane
            kind = FILM_UP if in_film else FILM_DOWN
            hit[HIT_FACET] = -1.0
            hit[HIT_Z] = film.height
    hit[HIT_T] = t
    # Other bodies: from inside of one only where bodies overlap
    if bodies.medium.size > 0 and (bodies_inside == 0 or bodies.overlap):
        found = next_body(bodies, state, top, t, hit)
        if found == MISMATCH:
            return ASTRAY, in_film
        if found != NO_BODY:
            kind = BODY_IN
            hit[HIT_BODY] = found
    return kind, in_film


@jit(forceinline=True)
def next_event(world, state, top, hit):
    """Find what the beam meets next; where and how far away is written into `hit`."""
    terrain, film = world.terrain, world.film
    kind, in_film = next_surface(world, state, top, hit)
    if kind == ASTRAY:
        return ASTRAY
    fate = ESCAPED
    conformal = film.kind == CONFORMAL
    if conformal:
        # The upper side of the film, the surface lifted by its thickness, from either side
        flip = -1.0 if in_film else 1.0
        if in_film:
            fate = next_facet(
                film.flipped, state, top, ON_FILM, film.height, flip, hit[HIT_T], hit
            )
        else:
            fate = next_facet(
                terrain, state, top, ON_FILM, film.height, flip, hit[HIT_T], hit
            )
        if fate == HIT:
            kind = FILM_UP if in_film else FILM_DOWN
    if not conformal or in_film:
        below = next_facet(terrain, state, top, ON_GROUND, 0.0, 1.0, hit[HIT_T], hit)
        if below == HIT:
            kind = GROUND
        if below != ESCAPED:
            fate = below
    if kind == OUT:
        if fate == SIDE:
            return ASIDE
        if fate == LOST or state[top, N_INSIDE] > 0:
            return ASTRAY
    return kind


@jit(forceinline=True)
def move_beam(world, state, top, kind, hit):
    """Take the beam to where the event is, round the period if need be."""
    terrain = world.terrain
    x = state[top, X] + hit[HIT_T] * state[top, KX]
    y = state[top, Y] + hit[HIT_T] * state[top, KY]
    z = state[top, Z] + hit[HIT_T] * state[top, KZ]
    nx, ny = cell_counts(terrain)
    size_x = nx * terrain.pitch_x
    size_y = ny * terrain.pitch_y
    new_x, new_y = x, y
    facet = kind == GROUND or (kind in (FILM_DOWN, FILM_UP) and hit[HIT_FACET] >= 0.0)
    if facet:
        new_x = (hit[HIT_I] + hit[HIT_U]) * terrain.pitch_x
        new_y = (hit[HIT_J] + hit[HIT_V]) * terrain.pitch_y
        z = hit[HIT_Z]
    elif terrain.periodic:
        new_x = x - size_x * math.floor(x / size_x)
        new_y = y - size_y * math.floor(y / size_y)
    if terrain.periodic:
        shift_x = size_x * math.floor((new_x - x) / size_x + 0.5)
        shift_y = size_y * math.floor((new_y - y) / size_y + 0.5)
        if shift_x != 0.0 or shift_y != 0.0:
            move_axes(state, top, shift_x, shift_y)
            hit[HIT_X] += shift_x
            hit[HIT_Y] += shift_y
    state[top, X] = new_x
    state[top, Y] = new_y
    state[top, Z] = z
    state[top, START] = FREE
    state[top, LEFT] = NOTHING
    if facet:
        state[top, START] = ON_GROUND if kind == GROUND else ON_FILM
        state[top, CELL_I] = hit[HIT_I]
        state[top, CELL_J] = hit[HIT_J]
        state[top, FACET] = hit[HIT_FACET]
        state[top, CELL_U] = hit[HIT_U]
        state[top, CELL_V] = hit[HIT_V]
    elif kind in (BODY_IN, BODY_OUT):
        state[top, START] = ON_BODY
        state[top, LEFT] = hit[HIT_BODY]
        state[top, LEFT + 1] = hit[HIT_X]
        state[top, LEFT + 2] = hit[HIT_Y]
    else:
        state[top, Z] = world.film.height
        state[top, START] = ON_FILM
        state[top, FACET] = -1.0


@jit(forceinline=True)
def normal_at(world, state, top, kind, hit):
    """Find the normal of the surface just met, towards the beam."""
    if kind in (BODY_IN, BODY_OUT):
        k = int(hit[HIT_BODY])
        n_x, n_y, n_z = body_normal(
            world.bodies, k, state[top, X] - hit[HIT_X], state[top, Y] - hit[HIT_Y],
            state[top, Z] - world.bodies.z[k],
        )  # fmt: skip
        if kind == BODY_OUT:
            n_x, n_y, n_z = -n_x, -n_y, -n_z
        return n_x, n_y, n_z
    slope_x = 0.0
    slope_y = 0.0
    if state[top, FACET] >= 0.0:
        slope_x, slope_y = facet_slopes(
            world.terrain, int(state[top, CELL_I]), int(state[top, CELL_J]),
            int(state[top, FACET]),
        )  # fmt: skip
    scale = 1.0 / math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    if kind == FILM_UP:
        scale = -scale
    return -slope_x * scale, -slope_y * scale, scale


@jit(allocates=False)
def set_rate(state, top, n_x, n_y, n_z):
    """Speed at which the beam leaves the facet it starts on, up or down from it."""
    along = state[top, KX] * n_x + state[top, KY] * n_y + state[top, KZ] * n_z
    state[top, RATE] = max(abs(along) / abs(n_z), GRAZING)


@jit(forceinline=True)
def cross(world, state, top, kind, hit):
    """Note that the beam has crossed the surface just met; False if it cannot be noted."""
    number = FILM
    if kind in (BODY_IN, BODY_OUT):
        number = hit[HIT_BODY]
    if kind in (BODY_IN, FILM_DOWN):
        return enter_body(state, top, number, hit[HIT_X], hit[HIT_Y])
    slot = inside_slot(state, top, number, hit[HIT_X], hit[HIT_Y])
    if slot >= 0:
        leave_body(state, top, slot)
    return slot >= 0


@jit(forceinline=True)
def meet_interface(world, w, state, top, kind, hit, columns, draw):
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
def meet_solid(world, w, state, top, kind, hit, columns, draw_a, draw_b, energy):
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


@jit(allocates=False)
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


@jit(allocates=False)
def launch_beam(state, x, y, z, source, cos_phi, sin_phi, columns):
    """Start a beam of unit matrix in the air, against dir_i."""
    for column in range(N_STATE):
        state[0, column] = 0.0
    state[0, X] = x
    state[0, Y] = y
    state[0, Z] = z
    state[0, KX] = -source.sin_theta * cos_phi
    state[0, KY] = -source.sin_theta * sin_phi
    state[0, KZ] = -source.cos_theta
    state[0, SX] = sin_phi
    state[0, SY] = -cos_phi
    state[0, FACET] = -1.0
    state[0, LEFT] = NOTHING
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
def survives(state, top, columns, draw):
    """Whether a beam goes on; a weak one by chance, at the strength of the threshold."""
    strength = state[top, MUELLER]
    if strength >= WEAK:
        return True
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
    draw_a, draw_b = uniform_pair(stream, number, 2 * step)
    opaque = kind == GROUND
    if kind == BODY_IN:
        opaque = world.media.solid[w, world.bodies.medium[int(hit[HIT_BODY])]] >= 0
    if opaque:
        new = meet_solid(
            world, w, state, top, kind, hit, columns, draw_a, draw_b, tally.energy
        )
    else:
        new = meet_interface(world, w, state, top, kind, hit, columns, draw_a)
        if new == CROWDED:
            end_beam(state, top, ASTRAY, columns, w, cos_phi, sin_phi, tally)
            return top - 1
    if new >= 0:
        _, chance = uniform_pair(stream, number, 2 * step + 1)
        if not survives(state, new, columns, chance):
            return new - 1
    return new


@jit(allocates=False)
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
        first = first_ray(line, source)
        rays = first_ray(line + 1, source) - first
        for ray in range(rays):
            s = length * ((ray + offset) / rays)
            x = wrap_into(start_x + speed_x * s, launch[0], launch[2])
            y = wrap_into(start_y + speed_y * s, launch[1], launch[3])
            for w in range(tally.energy.shape[0]):
                launch_beam(
                    room.state, x * terrain.pitch_x, y * terrain.pitch_y, z_start,
                    source, cos_phi, sin_phi, columns,
                )  # fmt: skip
                trace_beams(
                    world, w, first + ray, source, cos_phi, sin_phi, max_events,
                    columns, room, tally,
                )  # fmt: skip
