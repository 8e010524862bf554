"""Which side of a mesh is out, where it is open, and what lies below it."""

from typing import NamedTuple

import numpy as np

from pbrdf.surface.mesh.mending import Mended, named
from pbrdf.surface.mesh.topology import (
    Edges,
    consistent,
    face_vectors,
    parts,
    seam_pairs,
    snapped,
    winding_numbers,
)

# What light finds below the mesh: a solid that it cannot pass (ground), nothing (bodies),
# or an open sheet that is taken to go on beyond its rim (sheet)
KINDS = ("ground", "bodies", "sheet")
# The rim of a sheet reaches over at least this share of its extent, that of a hole less
RIM = 0.9
# Points of open rims that are looked at in all, and how far below they are looked at
RIM_POINTS = 2000
BELOW = 1e-4


class Sided(NamedTuple):
    """A mesh whose faces look out of the solid, and what kind of mesh it is.

    `body` numbers the part that each face belongs to; `closed` says of each part whether it
    is a closed body, or a layer of a mesh that is closed towards below.
    """

    mesh: Mended
    kind: str
    body: np.ndarray
    closed: np.ndarray


def with_sides(mesh: Mended, period: tuple[float, float] | None) -> Sided:
    """Turn faces so that all look out of the solid, and refuse what is open.

    Raises
    ------
    ValueError
        If a part has one side only, edges belong to too many faces, there are holes, or two
        grounds lie above each other.
    """
    vertices, faces = mesh.vertices, mesh.faces
    notes = list(mesh.notes)
    turned, torn = consistent(faces)
    if torn.any():
        msg = (
            f"faces must have two sides, got {int(torn.sum())} in parts that have one, "
            f"as a Möbius strip has, {named('face', mesh.source[torn])}. Cut them apart."
        )
        raise ValueError(msg)
    if turned.any():
        notes.append(
            f"{int(turned.sum())} of {len(faces)} faces looked the other way than their "
            f"neighbours and were turned, {named('face', mesh.source[turned])}."
        )
        faces = np.where(turned[:, None], faces[:, ::-1], faces)

    edges = Edges.of(faces)
    unpaired = edges.net != 0
    crowded = unpaired & (edges.counts > 2)
    if crowded.any():
        bad = mesh.source[edges.face[edges.start[:-1][crowded]]]
        msg = (
            f"edges must lie between two faces, got {int(crowded.sum())} with "
            f"three or more that do not pair, {named('face', bad)}. Separate the parts "
            "that meet there."
        )
        raise ValueError(msg)
    open_edges = edges.start[:-1][unpaired]
    ends = edges.ends[open_edges]
    # Neighbours in the list are neighbours on the mesh where they are of one edge
    within = np.ones(len(edges.face) - 1, dtype=bool)
    within[edges.start[1:-1] - 1] = False
    links = [(edges.face[:-1][within], edges.face[1:][within])]
    if period is not None:
        one, other, meeting = seam_pairs(vertices, ends, period)
        vertices = snapped(vertices, meeting, period)
        links.append((edges.face[open_edges[one]], edges.face[open_edges[other]]))
        left = np.ones(len(ends), dtype=bool)
        left[one] = left[other] = False
        open_edges, ends = open_edges[left], ends[left]
    body = parts(len(faces), *links)
    faces, kind, flipped = _turned_out(
        vertices, faces, body, edges.face[open_edges], ends, period, mesh.source
    )
    if flipped.any():
        notes.append(
            f"{int(flipped.sum())} of {int(body.max()) + 1} parts looked inwards and were "
            f"turned, {named('part', np.flatnonzero(flipped))}."
        )
    done = Mended(
        vertices=vertices, faces=faces, labels=mesh.labels, source=mesh.source,
        notes=tuple(notes),
    )  # fmt: skip
    closed = np.ones(int(body.max()) + 1, dtype=bool)
    closed[body[edges.face[open_edges]]] = False
    return Sided(done, kind, body, closed)


