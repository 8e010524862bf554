"""Rays from the source to the bins over an opaque height field, one path after another.

The path depends on the facets alone; `pbrdf.kernels.paths.shading` then multiplies the
matrices of each material or wavelength along its record. Over a diffuse base every hit
sends out a second ray, in a random direction; it waits until the mirror reflections are
done and shares the record up to its own hit.
"""

from pbrdf.kernels import jit
from pbrdf.kernels.bins.binning import bin_of_direction
from pbrdf.kernels.meshes.facets import facet_label, facet_normal
from pbrdf.kernels.meshes.seek import BELOW, WRONG, seek_facet
from pbrdf.kernels.optics.frames import turn_frame
from pbrdf.kernels.optics.fresnel import reflection_elements
from pbrdf.kernels.paths.first_bounce import (
    M_X,
    M_Y,
    M_Z,
    N_MIRRORED,
    end_after_one,
    mirror_line,
    slopes_of_line,
)
from pbrdf.kernels.paths.random import uniform_pair
from pbrdf.kernels.paths.ray_bounce import (
    GRAZING,
    exit_turn,
    mirror_at,
    new_axis,
    normal_of_slopes,
    scatter_at,
)
from pbrdf.kernels.paths.shading import (
    ABSORBED,
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
    tally_path,
)
from pbrdf.kernels.paths.spectra import gather_path
from pbrdf.kernels.terrain.embree import SELF, seek
from pbrdf.kernels.terrain.entry import entry_line, first_ray, line_beam, wrap_into
from pbrdf.kernels.terrain.heightfield import (
    ESCAPED,
    HIT,
    LOST,
    SIDE,
    facet_slopes,
    leave_facet,
    rises_free,
    walk,
)
from pbrdf.kernels.terrain.sweep import F_FACET, F_I, F_J, F_U, F_V, F_Z, sweep_line

MAX_STEPS = 10_000_000
# Columns of a waiting ray: cell, facet, place, direction, s axis, leave rate, cosine of
# exit
W_I, W_J, W_FACET, W_U, W_V, W_Z, W_KX, W_KY, W_KZ = 0, 1, 2, 3, 4, 5, 6, 7, 8
W_SX, W_SY, W_SZ, W_RATE, W_COS, W_BOUNCE, W_WEIGHT, N_WAITING = (
    9,
    10,
    11,
    12,
    13,
    14,
    15,
    16,
)
# A ray that chance has put an end to
DROPPED = 8
# On a mesh light may be held by a hollow, where two rays after each hit would be ever more:
# from this bounce on one of the two is followed, and stands for both. The mirror's chance
# is its reflectance, within these bounds
FIRST_CHOICE = 1
LEAST_CHANCE, MOST_CHANCE = 0.02, 0.9


@jit(forceinline=True)
def next_on_terrain(terrain, tree, i, j, facet, u, v, z, k_x, k_y, k_z, leave_rate):
    """Follow a ray from a facet to the next: by the walk, or with a tree by Embree."""
    if tree is None:
        return leave_facet(
            terrain, i, j, facet, u, v, z, k_x, k_y, k_z, leave_rate, MAX_STEPS
        )
    return seek(terrain, tree, i, j, facet, u, v, z, k_x, k_y, k_z)


# Of a terrain and a mesh one is None, which the compiler sees: it drops what is asked of it
@jit(forceinline=True)
def next_facet(terrain, tree, mesh, i, j, facet, u, v, z, k_x, k_y, k_z, leave_rate):
    """Follow a ray from a facet to the next; on a mesh (u, v, z) is its place [um]."""
    fate = LOST
    if mesh is not None:
        # The number of a cell, of which a mesh has none, tells whether a place is delicate
        fate, facet, i, u, v, z = seek_facet(mesh, facet, i, u, v, z, k_x, k_y, k_z)
    if terrain is not None:
        fate, i, j, facet, u, v, z = next_on_terrain(
            terrain, tree, i, j, facet, u, v, z, k_x, k_y, k_z, leave_rate
        )
    return fate, i, j, facet, u, v, z


