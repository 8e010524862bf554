"""Sums over all facets of a height field: how steep, how large, how far under a level."""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.terrain.heightfield import corner_heights, grid_cells, squared_slopes


@jit(inline="always")
def filled_triangle(level, z_a, z_b, z_c):
    """Mean depth below a level over a triangle, and the share of it that is below."""
    low = min(z_a, min(z_b, z_c))
    high = max(z_a, max(z_b, z_c))
    middle = z_a + z_b + z_c - low - high
    if level >= high:
        return level - (z_a + z_b + z_c) / 3.0, 1.0
    if level <= low:
        return 0.0, 0.0
    if level <= middle:
        # A small triangle at the lowest corner
        share = (level - low) ** 2 / ((middle - low) * (high - low))
        return share * (level - low) / 3.0, share
    # All but a small triangle at the highest corner, where the depth would be negative
    dry = (high - level) ** 2 / ((high - middle) * (high - low))
    depth = level - (z_a + z_b + z_c) / 3.0 + dry * (high - level) / 3.0
    return depth, 1.0 - dry


@jit(allocates=False)
def filled_volume(heights, periodic, pitch_x, pitch_y, level):
    """Volume between the surface and a level above it, and the area that is wet."""
    nx, ny = grid_cells(heights, periodic)
    volume = 0.0
    wet = 0.0
    for i in range(nx):
        for j in range(ny):
            z00, z10, z01, z11 = corner_heights(heights, i, j, periodic)
            depth, share = filled_triangle(level, z00, z10, z11)
            volume += depth
            wet += share
            depth, share = filled_triangle(level, z00, z01, z11)
            volume += depth
            wet += share
    half = 0.5 * pitch_x * pitch_y
    return volume * half, wet * half


@jit(allocates=False)
def steepest_slope(heights, periodic, pitch_x, pitch_y):
    """Largest slope of any facet, in its own direction of steepest ascent."""
    nx, ny = grid_cells(heights, periodic)
    largest = 0.0
    for i in range(nx):
        for j in range(ny):
            low, high = squared_slopes(heights, i, j, periodic, pitch_x, pitch_y)
            largest = max(largest, max(low, high))
    return math.sqrt(largest)


@jit(allocates=False)
def area_ratio(heights, periodic, pitch_x, pitch_y):
    """Area of all facets over the area seen from above."""
    nx, ny = grid_cells(heights, periodic)
    total = 0.0
    for i in range(nx):
        for j in range(ny):
            low, high = squared_slopes(heights, i, j, periodic, pitch_x, pitch_y)
            total += math.sqrt(1.0 + low)
            total += math.sqrt(1.0 + high)
    return total / (2.0 * nx * ny)


@jit(allocates=False)
def steep_share(heights, periodic, pitch_x, pitch_y, slope):
    """Share of the facets, by area seen from above, that are steeper than a slope."""
    nx, ny = grid_cells(heights, periodic)
    count = 0
    for i in range(nx):
        for j in range(ny):
            low, high = squared_slopes(heights, i, j, periodic, pitch_x, pitch_y)
            count += (low > slope * slope) + (high > slope * slope)
    return count / (2.0 * nx * ny)
