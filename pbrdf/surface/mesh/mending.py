"""Faults of a mesh: found, counted, and mended or refused by name."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from pbrdf.surface.mesh.topology import face_vectors, parts

# Vertices nearer than this share of the extent are one
MERGE = 1e-9
# A face lower than this share of the extent has no area
FLAT = 1e-9
# Places named in a message
NAMED = 3
# Steps of float32 above this share of the median edge turn facets; edges looked at
COARSE, MOST_SAMPLED = 1e-3, 100_000
# Extents of meshes that are probably meant [um]
LIKELY = 0.4, 1e6


@dataclass(frozen=True, kw_only=True)
class Mended:
    """A mesh without collapsed or double faces, and what was done to it.

    Attributes
    ----------
    vertices, faces, labels
        The mesh; labels (faces,) or None.
    source : ndarray, shape (faces,)
        Number of each face as given.
    notes : tuple of str
        What was mended, with counts and places.
    """

    vertices: np.ndarray
    faces: np.ndarray
    labels: np.ndarray | None
    source: np.ndarray
    notes: tuple[str, ...]


def checked_arrays(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, ...]:
    """Vertices as float64 and faces as int64, refused if they are no mesh.

    Raises
    ------
    TypeError, ValueError
        If shapes, types, numbers or vertex numbers are wrong.
    """
    for name, array, kinds in (("vertices", vertices, "fiu"), ("faces", faces, "iu")):
        if array.ndim != 2 or array.shape[1:] != (3,) or len(array) == 0:
            msg = f"{name} must have shape (n, 3) with n > 0, got {array.shape}."
            raise ValueError(msg)
        if array.dtype.kind not in kinds:
            msg = f"{name} must be {'real' if 'f' in kinds else 'whole'} numbers, got "
            raise TypeError(msg + f"{array.dtype}.")
    vertices = np.array(vertices, dtype=np.float64)
    faces = np.array(faces, dtype=np.int64)
    wrong = (faces < 0) | (faces >= len(vertices))
    if wrong.any():
        f, c = (int(k) for k in np.argwhere(wrong)[0])
        msg = (
            f"faces must name vertices from 0 to {len(vertices) - 1}, got {faces[f, c]} in "
            f"face {f} ({int(wrong.any(axis=1).sum())} faces). The file is damaged, or "
            "counts from 1."
        )
        raise ValueError(msg)
    # Vertices that no face uses do not matter
    used = np.zeros(len(vertices), dtype=bool)
    used[faces.ravel()] = True
    bad = used & ~np.isfinite(vertices).all(axis=1)
    if bad.any():
        first = int(np.flatnonzero(bad)[0])
        msg = (
            f"vertices must be finite [um], got {vertices[first].tolist()} at vertex "
            f"{first} ({int(bad.sum())} in all). Leave out the faces there."
        )
        raise ValueError(msg)
    vertices[~used] = vertices[faces[0, 0]]
    return vertices, faces


def mend(vertices: np.ndarray, faces: np.ndarray, labels: np.ndarray | None) -> Mended:
    """Merge vertices; drop faces that collapse and faces given twice.

    Raises
    ------
    ValueError
        If nothing is left, or two faces lie back to back.
    """
    notes = []
    faces = _merged(vertices, faces)
    used, faces = np.unique(faces, return_inverse=True)
    vertices, faces = vertices[used], faces.reshape(-1, 3)
    source = np.arange(len(faces))

    collapsed = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    if collapsed.any():
        notes.append(
            f"{int(collapsed.sum())} of {len(faces)} faces with two corners in one place "
            f"were left out, {named('face', source[collapsed])}."
        )
        faces, source = faces[~collapsed], source[~collapsed]
    if len(faces) == 0:
        msg = "faces must have three corners apart, got none that has."
        raise ValueError(msg)

    # Each face from its lowest vertex on, which keeps its side
    lead = faces.argmin(axis=1)[:, None]
    turned = np.take_along_axis(faces, (lead + np.arange(3)) % 3, axis=1)
    key = np.column_stack([turned[:, 0], np.sort(turned[:, 1:], axis=1)])
    order = np.lexsort(key.T[::-1])
    same = np.r_[False, (key[order][1:] == key[order][:-1]).all(axis=1)]
    if same.any():
        second = np.flatnonzero(same)
        apart = turned[order[second], 1] != turned[order[second - 1], 1]
        if apart.any():
            msg = (
                f"faces must have a thickness of solid behind them, got {int(apart.sum())} "
                f"pairs back to back, {named('face', source[order[second[apart]]])}. "
                "Give thin bodies two sides apart, or leave one side out."
            )
            raise ValueError(msg)
        double = np.zeros(len(faces), dtype=bool)
        double[order[second]] = True
        notes.append(
            f"{int(double.sum())} faces given twice were left out, "
            f"{named('face', source[double])}."
        )
        faces, source = faces[~double], source[~double]
    return Mended(
        vertices=vertices,
        faces=faces,
        labels=None if labels is None else labels[source],
        source=source,
        notes=tuple(notes),
    )


def _merged(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Faces with the first of all vertices in one place in place of each of them."""
    extent = float(np.ptp(vertices, axis=0).max())
    grid = np.round((vertices - vertices.min(axis=0)) / max(MERGE * extent, 1e-300))
    # Three whole numbers below 1e9 each; equal keys are taken for equal places below
    order = np.lexsort(grid.T)
    first = np.r_[True, (grid[order][1:] != grid[order][:-1]).any(axis=1)]
    leader = np.empty(len(vertices), dtype=np.int64)
    leader[order] = np.minimum.reduceat(order, np.flatnonzero(first))[np.cumsum(first) - 1]
    # What lies across a line of the grid
    each = np.unique(leader)
    pairs = cKDTree(vertices[each]).query_pairs(MERGE * extent, output_type="ndarray")
    if len(pairs):
        group = parts(len(each), (pairs[:, 0], pairs[:, 1]))
        _, lead = np.unique(group, return_index=True)
        leader = each[lead[group]][np.searchsorted(each, leader)]
    merged: np.ndarray = leader[faces]
    return merged