@jit(forceinline=True)
def normal_of_facet(terrain, mesh, i, j, facet):
    """Give the normal of a facet, and how much faster a ray rises than departs from it."""
    n_x, n_y, n_z, steep = 0.0, 0.0, 1.0, 1.0
    if mesh is not None:
        n_x, n_y, n_z = facet_normal(mesh, facet)
    if terrain is not None:
        slope_x, slope_y = facet_slopes(terrain, i, j, facet)
        n_x, n_y, n_z, steep = normal_of_slopes(slope_x, slope_y)
    return n_x, n_y, n_z, steep


@jit(forceinline=True)
def label_of_facet(terrain, mesh, i, j, facet):
    """Give the number of the material of a facet."""
    label = 0
    if mesh is not None:
        label = facet_label(mesh, facet)
    if terrain is not None:
        labels = terrain.labels
        label = labels[i, j] if labels.size > 0 else 0
    return label


@jit(forceinline=True)
def chance_of_mirror(cos_beta, label, optics):
    """Chance with which a ray over a diffuse base goes on from the mirror above it."""
    n, kappa = optics.n, optics.kappa
    a, _, _, _ = reflection_elements(max(cos_beta, GRAZING), n[0, label], kappa[0, label])
    return min(max(a, LEAST_CHANCE), MOST_CHANCE)


@jit(forceinline=True)
def first_facet(terrain, tree, i, j, u, v, k_x, k_y, k_z):
    """Follow a ray from the top plane to the first facet it meets."""
    if tree is None:
        return walk(
            terrain, i, j, -1, u, v, terrain.z_top, k_x / terrain.pitch_x,
            k_y / terrain.pitch_y, k_z, 0.0, MAX_STEPS,
        )  # fmt: skip
    return seek(terrain, tree, i, j, -1, u, v, terrain.z_top, k_x, k_y, k_z)


