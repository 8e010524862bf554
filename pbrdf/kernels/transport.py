"""Rays from the source to the bins over an opaque height field, one path after another.

The path depends on the facets alone; `pbrdf.kernels.shading` then multiplies the matrices
of each material or wavelength along its record. Over a diffuse base every hit sends out a
second ray, in a random direction; it waits until the mirror reflections are done and shares
the record up to its own hit.
"""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.embree import SELF, seek
from pbrdf.kernels.entry import TWO_PI, entry_line, first_ray, line_beam, wrap_into
from pbrdf.kernels.frames import PARALLEL, turn_frame
from pbrdf.kernels.heightfield import (
    ESCAPED,
    HIT,
    SIDE,
    facet_slopes,
    leave_facet,
    walk,
)
from pbrdf.kernels.random import uniform_pair
from pbrdf.kernels.shading import (
    ABSORBED,
    COS_IN,
    COS_OUT,
    LABEL,
    N_ESCAPED,
    N_LEAKED,
    N_SEGMENTS,
    N_SELF,
    N_SIDE,
    N_TRUNCATED,
    SPECULAR,
    TURN_C,
    TURN_S,
    tally_path,
)
from pbrdf.kernels.spectra import gather_path
from pbrdf.kernels.sweep import F_FACET, F_I, F_J, F_U, F_V, F_Z, sweep_line

MAX_STEPS = 10_000_000
# Smallest cosine of a hit: rounding may leave a grazing ray parallel to the facet it meets
GRAZING = 1e-15
# Columns of a waiting ray: cell, facet, place, direction, s axis, leave rate, cosine of
# exit
W_I, W_J, W_FACET, W_U, W_V, W_Z, W_KX, W_KY, W_KZ = 0, 1, 2, 3, 4, 5, 6, 7, 8
W_SX, W_SY, W_SZ, W_RATE, W_COS, W_BOUNCE, N_WAITING = 9, 10, 11, 12, 13, 14, 15


@jit(forceinline=True)
def reflect(k_x, k_y, k_z, slope_x, slope_y):
    """Mirror direction at a facet, the facet's normal and the cosine of incidence.

    The normal comes with 1 / n_z, its length before it was made a unit vector.
    """
    length = math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    n_z = 1.0 / length
    n_x = -slope_x * n_z
    n_y = -slope_y * n_z
    cos_beta = max(-(k_x * n_x + k_y * n_y + k_z * n_z), GRAZING)
    r_x = k_x + 2.0 * cos_beta * n_x
    r_y = k_y + 2.0 * cos_beta * n_y
    r_z = k_z + 2.0 * cos_beta * n_z
    # Keep the direction a unit vector over any number of bounces: one step of Newton's
    # rule for 1 / sqrt(r . r), which is 1 but for rounding
    scale = 1.5 - 0.5 * (r_x * r_x + r_y * r_y + r_z * r_z)
    return r_x * scale, r_y * scale, r_z * scale, n_x, n_y, n_z, length, cos_beta


@jit(forceinline=True)
def mirror(k_x, k_y, k_z, slope_x, slope_y):
    """Reflect a beam at a facet.

    Returns the new direction, the s axis k x n of the facet, the same before and after (not
    of unit length: only its direction counts), the speed at which the ray leaves the facet
    upwards and the cosine of incidence.
    """
    r_x, r_y, r_z, n_x, n_y, n_z, length, cos_beta = reflect(
        k_x, k_y, k_z, slope_x, slope_y
    )
    w_x = k_y * n_z - k_z * n_y
    w_y = k_z * n_x - k_x * n_z
    w_z = k_x * n_y - k_y * n_x
    # It leaves the plane as fast as it came, cos(beta) along the normal
    return r_x, r_y, r_z, w_x, w_y, w_z, cos_beta * length, cos_beta


@jit(forceinline=True)
def new_axis(s_x, s_y, s_z, w_x, w_y, w_z):
    """Axis w of a facet, or the old s axis where the beam met the facet head-on."""
    if w_x * w_x + w_y * w_y + w_z * w_z > PARALLEL:
        return w_x, w_y, w_z
    return s_x, s_y, s_z


