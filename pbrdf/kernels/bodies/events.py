"""What a beam among bodies meets next, and where: geometry only.

The ground and the upper side of a film are walked over, bodies are met at the roots of
quadratics, and facets of a mesh as `pbrdf.kernels.bodies.on_mesh` says. What the beam is
inside of is a list that changes when it crosses a surface; no point is ever tested.
"""

import math

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
from pbrdf.kernels.bodies.on_mesh import next_on_mesh
from pbrdf.kernels.bodies.world import (
    ASIDE,
    ASTRAY,
    BODY_IN,
    BODY_OUT,
    CONFORMAL,
    FILM_DOWN,
    FILM_UP,
    GROUND,
    HIT_BODY,
    HIT_FACET,
    HIT_I,
    HIT_J,
    HIT_U,
    HIT_V,
    HIT_Z,
    LEVEL,
    OUT,
    SOLID_IN,
    SOLID_OUT,
)
from pbrdf.kernels.meshes.facets import facet_normal
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
    # A direction that is no number would read outside of the tables
    if not abs(k_x) + abs(k_y) + abs(k_z) < 4.0:
        return ASTRAY, False
    kind = OUT
    t = t_limit
    bodies_inside = 0
    in_film = False
    # The way out of every body that holds the beam
    for slot in range(int(state[top, N_INSIDE])):
        number = state[top, INSIDE + 3 * slot]
        if number < 0.0:
            # The way out of the film or of a solid is found with its facets
            in_film = in_film or number == FILM
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
    kind, in_film = next_surface(world, state, top, FAR, hit)
    if kind == ASTRAY:
        return ASTRAY
    return next_of_facets(world, world.terrain, world.mesh, state, top, kind, in_film, hit)


@jit(forceinline=True)
def next_of_facets(world, terrain, mesh, state, top, kind, in_film, hit):
    """Find whether the beam meets a facet before the event of this kind in `hit`."""
    event = kind
    if terrain is not None:
        event = next_on_terrain(world, terrain, state, top, kind, in_film, hit)
    if mesh is not None:
        event = next_on_mesh(mesh, state, top, kind, hit)
    return event


@jit(forceinline=True)
def next_on_terrain(world, terrain, state, top, kind, in_film, hit):
    """`next_of_facets` over a height field, clean or with a film."""
    film = world.film
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
def place_of_hit(terrain, mesh, hit):
    """Give the place (x, y) of the facet just met."""
    x, y = hit[HIT_U], hit[HIT_V]
    if terrain is not None:
        x = (hit[HIT_I] + x) * terrain.pitch_x
        y = (hit[HIT_J] + y) * terrain.pitch_y
    return x, y


@jit(forceinline=True)
def repeats(terrain, mesh):
    """Whether the surface repeats, and its lengths."""
    periodic, size_x, size_y = False, 0.0, 0.0
    if terrain is not None:
        nx, ny = cell_counts(terrain)
        periodic = terrain.periodic
        size_x, size_y = nx * terrain.pitch_x, ny * terrain.pitch_y
    if mesh is not None:
        periodic = mesh.frame.periodic
        size_x, size_y = mesh.frame.period_x, mesh.frame.period_y
    return periodic, size_x, size_y


@jit(forceinline=True)
def move_beam(world, state, top, kind, hit):
    """Take the beam to where the event is, round the period if need be."""
    x = state[top, X] + hit[HIT_T] * state[top, KX]
    y = state[top, Y] + hit[HIT_T] * state[top, KY]
    z = state[top, Z] + hit[HIT_T] * state[top, KZ]
    periodic, size_x, size_y = repeats(world.terrain, world.mesh)
    new_x, new_y = x, y
    facet = kind in (GROUND, SOLID_IN, SOLID_OUT) or (
        kind in (FILM_DOWN, FILM_UP) and hit[HIT_FACET] >= 0.0
    )
    if facet:
        new_x, new_y = place_of_hit(world.terrain, world.mesh, hit)
        z = hit[HIT_Z]
    elif periodic:
        new_x = x - size_x * math.floor(x / size_x)
        new_y = y - size_y * math.floor(y / size_y)
    if periodic:
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
        state[top, START] = ON_FILM if kind in (FILM_DOWN, FILM_UP) else ON_GROUND
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
def normal_of_facet(terrain, mesh, state, top):
    """Give the normal of the facet that the beam is on; that of a level film is upright."""
    normal = Vec(0.0, 0.0, 1.0)
    if terrain is not None:
        slope_x = 0.0
        slope_y = 0.0
        if state[top, FACET] >= 0.0:
            slope_x, slope_y = facet_slopes(
                terrain, int(state[top, CELL_I]), int(state[top, CELL_J]),
                int(state[top, FACET]),
            )  # fmt: skip
        normal, _ = normal_of_slopes(slope_x, slope_y)
    if mesh is not None:
        n_x, n_y, n_z = facet_normal(mesh, int(state[top, FACET]))
        normal = Vec(n_x, n_y, n_z)
    return normal


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
    normal = normal_of_facet(world.terrain, world.mesh, state, top)
    return opposite(normal) if kind in (FILM_UP, SOLID_OUT) else normal


@jit(forceinline=True)
def set_rate(state, top, normal):
    """Speed at which the beam leaves the facet it starts on, up or down from it."""
    along = dot(way_of_beam(state, top), normal)
    state[top, RATE] = max(abs(along) / abs(normal.z), GRAZING)


@jit(forceinline=True)
def number_of(kind, hit):
    """Give the number of the body, solid or film whose surface has just been met."""
    return FILM if kind in (FILM_DOWN, FILM_UP) else hit[HIT_BODY]


@jit(forceinline=True)
def cross(world, state, top, kind, hit):
    """Note that the beam has crossed the surface just met; False if it cannot be noted."""
    number = number_of(kind, hit)
    if kind in (BODY_IN, SOLID_IN, FILM_DOWN):
        return enter_body(state, top, number, hit[HIT_X], hit[HIT_Y])
    slot = inside_slot(state, top, number, hit[HIT_X], hit[HIT_Y])
    if slot >= 0:
        leave_body(state, top, slot)
    return slot >= 0
