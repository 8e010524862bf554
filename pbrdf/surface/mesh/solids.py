"""Solids of a mesh that light goes through: which they are, and whether they are closed."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from pbrdf.surface.mesh.contacts import check_contacts
from pbrdf.surface.mesh.mending import named
from pbrdf.surface.mesh.sides import Sided
from pbrdf.surface.mesh.topology import face_vectors, winding_numbers

__all__ = ["Solids", "transparent_solids"]

Period = tuple[float, float] | None
# Layers that face up and down over a period leave at most this share of it uncovered
UNEVEN = 1e-3


class Solids(NamedTuple):
    """Solids that light goes through: of each face the number, from 1 on, and their labels.

    0 is the number of opaque faces.
    """

    number: np.ndarray
    labels: tuple[int, ...]


def transparent_solids(
    transparent: bool | Sequence[int], sided: Sided, period: Period
) -> Solids:
    """Find the solids of a mesh that light goes through.

    A solid is a part of the mesh with the walls of the hollows in it; all layers of a label
    that go on over the period are one.

    Raises
    ------
    TypeError, ValueError
        If they are no labels of the mesh, one of them is not that of closed solids, or
        solids share faces.
    """
    faces = sided.mesh.faces
    labels = sided.mesh.labels
    if labels is None:
        labels = np.zeros(len(faces), dtype=np.uint8)
    number = np.zeros(len(faces), dtype=np.int32)
    of_solid: list[int] = []
    for label in _chosen(transparent, np.unique(labels).tolist()):
        mine = labels == label
        _check_parts(label, mine, sided)
        solids = _joined(label, mine, sided, period)
        number[mine] = len(of_solid) + 1 + solids
        of_solid += [label] * (int(solids.max()) + 1)
    if of_solid:
        check_contacts(sided.mesh, number, period)
    return Solids(number, tuple(of_solid))


def _chosen(transparent: bool | Sequence[int], known: list[int]) -> tuple[int, ...]:
    if isinstance(transparent, bool | np.bool_):
        return tuple(known) if transparent else ()
    several = isinstance(transparent, Sequence | np.ndarray | set)
    several = several and not isinstance(transparent, str)
    numbers: list[Any] = list(transparent) if several else [transparent]
    for one in numbers:
        if isinstance(one, bool) or not isinstance(one, int | np.integer):
            msg = (
                "transparent must be True, False or labels of the mesh, got "
                f"{one!r}. Write the numbers of materials, such as [1]."
            )
            raise TypeError(msg)
        if one not in known:
            msg = (
                "transparent must hold labels of the mesh, got "
                f"{one}. Its labels are {', '.join(map(str, known))}."
            )
            raise ValueError(msg)
    return tuple(sorted({int(one) for one in numbers}))


def _check_parts(label: int, mine: np.ndarray, sided: Sided) -> None:
    """Refuse parts that are open, or of several labels."""
    body, source = sided.body, sided.mesh.source
    is_open = mine & ~sided.closed[body]
    if is_open.any():
        msg = (
            f"transparent solids must be closed, got {int(is_open.sum())} faces of label "
            f"{label} in open parts, {named('face', source[is_open])}. Close them, also "
            "where they are sunk in others, or leave the label out of transparent."
        )
        raise ValueError(msg)
    others = ~mine & np.isin(body, np.unique(body[mine]))
    if others.any():
        msg = (
            f"transparent solids must be of one label each, got {int(others.sum())} faces "
            f"of others in parts of label {label}, {named('face', source[others])}. Give "
            "all faces of a part one label; a coat is a body of its own."
        )
        raise ValueError(msg)


def _joined(label: int, mine: np.ndarray, sided: Sided, period: Period) -> np.ndarray:
    """Give each face of a label the number of its solid, from 0 on."""
    vertices, faces = sided.mesh.vertices, sided.mesh.faces[mine]
    kept, part = np.unique(sided.body[mine], return_inverse=True)
    count = len(kept)
    up = 0.5 * face_vectors(vertices, faces)[:, 2]
    z = vertices[faces, 2].mean(axis=1)
    # Divergence theorem with the field (0, 0, z), which knows no seam
    volume = np.bincount(part, weights=up * (z - z.min()), minlength=count)
    solid = np.arange(count)
    if period is not None:
        covers = np.bincount(part, weights=up, minlength=count)
        layers = np.abs(covers) > UNEVEN * np.prod(period)
        if layers.any():
            _check_layers(label, covers[layers], volume[layers], period)
            solid[layers] = np.flatnonzero(layers)[0]
            volume[layers] = volume[layers].sum()
    for hollow in np.flatnonzero(volume <= 0.0):
        face = faces[np.flatnonzero(part == hollow)[0]]
        point = np.array([[0.47, 0.32, 0.21]]) @ vertices[face]
        # In several, it is hollow in one of them and filled by the others
        around = (
            one
            for one in np.unique(solid[volume > 0.0])
            if winding_numbers(point, vertices, faces[solid[part] == one], period)[0] > 0.0
        )
        found = next(around, None)
        if found is None:
            msg = (
                f"hollows must lie in transparent solids, got none of label {label} around "
                f"the one at face {int(sided.mesh.source[mine][part == hollow][0])}. Give "
                "the walls of a hollow the label of the solid around it."
            )
            raise ValueError(msg)
        solid[hollow] = found
    numbers: np.ndarray = np.unique(solid, return_inverse=True)[1][part]
    return numbers


def _check_layers(
    label: int, covers: np.ndarray, volume: np.ndarray, period: tuple[float, float]
) -> None:
    """Refuse layers without a lower side, or with the sides exchanged."""
    if abs(covers.sum()) > UNEVEN * np.prod(period):
        msg = (
            "transparent solids must have a lower side, got a net area upwards of "
            f"{covers.sum():.6g} um² for label {label}. Add the lower side of the layer, "
            "or leave the label out of transparent."
        )
        raise ValueError(msg)
    if volume.sum() <= 0.0:
        msg = (
            f"transparent layers must face outwards, got the upper side of label {label} "
            "looking down. Turn both sides."
        )
        raise ValueError(msg)
