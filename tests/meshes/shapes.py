"""Meshes for the tests, and a slow intersector that tries every triangle in float64."""

from itertools import product

import numpy as np
import trimesh

from pbrdf import MeshSurface


def joined(*meshes):
    """Vertices and faces of several (vertices, faces)."""
    first = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    return (
        np.concatenate([vertices for vertices, _ in meshes]),
        np.concatenate([faces + k for (_, faces), k in zip(meshes, first, strict=False)]),
    )


def pair(mesh, move=(0.0, 0.0, 0.0)):
    """Vertices and faces of a Trimesh, moved."""
    return np.asarray(mesh.vertices) + move, np.asarray(mesh.faces)


def plate(lx=10.0, ly=8.0, cells=3, seed=1):
    """A flat plate cut into uneven triangles."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, cells + 1)
    x, y = np.meshgrid(t, t, indexing="ij")
    inner = np.s_[1:-1, 1:-1]
    x[inner] += 0.3 / cells * rng.uniform(-1, 1, x[inner].shape)
    y[inner] += 0.3 / cells * rng.uniform(-1, 1, y[inner].shape)
    number = np.arange(x.size).reshape(x.shape)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.concatenate(
        [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
    )
    return np.stack([x * lx, y * ly, 0.0 * x], -1).reshape(-1, 3), faces


def groove(width=3.0, length=4.0):
    """One period of a groove of 90 degrees along y, open below at its ridges."""
    half = width / 2
    vertices = np.array(
        [
            [x, y, z]
            for y in (0.0, length)
            for x, z in ((0.0, half), (half, 0.0), (width, half))
        ]
    )
    faces = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]]
    return vertices, np.array(faces)


def corner_cube(edge=2.0):
    """Three mirrors at right angles, their corner down; a sheet with a triangular rim."""
    s, d = edge / np.sqrt(2), edge / np.sqrt(3)
    rim = [
        [s * np.cos(a), s * np.sin(a), d] for a in 2 * np.pi * np.array([0.0, 1.0, 2.0]) / 3
    ]
    # Edges of length `edge` from the corner, at right angles to each other
    rim = np.array(rim)
    rim[:, :2] *= np.sqrt(2 / 3) * edge / s
    return np.array([[0.0, 0.0, 0.0], *rim]), np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1]])


def bent_tube(steps=48, sides=7):
    """A closed tube along an eight, which cuts through itself in the middle."""
    t = np.linspace(0.0, 2 * np.pi, steps, endpoint=False)
    path = np.stack([3 * np.sin(2 * t), 3 * np.sin(t), 0.2 * np.cos(t)], axis=1)
    along = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross([0.0, 0.0, 1.0], along)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    up = np.cross(along, across)
    angle = 0.1 + 2 * np.pi * np.arange(sides)[:, None, None] / sides
    ring = path + 0.5 * (np.cos(angle) * across + np.sin(angle) * up)
    number = np.arange(sides * steps).reshape(sides, steps)
    a, b = number, np.roll(number, -1, axis=0)
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    faces = [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
    return ring.reshape(-1, 3), np.concatenate(faces)


def mushrooms(period=(6.0, 5.0)):
    """A plate with a sphere on a thin stem and a torus in the air across the seam."""
    ball = trimesh.creation.icosphere(subdivisions=2, radius=1.1)
    stem = trimesh.creation.cylinder(radius=0.3, height=3.0, sections=9)
    ring = trimesh.creation.torus(0.8, 0.25, major_sections=14, minor_sections=9)
    ring.apply_transform(trimesh.transformations.rotation_matrix(0.7, [1.0, 0.4, 0.0]))
    return MeshSurface(
        joined(
            plate(*period), pair(ball, (2.1, 2.3, 2.2)), pair(stem, (2.1, 2.3, 0.6)),
            pair(ring, (5.6, 0.3, 1.4)),
        ),
        period,
    )  # fmt: skip


class SlowMesh:
    """Every triangle and every image near by, tried in turn."""

    def __init__(self, surface, images=2):
        self.reach = np.inf
        if surface.period is not None:
            self.reach = (images - 1) * min(surface.period)
        moves = [np.zeros(3)]
        if surface.period is not None:
            steps = range(-images, images + 1)
            moves = [
                np.array([a * surface.period[0], b * surface.period[1], 0.0])
                for a, b in product(steps, steps)
            ]
        corners = np.asarray(surface.vertices)[np.asarray(surface.faces)]
        self.corners = np.concatenate([corners + move for move in moves])
        self.face = np.tile(np.arange(len(corners)), len(moves))
        self.move = np.repeat(np.array(moves), len(corners), axis=0)
        self.normal = np.cross(
            self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0]
        )
        self.normal /= np.linalg.norm(self.normal, axis=1, keepdims=True)

    def crossings(self, place, k, leaves):
        """Where a ray crosses the plane of each facet, and which facets it meets.

        `near` is how far the crossing is from the nearest edge, inside or out [um].
        """
        rate = self.normal @ k
        with np.errstate(divide="ignore", invalid="ignore"):
            time = ((self.corners[:, 0] - place) * self.normal).sum(axis=1) / rate
            there = place + time[:, None] * k
        inside = np.full(len(time), np.inf)
        for p, q in ((0, 1), (1, 2), (2, 0)):
            edge = self.corners[:, q] - self.corners[:, p]
            across = np.cross(self.normal, edge)
            distance = (across * (there - self.corners[:, p])).sum(axis=1)
            inside = np.minimum(inside, distance / np.linalg.norm(edge, axis=1))
        own = (self.face == leaves) & (np.abs(self.move).max(axis=1) == 0.0)
        met = (time > 1e-12) & (inside >= 0.0) & ~own & np.isfinite(time)
        near = np.where((time > -1e-3) & ~own & np.isfinite(inside), np.abs(inside), np.inf)
        return rate, time, there, near, met

    def first(self, place, k, leaves=-1):
        """Nearest facet seen from its front: (face, place there, margin) or None.

        `margin` is how far inside the facet the place is, or how near another came [um].
        """
        rate, time, there, near, met = self.crossings(place, k, leaves)
        if not met.any():
            return None, float(near.min())
        best = np.flatnonzero(met)[np.argmin(time[met])]
        if rate[best] > 0.0:
            raise AssertionError("met from behind")
        # Nothing else matters that the ray meets later
        earlier = time <= time[best] + 1e-6
        margin = float(np.where(earlier, near, np.inf).min())
        return (int(self.face[best]), there[best] - self.move[best]), margin

    def path(self, place, k, most=40):
        """Faces of a path, its last direction, and the least margin on the way."""
        faces, margin, leaves = [], np.inf, -1
        low, high = self.corners[..., 2].min(), self.corners[..., 2].max()
        for _ in range(most):
            found, near = self.first(place, k, leaves)
            margin = min(margin, near)
            if found is None:
                level = (high if k[2] > 0.0 else low) - place[2]
                if np.hypot(k[0], k[1]) * abs(level) > self.reach * abs(k[2]):
                    margin = 0.0
                return faces, k, margin
            leaves, place = found
            n = self.normal[leaves]
            margin = min(margin, abs(float(k @ n)))
            k = k - 2.0 * (k @ n) * n
            k = k / np.linalg.norm(k)
            faces.append(leaves)
            assert low - 1e-9 <= place[2] <= high + 1e-9
        return faces, k, margin
