"""Bundles of rays from a detector over the facets to cones of sources, or the other way.

A bundle is a ray drawn from the detector's cone. Flat facets mirror the whole cone rigidly,
so the rays of its corners need no tracing of their own: where the axis of the cone would
go is carried along, and what the mirrored cone shares with the source is the weight of the
bundle when it leaves the surface. This takes every direction of the cone to meet the facets
that its ray meets.

Where a diffuse base scatters, the source is asked for directly, and rays into the
hemisphere look for other facets. Each number is that of light sent out by the detector;
reciprocity turns it round.
"""

import math
from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.cones.lens import cap_direction, carried_axis, leave, lens_flux
from pbrdf.kernels.cones.record import (
    A_X,
    A_Y,
    A_Z,
    catch_glint,
    catch_path,
    lose_path,
)
from pbrdf.kernels.cones.targets import (
    T_CHANCE,
    T_COS_HALF,
    T_COS_NEAR,
    T_SIN_HALF,
    light_from_base,
    place_axes,
)
from pbrdf.kernels.meshes.seek import BELOW, seek_facet
from pbrdf.kernels.paths.random import uniform_pair
from pbrdf.kernels.paths.ray_bounce import bounce_at, scatter_at
from pbrdf.kernels.paths.shading import (
    COS_IN,
    COS_OUT,
    LABEL,
    N_BELOW,
    N_ESCAPED,
    N_LEAKED,
    N_SEGMENTS,
    N_SIDE,
    N_TRUNCATED,
    SIDEWAYS,
    SPECULAR,
    TURN_C,
    TURN_S,
)
from pbrdf.kernels.paths.transport import MAX_STEPS, label_of_facet, normal_of_facet
from pbrdf.kernels.terrain.entry import STRIDE_PHI, TWO_PI, fraction, wrap_into
from pbrdf.kernels.terrain.heightfield import ESCAPED, HIT, LOST, SIDE, walk

# Bundles of one cone: zenith and azimuth of its axis (uniform: any azimuth), half-angle,
# the entry rectangle (corner x, y and lengths [cells]), lines and rays, five random shifts
# in [0, 1) (lines, rays, azimuths, directions twice), the stream of random numbers
Bundle = namedtuple(
    "Bundle",
    "sin_theta cos_theta phi uniform_phi cos_half sin_half "
    "launch n_lines n_rays shifts stream",
)
# How to look: COUNT every ray that meets the cone of the source; or SHARE what the mirrored
# cone shares with it, from paths of `first` bounces on; or FAR_END, the paths from the
# source that a base sends to the detector and that were mirrored before. Whether SHARE
# counts paths of mirrors too; then samples of the hemisphere, their decay with each bounce,
# and the cone of one sample
Rule = namedtuple("Rule", "kind first counts samples decay cos_spread sin_spread")
COUNT, SHARE, FAR_END = 0, 1, 2
# Columns of a hit whose hemisphere is being sampled: cell, facet, place, bounces before it,
# mirrors before the first base of the path, rays still to send, weight of each
H_I, H_J, H_FACET, H_U, H_V, H_Z, H_BOUNCE, H_MIRRORS, H_LEFT, H_WEIGHT, N_HIT = (
    0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10,
)  # fmt: skip
# The plastic number's powers: points that fill a square evenly for any count (Roberts 2018)
STRIDE_A = 0.7548776662466927
STRIDE_B = 0.5698402909980532


@jit(inline="always")
def mirrored(v_x, v_y, v_z, n_x, n_y, n_z):
    """Mirror image of a vector in a facet of this normal."""
    twice = 2.0 * (v_x * n_x + v_y * n_y + v_z * n_z)
    return v_x - twice * n_x, v_y - twice * n_y, v_z - twice * n_z


@jit(forceinline=True)
def begin(terrain, mesh, x, y, k_x, k_y, k_z):
    """Follow a ray from an entry point (x, y) to the first facet it meets."""
    fate, i, j, facet, u, v, z = LOST, 0, 0, -1, x, y, 0.0
    if mesh is not None:
        before = (mesh.frame.z_top - mesh.frame.z_high) / -k_z
        fate, facet, i, u, v, z = seek_facet(
            mesh, -1, 0, x - before * k_x, y - before * k_y, mesh.frame.z_top, k_x, k_y, k_z
        )
    if terrain is not None:
        i = min(int(x), terrain.heights.shape[0] - 1)
        j = min(int(y), terrain.heights.shape[1] - 1)
        fate, i, j, facet, u, v, z = walk(
            terrain, i, j, -1, x - i, y - j, terrain.z_top,
            k_x / terrain.pitch_x, k_y / terrain.pitch_y, k_z, 0.0, MAX_STEPS,
        )  # fmt: skip
    return fate, i, j, facet, u, v, z


