"""What lies on one surface sample: convex bodies and a film, placed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np
from scipy.spatial import cKDTree

from pbrdf.contaminants.ground import Ground
from pbrdf.contaminants.mesh_ground import MeshGround
from pbrdf.contaminants.shapes import Shape
from pbrdf.kernels.bodies.profile import widest_above
from pbrdf.optics.materials import Material
from pbrdf.surface.heightmap import HeightMap
from pbrdf.surface.mesh import MeshSurface

# How far below the lowest point of the surface a body still counts, relative to its height
BELOW = 1e-6
# Relative to their size, what two bodies that are the same may differ by
SAME = 1e-9


@dataclass(frozen=True, eq=False)
class Bodies:
    """Convex bodies of revolution about vertical axes, cut by the height field.

    A body is a stack of quadric slabs, r² = a + b s + c s² at the height s above its
    reference height, between low and high; r² is continuous with its slope. What is inside
    the body and above the surface is the drop or particle.

    Attributes
    ----------
    x, y, z : ndarray, shape (n,)
        Axis and reference height. [um]
    slab_start : ndarray of int, shape (n + 1,)
        Slabs of body k are slab_start[k] to slab_start[k + 1], from below.
    slabs : ndarray, shape (m, 5)
        low, high, a, b, c. [um]
    radius : ndarray, shape (n,)
        Largest radius of what lies above the lowest point of the surface. [um]
    z_low, z_high : ndarray, shape (n,)
        Heights between which that part lies. [um]
    material : ndarray of int, shape (n,)
        Number in `materials`.
    materials : tuple of Material
        Materials of bodies and film, in the order of the scene.
    """

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    slab_start: np.ndarray
    slabs: np.ndarray
    radius: np.ndarray
    z_low: np.ndarray
    z_high: np.ndarray
    material: np.ndarray
    materials: tuple[Material, ...]

    def __len__(self) -> int:
        return len(self.x)

    def shape(self, k: int) -> Shape:
        """Shape of body k about its reference height."""
        return Shape(self.slabs[self.slab_start[k] : self.slab_start[k + 1]])


class PlacedFilm(NamedTuple):
    """A film: its upper side is the plane z = value, or the surface raised by value."""

    level: bool
    value: float
    material: int


@dataclass(frozen=True, eq=False)
class Placement:
    """Bodies and film on one surface sample, and what each contaminant became.

    Attributes
    ----------
    bodies : Bodies
        Where two overlap, the first of them rules.
    film : PlacedFilm or None
        At most one.
    reports : tuple of mappings
        One for each contaminant; `notes` holds its warnings.
    """

    bodies: Bodies
    film: PlacedFilm | None
    reports: tuple[Mapping[str, Any], ...]

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings of all contaminants, each once."""
        return tuple(dict.fromkeys(note for r in self.reports for note in r["notes"]))


@dataclass(frozen=True, eq=False, kw_only=True)
class Settled:
    """One contaminant on one surface sample: bodies, or a film (level, value) [um]."""

    shapes: Sequence[Shape] = ()
    x: np.ndarray = field(default_factory=lambda: np.empty(0))
    y: np.ndarray = field(default_factory=lambda: np.empty(0))
    z: np.ndarray = field(default_factory=lambda: np.empty(0))
    film: tuple[bool, float] | None = None
    report: Mapping[str, Any]


class Contaminant(Protocol):
    """What a scene may hold besides surface and substrate."""

    @property
    def material(self) -> Material:
        """What it consists of."""
        ...

    def settle(self, ground: Ground, seed: np.random.SeedSequence) -> Settled:
        """Lay it on a surface."""
        ...


def place(
    contaminants: Sequence[Contaminant],
    surface: HeightMap | MeshSurface,
    seed: np.random.SeedSequence,
) -> Placement:
    """Lay contaminants on a surface.

    Parameters
    ----------
    contaminants : sequence
        Drops, spheres and films in the order of the scene.
    surface : HeightMap or MeshSurface
        The surface; bodies repeat with it if it is periodic.
    seed : SeedSequence
        Makes what is random reproducible; not changed.

    Raises
    ------
    ValueError
        If a body is wider than a period or leaves a finite map, there is no room, or two
        contaminants are films.
    """
    ground = MeshGround(surface) if isinstance(surface, MeshSurface) else Ground(surface)
    materials: list[Material] = []
    settled: list[tuple[int, Settled]] = []
    film: PlacedFilm | None = None
    for number, contaminant in enumerate(contaminants):
        if contaminant.material not in materials:
            materials.append(contaminant.material)
        index = materials.index(contaminant.material)
        child = np.random.SeedSequence(
            entropy=seed.entropy, spawn_key=(*seed.spawn_key, number)
        )
        here = contaminant.settle(ground, child)
        settled.append((index, here))
        if here.film is not None:
            if film is not None:
                msg = (
                    "contaminants must hold at most one film, got two (drops that wet "
                    "completely are one). Leave one out."
                )
                raise ValueError(msg)
            film = PlacedFilm(*here.film, index)
    bodies = _assemble(ground, settled, tuple(materials))
    return Placement(bodies, film, tuple(here.report for _, here in settled))


