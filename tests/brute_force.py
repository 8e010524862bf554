"""Ray against every triangle of a height map, in float64 NumPy: the slow way to find a hit.

Coordinates are cells along x and y. Each cell is split along the diagonal from (i, j) to
(i + 1, j + 1), as `HeightMap` documents.
"""

from dataclasses import dataclass

import numpy as np

LOW, HIGH = 0, 1


@dataclass(frozen=True, kw_only=True)
class Hits:
    """Intersections of one ray: time, how far inside the triangle, and which triangle."""

    t: np.ndarray
    inside: np.ndarray
    column: np.ndarray
    row: np.ndarray
    facet: np.ndarray


def triangles(heights, i, j):
    """Corners (facets, 3, 3) of the two facets of each cell, and their labels."""
    nx, ny = heights.shape
    facet = np.tile([LOW, HIGH], len(i))
    i, j = np.repeat(i, 2), np.repeat(j, 2)
    # Corners of the facet with u > v, and of the one with u < v
    steps = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]])[facet]
    x, y = i[:, None] + steps[..., 0], j[:, None] + steps[..., 1]
    return np.stack([x, y, heights[x % nx, y % ny]], axis=-1), i, j, facet


def cells_near(heights, periodic, start, speed):
    """Cells within reach of the ray while it is at the heights of the surface."""
    nx, ny = heights.shape
    if not periodic:
        i, j = np.meshgrid(np.arange(nx - 1), np.arange(ny - 1), indexing="ij")
        return i.ravel(), j.ravel()
    low, high = reach(heights, start, speed)
    i, j = np.meshgrid(
        *(
            np.arange(np.floor(a) - 2, np.ceil(b) + 3)
            for a, b in zip(low, high, strict=True)
        ),
        indexing="ij",
    )
    # All that lie within two cells of the line
    away = (i + 0.5 - start[0]) * speed[1] - (j + 0.5 - start[1]) * speed[0]
    near = np.abs(away) <= 2.0 * np.hypot(speed[0], speed[1])
    return i[near].astype(int), j[near].astype(int)


def intersect(heights, periodic, start, speed, *, skip=None):
    """Intersections from above of start + t speed, t >= 0, with all facets within reach.

    `skip` = (column, row, facet) is left out. The plane of each facet is met first; then
    the edges in the horizontal plane tell how far inside (> 0) the point lies.
    """
    corner, i, j, facet = triangles(heights, *cells_near(heights, periodic, start, speed))
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    rate = normal @ speed
    # Facets face upwards
    keep = rate < 0
    if skip is not None:
        keep &= ~((i == skip[0]) & (j == skip[1]) & (facet == skip[2]))
    corner, i, j, facet = corner[keep], i[keep], j[keep], facet[keep]

    t = ((corner[:, 0] - start) * normal[keep]).sum(axis=1) / rate[keep]
    point = start[:2] + t[:, None] * speed[:2]
    inside = np.full(len(t), np.inf)
    for p, q in ((0, 1), (1, 2), (2, 0)):
        edge = (corner[:, q] - corner[:, p])[:, :2]
        to_point = point - corner[:, p, :2]
        side = edge[:, 0] * to_point[:, 1] - edge[:, 1] * to_point[:, 0]
        inside = np.minimum(inside, side / np.hypot(edge[:, 0], edge[:, 1]))
    met = t > -1e-9
    return Hits(t=t[met], inside=inside[met], column=i[met], row=j[met], facet=facet[met])


def reach(heights, start, speed):
    """Smallest rectangle that holds the ray while it is at the heights of the surface."""
    if speed[2] == 0:
        t_end = 400.0
    elif speed[2] > 0:
        t_end = max((heights.max() - start[2]) / speed[2], 0.0)
    else:
        t_end = max((heights.min() - start[2]) / speed[2], 0.0)
    end = start[:2] + t_end * speed[:2]
    return np.minimum(start[:2], end), np.maximum(start[:2], end)