@jit(allocates=False)
def follow_bundle(
    terrain, mesh, x, y, cos_phi, sin_phi, bundle, name, targets, axes, record, hits,
    optics, rule, catch,
):  # fmt: skip
    """Follow one ray of a bundle, with all the rays it sends out, to their ends."""
    max_bounces = record.shape[0] - 1
    splits = optics.base.shape[1] > 0
    a_x = bundle.sin_theta * cos_phi
    a_y = bundle.sin_theta * sin_phi
    a_z = bundle.cos_theta
    # The ray of the bundle, spread evenly over its cone, weighs as its cosine
    number = name + 1
    d_x, d_y, d_z = cap_direction(
        a_x, a_y, a_z, sin_phi, -cos_phi, bundle.cos_half,
        fraction(number * STRIDE_A + bundle.shifts[3]),
        fraction(number * STRIDE_B + bundle.shifts[4]),
    )  # fmt: skip
    cone_flux = math.pi * bundle.sin_half * bundle.sin_half * a_z
    start = 2.0 * math.pi * (1.0 - bundle.cos_half) * d_z / cone_flux
    k_x, k_y, k_z = -d_x, -d_y, -d_z
    s_x, s_y, s_z = carried_axis(a_x, a_y, a_z, sin_phi, -cos_phi, d_x, d_y, d_z)
    # Images of the axis of the cone and of the vertical, along the beam
    e_x, e_y, e_z = -a_x, -a_y, -a_z
    g_x, g_y, g_z = 0.0, 0.0, -1.0

    catch.counts[N_SEGMENTS] += 1
    fate, i, j, facet, u, v, z = begin(terrain, mesh, x, y, k_x, k_y, k_z)
    if fate == SIDE:
        catch.counts[N_SIDE] += 1
        if splits:
            for w in range(catch.energy.shape[0]):
                catch.energy[w, SIDEWAYS] += start
        return
    bounces = 0
    mirrors = 0  # before the first base of the path, or up to now if there was none
    since = 0  # mirrors since the last base
    diffused = False
    weight = start
    n_hits = 0
    event = 0
    while True:
        while fate == HIT and bounces < max_bounces:
            n_x, n_y, n_z, steep = normal_of_facet(terrain, mesh, i, j, facet)
            # Only the base scatters at a hit that a base has its own record of
            r_x, r_y, r_z, p_x, p_y, p_z, cos_beta, c2, s2 = bounce_at(
                k_x, k_y, k_z, s_x, s_y, s_z, n_x, n_y, n_z
            )
            record[bounces, 0, COS_IN] = cos_beta
            record[bounces, 0, TURN_C] = c2
            record[bounces, 0, TURN_S] = s2
            record[bounces, 0, LABEL] = label_of_facet(terrain, mesh, i, j, facet)
            if splits:
                asked = rule.kind == SHARE or (rule.kind == FAR_END and mirrors > 0)
                if asked:
                    event = light_from_base(
                        terrain, mesh, i, j, facet, u, v, z, weight, targets, axes,
                        bundle.stream, name, event, record, bounces,
                        optics, catch,
                    )  # fmt: skip
                if asked or rule.kind == COUNT:
                    # Rays into the hemisphere: the mean number, rounded at random
                    mean = rule.samples * rule.decay**bounces
                    chance, _ = uniform_pair(bundle.stream, name, event)
                    event += 1
                    hits[n_hits, H_I] = i
                    hits[n_hits, H_J] = j
                    hits[n_hits, H_FACET] = facet
                    hits[n_hits, H_U] = u
                    hits[n_hits, H_V] = v
                    hits[n_hits, H_Z] = z
                    hits[n_hits, H_BOUNCE] = bounces
                    hits[n_hits, H_MIRRORS] = mirrors
                    hits[n_hits, H_LEFT] = math.floor(mean + chance)
                    hits[n_hits, H_WEIGHT] = weight / mean
                    n_hits += 1
            record[bounces, 0, COS_OUT] = SPECULAR
            k_x, k_y, k_z, s_x, s_y, s_z = r_x, r_y, r_z, p_x, p_y, p_z
            bounces += 1
            since += 1
            if not diffused:
                mirrors += 1
                e_x, e_y, e_z = mirrored(e_x, e_y, e_z, n_x, n_y, n_z)
                g_x, g_y, g_z = mirrored(g_x, g_y, g_z, n_x, n_y, n_z)
            catch.counts[N_SEGMENTS] += 1
            fate, i, j, facet, u, v, z = leave(
                terrain, mesh, i, j, facet, u, v, z, k_x, k_y, k_z, cos_beta * steep
            )

        if fate == ESCAPED and bounces > 0:
            catch.counts[N_ESCAPED] += 1
            # What a base sends straight to a target was asked for already
            straight = diffused and since == 0
            looks = rule.kind == COUNT or (
                rule.kind == SHARE
                and not straight
                and (bounces >= rule.first if not diffused else mirrors > 0)
            )
            for target in range(targets.shape[0] if looks else 0):
                along = (
                    k_x * axes[target, A_X] + k_y * axes[target, A_Y]
                    + k_z * axes[target, A_Z]
                )  # fmt: skip
                if rule.kind != COUNT and diffused:
                    spread = math.pi * rule.sin_spread * rule.sin_spread
                    share = lens_flux(
                        along, 1.0, along, rule.cos_spread, rule.sin_spread,
                        targets[target, T_COS_HALF], targets[target, T_SIN_HALF],
                    ) / spread  # fmt: skip
                    if share > 0.0:
                        catch_path(
                            weight * share, target, axes, record, bounces,
                            k_x, k_y, k_z, s_x, s_y, s_z, optics, catch,
                        )  # fmt: skip
                    continue
                share = 1.0 if along >= targets[target, T_COS_HALF] else 0.0
                if not rule.counts:
                    along = (
                        e_x * axes[target, A_X] + e_y * axes[target, A_Y]
                        + e_z * axes[target, A_Z]
                    )  # fmt: skip
                    upright = (
                        g_x * axes[target, A_X] + g_y * axes[target, A_Y]
                        + g_z * axes[target, A_Z]
                    )  # fmt: skip
                    share = lens_flux(
                        along, a_z, upright, bundle.cos_half, bundle.sin_half,
                        targets[target, T_COS_HALF], targets[target, T_SIN_HALF],
                    ) / cone_flux  # fmt: skip
                if share > 0.0 or along > targets[target, T_COS_NEAR]:
                    catch_glint(
                        weight, max(share, 0.0), targets[target, T_CHANCE], target, axes,
                        record, bounces, k_x, k_y, k_z, s_x, s_y, s_z, optics, catch,
                    )  # fmt: skip
        elif fate == SIDE and not splits:
            # Such a ray belongs to neither part of the fraction
            catch.counts[N_SIDE] += 1
        else:
            end = N_LEAKED
            if fate == HIT:
                end = N_TRUNCATED
            elif fate == SIDE:
                end = N_SIDE
            elif fate == BELOW:
                end = N_BELOW
            lose_path(weight, end, record, bounces, optics, catch)

        # The next ray into the hemisphere above the last hit: its record is still in place
        while n_hits > 0 and hits[n_hits - 1, H_LEFT] < 1.0:
            n_hits -= 1
        if n_hits == 0:
            break
        last = n_hits - 1
        hits[last, H_LEFT] -= 1.0
        i = int(hits[last, H_I])
        j = int(hits[last, H_J])
        facet = int(hits[last, H_FACET])
        u = hits[last, H_U]
        v = hits[last, H_V]
        z = hits[last, H_Z]
        bounces = int(hits[last, H_BOUNCE])
        mirrors = int(hits[last, H_MIRRORS])
        weight = hits[last, H_WEIGHT]
        diffused = True
        since = 0
        n_x, n_y, n_z, steep = normal_of_facet(terrain, mesh, i, j, facet)
        draw_a, draw_b = uniform_pair(bundle.stream, name, event)
        event += 1
        k_x, k_y, k_z, s_x, s_y, s_z, cosine = scatter_at(n_x, n_y, n_z, draw_a, draw_b)
        record[bounces, 0, COS_OUT] = cosine
        bounces += 1
        catch.counts[N_SEGMENTS] += 1
        fate, i, j, facet, u, v, z = leave(
            terrain, mesh, i, j, facet, u, v, z, k_x, k_y, k_z, cosine * steep
        )