def _turned_out(
    vertices: np.ndarray,
    faces: np.ndarray,
    body: np.ndarray,
    open_faces: np.ndarray,
    ends: np.ndarray,
    period: tuple[float, float] | None,
    source: np.ndarray,
) -> tuple[np.ndarray, str, np.ndarray]:
    """Faces with all parts turned out, the kind of mesh, and which parts were turned."""
    count = int(body.max()) + 1
    up = 0.5 * face_vectors(vertices, faces)[:, 2]
    area = np.bincount(body, weights=up, minlength=count)
    # Divergence theorem with the field (0, 0, z), which knows no seam
    z = vertices[faces, 2]
    volume = np.bincount(body, weights=up * (z.mean(axis=1) - z.min()), minlength=count)
    is_open = np.bincount(body[open_faces], minlength=count) > 0
    flip = np.zeros(count, dtype=bool)

    if period is None:
        ground = np.zeros(count, dtype=bool)
        sheet = _sheet(vertices, faces, body, is_open, body[open_faces], ends)
        if sheet is not None:
            ground[sheet] = True
        kind = "bodies" if sheet is None else "sheet"
        flip[ground] = area[ground] < 0.0
        layers = ground & False
    else:
        share = area / np.prod(period)
        laps = np.round(share)
        uneven = ~is_open & ((np.abs(share - laps) > 1e-3) | (np.abs(laps) > 1.0))
        if uneven.any():
            worst = int(np.flatnonzero(uneven)[0])
            msg = (
                "period must be that of the mesh [um], got "
                f"{period[0]:g} x {period[1]:g}, of which a closed part covers "
                f"{share[worst]:.4g} times. Give the lengths after which the mesh repeats."
            )
            raise ValueError(msg)
        layers = ~is_open & (laps != 0.0)
        ground = layers
        if layers.sum() == 1:
            flip |= layers & (laps < 0.0)
        elif laps[layers].sum() not in (0.0, 1.0):
            msg = (
                "mesh must be one ground or bodies, got "
                f"{int(layers.sum())} layers that each cover the period. Turn the lower "
                "side of a slab downwards, or leave layers out."
            )
            raise ValueError(msg)
        total = np.where(flip, -laps, laps)[layers].sum()
        kind = "ground" if total == 1.0 else "bodies"

    closed = ~is_open & ~layers
    inward = closed & (volume < 0.0)
    if inward.any():
        outward = closed & (volume > 0.0)
        if not outward.any() and not ground.any():
            flip |= inward
        else:
            flip |= _not_hollows(vertices, faces, body, inward, flip, period)
    caps = is_open & ~ground
    flip |= caps & (area < 0.0)
    faces = np.where(flip[body][:, None], faces[:, ::-1], faces)
    if caps.any():
        _check_rims(vertices, faces, body, caps, open_faces, ends, period, source)
    return faces, kind, flip


def _sheet(
    vertices: np.ndarray,
    faces: np.ndarray,
    body: np.ndarray,
    is_open: np.ndarray,
    open_body: np.ndarray,
    ends: np.ndarray,
) -> int | None:
    """Part that is an open sheet: its rim reaches over its extent; the largest of such."""
    best, largest = None, 0.0
    for part in np.flatnonzero(is_open):
        inside = vertices[faces[body == part].ravel(), :2]
        rim = vertices[ends[open_body == part].ravel(), :2]
        size, reach = np.ptp(inside, axis=0), np.ptp(rim, axis=0)
        if (reach >= RIM * size).all() and size.prod() > largest:
            best, largest = int(part), float(size.prod())
    return best


def _not_hollows(
    vertices: np.ndarray,
    faces: np.ndarray,
    body: np.ndarray,
    inward: np.ndarray,
    flip: np.ndarray,
    period: tuple[float, float] | None,
) -> np.ndarray:
    """Inward parts that are not the walls of a hollow in another: these are inside out."""
    wrong = np.zeros(len(inward), dtype=bool)
    others = ~inward[body]
    rest = np.where(flip[body][:, None], faces[:, ::-1], faces)[others]
    for part in np.flatnonzero(inward):
        face = faces[np.flatnonzero(body == part)[0]]
        point = np.array([0.47, 0.32, 0.21]) @ vertices[face]
        wrong[part] = winding_numbers(point[None], vertices, rest, period)[0] < 1.0
    return wrong


def _cure(vertices: np.ndarray, period: tuple[float, float] | None) -> str:
    """Say what may be wrong with open edges."""
    fill = "the holes (trimesh.repair.fill_holes) or merge vertices that nearly meet"
    if period is None:
        return f"Fill {fill}, or give the period if they are its seam."
    x, y = np.ptp(vertices[:, :2], axis=0)
    return (
        f"The mesh is {x:.9g} x {y:.9g} um wide, and its sides do not meet over the "
        f"period {period}; check that, or fill {fill}."
    )


def _check_rims(
    vertices: np.ndarray,
    faces: np.ndarray,
    body: np.ndarray,
    caps: np.ndarray,
    open_faces: np.ndarray,
    ends: np.ndarray,
    period: tuple[float, float] | None,
    source: np.ndarray,
) -> None:
    """Refuse open edges that light can reach: those that do not lie in other parts."""
    mine = np.flatnonzero(caps[body[open_faces]])
    step = -(-len(mine) // RIM_POINTS)
    looked = mine[::step]
    points = 0.53 * vertices[ends[looked, 0]] + 0.47 * vertices[ends[looked, 1]]
    points[:, 2] -= BELOW * float(np.ptp(vertices, axis=0).max())
    of = body[open_faces[looked]]
    hidden = np.zeros(len(looked), dtype=bool)
    for part in np.unique(of):
        chosen = of == part
        hidden[chosen] = (
            winding_numbers(points[chosen], vertices, faces[body != part], period) >= 1.0
        )
    if not hidden.all():
        bad = looked[~hidden]
        middle = vertices[ends[bad[0]]].mean(axis=0)
        msg = (
            f"mesh must be closed, got {len(mine)} open edges, the first at "
            f"({middle[0]:.6g}, {middle[1]:.6g}, {middle[2]:.6g}) um, "
            f"{named('face', source[open_faces[bad]])}. {_cure(vertices, period)}"
        )
        raise ValueError(msg)
