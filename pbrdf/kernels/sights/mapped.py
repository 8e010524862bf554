"""Single bounces of one height map, facet by facet: what each sends where if it is seen.

The flux that a facet sends into its one direction is known exactly; only how much of it is
seen from the source and from there is not. That is nothing or all for nearly all facets, as
a few points of each tell: the sum over all facets with what these points tell is a tally of
this very map without chance, and looks at random points add what is amiss on average.
"""

from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.bins.binning import bin_of_direction
from pbrdf.kernels.optics.frames import exit_turn
from pbrdf.kernels.optics.fresnel import reflection_elements
from pbrdf.kernels.optics.vectors import dot, opposite
from pbrdf.kernels.paths.ground import Place, label_of_facet, next_facet, normal_of_facet
from pbrdf.kernels.paths.ray_bounce import bounce_at
from pbrdf.kernels.paths.shading import reflect_once
from pbrdf.kernels.terrain.entry import fraction, line_beam, way_of
from pbrdf.kernels.terrain.heightfield import (
    ESCAPED,
    FACET_HIGH,
    FACET_LOW,
    cell_counts,
    corner_heights,
    plane_height,
)

# Fractions of these spread points evenly over the map, for any count
PLASTIC_A, PLASTIC_B = 0.7548776662466927, 0.5698402909980532
# Columns of a look: bin, material, flux of the facet, cosine of incidence, turns of the
# frame into the plane of incidence and out of it
L_THETA, L_DPHI, L_LABEL, L_FLUX, L_COS, L_IN_C, L_IN_S, L_OUT_C, L_OUT_S = range(9)
N_LOOK = 9
# Sums over facets by bin (n_theta, n_dphi), in the share of the light: of all, none hidden;
# of what their points say is seen; of those with points seen and points hidden; and their
# number
FacetSums = namedtuple("FacetSums", "whole seen partly number")
# Points of a facet: its middle, and one near each corner
N_POINTS = 4


@jit(forceinline=True)
def flux_through(terrain, source, cos_beta, steep):
    """Share of the light that a facet gets if it is seen from the source."""
    return 0.5 * cos_beta * steep / (source.cos_theta * source.launch[2] * source.launch[3])


@jit(forceinline=True)
def point_of_facet(facet, point):
    """One of the points of a facet in its cell."""
    u, v = 2.0 / 3.0, 1.0 / 3.0
    if point == 1:
        u, v = 0.1, 0.05
    elif point == 2:
        u, v = 0.95, 0.05
    elif point == 3:
        u, v = 0.95, 0.9
    return (u, v) if facet == FACET_LOW else (v, u)


@jit(forceinline=True)
def place_on(terrain, i, j, facet, u, v):
    """Place of a point of a facet."""
    z00, z10, z01, z11 = corner_heights(terrain.heights, i, j, terrain.periodic)
    return Place(i, j, facet, u, v, plane_height(z00, z10, z01, z11, facet, u, v))


@jit(forceinline=True)
def entry_of(terrain, source, place, back):
    """Where light that meets a place came in, from the corner of the entry rectangle."""
    time = (terrain.z_top - place.z) / back.z
    return (
        place.i + place.u + time * back.x / terrain.pitch_x - source.launch[0],
        place.j + place.v + time * back.y / terrain.pitch_y - source.launch[1],
    )


@jit(forceinline=True)
def is_lit(terrain, source, place, back):
    """Whether light that meets a place has come through the entry rectangle."""
    if terrain.periodic:
        return True
    x, y = entry_of(terrain, source, place, back)
    return 0.0 <= x < source.launch[2] and 0.0 <= y < source.launch[3]


@jit(forceinline=True)
def heaped(y, height):
    """Integral from 0 to y of what lies between 0 and a height."""
    inside = min(max(y, 0.0), height)
    return 0.5 * inside * inside + height * max(y - height, 0.0)


@jit(forceinline=True)
def mean_between(first, last, height):
    """Mean of what lies between 0 and a height, on a straight way from first to last."""
    low, high = min(first, last), max(first, last)
    if low >= 0.0 and high <= height:
        return 0.5 * (low + high)
    if high <= 0.0 or low >= height:
        return 0.0 if high <= 0.0 else height
    return (heaped(high, height) - heaped(low, height)) / (high - low)


