"""How the faces of a mesh hang together: edges, rims, bodies, which side is out."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

# Vertices of files in float32 meet across the seam of a period to this share of the extent
SEAM = 2e-6


@dataclass(frozen=True)
class Edges:
    """Edges of all faces, each with the faces at it.

    Attributes
    ----------
    face : ndarray, shape (3 faces,)
        Faces in the order of their edges, so that those of one edge are neighbours.
    start : ndarray
        Where each edge begins in that order; one more than there are edges.
    ends : ndarray, shape (3 faces, 2)
        Vertices of the edge as the face runs along it.
    net : ndarray
        Faces that run along an edge one way less those that run the other way.
    """

    face: np.ndarray
    start: np.ndarray
    ends: np.ndarray
    net: np.ndarray

    @classmethod
    def of(cls, faces: np.ndarray) -> "Edges":
        """Find the edges of faces (faces, 3)."""
        ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
        ends = ends.astype(np.int64)
        low, high = ends.min(axis=1), ends.max(axis=1)
        key = low * (int(faces.max()) + 1) + high
        order = np.argsort(key, kind="stable")
        sorted_key = key[order]
        first = np.flatnonzero(np.r_[True, sorted_key[1:] != sorted_key[:-1]])
        ends = ends[order]
        way = np.where(ends[:, 0] < ends[:, 1], 1, -1)
        return cls(
            face=order // 3,
            start=np.r_[first, len(order)],
            ends=ends,
            net=np.add.reduceat(way, first),
        )

    @property
    def counts(self) -> np.ndarray:
        """Faces at each edge."""
        return np.diff(self.start)

    def pairs(self, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Two faces at each of the chosen edges (a mask), which have two or more."""
        first = self.start[:-1][chosen]
        return self.face[first], self.face[first + 1]


