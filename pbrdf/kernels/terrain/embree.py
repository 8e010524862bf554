"""The next facet that a ray meets, from Embree instead of the walk over the height field.

A ray keeps its exact place (cell, facet, u, v, height) in float64; only the copy handed to
Embree is float32 and lifted off its facet along the normal. A hit facet returns as a
number; where on its plane the ray arrives follows in float64.
"""

import math
from collections import namedtuple

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from pbrdf.kernels import jit
from pbrdf.kernels.optics.vectors import Vec
from pbrdf.kernels.terrain.heightfield import (
    ESCAPED,
    FACET_LOW,
    HIT,
    LOST,
    SIDE,
    cell_counts,
    corner_heights,
    facet_slopes,
)

# A ray came back to the face it has just left: impossible but for rounding inside Embree
SELF = 5
MAX_PERIODS = 1_000_000
# Words of 32 bits of an RTCRayHit: origin, nearest, direction, time, farthest, mask, id,
# flags; then the hit: normal, u, v, face, geometry, instances
ORIGIN, NEAREST, DIRECTION, TIME, FARTHEST, MASK, ID, FLAGS = 0, 3, 4, 7, 8, 9, 10, 11
FACE, GEOMETRY, INSTANCE, N_WORDS = 17, 18, 19, 32
NOTHING, ALL = 0xFFFFFFFF, 0xFFFFFFFF

# How the mesh lies: its centre (cells, cells, height), units of the mesh to a cell and to a
# height, lift of a ray off its facet in units, cells of the guard band, cells of a column
# and their inverse, and the lowest height
MeshFrame = namedtuple(
    "MeshFrame",
    "center_x center_y center_z scale_x scale_y scale_z offset guard_x guard_y rows "
    "per_column z_bottom",
)
# Embree's tree over the mesh: the addresses of its function `rtcIntersect1`, of the scene
# and of a ray, that ray (N_WORDS float32) and the same memory as uint32, and the MeshFrame
Tree = namedtuple("Tree", "intersect scene place ray words frame")


@intrinsic
def call_embree(typing_context, function, scene, ray):
    """Call the C function (scene, ray, NULL) at an address; all three are addresses."""

    def generate(context, builder, signature, arguments):
        pointer = ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [pointer, pointer, pointer])
        target = builder.inttoptr(arguments[0], kind.as_pointer())
        given = [builder.inttoptr(argument, pointer) for argument in arguments[1:]]
        builder.call(target, [*given, pointer(None)])
        return context.get_dummy_value()

    return types.void(types.intp, types.intp, types.intp), generate


@jit(forceinline=True)
def write_ray(ray, words, lane, lanes, origin, direction, nearest, farthest):
    """Write a ray, in units of the mesh, as one of so many that lie word by word.

    `words` is the memory of `ray` as uint32.
    """
    ray[ORIGIN * lanes + lane] = origin.x
    ray[(ORIGIN + 1) * lanes + lane] = origin.y
    ray[(ORIGIN + 2) * lanes + lane] = origin.z
    ray[NEAREST * lanes + lane] = nearest
    ray[DIRECTION * lanes + lane] = direction.x
    ray[(DIRECTION + 1) * lanes + lane] = direction.y
    ray[(DIRECTION + 2) * lanes + lane] = direction.z
    ray[TIME * lanes + lane] = 0.0
    ray[FARTHEST * lanes + lane] = farthest
    words[MASK * lanes + lane] = ALL
    words[ID * lanes + lane] = 0
    words[FLAGS * lanes + lane] = 0
    words[GEOMETRY * lanes + lane] = NOTHING
    words[INSTANCE * lanes + lane] = NOTHING


@jit(forceinline=True)
def first_face(terrain, tree, i, j, facet, u, v, z, k_x, k_y, k_z):
    """Face of the mesh that a ray meets first, or -1."""
    frame, ray, words = tree.frame, tree.ray, tree.words
    x = (i + u - frame.center_x) * frame.scale_x
    y = (j + v - frame.center_y) * frame.scale_y
    height = (z - frame.center_z) * frame.scale_z
    if facet >= 0:
        # Lift the ray off its facet along the normal
        slope_x, slope_y = facet_slopes(terrain, i, j, facet)
        lift = frame.offset / math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
        x -= slope_x * lift
        y -= slope_y * lift
        height += lift
    write_ray(ray, words, 0, 1, Vec(x, y, height), Vec(k_x, k_y, k_z), 0.0, math.inf)
    call_embree(tree.intersect, tree.scene, tree.place)
    if words[GEOMETRY] == NOTHING:
        return -1
    return int(words[FACE])