@jit(allocates=False)
def trace_bundles(terrain, mesh, bundle, targets, axes, record, hits, optics, rule, catch):
    """Send all bundles of a cone over a terrain or a mesh, the other None, line by line.

    axes        (targets, N_AXES), record (bounces + 1, 1, N_RECORD) and hits (bounces,
                N_HIT) are room to work in
    """
    launch = bundle.launch
    for line in range(bundle.n_lines):
        phi = bundle.phi
        if bundle.uniform_phi:
            phi = TWO_PI * fraction(line * STRIDE_PHI + bundle.shifts[2])
        cos_phi = math.cos(phi)
        sin_phi = math.sin(phi)
        place_axes(bundle, targets, cos_phi, sin_phi, axes)
        first = line * bundle.n_rays // bundle.n_lines
        rays = (line + 1) * bundle.n_rays // bundle.n_lines - first
        y = wrap_into(
            launch[1] + launch[3] * (line + bundle.shifts[0]) / bundle.n_lines,
            launch[1], launch[3],
        )  # fmt: skip
        offset = fraction(line * STRIDE_B + bundle.shifts[1])
        for ray in range(rays):
            x = wrap_into(
                launch[0] + launch[2] * (ray + offset) / rays, launch[0], launch[2]
            )
            follow_bundle(
                terrain, mesh, x, y, cos_phi, sin_phi, bundle, first + ray, targets,
                axes, record, hits, optics, rule, catch,
            )  # fmt: skip
