"""Straight probes through a mesh: all facets that they meet, by Embree in float32."""

from itertools import product
from typing import Any

import numpy as np

__all__ = ["TOUCH", "exposed_shares", "met_between", "moves_of", "scene_of"]

# Probes go on this share of their length behind each facet that they meet
STEP = 1e-6
# Facets that a probe may meet
MOST_MET = 64
# Distances below this share of the extent are contact
TOUCH = 1e-9
# Points on all facets, and how far in front of them, as a share of the extent
POINTS, FRONT = 100_000, 1e-5


def scene_of(vertices: np.ndarray, faces: np.ndarray) -> Any:
    """Embree's scene of a mesh about as large as 1."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, vertices.astype(np.float32), faces.astype(np.int32))
    return scene


def moves_of(
    low: np.ndarray, high: np.ndarray, period: tuple[float, float] | None
) -> list[np.ndarray]:
    """Shifts of the images that reach into the mesh, the mesh itself first."""
    moves = [np.zeros(3)]
    if period is not None:
        widths = (high - low)[:2]
        # Those that only touch it do not count
        reach = np.ceil(widths / period - TOUCH).astype(int) - 1
        for i, j in product(*(range(-n, n + 1) for n in reach)):
            if (i, j) != (0, 0):
                moves.append(np.array([i * period[0], j * period[1], 0.0]))
    return moves


def met_between(
    scene: Any, rays: np.ndarray, margin: float = 0.0
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Rays (rays, 2 ends, 3) and the faces that they meet between their ends, in turn.

    They start and end the share `margin` of their length from their ends.
    """
    start, way = rays[:, 0], rays[:, 1] - rays[:, 0]
    number = np.arange(len(rays))
    gone = np.full(len(rays), margin, dtype=np.float32)
    last = np.full(len(rays), -1)
    found = []
    for _ in range(MOST_MET):
        if len(number) == 0:
            break
        origins = start[number] + gone[:, None] * way[number]
        left = np.maximum(np.float32(1.0 - margin) - gone, 0.0).astype(np.float32)
        told = scene.run(origins, way[number], dists=left.copy(), output=True)
        face = told["primID"]
        hit = (face >= 0) & (told["tfar"] < left)
        # Rounding may find a face again from just behind it
        new = hit & (face != last)
        found.append((number[new], face[new]))
        number, last = number[hit], face[hit]
        gone = (gone + told["tfar"] + np.float32(STEP))[hit]
    return found


def exposed_shares(
    vertices: np.ndarray,
    faces: np.ndarray,
    normals: np.ndarray,
    areas: np.ndarray,
    period: tuple[float, float] | None,
) -> np.ndarray:
    """Share of each face in front of which no body lies, shape (faces,).

    From points spread over the faces by their area, each a hair in front of its face, a
    probe goes up: a point lies in as many bodies as it leaves less those that it enters.
    """
    count = np.maximum(np.ceil(POINTS * areas / areas.sum()), 1.0).astype(int)
    face = np.repeat(np.arange(len(faces)), count)
    rng = np.random.default_rng(0)
    u, v = rng.random((2, len(face)))
    u, v = np.where(u + v > 1.0, [1.0 - u, 1.0 - v], [u, v])
    a, b, c = (vertices[faces[face, k]] for k in range(3))
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    extent = float((high - low).max())
    points = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    points += FRONT * extent * normals[face]
    scene = scene_of((vertices - low) / extent, faces)
    side = np.sign(normals[:, 2])
    bodies = np.zeros(len(face))
    for move in moves_of(low, high, period):
        start = points + move
        rays = np.stack([start, start], axis=1)
        rays[:, 1, 2] = high[2] + 0.01 * extent
        for number, hit in met_between(scene, ((rays - low) / extent).astype(np.float32)):
            bodies[number] += side[hit]
    shares: np.ndarray = np.bincount(face, weights=bodies < 0.5) / count
    return shares
