"""Single mirror reflections, asked of the facets: which of them join source and detector?

Seen through a facet the source stands in another place; the facet joins the two cones if
its mirrored source overlaps the detector's cone. The normals that do so fill a small conic
in the plane of slopes, so a table of facets by slope names them at once, and only they need
rays: one to the detector and one to the source.
"""

import math
from collections import namedtuple

import numpy as np

from pbrdf.kernels import jit
from pbrdf.kernels.cones.lens import leave, lens_direction, lens_flux
from pbrdf.kernels.cones.matrix import facet_mueller
from pbrdf.kernels.optics.light import mirror_image
from pbrdf.kernels.optics.vectors import dot, opposite
from pbrdf.kernels.paths.ground import Place
from pbrdf.kernels.paths.random import uniform_pair
from pbrdf.kernels.paths.ray_bounce import normal_of_slopes
from pbrdf.kernels.terrain.heightfield import (
    ESCAPED,
    FACET_LOW,
    SIDE,
    corner_heights,
    facet_slopes,
    plane_height,
)

# Facets 2 (i rows + j) + facet in the order of a square grid of slopes: lowest slopes,
# cells of the grid per unit of slope, first facet of each cell, and the number of facets
SlopeTable = namedtuple("SlopeTable", "low_x low_y per_x per_y start facets rows")
# Columns of what the facets of a material show: flux, flux with unknown visibility, and
# flux of all points tried, whether they are seen or not
FLUX, UNKNOWN_FLUX, TRIED_FLUX, N_SHOWN = 0, 1, 2, 3
# Counts: facets that join the cones, points tried on them, points seen from both sides,
# points whose rays left a finite map sideways
N_FACETS, N_POINTS, N_SEEN, N_ASIDE, N_FACET_COUNTS = 0, 1, 2, 3, 4
# What is added up: `shown` (materials, N_SHOWN), flux of single reflections without the
# mirror's matrix; `matrices` (wavelengths, stokes, stokes), flux with each path's own, of
# no size where that is not asked; counts (N_FACET_COUNTS,); and room for a matrix (4, 4)
Sums = namedtuple("Sums", "shown matrices counts mueller")


@jit(allocates=False)
def slope_range(terrain, inside):
    """Least and largest slopes along x and y of the facets of cells inside (i, i, j, j)."""
    low_x, high_x, low_y, high_y = math.inf, -math.inf, math.inf, -math.inf
    for i in range(inside[0], inside[1]):
        for j in range(inside[2], inside[3]):
            for facet in range(2):
                slope_x, slope_y = facet_slopes(terrain, i, j, facet)
                low_x, high_x = min(low_x, slope_x), max(high_x, slope_x)
                low_y, high_y = min(low_y, slope_y), max(high_y, slope_y)
    return low_x, high_x, low_y, high_y


@jit(inline="always")
def slope_cell(table, size, slope_x, slope_y):
    """Cell of the grid of slopes."""
    a = int((slope_x - table.low_x) * table.per_x)
    b = int((slope_y - table.low_y) * table.per_y)
    return min(max(a, 0), size - 1) * size + min(max(b, 0), size - 1)


@jit
def sort_facets(terrain, inside, size, low_x, high_x, low_y, high_y):
    """Table of the facets by slope, on a grid of size x size cells."""
    rows = inside[3] - inside[2]
    count = 2 * (inside[1] - inside[0]) * rows
    start = np.zeros(size * size + 1, dtype=np.int32)
    facets = np.empty(count, dtype=np.int32)
    table = SlopeTable(
        low_x, low_y,
        size / max(high_x - low_x, 1e-300), size / max(high_y - low_y, 1e-300),
        start, facets, rows,
    )  # fmt: skip
    # Count, sum up, deal out
    for i in range(inside[0], inside[1]):
        for j in range(inside[2], inside[3]):
            for facet in range(2):
                slope_x, slope_y = facet_slopes(terrain, i, j, facet)
                start[slope_cell(table, size, slope_x, slope_y) + 1] += 1
    for k in range(size * size):
        start[k + 1] += start[k]
    place = start[:-1].copy()
    for i in range(inside[0], inside[1]):
        for j in range(inside[2], inside[3]):
            for facet in range(2):
                slope_x, slope_y = facet_slopes(terrain, i, j, facet)
                cell = slope_cell(table, size, slope_x, slope_y)
                number = (i - inside[0]) * rows + j - inside[2]
                facets[place[cell]] = 2 * number + facet
                place[cell] += 1
    return table


