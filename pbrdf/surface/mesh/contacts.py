"""Faces of solids that coincide: nothing says whether there is air between them."""

from itertools import product

import numpy as np

from pbrdf.surface.mesh.mending import Mended, named
from pbrdf.surface.mesh.topology import face_vectors

__all__ = ["check_contacts"]

# Planes are the same to this many decimals of their normal and of the extent of the mesh
DECIMALS = 6
# Points of a face, as shares of its corners, and most points of a solid in one plane
SHARES = np.array(
    [[0.34, 0.35, 0.31], [0.82, 0.11, 0.07], [0.1, 0.79, 0.11], [0.08, 0.1, 0.82]]
)
MOST_POINTS = 400


def check_contacts(
    mesh: Mended, number: np.ndarray, period: tuple[float, float] | None
) -> None:
    """Refuse faces of transparent solids that coincide with those of other solids.

    `number` is that of the solid of each face, 0 of opaque ones.

    Raises
    ------
    ValueError
        If there are any.
    """
    vertices, faces = mesh.vertices, mesh.faces
    plane = _planes(vertices, faces)
    clear = np.unique(plane[number > 0])
    for one in clear:
        here = np.flatnonzero(plane == one)
        owners = np.unique(number[here])
        if len(owners) < 2:
            continue
        for solid in owners[owners > 0]:
            mine, others = here[number[here] == solid], here[number[here] != solid]
            hit = _covered(vertices, faces[mine], faces[others], period)
            if hit is not None:
                msg = (
                    "transparent solids must not share faces with others, got faces that "
                    f"coincide, {named('face', mesh.source[others])}, at ({hit[0]:.6g}, "
                    f"{hit[1]:.6g}, {hit[2]:.6g}) um. Sink one solid into the other for "
                    "optical contact, or leave a gap of air."
                )
                raise ValueError(msg)


def _planes(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Give each face the number of its plane, whichever side it looks to."""
    normal = face_vectors(vertices, faces)
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    leading = np.abs(normal).argmax(axis=1)
    normal = normal * np.sign(np.take_along_axis(normal, leading[:, None], axis=1))
    middle = vertices.mean(axis=0)
    extent = float(np.ptp(vertices, axis=0).max())
    offset = ((vertices[faces[:, 0]] - middle) * normal).sum(axis=1) / extent
    key = np.round(np.column_stack([normal, offset]), DECIMALS) + 0.0
    number: np.ndarray = np.unique(key, axis=0, return_inverse=True)[1].ravel()
    return number


def _covered(
    vertices: np.ndarray,
    mine: np.ndarray,
    others: np.ndarray,
    period: tuple[float, float] | None,
) -> np.ndarray | None:
    """Point of some faces that lies on one of the others in their plane, or None."""
    for inner, outer in ((mine, others), (others, mine)):
        points = (SHARES @ vertices[inner]).reshape(-1, 3)
        points = points[:: -(-len(points) // MOST_POINTS)]
        a, b, c = (vertices[outer[:, k]] for k in range(3))
        across = np.cross(b - a, c - a)
        axis = int(np.abs(across).sum(axis=0).argmax())
        u, v = [k for k in range(3) if k != axis]
        steps = product((-1, 0, 1), repeat=2) if period is not None else [(0, 0)]
        for step in steps:
            move = [*np.multiply(step, period or (0.0, 0.0)), 0.0]
            for point in points + np.array(move):
                sides = [
                    (q[:, u] - p[:, u]) * (point[v] - p[:, v])
                    - (q[:, v] - p[:, v]) * (point[u] - p[:, u])
                    for p, q in ((a, b), (b, c), (c, a))
                ]
                low, high = np.min(sides, axis=0), np.max(sides, axis=0)
                if ((low > 0.0) | (high < 0.0)).any():
                    found: np.ndarray = point
                    return found
    return None
