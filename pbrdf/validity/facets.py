"""What light sees of a mesh: curvature, size of features and heights, from its facets."""

from dataclasses import dataclass

import numpy as np

from pbrdf.surface import MeshSurface
from pbrdf.surface.mesh.topology import Edges, parts, seam_pairs
from pbrdf.validity.roughness import FLAT, HEIGHTS, Roughness

# Parts with less of the area than this do not decide for the whole
LEAST_PART = 1e-3


def roughness_of_mesh(surface: MeshSurface) -> Roughness:
    """Find the scales of a mesh, of the part that bends most.

    A facet bends across its edges: each adds half of the angle to its neighbour, times its
    length over the facet's area, in its direction; the larger principal value counts. The
    mean over the area then has a sharp edge by the angle that it turns, however fine the
    facets are, and flat faces between edges have a radius of the order of their width.
    Features of radius R and slope s are as wide as √6 s R: the correlation length of a
    Gaussian surface.
    """
    area = surface.areas
    pairs = _neighbours(surface)
    body = parts(len(area), (pairs.one, pairs.other))
    bend = _bends(surface, pairs)
    whole = np.bincount(body, area)
    means = np.bincount(body, area * bend) / whole
    tilted = np.sum(_about_mean(surface.normals, area, body) ** 2, axis=1)
    spread = np.bincount(body, area * tilted) / whole
    weighty = whole >= LEAST_PART * area.sum()
    worst = int(np.argmax(np.where(weighty, means, -1.0)))
    with np.errstate(divide="ignore"):
        radius = 1.0 / means[worst]
    length = float(np.sqrt(3.0 * spread[worst]) * radius) if spread[worst] else np.inf
    heights = _heights(surface)
    mean_spread = float(np.sum(whole * spread) / area.sum())
    weight = area[pairs.one] + area[pairs.other]
    apart = 2.0 - 2.0 * np.cos(pairs.turn)
    change = float(np.sum(weight * apart) / max(float(weight.sum()), 1e-300))
    return Roughness(
        height_rms=float(heights.std()) if heights.size else np.inf,
        slope_rms=float(np.sqrt(mean_spread / 2)), corr_length=length,
        cell=float(np.sqrt(2.0 * np.sum(area**2) / area.sum())),
        steps=np.zeros(1), radii=np.array([radius]),
        smooth=1.0 - change / (2 * mean_spread) if mean_spread > 0.0 else 1.0,
        cells=np.inf, lengths=min(surface.size) / length,
        heights=heights, flat=_flat_share(surface), generated=False, facets=True,
        bodies=surface.kind == "bodies",
    )  # fmt: skip


@dataclass(frozen=True)
class _Neighbours:
    """Faces `one` and `other` at each edge, across a seam too.

    `edge` (pairs, 3) runs as that of `one` [um], `turn` is the angle of their normals
    about it, positive where the surface is convex [rad].
    """

    one: np.ndarray
    other: np.ndarray
    edge: np.ndarray
    turn: np.ndarray


def _neighbours(surface: MeshSurface) -> _Neighbours:
    edges = Edges.of(surface.faces.astype(np.int64))
    shared = edges.counts >= 2
    one, other = edges.pairs(shared)
    ends = edges.ends[edges.start[:-1][shared]]
    if surface.period is not None:
        alone = edges.start[:-1][edges.counts == 1]
        first, second, _ = seam_pairs(surface.vertices, edges.ends[alone], surface.period)
        one = np.concatenate([one, edges.face[alone[first]]])
        other = np.concatenate([other, edges.face[alone[second]]])
        ends = np.concatenate([ends, edges.ends[alone[first]]])
    edge = surface.vertices[ends[:, 1]] - surface.vertices[ends[:, 0]]
    a, b = surface.normals[one], surface.normals[other]
    along = edge / np.linalg.norm(edge, axis=1, keepdims=True)
    sine = np.sum(np.cross(a, b) * along, axis=1)
    turn = np.arctan2(sine, np.sum(a * b, axis=1))
    return _Neighbours(one, other, edge, turn)


def _bends(surface: MeshSurface, pairs: _Neighbours) -> np.ndarray:
    """Larger principal curvature of each face, by amount. [1/um]"""
    count = len(surface.faces)
    length = np.linalg.norm(pairs.edge, axis=1)
    trace, square = np.zeros(count), np.zeros(count)
    tensor = np.zeros((count, 3, 3))
    for face in (pairs.one, pairs.other):
        strength = 0.5 * pairs.turn * length / surface.areas[face]
        across = np.cross(surface.normals[face], pairs.edge) / length[:, None]
        trace += np.bincount(face, strength, count)
        for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
            term = strength * across[:, i] * across[:, j]
            tensor[:, i, j] += np.bincount(face, term, count)
    for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        square += (1.0 if i == j else 2.0) * tensor[:, i, j] ** 2
    apart = np.sqrt(np.maximum(square / 2 - trace**2 / 4, 0.0))
    bends: np.ndarray = np.abs(trace) / 2 + apart
    return bends


def _about_mean(normals: np.ndarray, area: np.ndarray, body: np.ndarray) -> np.ndarray:
    """Return normals less the mean of their part. [1]"""
    whole = np.bincount(body, area)
    means = [np.bincount(body, area * normals[:, k]) / whole for k in range(3)]
    found: np.ndarray = normals - np.stack(means, axis=1)[body]
    return found


def _heights(surface: MeshSurface) -> np.ndarray:
    """Heights about the mean, equally likely as seen from above; none of bodies. [um]

    Facets that look up, hidden ones too, at evenly spread places.
    """
    seen = surface.areas * np.maximum(surface.normals[:, 2], 0.0)
    if surface.kind == "bodies" or not seen.sum() > 0.0:
        return np.empty(0)
    number = np.arange(HEIGHTS)
    share = np.cumsum(seen) / seen.sum()
    face = np.searchsorted(share, (number + 0.5) / HEIGHTS).clip(max=len(seen) - 1)
    # Additive recurrence of the plastic number: even over the unit square
    u, v = np.mod(0.5 + np.outer([0.7548776662466927, 0.5698402909980532], number), 1.0)
    u, v = np.where(u + v > 1.0, [1.0 - u, 1.0 - v], [u, v])
    corners = surface.vertices[surface.faces[face]]
    ways = corners[:, 1:] - corners[:, :1]
    places = corners[:, 0] + u[:, None] * ways[:, 0] + v[:, None] * ways[:, 1]
    heights: np.ndarray = places[:, 2] - places[:, 2].mean()
    if surface.period is None:
        plane = np.column_stack([places[:, :2], np.ones(HEIGHTS)])
        heights = heights - plane @ np.linalg.lstsq(plane, heights, rcond=None)[0]
    return heights


def _flat_share(surface: MeshSurface) -> float:
    """Share of the light from above that facets parallel to the mean plane take. [1]"""
    seen = surface.areas * np.maximum(surface.normals[:, 2], 0.0)
    level = np.hypot(surface.normals[:, 0], surface.normals[:, 1]) <= FLAT
    return float(seen[level].sum() / max(float(seen.sum()), 1e-300))
