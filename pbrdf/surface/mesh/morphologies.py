"""Ready-made surfaces that no height map can hold, from few parameters and a seed.

All are opaque, periodic, and bodies may cut into each other: light sees their union.
"""

import warnings
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull

from pbrdf.errors import AccuracyWarning, require
from pbrdf.surface.mesh.surface import MeshSurface
from pbrdf.surface.periodic import nearest

__all__ = ["fibres", "flakes", "grit", "pillars", "porous_sheet", "spheres_on_plane"]

Solid = tuple[np.ndarray, np.ndarray]
# Random places without overlap fill a plane up to 0.547; from here on they take too long
MOST_COVERAGE = 0.5
MOST_TRIES = 200_000
# Bodies stand this share of their size in the ground, so that they touch it
SUNK = 1e-3
# Whole bodies may cover so much more or less than asked for, by share of it
UNLIKE = 0.1
# Flakes float so high that those of so many rms tilts clear the plane
MOST_TILTS = 3.0


def spheres_on_plane(
    *, period: tuple[float, float], radius: float, coverage: float, seed: int = 0,
    subdivisions: int = 3,
) -> MeshSurface:  # fmt: skip
    """Equal spheres at random places on a plane, none over another.

    Parameters
    ----------
    period : (float, float)
        Periods along x and y. [um]
    radius : float
        Radius of the spheres. [um]
    coverage : float
        Share of the plane below spheres, at most 0.5. [1]
    seed : int
        Of their places.
    subdivisions : int
        A sphere has 20 * 4**subdivisions facets.

    Examples
    --------
    >>> spheres_on_plane(period=(9, 9), radius=1.0, coverage=0.3, subdivisions=1)
    MeshSurface(642 faces, ground, period=(9.0, 9.0) um)
    """
    import trimesh

    lengths = _lengths(period)
    size = _positive("radius", radius)
    share = _share("coverage", coverage, MOST_COVERAGE)
    rng = np.random.default_rng(seed)
    count = _count(share, lengths, np.pi * size**2)
    ball = trimesh.creation.icosphere(subdivisions=subdivisions, radius=size)
    points = np.asarray(ball.vertices)
    solids = [_plane(lengths)]
    for x, y in _apart(lengths, 2.0 * size, count, rng):
        turned = points @ _turn(rng).T
        # Facets lie inside the sphere: what is lowest touches the plane
        turned[:, 2] -= turned[:, 2].min() + SUNK * size
        solids.append((turned + np.array([x, y, 0.0]), np.asarray(ball.faces)))
    return _surface(solids, lengths)


def pillars(
    *, period: tuple[float, float], radius: float, height: float, sections: int = 32,
    overhang: float = 0.0,
) -> MeshSurface:  # fmt: skip
    """One upright pillar a period, square or otherwise as the period is.

    Parameters
    ----------
    period : (float, float)
        Distances of the pillars along x and y. [um]
    radius, height : float
        Of a pillar. [um]
    sections : int
        Facets around it.
    overhang : float
        A cap on it is wider by this and as high as that, so that it hangs over. [um]
    """
    lengths = _lengths(period)
    size, tall = _positive("radius", radius), _positive("height", height)
    wide = size + float(
        require("overhang", overhang, lambda v: v >= 0, "be 0 or more [um]", "0 is none.")
    )
    if 2.0 * wide >= lengths.min():
        msg = (
            f"radius and overhang must leave gaps between pillars [um], got {wide:g} in a "
            f"period of {lengths.min():g}. Take a larger period."
        )
        raise ValueError(msg)
    z = [-SUNK * tall, tall]
    r = [size, size]
    if wide > size:
        top = tall + wide - size
        z, r = [-SUNK * tall, tall, tall, top], [size, size, wide, wide]
    turned = turned_body(np.array(r), np.array(z), sections)
    middle = [*(lengths / 2), 0.0]
    return _surface([_plane(lengths), (turned[0] + middle, turned[1])], lengths)