@jit(forceinline=True)
def below_edge(x_a, y_a, x_b, y_b, width, height):
    """Area below an edge and inside a rectangle, negative where the edge runs back."""
    low, high = min(max(x_a, 0.0), width), min(max(x_b, 0.0), width)
    if low == high:
        return 0.0
    slope = (y_b - y_a) / (x_b - x_a)
    first = y_a if low == x_a else y_a + slope * (low - x_a)
    last = y_b if high == x_b else y_a + slope * (high - x_a)
    return (high - low) * mean_between(first, last, height)


@jit(forceinline=True)
def lit_share(terrain, source, i, j, facet, back):
    """Share of a facet whose light has come through the entry rectangle."""
    if terrain.periodic:
        return 1.0
    launch = source.launch
    x_0, y_0 = entry_of(terrain, source, place_on(terrain, i, j, facet, 0.0, 0.0), back)
    x_2, y_2 = entry_of(terrain, source, place_on(terrain, i, j, facet, 1.0, 1.0), back)
    u, v = (1.0, 0.0) if facet == FACET_LOW else (0.0, 1.0)
    x_1, y_1 = entry_of(terrain, source, place_on(terrain, i, j, facet, u, v), back)
    whole = (x_1 - x_0) * (y_2 - y_0) - (x_2 - x_0) * (y_1 - y_0)
    inside = (
        below_edge(x_0, y_0, x_1, y_1, launch[2], launch[3])
        + below_edge(x_1, y_1, x_2, y_2, launch[2], launch[3])
        + below_edge(x_2, y_2, x_0, y_0, launch[2], launch[3])
    )
    return min(2.0 * abs(inside) / max(abs(whole), 1e-300), 1.0)


@jit(forceinline=True)
def is_seen(terrain, place, back, out, leave_rate):
    """Whether no facet stands between a place and the source, nor on its light's way."""
    fate, _ = next_facet(terrain, None, None, place, back, leave_rate)
    if fate != ESCAPED:
        return False
    fate, _ = next_facet(terrain, None, None, place, out, leave_rate)
    return fate == ESCAPED


@jit(forceinline=True)
def points_seen(terrain, i, j, facet, back, out, leave_rate):
    """Count the points of a facet that are seen."""
    count = 0
    for point in range(N_POINTS):
        u, v = point_of_facet(facet, point)
        count += is_seen(
            terrain, place_on(terrain, i, j, facet, u, v), back, out, leave_rate
        )
    return count


@jit(forceinline=True)
def write_look(rows, row, bin_, label, flux, cos_beta, turn_in, turn_out):
    """Write what shading a facet takes."""
    rows[row, L_THETA], rows[row, L_DPHI] = bin_
    rows[row, L_LABEL] = label
    rows[row, L_FLUX] = flux
    rows[row, L_COS] = cos_beta
    rows[row, L_IN_C], rows[row, L_IN_S] = turn_in
    rows[row, L_OUT_C], rows[row, L_OUT_S] = turn_out


@jit(forceinline=True)
def shade_row(rows, row, w, slot, optics, flux, mueller):
    """Add the light of a facet to its bin."""
    a, b = int(rows[row, L_THETA]), int(rows[row, L_DPHI])
    m, n_stokes = int(rows[row, L_LABEL]), optics.n_stokes
    elements = reflection_elements(rows[row, L_COS], optics.n[w, m], optics.kappa[w, m])
    reflect_once(
        elements, (rows[row, L_IN_C], rows[row, L_IN_S]),
        (rows[row, L_OUT_C], rows[row, L_OUT_S]), n_stokes, mueller,
    )  # fmt: skip
    for e in range(n_stokes):
        for f in range(n_stokes):
            flux[slot, 0, a, b, e, f] += rows[row, L_FLUX] * mueller[e, f]


@jit(allocates=False)
def shade_looks(rows, w, slot, optics, flux, mueller):
    """Add the light of all looks (looks, N_LOOK) at a wavelength to a slot of the flux."""
    for row in range(rows.shape[0]):
        shade_row(rows, row, w, slot, optics, flux, mueller)


@jit(forceinline=True)
def is_steep(terrain, k):
    """Whether a ray rises more steeply than every facet, so that it meets none."""
    level = k.x * k.x + k.y * k.y
    return k.z > 0.0 and k.z * k.z >= terrain.steepest * terrain.steepest * level


