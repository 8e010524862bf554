"""Vertical lines through a mesh: where they meet it, and where they are inside of it."""

from typing import NamedTuple

import numpy as np

from pbrdf.contaminants.shapes import Shape
from pbrdf.surface.mesh import MeshSurface
from pbrdf.surface.mesh.topology import face_vectors

# Heights at which the profile of a body is tabulated
PROFILE = 2001


class Crossings(NamedTuple):
    """Facets that vertical lines meet, from above, line after line.

    `line` is the number of the line, `z` the height [um], and `side` 1 on facets that look
    up and -1 on those that look down.
    """

    line: np.ndarray
    z: np.ndarray
    side: np.ndarray


def triangles_near(
    surface: MeshSurface, x: float, y: float, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """Corners (n, 3, 3) of facets, images included, near a place, which is at x = y = 0.

    They are those of which the bounding square touches a square of half side `reach`. Also
    returns which faces they are.
    """
    corners = surface.vertices[surface.faces] - np.array([x, y, 0.0])
    low, high = corners[..., :2].min(axis=1), corners[..., :2].max(axis=1)
    moves = np.zeros((1, 2))
    if surface.period is not None:
        lengths = np.asarray(surface.period)
        first = np.ceil((-reach - high.max(axis=0)) / lengths).astype(int)
        last = np.floor((reach - low.min(axis=0)) / lengths).astype(int)
        steps = [np.arange(a, b + 1) for a, b in zip(first, last, strict=True)]
        moves = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 2)
        moves = moves * lengths
    found, numbers = [np.empty((0, 3, 3))], [np.empty(0, dtype=np.int64)]
    for move in moves:
        near = ((low + move <= reach) & (high + move >= -reach)).all(axis=1)
        found.append(corners[near] + [*move, 0.0])
        numbers.append(np.flatnonzero(near))
    return np.concatenate(found), np.concatenate(numbers)


def crossings(triangles: np.ndarray, axis: np.ndarray) -> Crossings:
    """Meet facets (n, 3, 3) with lines over a grid (i, j) at x = axis[i], y = axis[j]."""
    up = face_vectors(
        triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)
    )
    lines, heights, sides = [], [], []
    count = len(axis)
    for (a, b, c), (n_x, n_y, n_z) in zip(triangles, up, strict=True):
        if n_z == 0.0:
            continue
        corners = np.stack([a, b, c])
        i, j = (
            slice(*np.searchsorted(axis, [corners[:, k].min(), corners[:, k].max()]))
            for k in (0, 1)
        )
        x, y = axis[i, None], axis[None, j]
        inside = np.ones(np.broadcast(x, y).shape, dtype=bool)
        for p, q in ((a, b), (b, c), (c, a)):
            across = (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
            inside &= across * n_z >= 0.0
        if not inside.any():
            continue
        z = a[2] - ((x - a[0]) * n_x + (y - a[1]) * n_y) / n_z
        number = np.arange(count)[i, None] * count + np.arange(count)[None, j]
        lines.append(number[inside])
        heights.append(z[inside])
        sides.append(np.full(len(heights[-1]), 1 if n_z > 0.0 else -1))
    if not lines:
        none = np.empty(0)
        return Crossings(none.astype(np.int64), none, none.astype(np.int64))
    line, z, side = (np.concatenate(part) for part in (lines, heights, sides))
    order = np.lexsort((-z, line))
    return Crossings(line[order], z[order], side[order])


def spans(shape: Shape, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest point of a body on lines at distances from its axis.

    Heights above its plane, from a table of its profile; on lines that miss it the highest
    lies below the lowest. [um]
    """
    low, high = shape.bottom, shape.height
    # Dense at both ends, where the profile turns to the axis
    s = 0.5 * (low + high) - 0.5 * (high - low) * np.cos(np.linspace(0.0, np.pi, PROFILE))
    slab = np.clip(np.searchsorted(shape.slabs[:, 1], s), 0, len(shape.slabs) - 1)
    a, b, c = shape.slabs[slab, 2:].T
    radius = np.sqrt(np.maximum(a + s * (b + c * s), 0.0))
    widest = int(radius.argmax())
    lowest = np.interp(distance, radius[: widest + 1], s[: widest + 1])
    highest = np.interp(distance, radius[widest:][::-1], s[widest:][::-1])
    missed = distance > radius[widest]
    return np.where(missed, np.inf, lowest), np.where(missed, -np.inf, highest)
