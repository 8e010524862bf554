"""How often facets of given slopes are seen from source and detector, cell by cell.

Facets of fitting slopes are put at random places of a realisation, one for each cell of
directions of one azimuth. What the realisation's own slopes happen to be does not matter:
only what stands around a facet does, and from which height on the facet is clear of it;
that it lies so high has a known probability.
"""

from collections import namedtuple
from math import cos, erfc, exp, expm1, floor, log, log1p, sin, sqrt, tau

from pbrdf.kernels import jit
from pbrdf.kernels.bins.binning import HALF_PI
from pbrdf.kernels.microfacet.facet import directions, mirror_facet
from pbrdf.kernels.paths.random import uniform_pair
from pbrdf.kernels.sights.light import RISE_DPHI, RISE_THETA, overhang
from pbrdf.kernels.sights.walk import Bend, Place, Rays, lift_clear

# The ensemble: `SlopeLaw`; grid steps; for the facets below and above the diagonal the
# inverse covariance (2, 3, 3) of their corners (0, 0), (1, 0) or (0, 1), (1, 1) in units of
# the variance of height; regression (2, 2) of their mean height on their slopes and what
# remains (2,) [um]; `Reach` of the bending
Ensemble = namedtuple("Ensemble", "law pitch_x pitch_y inverse regression remainder reach")
# Numbers of the looks: the source's zenith and azimuth (uniform_phi: any), first edge of
# dphi, cells (cells, cells, N_CELL) and which of them are looked at; by column of cells of
# one dphi: how many places see it, and logarithmic change across it of their density;
# stream of random numbers
Looks = namedtuple(
    "Looks", "theta_i phi uniform_phi left cells wanted places change stream"
)
PLASTIC_A, PLASTIC_B = 0.7548776662466927, 0.5698402909980532
N_OF_LOOK = 3
GOLDEN = 0.6180339887498949
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
    return log1p(x * expm1(change)) / change


@jit(forceinline=True)
def tilted_density(x, change):
    """Density at x in [0, 1) that grows by exp(change) and has the mean 1."""
    if abs(change) < 1e-6:
        return 1.0
    return change * exp(change * x) / expm1(change)


@jit(forceinline=True)
def times(inverse, k, a, b, d, low):
    """Bending for changes of the corners of a facet, below or above the diagonal."""
    middle = inverse[k, 1, 0] * a + inverse[k, 1, 1] * b + inverse[k, 1, 2] * d
    return Bend(
        inverse[k, 0, 0] * a + inverse[k, 0, 1] * b + inverse[k, 0, 2] * d,
        middle if low else 0.0,
        0.0 if low else middle,
        inverse[k, 2, 0] * a + inverse[k, 2, 1] * b + inverse[k, 2, 2] * d,
    )


@jit(forceinline=True)
def facet_place(mesh, ensemble, i, j, u, v):
    """Place of facets that are to be at (u, v) of a cell; see `Place`."""
    heights = mesh.terrain.heights
    nx, ny = heights.shape
    i1 = i + 1 if i + 1 < nx else 0
    j1 = j + 1 if j + 1 < ny else 0
    low = u > v
    k = 0 if low else 1
    z_a, z_d = heights[i, j], heights[i1, j1]
    z_b = heights[i1, j] if low else heights[i, j1]
    pitch_x, pitch_y = ensemble.pitch_x, ensemble.pitch_y
    old_x = ((z_b - z_a) if low else (z_d - z_b)) / pitch_x
    old_y = ((z_d - z_b) if low else (z_b - z_a)) / pitch_y
    # Heights of the first corner by a unit of slope, their mean being the regression's
    first_x, first_y = ensemble.regression[k, 0], ensemble.regression[k, 1]
    old_lift = (z_a + z_b + z_d) / 3.0 - first_x * old_x - first_y * old_y
    first_x -= (2.0 if low else 1.0) * pitch_x / 3.0
    first_y -= (1.0 if low else 2.0) * pitch_y / 3.0
    step_x, step_y = pitch_x if low else 0.0, 0.0 if low else pitch_y
    inverse = ensemble.inverse
    return Place(
        i, j, u, v,
        times(inverse, k, -z_a, -z_b, -z_d, low),
        times(inverse, k, first_x, first_x + step_x, first_x + pitch_x, low),
        times(inverse, k, first_y, first_y + step_y, first_y + pitch_y, low),
        times(inverse, k, 1.0, 1.0, 1.0, low),
        first_x + u * pitch_x, first_y + v * pitch_y, old_x, old_y, old_lift,
    )  # fmt: skip


@jit(forceinline=True)
def set_ray(rays, k, place, slope_x, slope_y):
    """Let ray k leave a facet of given slopes."""
    rays.slope_x[k] = slope_x
    rays.slope_y[k] = slope_y
    rays.start[k] = place.start_x * slope_x + place.start_y * slope_y
    rays.change_x[k] = abs(slope_x - place.old_x)
    rays.change_y[k] = abs(slope_y - place.old_y)


