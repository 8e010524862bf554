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
from pbrdf.kernels.cones.lens import cap_direction, leave, lens_flux
from pbrdf.kernels.cones.record import (
    T_COS_HALF,
    T_COS_NEAR,
    T_SIN_HALF,
    Scan,
    axis_of_target,
    catch_glint,
    catch_path,
    lose_path,
)
from pbrdf.kernels.cones.targets import light_from_base, place_axes
from pbrdf.kernels.optics.frames import carried_axis
from pbrdf.kernels.optics.light import mirror_image
from pbrdf.kernels.optics.vectors import Vec, dot, opposite
from pbrdf.kernels.paths.ground import (
    N_PLACE,
    first_facet,
    first_on_mesh,
    label_of_facet,
    normal_of_facet,
    read_place,
    write_place,
)
from pbrdf.kernels.paths.random import Draw, uniform_pair
from pbrdf.kernels.paths.ray_bounce import bounce_at, scatter_at
from pbrdf.kernels.paths.shading import (
    COS_OUT,
    N_ESCAPED,
    N_SEGMENTS,
    N_SIDE,
    SIDEWAYS,
    SPECULAR,
)
from pbrdf.kernels.paths.transport import end_of, write_mirror
from pbrdf.kernels.terrain.entry import STRIDE_PHI, fraction, wrap_into
from pbrdf.kernels.terrain.heightfield import ESCAPED, HIT, SIDE

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
# Columns of a hit whose hemisphere is being sampled, after its place: bounces before it,
# mirrors before the first base of the path, rays still to send, weight of each
H_BOUNCE, H_MIRRORS, H_LEFT, H_WEIGHT, N_HIT = range(N_PLACE, N_PLACE + 5)
# The plastic number's powers: points that fill a square evenly for any count (Roberts 2018)
STRIDE_A = 0.7548776662466927
STRIDE_B = 0.5698402909980532


# A ray of a bundle on its way: direction, s axis, weight, bounces; mirrors before the first
# base of the path, or up to now if there was none, and since the last base; whether a base
# has scattered it; images of the axis of the cone and of the vertical, along the beam
Flight = namedtuple("Flight", "k s weight bounces mirrors since diffused axis upright")


@jit(forceinline=True)
def begin(terrain, mesh, x, y, k):
    """Follow a ray from an entry point (x, y) to the first facet it meets."""
    if mesh is not None:
        before = (mesh.frame.z_top - mesh.frame.z_high) / -k.z
        fate, place = first_on_mesh(mesh, x, y, before, k)
    if terrain is not None:
        i = min(int(x), terrain.heights.shape[0] - 1)
        j = min(int(y), terrain.heights.shape[1] - 1)
        fate, place = first_facet(terrain, None, i, j, x - i, y - j, k)
    return fate, place


@jit(forceinline=True)
def axis_of_bundle(bundle, cos_phi, sin_phi):
    """Axis of the cone of a bundle, and the horizontal axis across it."""
    axis = Vec(bundle.sin_theta * cos_phi, bundle.sin_theta * sin_phi, bundle.cos_theta)
    return axis, Vec(sin_phi, -cos_phi, 0.0)


@jit(forceinline=True)
def flux_of_cone(bundle):
    """Flux of unit radiance through the cone of a bundle."""
    return math.pi * bundle.sin_half * bundle.sin_half * bundle.cos_theta


@jit(forceinline=True)
def launch_ray(bundle, name, axis, across):
    """Start a ray of a bundle: spread evenly over the cone, they weigh as their cosine."""
    number = name + 1
    d = cap_direction(
        axis, across, bundle.cos_half,
        fraction(number * STRIDE_A + bundle.shifts[3]),
        fraction(number * STRIDE_B + bundle.shifts[4]),
    )  # fmt: skip
    weight = 2.0 * math.pi * (1.0 - bundle.cos_half) * d.z / flux_of_cone(bundle)
    s = carried_axis(axis, across, d)
    return Flight(
        opposite(d), s, weight, 0, 0, 0, False, opposite(axis), Vec(0.0, 0.0, -1.0)
    )


