"""How often facets of given slopes are seen from source and detector, cell by cell.

Facets of fitting slopes are put at random places of a realisation, one for each cell of
directions of one azimuth. What the realisation's own slopes happen to be does not matter:
only what stands around a facet does, and from which height on the facet is clear of it;
that it lies so high has a known probability. Most looks draw what stands around
(`pbrdf.kernels.sights.drawn`); those over the realisation correct their mean.
"""

from collections import namedtuple
from math import cos, erfc, floor, log, sin, sqrt, tau

from pbrdf.kernels import jit
from pbrdf.kernels.bins.binning import HALF_PI
from pbrdf.kernels.microfacet.facet import directions, mirror_facet
from pbrdf.kernels.paths.random import uniform_pair
from pbrdf.kernels.sights.drawn import draw_looks, take_mesh_looks
from pbrdf.kernels.sights.light import RISE_DPHI, RISE_THETA, overhang
from pbrdf.kernels.sights.profiles import corner_heights_by_slopes
from pbrdf.kernels.sights.spread import tilted, tilted_density
from pbrdf.kernels.sights.walk import Bend, Place, Rays, lift_clear

# The ensemble: `SlopeLaw`; grid steps; for the facets below and above the diagonal the
# inverse covariance (2, 3, 3) of their corners (0, 0), (1, 0) or (0, 1), (1, 1) in units of
# the variance of height; regression (2, 2) of their mean height on their slopes and what
# remains (2,) [um]; `Reach` of the bending
Ensemble = namedtuple("Ensemble", "law pitch_x pitch_y inverse regression remainder reach")
# Numbers of the looks: the source's zenith and azimuth (uniform_phi: any), first edge of
# dphi, cells (cells, cells, N_CELL) and which of them are looked at; by column of cells of
# one dphi: how many places see it in the mean, pairs of looks without a surface, and
# logarithmic change across it of the density of looks; stream of random numbers; normal
# numbers (pairs in all, nodes)
Looks = namedtuple(
    "Looks", "theta_i phi uniform_phi left cells wanted places pairs change stream normals"
)
# Room to work in: `rays` are `Rays` and `numbers` (N_OF_LOOK, cells), as long as a column
# of cells; `drawn` is that of `draw_looks`
LookRoom = namedtuple("LookRoom", "rays numbers drawn")
PLASTIC_A, PLASTIC_B = 0.7548776662466927, 0.5698402909980532
# Numbers of a look: rise of the exit ray, weight, one more than Smith's Lambdas, place
# across its cell in zenith, and what it told
OUT_RISE, OF_LOOK, OF_SMITH, ACROSS, TOLD, N_OF_LOOK = 0, 1, 2, 3, 4, 5
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
    old_lift = (z_a + z_b + z_d) / 3.0
    old_lift -= ensemble.regression[k, 0] * old_x + ensemble.regression[k, 1] * old_y
    first_x, first_y, step_x, step_y = corner_heights_by_slopes(ensemble, k)
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
def look_up(mesh, ensemble, looks, column, m, number, rays, numbers):
    """Lift the facets of a column's cells at one place until they are seen from both ends.

    rays        `Rays`, one for each cell that is wanted
    numbers     by cell (N_OF_LOOK, cells), but for TOLD, which is left

    Returns the place, where across the column it looks, the unit of lift, and the lift
    below which none was looked at.
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
    across = start_b + m * PLASTIC_B
    across -= floor(across)
    b = tilted(across, change)
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
        a -= floor(a)
        numbers[ACROSS, k] = a
        theta_s = HALF_PI / n_theta * (row + tilted(a, cell[RISE_THETA]))
        way = directions(looks.theta_i, theta_s, dphi, cos_phi, sin_phi)
        facet = mirror_facet(way)
        set_ray(rays, k, place, facet.slope_x, facet.slope_y)
        rays.rise[k] = steepness(cos_i, sin_i)
        rays.lift[k] = lowest
        hidden_s = overhang(law, way.cos_s, way.sin_s, cos_o, sin_o)
        numbers[OUT_RISE, k] = steepness(way.cos_s, way.sin_s)
        numbers[OF_LOOK, k] = share * tilted_density(b, cell[RISE_DPHI])
        numbers[OF_SMITH, k] = 1.0 + hidden_i + hidden_s
        k += 1
    most, reach = HIGHEST * unit, ensemble.reach
    px, py = ensemble.pitch_x, ensemble.pitch_y
    lift_clear(mesh, place, reach, rays, most, cos_phi / px, sin_phi / py)
    for k in range(rays.rise.size):
        rays.rise[k] = numbers[OUT_RISE, k]
    lift_clear(mesh, place, reach, rays, most, cos_o / px, sin_o / py)
    return place, across, unit, lowest


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


@jit(forceinline=True)
def first_of(rays, n):
    """Return the first n rays."""
    return Rays(
        rays.slope_x[:n], rays.slope_y[:n], rays.start[:n], rays.change_x[:n],
        rays.change_y[:n], rays.rise[:n], rays.lift[:n],
    )  # fmt: skip


@jit(allocates=False)
def look(mesh, ensemble, looks, profiles, room, seen):
    """Fill in how often facets are seen in units of Smith's rule (cells, cells).

    profiles    `Profiles` of the lines of looks without a surface
    room        `LookRoom`
    """
    n_theta, n_dphi = seen.shape
    numbers, told = room.numbers, room.numbers[TOLD]
    number = pair = 0
    # So that on average a column has the places that it should, if only one in many samples
    due, _ = uniform_pair(looks.stream, 0, 4)
    for column in range(n_dphi):
        n = 0
        for row in range(n_theta):
            seen[row, column] = 1.0
            n += looks.wanted[row, column]
            told[row] = 0.0
        if n == 0:
            continue
        pairs = looks.pairs[column]
        if pairs > 0:
            start, _ = uniform_pair(looks.stream, column, 5)
            draw_looks(
                ensemble, profiles, column, n, pairs, start,
                looks.normals[pair : pair + pairs], room.drawn, told,
            )  # fmt: skip
            pair += pairs
            add_rows(looks.wanted, column, told, 0.5 / pairs, seen)
        some = first_of(room.rays, n)
        before = floor(due)
        due += looks.places[column]
        for m in range(int(floor(due) - before)):
            place, b, unit, lowest = look_up(
                mesh, ensemble, looks, column, m, number, some, numbers
            )
            number += 1
            for k in range(n):
                surplus = numbers[OF_SMITH, k] * higher(some.lift[k], lowest, unit) - 1.0
                told[k] = numbers[OF_LOOK, k] * surplus
            if pairs > 0:
                take_mesh_looks(
                    mesh, ensemble, profiles, column, place, b, numbers[ACROSS], n,
                    room.drawn, told,
                )  # fmt: skip
            add_rows(looks.wanted, column, told, 1.0 / looks.places[column], seen)


@jit(forceinline=True)
def add_rows(wanted, column, told, share, seen):
    """Add what was told of the wanted cells of a column."""
    k = 0
    for row in range(wanted.shape[0]):
        if wanted[row, column]:
            seen[row, column] += share * told[k]
            k += 1
