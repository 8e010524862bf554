"""Light among bodies and films on an opaque height field or mesh, and in solids of a mesh.

A beam goes from event to event: it enters or leaves a body, a solid or the film, or meets
something opaque, and may come apart there (`pbrdf.kernels.bodies.splitting`). The part at
the top of the stack is followed to its end, then those below it.
"""

from pbrdf.kernels import jit
from pbrdf.kernels.bodies.beams import (
    EVENTS,
    FACET,
    FREE,
    INDEX,
    KX,
    KY,
    KZ,
    LEFT,
    MUELLER,
    N_INSIDE,
    NOTHING,
    START,
    X,
    Y,
    Z,
)
from pbrdf.kernels.bodies.bodies import HIT_T
from pbrdf.kernels.bodies.detectors import detect, turn_cones
from pbrdf.kernels.bodies.events import first_event, move_beam, next_event
from pbrdf.kernels.bodies.interfaces import set_axis
from pbrdf.kernels.bodies.media import solid_at
from pbrdf.kernels.bodies.splitting import (
    CROWDED,
    arrives,
    meet_interface,
    meet_solid,
    survives,
)
from pbrdf.kernels.bodies.world import ASIDE, ASTRAY, CONFORMAL, OUT, PASSED
from pbrdf.kernels.paths.random import Draw
from pbrdf.kernels.paths.shading import (
    LEAKED,
    N_BELOW,
    N_ESCAPED,
    N_EXACT,
    N_LEAKED,
    N_MISMATCH,
    N_ORDERS,
    N_SEGMENTS,
    N_SIDE,
    N_TRUNCATED,
    SIDEWAYS,
    TRANSMITTED,
    TRUNCATED,
)
from pbrdf.kernels.terrain.entry import entry_point, rays_of_line, way_of
from pbrdf.kernels.terrain.sweep import sweep_line

MAX_STEPS = 10_000_000  # of one ray with all its parts


@jit(forceinline=True)
def deposit(state, top, columns, w, beam, tally):
    """Count a beam that leaves the scene, and add its matrix to its bin or its cones."""
    order = int(min(state[top, EVENTS], tally.flux.shape[1])) - 1
    tally.counts[N_ESCAPED] += 1
    tally.counts[N_ORDERS + order] += 1
    detect(state, top, columns, w, order, beam, tally, tally.cones)


@jit(forceinline=True)
def end_beam(state, top, kind, columns, w, beam, tally):
    """Book what has become of a beam that goes no further."""
    if kind == OUT and state[top, EVENTS] > 0.0 and state[top, KZ] > 0.0:
        deposit(state, top, columns, w, beam, tally)
    elif kind == ASIDE:
        tally.counts[N_SIDE] += 1
        tally.energy[w, SIDEWAYS] += state[top, MUELLER]
    elif kind == PASSED:
        tally.counts[N_BELOW] += 1
        tally.energy[w, TRANSMITTED] += state[top, MUELLER]
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
    state[0, X] = x
    state[0, Y] = y
    state[0, Z] = z
    state[0, KX], state[0, KY], state[0, KZ] = way_of(beam)
    set_axis(state, 0, beam.s)
    state[0, START] = FREE
    state[0, FACET] = -1.0
    state[0, EVENTS] = 0.0
    state[0, LEFT] = NOTHING
    state[0, N_INSIDE] = 0.0
    state[0, INDEX] = 1.0
    for element in range(16):
        state[0, MUELLER + element] = 0.0
    for row in range(columns):
        state[0, MUELLER + 5 * row] = 1.0


