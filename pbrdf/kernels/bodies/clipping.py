"""Volume of a body of revolution above a triangulated height field.

Over one azimuth the water is a region of the (r, z) half-plane, between the surface from
below and the profile of the body from outside. Green's theorem turns its share of the
volume, the integral of r dr dz, into one of r²/2 dz along its rim: a cubic on each slab of
the body, where r² = a + b s + c s², and on each facet, where z is linear in r. So every
azimuth is exact for any body of slabs, also at its equator; only the sum over azimuths is
a quadrature, by the trapezoidal rule, which suits periodic functions.
"""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.bodies.profile import (
    FAR,
    HIGH,
    deepest_inside,
    moment_between,
    profile_crossing,
    radius_squared,
    widest_above,
)
from pbrdf.kernels.terrain.heightfield import (
    FACET_HIGH,
    FACET_LOW,
    corner_heights,
    plane_height,
)

SOLVER_STEPS = 80
# An excess of the smaller volume that one step of Newton's rule brings down to rounding: it
# falls with its square
LAST_STEP = 5e-6
# How often to look for the lowest point near a body in an ever smaller circle
FLOORS = 3
CIRCLE = 16


@jit(inline="always")
def surface_height(heights, periodic, pitch_x, pitch_y, x, y):
    """Height of the facets at (x, y); beyond the rim of a finite map that of the rim."""
    nx, ny = heights.shape
    u = x / pitch_x
    v = y / pitch_y
    if periodic:
        u -= math.floor(u / nx) * nx
        v -= math.floor(v / ny) * ny
        i = min(int(u), nx - 1)
        j = min(int(v), ny - 1)
    else:
        u = min(max(u, 0.0), nx - 1.0)
        v = min(max(v, 0.0), ny - 1.0)
        i = min(int(u), nx - 2)
        j = min(int(v), ny - 2)
    z00, z10, z01, z11 = corner_heights(heights, i, j, periodic)
    facet = FACET_LOW if u - i > v - j else FACET_HIGH
    return plane_height(z00, z10, z01, z11, facet, u - i, v - j)


@jit(inline="always")
def part_inside(r_a, s_a, r_b, s_b):
    """Rim integral of r²/2 dz, and of r dr, along a straight part of the surface."""
    slope = (s_b - s_a) / (r_b - r_a) if r_b > r_a else 0.0
    moment = slope * (r_b - r_a) * (r_a * r_a + r_a * r_b + r_b * r_b) / 6.0
    return moment, 0.5 * (r_b - r_a) * (r_b + r_a)


@jit(part=True, allocates=False)
def azimuth_share(
    heights, periodic, pitch_x, pitch_y, slabs, x, y, z, k_x, k_y, reach
):  # fmt: skip
    """Volume above the surface and wetted area of a body, per radian of azimuth.

    Returns them and the distance of the outermost wetted point.
    """
    # Distances at which the ray meets the next line of the grid: x, y and diagonal
    per_x = pitch_x / abs(k_x) if k_x != 0.0 else FAR
    per_y = pitch_y / abs(k_y) if k_y != 0.0 else FAR
    turn = k_x / pitch_x - k_y / pitch_y
    per_d = 1.0 / abs(turn) if turn != 0.0 else FAR
    u, v = x / pitch_x, y / pitch_y
    d = u - v
    next_x = (math.floor(u) + 1.0 - u if k_x > 0.0 else u - math.ceil(u) + 1.0) * per_x
    next_y = (math.floor(v) + 1.0 - v if k_y > 0.0 else v - math.ceil(v) + 1.0) * per_y
    next_d = (math.floor(d) + 1.0 - d if turn > 0.0 else d - math.ceil(d) + 1.0) * per_d

    r_a = 0.0
    s_a = surface_height(heights, periodic, pitch_x, pitch_y, x, y) - z
    inside = radius_squared(slabs, s_a) > 0.0
    # Where the surface leaves the body the profile above it begins, and it ends where the
    # surface enters; a body that floats over the axis has all of it
    top = slabs[slabs.shape[0] - 1, HIGH]
    volume = moment_between(slabs, -FAR, top) if s_a < top and not inside else 0.0
    wetted = 0.0
    outermost = 0.0
    while r_a < reach:
        r_b = min(min(next_x, next_y), min(next_d, reach))
        if next_x <= r_b:
            next_x += per_x
        if next_y <= r_b:
            next_y += per_y
        if next_d <= r_b:
            next_d += per_d
        if r_b <= r_a:
            continue
        s_b = surface_height(
            heights, periodic, pitch_x, pitch_y, x + r_b * k_x, y + r_b * k_y
        ) - z  # fmt: skip
        still = r_b < reach and radius_squared(slabs, s_b) > r_b * r_b
        if inside and still:
            moment, area = part_inside(r_a, s_a, r_b, s_b)
            volume += moment
            wetted += area
            outermost = r_b
        elif inside or still:
            share = profile_crossing(slabs, r_a, s_a, r_b, s_b)
            r = r_a + (r_b - r_a) * share
            s = s_a + (s_b - s_a) * share
            if inside:
                moment, area = part_inside(r_a, s_a, r, s)
                volume += moment_between(slabs, s, top)
                outermost = r
            else:
                moment, area = part_inside(r, s, r_b, s_b)
                volume -= moment_between(slabs, s, top)
                outermost = r_b
            volume += moment
            wetted += area
        else:
            share = deepest_inside(slabs, r_a, s_a, r_b, s_b)
            if share >= 0.0:
                r_m = r_a + (r_b - r_a) * share
                s_m = s_a + (s_b - s_a) * share
                share = profile_crossing(slabs, r_m, s_m, r_a, s_a)
                r_in = r_m + (r_a - r_m) * share
                s_in = s_m + (s_a - s_m) * share
                share = profile_crossing(slabs, r_m, s_m, r_b, s_b)
                r_out = r_m + (r_b - r_m) * share
                s_out = s_m + (s_b - s_m) * share
                moment, area = part_inside(r_in, s_in, r_out, s_out)
                volume += moment
                # Signed: on its way the surface may fall or rise
                volume += moment_between(slabs, s_out, s_in)
                volume -= moment_between(slabs, s_in, s_out)
                wetted += area
                outermost = r_out
        r_a, s_a, inside = r_b, s_b, still
    return volume, wetted, outermost