def rounding_note(vertices: np.ndarray, faces: np.ndarray) -> tuple[str, ...]:
    """Warn of vertices of a float32 file that lie too far from its origin."""
    step = float(np.spacing(np.abs(vertices).max().astype(np.float32)))
    if not np.array_equal(vertices.astype(np.float32), vertices):
        return ()
    corners = vertices[faces[:: -(-len(faces) // MOST_SAMPLED)]]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    middle = float(np.median(sides))
    if step <= COARSE * middle:
        return ()
    return (
        f"Vertices lie up to {np.abs(vertices).max():.3g} from the origin, where the "
        f"float32 numbers of a file are {step:.2g} apart: {100 * step / middle:.2g} % of "
        "the median edge. Move the mesh to its origin before it is written.",
    )


def size_note(vertices: np.ndarray, *, known: bool) -> tuple[str, ...]:
    """Doubt micrometres that nobody named, of a mesh of an unlikely size."""
    extent = float(np.ptp(vertices, axis=0).max())
    least, most = LIKELY
    if known or least <= extent <= most:
        return ()
    size = "less than a wavelength of light" if extent < least else "more than a metre"
    return (
        f"The mesh is {extent:.3g} um long, {size}: no unit is named, and its numbers are "
        "taken as micrometres. Give unit= in Python, unit in a scene file, or --unit.",
    )


def without_flat_faces(mesh: Mended) -> Mended:
    """Leave out faces without an area; their neighbours close the gap."""
    vectors = face_vectors(mesh.vertices, mesh.faces)
    corners = mesh.vertices[mesh.faces]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    extent = float(np.ptp(mesh.vertices, axis=0).max())
    flat = np.linalg.norm(vectors, axis=1) <= FLAT * extent * sides
    if not flat.any():
        return mesh
    if flat.all():
        msg = f"faces must have an area, got {len(flat)} without one."
        raise ValueError(msg)
    note = (
        f"{int(flat.sum())} of {len(flat)} faces without an area were left out, "
        f"{named('face', mesh.source[flat])}."
    )
    return Mended(
        vertices=mesh.vertices,
        faces=mesh.faces[~flat],
        labels=None if mesh.labels is None else mesh.labels[~flat],
        source=mesh.source[~flat],
        notes=(*mesh.notes, note),
    )


def named(kind: str, numbers: np.ndarray) -> str:
    """Name the first few of some faces."""
    listed = ", ".join(str(int(k)) for k in numbers[:NAMED])
    more = " ..." if len(numbers) > NAMED else ""
    return f"{kind}{'s' if len(numbers) > 1 else ''} {listed}{more}"
