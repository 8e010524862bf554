"""How high a facet must lie for a ray from it to clear the mesh around, bent to hold it.

A normal field that is conditioned on the heights of three nodes is the field plus three
multiples of its autocorrelation about them (Journel and Huijbregts, Mining Geostatistics,
1978, on conditional simulation); where the field was drawn at random, so is the bent one
given the corners. The facet's height above what its slopes let expect stays free: lifting
it lifts the mesh around by less, in proportion, so that a ray clears it from one height on.
"""

from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.terrain.horizon import (
    BLOCK,
    FAR,
    HIGHEST_FAR,
    HIGHEST_MIDDLE,
    MIDDLE,
    NEAR,
    SHIFT,
    STEEPEST,
    octant,
)

# The terrain and its autocorrelation along x and y at lags -1, 0, ... of the grid
Mesh = namedtuple("Mesh", "terrain along_x along_y")
# Multiples of the autocorrelation about the corners (0, 0), (1, 0), (0, 1), (1, 1) of a
# cell, one of the middle two being 0
Bend = namedtuple("Bend", "c00 c10 c01 c11")
# Facet that is given: its cell, how the mesh is bent to hold it and by a unit of lift, its
# changes of slopes without sign, and its remaining height before
Given = namedtuple("Given", "i j bend lift change_x change_y before")
# How far the mesh is bent at `stride` cells, two strides ... from the facet and beyond, as
# far as half a period: largest height and largest rise from node to node (strides, 2), for
# three changes and then for those of a facet
Reach = namedtuple("Reach", "stride half bent")
# A ray among the lines of the grid: direction in cells per unit of time, and times from one
# line along y, along x and from one diagonal to the next
Pace = namedtuple("Pace", "speed_x speed_y per_x per_y per_d")
# Where it is: cell, place in the plane relative to the cell at the time 0, and the times at
# which it crosses the next of these lines
Among = namedtuple("Among", "i j x0 y0 t_x t_y t_d")
NEVER = 1e300
MAX_STEPS = 1_000_000


BLOCK_LEVEL = SHIFT  # of the pyramid of block maxima


@jit(forceinline=True)
def lags(heights, given, i, j):
    """Nodes from the given facet's first to node (i, j), round the period."""
    a = i - given.i
    b = j - given.j
    return (
        a + heights.shape[0] if a < 0 else a,
        b + heights.shape[1] if b < 0 else b,
    )


@jit(forceinline=True)
def bend_along_y(bend, x_back, x_here, y, share):
    """Bending on the grid line from a node along y; y from `correlations`."""
    here = x_here * bend.c00 + x_back * bend.c10
    back = x_here * bend.c01 + x_back * bend.c11
    first = here * y[1] + back * y[0]
    return first + share * (here * y[2] + back * y[1] - first)


@jit(forceinline=True)
def bend_along_x(bend, x, y_back, y_here, share):
    """Bending on the grid line from a node along x; x from `correlations`."""
    here = y_here * bend.c00 + y_back * bend.c01
    back = y_here * bend.c10 + y_back * bend.c11
    first = here * x[1] + back * x[0]
    return first + share * (here * x[2] + back * x[1] - first)


@jit(forceinline=True)
def bend_on_diagonal(bend, x, y, share):
    """Bending on the diagonal from a node."""
    first = x[1] * (bend.c00 * y[1] + bend.c01 * y[0]) + x[0] * (
        bend.c10 * y[1] + bend.c11 * y[0]
    )
    last = x[2] * (bend.c00 * y[2] + bend.c01 * y[1]) + x[1] * (
        bend.c10 * y[2] + bend.c11 * y[1]
    )
    return first + share * (last - first)


@jit(forceinline=True)
def correlations(along, lag):
    """Autocorrelation along an axis before, at and after a lag."""
    return along[lag], along[lag + 1], along[lag + 2]


@jit(forceinline=True)
def crossing_along_y(mesh, given, i, j, share):
    """Height of the bent mesh on a grid line along y, and its share in a lift."""
    heights = mesh.terrain.heights
    a, b = lags(heights, given, i, j)
    j1 = j + 1 if j + 1 < heights.shape[1] else 0
    y = correlations(mesh.along_y, b)
    x_back, x_here = mesh.along_x[a], mesh.along_x[a + 1]
    z = heights[i, j] + share * (heights[i, j1] - heights[i, j])
    return z + bend_along_y(given.bend, x_back, x_here, y, share), bend_along_y(
        given.lift, x_back, x_here, y, share
    )


