"""Convex bodies of revolution on the surface: where a ray enters and leaves them.

A body is a stack of slabs about a vertical axis. In each slab the square of its radius is a
quadratic in the height, r² = a + b s + c s², so that the ray meets it at the roots of a
quadratic: a sphere is one slab, a drop that gravity flattens is several. The surface is
never faceted; position and normal are exact.

A grid of cells over the plane lists the bodies above each cell; on a periodic surface it
repeats with the surface.
"""

import math
from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.bodies.beams import INSIDE, KX, KY, KZ, LEFT, N_INSIDE, X, Y, Z

FAR = 1e300
MISSED = (FAR, -FAR)
# Relative to the radius of a body: what two routes to one point may differ by
CLOSE = 1e-9
# A quadratic this flat is a straight line
FLAT = 1e-14
LOW, HIGH, CONSTANT, LINEAR, SQUARE, N_SLAB = 0, 1, 2, 3, 4, 5
MAX_CELLS = 10_000_000
NO_BODY, MISMATCH = -1, -2
# Where a hit is written: distance and axis
HIT_T, HIT_X, HIT_Y, N_HIT = 0, 1, 2, 3

# Reference height, largest radius and medium of each body; its slabs (N_SLAB columns) from
# slab_start[k] to slab_start[k + 1]; lowest and highest point of all; whether any two
# overlap. The grid: numbers and sizes of its cells, the extent of the surface and whether
# it repeats; the images of bodies over a cell and their axes, from cell_start[cell] on
Bodies = namedtuple(
    "Bodies",
    "z radius medium slab_start slabs z_low z_high overlap "
    "cells_x cells_y step_x step_y size_x size_y periodic "
    "cell_start member member_x member_y",
)


@jit(forceinline=True)
def slab_interval(a, b, c, d_x, d_y, d_z, k_x, k_y, k_z, t_low, t_high):
    """Part of (t_low, t_high) in which a ray is inside a quadric, or MISSED."""
    # Outside minus inside is square t² + 2 half t + ...; at its least value nothing cancels
    square = k_x * k_x + k_y * k_y - c * k_z * k_z
    half = d_x * k_x + d_y * k_y - k_z * (0.5 * b + c * d_z)
    if square > FLAT:
        t_mid = -half / square
        x = d_x + k_x * t_mid
        y = d_y + k_y * t_mid
        s = d_z + k_z * t_mid
        depth = a + s * (b + c * s) - x * x - y * y
        if depth < 0.0:
            return MISSED
        reach = math.sqrt(depth / square)
        return max(t_low, t_mid - reach), min(t_high, t_mid + reach)

    depth = a + d_z * (b + c * d_z) - d_x * d_x - d_y * d_y
    if square >= -FLAT:
        # Along an asymptote: inside on one side of a single root
        if half == 0.0:
            return (t_low, t_high) if depth >= 0.0 else MISSED
        root = 0.5 * depth / half
        return (t_low, min(t_high, root)) if half > 0.0 else (max(t_low, root), t_high)
    # Steeper than a cone that opens: inside on either side of both roots, of which a convex
    # body keeps one
    spread = half * half + square * depth
    if spread <= 0.0:
        return t_low, t_high
    first = (half - math.sqrt(spread)) / -square
    second = (half + math.sqrt(spread)) / -square
    if min(t_high, first) - t_low > t_high - max(t_low, second):
        return t_low, min(t_high, first)
    return max(t_low, second), t_high


@jit(forceinline=True)
def heights_in_cylinder(radius, d_x, d_y, d_z, k_x, k_y, k_z):
    """Lowest and highest point of the part of a line within a radius of the axis."""
    square = k_x * k_x + k_y * k_y
    if square < FLAT:
        return (-FAR, FAR) if d_x * d_x + d_y * d_y <= radius * radius else MISSED
    t_mid = -(d_x * k_x + d_y * k_y) / square
    x = d_x + k_x * t_mid
    y = d_y + k_y * t_mid
    depth = radius * radius - x * x - y * y
    if depth < 0.0:
        return MISSED
    climb = abs(k_z) * math.sqrt(depth / square)
    middle = d_z + k_z * t_mid
    return middle - climb, middle + climb


@jit(part=True, allocates=False)
def stack_interval(slabs, first, last, radius, d_x, d_y, d_z, k_x, k_y, k_z):
    """`body_interval` of a body of several slabs, `first` to `last`."""
    wide = radius * (1.0 + CLOSE)
    lowest, highest = heights_in_cylinder(wide, d_x, d_y, d_z, k_x, k_y, k_z)
    t_in, t_out = MISSED
    for index in range(first, last):
        low = slabs[index, LOW]
        high = slabs[index, HIGH]
        if high < lowest or low > highest:
            continue
        t_low, t_high = -FAR, FAR
        if k_z != 0.0:
            t_low = min((low - d_z) / k_z, (high - d_z) / k_z)
            t_high = max((low - d_z) / k_z, (high - d_z) / k_z)
        t_low, t_high = slab_interval(
            slabs[index, CONSTANT], slabs[index, LINEAR], slabs[index, SQUARE],
            d_x, d_y, d_z, k_x, k_y, k_z, t_low, t_high,
        )  # fmt: skip
        if t_low <= t_high:
            # A line cuts a convex body once, so the parts join
            t_in = min(t_in, t_low)
            t_out = max(t_out, t_high)
    return t_in, t_out


