"""How often facets of given slopes are seen from source and detector, cell by cell.

In a cell of directions facets of fitting slopes are put at random places of a realisation.
What the realisation's own slopes happen to be does not matter: only what stands around a
facet does, and from which height on the facet is clear of it; that it lies so high has a
known probability.
"""

from collections import namedtuple
from math import cos, erfc, exp, floor, log, sin, sqrt, tau

from pbrdf.kernels import jit
from pbrdf.kernels.bins.binning import HALF_PI
from pbrdf.kernels.microfacet.facet import directions, mirror_facet
from pbrdf.kernels.paths.random import uniform_pair
from pbrdf.kernels.sights.light import RISE_DPHI, RISE_THETA, overhang
from pbrdf.kernels.sights.walk import Bend, Given, least_lift

# The ensemble: `SlopeLaw`; grid steps; for the facets below and above the diagonal the
# inverse covariance (2, 3, 3) of their corners (0, 0), (1, 0) or (0, 1), (1, 1) in units of
# the variance of height; regression (2, 2) of their mean height on their slopes and what
# remains (2,) [um]; `Reach` of the bending
Ensemble = namedtuple("Ensemble", "law pitch_x pitch_y inverse regression remainder reach")
# Numbers of the looks: the source's zenith and azimuth (uniform_phi: any), first edge of
# dphi, cells (cells, cells, N_CELL), looks (cells, cells) and stream of random numbers
Looks = namedtuple("Looks", "theta_i phi uniform_phi left cells counts stream")
PLASTIC_A, PLASTIC_B = 0.7548776662466927, 0.5698402909980532
# Share of the lowest facets of which one is looked at by chance; and a height above which
# there is none, in standard deviations
LOW_SHARE, HIGHEST = 0.03, 5.5


@jit(forceinline=True)
def low_quantile(p):
    """Return the normal quantile of p below 0.07, to 1e-7.

    M. Wichura, Appl. Stat. 37, 477 (1988), algorithm AS 241.
    """
    r = sqrt(-log(p))
    if r <= 5.0:
        r -= 1.6
        up = ((0.17023821103 * r + 1.3067284816) * r + 2.7568153900) * r + 1.4234372777
        return -up / ((0.12021132975 * r + 0.73700164250) * r + 1.0)
    r -= 5.0
    up = ((0.017337203997 * r + 0.42868294337) * r + 3.0812263860) * r + 6.6579051150
    return -up / ((0.012258202635 * r + 0.24197894225) * r + 1.0)


@jit(forceinline=True)
def tilted(x, change):
    """Turn a uniform number in [0, 1) into one of a density that grows by exp(change)."""
    if abs(change) < 1e-6:
        return x
    return log(1.0 + x * (exp(change) - 1.0)) / change


@jit(forceinline=True)
def hold(mesh, ensemble, i, j, low, slope_x, slope_y):
    """Give a facet slopes and the height that they let expect.

    Returns `Given`, the height of its first corner and its steps along its first and second
    edge.
    """
    heights = mesh.terrain.heights
    nx, ny = heights.shape
    i1 = i + 1 if i + 1 < nx else 0
    j1 = j + 1 if j + 1 < ny else 0
    k = 0 if low else 1
    z_a = heights[i, j]
    z_b = heights[i1, j] if low else heights[i, j1]
    z_d = heights[i1, j1]
    old_x = ((z_b - z_a) if low else (z_d - z_b)) / ensemble.pitch_x
    old_y = ((z_d - z_b) if low else (z_b - z_a)) / ensemble.pitch_y
    per_x, per_y = ensemble.regression[k, 0], ensemble.regression[k, 1]
    before = (z_a + z_b + z_d) / 3.0 - per_x * old_x - per_y * old_y
    # The corners from the mean height and the slopes
    up_x, up_y = slope_x * ensemble.pitch_x, slope_y * ensemble.pitch_y
    first = up_x if low else up_y
    second = up_y if low else up_x
    corner = per_x * slope_x + per_y * slope_y - (2.0 * first + second) / 3.0
    d_a = corner - z_a
    d_b = corner + first - z_b
    d_d = corner + first + second - z_d
    inverse = ensemble.inverse
    a0, a1, a2 = inverse[k, 0, 0], inverse[k, 0, 1], inverse[k, 0, 2]
    b0, b1, b2 = inverse[k, 1, 0], inverse[k, 1, 1], inverse[k, 1, 2]
    c0, c1, c2 = inverse[k, 2, 0], inverse[k, 2, 1], inverse[k, 2, 2]
    bent_b = b0 * d_a + b1 * d_b + b2 * d_d
    lift_b = b0 + b1 + b2
    given = Given(
        i, j,
        Bend(
            a0 * d_a + a1 * d_b + a2 * d_d, bent_b if low else 0.0, 0.0 if low else bent_b,
            c0 * d_a + c1 * d_b + c2 * d_d,
        ),
        Bend(a0 + a1 + a2, lift_b if low else 0.0, 0.0 if low else lift_b, c0 + c1 + c2),
        abs(slope_x - old_x), abs(slope_y - old_y), before,
    )  # fmt: skip
    return given, corner, first, second


