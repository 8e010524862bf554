"""Looks along two lines of nodes: heights drawn by themselves, and those of a realisation.

Both are the same function of heights with the same law (`pbrdf.kernels.sights.profiles`),
so that their means are the same whatever the function is: the difference of a true look
and one along the nodes of the same realisation corrects the mean of the drawn ones.
"""

import numpy as np

from pbrdf.kernels import jit
from pbrdf.kernels.sights.profiles import (
    BY_X,
    BY_Y,
    GAIN,
    LAMBDAS,
    RISE_I,
    RISE_S,
    SLOPE_X,
    SLOPE_Y,
    WAY,
    WEIGHT,
)

# Lift of a facet above which nothing stands
NOTHING_ABOVE = -1e30


@jit(forceinline=True)
def share_above(x):
    """Probability that a normal number lies above x, to 2e-7.

    M. Abramowitz and I. Stegun, Handbook of Mathematical Functions, 1964, eq. 26.2.19.
    """
    z = min(abs(x), 20.0)
    p = 0.0000488906 + z * 0.0000053830
    p = 0.0211410061 + z * (0.0032776263 + z * (0.0000380036 + z * p))
    p = 1.0 + z * (0.0498673470 + z * p)
    p *= p
    p *= p
    p *= p
    tail = 0.5 / (p * p)
    return tail if x >= 0.0 else 1.0 - tail


@jit(forceinline=True)
def lift_rows(profiles, path, rows, heights, sign, n, lifts):
    """Lifts (rows,) that clear all nodes of a path, of heights (nodes,) in lifts."""
    for k in range(n):
        lifts[k] = NOTHING_ABOVE
    slope_x, slope_y = rows[SLOPE_X], rows[SLOPE_Y]
    for a in range(heights.size):
        rise = rows[RISE_I] if a < profiles.sources else rows[RISE_S]
        height = sign * heights[a]
        by_x, by_y = profiles.bent[path, a, BY_X], profiles.bent[path, a, BY_Y]
        way = profiles.bent[path, a, WAY]
        # Without sign, so that the compiler makes vector code of it
        for k in range(np.uint64(profiles.first[path, a]), np.uint64(n)):
            need = height + slope_x[k] * by_x + slope_y[k] * by_y - rise[k] * way
            lift = lifts[k]
            lifts[k] = need if need > lift else lift


@jit(forceinline=True)
def add_looks(rows, unit, n, lifts, seen):
    """Add what a look along the nodes tells of each row, in Smith's rule less 1."""
    per_unit = 1.0 / unit
    lambdas, weight = rows[LAMBDAS], rows[WEIGHT]
    for k in range(np.uint64(n)):
        seen[k] += weight[k] * (lambdas[k] * share_above(lifts[k] * per_unit) - 1.0)


@jit(part=True, allocates=False)
def draw_looks(ensemble, profiles, column, n, pairs, start, numbers, room, seen):
    """Add pairs of looks along drawn heights and along their negatives to seen (rows,).

    start    in [0, 1), says which azimuth, facet and zenith are looked at first
    numbers  normal numbers (pairs, nodes)
    room     `heights` (nodes,) and `lifts` (rows,) to work in
    """
    heights, lifts = room
    turns, steps = profiles.nodes.shape[0] // (2 * profiles.columns), profiles.rows.shape[1]
    kinds = 2 * turns
    which = int(start * kinds * steps)
    for m in range(pairs):
        kind, step = which % kinds, which // kinds
        which = which + 1 if which + 1 < kinds * steps else 0
        path = kinds * column + kind
        rows = profiles.rows[turns * column + kind // 2, step]
        factor = profiles.factor[path]
        for a in range(heights.size):
            heights[a] = 0.0
        for b in range(heights.size):
            for a in range(np.uint64(b), np.uint64(heights.size)):
                heights[a] += factor[b, a] * numbers[m, b]
        unit = ensemble.remainder[kind % 2]
        lift_rows(profiles, path, rows, heights, 1.0, n, lifts)
        add_looks(rows, unit, n, lifts, seen)
        lift_rows(profiles, path, rows, heights, -1.0, n, lifts)
        add_looks(rows, unit, n, lifts, seen)


@jit(forceinline=True)
def corner(heights, i, j):
    """Height of a node, round the period."""
    return heights[i % heights.shape[0], j % heights.shape[1]]


@jit(part=True, allocates=False)
def take_mesh_looks(mesh, ensemble, profiles, column, place, b, steps, n, room, told):
    """Take the look along the nodes of a realisation off what a true look told (rows,).

    place  of the facet in the mesh
    b      of the look across the column, in [0, 1), before it was tilted
    steps  of each row's zenith (rows,), likewise
    """
    heights, lifts = room
    terrain = mesh.terrain.heights
    n_steps = profiles.rows.shape[1]
    turns = profiles.nodes.shape[0] // (2 * profiles.columns)
    k = 0 if place.u > place.v else 1
    turn = int(b * turns)
    path = 2 * (turns * column + turn) + k
    i, j = place.i, place.j
    first = corner(terrain, i, j)
    middle = corner(terrain, i + 1, j) if k == 0 else corner(terrain, i, j + 1)
    last = corner(terrain, i + 1, j + 1)
    for a in range(heights.size):
        node = profiles.nodes[path, a]
        height = corner(terrain, i + node[0], j + node[1])
        weights = profiles.weights[path, a]
        height -= weights[0] * first + weights[1] * middle + weights[2] * last
        heights[a] = profiles.bent[path, a, GAIN] * height
    unit = ensemble.remainder[k]
    for step in range(n_steps):
        rows = profiles.rows[turns * column + turn, step]
        lift_rows(profiles, path, rows, heights, 1.0, n, lifts)
        for row in range(n):
            if int(steps[row] * n_steps) == step:
                share = share_above(lifts[row] / unit)
                told[row] -= rows[WEIGHT, row] * (rows[LAMBDAS, row] * share - 1.0)