def _assemble(
    ground: Ground, settled: Sequence[tuple[int, Settled]], materials: tuple[Material, ...]
) -> Bodies:
    """Join the bodies of all contaminants into one table."""
    shapes = [shape for _, here in settled for shape in here.shapes]
    x, y, z = (
        np.concatenate([np.empty(0), *(getattr(here, name) for _, here in settled)])
        for name in "xyz"
    )
    x, y = ground.wrapped(np.column_stack([x, y])).T.copy()
    material = np.concatenate(
        [np.empty(0, np.int64)]
        + [np.full(len(here.x), index, np.int64) for index, here in settled]
    )
    rules = _not_filled_before(ground, shapes, np.column_stack([x, y, z]))
    shapes = [shape for shape, kept in zip(shapes, rules, strict=True) if kept]
    x, y, z, material = x[rules], y[rules], z[rules], material[rules]
    # What lies below the surface everywhere is of no concern
    floor = ground.lowest - z
    cut = [
        max(shape.bottom, level - BELOW * shape.height)
        for shape, level in zip(shapes, floor, strict=True)
    ]
    radius = np.array(
        [widest_above(s.slabs, level) for s, level in zip(shapes, cut, strict=True)]
    )
    _check_extent(ground, x, y, radius)
    counts = [len(shape.slabs) for shape in shapes]
    return Bodies(
        x=x,
        y=y,
        z=z,
        slab_start=np.concatenate([[0], np.cumsum(counts, dtype=np.int64)]).astype(
            np.int64
        ),
        slabs=np.concatenate([np.empty((0, 5)), *(shape.slabs for shape in shapes)]),
        radius=radius,
        z_low=z + np.array(cut),
        z_high=z + np.array([shape.height for shape in shapes]),
        material=material,
        materials=materials,
    )


def _not_filled_before(
    ground: Ground, shapes: Sequence[Shape], place: np.ndarray
) -> np.ndarray:
    """Which bodies are not the very same as one before, which rules all that they hold.

    A beam would meet both surfaces at one point, in the order of rounding.
    """
    kept = np.ones(len(shapes), dtype=bool)
    if len(shapes) < 2:
        return kept
    period = (*ground.size, 0.0) if ground.periodic else None
    heights = np.array([shape.height for shape in shapes])
    tree = cKDTree(
        np.where(place == period, 0.0, place) if period else place, boxsize=period
    )
    for one, other in sorted(tree.query_pairs(SAME * heights.max())):
        near, far = shapes[one].slabs, shapes[other].slabs
        if kept[one] and near.shape == far.shape:
            apart = place[one] - place[other]
            apart[:2] = ground.nearest(apart[:2])
            close = SAME * heights[one]
            kept[other] &= not (
                np.abs(apart).max() <= close and np.allclose(near, far, SAME, close)
            )
    return kept


def _check_extent(ground: Ground, x: np.ndarray, y: np.ndarray, radius: np.ndarray) -> None:
    """Refuse bodies wider than a period, or across the rim of a finite map."""
    lengths = ground.size
    if ground.periodic:
        wide = np.flatnonzero(2 * radius > min(lengths))
        if wide.size:
            msg = (
                f"bodies must be narrower than the period {min(lengths):g} um, got "
                f"{2 * radius[wide[0]]:.4g} um for body {wide[0]}. Take a larger surface "
                "or less volume."
            )
            raise ValueError(msg)
        return
    left, front = ground.corner
    outside = (
        (x - radius < left)
        | (x + radius > left + lengths[0])
        | (y - radius < front)
        | (y + radius > front + lengths[1])
    )
    if outside.any():
        k = int(np.flatnonzero(outside)[0])
        what, cure = "map", "map periodic with HeightMap.mirrored()"
        if isinstance(ground, MeshGround):
            what, cure = "mesh", "mesh periodic with period="
        msg = (
            f"bodies must lie inside the finite {what} of {lengths[0]:g} x "
            f"{lengths[1]:g} um, "
            f"got one of radius {radius[k]:.4g} um about ({x[k]:.4g}, {y[k]:.4g}) um. "
            f"Move it, or make the {cure}."
        )
        raise ValueError(msg)