@jit(forceinline=True)
def one_look(mesh, ensemble, looks, place, point, chance, theta_s, dphi, phi):
    """Probability that a facet is seen from both ends, in units of Smith's rule.

    Seen are those above some height. Of the lowest facets one of a height drawn by `chance`
    stands for all.
    """
    cos_phi, sin_phi = cos(phi), sin(phi)
    cos_o, sin_o = cos(phi + dphi), sin(phi + dphi)
    way = directions(looks.theta_i, theta_s, dphi, cos_phi, sin_phi)
    facet = mirror_facet(way)
    u, v = point
    low = u > v
    given, z, first, second = hold(
        mesh, ensemble, place[0], place[1], low, facet.slope_x, facet.slope_y
    )
    # The facet below the diagonal rises first along x, the one above first along y
    z += first * (u if low else v) + second * (v if low else u)
    law, reach = ensemble.law, ensemble.reach
    hidden_i = overhang(law, way.cos_i, way.sin_i, cos_phi, sin_phi)
    hidden_s = overhang(law, way.cos_s, way.sin_s, cos_o, sin_o)
    unit = ensemble.remainder[0 if low else 1]
    lowest = low_quantile(LOW_SHARE * chance + 1e-30) * unit
    lift, most = lowest, HIGHEST * unit
    lift = least_lift(
        mesh, given, reach, lift, most, u, v, z, way.sin_i * cos_phi / ensemble.pitch_x,
        way.sin_i * sin_phi / ensemble.pitch_y, way.cos_i,
    )  # fmt: skip
    if lift < most:
        lift = least_lift(
            mesh, given, reach, lift, most, u, v, z, way.sin_s * cos_o / ensemble.pitch_x,
            way.sin_s * sin_o / ensemble.pitch_y, way.cos_s,
        )  # fmt: skip
    if lift >= most:
        return 0.0
    whole = 1.0 + hidden_i + hidden_s
    if lift <= lowest:
        return whole
    return whole * (1.0 - max(LOW_SHARE, 0.5 * erfc(-lift / (sqrt(2.0) * unit))))


@jit(allocates=False)
def look(mesh, ensemble, looks, seen):
    """Fill in how often facets are seen in units of Smith's rule (cells, cells)."""
    n_theta, n_dphi = seen.shape
    nx, ny = mesh.terrain.heights.shape
    step, turn = HALF_PI / n_theta, tau / n_dphi
    number = 0
    for row in range(n_theta):
        for column in range(n_dphi):
            count = looks.counts[row, column]
            seen[row, column] = 1.0
            if count == 0:
                continue
            start_a, start_b = uniform_pair(looks.stream, number, 0)
            total = 0.0
            for m in range(count):
                # Evenly spread over the cell (Roberts' sequence)
                a = start_a + m * PLASTIC_A
                b = start_b + m * PLASTIC_B
                a = tilted(a - floor(a), looks.cells[row, column, RISE_THETA])
                b = tilted(b - floor(b), looks.cells[row, column, RISE_DPHI])
                x, y = uniform_pair(looks.stream, number, 1)
                point = uniform_pair(looks.stream, number, 2)
                chance, turned = uniform_pair(looks.stream, number, 3)
                phi = tau * turned if looks.uniform_phi else looks.phi
                number += 1
                total += one_look(
                    mesh, ensemble, looks, (int(x * nx), int(y * ny)), point,
                    chance, step * (row + a), looks.left + turn * (column + b), phi,
                )  # fmt: skip
            seen[row, column] = total / count