@jit(forceinline=True)
def mirror_flight(flight, k, s, normal):
    """Go on after a mirror, which shows the axis of the cone as well until a base comes."""
    axis, upright, mirrors = flight.axis, flight.upright, flight.mirrors
    if not flight.diffused:
        mirrors += 1
        axis = mirror_image(axis, normal, -dot(axis, normal))
        upright = mirror_image(upright, normal, -dot(upright, normal))
    return Flight(
        k, s, flight.weight, flight.bounces + 1, mirrors, flight.since + 1,
        flight.diffused, axis, upright,
    )  # fmt: skip


@jit(forceinline=True)
def ask_base(terrain, mesh, place, flight, draw, n_hits, scan):
    """Ask the base under a facet for its light, and note that its hemisphere is to do.

    Returns the number of the next draw and of hits noted.
    """
    rule, hits = scan.rule, scan.hits
    event = draw.event
    asked = rule.kind == SHARE or (rule.kind == FAR_END and flight.mirrors > 0)
    if asked:
        event = light_from_base(
            terrain, mesh, place, flight.bounces, flight.weight, draw, scan
        )
    if asked or rule.kind == COUNT:
        # Rays into the hemisphere: the mean number, rounded at random
        mean = rule.samples * rule.decay**flight.bounces
        chance, _ = uniform_pair(draw.stream, draw.number, event)
        event += 1
        write_place(hits, n_hits, place)
        hits[n_hits, H_BOUNCE] = flight.bounces
        hits[n_hits, H_MIRRORS] = flight.mirrors
        hits[n_hits, H_LEFT] = math.floor(mean + chance)
        hits[n_hits, H_WEIGHT] = flight.weight / mean
        n_hits += 1
    return event, n_hits


@jit(forceinline=True)
def share_of_target(flight, bundle, target, along, scan):
    """Share of the mirrored cone that lies in a target, and the cosine between them."""
    targets = scan.targets
    share = 1.0 if along >= targets[target, T_COS_HALF] else 0.0
    if not scan.rule.counts:
        axis, _ = axis_of_target(scan, target)
        along = dot(flight.axis, axis)
        share = lens_flux(
            along, bundle.cos_theta, dot(flight.upright, axis),
            bundle.cos_half, bundle.sin_half,
            targets[target, T_COS_HALF], targets[target, T_SIN_HALF],
        ) / flux_of_cone(bundle)  # fmt: skip
    return share, along


@jit(forceinline=True)
def share_of_sample(target, along, scan):
    """Share of the cone of one sample of the hemisphere that lies in a target."""
    rule, targets = scan.rule, scan.targets
    spread = math.pi * rule.sin_spread * rule.sin_spread
    return (
        lens_flux(
            along, 1.0, along, rule.cos_spread, rule.sin_spread,
            targets[target, T_COS_HALF], targets[target, T_SIN_HALF],
        ) / spread
    )  # fmt: skip


@jit(forceinline=True)
def look_at_targets(flight, bundle, scan):
    """Value a path that has left the surface for each target."""
    rule = scan.rule
    # What a base sends straight to a target was asked for already
    straight = flight.diffused and flight.since == 0
    looks = rule.kind == COUNT or (
        rule.kind == SHARE
        and not straight
        and (flight.mirrors > 0 if flight.diffused else flight.bounces >= rule.first)
    )
    for target in range(scan.targets.shape[0] if looks else 0):
        axis, _ = axis_of_target(scan, target)
        along = dot(flight.k, axis)
        if rule.kind != COUNT and flight.diffused:
            share = share_of_sample(target, along, scan)
            if share > 0.0:
                catch_path(
                    flight.weight * share, target, flight.bounces, flight.k, flight.s, scan
                )
            continue
        share, along = share_of_target(flight, bundle, target, along, scan)
        if share > 0.0 or along > scan.targets[target, T_COS_NEAR]:
            catch_glint(
                flight.weight, max(share, 0.0), target, flight.bounces, flight.k, flight.s,
                scan,
            )  # fmt: skip


@jit(forceinline=True)
def end_flight(fate, flight, bundle, scan):
    """Book a path that goes no further."""
    counts = scan.catch.counts
    if fate == ESCAPED and flight.bounces > 0:
        counts[N_ESCAPED] += 1
        look_at_targets(flight, bundle, scan)
    elif fate == SIDE and scan.optics.base.shape[1] == 0:
        # Such a ray belongs to neither part of the fraction
        counts[N_SIDE] += 1
    else:
        lose_path(flight.weight, end_of(fate, flight.bounces), flight.bounces, scan)


