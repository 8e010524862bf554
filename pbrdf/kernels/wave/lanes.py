"""Amplitudes of many geometries side by side, and what curvature changes in them.

Geometries lie in rows of `LANES` numbers of one flat array. A loop over them becomes vector
instructions because the place of every row is a constant and no branch is left; the same
arithmetic one by one takes three times as long.
"""

from math import sqrt

from pbrdf.kernels import jit
from pbrdf.kernels.optics.elementary import cos, sin
from pbrdf.kernels.wave.amplitudes import (
    LEAST_COSINE,
    Ray,
    difference,
    first_order,
    lateral_ray,
    medium_of,
    tangent_plane,
    turned,
)

__all__ = [
    "HORIZON",
    "LANES",
    "PAIR",
    "ROWS",
    "fill_amplitudes",
    "fill_node_changes",
    "jones_of",
    "rays_of",
    "set_lane",
]

# Geometries side by side
LANES = 64
# Rows of a geometry: sine and cosine of the zenith of the way in and out, direction of the
# way out, rms wave vector of the heights over k, n and kappa
ROWS = 9
SIN_IN, COS_IN, SIN_OUT, COS_OUT = 0 * LANES, 1 * LANES, 2 * LANES, 3 * LANES
ALONG, ACROSS, SPREAD = 4 * LANES, 5 * LANES, 6 * LANES
INDEX, ABSORPTION = 7 * LANES, 8 * LANES
# Rows of two Jones matrices (real and imaginary parts of ss, sp, ps, pp): of both kernels,
# or of a node and its opposite
PAIR = 16

# Local wave vectors reach this share of the horizon, unless a ray given lies beyond
HORIZON = 0.97


@jit(forceinline=True)
def reach_of_shift(ray_in, ray_out, x, y):
    """Share of a shift that keeps both waves from the horizon; 1 of one that is small.

    Of the share t where one of them would reach it, (1 + t^-8)^(-1/8): a step would show as
    a kink wherever a surface or wavelength brings waves there.
    """
    middle_x = 0.5 * (ray_out.sin * ray_out.along + ray_in.sin * ray_in.along)
    middle_y = 0.5 * (ray_out.sin * ray_out.across + ray_in.sin * ray_in.across)
    rim = max(HORIZON, max(ray_in.sin, ray_out.sin))
    square = 0.25 * (x * x + y * y)
    along = 0.5 * abs(middle_x * x + middle_y * y)
    room = rim * rim - middle_x * middle_x - middle_y * middle_y
    # square t^2 + 2 along t = room, the worse sign of the two
    inverse = (along + sqrt(along * along + square * room)) / (room + 1e-300)
    fourth = inverse * inverse * inverse * inverse
    return 1.0 / sqrt(sqrt(sqrt(1.0 + fourth * fourth)))


@jit(forceinline=True)
def wave_vector(ray_in, ray_out, spread, u, v, plane):
    """Wave vector of node (u, v) of the spectrum, bounded by the horizon.

    In the plane u is along the mean of the two rays: exchanging them leaves the hexagon of
    nodes as it is.
    """
    mean_x = ray_out.sin * ray_out.along + ray_in.sin * ray_in.along
    mean_y = ray_out.sin * ray_out.across + ray_in.sin * ray_in.across
    length = sqrt(mean_x * mean_x + mean_y * mean_y)
    turns = plane and length > 1e-9
    cos_m = mean_x / length if turns else 1.0
    sin_m = mean_y / length if turns else 0.0
    x, y = spread * (cos_m * u - sin_m * v), spread * (sin_m * u + cos_m * v)
    share = reach_of_shift(ray_in, ray_out, x, y)
    return share * x, share * y


@jit(forceinline=True)
def set_lane(lanes, lane, theta_i, theta_s, dphi, spread, n, kappa):
    """Write a geometry into a lane."""
    lanes[SIN_IN + lane], lanes[COS_IN + lane] = (
        sin(theta_i),
        max(cos(theta_i), LEAST_COSINE),
    )
    lanes[SIN_OUT + lane] = sin(theta_s)
    lanes[COS_OUT + lane] = max(cos(theta_s), LEAST_COSINE)
    # Propagation turns by dphi - pi
    lanes[ALONG + lane], lanes[ACROSS + lane] = -cos(dphi), -sin(dphi)
    lanes[SPREAD + lane], lanes[INDEX + lane], lanes[ABSORPTION + lane] = spread, n, kappa


@jit(forceinline=True)
def rays_of(lanes, lane):
    """Ways in and out of a lane."""
    ray_in = Ray(lanes[SIN_IN + lane], lanes[COS_IN + lane], 1.0, 0.0)
    ray_out = Ray(
        lanes[SIN_OUT + lane], lanes[COS_OUT + lane],
        lanes[ALONG + lane], lanes[ACROSS + lane],
    )  # fmt: skip
    return ray_in, ray_out


@jit(forceinline=True)
def set_jones(rows, row, lane, jones):
    """Write a Jones matrix into eight rows."""
    for element in range(4):
        place = (row + 2 * element) * LANES + lane
        rows[place], rows[place + LANES] = jones[element].real, jones[element].imag


@jit(forceinline=True)
def jones_of(rows, row, lane):
    """Jones matrix of eight rows."""
    place = row * LANES + lane
    return (
        complex(rows[place], rows[place + LANES]),
        complex(rows[place + 2 * LANES], rows[place + 3 * LANES]),
        complex(rows[place + 4 * LANES], rows[place + 5 * LANES]),
        complex(rows[place + 6 * LANES], rows[place + 7 * LANES]),
    )


@jit(part=True, allocates=False)
def fill_amplitudes(lanes, rows):
    """Tangent-plane kernel in the first eight rows, first-order kernel in the next."""
    for lane in range(LANES):
        ray_in, ray_out = rays_of(lanes, lane)
        medium = medium_of(lanes[INDEX + lane], lanes[ABSORPTION + lane])
        set_jones(rows, 0, lane, tangent_plane(ray_in, ray_out, medium))
        set_jones(rows, 8, lane, first_order(ray_in, ray_out, medium))


@jit(part=True, allocates=False)
def fill_node_changes(lanes, u, v, plane, rows):
    """First-order less tangent-plane kernel for +-(u, v) times the spread of waves.

    Taken at the mean of the two lateral vectors, plus and minus half of it, turned into
    the frames of the rays given. The second has the rays exchanged: by reciprocity ss and
    pp are the same, sp and ps change places and sign.
    """
    for lane in range(LANES):
        ray_in, ray_out = rays_of(lanes, lane)
        medium = medium_of(lanes[INDEX + lane], lanes[ABSORPTION + lane])
        x, y = wave_vector(ray_in, ray_out, lanes[SPREAD + lane], u, v, plane)
        middle_x = 0.5 * (ray_out.sin * ray_out.along + ray_in.sin)
        middle_y = 0.5 * ray_out.sin * ray_out.across
        to = lateral_ray(middle_x + 0.5 * x, middle_y + 0.5 * y)
        come = lateral_ray(middle_x - 0.5 * x, middle_y - 0.5 * y)
        ss, sp, ps, pp = difference(come, to, medium)
        there = turned((ss, sp, ps, pp), ray_in, ray_out, come, to)
        back = turned((ss, -ps, -sp, pp), ray_in, ray_out, to, come)
        set_jones(rows, 0, lane, there)
        set_jones(rows, 8, lane, back)