@jit(forceinline=True)
def cell_of_face(face, frame):
    """Column and row of the cell, without wrapping, and facet of a face of the mesh."""
    number = face >> 1
    # Exact: half a row keeps the quotient away from whole numbers
    column = int((number + 0.5) * frame.per_column)
    row = number - column * frame.rows
    return column - frame.guard_x, row - frame.guard_y, face & 1


@jit(forceinline=True)
def face_of_cell(i, j, facet, frame):
    """Face of the mesh that is a facet of cell (i, j) of the field."""
    return 2 * ((i + frame.guard_x) * frame.rows + j + frame.guard_y) + facet


@jit(forceinline=True)
def wrap_cell(number, count):
    """Bring the number of a cell into [0, count) by whole periods."""
    while number < 0:
        number += count
    while number >= count:
        number -= count
    return number


@jit(forceinline=True)
def arrive_on_facet(terrain, i, j, u, v, z, k_x, k_y, k_z, column, row, facet):
    """Cell and place (i, j, u, v, z) where a ray from (u, v) of cell (i, j) meets a facet.

    The facet's cell (column, row) is given without wrapping: where the ray arrives.
    """
    nx, ny = cell_counts(terrain)
    ci = wrap_cell(column, nx)
    cj = wrap_cell(row, ny)
    z00, z10, z01, z11 = corner_heights(terrain.heights, ci, cj, terrain.periodic)
    step_x, step_y = z11 - z01, z01 - z00
    if facet == FACET_LOW:
        step_x, step_y = z10 - z00, z11 - z10
    speed_x = k_x * (1.0 / terrain.pitch_x)
    speed_y = k_y * (1.0 / terrain.pitch_y)
    # Clearance above the facet's plane, and how fast it shrinks
    u += i - column
    v += j - row
    clear = z - (z00 + step_x * u + step_y * v)
    rate = k_z - step_x * speed_x - step_y * speed_y
    t = 0.0
    if rate < 0.0:
        t = max(-clear / rate, 0.0)
    # Rounding may put the place a hair outside its cell
    u = min(max(u + speed_x * t, 0.0), 1.0)
    v = min(max(v + speed_y * t, 0.0), 1.0)
    return ci, cj, u, v, z00 + step_x * u + step_y * v


@jit(part=True, allocates=False)
def leave_mesh(terrain, frame, x, y, k_x, k_y):
    """Time at which a ray from (x, y) [cells] leaves the rectangle of the mesh."""
    nx, ny = cell_counts(terrain)
    t = math.inf
    if k_x != 0.0:
        edge = nx + frame.guard_x if k_x > 0.0 else -frame.guard_x
        t = (edge - x) * terrain.pitch_x / k_x
    if k_y != 0.0:
        edge = ny + frame.guard_y if k_y > 0.0 else -frame.guard_y
        t = min(t, (edge - y) * terrain.pitch_y / k_y)
    return max(t, 0.0)


@jit(forceinline=True)
def seek(terrain, tree, i, j, facet, u, v, z, k_x, k_y, k_z):
    """Follow a ray along the unit vector k to the next facet it meets, as `leave_facet`.

    With facet -1 the ray starts in free space. A ray that leaves the mesh of a periodic
    field below its top goes on from the same place one period back.
    """
    frame = tree.frame
    nx, ny = cell_counts(terrain)
    left = face_of_cell(i, j, facet, frame) if facet >= 0 else -1
    for _ in range(MAX_PERIODS):
        face = first_face(terrain, tree, i, j, facet, u, v, z, k_x, k_y, k_z)
        if face >= 0:
            if face == left:
                return SELF, i, j, facet, u, v, z
            column, row, facet = cell_of_face(face, frame)
            i, j, u, v, z = arrive_on_facet(
                terrain, i, j, u, v, z, k_x, k_y, k_z, column, row, facet
            )
            return HIT, i, j, facet, u, v, z
        steepest = terrain.steepest
        if k_z > 0.0 and k_z * k_z >= steepest * steepest * (k_x * k_x + k_y * k_y):
            return ESCAPED, i, j, -1, u, v, z
        t = leave_mesh(terrain, frame, i + u, j + v, k_x, k_y)
        z += k_z * t if k_z != 0.0 else 0.0
        if k_z > 0.0 and z >= terrain.z_top:
            return ESCAPED, i, j, -1, u, v, z
        if not terrain.periodic:
            return SIDE, i, j, -1, u, v, z
        if z < frame.z_bottom:
            return LOST, i, j, -1, u, v, z
        x = (i + u + k_x * t / terrain.pitch_x) % nx
        y = (j + v + k_y * t / terrain.pitch_y) % ny
        i = min(int(x), nx - 1)
        j = min(int(y), ny - 1)
        u = x - i
        v = y - j
        facet = left = -1
    return LOST, i, j, -1, u, v, z