@jit(forceinline=True)
def trace_ray(
    terrain, tree, mesh, fate, i, j, facet, u, v, z, beam, stream, number,
    record, waiting, spectra, optics, tally,
):  # fmt: skip
    """Follow a ray from its first meeting with the surface until all its light has left.

    `fate` says what became of it so far: HIT on the facet given, or what `walk` returned;
    `beam` is the light of its line as `line_beam` tells; `tree` as in `trace_batch`. Of
    terrain and mesh one is None; on a mesh (u, v, z) is the place of a facet [um].
    """
    cos_phi, sin_phi, sin_t, cos_t, cos_b, sin_b, s_x, s_y, s_z = beam
    max_bounces = record.shape[0] - 1
    splits = optics.base.shape[1] > 0
    gathers = spectra.sums.size > 0
    # The turns out of the source's frame and into the detector's do not touch M00
    polarised = optics.n_stokes > 1
    if not gathers:
        for w in range(tally.energy.shape[0]):
            tally.energy[w, ABSORBED] += 1.0
    tally.counts[N_SEGMENTS] += 1
    # The beam travels away from the source
    k_x = -sin_t * cos_b
    k_y = -sin_t * sin_b
    k_z = -cos_t
    bounces = 0
    n_waiting = 0
    events = 0
    weight = 1.0
    while True:
        while fate == HIT and bounces < max_bounces:
            n_x, n_y, n_z, steep = normal_of_facet(terrain, mesh, i, j, facet)
            chance = 1.0
            if splits and mesh is not None and bounces >= FIRST_CHOICE:
                chance = chance_of_mirror(
                    -(k_x * n_x + k_y * n_y + k_z * n_z),
                    label_of_facet(terrain, mesh, i, j, facet), optics,
                )  # fmt: skip
            mirrors = True
            if chance < 1.0:
                draw_a, _ = uniform_pair(stream, number, events)
                events += 1
                mirrors = draw_a < chance
                weight /= chance if mirrors else 1.0 - chance
            if splits and (chance == 1.0 or not mirrors):
                # A second ray leaves the base under the interface
                draw_a, draw_b = uniform_pair(stream, number, events)
                events += 1
                waiting[n_waiting, W_I] = i
                waiting[n_waiting, W_J] = j
                waiting[n_waiting, W_FACET] = facet
                waiting[n_waiting, W_U] = u
                waiting[n_waiting, W_V] = v
                waiting[n_waiting, W_Z] = z
                waiting[n_waiting, W_BOUNCE] = bounces
                (
                    waiting[n_waiting, W_KX], waiting[n_waiting, W_KY],
                    waiting[n_waiting, W_KZ], waiting[n_waiting, W_SX],
                    waiting[n_waiting, W_SY], waiting[n_waiting, W_SZ], cosine,
                ) = scatter_at(n_x, n_y, n_z, draw_a, draw_b)  # fmt: skip
                waiting[n_waiting, W_COS] = cosine
                waiting[n_waiting, W_RATE] = cosine * steep
                waiting[n_waiting, W_WEIGHT] = weight
                n_waiting += 1
            r_x, r_y, r_z, w_x, w_y, w_z, cos_beta = mirror_at(k_x, k_y, k_z, n_x, n_y, n_z)
            c2, s2 = 1.0, 0.0
            if polarised or bounces > 0:
                c2, s2 = turn_frame(k_x, k_y, k_z, s_x, s_y, s_z, w_x, w_y, w_z)
            s_x, s_y, s_z = new_axis(s_x, s_y, s_z, w_x, w_y, w_z)
            k_x, k_y, k_z = r_x, r_y, r_z
            record[bounces, 0, COS_IN] = cos_beta
            record[bounces, 0, TURN_C] = c2
            record[bounces, 0, TURN_S] = s2
            record[bounces, 0, COS_OUT] = SPECULAR
            record[bounces, 0, LABEL] = label_of_facet(terrain, mesh, i, j, facet)
            if not mirrors:
                fate = DROPPED
                break
            bounces += 1
            tally.counts[N_SEGMENTS] += 1
            fate, i, j, facet, u, v, z = next_facet(
                terrain, tree, mesh, i, j, facet, u, v, z, k_x, k_y, k_z, cos_beta * steep
            )

        if fate != DROPPED:
            c2, s2 = 1.0, 0.0
            if polarised:
                c2, s2 = exit_turn(k_x, k_y, k_z, s_x, s_y, s_z, cos_phi, sin_phi)
            record[bounces, 0, TURN_C] = c2
            record[bounces, 0, TURN_S] = s2
            record[bounces, 0, WEIGHT] = weight
            end = N_LEAKED
            if fate == HIT:
                end = N_TRUNCATED
            elif fate == SIDE:
                end = N_SIDE
            elif fate == ESCAPED and bounces > 0:
                end = N_ESCAPED
            elif fate == BELOW:
                end = N_BELOW
            elif fate == SELF:
                tally.counts[N_SELF] += 1
            elif fate == WRONG:
                tally.counts[N_MISMATCH] += 1
            i_theta = i_dphi = 0
            if end == N_ESCAPED:
                i_theta, i_dphi = bin_of_direction(
                    k_x, k_y, k_z, cos_phi, sin_phi, tally.zenith, tally.azimuth
                )
            if gathers:
                gather_path(
                    end, record, 0, bounces, i_theta, i_dphi, spectra, optics, tally
                )
            else:
                tally_path(end, record, 0, bounces, i_theta, i_dphi, optics, tally)
        if n_waiting == 0:
            break

        # The last ray that waits: its record up to its hit is still in place
        n_waiting -= 1
        k_x = waiting[n_waiting, W_KX]
        k_y = waiting[n_waiting, W_KY]
        k_z = waiting[n_waiting, W_KZ]
        s_x = waiting[n_waiting, W_SX]
        s_y = waiting[n_waiting, W_SY]
        s_z = waiting[n_waiting, W_SZ]
        weight = waiting[n_waiting, W_WEIGHT]
        bounces = int(waiting[n_waiting, W_BOUNCE])
        record[bounces, 0, COS_OUT] = waiting[n_waiting, W_COS]
        bounces += 1
        tally.counts[N_SEGMENTS] += 1
        fate, i, j, facet, u, v, z = next_facet(
            terrain, tree, mesh, int(waiting[n_waiting, W_I]),
            int(waiting[n_waiting, W_J]), int(waiting[n_waiting, W_FACET]),
            waiting[n_waiting, W_U], waiting[n_waiting, W_V], waiting[n_waiting, W_Z],
            k_x, k_y, k_z, waiting[n_waiting, W_RATE],
        )  # fmt: skip