@jit(inline="always")
def joining_normals(cones):
    """Quadratic form n B n >= 0 of the normals n that join the two cones.

    The source mirrored by n lies within the sum of the half-angles of the detector:
    2 (n.d)(n.i) - (d.i) |n|^2 >= cos(sum) |n|^2.
    """
    d, i = cones.d, cones.i
    share = dot(d, i) + (cones.cos_d * cones.cos_i - cones.sin_d * cones.sin_i)
    return (
        2.0 * d.x * i.x - share,
        2.0 * d.y * i.y - share,
        2.0 * d.z * i.z - share,
        d.x * i.y + d.y * i.x,
        d.x * i.z + d.z * i.x,
        d.y * i.z + d.z * i.y,
    )


@jit(inline="always")
def conic_extent(b_xx, b_yy, b_zz, b_xy, b_xz, b_yz):
    """Range of n_x/n_z with n B n >= 0 for some n_y; all numbers if it is no ellipse."""
    a = b_xy * b_xy - b_yy * b_xx
    b = b_xy * b_yz - b_yy * b_xz
    c = b_yz * b_yz - b_yy * b_zz
    square = b * b - a * c
    if b_yy >= 0.0 or a >= 0.0 or square < 0.0:
        return -math.inf, math.inf
    root = math.sqrt(square)
    return (-b + root) / a, (-b - root) / a


@jit(inline="always")
def cell_range(low, high, first, per_slope, size):
    """Cells of one axis of the slope grid that hold slopes from low to high."""
    # The rounding of a bound must not cost a facet
    from_cell = (low - first) * per_slope - 1e-6
    to_cell = (high - first) * per_slope + 1e-6
    if not from_cell < size or not to_cell >= 0.0:
        return 0, 0
    return int(max(from_cell, 0.0)), int(min(to_cell, size - 1.0)) + 1


@jit(forceinline=True)
def cells_of_conic(table, size, form):
    """Cells (from x, to x, from y, to y) of the grid of slopes that hold joining facets."""
    b_xx, b_yy, b_zz, b_xy, b_xz, b_yz = form
    # A normal (x, y, 1) has the slopes (-x, -y)
    low, high = conic_extent(b_xx, b_yy, b_zz, b_xy, b_xz, b_yz)
    from_x, to_x = cell_range(-high, -low, table.low_x, table.per_x, size)
    low, high = conic_extent(b_yy, b_xx, b_zz, b_xy, b_yz, b_xz)
    from_y, to_y = cell_range(-high, -low, table.low_y, table.per_y, size)
    return from_x, to_x, from_y, to_y


@jit(forceinline=True)
def value_of_form(form, slope_x, slope_y):
    """Value of the quadratic form of the normals for a facet of these slopes."""
    b_xx, b_yy, b_zz, b_xy, b_xz, b_yz = form
    return (
        b_zz
        + (b_xx * slope_x + 2.0 * b_xy * slope_y - 2.0 * b_xz) * slope_x
        + (b_yy * slope_y - 2.0 * b_yz) * slope_y
    )


@jit(forceinline=True)
def flux_of_facet(normal, cones):
    """Flux through a facet per area, and the source as the facet shows it."""
    to_d, to_i = dot(normal, cones.d), dot(normal, cones.i)
    image = mirror_image(opposite(cones.i), normal, to_i)
    flux = 0.0
    if to_d > 0.0 and to_i > 0.0:
        flux = lens_flux(
            dot(image, cones.d), to_d, to_i,
            cones.cos_d, cones.sin_d, cones.cos_i, cones.sin_i,
        )  # fmt: skip
    return flux, image


