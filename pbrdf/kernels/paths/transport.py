"""Rays from the source to the bins over an opaque height field, one path after another.

The path depends on the facets alone; `pbrdf.kernels.paths.shading` then multiplies the
matrices of each material or wavelength along its record. Over a diffuse base every hit
sends out a second ray, in a random direction; it waits until the mirror reflections are
done and shares the record up to its own hit.
"""

from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.bins.binning import bin_of_direction
from pbrdf.kernels.meshes.packets import UNTOLD
from pbrdf.kernels.meshes.shots import BELOW, WRONG
from pbrdf.kernels.optics.frames import exit_turn, kept_axis, turn_frame
from pbrdf.kernels.optics.fresnel import reflection_elements
from pbrdf.kernels.optics.light import GRAZING
from pbrdf.kernels.optics.vectors import Vec, dot
from pbrdf.kernels.paths.first_bounce import (
    M_X,
    M_Y,
    M_Z,
    N_MIRRORED,
    end_after_one,
    mirror_line,
    slopes_of_line,
)
from pbrdf.kernels.paths.ground import (
    N_PLACE,
    first_facet,
    label_of_facet,
    next_facet,
    normal_of_facet,
    read_place,
    write_place,
)
from pbrdf.kernels.paths.mesh_lines import FATE, foresee_second, meet_first
from pbrdf.kernels.paths.random import Draw, pair_of, uniform_pair
from pbrdf.kernels.paths.ray_bounce import mirror_at, scatter_at
from pbrdf.kernels.paths.shading import (
    COS_IN,
    COS_OUT,
    LABEL,
    N_BELOW,
    N_ESCAPED,
    N_EXACT,
    N_LEAKED,
    N_MISMATCH,
    N_SEGMENTS,
    N_SELF,
    N_SIDE,
    N_TRUNCATED,
    SPECULAR,
    TURN_C,
    TURN_S,
    WEIGHT,
)
from pbrdf.kernels.paths.spectra import begin_light, end_light
from pbrdf.kernels.terrain.embree import SELF
from pbrdf.kernels.terrain.entry import (
    entry_point,
    first_ray,
    line_beam,
    rays_of_line,
    way_of,
)
from pbrdf.kernels.terrain.heightfield import ESCAPED, HIT, SIDE, rises_free
from pbrdf.kernels.terrain.sweep import sweep_line

# Columns of a waiting ray after its place: direction, s axis, leave rate, cosine of exit,
# bounces before it and weight
W_KX, W_KY, W_KZ, W_SX, W_SY, W_SZ, W_RATE, W_COS, W_BOUNCE, W_WEIGHT, N_WAITING = range(
    N_PLACE, N_PLACE + 11
)
# A ray that chance has put an end to
DROPPED = 8
# On a mesh light may be held by a hollow, where two rays after each hit would be ever more:
# from this bounce on one of the two is followed, and stands for both. The mirror's chance
# is its reflectance, within these bounds
FIRST_CHOICE = 1
LEAST_CHANCE, MOST_CHANCE = 0.02, 0.9


# Entry points for each facet of a mesh from which on those side by side share their way
# through Embree's tree
DENSE = 0.125

# What paths of one incident direction write to: record (bounces + 1, 1, N_RECORD) and
# waiting (bounces, N_WAITING), room to work in, and where their light goes
Sink = namedtuple("Sink", "record waiting spectra optics tally")


@jit(forceinline=True)
def chance_of_mirror(cos_beta, label, optics):
    """Chance with which a ray over a diffuse base goes on from the mirror above it."""
    n, kappa = optics.n, optics.kappa
    a, _, _, _ = reflection_elements(max(cos_beta, GRAZING), n[0, label], kappa[0, label])
    return min(max(a, LEAST_CHANCE), MOST_CHANCE)


@jit(forceinline=True)
def put_waiting(waiting, row, place, bounces, normal, steep, weight, draw):
    """Let a second ray leave the base under the interface, in a random direction."""
    draw_a, draw_b = pair_of(draw)
    k, s, cosine = scatter_at(normal, draw_a, draw_b)
    write_place(waiting, row, place)
    waiting[row, W_KX], waiting[row, W_KY], waiting[row, W_KZ] = k
    waiting[row, W_SX], waiting[row, W_SY], waiting[row, W_SZ] = s
    waiting[row, W_RATE] = cosine * steep
    waiting[row, W_COS] = cosine
    waiting[row, W_BOUNCE] = bounces
    waiting[row, W_WEIGHT] = weight


