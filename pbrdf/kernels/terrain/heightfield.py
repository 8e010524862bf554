"""Exact walk of a ray over a triangulated height field.

The field is a grid of cells, each split along the diagonal u = v into two facets. Positions
are counted in cells along x and y, heights in the unit of the caller; `speed` is the ray
direction in those units, so a point of the ray is start + t * speed. A pyramid of block
maxima lets a ray skip every block that it passes above.

On its way through neighbouring cells the walk carries the clearance of the ray above the
surface from facet to facet. A hit is a change of its sign, so that no ray can slip through
an edge or a vertex, and a ray that starts on a facet needs no offset: its clearance there
is t times its speed away from the facet, without cancellation.
"""

import math
from collections import namedtuple

import numpy as np

from pbrdf.kernels import jit
from pbrdf.kernels.terrain.horizon import is_free

ESCAPED, HIT, SIDE, LOST, REACHED = 0, 1, 2, 3, 4
FACET_LOW, FACET_HIGH = 0, 1  # the facet with u > v, and the one with u < v
UNKNOWN = -1.0  # a clearance that was not followed
NEVER = 1e300  # time per cell of a ray that does not move along an axis
START_LEVEL = 3  # blocks of 8 cells: where a ray from above starts to look


# A height field as the kernels take it: node heights, the pyramid of `block_maxima`, the
# highest node, the slope from which on a rising ray is free at once (inf: not to be used),
# the largest slope of a facet, whether the field repeats, the grid steps, the material of
# each cell (of no size: all 0) and what `pbrdf.kernels.terrain.horizon` knows (of no size:
# nothing)
Terrain = namedtuple(
    "Terrain",
    "heights maxima levels z_top free_slope steepest periodic pitch_x pitch_y labels "
    "horizon",
)


def block_maxima(heights, periodic):
    """Maximum height over blocks of 2, 4, 8 ... cells.

    Returns the levels one after another in a flat array, level 1 first, and the table
    (offset, blocks along y) of each level, shape (levels, 2).
    """
    nx, ny = heights.shape
    if not periodic:
        nx, ny = nx - 1, ny - 1
    depth = 1
    while max(nx, ny) > 2 << depth:
        depth += 1
    levels = np.empty((depth, 2), dtype=np.int64)
    size = 0
    for level in range(depth):
        levels[level] = size, (ny + (2 << level) - 1) >> (level + 1)
        size += ((nx + (2 << level) - 1) >> (level + 1)) * int(levels[level, 1])
    maxima = np.full(size, -np.inf)
    fill_maxima(heights, periodic, levels, maxima)
    return maxima, levels


