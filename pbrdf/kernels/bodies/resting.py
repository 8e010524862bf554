"""Where a sphere comes to rest on a triangulated height field."""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.bodies.profile import FAR
from pbrdf.kernels.terrain.heightfield import (
    FACET_HIGH,
    FACET_LOW,
    corner_heights,
    plane_height,
    steps_of,
)


@jit(part=True, allocates=False)
def edge_rest(z_a, z_b, off_x, off_y, step_x, step_y, radius):
    """Height of the centre of a sphere that lies on an edge, or -FAR if it touches none.

    The edge goes from (off_x, off_y), relative to the axis, by (step_x, step_y).
    """
    length = math.sqrt(step_x * step_x + step_y * step_y)
    slope = (z_b - z_a) / length
    along = (off_x * step_x + off_y * step_y) / length
    across = off_x * off_x + off_y * off_y - along * along
    room = radius * radius - across
    if room <= 0.0:
        return -FAR
    # Where the slope of the sphere's lower side is that of the edge
    place = math.sqrt(room) * slope / math.sqrt(1.0 + slope * slope)
    if place < along or place > along + length:
        return -FAR
    return z_a + (place - along) * slope + math.sqrt(room - place * place)


@jit(allocates=False)
def resting_height(heights, periodic, pitch_x, pitch_y, x, y, radius):
    """Height of the centre of a sphere about the axis (x, y) that rests on the facets.

    It touches a node, an edge or the inside of a facet: the highest of all candidates.
    """
    nx, ny = heights.shape
    first_i = math.floor((x - radius) / pitch_x)
    last_i = math.floor((x + radius) / pitch_x)
    first_j = math.floor((y - radius) / pitch_y)
    last_j = math.floor((y + radius) / pitch_y)
    if not periodic:
        first_i, first_j = max(first_i, 0), max(first_j, 0)
        last_i, last_j = min(last_i, nx - 2), min(last_j, ny - 2)
    best = -FAR
    for i in range(first_i, last_i + 1):
        for j in range(first_j, last_j + 1):
            z00, z10, z01, z11 = corner_heights(
                heights, i - (i // nx) * nx, j - (j // ny) * ny, periodic
            )
            a_x = i * pitch_x - x
            a_y = j * pitch_y - y
            b_x = a_x + pitch_x
            b_y = a_y + pitch_y
            # Nodes; their cell is the one beyond them, save on the far rim
            for p_x, p_y, z in (
                (a_x, a_y, z00), (b_x, a_y, z10), (a_x, b_y, z01), (b_x, b_y, z11),
            ):  # fmt: skip
                room = radius * radius - p_x * p_x - p_y * p_y
                if room >= 0.0:
                    best = max(best, z + math.sqrt(room))
            best = max(best, edge_rest(z00, z10, a_x, a_y, pitch_x, 0.0, radius))
            best = max(best, edge_rest(z00, z01, a_x, a_y, 0.0, pitch_y, radius))
            best = max(best, edge_rest(z00, z11, a_x, a_y, pitch_x, pitch_y, radius))
            best = max(best, edge_rest(z01, z11, a_x, b_y, pitch_x, 0.0, radius))
            best = max(best, edge_rest(z10, z11, b_x, a_y, 0.0, pitch_y, radius))
            # Facets, where the sphere's normal is theirs
            for facet in (FACET_LOW, FACET_HIGH):
                step_x, step_y = steps_of(z00, z10, z01, z11, facet)
                g_x, g_y = step_x / pitch_x, step_y / pitch_y
                stretch = math.sqrt(1.0 + g_x * g_x + g_y * g_y)
                p_x, p_y = radius * g_x / stretch, radius * g_y / stretch
                u, v = (p_x - a_x) / pitch_x, (p_y - a_y) / pitch_y
                on_it = u >= v if facet == FACET_LOW else v >= u
                if on_it and 0.0 <= u <= 1.0 and 0.0 <= v <= 1.0:
                    z = plane_height(z00, z10, z01, z11, facet, u, v)
                    best = max(best, z + radius / stretch)
    return best