@jit(forceinline=True)
def write_mirror(record, bounces, cos_beta, turn, label):
    """Record a mirror reflection."""
    record[bounces, 0, COS_IN] = cos_beta
    record[bounces, 0, TURN_C], record[bounces, 0, TURN_S] = turn
    record[bounces, 0, COS_OUT] = SPECULAR
    record[bounces, 0, LABEL] = label


@jit(forceinline=True)
def end_of(fate, bounces):
    """Say what became of a path, one of the N_ constants, from the fate of its ray."""
    if fate == HIT:
        return N_TRUNCATED
    if fate == SIDE:
        return N_SIDE
    if fate == ESCAPED and bounces > 0:
        return N_ESCAPED
    if fate == BELOW:
        return N_BELOW
    return N_LEAKED


@jit(forceinline=True)
def end_path(fate, bounces, k, s, weight, beam, sink):
    """Turn the frame of a path to that of its exit, and tally its light."""
    record, _, spectra, optics, tally = sink
    turn = (1.0, 0.0)
    # The turns out of the source's frame and into the detector's do not touch M00
    if optics.n_stokes > 1:
        turn = exit_turn(k, s, beam.cos_phi, beam.sin_phi)
    record[bounces, 0, TURN_C], record[bounces, 0, TURN_S] = turn
    record[bounces, 0, WEIGHT] = weight
    end = end_of(fate, bounces)
    if fate == SELF:
        tally.counts[N_SELF] += 1
    elif fate == WRONG:
        tally.counts[N_MISMATCH] += 1
    i_theta = i_dphi = 0
    if end == N_ESCAPED:
        i_theta, i_dphi = bin_of_direction(
            k.x, k.y, k.z, beam.cos_phi, beam.sin_phi, tally.zenith, tally.azimuth
        )
    end_light(spectra, end, record, 0, bounces, i_theta, i_dphi, optics, tally)


@jit(forceinline=True)
def trace_ray(terrain, tree, mesh, fate, place, beam, draw, sink, told=UNTOLD):
    """Follow a ray from its first meeting with the surface until all its light has left.

    `fate` says what became of it so far: HIT on the facet given, or what `walk` returned;
    `beam` is the light of its line as `line_beam` tells; `tree` as in `trace_batch`; `told`
    what a packet has told of what the mirror of its first facet shows.
    """
    record, waiting, spectra, optics, tally = sink
    stream, number, events = draw
    k, s = way_of(beam), beam.s
    max_bounces = record.shape[0] - 1
    splits = optics.base.shape[1] > 0
    polarised = optics.n_stokes > 1
    begin_light(spectra, tally)
    tally.counts[N_SEGMENTS] += 1
    bounces = 0
    n_waiting = 0
    weight = 1.0
    while True:
        while fate == HIT and bounces < max_bounces:
            normal, steep = normal_of_facet(terrain, mesh, place)
            label = label_of_facet(terrain, mesh, place)
            chance = 1.0
            if splits and mesh is not None and bounces >= FIRST_CHOICE:
                chance = chance_of_mirror(-dot(k, normal), label, optics)
            mirrors = True
            if chance < 1.0:
                draw_a, _ = uniform_pair(stream, number, events)
                events += 1
                mirrors = draw_a < chance
                weight /= chance if mirrors else 1.0 - chance
            if splits and (chance == 1.0 or not mirrors):
                put_waiting(
                    waiting, n_waiting, place, bounces, normal, steep, weight,
                    Draw(stream, number, events),
                )  # fmt: skip
                events += 1
                n_waiting += 1
            r, axis, cos_beta = mirror_at(k, normal)
            turn = (1.0, 0.0)
            if polarised or bounces > 0:
                turn = turn_frame(k, s, axis)
            k, s = r, kept_axis(s, axis)
            write_mirror(record, bounces, cos_beta, turn, label)
            if not mirrors:
                fate = DROPPED
                break
            bounces += 1
            tally.counts[N_SEGMENTS] += 1
            # One bounce lies behind the mirror image of the ray that entered only
            fate, place = next_facet(
                terrain, tree, mesh, place, k, cos_beta * steep,
                told if bounces == 1 else UNTOLD,
            )  # fmt: skip

        if fate != DROPPED:
            end_path(fate, bounces, k, s, weight, beam, sink)
        if n_waiting == 0:
            break

        # The last ray that waits: its record up to its hit is still in place
        n_waiting -= 1
        k = Vec(
            waiting[n_waiting, W_KX], waiting[n_waiting, W_KY], waiting[n_waiting, W_KZ]
        )
        s = Vec(
            waiting[n_waiting, W_SX], waiting[n_waiting, W_SY], waiting[n_waiting, W_SZ]
        )
        weight = waiting[n_waiting, W_WEIGHT]
        bounces = int(waiting[n_waiting, W_BOUNCE])
        record[bounces, 0, COS_OUT] = waiting[n_waiting, W_COS]
        bounces += 1
        tally.counts[N_SEGMENTS] += 1
        fate, place = next_facet(
            terrain,
            tree,
            mesh,
            read_place(waiting, n_waiting),
            k,
            waiting[n_waiting, W_RATE],
        )