@jit(forceinline=True)
def sample_hemisphere(terrain, mesh, row, draw, old, scan):
    """Send a ray into the hemisphere above a hit: its record is still in place.

    Returns its fate, its place and the ray.
    """
    hits = scan.hits
    hits[row, H_LEFT] -= 1.0
    bounces = int(hits[row, H_BOUNCE])
    place = read_place(hits, row)
    normal, steep = normal_of_facet(terrain, mesh, place)
    draw_a, draw_b = uniform_pair(draw.stream, draw.number, draw.event)
    k, s, cosine = scatter_at(normal, draw_a, draw_b)
    scan.record[bounces, 0, COS_OUT] = cosine
    flight = Flight(
        k, s, hits[row, H_WEIGHT], bounces + 1, int(hits[row, H_MIRRORS]), 0, True,
        old.axis, old.upright,
    )  # fmt: skip
    scan.catch.counts[N_SEGMENTS] += 1
    fate, place = leave(terrain, mesh, place, k, cosine * steep)
    return fate, place, flight


@jit(part=True, allocates=False)
def follow_bundle(terrain, mesh, x, y, cos_phi, sin_phi, bundle, name, scan):
    """Follow one ray of a bundle, with all the rays it sends out, to their ends."""
    record, hits, counts = scan.record, scan.hits, scan.catch.counts
    max_bounces = record.shape[0] - 1
    splits = scan.optics.base.shape[1] > 0
    axis, across = axis_of_bundle(bundle, cos_phi, sin_phi)
    flight = launch_ray(bundle, name, axis, across)
    counts[N_SEGMENTS] += 1
    fate, place = begin(terrain, mesh, x, y, flight.k)
    if fate == SIDE:
        counts[N_SIDE] += 1
        if splits:
            for w in range(scan.catch.energy.shape[0]):
                scan.catch.energy[w, SIDEWAYS] += flight.weight
        return
    n_hits = 0
    event = 0
    while True:
        while fate == HIT and flight.bounces < max_bounces:
            normal, steep = normal_of_facet(terrain, mesh, place)
            k, s, cos_beta, turn = bounce_at(flight.k, flight.s, normal)
            label = label_of_facet(terrain, mesh, place)
            write_mirror(record, flight.bounces, cos_beta, turn, label)
            if splits:
                event, n_hits = ask_base(
                    terrain, mesh, place, flight, Draw(bundle.stream, name, event), n_hits,
                    scan,
                )  # fmt: skip
                # The base has left its own cosine of exit there
                record[flight.bounces, 0, COS_OUT] = SPECULAR
            flight = mirror_flight(flight, k, s, normal)
            counts[N_SEGMENTS] += 1
            fate, place = leave(terrain, mesh, place, flight.k, cos_beta * steep)

        end_flight(fate, flight, bundle, scan)
        while n_hits > 0 and hits[n_hits - 1, H_LEFT] < 1.0:
            n_hits -= 1
        if n_hits == 0:
            break
        draw = Draw(bundle.stream, name, event)
        event += 1
        fate, place, flight = sample_hemisphere(
            terrain, mesh, n_hits - 1, draw, flight, scan
        )


@jit(allocates=False)
def trace_bundles(terrain, mesh, bundle, targets, axes, record, hits, optics, rule, catch):
    """Send all bundles of a cone over a terrain or a mesh, the other None, line by line.

    axes, record and hits are room to work in, see `Scan`.
    """
    scan = Scan(targets, axes, record, hits, optics, rule, catch)
    launch = bundle.launch
    for line in range(bundle.n_lines):
        phi = bundle.phi
        if bundle.uniform_phi:
            phi = math.tau * fraction(line * STRIDE_PHI + bundle.shifts[2])
        cos_phi = math.cos(phi)
        sin_phi = math.sin(phi)
        place_axes(targets, cos_phi, sin_phi, axes)
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
            follow_bundle(terrain, mesh, x, y, cos_phi, sin_phi, bundle, first + ray, scan)