@jit(allocates=False)
def trace_batch(terrain, tree, source, record, waiting, spectra, optics, tally):
    """Trace rays of one incident direction and add their Mueller matrices to the tally.

    Every ray is followed from its entry point in the top plane; see `sweep_batch`. It
    walks, or with a `pbrdf.kernels.terrain.embree.Tree` asks Embree for each facet.
    `record` (bounces + 1, 1, N_RECORD) and `waiting` (bounces, N_WAITING) are room to work
    in. With `Spectra` of some size the light is gathered there, to be shaded afterwards.
    """
    launch = source.launch
    for line in range(source.n_lines):
        start_x, start_y, speed_x, speed_y, length, _, offset, _, _ = entry_line(
            line, source, terrain.pitch_x, terrain.pitch_y
        )
        beam = line_beam(line, source)
        _, _, sin_t, cos_t, cos_b, sin_b, _, _, _ = beam
        first = first_ray(line, source)
        rays = first_ray(line + 1, source) - first
        for ray in range(rays):
            s = length * ((ray + offset) / rays)
            x = wrap_into(start_x + speed_x * s, launch[0], launch[2])
            y = wrap_into(start_y + speed_y * s, launch[1], launch[3])
            i = min(int(x), terrain.heights.shape[0] - 1)
            j = min(int(y), terrain.heights.shape[1] - 1)
            fate, i, j, facet, u, v, z = first_facet(
                terrain, tree, i, j, x - i, y - j, -sin_t * cos_b, -sin_t * sin_b, -cos_t
            )
            trace_ray(
                terrain, tree, None, fate, i, j, facet, u, v, z, beam, source.stream,
                first + ray, record, waiting, spectra, optics, tally,
            )  # fmt: skip


@jit(allocates=False)
def sweep_batch(terrain, source, line_room, record, waiting, spectra, optics, tally):
    """`trace_batch` over a periodic field, without a search for the first facets.

    Over an opaque base the first bounces of a line are done together, and a ray that then
    is known to escape needs no more; `line_room` is a `LineRoom`.
    """
    meetings, slopes, mirrored = line_room
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
            i, j, z = int(meetings[ray, F_I]), int(meetings[ray, F_J]), meetings[ray, F_Z]
            at = ray * N_MIRRORED
            if together and rises_free(
                terrain, i, j, z,
                mirrored[at + M_X], mirrored[at + M_Y], mirrored[at + M_Z],
            ):  # fmt: skip
                label = labels[i, j] if labels.size > 0 else 0
                end_after_one(
                    mirrored, at, label, beam[0], beam[1], record, spectra, optics, tally
                )
                continue
            trace_ray(
                terrain, None, None, HIT, i, j, int(meetings[ray, F_FACET]),
                meetings[ray, F_U], meetings[ray, F_V], z, beam, source.stream, first + ray,
                record, waiting, spectra, optics, tally,
            )  # fmt: skip


@jit(allocates=False)
def trace_mesh_batch(mesh, source, record, waiting, spectra, optics, tally):
    """`trace_batch` over a mesh: places are micrometres, entry points at its highest one.

    Rays start a little before, so that none starts on a facet.
    """
    launch, z_top = source.launch, mesh.frame.z_top
    margin = z_top - mesh.frame.z_high
    tally.counts[N_EXACT] -= mesh.searches[0]
    for line in range(source.n_lines):
        start_x, start_y, speed_x, speed_y, length, _, offset, _, _ = entry_line(
            line, source, 1.0, 1.0
        )
        beam = line_beam(line, source)
        _, _, sin_t, cos_t, cos_b, sin_b, _, _, _ = beam
        before = margin / cos_t
        first = first_ray(line, source)
        rays = first_ray(line + 1, source) - first
        for ray in range(rays):
            s = length * ((ray + offset) / rays)
            x = wrap_into(start_x + speed_x * s, launch[0], launch[2])
            y = wrap_into(start_y + speed_y * s, launch[1], launch[3])
            fate, facet, delicate, x, y, z = seek_facet(
                mesh, -1, 0, x + before * sin_t * cos_b, y + before * sin_t * sin_b, z_top,
                -sin_t * cos_b, -sin_t * sin_b, -cos_t,
            )  # fmt: skip
            trace_ray(
                None, None, mesh, fate, delicate, 0, facet, x, y, z, beam, source.stream,
                first + ray, record, waiting, spectra, optics, tally,
            )  # fmt: skip
    tally.counts[N_EXACT] += mesh.searches[0]