@jit(forceinline=True)
def follow_beam(world, w, top, kind, draw, beam, max_events, columns, room, tally):
    """Take the beam at the top of the stack to its next event; returns the new top.

    `draw` names the first of two pairs of random numbers; `beam` is the light as it came.
    """
    state, hit = room.state, room.hit
    if kind < OUT and not arrives(world, w, state, top, columns, hit[HIT_T], tally.energy):
        return top - 1
    if kind >= OUT or state[top, EVENTS] >= max_events:
        end_beam(state, top, kind, columns, w, beam, tally)
        return top - 1

    move_beam(world, state, top, kind, hit)
    solid = solid_at(world, w, state, top, kind, hit)
    if solid >= 0:
        new = meet_solid(
            world, w, state, top, kind, solid, hit, columns, draw, tally.energy
        )
    else:
        new = meet_interface(world, w, state, top, kind, hit, columns, draw, tally.energy)
        if new == CROWDED:
            end_beam(state, top, ASTRAY, columns, w, beam, tally)
            return top - 1
    later = Draw(draw.stream, draw.number, draw.event + 1)
    if new >= 0 and not survives(state, new, columns, later):
        return new - 1
    return new


@jit(forceinline=True)
def event_of_step(world, terrain, top, step, ray, room):
    """Find what the beam meets next; the first facets of a line may be known."""
    kind = OUT
    if terrain is None:
        kind = next_event(world, room.state, top, room.hit)
    if terrain is not None:
        if step == 0 and room.meetings.size > 0:
            kind = first_event(world, room.state, room.meetings[ray], room.hit)
        else:
            kind = next_event(world, room.state, top, room.hit)
    return kind


@jit(forceinline=True)
def trace_beams(world, w, number, ray, stream, beam, max_events, columns, room, tally):
    """Follow one ray of a line and all its parts until their light has left or is lost."""
    top = 0
    step = 0
    while top >= 0:
        kind = event_of_step(world, world.terrain, top, step, ray, room)
        draw = Draw(stream, number, 2 * step)
        top = follow_beam(world, w, top, kind, draw, beam, max_events, columns, room, tally)
        step += 1
        if step == MAX_STEPS and top >= 0:
            end_beam(room.state, top, ASTRAY, columns, w, beam, tally)
            break
    tally.counts[N_SEGMENTS] += step


@jit(allocates=False)
def trace_among_bodies(world, source, z_start, max_events, columns, room, tally):
    """Trace rays of one incident direction over a scene with bodies or a film.

    The rays start in a plane above everything; see
    `pbrdf.kernels.paths.transport.trace_batch`.
    """
    terrain = world.terrain
    for line in range(source.n_lines):
        beam, first, rays, points = rays_of_line(
            line, source, terrain.pitch_x, terrain.pitch_y
        )
        turn_cones(tally.cones, beam)
        if room.meetings.size > 0:
            lift = world.film.height if world.film.kind == CONFORMAL else 0.0
            sweep_line(terrain, line, source, z_start - lift, room.meetings)
        for ray in range(rays):
            x, y = entry_point(points, ray, rays, source.launch)
            for w in range(tally.energy.shape[0]):
                launch_beam(
                    room.state, x * terrain.pitch_x, y * terrain.pitch_y, z_start,
                    beam, columns,
                )  # fmt: skip
                trace_beams(
                    world, w, first + ray, ray, source.stream, beam, max_events, columns,
                    room, tally,
                )  # fmt: skip


@jit(allocates=False)
def trace_on_mesh(world, source, z_top, max_events, columns, room, tally):
    """`trace_among_bodies` over a mesh: places are micrometres, entry points at z_top.

    Rays start a little before, so that none starts on a facet.
    """
    frame = world.mesh.frame
    margin = frame.z_top - frame.z_high
    tally.counts[N_EXACT] -= world.mesh.searches[0]
    for line in range(source.n_lines):
        beam, first, rays, points = rays_of_line(line, source, 1.0, 1.0)
        turn_cones(tally.cones, beam)
        k = way_of(beam)
        before = margin / beam.cos_t
        for ray in range(rays):
            x, y = entry_point(points, ray, rays, source.launch)
            for w in range(tally.energy.shape[0]):
                launch_beam(
                    room.state, x - before * k.x, y - before * k.y, z_top + margin, beam,
                    columns,
                )  # fmt: skip
                trace_beams(
                    world, w, first + ray, ray, source.stream, beam, max_events, columns,
                    room, tally,
                )  # fmt: skip
    tally.counts[N_EXACT] += world.mesh.searches[0]