@jit(allocates=False)
def trace_batch(terrain, tree, source, record, waiting, spectra, optics, tally):
    """Trace rays of one incident direction and add their Mueller matrices to the tally.

    Every ray is followed from its entry point in the top plane; see `sweep_batch`. It
    walks, or with a `pbrdf.kernels.terrain.embree.Tree` asks Embree for each facet.
    `record` and `waiting` are room to work in. With `Spectra`, not None, the light is
    gathered there, to be shaded afterwards.
    """
    sink = Sink(record, waiting, spectra, optics, tally)
    for line in range(source.n_lines):
        beam, first, rays, points = rays_of_line(
            line, source, terrain.pitch_x, terrain.pitch_y
        )
        k = way_of(beam)
        for ray in range(rays):
            x, y = entry_point(points, ray, rays, source.launch)
            i = min(int(x), terrain.heights.shape[0] - 1)
            j = min(int(y), terrain.heights.shape[1] - 1)
            fate, place = first_facet(terrain, tree, i, j, x - i, y - j, k)
            draw = Draw(source.stream, first + ray, 0)
            trace_ray(terrain, tree, None, fate, place, beam, draw, sink)


@jit(allocates=False)
def sweep_batch(terrain, source, line_room, record, waiting, spectra, optics, tally):
    """`trace_batch` over a periodic field, without a search for the first facets.

    Over an opaque base the first bounces of a line are done together, and a ray that then
    is known to escape needs no more; `line_room` is a `LineRoom`.
    """
    meetings, slopes, mirrored = line_room
    sink = Sink(record, waiting, spectra, optics, tally)
    together = optics.base.shape[1] == 0
    labels = terrain.labels
    n_theta, n_dphi = tally.zenith.shape[0] - 1, tally.azimuth.shape[0]
    for line in range(source.n_lines):
        beam = line_beam(line, source)
        first = first_ray(line, source)
        rays = first_ray(line + 1, source) - first
        sweep_line(terrain, line, source, terrain.z_top, meetings)
        if together:
            slopes_of_line(terrain, meetings, rays, slopes)
            mirror_line(beam, rays, slopes, n_theta, n_dphi, mirrored)
        for ray in range(rays):
            place = read_place(meetings, ray)
            at = ray * N_MIRRORED
            if together and rises_free(
                terrain, place.i, place.j, place.z,
                mirrored[at + M_X], mirrored[at + M_Y], mirrored[at + M_Z],
            ):  # fmt: skip
                label = labels[place.i, place.j] if labels.size > 0 else 0
                end_after_one(
                    mirrored, at, label, beam.cos_phi, beam.sin_phi, record, spectra,
                    optics, tally,
                )  # fmt: skip
                continue
            draw = Draw(source.stream, first + ray, 0)
            trace_ray(terrain, None, None, HIT, place, beam, draw, sink)


@jit(allocates=False)
def trace_mesh_batch(mesh, source, room, record, waiting, spectra, optics, tally):
    """`trace_batch` over a mesh: places are micrometres, entry points at its highest one.

    Rays start a little before, so that none starts on a facet. `room` is a `MeshLine`.
    """
    sink = Sink(record, waiting, spectra, optics, tally)
    margin = mesh.frame.z_top - mesh.frame.z_high
    dense = source.n_rays > DENSE * mesh.faces.shape[0]
    tally.counts[N_EXACT] -= mesh.searches[0]
    for line in range(source.n_lines):
        beam, first, rays, points = rays_of_line(line, source, 1.0, 1.0)
        k = way_of(beam)
        meet_first(mesh, points, source.launch, rays, k, margin / beam.cos_t, dense, room)
        foresee_second(mesh, rays, k, room)
        for ray in range(rays):
            fate, place = int(room.met[ray, FATE]), read_place(room.met, ray)
            draw = Draw(source.stream, first + ray, 0)
            trace_ray(None, None, mesh, fate, place, beam, draw, sink, room.told[ray])
    tally.counts[N_EXACT] += mesh.searches[0]
