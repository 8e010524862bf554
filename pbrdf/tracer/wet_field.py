"""A scene with contaminants as the kernels take it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from pbrdf.contaminants.bodies import Bodies, Placement, place
from pbrdf.kernels.bodies import bodies as bodies_kernel
from pbrdf.kernels.bodies import world as scenes
from pbrdf.kernels.bodies.media import DEEP
from pbrdf.kernels.terrain.heightfield import block_maxima
from pbrdf.kernels.terrain.horizon import NO_HORIZON
from pbrdf.surface.heightmap import HeightMap
from pbrdf.tracer.field import Field

# Cells of the grid of bodies: so many for each body, and so many in any case
CELLS_PER_BODY = 4
FEWEST_CELLS = 12


@dataclass(frozen=True, kw_only=True)
class WetField:
    """A surface sample with what lies on it, built once for all directions.

    Attributes
    ----------
    field : Field
        The surface; its top is above everything that lies on it.
    world : pbrdf.kernels.bodies.world.World
        Surface, bodies, film and media.
    reports : tuple of mappings
        What each contaminant became on this sample.
    notes : tuple of str
        Warnings of the placement.
    """

    field: Field
    world: scenes.World
    reports: tuple[Mapping[str, Any], ...]
    notes: tuple[str, ...]

    @classmethod
    def of(
        cls,
        field: Field,
        surface: HeightMap,
        contaminants: Sequence[Any],
        media: scenes.Media,
        seed: np.random.SeedSequence,
        *,
        skips_deep: bool = True,
    ) -> "WetField":
        """Lay the contaminants on a surface."""
        placement = place(contaminants, surface, seed)
        world, top = world_of(field, placement, media, skips_deep=skips_deep)
        return cls(
            field=replace(field, terrain=field.terrain._replace(z_top=top)),
            world=world,
            reports=placement.reports,
            notes=placement.notes,
        )


def world_of(
    field: Field, placement: Placement, media: scenes.Media, *, skips_deep: bool = True
) -> tuple[scenes.World, float]:
    """Scene for the kernels, and a height above everything in it. [um]"""
    terrain = field.terrain
    kind, height, medium = scenes.NO_FILM, 0.0, 0
    top = terrain.z_top
    flipped = terrain
    if placement.film is not None:
        level, height, material = placement.film
        kind = scenes.LEVEL if level else scenes.CONFORMAL
        medium = 1 + material
        top = max(top, height) if level else top + height
    if kind == scenes.CONFORMAL:
        below = -terrain.heights
        # Of the same kind, or the kernels would be compiled once more
        below.setflags(write=terrain.heights.flags.writeable)
        maxima, levels = block_maxima(below, terrain.periodic)
        flipped = terrain._replace(
            heights=below, maxima=maxima, levels=levels, z_top=-field.z_bottom,
            horizon=NO_HORIZON,
        )  # fmt: skip
    film = scenes.Film(kind, float(height), medium, flipped)
    cells = np.array(terrain.heights.shape) - (0 if terrain.periodic else 1)
    bodies = register(
        placement.bodies, size=cells * np.array(field.pitch), periodic=terrain.periodic,
        z_bottom=field.z_bottom,
    )  # fmt: skip
    if len(bodies.z) > 0:
        top = max(top, bodies.z_high)
    deep = DEEP if skips_deep else np.inf
    return scenes.World(terrain, None, film, bodies, media, deep), float(top)


def register(
    bodies: Bodies, *, size: np.ndarray, periodic: bool, z_bottom: float
) -> bodies_kernel.Bodies:
    """Bodies with a grid that lists the images above each of its cells.

    `size` is the extent of the surface, whose corner is at 0, and `z_bottom` its lowest
    point. [um]
    """
    reach = bodies.radius
    visible = np.flatnonzero(reach > 0.0)
    total = CELLS_PER_BODY * len(visible) + FEWEST_CELLS
    shape = np.maximum(np.sqrt(total * size / size[::-1]).astype(int), 1)
    step = size / shape
    centre = np.stack([bodies.x, bodies.y], axis=1)
    radius = reach[visible, None]
    low = np.floor((centre[visible] - radius) / step).astype(int)
    high = np.floor((centre[visible] + radius) / step).astype(int)
    if not periodic:
        low, high = np.clip(low, 0, shape - 1), np.clip(high, 0, shape - 1)
    # One entry for each cell below the square round a body
    spans = high - low + 1
    entries = spans.prod(axis=1)
    body = np.repeat(np.arange(len(visible)), entries)
    number = np.arange(entries.sum()) - np.repeat(np.cumsum(entries) - entries, entries)
    cell = low[body] + np.stack(np.divmod(number, spans[body, 1]), axis=1)
    lap, cell = np.divmod(cell, shape)
    flat = cell[:, 0] * shape[1] + cell[:, 1]
    order = np.argsort(flat, kind="stable")
    member = visible[body[order]]
    axis = (centre[visible[body]] - lap * size)[order]
    start = np.searchsorted(flat[order], np.arange(shape.prod() + 1))
    return bodies_kernel.Bodies(
        z=np.array(bodies.z),
        radius=np.array(reach),
        medium=np.array(bodies.material, dtype=np.int64) + 1,
        slab_start=np.array(bodies.slab_start, dtype=np.int64),
        slabs=np.array(bodies.slabs, order="C"),
        z_low=max(float(bodies.z_low.min(initial=np.inf)), z_bottom),
        z_high=float(bodies.z_high.max(initial=-np.inf)),
        overlap=_overlap(centre[visible], reach[visible], size, periodic),
        cells_x=int(shape[0]),
        cells_y=int(shape[1]),
        step_x=float(step[0]),
        step_y=float(step[1]),
        size_x=float(size[0]),
        size_y=float(size[1]),
        periodic=bool(periodic),
        cell_start=start.astype(np.int64),
        member=member.astype(np.int64),
        member_x=np.ascontiguousarray(axis[:, 0]),
        member_y=np.ascontiguousarray(axis[:, 1]),
    )


def _overlap(centre: np.ndarray, reach: np.ndarray, size: np.ndarray, wraps: bool) -> bool:
    """Whether the shadows of any two bodies touch; if not, the bodies cannot."""
    if len(centre) == 0:
        return False
    if wraps and 2.0 * reach.max() >= size.min():
        return True
    tree = cKDTree(
        np.mod(centre, size) if wraps else centre, boxsize=size if wraps else None
    )
    pairs = tree.query_pairs(2.0 * reach.max(), output_type="ndarray")
    offset = tree.data[pairs[:, 0]] - tree.data[pairs[:, 1]]
    if wraps:
        offset -= size * np.round(offset / size)
    return bool((np.hypot(*offset.T) < reach[pairs].sum(axis=1)).any())