def fibres(
    *, period: tuple[float, float], radius: float, length: float, coverage: float,
    layers: float = 2.0, seed: int = 0, sections: int = 12,
) -> MeshSurface:  # fmt: skip
    """Straight fibres that lie at random over each other on a plane.

    Parameters
    ----------
    period : (float, float)
        Periods along x and y. [um]
    radius, length : float
        Of a fibre, with flat ends. [um]
    coverage : float
        Area of all fibres as seen from above, those below others counted, in that of the
        plane; may be more than 1. [1]
    layers : float
        Height of the heap in diameters of a fibre. [1]
    seed : int
        Of places, azimuths and heights.
    sections : int
        Facets around a fibre.
    """
    lengths = _lengths(period)
    size, long = _positive("radius", radius), _positive("length", length)
    share = _share("coverage", coverage, 20.0)
    heap = float(require("layers", layers, lambda v: v >= 1, "be 1 or more", "1 is flat."))
    rng = np.random.default_rng(seed)
    count = _count(share, lengths, 2.0 * size * long)
    rod = turned_body(np.array([size, size]), np.array([-long / 2, long / 2]), sections)
    lying = rod[0][:, [2, 0, 1]]
    solids = [_plane(lengths)]
    for _ in range(count):
        x, y = rng.random(2) * lengths
        # A fibre leans as far as half of the heap lets its ends, and then rests somewhere
        depth = 2.0 * size * (heap - 1.0)
        lean = np.arcsin(min(depth / long, 1.0)) * rng.uniform(-0.5, 0.5)
        rise = long * abs(np.sin(lean))
        z = size * (1.0 - SUNK) + rise / 2 + max(depth - rise, 0.0) * rng.random()
        turn = _about_z(rng.uniform(0.0, 2.0 * np.pi)) @ _about_y(lean)
        turned = lying @ turn.T
        solids.append((turned + np.array([x, y, z]), rod[1]))
    return _surface(solids, lengths)


def flakes(
    *, period: tuple[float, float], radius: float, thickness: float, coverage: float,
    tilt_rms: float, seed: int = 0, sections: int = 9,
) -> MeshSurface:  # fmt: skip
    """Thin flakes at random tilts above a plane, as metal flakes that float up in a paint.

    Parameters
    ----------
    period : (float, float)
        Periods along x and y. [um]
    radius, thickness : float
        Of a flake. [um]
    coverage : float
        Area of all flakes in that of the plane; may be more than 1. [1]
    tilt_rms : float
        Rms of the slopes of flakes, per axis. [1]
    seed : int
        Of places and tilts.
    sections : int
        Corners of a flake.
    """
    lengths = _lengths(period)
    size, thick = _positive("radius", radius), _positive("thickness", thickness)
    share = _share("coverage", coverage, 20.0)
    steep = float(
        require("tilt_rms", tilt_rms, lambda v: (v >= 0) & (v < 3), "lie in [0, 3)", "0.1.")
    )
    rng = np.random.default_rng(seed)
    count = _count(share, lengths, np.pi * size**2)
    disc = turned_body(np.array([size, size]), np.array([0.0, thick]), sections)
    solids = [_plane(lengths)]
    lowest = size * min(MOST_TILTS * steep, 1.0) + thick
    # Each on a level of its own; steep ones cut through their neighbours
    for level in range(count):
        slope_x, slope_y = rng.normal(0.0, steep, 2)
        tilt = np.arctan(np.hypot(slope_x, slope_y))
        turn = _about_z(np.arctan2(slope_y, slope_x)) @ _about_y(tilt)
        turned = disc[0] @ (turn @ _about_z(rng.uniform(0.0, 2.0 * np.pi))).T
        place = np.array([*(rng.random(2) * lengths), lowest + 2.0 * thick * level])
        solids.append((turned + place, disc[1]))
    return _surface(solids, lengths)


