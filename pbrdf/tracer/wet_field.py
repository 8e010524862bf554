"""A scene with contaminants as the kernels take it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from pbrdf.contaminants.bodies import Bodies, Placement, place
from pbrdf.kernels.bodies import bodies as bodies_kernel
from pbrdf.kernels.bodies import events
from pbrdf.kernels.paths.shading import base_strength
from pbrdf.kernels.terrain.heightfield import block_maxima
from pbrdf.kernels.terrain.horizon import NO_HORIZON
from pbrdf.optics.materials import Material
from pbrdf.surface.heightmap import HeightMap
from pbrdf.tracer.field import Field

# From this kappa on light dies within a few wavelengths of the surface: the body is opaque,
# and directions inside of weaker absorbers are those of a transparent one
OPAQUE_KAPPA = 0.01
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
    world : pbrdf.kernels.bodies.events.World
        Surface, bodies, film and media.
    reports : tuple of mappings
        What each contaminant became on this sample.
    notes : tuple of str
        Warnings of the placement.
    """

    field: Field
    world: events.World
    reports: tuple[Mapping[str, Any], ...]
    notes: tuple[str, ...]

    @classmethod
    def of(
        cls,
        field: Field,
        surface: HeightMap,
        contaminants: Sequence[Any],
        media: events.Media,
        seed: np.random.SeedSequence,
    ) -> "WetField":
        """Lay the contaminants on a surface."""
        placement = place(contaminants, surface, seed)
        world, top = world_of(field, placement, media)
        return cls(
            field=replace(field, terrain=field.terrain._replace(z_top=top)),
            world=world,
            reports=placement.reports,
            notes=placement.notes,
        )


def contaminant_materials(contaminants: Sequence[Any]) -> list[Material]:
    """Materials of contaminants, each once, in the order in which they rule."""
    materials: list[Material] = []
    for contaminant in contaminants:
        if contaminant.material not in materials:
            materials.append(contaminant.material)
    return materials


def media_of(
    substrate: Sequence[Material],
    contaminants: Sequence[Material],
    waves: np.ndarray | None,
) -> events.Media:
    """Optical constants of air, contaminants and solids at each wavelength.

    Raises
    ------
    ValueError
        If a transparent body absorbs and no wavelength tells how much.
    """
    count = 1 if waves is None or waves.ndim == 0 else waves.size
    n_media, first = len(contaminants) + 1, len(substrate)
    solids = [*substrate, *contaminants]
    n = np.ones((count, n_media))
    absorption = np.zeros((count, n_media))
    solid = np.full((count, n_media), -1)
    solid_n, solid_kappa = np.empty((count, len(solids))), np.empty((count, len(solids)))
    for column, material in enumerate(solids):
        solid_n[:, column], solid_kappa[:, column] = material.indices(waves)
    for medium, material in enumerate(contaminants, start=1):
        column = first + medium - 1
        index, kappa = solid_n[:, column], solid_kappa[:, column]
        opaque = (kappa >= OPAQUE_KAPPA) | np.isinf(index)
        opaque |= material == Material.black() or material.diffuse_albedo > 0.0
        solid[opaque, medium] = column
        n[~opaque, medium] = index[~opaque]
        if kappa[~opaque].any():
            if waves is None:
                msg = (
                    f"wavelength must be given [um] where a body absorbs, got None and "
                    f"kappa {kappa[~opaque].max():g}. Or take a material with kappa = 0."
                )
                raise ValueError(msg)
            absorption[:, medium] = np.where(opaque, 0.0, 4 * np.pi * kappa / waves)
    base = np.zeros((count, len(solids), n_media))
    for w, column, medium in np.ndindex(*base.shape):
        albedo = solids[column].diffuse_albedo
        ratio = solid_n[w, column] / n[w, medium]
        base[w, column, medium] = base_strength(
            albedo, ratio, solid_kappa[w, column] / n[w, medium]
        )
    black = np.array([material == Material.black() for material in solids])
    return events.Media(n, absorption, solid, solid_n, solid_kappa, base, black)


def world_of(
    field: Field, placement: Placement, media: events.Media
) -> tuple[events.World, float]:
    """Scene for the kernels, and a height above everything in it. [um]"""
    terrain = field.terrain
    kind, height, medium = events.NO_FILM, 0.0, 0
    top = terrain.z_top
    flipped = terrain
    if placement.film is not None:
        level, height, material = placement.film
        kind = events.LEVEL if level else events.CONFORMAL
        medium = 1 + material
        top = max(top, height) if level else top + height
    if kind == events.CONFORMAL:
        below = -terrain.heights
        # Of the same kind, or the kernels would be compiled once more
        below.setflags(write=terrain.heights.flags.writeable)
        maxima, levels = block_maxima(below, terrain.periodic)
        flipped = terrain._replace(
            heights=below, maxima=maxima, levels=levels, z_top=-field.z_bottom,
            horizon=NO_HORIZON,
        )  # fmt: skip
    film = events.Film(kind, float(height), medium, flipped)
    bodies = _register(placement.bodies, field)
    if len(bodies.z) > 0:
        top = max(top, bodies.z_high)
    return events.World(terrain, film, bodies, media), float(top)


def _register(bodies: Bodies, field: Field) -> bodies_kernel.Bodies:
    """Bodies with a grid that lists the images above each of its cells."""
    terrain = field.terrain
    cells = np.array(terrain.heights.shape) - (0 if terrain.periodic else 1)
    size = cells * np.array(field.pitch)
    reach = bodies.radius
    visible = np.flatnonzero(reach > 0.0)
    total = CELLS_PER_BODY * len(visible) + FEWEST_CELLS
    shape = np.maximum(np.sqrt(total * size / size[::-1]).astype(int), 1)
    step = size / shape
    centre = np.stack([bodies.x, bodies.y], axis=1)
    radius = reach[visible, None]
    low = np.floor((centre[visible] - radius) / step).astype(int)
    high = np.floor((centre[visible] + radius) / step).astype(int)
    if not terrain.periodic:
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
        z_low=max(float(bodies.z_low.min(initial=np.inf)), field.z_bottom),
        z_high=float(bodies.z_high.max(initial=-np.inf)),
        overlap=_overlap(centre[visible], reach[visible], size, terrain.periodic),
        cells_x=int(shape[0]),
        cells_y=int(shape[1]),
        step_x=float(step[0]),
        step_y=float(step[1]),
        size_x=float(size[0]),
        size_y=float(size[1]),
        periodic=bool(terrain.periodic),
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