@jit(forceinline=True)
def bounce(k_x, k_y, k_z, s_x, s_y, s_z, slope_x, slope_y):
    """Reflect a beam and its frame at a facet.

    Returns the new direction, the new s axis, the speed at which the ray leaves the facet
    upwards, the cosine of incidence and the turn of the frame into the plane of incidence.
    """
    r_x, r_y, r_z, w_x, w_y, w_z, leave_rate, cos_beta = mirror(
        k_x, k_y, k_z, slope_x, slope_y
    )
    c2, s2 = turn_frame(k_x, k_y, k_z, s_x, s_y, s_z, w_x, w_y, w_z)
    s_x, s_y, s_z = new_axis(s_x, s_y, s_z, w_x, w_y, w_z)
    return r_x, r_y, r_z, s_x, s_y, s_z, leave_rate, cos_beta, c2, s2


@jit(forceinline=True)
def exit_turn(k_x, k_y, k_z, s_x, s_y, s_z, cos_phi_i, sin_phi_i):
    """Turn of the frame to the meridian plane of the exit direction, e_s = z x k."""
    m_x = -k_y
    m_y = k_x
    if k_x * k_x + k_y * k_y < PARALLEL:
        # Straight up: the azimuth of the source stands for that of the detector
        m_x = -sin_phi_i
        m_y = cos_phi_i
    return turn_frame(k_x, k_y, k_z, s_x, s_y, s_z, m_x, m_y, 0.0)


@jit
def scatter(slope_x, slope_y, draw_a, draw_b):
    """Direction spread as the cosine about a facet's normal, from two uniform numbers.

    Returns the direction, its s axis k x n, the speed at which the ray leaves the facet
    upwards and the cosine of exit.
    """
    length = math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    n_x = -slope_x / length
    n_y = -slope_y / length
    n_z = 1.0 / length
    # Axes across the normal (Duff et al. 2017); a facet never faces down
    share = -1.0 / (1.0 + n_z)
    mixed = n_x * n_y * share
    sine = math.sqrt(draw_a)
    cosine = max(math.sqrt(1.0 - draw_a), GRAZING)
    a = sine * math.cos(TWO_PI * draw_b)
    b = sine * math.sin(TWO_PI * draw_b)
    k_x = a * (1.0 + n_x * n_x * share) + b * mixed + cosine * n_x
    k_y = a * mixed + b * (1.0 + n_y * n_y * share) + cosine * n_y
    k_z = -a * n_x - b * n_y + cosine * n_z
    s_x = k_y * n_z - k_z * n_y
    s_y = k_z * n_x - k_x * n_z
    s_z = k_x * n_y - k_y * n_x
    square = s_x * s_x + s_y * s_y + s_z * s_z
    if square > PARALLEL:
        scale = 1.0 / math.sqrt(square)
        s_x *= scale
        s_y *= scale
        s_z *= scale
    else:
        # Along the normal every axis across it serves
        s_x, s_y, s_z = 1.0 + n_x * n_x * share, mixed, -n_x
    return k_x, k_y, k_z, s_x, s_y, s_z, cosine * length, cosine