@jit(allocates=False)
def add_facets(terrain, source, edges, optics, seen, row, flux, mueller, sums):
    """Sum up the light of all facets of a map by what their points tell.

    source      of one direction, without width
    seen        points seen of each facet (cells along x, cells along y, 2), written
    row         room for one look (1, N_LOOK)
    flux        (wavelengths, 1, n_theta, n_dphi, stokes, stokes), added to
    sums        `FacetSums`, added to

    Returns whether all of every facet is seen, for certain.
    """
    zenith, azimuth = edges
    nx, ny = cell_counts(terrain)
    light = line_beam(0, source)
    k = way_of(light)
    back = opposite(k)
    certain = terrain.periodic and is_steep(terrain, back)
    for i in range(nx):
        for j in range(ny):
            for facet in range(FACET_HIGH + 1):
                seen[i, j, facet] = 0
                u, v = point_of_facet(facet, 0)
                place = place_on(terrain, i, j, facet, u, v)
                normal, steep = normal_of_facet(terrain, None, place)
                r, s, cos_beta, turn_in = bounce_at(k, light.s, normal)
                certain = certain and is_steep(terrain, r)
                # What is mirrored downwards meets another facet
                if dot(back, normal) <= 0.0 or r.z <= 0.0:
                    continue
                lit = lit_share(terrain, source, i, j, facet, back)
                if lit == 0.0:
                    continue
                a, b = bin_of_direction(
                    r.x, r.y, r.z, light.cos_phi, light.sin_phi, zenith, azimuth
                )
                share = lit * flux_through(terrain, source, cos_beta, steep)
                sums.whole[a, b] += share
                sums.number[a, b] += 1.0
                count = points_seen(terrain, i, j, facet, back, r, cos_beta * steep)
                seen[i, j, facet] = count
                if 0 < count < N_POINTS:
                    sums.partly[a, b] += share
                if count == 0:
                    continue
                share *= count / N_POINTS
                sums.seen[a, b] += share
                write_look(
                    row, 0, (a, b), label_of_facet(terrain, None, place), share, cos_beta,
                    turn_in, exit_turn(r, s, light.cos_phi, light.sin_phi),
                )  # fmt: skip
                for w in range(flux.shape[0]):
                    shade_row(row, 0, w, w, optics, flux, mueller)
    return certain


@jit(allocates=False)
def look_at_map(terrain, source, edges, seen, start, count, rows):
    """Look at random points of a map for what the points of its facets have amiss.

    seen        points seen of each facet, as from `add_facets`
    start       where the points begin (2,), in [0, 1)
    count       how many
    rows        looks that differ (points, N_LOOK), written

    Returns how many rows are written.
    """
    zenith, azimuth = edges
    nx, ny = cell_counts(terrain)
    light = line_beam(0, source)
    k = way_of(light)
    back = opposite(k)
    found = 0
    scale = 2.0 * nx * ny / count
    for number in range(count):
        x = nx * fraction(number * PLASTIC_A + start[0])
        y = ny * fraction(number * PLASTIC_B + start[1])
        i, j = min(int(x), nx - 1), min(int(y), ny - 1)
        u, v = x - i, y - j
        facet = FACET_LOW if u > v else FACET_HIGH
        place = place_on(terrain, i, j, facet, u, v)
        normal, steep = normal_of_facet(terrain, None, place)
        r, s, cos_beta, turn_in = bounce_at(k, light.s, normal)
        if dot(back, normal) <= 0.0 or r.z <= 0.0:
            continue
        if not is_lit(terrain, source, place, back):
            continue
        amiss = is_seen(terrain, place, back, r, cos_beta * steep)
        amiss = amiss - seen[i, j, facet] / N_POINTS
        if amiss == 0.0:
            continue
        share = scale * flux_through(terrain, source, cos_beta, steep)
        write_look(
            rows, found, bin_of_direction(
                r.x, r.y, r.z, light.cos_phi, light.sin_phi, zenith, azimuth
            ), label_of_facet(terrain, None, place), share * amiss, cos_beta, turn_in,
            exit_turn(r, s, light.cos_phi, light.sin_phi),
        )  # fmt: skip
        found += 1
    return found