@jit(allocates=False)
def fill_maxima(heights, periodic, levels, maxima):
    """Find the maxima of `block_maxima`."""
    nx, ny = grid_cells(heights, periodic)
    row = levels[0, 1]
    for i in range(nx):
        for j in range(ny):
            z00, z10, z01, z11 = corner_heights(heights, i, j, periodic)
            block = (i >> 1) * row + (j >> 1)
            maxima[block] = max(maxima[block], max(max(z00, z10), max(z01, z11)))
    for level in range(1, levels.shape[0]):
        below, row_below = levels[level - 1, 0], levels[level - 1, 1]
        offset, row = levels[level, 0], levels[level, 1]
        for k in range(offset - below):
            block = offset + (k // row_below >> 1) * row + (k % row_below >> 1)
            maxima[block] = max(maxima[block], maxima[below + k])


@jit(forceinline=True)
def grid_cells(heights, periodic):
    """Count the cells along x and y between nodes."""
    nx, ny = heights.shape
    if periodic:
        return nx, ny
    return nx - 1, ny - 1


@jit(forceinline=True)
def cell_counts(terrain):
    """Count the cells along x and y."""
    return grid_cells(terrain.heights, terrain.periodic)


@jit(forceinline=True)
def corner_heights(heights, i, j, periodic):
    """Heights of the corners (i, j), (i+1, j), (i, j+1), (i+1, j+1) of a cell."""
    i1 = i + 1
    j1 = j + 1
    if periodic:
        if i1 == heights.shape[0]:
            i1 = 0
        if j1 == heights.shape[1]:
            j1 = 0
    return heights[i, j], heights[i1, j], heights[i, j1], heights[i1, j1]


@jit(forceinline=True)
def block_top(maxima, levels, level, i, j):
    """Highest point of the block of a level, from 1 on, around cell (i, j)."""
    offset, row = levels[level - 1]
    return maxima[offset + (i >> level) * row + (j >> level)]


@jit(forceinline=True)
def steps_of(z00, z10, z01, z11, facet):
    """Height step per cell along x and y on one facet, from the corner heights."""
    if facet == FACET_LOW:
        return z10 - z00, z11 - z10
    return z11 - z01, z01 - z00


@jit(forceinline=True)
def facet_steps(terrain, i, j, facet):
    """Height step per cell along x and y on one facet of cell (i, j)."""
    z00, z10, z01, z11 = corner_heights(terrain.heights, i, j, terrain.periodic)
    return steps_of(z00, z10, z01, z11, facet)


@jit(forceinline=True)
def squared_slopes(heights, i, j, periodic, pitch_x, pitch_y):
    """Squares of the slopes of both facets of a cell, along their steepest ascent."""
    z00, z10, z01, z11 = corner_heights(heights, i, j, periodic)
    low_x, low_y = steps_of(z00, z10, z01, z11, FACET_LOW)
    high_x, high_y = steps_of(z00, z10, z01, z11, FACET_HIGH)
    return (
        (low_x / pitch_x) ** 2 + (low_y / pitch_y) ** 2,
        (high_x / pitch_x) ** 2 + (high_y / pitch_y) ** 2,
    )


@jit(forceinline=True)
def facet_slopes(terrain, i, j, facet):
    """Slopes dz/dx and dz/dy of one facet of cell (i, j)."""
    step_x, step_y = facet_steps(terrain, i, j, facet)
    return step_x * (1.0 / terrain.pitch_x), step_y * (1.0 / terrain.pitch_y)


@jit(forceinline=True)
def plane_height(z00, z10, z01, z11, facet, u, v):
    """Height of one facet's plane at (u, v) of its cell, from the corner heights."""
    if facet == FACET_LOW:
        return z00 + (z10 - z00) * u + (z11 - z10) * v
    return z00 + (z11 - z01) * u + (z01 - z00) * v


@jit(forceinline=True)
def zero_between(t_a, t_b, clear_a, clear_b):
    """Time at which a clearance that is linear between two times reaches zero."""
    return min(max(t_a + (t_b - t_a) * (clear_a / (clear_a - clear_b)), t_a), t_b)


@jit(allocates=False)
def fall(heights, periodic, i, j, u, v, z, speed_z, t_limit):
    """Fate of a vertical ray, as from `walk_until`."""
    if speed_z >= 0.0:
        fate = ESCAPED if t_limit == NEVER else REACHED
        return fate, i, j, -1, u, v, z + speed_z * t_limit, t_limit
    z00, z10, z01, z11 = corner_heights(heights, i, j, periodic)
    facet = FACET_LOW if u > v else FACET_HIGH
    surface = plane_height(z00, z10, z01, z11, facet, u, v)
    t = max((surface - z) / speed_z, 0.0)
    if t > t_limit:
        return REACHED, i, j, -1, u, v, z + speed_z * t_limit, t_limit
    return HIT, i, j, facet, u, v, surface, t


@jit(forceinline=True)
def walk_until(
    terrain, i, j, facet, u, v, z, speed_x, speed_y, speed_z, leave_rate, t_limit, max_steps
):  # fmt: skip
    """Follow a ray from (u, v) of cell (i, j) at height z to the next facet it meets.

    With facet >= 0 the ray starts on that facet and leaves it at `leave_rate` > 0 per unit
    of t; with -1 it starts in free space. Beyond t_limit nothing matters: the fate is then
    REACHED, or ESCAPED. Returns (fate, i, j, facet, u, v, z, t).

    One loop in one function on purpose: every step decides between blocks, cells and
    facets, and what a part of its own would have to be told and to return costs as much as
    the step.
    """
    heights, maxima, levels = terrain.heights, terrain.maxima, terrain.levels
    periodic, z_top = terrain.periodic, terrain.z_top
    nx, ny = cell_counts(terrain)
    if speed_x == 0.0 and speed_y == 0.0:
        return fall(heights, periodic, i, j, u, v, z, speed_z, t_limit)

    # The ray in the plane is x0 + speed_x t; x0 moves back by a period at each wrap
    x0 = i + u
    y0 = j + v
    forward_x = speed_x >= 0.0
    forward_y = speed_y >= 0.0
    per_x = 1.0 / speed_x if speed_x != 0.0 else NEVER
    per_y = 1.0 / speed_y if speed_y != 0.0 else NEVER
    rising = speed_z >= 0.0
    t = 0.0
    clear = UNKNOWN
    level = 0 if facet >= 0 else min(START_LEVEL, levels.shape[0])

    for _ in range(max_steps):
        # Above the highest peak a rising ray is free
        z_in = z + speed_z * t
        if rising and z_in > z_top:
            return ESCAPED, i, j, -1, u, v, z_in, t
        if t > t_limit:
            return REACHED, i, j, -1, u, v, z_in, t

        # Look closer unless the ray passes above the whole block: one that rises does so if
        # it is above where it enters
        if rising:
            while level > 0 and z_in <= block_top(maxima, levels, level, i, j):
                level -= 1

        # Where and when the ray leaves the present block
        low_x = (i >> level) << level
        low_y = (j >> level) << level
        high_x = min(low_x + (1 << level), nx)
        high_y = min(low_y + (1 << level), ny)
        t_x = ((high_x if forward_x else low_x) - x0) * per_x
        t_y = ((high_y if forward_y else low_y) - y0) * per_y
        t_out = max(min(t_x, t_y), t)
        z_out = z + speed_z * t_out
        lowest = z_in if rising else z_out

        if level > 0:
            if not rising and z_out <= block_top(maxima, levels, level, i, j):
                level -= 1
                continue
            clear = UNKNOWN
        else:
            z00, z10, z01, z11 = corner_heights(heights, i, j, periodic)
            if facet < 0 and lowest > max(max(z00, z10), max(z01, z11)):
                clear = UNKNOWN
            else:
                # Places where the ray enters and leaves the cell; u - v tells the facet
                u_in = x0 + speed_x * t - i
                v_in = y0 + speed_y * t - j
                u_out = x0 + speed_x * t_out - i
                v_out = y0 + speed_y * t_out - j
                side_in = u_in - v_in
                side_out = u_out - v_out
                if facet >= 0:
                    first = facet
                    split = side_out < 0.0 if facet == FACET_LOW else side_out > 0.0
                else:
                    split = side_in * side_out < 0.0
                    side = side_in if split else side_in + side_out
                    first = FACET_LOW if side > 0.0 else FACET_HIGH

                # Through the first facet, to the diagonal or out of the cell
                t_mid = t_out
                if split and side_in != side_out:
                    share = min(max(side_in / (side_in - side_out), 0.0), 1.0)
                    t_mid = t + (t_out - t) * share
                if facet >= 0:
                    # A plane just left is not met again
                    clear_mid = t_mid * leave_rate
                    facet = -1
                else:
                    if clear < 0.0:
                        surface = plane_height(z00, z10, z01, z11, first, u_in, v_in)
                        clear = max(z_in - surface, 0.0)
                    u_mid = x0 + speed_x * t_mid - i
                    v_mid = y0 + speed_y * t_mid - j
                    surface = plane_height(z00, z10, z01, z11, first, u_mid, v_mid)
                    clear_mid = z + speed_z * t_mid - surface
                    # A facet met at a corner only, and moved away from, is no hit
                    if clear_mid <= 0.0 and clear_mid < clear:
                        t_hit = zero_between(t, t_mid, clear, clear_mid)
                        if t_hit > t_limit:
                            return REACHED, i, j, -1, u, v, z_out, t_limit
                        u = x0 + speed_x * t_hit - i
                        v = y0 + speed_y * t_hit - j
                        return HIT, i, j, first, u, v, z + speed_z * t_hit, t_hit
                clear = clear_mid

                # Through the second facet, if the ray crosses the diagonal
                if split:
                    second = 1 - first
                    surface = plane_height(z00, z10, z01, z11, second, u_out, v_out)
                    clear = z_out - surface
                    if clear <= 0.0 and clear < clear_mid:
                        t_hit = zero_between(t_mid, t_out, clear_mid, clear)
                        if t_hit > t_limit:
                            return REACHED, i, j, -1, u, v, z_out, t_limit
                        u = x0 + speed_x * t_hit - i
                        v = y0 + speed_y * t_hit - j
                        return HIT, i, j, second, u, v, z + speed_z * t_hit, t_hit

        # Step over the edge into the next block; inside a block keep to its rows
        if t_x <= t_y:
            i = high_x if forward_x else low_x - 1
            if level > 0:
                j = min(max(int(y0 + speed_y * t_out), low_y), high_y - 1)
        else:
            j = high_y if forward_y else low_y - 1
            if level > 0:
                i = min(max(int(x0 + speed_x * t_out), low_x), high_x - 1)
        if i < 0 or i >= nx or j < 0 or j >= ny:
            if not periodic:
                # Beyond the rim the surface is taken to be no higher and no steeper
                level_x = speed_x * terrain.pitch_x
                level_y = speed_y * terrain.pitch_y
                reach = math.sqrt(level_x * level_x + level_y * level_y)
                above = rising and z_out >= z_top
                fate = ESCAPED if above or speed_z >= terrain.steepest * reach else SIDE
                return fate, i, j, -1, u, v, z_out, t_out
            if i < 0:
                i += nx
                x0 += nx
            elif i >= nx:
                i -= nx
                x0 -= nx
            if j < 0:
                j += ny
                y0 += ny
            elif j >= ny:
                j -= ny
                y0 -= ny
        t = t_out
        if clear < 0.0 and level < levels.shape[0]:
            level += 1
    return LOST, i, j, -1, u, v, z + speed_z * t, t


@jit(forceinline=True)
def walk(terrain, i, j, facet, u, v, z, speed_x, speed_y, speed_z, leave_rate, max_steps):
    """`walk_until` without a limit: (fate, i, j, facet, u, v, z)."""
    fate, i, j, facet, u, v, z, _ = walk_until(
        terrain, i, j, facet, u, v, z, speed_x, speed_y, speed_z, leave_rate, NEVER,
        max_steps,
    )  # fmt: skip
    return fate, i, j, facet, u, v, z


@jit(forceinline=True)
def rises_free(terrain, i, j, z, k_x, k_y, k_z):
    """Whether a ray along the unit vector k from the surface in cell (i, j) must escape.

    One that rises more steeply than any facet can meet none, nor one that rises above all
    that lies ahead.
    """
    free_slope = terrain.free_slope
    if k_z > 0.0 and k_z * k_z >= free_slope * free_slope * (k_x * k_x + k_y * k_y):
        return True
    if terrain.horizon.size == 0:
        return False
    return is_free(
        terrain.horizon, terrain.z_top, i, j, z, k_x * (1.0 / terrain.pitch_x),
        k_y * (1.0 / terrain.pitch_y), k_z,
    )  # fmt: skip


@jit(forceinline=True)
def leave_facet(terrain, i, j, facet, u, v, z, k_x, k_y, k_z, leave_rate, max_steps):
    """Follow a ray along the unit vector k from a facet to the next one it meets."""
    if rises_free(terrain, i, j, z, k_x, k_y, k_z):
        return ESCAPED, i, j, -1, u, v, z
    speed_x = k_x * (1.0 / terrain.pitch_x)
    speed_y = k_y * (1.0 / terrain.pitch_y)
    return walk(terrain, i, j, facet, u, v, z, speed_x, speed_y, k_z, leave_rate, max_steps)
