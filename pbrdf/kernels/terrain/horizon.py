"""What lies ahead of a ray that rises from a height field: proof that it meets nothing.

Blocks of 8 cells know, for each octant of directions, the steepest rise of the surface over
the blocks next to come and the highest points of those behind them. A ray that rises faster
than the first and passes above the others is free; nothing else about it need be known. In
units of cells the octant of a ray is told by the signs and the order of its two speeds, and
the rise of a facet per cell along the faster axis is linear between the two rims of the
octant, so that its largest value is exact.
"""

import numpy as np

from pbrdf.kernels import jit

SHIFT = 3
BLOCK = 1 << SHIFT
# Below this many blocks a side a ray may go round the period within what is looked at
LEAST_BLOCKS = 8
# A ray starts anywhere in block 0; the steepest rise holds over blocks 0 to NEAR, the
# highest points over those up to MIDDLE and up to FAR, then the highest of all
NEAR, MIDDLE, FAR = 1, 2, 4
STEEPEST, HIGHEST_MIDDLE, HIGHEST_FAR, N_AHEAD = 0, 1, 2, 3
# Rounding must not free a ray that grazes what lies ahead
MARGIN = 1e-9

NO_HORIZON = np.empty((0, 0, 0, N_AHEAD))


@jit(forceinline=True)
def octant(speed_x, speed_y):
    """Find the octant of a direction, in cells."""
    along_x = abs(speed_x) >= abs(speed_y)
    return (4 if along_x else 0) + (2 if speed_x < 0.0 else 0) + (1 if speed_y < 0.0 else 0)


@jit(forceinline=True)
def is_free(horizon, z_top, i, j, z, speed_x, speed_y, speed_z):
    """Whether a ray that rises from the surface in cell (i, j) is known to meet nothing."""
    main = max(abs(speed_x), abs(speed_y))
    o = octant(speed_x, speed_y)
    block_i = i >> SHIFT
    block_j = j >> SHIFT
    if speed_z < horizon[o, block_i, block_j, STEEPEST] * main:
        return False
    step = BLOCK * speed_z
    return (
        step * FAR >= (z_top - z) * main
        and step * MIDDLE >= (horizon[o, block_i, block_j, HIGHEST_FAR] - z) * main
        and step * NEAR >= (horizon[o, block_i, block_j, HIGHEST_MIDDLE] - z) * main
    )


@jit(part=True, allocates=False)
def block_extremes(heights, periodic, rise, top):
    """Steepest rise by octant (8, blocks, blocks) and highest node (blocks, blocks)."""
    nx, ny = heights.shape
    if not periodic:
        nx, ny = nx - 1, ny - 1
    for block_i in range(top.shape[0]):
        for block_j in range(top.shape[1]):
            u_low = v_low = sum_low = apart_low = np.inf
            u_high = v_high = sum_high = apart_high = highest = -np.inf
            for i in range(block_i << SHIFT, min((block_i + 1) << SHIFT, nx)):
                i1 = i + 1 if i + 1 < heights.shape[0] else 0
                for j in range(block_j << SHIFT, min((block_j + 1) << SHIFT, ny)):
                    j1 = j + 1 if j + 1 < heights.shape[1] else 0
                    z00, z10 = heights[i, j], heights[i1, j]
                    z01, z11 = heights[i, j1], heights[i1, j1]
                    highest = max(max(highest, max(z00, z10)), max(z01, z11))
                    # The two facets share the diagonal: one sum of their steps
                    u_low = min(u_low, min(z10 - z00, z11 - z01))
                    u_high = max(u_high, max(z10 - z00, z11 - z01))
                    v_low = min(v_low, min(z11 - z10, z01 - z00))
                    v_high = max(v_high, max(z11 - z10, z01 - z00))
                    sum_low = min(sum_low, z11 - z00)
                    sum_high = max(sum_high, z11 - z00)
                    one = z10 - z00 - (z11 - z10)
                    two = z11 - z01 - (z01 - z00)
                    apart_low = min(apart_low, min(one, two))
                    apart_high = max(apart_high, max(one, two))
            top[block_i, block_j] = highest
            # Octants as `octant` numbers them: rims along an axis and along a diagonal
            rise[0, block_i, block_j] = max(v_high, sum_high)
            rise[1, block_i, block_j] = max(-v_low, apart_high)
            rise[2, block_i, block_j] = max(v_high, -apart_low)
            rise[3, block_i, block_j] = max(-v_low, -sum_low)
            rise[4, block_i, block_j] = max(u_high, sum_high)
            rise[5, block_i, block_j] = max(u_high, apart_high)
            rise[6, block_i, block_j] = max(-u_low, -apart_low)
            rise[7, block_i, block_j] = max(-u_low, -sum_low)