@jit(forceinline=True)
def next_facet(terrain, tree, i, j, facet, u, v, z, k_x, k_y, k_z, leave_rate):
    """Follow a ray from a facet to the next: by the walk, or with a tree by Embree."""
    if tree is None:
        return leave_facet(
            terrain, i, j, facet, u, v, z, k_x, k_y, k_z, leave_rate, MAX_STEPS
        )
    return seek(terrain, tree, i, j, facet, u, v, z, k_x, k_y, k_z)


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
    terrain, tree, fate, i, j, facet, u, v, z, beam, stream, number,
    record, waiting, spectra, optics, tally,
):  # fmt: skip
    """Follow a ray from its first meeting with the surface until all its light has left.

    `fate` says what became of it so far: HIT on the facet given, or what `walk` returned;
    `beam` is the light of its line as `line_beam` tells; `tree` as in `trace_batch`.
    """
    cos_phi, sin_phi, sin_t, cos_t, cos_b, sin_b, s_x, s_y, s_z = beam
    labels = terrain.labels
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
    while True:
        while fate == HIT and bounces < max_bounces:
            slope_x, slope_y = facet_slopes(terrain, i, j, facet)
            if splits:
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
                    waiting[n_waiting, W_SY], waiting[n_waiting, W_SZ],
                    waiting[n_waiting, W_RATE], waiting[n_waiting, W_COS],
                ) = scatter(slope_x, slope_y, draw_a, draw_b)  # fmt: skip
                n_waiting += 1
            r_x, r_y, r_z, w_x, w_y, w_z, leave_rate, cos_beta = mirror(
                k_x, k_y, k_z, slope_x, slope_y
            )
            c2, s2 = 1.0, 0.0
            if polarised or bounces > 0:
                c2, s2 = turn_frame(k_x, k_y, k_z, s_x, s_y, s_z, w_x, w_y, w_z)
            s_x, s_y, s_z = new_axis(s_x, s_y, s_z, w_x, w_y, w_z)
            k_x, k_y, k_z = r_x, r_y, r_z
            record[bounces, 0, COS_IN] = cos_beta
            record[bounces, 0, TURN_C] = c2
            record[bounces, 0, TURN_S] = s2
            record[bounces, 0, COS_OUT] = SPECULAR
            record[bounces, 0, LABEL] = labels[i, j] if labels.size > 0 else 0
            bounces += 1
            tally.counts[N_SEGMENTS] += 1
            fate, i, j, facet, u, v, z = next_facet(
                terrain, tree, i, j, facet, u, v, z, k_x, k_y, k_z, leave_rate
            )

        c2, s2 = 1.0, 0.0
        if polarised:
            c2, s2 = exit_turn(k_x, k_y, k_z, s_x, s_y, s_z, cos_phi, sin_phi)
        record[bounces, 0, TURN_C] = c2
        record[bounces, 0, TURN_S] = s2
        end = N_LEAKED
        if fate == HIT:
            end = N_TRUNCATED
        elif fate == SIDE:
            end = N_SIDE
        elif fate == ESCAPED and bounces > 0:
            end = N_ESCAPED
        elif fate == SELF:
            tally.counts[N_SELF] += 1
        if gathers:
            gather_path(
                end, record, 0, bounces, k_x, k_y, k_z, cos_phi, sin_phi,
                spectra, optics, tally,
            )  # fmt: skip
        else:
            tally_path(
                end, record, 0, bounces, k_x, k_y, k_z, cos_phi, sin_phi, optics, tally
            )
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
        bounces = int(waiting[n_waiting, W_BOUNCE])
        record[bounces, 0, COS_OUT] = waiting[n_waiting, W_COS]
        bounces += 1
        tally.counts[N_SEGMENTS] += 1
        fate, i, j, facet, u, v, z = next_facet(
            terrain, tree, int(waiting[n_waiting, W_I]), int(waiting[n_waiting, W_J]),
            int(waiting[n_waiting, W_FACET]), waiting[n_waiting, W_U],
            waiting[n_waiting, W_V], waiting[n_waiting, W_Z],
            k_x, k_y, k_z, waiting[n_waiting, W_RATE],
        )  # fmt: skip


@jit(allocates=False)
def trace_batch(terrain, tree, source, record, waiting, spectra, optics, tally):
    """Trace rays of one incident direction and add their Mueller matrices to the tally.

    Every ray is followed from its entry point in the top plane; see `sweep_batch`. It
    walks, or with a `pbrdf.kernels.embree.Tree` asks Embree for each facet. `record`
    (bounces + 1, 1, N_RECORD) and `waiting` (bounces, N_WAITING) are room to work in. With
    `Spectra` of some size the light is gathered there, to be shaded afterwards.
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
                terrain, tree, fate, i, j, facet, u, v, z, beam, source.stream, first + ray,
                record, waiting, spectra, optics, tally,
            )  # fmt: skip


@jit(allocates=False)
def sweep_batch(terrain, source, meetings, record, waiting, spectra, optics, tally):
    """`trace_batch` over a periodic field, without a search for the first facets.

    `meetings` (rays of the longest line, N_FIRST) is room for `sweep_line` to write into.
    """
    for line in range(source.n_lines):
        beam = line_beam(line, source)
        first = first_ray(line, source)
        sweep_line(terrain, line, source, terrain.z_top, meetings)
        for ray in range(first_ray(line + 1, source) - first):
            trace_ray(
                terrain, None, HIT, int(meetings[ray, F_I]), int(meetings[ray, F_J]),
                int(meetings[ray, F_FACET]), meetings[ray, F_U], meetings[ray, F_V],
                meetings[ray, F_Z], beam, source.stream, first + ray,
                record, waiting, spectra, optics, tally,
            )  # fmt: skip