@jit(forceinline=True)
def crossing_along_x(mesh, given, i, j, share):
    """Height of the bent mesh on a grid line along x, and its share in a lift."""
    heights = mesh.terrain.heights
    a, b = lags(heights, given, i, j)
    i1 = i + 1 if i + 1 < heights.shape[0] else 0
    x = correlations(mesh.along_x, a)
    y_back, y_here = mesh.along_y[b], mesh.along_y[b + 1]
    z = heights[i, j] + share * (heights[i1, j] - heights[i, j])
    return z + bend_along_x(given.bend, x, y_back, y_here, share), bend_along_x(
        given.lift, x, y_back, y_here, share
    )


@jit(forceinline=True)
def crossing_on_diagonal(mesh, given, i, j, share):
    """Height of the bent mesh on the diagonal of a cell, and its share in a lift."""
    heights = mesh.terrain.heights
    a, b = lags(heights, given, i, j)
    i1 = i + 1 if i + 1 < heights.shape[0] else 0
    j1 = j + 1 if j + 1 < heights.shape[1] else 0
    x, y = correlations(mesh.along_x, a), correlations(mesh.along_y, b)
    z = heights[i, j] + share * (heights[i1, j1] - heights[i, j])
    return z + bend_on_diagonal(given.bend, x, y, share), bend_on_diagonal(
        given.lift, x, y, share
    )


@jit(forceinline=True)
def bent_by(bent, stride, what, given, lift):
    """Largest height (0) or rise (1) by which a lifted facet bends the mesh."""
    one = bent[stride, what]
    lifted = abs(lift - given.before)
    return given.change_x * one[0] + given.change_y * one[1] + lifted * one[2]


@jit(forceinline=True)
def knows_free(terrain, i, j, z, speed_x, speed_y, speed_z, bent, stride, given, lift):
    """Whether a ray is known to clear the bent mesh from a stride on.

    As `pbrdf.kernels.terrain.horizon.is_free`, for the mesh bent as much as it may be.
    """
    if terrain.horizon.size == 0:
        return False
    height = bent_by(bent, stride, 0, given, lift)
    rise = bent_by(bent, stride, 1, given, lift)
    main = max(abs(speed_x), abs(speed_y))
    ahead = terrain.horizon[octant(speed_x, speed_y), i >> SHIFT, j >> SHIFT]
    step = BLOCK * speed_z
    return (
        speed_z >= (ahead[STEEPEST] + rise) * main
        and step * FAR >= (terrain.z_top + height - z) * main
        and step * MIDDLE >= (ahead[HIGHEST_FAR] + height - z) * main
        and step * NEAR >= (ahead[HIGHEST_MIDDLE] + height - z) * main
    )


@jit(forceinline=True)
def cells_left(i, n, speed):
    """Cells of the block between cell i and the rim towards which a ray travels."""
    if speed > 0.0:
        return min(i | (BLOCK - 1), n - 1) - i
    return i & (BLOCK - 1)


@jit(forceinline=True)
def crossings(t_next, t_end, per, most):
    """Count the lines of a family that a ray crosses before t_end, at most `most`."""
    if t_next >= t_end:
        return 0
    return min(int((t_end - t_next) / per) + 1, most)


@jit(forceinline=True)
def enter_grid(given, u, v, speed_x, speed_y):
    """Pace of a ray among the lines of the grid, and where it is as it starts."""
    per_x = 1.0 / abs(speed_x) if speed_x != 0.0 else NEVER
    per_y = 1.0 / abs(speed_y) if speed_y != 0.0 else NEVER
    turn = speed_x - speed_y
    per_d = 1.0 / abs(turn) if turn != 0.0 else NEVER
    t_x = (1.0 - u if speed_x > 0.0 else u) * per_x
    t_y = (1.0 - v if speed_y > 0.0 else v) * per_y
    side = u - v if u > v else u - v + 1.0
    t_d = (1.0 - side if turn > 0.0 else side) * per_d
    return (
        Pace(speed_x, speed_y, per_x, per_y, per_d),
        Among(given.i, given.j, u, v, t_x, t_y, t_d),
    )


@jit(forceinline=True)
def pass_block(terrain, at, pace):
    """Where a ray is in the last cell of its block."""
    nx, ny = terrain.heights.shape
    i, j, x0, y0, t_x, t_y, t_d = at
    cells_x = cells_left(i, nx, pace.speed_x)
    cells_y = cells_left(j, ny, pace.speed_y)
    t_end = min(t_x + cells_x * pace.per_x, t_y + cells_y * pace.per_y)
    count = crossings(t_x, t_end, pace.per_x, cells_x)
    t_x += count * pace.per_x
    i += count if pace.speed_x > 0.0 else -count
    x0 -= count if pace.speed_x > 0.0 else -count
    count = crossings(t_y, t_end, pace.per_y, cells_y)
    t_y += count * pace.per_y
    j += count if pace.speed_y > 0.0 else -count
    y0 -= count if pace.speed_y > 0.0 else -count
    t_d += crossings(t_d, t_end, pace.per_d, 2 * BLOCK) * pace.per_d
    return Among(i, j, x0, y0, t_x, t_y, t_d)


