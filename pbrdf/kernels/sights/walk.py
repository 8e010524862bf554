"""How high a facet must lie for rays from it to clear the mesh around, bent to hold it.

A normal field that is conditioned on the heights of three nodes is the field plus three
multiples of its autocorrelation about them (Journel and Huijbregts, Mining Geostatistics,
1978, on conditional simulation); where the field was drawn at random, so is the bent one
given the corners. The facet's height above what its slopes let expect stays free: lifting
it lifts the mesh around by less, in proportion, so that a ray clears it from one height on.

The bending is linear in the slopes and in the lift. So rays that leave one place at one
azimuth, each from a facet of its own slopes at an elevation of its own, share their way
over the grid and all that is read there; this is where the time of one ray goes.
"""

from collections import namedtuple

import numpy as np

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
# Place of a facet: its cell and a point (u, v) of it; how the mesh is bent there to have a
# facet without slopes and lift, and by a unit of either slope and of lift; height of the
# point by a unit of slope; slopes and lift that it has
Place = namedtuple(
    "Place", "i j u v level per_x per_y lift start_x start_y old_x old_y old_lift"
)
# Rays from facets at a place, by ray: slopes of the facet, height of its point without
# lift, changes of its slopes without sign, height gained by a unit of way, and least lift
# so far
Rays = namedtuple("Rays", "slope_x slope_y start change_x change_y rise lift")
N_OF_RAY = 7
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
# Least gain of height over the mesh for a unit of lift
LEAST_GAIN = 1e-9


BLOCK_LEVEL = SHIFT  # of the pyramid of block maxima


@jit(forceinline=True)
def lags(heights, place, i, j):
    """Nodes from the facet's first to node (i, j), round the period."""
    a = i - place.i
    b = j - place.j
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
def crossing_along_y(mesh, place, i, j, share):
    """Height of the mesh on a grid line along y: level, by slopes and by lift."""
    heights = mesh.terrain.heights
    a, b = lags(heights, place, i, j)
    j1 = j + 1 if j + 1 < heights.shape[1] else 0
    y = correlations(mesh.along_y, b)
    x_back, x_here = mesh.along_x[a], mesh.along_x[a + 1]
    z = heights[i, j] + share * (heights[i, j1] - heights[i, j])
    return (
        z + bend_along_y(place.level, x_back, x_here, y, share),
        bend_along_y(place.per_x, x_back, x_here, y, share),
        bend_along_y(place.per_y, x_back, x_here, y, share),
        bend_along_y(place.lift, x_back, x_here, y, share),
    )


@jit(forceinline=True)
def crossing_along_x(mesh, place, i, j, share):
    """Height of the mesh on a grid line along x: level, by slopes and by lift."""
    heights = mesh.terrain.heights
    a, b = lags(heights, place, i, j)
    i1 = i + 1 if i + 1 < heights.shape[0] else 0
    x = correlations(mesh.along_x, a)
    y_back, y_here = mesh.along_y[b], mesh.along_y[b + 1]
    z = heights[i, j] + share * (heights[i1, j] - heights[i, j])
    return (
        z + bend_along_x(place.level, x, y_back, y_here, share),
        bend_along_x(place.per_x, x, y_back, y_here, share),
        bend_along_x(place.per_y, x, y_back, y_here, share),
        bend_along_x(place.lift, x, y_back, y_here, share),
    )


@jit(forceinline=True)
def crossing_on_diagonal(mesh, place, i, j, share):
    """Height of the mesh on the diagonal of a cell: level, by slopes and by lift."""
    heights = mesh.terrain.heights
    a, b = lags(heights, place, i, j)
    i1 = i + 1 if i + 1 < heights.shape[0] else 0
    j1 = j + 1 if j + 1 < heights.shape[1] else 0
    x, y = correlations(mesh.along_x, a), correlations(mesh.along_y, b)
    z = heights[i, j] + share * (heights[i1, j1] - heights[i, j])
    return (
        z + bend_on_diagonal(place.level, x, y, share),
        bend_on_diagonal(place.per_x, x, y, share),
        bend_on_diagonal(place.per_y, x, y, share),
        bend_on_diagonal(place.lift, x, y, share),
    )


@jit(forceinline=True)
def raise_lifts(rays, place, first, crossing, t):
    """Lift the rays from `first` on above a crossing that lies t along their way."""
    level, per_x, per_y, follows = crossing
    share = 1.0 / max(1.0 - follows, LEAST_GAIN)
    level *= share
    per_x = (per_x - place.start_x) * share
    per_y = (per_y - place.start_y) * share
    way = t * share
    # Without sign, so that the compiler makes vector code of it
    for k in range(np.uint64(first), np.uint64(rays.lift.size)):
        need = level + rays.slope_x[k] * per_x + rays.slope_y[k] * per_y
        need -= rays.rise[k] * way
        lift = rays.lift[k]
        rays.lift[k] = need if need > lift else lift


@jit(forceinline=True)
def reach_at(bent, stride, what):
    """Largest height (0) or rise (1) from a stride on, for a unit of three changes."""
    return bent[stride, what, 0], bent[stride, what, 1], bent[stride, what, 2]


@jit(forceinline=True)
def bent_by(reached, rays, k, place):
    """Largest height or rise by which ray k's facet bends the mesh."""
    lifted = abs(rays.lift[k] - place.old_lift)
    return (
        rays.change_x[k] * reached[0] + rays.change_y[k] * reached[1] + lifted * reached[2]
    )


@jit(forceinline=True)
def passes_image(rays, k, t_half, top):
    """Whether ray k is above a height where the facet's next image comes near."""
    return rays.start[k] + rays.lift[k] + rays.rise[k] * t_half >= top