@jit(forceinline=True)
def body_interval(bodies, k, d_x, d_y, d_z, k_x, k_y, k_z):
    """Distances at which a line enters and leaves body k, or MISSED.

    (d_x, d_y, d_z) is the start relative to the axis and the reference height.
    """
    slabs, first, last = bodies.slabs, bodies.slab_start[k], bodies.slab_start[k + 1]
    if last - first > 1:
        radius = bodies.radius[k]
        return stack_interval(slabs, first, last, radius, d_x, d_y, d_z, k_x, k_y, k_z)
    # One closed quadric needs no clipping
    return slab_interval(
        slabs[first, CONSTANT], slabs[first, LINEAR], slabs[first, SQUARE],
        d_x, d_y, d_z, k_x, k_y, k_z, -FAR, FAR,
    )  # fmt: skip


@jit(forceinline=True)
def body_normal(bodies, k, d_x, d_y, d_z):
    """Outward normal of body k at a point of its surface, relative to axis and height."""
    index = bodies.slab_start[k]
    while index + 1 < bodies.slab_start[k + 1] and d_z > bodies.slabs[index, HIGH]:
        index += 1
    n_z = -(0.5 * bodies.slabs[index, LINEAR] + bodies.slabs[index, SQUARE] * d_z)
    scale = 1.0 / math.sqrt(d_x * d_x + d_y * d_y + n_z * n_z)
    return d_x * scale, d_y * scale, n_z * scale


@jit(forceinline=True)
def span_of_heights(bodies, z, k_z, t_limit):
    """Distances between which a ray is at the heights of the bodies."""
    if k_z > 0.0:
        return max((bodies.z_low - z) / k_z, 0.0), min((bodies.z_high - z) / k_z, t_limit)
    if k_z < 0.0:
        return max((bodies.z_high - z) / k_z, 0.0), min((bodies.z_low - z) / k_z, t_limit)
    between = bodies.z_low <= z <= bodies.z_high
    return 0.0, (t_limit if between else -1.0)


@jit(forceinline=True)
def names_image(state, top, column, k, axis_x, axis_y, radius):
    """Whether (number, axis) in three columns of a beam name this image of body k."""
    return (
        state[top, column] == k
        and abs(state[top, column + 1] - axis_x) < 0.5 * radius
        and abs(state[top, column + 2] - axis_y) < 0.5 * radius
    )


@jit(forceinline=True)
def is_known(state, top, k, axis_x, axis_y, radius):
    """Whether the beam is inside this image of body k, or has just left it."""
    if names_image(state, top, LEFT, k, axis_x, axis_y, radius):
        return True
    for slot in range(int(state[top, N_INSIDE])):
        if names_image(state, top, INSIDE + 3 * slot, k, axis_x, axis_y, radius):
            return True
    return False


@jit(forceinline=True)
def next_body(bodies, state, top, t_limit, hit):
    """Body whose surface a beam enters next before t_limit; NO_BODY if it meets none.

    A convex body that it has just left is not met again; one that it is inside of without
    having entered it is a MISMATCH. Writes distance and axis into `hit`.
    """
    x, y, z = state[top, X], state[top, Y], state[top, Z]
    k_x, k_y, k_z = state[top, KX], state[top, KY], state[top, KZ]
    t, best = span_of_heights(bodies, z, k_z, t_limit)
    if t > best:
        return NO_BODY
    step_x, step_y = bodies.step_x, bodies.step_y
    cells_x, cells_y = bodies.cells_x, bodies.cells_y
    # Cells are counted on without end; whole laps of the period are taken off
    i = math.floor((x + k_x * t) / step_x)
    j = math.floor((y + k_y * t) / step_y)
    found = NO_BODY
    for _ in range(MAX_CELLS):
        lap_x = math.floor(i / cells_x)
        lap_y = math.floor(j / cells_y)
        if not bodies.periodic and (lap_x != 0 or lap_y != 0):
            break
        cell = int((i - lap_x * cells_x) * cells_y + (j - lap_y * cells_y))
        for m in range(bodies.cell_start[cell], bodies.cell_start[cell + 1]):
            k = bodies.member[m]
            radius = bodies.radius[k]
            axis_x = bodies.member_x[m] + lap_x * bodies.size_x
            axis_y = bodies.member_y[m] + lap_y * bodies.size_y
            if is_known(state, top, k, axis_x, axis_y, radius):
                continue
            t_in, t_out = body_interval(
                bodies, k, x - axis_x, y - axis_y, z - bodies.z[k], k_x, k_y, k_z
            )
            if t_out <= max(CLOSE * radius, t_in) or t_in >= best:
                continue
            if t_in < -CLOSE * radius:
                return MISMATCH
            best = max(t_in, 0.0)
            found = k
            hit[HIT_T] = best
            hit[HIT_X] = axis_x
            hit[HIT_Y] = axis_y
        # Into the next cell, unless a hit comes before it
        t_x = ((i + (1 if k_x > 0.0 else 0)) * step_x - x) / k_x if k_x != 0.0 else FAR
        t_y = ((j + (1 if k_y > 0.0 else 0)) * step_y - y) / k_y if k_y != 0.0 else FAR
        if min(t_x, t_y) >= best:
            break
        if t_x <= t_y:
            i += 1 if k_x > 0.0 else -1
        else:
            j += 1 if k_y > 0.0 else -1
    return found
