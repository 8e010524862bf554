"""Rays over a random surface without the bodies on it, and which of them bodies let pass.

The rays of a sample among bodies meet their first facets here as if there were no bodies.
What hides a facet are bodies on the plane z = 0, whose places do not depend on the heights:
so a facet is as likely to be hidden as any other place, whatever its slopes.
"""

from collections import namedtuple
from math import cos, floor, sin, tau

from pbrdf.kernels import jit
from pbrdf.kernels.bins.binning import bin_of_direction
from pbrdf.kernels.bodies.beams import KX, KY, KZ, LEFT, N_INSIDE, NOTHING, X, Y, Z
from pbrdf.kernels.bodies.bodies import FAR, NO_BODY, next_body
from pbrdf.kernels.optics.vectors import Vec, opposite
from pbrdf.kernels.paths.ground import next_facet, normal_of_facet, read_place
from pbrdf.kernels.paths.ray_bounce import mirror_at
from pbrdf.kernels.terrain.entry import first_ray, line_beam, way_of
from pbrdf.kernels.terrain.heightfield import ESCAPED
from pbrdf.kernels.terrain.sweep import sweep_line

# Fractions of these spread places evenly over the plane, and azimuths, for any count
PLASTIC_A, PLASTIC_B, GOLDEN = 0.7548776662466927, 0.5698402909980532, 0.6180339887498949
# Room for the first facets of a line, one beam (1, N_STATE) and what it meets (N_HIT,)
SightRoom = namedtuple("SightRoom", "meetings beam hit")
# Rays by bin (n_theta, n_dphi): those that leave the clean surface after one bounce; of
# these, those that no body on the plane hides where they are; and places elsewhere where
# none would hide them
Counts = namedtuple("Counts", "clean here elsewhere")


@jit(forceinline=True)
def start_on_plane(beam):
    """Let a beam start on the plane, outside of all bodies that it knows of."""
    beam[0, Z] = 0.0
    beam[0, LEFT] = NOTHING
    beam[0, N_INSIDE] = 0.0


@jit(forceinline=True)
def is_free(bodies, x, y, k, beam, hit):
    """Whether the way from a place on the plane towards k meets no body."""
    beam[0, X] = x
    beam[0, Y] = y
    beam[0, KX], beam[0, KY], beam[0, KZ] = k
    return next_body(bodies, beam, 0, FAR, hit) == NO_BODY


@jit(forceinline=True)
def is_seen(bodies, x, y, back, out, beam, hit):
    """Whether a place on the plane is seen from the source and from the detector."""
    return is_free(bodies, x, y, back, beam, hit) and is_free(bodies, x, y, out, beam, hit)


@jit(forceinline=True)
def middle_of_cell(number, start, factor, cells):
    """Return the middle of the cell that the number falls into, counted in cells."""
    x = number * factor + start
    return floor((x - floor(x)) * cells) + 0.5


@jit(allocates=False)
def count_seen(
    terrain, bodies, source, z_start, start, places, edges, wanted, room, counts
):
    """Count the rays of a sample that leave the clean surface after one bounce, by bin.

    terrain     the surface; rays start at the height z_start as those of the sample do
    bodies      on the plane z = 0
    start       where the places elsewhere begin (2,), in [0, 1)
    places      elsewhere, for each ray
    edges       of the bins, as `bin_edges` gives them
    wanted      which bins are counted (n_theta, n_dphi)
    counts      `Counts`, added to
    """
    zenith, azimuth = edges
    meetings, beam, hit = room
    nx, ny = terrain.heights.shape
    start_on_plane(beam)
    number = 0
    for line in range(source.n_lines):
        light = line_beam(line, source)
        k = way_of(light)
        back = opposite(k)
        rays = first_ray(line + 1, source) - first_ray(line, source)
        sweep_line(terrain, line, source, z_start, meetings)
        for ray in range(rays):
            place = read_place(meetings, ray)
            normal, steep = normal_of_facet(terrain, None, place)
            r, _, cos_beta = mirror_at(k, normal)
            fate, _ = next_facet(terrain, None, None, place, r, cos_beta * steep)
            if fate != ESCAPED:
                continue
            a, b = bin_of_direction(
                r.x, r.y, r.z, light.cos_phi, light.sin_phi, zenith, azimuth
            )
            if not wanted[a, b]:
                continue
            counts.clean[a, b] += 1.0
            # The middle of the cell: a law that repeats with the grid is the same there
            x, y = (place.i + 0.5) * terrain.pitch_x, (place.j + 0.5) * terrain.pitch_y
            if is_seen(bodies, x, y, back, r, beam, hit):
                counts.here[a, b] += 1.0
            for _ in range(places):
                number += 1
                x = middle_of_cell(number, start[0], PLASTIC_A, nx) * terrain.pitch_x
                y = middle_of_cell(number, start[1], PLASTIC_B, ny) * terrain.pitch_y
                if is_seen(bodies, x, y, back, r, beam, hit):
                    counts.elsewhere[a, b] += 1.0


@jit(forceinline=True)
def towards(sin_theta, cos_theta, phi):
    """Return the unit vector of a zenith angle and an azimuth."""
    return Vec(sin_theta * cos(phi), sin_theta * sin(phi), cos_theta)


@jit(allocates=False)
def share_seen(bodies, source, start, places, wanted, middles, room, share):
    """Share of the plane that is seen, for exits towards the middles of bins.

    places      tried for each bin
    middles     zenith angles (n_theta,) and azimuths (n_dphi,) of the bins [rad]
    share       by bin (n_theta, n_dphi), written where `wanted`
    """
    theta_s, dphi = middles
    _, beam, hit = room
    start_on_plane(beam)
    number = 0
    for a in range(theta_s.size):
        sin_s, cos_s = sin(theta_s[a]), cos(theta_s[a])
        for b in range(dphi.size):
            if not wanted[a, b]:
                continue
            seen = 0
            for _ in range(places):
                number += 1
                phi = source.phi
                if source.uniform_phi:
                    phi = tau * (number * GOLDEN + start[0])
                x = number * PLASTIC_A + start[0]
                y = number * PLASTIC_B + start[1]
                back = towards(source.sin_theta, source.cos_theta, phi)
                out = towards(sin_s, cos_s, phi + dphi[b])
                if is_seen(
                    bodies, (x - floor(x)) * bodies.size_x, (y - floor(y)) * bodies.size_y,
                    back, out, beam, hit,
                ):  # fmt: skip
                    seen += 1
            share[a, b] = seen / places