@jit(forceinline=True)
def knows_free(terrain, at, pace, z, speed_z, height, rise):
    """Whether a ray is known to clear a mesh that is bent by no more than height and rise.

    As `pbrdf.kernels.terrain.horizon.is_free`.
    """
    if terrain.horizon.size == 0:
        return False
    main = max(abs(pace.speed_x), abs(pace.speed_y))
    way = octant(pace.speed_x, pace.speed_y)
    ahead = terrain.horizon[way, at.i >> SHIFT, at.j >> SHIFT]
    step = BLOCK * speed_z
    return (
        speed_z >= (ahead[STEEPEST] + rise) * main
        and step * FAR >= (terrain.z_top + height - z) * main
        and step * MIDDLE >= (ahead[HIGHEST_FAR] + height - z) * main
        and step * NEAR >= (ahead[HIGHEST_MIDDLE] + height - z) * main
    )


@jit(forceinline=True)
def first_in_doubt(terrain, place, bent, rays, first, at, pace, t, stride, t_half, most):
    """Find the first ray from `first` on that may yet meet the mesh.

    Those before are known to be clear of it or lifted to `most`.
    """
    while first < rays.lift.size:
        if rays.lift[first] < most:
            height = bent_by(reach_at(bent, 0, 0), rays, first, place)
            beyond = 0
            if passes_image(rays, first, t_half, terrain.z_top + height):
                beyond = stride
                height = bent_by(reach_at(bent, beyond, 0), rays, first, place)
            rise = bent_by(reach_at(bent, beyond, 1), rays, first, place)
            z = rays.start[first] + rays.lift[first] + rays.rise[first] * t
            if z <= terrain.z_top + height and not knows_free(
                terrain, at, pace, z, rays.rise[first], height, rise
            ):
                return first
        first += 1
    return first


@jit(forceinline=True)
def all_above(terrain, place, bent, rays, first, top, stride, t, t_half):
    """Whether all rays from `first` on lie at t above a height and all bending."""
    below = 0
    near, far = reach_at(bent, 0, 0), reach_at(bent, stride, 0)
    # Without sign, as above; counted, since a minimum cannot be taken in any order
    for k in range(np.uint64(first), np.uint64(rays.lift.size)):
        most = bent_by(near, rays, k, place)
        height = bent_by(far, rays, k, place)
        height = height if passes_image(rays, k, t_half, terrain.z_top + most) else most
        z = rays.start[k] + rays.lift[k] + rays.rise[k] * t
        below += 1 if z <= top + height else 0
    return below == 0


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
def enter_grid(place, speed_x, speed_y):
    """Pace of rays among the lines of the grid, and where they are as they start."""
    u, v = place.u, place.v
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
        Among(place.i, place.j, u, v, t_x, t_y, t_d),
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
def cross_line(mesh, place, rays, first, at, pace, t, look):
    """Cross the next line at the time t, and return where the rays are then.

    If asked to look, lift the rays from `first` on above what they cross.
    """
    nx, ny = mesh.terrain.heights.shape
    i, j, x0, y0, t_x, t_y, t_d = at
    if t == t_x:
        line, i, change = step_to(i, nx, pace.speed_x)
        if look:
            met = crossing_along_y(mesh, place, line, j, y0 + pace.speed_y * t)
            raise_lifts(rays, place, first, met, t)
        t_x += pace.per_x
        x0 += change
    elif t == t_y:
        line, j, change = step_to(j, ny, pace.speed_y)
        if look:
            met = crossing_along_x(mesh, place, i, line, x0 + pace.speed_x * t)
            raise_lifts(rays, place, first, met, t)
        t_y += pace.per_y
        y0 += change
    else:
        if look:
            met = crossing_on_diagonal(mesh, place, i, j, x0 + pace.speed_x * t)
            raise_lifts(rays, place, first, met, t)
        t_d += pace.per_d
    return Among(i, j, x0, y0, t_x, t_y, t_d)


@jit(part=True, allocates=False)
def lift_clear(mesh, place, reach, rays, most, speed_x, speed_y):
    """Raise the lifts of rays until they meet no other facet, or to `most` and more.

    speed_x, speed_y  direction of all rays in cells per unit of way

    The mesh is linear along the rays but where they cross a grid line or a diagonal.
    """
    terrain, bent = mesh.terrain, reach.bent
    offset, row = terrain.levels[BLOCK_LEVEL - 1]
    pace, at = enter_grid(place, speed_x, speed_y)
    per_cell = min(pace.per_x, pace.per_y)
    t_half, t_stride = per_cell * reach.half, per_cell * reach.stride
    stride, block, t = 0, -1, 0.0
    first = first_in_doubt(terrain, place, bent, rays, 0, at, pace, t, stride, t_half, most)
    for step in range(MAX_STEPS):
        if first == rays.lift.size:
            return
        here = (at.i >> SHIFT) * row + (at.j >> SHIFT)
        if here != block:
            block = here
            top = terrain.maxima[offset + block]
            if step > 0 and all_above(
                terrain, place, bent, rays, first, top, stride, t, t_half
            ):
                # Rising rays that enter above a block pass above all of it
                at = pass_block(terrain, at, pace)
        t = min(at.t_x, min(at.t_y, at.t_d))
        # The rim of the facet itself hides nothing
        at = cross_line(mesh, place, rays, first, at, pace, t, step > 0)
        if t >= t_stride:
            stride = min(stride + 1, bent.shape[0] - 1)
            t_stride += per_cell * reach.stride
            first = first_in_doubt(
                terrain, place, bent, rays, first, at, pace, t, stride, t_half, most
            )
    for k in range(first, rays.lift.size):
        rays.lift[k] = most