def porous_sheet(
    *, period: float, radius: float, thickness: float, sections: int = 32
) -> MeshSurface:
    """Flat sheet with round holes on a square grid, and light below it.

    Parameters
    ----------
    period : float
        Distance of the holes. [um]
    radius : float
        Of a hole. [um]
    thickness : float
        Of the sheet. [um]
    sections : int
        Facets around a hole, a multiple of 4.
    """
    side = _positive("period", period)
    size, thick = _positive("radius", radius), _positive("thickness", thickness)
    if 2.0 * size >= side:
        msg = f"radius must leave a sheet between holes [um], got {size:g} in {side:g}."
        raise ValueError(msg)
    if sections < 4 or sections % 4:
        msg = f"sections must be a multiple of 4, got {sections}."
        raise ValueError(msg)
    angle = 2.0 * np.pi * np.arange(sections) / sections
    # The square through the same directions, its corners among them
    turned = angle + np.pi / 4
    ring = np.stack([np.cos(turned), np.sin(turned)], axis=1)
    square = 0.5 * side * ring / np.abs(ring).max(axis=1, keepdims=True)
    n = sections
    points = np.concatenate(
        [
            np.column_stack([edge + side / 2, np.full(n, z)])
            for z in (0.0, -thick)
            for edge in (square, size * ring)
        ]
    )
    k = np.arange(n)
    following = (k + 1) % n
    outer, inner, below, inside = k, k + n, k + 2 * n, k + 3 * n
    quads = [
        (outer, following, following + n, inner),
        (following + 2 * n, below, inside, following + 3 * n),
        (inner, following + n, following + 3 * n, inside),
    ]
    faces = [
        np.stack(corners, axis=1)
        for a, b, c, d in quads
        for corners in ((a, b, c), (a, c, d))
    ]
    return MeshSurface((points, np.concatenate(faces)), (side, side))


def grit(
    *, period: tuple[float, float], radius: float, coverage: float, sunk: float = 0.4,
    seed: int = 0, corners: int = 16,
) -> MeshSurface:  # fmt: skip
    """Sharp grains of abrasive that stick in a plane.

    Parameters
    ----------
    period : (float, float)
        Periods along x and y. [um]
    radius : float
        Of the sphere around a grain. [um]
    coverage : float
        Share of the plane below these spheres, at most 0.5. [1]
    sunk : float
        Share of the height of a grain that is in the plane, in [0, 0.9]. [1]
    seed : int
        Of places and shapes.
    corners : int
        Of a grain, 5 or more.
    """
    lengths = _lengths(period)
    size = _positive("radius", radius)
    share = _share("coverage", coverage, MOST_COVERAGE)
    deep = float(
        require("sunk", sunk, lambda v: (v >= 0) & (v <= 0.9), "lie in [0, 0.9]", "0.4.")
    )
    if corners < 5:
        msg = f"corners must be 5 or more, got {corners}."
        raise ValueError(msg)
    rng = np.random.default_rng(seed)
    count = _count(share, lengths, np.pi * size**2)
    solids = [_plane(lengths)]
    for x, y in _apart(lengths, 2.0 * size, count, rng):
        points = rng.normal(size=(corners, 3))
        points *= size / np.linalg.norm(points, axis=1, keepdims=True)
        hull = ConvexHull(points)
        # Corners in the order in which the outside sees them
        faces = hull.simplices
        a, b, c = (points[faces[:, n]] for n in range(3))
        inwards = (np.cross(b - a, c - a) * hull.equations[:, :3]).sum(axis=1) < 0.0
        faces = np.where(inwards[:, None], faces[:, ::-1], faces)
        tall = np.ptp(points[:, 2])
        points[:, 2] -= points[:, 2].min() + max(deep, SUNK) * tall
        solids.append((points + np.array([x, y, 0.0]), faces))
    return _surface(solids, lengths)


def _surface(solids: Sequence[Solid], lengths: np.ndarray) -> MeshSurface:
    first = np.cumsum([0, *(len(points) for points, _ in solids[:-1])])
    faces = [solid[1] + k for solid, k in zip(solids, first, strict=True)]
    points = np.concatenate([points for points, _ in solids])
    return MeshSurface((points, np.concatenate(faces)), (lengths[0], lengths[1]))