@jit(forceinline=True)
def copy(values, out):
    """Copy a value a block."""
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            out[i, j] = values[i, j]


@jit(forceinline=True)
def beyond(values, i, j, periodic, outside):
    """Value of block (i, j), round the period or else beyond the rim."""
    bx, by = values.shape
    if 0 <= i < bx and 0 <= j < by:
        return values[i, j]
    return values[i % bx, j % by] if periodic else outside


@jit(allocates=False)
def spread(values, out, di, dj, ei, ej, periodic, outside):
    """Largest of each block and the two that lie (di, dj) and (ei, ej) from it."""
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            out[i, j] = max(
                values[i, j],
                max(
                    beyond(values, i + di, j + dj, periodic, outside),
                    beyond(values, i + ei, j + ej, periodic, outside),
                ),
            )


@jit(part=True, allocates=False)
def look_ahead(values, first, last, o, spare, periodic, outside, room, out):
    """Largest value over the blocks `first` to `last` that a ray of octant o may meet.

    Counted along the faster axis; `spare` more where a block at the end of the map is
    narrower than others. Beyond the rim of a finite map the value is `outside`. `room` has
    two layers the size of the result.
    """
    sign_x = -1 if o & 2 else 1
    sign_y = -1 if o & 1 else 1
    along_i, along_j = (sign_x, 0) if o >= 4 else (0, sign_y)
    side_i, side_j = (0, sign_y) if o >= 4 else (sign_x, 0)
    now, then = room[0], room[1]
    copy(values, now)
    for _ in range(1 + spare):
        spread(now, then, side_i, side_j, side_i, side_j, periodic, outside)
        now, then = then, now
    for _ in range(last - first + spare):
        spread(now, then, along_i, along_j, sign_x, sign_y, periodic, outside)
        now, then = then, now
    # Begin `first` blocks further on
    for _ in range(first):
        for i in range(now.shape[0]):
            for j in range(now.shape[1]):
                then[i, j] = max(
                    beyond(now, i + along_i, j + along_j, periodic, outside),
                    beyond(now, i + sign_x, j + sign_y, periodic, outside),
                )
        now, then = then, now
    copy(now, out)


def build_horizon(heights, periodic, z_top):
    """Look ahead from every block in every octant: (8, blocks, blocks, N_AHEAD)."""
    nx, ny = heights.shape
    if not periodic:
        nx, ny = nx - 1, ny - 1
    shape = ((nx + BLOCK - 1) >> SHIFT, (ny + BLOCK - 1) >> SHIFT)
    if min(shape) < LEAST_BLOCKS:
        return np.empty((0, 0, 0, N_AHEAD))
    spare = 1 if nx % BLOCK or ny % BLOCK else 0
    # The largest rise of each octant, the top, and two layers to work in
    room = np.empty((11, *shape))
    horizon = np.empty((8, *shape, N_AHEAD))
    fill_horizon(heights, periodic, z_top, spare, room, horizon)
    return horizon


@jit(allocates=False)
def fill_horizon(heights, periodic, z_top, spare, room, horizon):
    """Look ahead as `build_horizon` says."""
    top = room[8]
    block_extremes(heights, periodic, room, top)
    for o in range(8):
        ahead = horizon[o]
        # Beyond the rim of a finite map no rise is enough, and the top must be cleared
        for what in range(N_AHEAD):
            if what == STEEPEST:
                values, outside, first, last = room[o], np.inf, 0, NEAR
            elif what == HIGHEST_MIDDLE:
                values, outside, first, last = top, z_top, NEAR + 1, MIDDLE
            else:
                values, outside, first, last = top, z_top, MIDDLE + 1, FAR
            look_ahead(
                values, first, last, o, spare, periodic, outside, room[9:],
                ahead[:, :, what],
            )  # fmt: skip
        for i in range(top.shape[0]):
            for j in range(top.shape[1]):
                ahead[i, j, STEEPEST] += MARGIN * abs(ahead[i, j, STEEPEST])