@jit(forceinline=True)
def step_to(i, n, speed):
    """Line that a ray in cell i meets next, the cell behind it, and its place's change."""
    if speed > 0.0:
        ahead = i + 1 if i + 1 < n else 0
        return ahead, ahead, -1.0
    return i, i - 1 if i > 0 else n - 1, 1.0


@jit(forceinline=True)
def cross_line(mesh, given, at, pace, t, look):
    """Cross the next line at the time t: where the ray is then, and what it crosses.

    That is the height of the bent mesh there and its share in a lift, if asked to look.
    """
    nx, ny = mesh.terrain.heights.shape
    i, j, x0, y0, t_x, t_y, t_d = at
    surface, follows = 0.0, 0.0
    if t == t_x:
        line, i, change = step_to(i, nx, pace.speed_x)
        if look:
            share = y0 + pace.speed_y * t
            surface, follows = crossing_along_y(mesh, given, line, j, share)
        t_x += pace.per_x
        x0 += change
    elif t == t_y:
        line, j, change = step_to(j, ny, pace.speed_y)
        if look:
            share = x0 + pace.speed_x * t
            surface, follows = crossing_along_x(mesh, given, i, line, share)
        t_y += pace.per_y
        y0 += change
    else:
        if look:
            share = x0 + pace.speed_x * t
            surface, follows = crossing_on_diagonal(mesh, given, i, j, share)
        t_d += pace.per_d
    return Among(i, j, x0, y0, t_x, t_y, t_d), surface, follows


@jit(forceinline=True)
def least_lift(mesh, given, reach, lift, most, u, v, z, speed_x, speed_y, speed_z):
    """Least lift, from `lift` on, at which a rising ray meets no other facet.

    The ray leaves (u, v) of the given facet at height z without lift. Gives up at `most`.

    speed_x, speed_y  direction in cells per unit of time, speed_z in height

    The mesh is linear along the ray but where it crosses a grid line or a diagonal.
    """
    terrain = mesh.terrain
    maxima = terrain.maxima
    offset, row = terrain.levels[BLOCK_LEVEL - 1]
    pace, at = enter_grid(given, u, v, speed_x, speed_y)
    bent = reach.bent
    per_stride = min(pace.per_x, pace.per_y) * reach.stride
    # Where the next image of the facet comes near the ray must be above all of it
    above = z + speed_z * min(pace.per_x, pace.per_y) * reach.half - terrain.z_top
    stride = 0
    t_stride = per_stride
    height = bent_by(bent, 0, 0, given, lift)
    far = above + lift >= height
    if far and knows_free(
        terrain, at.i, at.j, z + lift, speed_x, speed_y, speed_z, bent, 0, given, lift
    ):
        return lift
    block = -1
    block_top = 0.0
    t_in = 0.0
    for step in range(MAX_STEPS):
        here = (at.i >> SHIFT) * row + (at.j >> SHIFT)
        if here != block:
            block = here
            block_top = maxima[offset + block]
            if step > 0 and z + lift + speed_z * t_in > block_top + height:
                # A rising ray that enters above a block passes above all of it
                at = pass_block(terrain, at, pace)
        t = min(at.t_x, min(at.t_y, at.t_d))
        z_ray = z + lift + speed_z * t
        if z_ray > terrain.z_top + height:
            return lift
        # The rim of the cell is below the highest point of its block
        look = step > 0 and z_ray <= block_top + height
        at, surface, follows = cross_line(mesh, given, at, pace, t, look)
        t_in = t
        if look:
            missing = surface + follows * lift - z_ray
            if missing > 0.0:
                if missing >= (most - lift) * (1.0 - follows):
                    return most
                lift += missing / (1.0 - follows)
                height = bent_by(bent, stride, 0, given, lift)
                far = above + lift >= bent_by(bent, 0, 0, given, lift)
        if far and t >= t_stride:
            stride = min(stride + 1, bent.shape[0] - 1)
            t_stride += per_stride
            height = bent_by(bent, stride, 0, given, lift)
            if knows_free(
                terrain, at.i, at.j, z + lift + speed_z * t, speed_x, speed_y, speed_z,
                bent, stride, given, lift,
            ):  # fmt: skip
                return lift
    return most
