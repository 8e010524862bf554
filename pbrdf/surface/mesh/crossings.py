"""Parts of a mesh that cut through themselves or through their images over a period."""

from typing import NamedTuple

import numpy as np

from pbrdf.surface.mesh.mending import Mended, named
from pbrdf.surface.mesh.probes import TOUCH, met_between, moves_of, scene_of
from pbrdf.surface.mesh.topology import Edges, face_vectors, winding_numbers

__all__ = ["Crossings", "check_crossings", "find_crossings", "inside_out"]

# Edges in one call of Embree
CHUNK = 2**18
# What passes through an edge nearer to its ends, as a share of it, is not looked for
MARGIN = 1e-4
# Places at which sides are looked at; steps beside them, as shares of an edge
MOST_PLACES, BESIDE, OFF = 16, 1e-4, 1e-7
# Facets of a smaller angle give no line of intersection
LEAST_SINE = 1e-3


class Crossings(NamedTuple):
    """Where edges pass through faces of their own part.

    Attributes
    ----------
    edge_face, face : ndarray, shape (n,)
        A face at each edge, and the face that it passes through.
    ends : ndarray, shape (n, 2, 3)
        Ends of the edge, moved to where it passes through that face. [um]
    place : ndarray, shape (n, 3)
        Where it does. [um]
    move : ndarray, shape (n, 3)
        Shift of the image of the part that the edge belongs to. [um]
    """

    edge_face: np.ndarray
    face: np.ndarray
    ends: np.ndarray
    place: np.ndarray
    move: np.ndarray


class Cut(NamedTuple):
    """Whether a part cuts through itself or an image of it, and notes for the user."""

    found: bool
    notes: tuple[str, ...]


def check_crossings(
    mesh: Mended,
    part: np.ndarray,
    solids: np.ndarray | None,
    period: tuple[float, float] | None,
) -> Cut:
    """Count the edges at which parts cut through themselves; refuse what has no inside.

    Opaque parts may overlap themselves, as different parts may: light sees their union.

    Parameters
    ----------
    mesh : Mended
        The mesh, all faces looking out of the solid.
    part : ndarray, shape (faces,)
        Number of the part that each face belongs to.
    solids : ndarray, shape (faces,), or None
        Number of the transparent solid that each face bounds, 0 where it is opaque.
    period : (float, float) or None
        Periods of the mesh. [um]

    Raises
    ------
    ValueError
        If a part is inside out where it cuts through itself, or a transparent solid
        overlaps itself or its images.
    """
    clear = np.zeros(len(part), dtype=bool) if solids is None else solids > 0
    if solids is not None:
        part = np.where(clear, int(part.max()) + solids, part)
    found = find_crossings(mesh.vertices, mesh.faces, part, period)
    if len(found.face) == 0:
        return Cut(False, ())
    inner = inside_out(found, mesh.vertices, mesh.faces, period)
    if len(inner):
        msg = (
            f"parts must not be inside out, got {_where(found, mesh, inner)} at which one "
            "passes through itself and encloses space with its outside. Smooth or remesh "
            "the surface there."
        )
        raise ValueError(msg)
    caught = np.flatnonzero(clear[found.face])
    if len(caught):
        msg = (
            "transparent solids must not overlap themselves or their images, got "
            f"{_where(found, mesh, caught)} that do. Cut the solid into parts, which may "
            "overlap; of images, give the mesh with several of them and a longer period."
        )
        raise ValueError(msg)
    own = np.flatnonzero(~found.move.any(axis=1))
    if len(own) == 0:
        return Cut(True, ())
    note = (
        f"A part cuts through itself: {_where(found, mesh, own)} that pass through another "
        "of its faces. Light sees the union of what it encloses."
    )
    return Cut(True, (note,))


def _where(found: Crossings, mesh: Mended, chosen: np.ndarray) -> str:
    """Count some crossings and name the first."""
    first = chosen[0]
    x, y, z = found.place[first]
    pair = mesh.source[[found.edge_face[first], found.face[first]]]
    count = "an edge" if len(chosen) == 1 else f"{len(chosen)} edges"
    return f"{count}, the first at ({x:.6g}, {y:.6g}, {z:.6g}) um, {named('face', pair)},"