@jit(allocates=False)
def mean_near(heights, periodic, pitch_x, pitch_y, x, y, radius):
    """Mean height of the surface on a circle about (x, y)."""
    total = 0.0
    for k in range(CIRCLE):
        turn = 2.0 * math.pi * k / CIRCLE
        total += surface_height(
            heights, periodic, pitch_x, pitch_y,
            x + radius * math.cos(turn), y + radius * math.sin(turn),
        )  # fmt: skip
    return total / CIRCLE


@jit(part=True, allocates=False)
def lowest_near(heights, periodic, pitch_x, pitch_y, x, y, reach):
    """Lowest node of all facets nearer to (x, y) than `reach`."""
    nx, ny = heights.shape
    first_i = math.floor((x - reach) / pitch_x)
    last_i = math.floor((x + reach) / pitch_x) + 1
    first_j = math.floor((y - reach) / pitch_y)
    last_j = math.floor((y + reach) / pitch_y) + 1
    if periodic:
        last_i, last_j = min(last_i, first_i + nx - 1), min(last_j, first_j + ny - 1)
    else:
        first_i, first_j = max(first_i, 0), max(first_j, 0)
        last_i, last_j = min(last_i, nx - 1), min(last_j, ny - 1)
    lowest = FAR
    for i in range(first_i, last_i + 1):
        row = i - (i // nx) * nx
        for j in range(first_j, last_j + 1):
            lowest = min(lowest, heights[row, j - (j // ny) * ny])
    return lowest


@jit(allocates=False)
def volume_above(heights, periodic, pitch_x, pitch_y, z_min, slabs, x, y, z, azimuths):
    """Volume of a body above the surface and the area it wets, seen from above.

    (x, y) is its axis, z its reference height and z_min the lowest point of the surface.
    Returns them and the distance from the axis to the outermost wetted point.
    """
    # Beyond its radius at the lowest point near it a body is below the surface
    reach = widest_above(slabs, z_min - z) * (1.0 + 1e-12)
    for _ in range(FLOORS):
        floor = lowest_near(heights, periodic, pitch_x, pitch_y, x, y, reach)
        reach = min(reach, widest_above(slabs, floor - z) * (1.0 + 1e-12))
    volume = 0.0
    wetted = 0.0
    outermost = 0.0
    step = 2.0 * math.pi / azimuths
    for k in range(azimuths):
        k_x = math.cos((k + 0.5) * step)
        k_y = math.sin((k + 0.5) * step)
        share, area, rim = azimuth_share(
            heights, periodic, pitch_x, pitch_y, slabs, x, y, z, k_x, k_y, reach
        )
        volume += share
        wetted += area
        outermost = max(outermost, rim)
    return volume * step, wetted * step, outermost


@jit(allocates=False)
def settled_height(
    heights, periodic, pitch_x, pitch_y, z_min, slabs, x, y, above, sunk, low, high,
    start, azimuths,
):  # fmt: skip
    """Find the reference height in [low, high] that parts the body as on a plane.

    `above` and `sunk` are its volumes above and below the plane; the smaller one decides.
    The search begins at `start`.
    Returns the height, the volume above, the wetted area and its outermost distance.
    """
    whole = above + sunk
    z = start
    volume = 0.0
    wetted = 0.0
    rim = 0.0
    for _ in range(SOLVER_STEPS):
        volume, wetted, rim = volume_above(
            heights, periodic, pitch_x, pitch_y, z_min, slabs, x, y, z, azimuths
        )
        excess = above - volume if above < sunk else (whole - volume) - sunk
        if abs(excess) <= LAST_STEP * min(above, sunk) and wetted > 0.0:
            return z + excess / wetted, volume + excess, wetted, rim
        enough = abs(excess) <= 1e-15 * whole
        if enough or high - low <= 1e-15 * (abs(low) + abs(high)):
            break
        if excess > 0.0:
            low = z
        else:
            high = z
        # Raising the body by dz lifts the wetted area out: Newton, kept in its bracket
        z = z + excess / wetted if wetted > 0.0 else low
        if not low < z < high:
            z = 0.5 * (low + high)
    return z, volume, wetted, rim