@jit(forceinline=True)
def steepness(cos_theta, sin_theta):
    """Height that a ray gains on a unit of way in the plane."""
    return cos_theta / max(sin_theta, 1e-12)


@jit(forceinline=True)
def look_up(mesh, ensemble, looks, column, m, number, rays, room):
    """Lift the facets of a column's cells at one place until they are seen from both ends.

    rays        `Rays`, one for each cell that is wanted
    room        by cell (N_OF_LOOK, cells): rise of the exit ray, weight of the look, and
                one more than Smith's Lambdas

    Returns the unit of lift, and the lift below which none was looked at.
    """
    n_theta, n_dphi = looks.wanted.shape
    nx, ny = mesh.terrain.heights.shape
    start_a, start_b = uniform_pair(looks.stream, column, 0)
    x, y = uniform_pair(looks.stream, number, 1)
    u, v = uniform_pair(looks.stream, number, 2)
    chance, turned = uniform_pair(looks.stream, number, 3)
    place = facet_place(mesh, ensemble, int(x * nx), int(y * ny), u, v)
    unit = ensemble.remainder[0 if u > v else 1]
    lowest = low_quantile(LOW_SHARE * chance + 1e-30) * unit
    phi = tau * turned if looks.uniform_phi else looks.phi
    cos_phi, sin_phi = cos(phi), sin(phi)
    law, change = ensemble.law, looks.change[column]
    # Evenly spread over the cells (Roberts' sequence)
    b = start_b + m * PLASTIC_B
    b = tilted(b - floor(b), change)
    share = 1.0 / tilted_density(b, change)
    dphi = looks.left + tau / n_dphi * (column + b)
    cos_o, sin_o = cos(phi + dphi), sin(phi + dphi)
    cos_i, sin_i = cos(looks.theta_i), sin(looks.theta_i)
    hidden_i = overhang(law, cos_i, sin_i, cos_phi, sin_phi)
    k = 0
    for row in range(n_theta):
        if not looks.wanted[row, column]:
            continue
        cell = looks.cells[row, column]
        a = start_a + m * PLASTIC_A + row * GOLDEN
        a = tilted(a - floor(a), cell[RISE_THETA])
        theta_s = HALF_PI / n_theta * (row + a)
        way = directions(looks.theta_i, theta_s, dphi, cos_phi, sin_phi)
        facet = mirror_facet(way)
        set_ray(rays, k, place, facet.slope_x, facet.slope_y)
        rays.rise[k] = steepness(cos_i, sin_i)
        rays.lift[k] = lowest
        hidden_s = overhang(law, way.cos_s, way.sin_s, cos_o, sin_o)
        room[0, k] = steepness(way.cos_s, way.sin_s)
        room[1, k] = share * tilted_density(b, cell[RISE_DPHI])
        room[2, k] = 1.0 + hidden_i + hidden_s
        k += 1
    most, reach = HIGHEST * unit, ensemble.reach
    px, py = ensemble.pitch_x, ensemble.pitch_y
    lift_clear(mesh, place, reach, rays, most, cos_phi / px, sin_phi / py)
    for k in range(rays.rise.size):
        rays.rise[k] = room[0, k]
    lift_clear(mesh, place, reach, rays, most, cos_o / px, sin_o / py)
    return unit, lowest


@jit(forceinline=True)
def higher(lift, lowest, unit):
    """Probability that a facet lies higher than a lift.

    Of the lowest facets one of a height drawn by chance stands for all.
    """
    if lift >= HIGHEST * unit:
        return 0.0
    if lift <= lowest:
        return 1.0
    return 1.0 - max(LOW_SHARE, 0.5 * erfc(-lift / (sqrt(2.0) * unit)))


@jit(allocates=False)
def look(mesh, ensemble, looks, rays, room, seen):
    """Fill in how often facets are seen in units of Smith's rule (cells, cells).

    rays, room  as of `look_up`, as long as a column of cells
    """
    n_theta, n_dphi = seen.shape
    number = 0
    for column in range(n_dphi):
        count = looks.places[column]
        for row in range(n_theta):
            seen[row, column] = 1.0
        n_rays = 0
        for row in range(n_theta):
            n_rays += looks.wanted[row, column]
        if n_rays == 0:
            continue
        some = Rays(
            rays.slope_x[:n_rays], rays.slope_y[:n_rays], rays.start[:n_rays],
            rays.change_x[:n_rays], rays.change_y[:n_rays], rays.rise[:n_rays],
            rays.lift[:n_rays],
        )  # fmt: skip
        for m in range(count):
            unit, lowest = look_up(mesh, ensemble, looks, column, m, number, some, room)
            number += 1
            k = 0
            for row in range(n_theta):
                if looks.wanted[row, column]:
                    surplus = room[2, k] * higher(some.lift[k], lowest, unit) - 1.0
                    seen[row, column] += room[1, k] * surplus / count
                    k += 1
