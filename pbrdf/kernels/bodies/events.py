"""What a beam among bodies meets next, and where: geometry only.

The ground and the upper side of a film are walked over, bodies are met at the roots of
quadratics. What the beam is inside of is a list that changes when it crosses a surface;
no point is ever tested.
"""

import math
from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.bodies.beams import (
    CELL_I,
    CELL_J,
    CELL_U,
    CELL_V,
    FACET,
    FILM,
    FREE,
    INSIDE,
    KX,
    KY,
    KZ,
    LEFT,
    N_INSIDE,
    NOTHING,
    ON_BODY,
    ON_FILM,
    ON_GROUND,
    RATE,
    START,
    X,
    Y,
    Z,
    enter_body,
    inside_slot,
    leave_body,
    move_axes,
)
from pbrdf.kernels.bodies.bodies import (
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
from pbrdf.kernels.bodies.interfaces import way_of_beam
from pbrdf.kernels.optics.light import GRAZING
from pbrdf.kernels.optics.vectors import Vec, dot, opposite
from pbrdf.kernels.paths.ray_bounce import normal_of_slopes
from pbrdf.kernels.terrain.heightfield import (
    ESCAPED,
    HIT,
    LOST,
    SIDE,
    cell_counts,
    facet_slopes,
    walk_until,
)
from pbrdf.kernels.terrain.horizon import is_free
from pbrdf.kernels.terrain.sweep import F_FACET, F_I, F_J, F_U, F_V, F_Z

MAX_STEPS = 10_000_000
NO_FILM, CONFORMAL, LEVEL = 0, 1, 2
# What comes next: a facet of the ground or of the film, from above or from below; the
# surface of a body, from outside or inside; or the end of the path
GROUND, FILM_DOWN, FILM_UP, BODY_IN, BODY_OUT, OUT, ASIDE, ASTRAY = 0, 1, 2, 3, 4, 5, 6, 7
# What the next event is, after the columns of `pbrdf.kernels.bodies.bodies`
HIT_BODY, HIT_I, HIT_J, HIT_FACET, HIT_U, HIT_V, HIT_Z, N_HIT = 3, 4, 5, 6, 7, 8, 9, 10

# A film: its kind, its thickness or level [um], its medium, and the ground upside down
Film = namedtuple("Film", "kind height medium flipped")
# Media that light goes through, 0 the air: index and absorption [1/um] (wavelengths,
# media), and the solid that a medium is instead, or -1. Solids, first the materials of the
# ground: index (wavelengths, solids), which are black, and the diffuse base under each
# medium (wavelengths, solids, media): its strength, and the share of samples of what a
# medium takes in only because it absorbs
Media = namedtuple("Media", "n kappa absorption solid solid_n solid_kappa black base tail")
# `deep` is the optical depth from which on light is not followed, or inf
World = namedtuple("World", "terrain film bodies media deep")


@jit(forceinline=True)
def next_facet(terrain, state, top, start, lift, flip, t_limit, hit):
    """Facet of a lifted or flipped height field that the beam meets before t_limit.

    `flip` is 1 above the field and -1 below it. Returns what `walk_until` says; a hit is
    written into `hit`.
    """
    k_x, k_y, k_z = state[top, KX], state[top, KY], flip * state[top, KZ]
    # A ray that rises more steeply than any facet can meet none
    if k_z >= terrain.free_slope * math.sqrt(k_x * k_x + k_y * k_y):
        return ESCAPED
    speed_x = k_x / terrain.pitch_x
    speed_y = k_y / terrain.pitch_y
    z = flip * (state[top, Z] - lift)
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
    # Nor can one that rises above all that lies ahead
    if (
        k_z > 0.0
        and terrain.horizon.size > 0
        and is_free(terrain.horizon, terrain.z_top, i, j, z, speed_x, speed_y, k_z)
    ):
        return ESCAPED
    fate, i, j, facet, u, v, z, t = walk_until(
        terrain, i, j, facet, u, v, z, speed_x, speed_y, k_z, rate, t_limit, MAX_STEPS,
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
def next_surface(world, state, top, t_limit, hit):
    """Surface of a body, or plane of a level film, that the beam meets before t_limit."""
    film, bodies = world.film, world.bodies
    x, y, z = state[top, X], state[top, Y], state[top, Z]
    k_x, k_y, k_z = state[top, KX], state[top, KY], state[top, KZ]
    kind = OUT
    t = t_limit
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
    kind, in_film = next_surface(world, state, top, FAR, hit)
    if kind == ASTRAY:
        return ASTRAY
    fate = ESCAPED
    conformal = film.kind == CONFORMAL
    if conformal:
        # The upper side of the film, the surface lifted by its thickness, from either side
        flip = -1.0 if in_film else 1.0
        upper = film.flipped if in_film else terrain
        fate = next_facet(upper, state, top, ON_FILM, film.height, flip, hit[HIT_T], hit)
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
def first_event(world, state, meeting, hit):
    """`next_event` of a ray from above, whose first facet `sweep_line` has found."""
    film = world.film
    conformal = film.kind == CONFORMAL
    z = meeting[F_Z] + (film.height if conformal else 0.0)
    kind, _ = next_surface(world, state, 0, (state[0, Z] - z) / -state[0, KZ], hit)
    if kind != OUT:
        return kind
    hit[HIT_I] = meeting[F_I]
    hit[HIT_J] = meeting[F_J]
    hit[HIT_FACET] = meeting[F_FACET]
    hit[HIT_U] = meeting[F_U]
    hit[HIT_V] = meeting[F_V]
    hit[HIT_Z] = z
    return FILM_DOWN if conformal else GROUND


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
        normal = Vec(n_x, n_y, n_z)
        return opposite(normal) if kind == BODY_OUT else normal
    slope_x = 0.0
    slope_y = 0.0
    if state[top, FACET] >= 0.0:
        slope_x, slope_y = facet_slopes(
            world.terrain, int(state[top, CELL_I]), int(state[top, CELL_J]),
            int(state[top, FACET]),
        )  # fmt: skip
    normal, _ = normal_of_slopes(slope_x, slope_y)
    return opposite(normal) if kind == FILM_UP else normal


@jit(forceinline=True)
def set_rate(state, top, normal):
    """Speed at which the beam leaves the facet it starts on, up or down from it."""
    along = dot(way_of_beam(state, top), normal)
    state[top, RATE] = max(abs(along) / abs(normal.z), GRAZING)


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