def _plane(lengths: np.ndarray) -> Solid:
    x, y = lengths
    points = np.array([[0.0, 0.0, 0.0], [x, 0.0, 0.0], [x, y, 0.0], [0.0, y, 0.0]])
    return points, np.array([[0, 1, 2], [0, 2, 3]])


def turned_body(r: np.ndarray, z: np.ndarray, sections: int) -> Solid:
    """Body of revolution about z with flat ends, of which the profile goes up."""
    if sections < 3:
        msg = f"sections must be 3 or more, got {sections}."
        raise ValueError(msg)
    angle = 2.0 * np.pi * np.arange(sections) / sections
    rings = [
        np.stack([a * np.cos(angle), a * np.sin(angle), np.full(sections, b)], axis=1)
        for a, b in zip(r, z, strict=True)
    ]
    ends = np.array([[0.0, 0.0, z[0]], [0.0, 0.0, z[-1]]])
    k = np.arange(sections)
    following = (k + 1) % sections
    faces = []
    for ring in range(len(r) - 1):
        a, b = k + ring * sections, following + ring * sections
        faces += [
            np.stack([a, b, b + sections], axis=1),
            np.stack([a, b + sections, a + sections], axis=1),
        ]
    last = (len(r) - 1) * sections
    bottom, top = len(r) * sections, len(r) * sections + 1
    faces += [
        np.stack([np.full(sections, bottom), following, k], axis=1),
        np.stack([np.full(sections, top), k + last, following + last], axis=1),
    ]
    return np.concatenate([*rings, ends]), np.concatenate(faces)


def _apart(
    lengths: np.ndarray, distance: float, count: int, rng: np.random.Generator
) -> np.ndarray:
    """Random places (count, 2) of which no two images are nearer than a distance."""
    if distance > lengths.min():
        msg = (
            f"period must be no less than a body is wide, {distance:g} um, got "
            f"{lengths.tolist()}. Take a larger period or smaller bodies."
        )
        raise ValueError(msg)
    places = np.empty((count, 2))
    found = 0
    for _ in range(MOST_TRIES):
        place = rng.random(2) * lengths
        away = np.linalg.norm(nearest(places[:found] - place, lengths), axis=1)
        if (away >= distance).all():
            places[found] = place
            found += 1
            if found == count:
                return places
    msg = (
        f"coverage must leave room for bodies {distance:g} um wide, got {found} of {count} "
        f"in a period of {lengths.tolist()} um. Take less of it or a larger period."
    )
    raise ValueError(msg)


def _turn(rng: np.random.Generator) -> np.ndarray:
    """Rotation by chance, all alike."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0.0 else -q


def _about_z(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _about_y(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def _lengths(period: npt.ArrayLike) -> np.ndarray:
    lengths = require(
        "period", period, lambda v: (v > 0) & np.isfinite(v), "be positive [um]",
        "Give (lx, ly).",
    )  # fmt: skip
    return np.broadcast_to(lengths, (2,)).astype(float)


def _positive(name: str, value: float) -> float:
    return float(
        require(name, value, lambda v: (v > 0) & np.isfinite(v), "be positive [um]", "Um.")
    )


def _count(share: float, lengths: np.ndarray, each: float) -> int:
    """Whole number of bodies, each over an area, nearest to a coverage; warned if far."""
    count = max(round(share * lengths.prod() / each), 1)
    covered = count * each / lengths.prod()
    if abs(covered - share) > UNLIKE * share:
        note = (
            f"coverage is {covered:.3g} with {count} bodies a period, not {share:.3g}. "
            "Take a larger period, or smaller bodies."
        )
        warnings.warn(note, AccuracyWarning, stacklevel=3)
    return count


def _share(name: str, value: float, most: float) -> float:
    return float(
        require(
            name, value, lambda v: (v > 0) & (v <= most), f"lie in (0, {most:g}]",
            "It is a share of the area.",
        )
    )  # fmt: skip