@jit(forceinline=True)
def show_point(terrain, mesh, place, facet, cones, stream, name, optics, sums):
    """Add the light of a facet if a point of it is seen from the detector and the source.

    facet       its normal, the source as it shows it, its material, and its flux
    """
    normal, image, m, flux = facet
    shown, matrices, counts, mueller = sums
    k = lens_direction(cones.d, image, cones.half_d, cones.half_i, normal, stream, name)
    cosine = dot(normal, k)
    counts[N_POINTS] += 1
    shown[m, TRIED_FLUX] += flux
    if cosine <= 0.0:
        return
    # Seen from the detector, and through the mirror from the source? (Only the walk over a
    # height field asks how fast a ray rises from its facet)
    rate = cosine / normal.z
    fate, _ = leave(terrain, mesh, place, k, rate)
    if fate == ESCAPED:
        fate, _ = leave(
            terrain, mesh, place, mirror_image(opposite(k), normal, cosine), rate
        )
    if fate == SIDE:
        counts[N_ASIDE] += 1
        shown[m, UNKNOWN_FLUX] += flux
    elif fate == ESCAPED:
        counts[N_SEEN] += 1
        shown[m, FLUX] += flux
        n_stokes = matrices.shape[1]
        for w in range(matrices.shape[0]):
            facet_mueller(cones, k, normal, optics, w, m, n_stokes, mueller)
            for row in range(n_stokes):
                for column in range(n_stokes):
                    matrices[w, row, column] += flux * mueller[row, column]


@jit(allocates=False)
def show_facets(terrain, table, size, inside, cones, points, most, stream, optics, sums):
    """Add up the facets that join the two cones.

    points, most    points a facet, and about the most in all: of more, some facets are
                    drawn at random and stand for the others
    sums            `Sums`

    Flux is the integral of the cosine over the lens of directions, a facet counting by its
    share of the horizontal area and a hidden point as none. Divided by the projected solid
    angles of both cones it is 1/sr.
    """
    labels = terrain.labels
    form = joining_normals(cones)
    from_x, to_x, from_y, to_y = cells_of_conic(table, size, form)
    near = 0
    for a in range(from_x, to_x):
        near += table.start[a * size + to_y] - table.start[a * size + from_y]
    chance = min(1.0, most / max(near * points, 1))
    share = 1.0 / table.facets.size / points / chance
    for a in range(from_x, to_x):
        for entry in range(table.start[a * size + from_y], table.start[a * size + to_y]):
            number = table.facets[entry]
            facet = number % 2
            i = number // 2 // table.rows + inside[0]
            j = number // 2 % table.rows + inside[2]
            slope_x, slope_y = facet_slopes(terrain, i, j, facet)
            if value_of_form(form, slope_x, slope_y) <= 0.0:
                continue
            normal, _ = normal_of_slopes(slope_x, slope_y)
            flux, image = flux_of_facet(normal, cones)
            flux *= share / normal.z
            draw, _ = uniform_pair(stream, 2 * number * points, 1)
            if flux <= 0.0 or draw >= chance:
                continue
            sums.counts[N_FACETS] += 1
            m = labels[i, j] if labels.size > 0 else 0
            z00, z10, z01, z11 = corner_heights(terrain.heights, i, j, terrain.periodic)
            for point in range(points):
                name = number * points + point
                u, v = uniform_pair(stream, 2 * name, 0)
                if (u > v) != (facet == FACET_LOW):
                    u, v = v, u
                z = plane_height(z00, z10, z01, z11, facet, u, v)
                show_point(
                    terrain, None, Place(i, j, facet, u, v, z), (normal, image, m, flux),
                    cones, stream, 2 * name + 1, optics, sums,
                )  # fmt: skip