def find_crossings(
    vertices: np.ndarray,
    faces: np.ndarray,
    part: np.ndarray,
    period: tuple[float, float] | None,
) -> Crossings:
    """Find edges that pass through faces of their own part, or of an image of it.

    Faces in one plane, and contacts, are none.

    Parameters
    ----------
    vertices, faces
        The mesh.
    part : ndarray, shape (faces,)
        Number of the part that each face belongs to.
    period : (float, float) or None
        Periods of the mesh. [um]
    """
    edges = Edges.of(faces)
    first = edges.start[:-1]
    ends, owner = edges.ends[first], edges.face[first]
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    extent = float((high - low).max())
    scene = scene_of((vertices - low) / extent, faces)
    lowest = np.minimum(vertices[ends[:, 0]], vertices[ends[:, 1]])[:, :2]
    highest = np.maximum(vertices[ends[:, 0]], vertices[ends[:, 1]])[:, :2]
    met = []
    for move in moves_of(low, high, period):
        image = bool(np.any(move))
        near = np.arange(len(ends))
        if image:
            reached = (highest + move[:2] > low[:2] + TOUCH * extent).all(axis=1)
            reached &= (lowest + move[:2] < high[:2] - TOUCH * extent).all(axis=1)
            near = np.flatnonzero(reached)
        for chunk in np.split(near, np.arange(CHUNK, len(near), CHUNK)):
            segments = vertices[ends[chunk]] + move
            rays = ((segments - low) / extent).astype(np.float32)
            for number, hit in met_between(scene, rays, MARGIN):
                edge = chunk[number]
                own = part[owner[edge]] == part[hit]
                if not image:
                    own &= ~(faces[hit][:, :, None] == ends[edge][:, None]).any(axis=(1, 2))
                number, hit = number[own], hit[own]
                through, place = _through(segments[number], vertices[faces[hit]], extent)
                number, hit = number[through], hit[through]
                met.append(
                    Crossings(
                        owner[chunk[number]], hit, segments[number], place[through],
                        np.tile(move, (len(hit), 1)),
                    )
                )  # fmt: skip
    return Crossings(*(np.concatenate(one) for one in zip(*met, strict=True)))


def _through(
    segments: np.ndarray, corners: np.ndarray, extent: float
) -> tuple[np.ndarray, np.ndarray]:
    """Whether segments (n, 2, 3) pass through triangles (n, 3, 3), and where."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    side = ((segments - corners[:, :1]) * normal[:, None]).sum(axis=2)
    through = (side[:, 0] * side[:, 1] < 0.0) & (np.abs(side) > TOUCH * extent).all(axis=1)
    share = side[:, 0] / np.where(through, side[:, 0] - side[:, 1], 1.0)
    place = segments[:, 0] + share[:, None] * (segments[:, 1] - segments[:, 0])
    for k in range(3):
        along = corners[:, (k + 1) % 3] - corners[:, k]
        inward = np.cross(normal, along) / np.linalg.norm(along, axis=1, keepdims=True)
        through &= ((place - corners[:, k]) * inward).sum(axis=1) > -TOUCH * extent
    return through, place


def inside_out(
    crossings: Crossings,
    vertices: np.ndarray,
    faces: np.ndarray,
    period: tuple[float, float] | None,
) -> np.ndarray:
    """Find the crossings at which the space in front of both faces is less than empty.

    Around the line where two facets intersect, a solid that overlaps itself fills three of
    four wedges, one of them twice. Where it is turned inside out, the wedge in front of
    both lies in -1 solids. Returns numbers of crossings; at most 16 are looked at.
    """
    count = len(crossings.face)
    looked = np.unique(np.linspace(0, count - 1, min(count, MOST_PLACES)).astype(int))
    normals = [
        face_vectors(vertices, faces[one[looked]])
        for one in (crossings.edge_face, crossings.face)
    ]
    a, b = (one / np.linalg.norm(one, axis=1, keepdims=True) for one in normals)
    line = np.cross(a, b)
    sine = np.linalg.norm(line, axis=1)
    ends, place = crossings.ends[looked], crossings.place[looked]
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=1, keepdims=True)
    # From the edge into its face
    inward = np.cross(a, along)
    middle = vertices[faces[crossings.edge_face[looked]]].mean(axis=1)
    middle += crossings.move[looked] - place
    inward *= np.sign((inward * middle).sum(axis=1))[:, None]
    line *= np.sign((line * inward).sum(axis=1))[:, None]
    line /= np.maximum(sine, LEAST_SINE)[:, None]
    beside = place + BESIDE * length * line
    sides = []
    for sign_a, sign_b in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        way = sign_a * a + sign_b * b
        way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), LEAST_SINE)
        points = beside + OFF * length * way
        sides.append(np.rint(winding_numbers(points, vertices, faces, period)))
    front = sides[0]
    clear = sine > LEAST_SINE
    for found, more in zip(sides[1:], (1, 1, 2), strict=True):
        clear &= found == front + more
    return looked[clear & (front < 0.0)]