def parts(n: int, *pairs: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Find the connected parts of n things, given pairs of neighbours."""
    a = np.concatenate([one for one, _ in pairs])
    b = np.concatenate([other for _, other in pairs])
    graph = coo_array((np.ones(len(a), dtype=np.int8), (a, b)), shape=(n, n))
    labels: np.ndarray = connected_components(graph, directed=False)[1]
    return labels


def consistent(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Turn as few faces as needed so that neighbours agree on their side: (turned, torn).

    Each face has two copies, as it is and turned; where two faces meet at an edge the
    copies that agree are neighbours. Parts in which both copies of a face come together
    have one side only: `torn` marks their faces.
    """
    edges = Edges.of(faces)
    n = len(faces)
    two = edges.counts == 2
    a, b = edges.pairs(two)
    agree = edges.net[two] == 0
    same = np.where(agree, b, b + n), np.where(agree, b + n, b)
    copies = parts(2 * n, (a, same[0]), (a + n, same[1]))
    torn = copies[:n] == copies[n:]
    whole = parts(n, (a, b))
    # Of the two copies of a part keep the one that holds more faces as they are
    lower = np.minimum(copies[:n], copies[n:])
    is_lower = copies[:n] == lower
    votes = np.bincount(whole, weights=np.where(is_lower, 1.0, -1.0))
    turned = is_lower != (votes[whole] >= 0.0)
    return turned & ~torn, torn


def seam_pairs(
    vertices: np.ndarray, ends: np.ndarray, period: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Match open edges (edges, 2) whose images meet across the period.

    Returns pairs of edges, and of vertices (pairs, 2) that are images of each other.
    """
    lengths = np.asarray(period)
    extent = max(float(np.ptp(vertices, axis=0).max()), float(lengths.max()))
    tolerance = SEAM * extent
    if len(ends) == 0:
        none = np.empty(0, dtype=np.int64)
        return none, none, np.empty((0, 2), dtype=np.int64)
    a, b = vertices[ends[:, 0]], vertices[ends[:, 1]]
    # Place and direction of an edge; its partner runs the other way
    middle, along = 0.5 * (a + b), b - a
    box = np.array([*lengths, 8.0 * extent])
    place = np.mod(middle - [*vertices.min(axis=0)], box)
    # A coordinate a hair below its period is the same place as one at 0
    place = np.where(place >= box, 0.0, place)
    tree = cKDTree(place, boxsize=box)
    found = tree.query_pairs(4.0 * tolerance, output_type="ndarray")
    opposite = np.abs(along[found[:, 0]] + along[found[:, 1]]).max(axis=1) <= 8 * tolerance
    found = found[opposite]
    # Each edge has one partner only
    _, first = np.unique(found[:, 0], return_index=True)
    found = found[first]
    _, first = np.unique(found[:, 1], return_index=True)
    found = found[first]
    twice = np.isin(found[:, 0], found[:, 1])
    found = found[~twice]
    one, other = found[:, 0], found[:, 1]
    meeting = np.concatenate(
        [
            np.stack([ends[one, 0], ends[other, 1]], axis=1),
            np.stack([ends[one, 1], ends[other, 0]], axis=1),
        ]
    )
    return one, other, meeting


def snapped(
    vertices: np.ndarray, meeting: np.ndarray, period: tuple[float, float]
) -> np.ndarray:
    """Move vertices that are images of each other so that they are so exactly."""
    if len(meeting) == 0:
        return vertices
    group = parts(len(vertices), (meeting[:, 0], meeting[:, 1]))
    touched = np.unique(meeting)
    _, first = np.unique(group[touched], return_index=True)
    leader = np.empty(int(group.max()) + 1, dtype=np.int64)
    leader[group[touched[first]]] = touched[first]
    lead = leader[group[touched]]
    out = vertices.copy()
    apart = vertices[touched, :2] - vertices[lead, :2]
    out[touched, :2] = vertices[lead, :2] + np.round(apart / period) * period
    out[touched, 2] = vertices[lead, 2]
    return out


def face_vectors(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return normals of faces, as long as twice their area."""
    a, b, c = vertices[faces[:, 0]], vertices[faces[:, 1]], vertices[faces[:, 2]]
    return np.cross(b - a, c - a)


def winding_numbers(
    points: np.ndarray,
    vertices: np.ndarray,
    faces: np.ndarray,
    period: tuple[float, float] | None,
) -> np.ndarray:
    """How many bodies each point (points, 3) lies inside of: facets above it, by side."""
    if len(faces) == 0:
        return np.zeros(len(points))
    corners = vertices[faces]
    side = np.sign(face_vectors(vertices, faces)[:, 2])
    low, high = corners.min(axis=1), corners.max(axis=1)
    counts = np.zeros(len(points))
    for number, point in enumerate(points):
        moves = [np.zeros(2)]
        if period is not None:
            lengths = np.asarray(period)
            least = np.floor((low[:, :2].min(axis=0) - point[:2]) / lengths).astype(int)
            most = np.ceil((high[:, :2].max(axis=0) - point[:2]) / lengths).astype(int)
            moves = [
                np.array([a, b]) * lengths
                for a in range(least[0], most[0] + 1)
                for b in range(least[1], most[1] + 1)
            ]
        for move in moves:
            x, y = point[:2] + move
            near = np.flatnonzero(
                (low[:, 0] <= x) & (x <= high[:, 0]) & (low[:, 1] <= y)
                & (y <= high[:, 1]) & (high[:, 2] > point[2]) & (side != 0.0)
            )  # fmt: skip
            if len(near) == 0:
                continue
            a, b, c = corners[near, 0], corners[near, 1], corners[near, 2]
            # Twice the areas that the point spans with each edge, seen from above
            areas = np.stack(
                [
                    (q[:, 0] - p[:, 0]) * (y - p[:, 1])
                    - (q[:, 1] - p[:, 1]) * (x - p[:, 0])
                    for p, q in ((b, c), (c, a), (a, b))
                ],
                axis=1,
            )
            whole = areas.sum(axis=1)
            inside = (areas * np.sign(whole)[:, None] > 0.0).all(axis=1)
            height = (areas * np.stack([a[:, 2], b[:, 2], c[:, 2]], axis=1)).sum(axis=1)
            above = inside & (height * np.sign(whole) > point[2] * np.abs(whole))
            counts[number] += side[near][above].sum()
    return counts
