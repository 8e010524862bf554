"""A scene with contaminants as the kernels take it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from pbrdf.contaminants.arguments import material_of
from pbrdf.contaminants.bodies import Bodies, Placement, place
from pbrdf.contaminants.drops import Drops
from pbrdf.kernels.bodies import bodies as bodies_kernel
from pbrdf.kernels.bodies import events
from pbrdf.kernels.bodies.media import DEEP
from pbrdf.kernels.optics.absorbing import shares_into_absorber
from pbrdf.kernels.paths.shading import base_strength
from pbrdf.kernels.terrain.heightfield import block_maxima
from pbrdf.kernels.terrain.horizon import NO_HORIZON
from pbrdf.optics.materials import Material
from pbrdf.surface.heightmap import HeightMap
from pbrdf.tracer.field import Field
from pbrdf.validity.contaminants import LEAST_SIZE_PARAMETER

# Without a wavelength bodies are as large against it as geometric optics asks for: no light
# then crosses one of this kappa, whose optical depth is 4 kappa times the size parameter
OPAQUE_KAPPA = DEEP / (4.0 * LEAST_SIZE_PARAMETER)
# Nodes for the light that a diffuse base sends into an absorber
NODES, WEIGHTS = (0.5 * part for part in np.polynomial.legendre.leggauss(64))
NODES = NODES + 0.5
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
    films: Sequence[Material | str] = (),
) -> events.Media:
    """Optical constants of air, contaminants and solids at each wavelength.

    `films` are those of the contaminants that a film consists of: it may be thin.

    Raises
    ------
    ValueError
        If a body absorbs and no wavelength tells how much, or has a diffuse base under an
        interface that absorbs.
    """
    count = 1 if waves is None or waves.ndim == 0 else waves.size
    n_media, first = len(contaminants) + 1, len(substrate)
    solids = [*substrate, *contaminants]
    n = np.ones((count, n_media))
    kappa, absorption = np.zeros((2, count, n_media))
    solid = np.full((count, n_media), -1)
    solid_n, solid_kappa = np.empty((2, count, len(solids)))
    for column, material in enumerate(solids):
        solid_n[:, column], solid_kappa[:, column] = material.indices(waves)
    for medium, material in enumerate(contaminants, start=1):
        column = first + medium - 1
        index, absorbs = solid_n[:, column], solid_kappa[:, column]
        opaque = np.isinf(index) | material.absorbs_all | material.has_base
        if material.has_base and absorbs.any():
            msg = (
                f"kappa must be 0 over a diffuse base [1], got {absorbs.max():g} and "
                f"diffuse_albedo {material.albedo(waves).max():g}. "
                "Light does not reach a base under an absorber."
            )
            raise ValueError(msg)
        if waves is None:
            opaque |= (absorbs >= OPAQUE_KAPPA) & (material not in films)
            _check_transparent(absorbs[~opaque])
        solid[opaque, medium] = column
        n[~opaque, medium] = index[~opaque]
        kappa[~opaque, medium] = absorbs[~opaque]
        if waves is not None:
            absorption[:, medium] = 4 * np.pi * kappa[:, medium] / waves
    base, tail = np.zeros((2, count, len(solids), n_media))
    for w, column, medium in np.ndindex(*base.shape):
        albedo = float(np.broadcast_to(solids[column].albedo(waves), count)[w])
        if kappa[w, medium] > 0.0 and albedo > 0.0:
            base[w, column, medium], tail[w, column, medium] = _base_under_absorber(
                albedo,
                float(solid_n[w, column]),
                float(n[w, medium]),
                float(kappa[w, medium]),
            )
        else:
            base[w, column, medium] = base_strength(
                albedo,
                solid_n[w, column] / n[w, medium],
                solid_kappa[w, column] / n[w, medium],
            )
    black = np.array([material.absorbs_all for material in solids])
    return events.Media(
        n, kappa, absorption, solid, solid_n, solid_kappa, black, base, tail
    )


def opaque_drop_notes(contaminants: Sequence[Any], waves: np.ndarray | None) -> list[str]:
    """Say which drops are taken as opaque for want of a wavelength, flat as they are.

    A body as wide as `OPAQUE_KAPPA` takes it for lets no light through; a cap is thinner
    by 1 - cos of its contact angle.
    """
    notes = []
    for one in contaminants if waves is None else ():
        if not isinstance(one, Drops) or material_of(one.material).has_base:
            continue
        kappa = material_of(one.material).index()[1]
        thinness = 1.0 - np.cos(min(one.contact_angle, np.pi / 2))
        if kappa >= OPAQUE_KAPPA > kappa * thinness:
            notes.append(
                f"Drops of contact angle {np.rad2deg(one.contact_angle):.3g} deg and "
                f"kappa {kappa:.3g} are taken as opaque for want of a wavelength, but are "
                "so flat that light may cross them. Pass wavelength."
            )
    return notes


def _check_transparent(kappa: np.ndarray) -> None:
    """Refuse absorption that cannot be told without a wavelength."""
    if kappa.any():
        msg = (
            f"wavelength must be given [um] where a body absorbs, got None and "
            f"kappa {kappa.max():g}. Or take a material with kappa = 0."
        )
        raise ValueError(msg)


def _base_under_absorber(
    albedo: float, n_base: float, n: float, kappa: float
) -> tuple[float, float]:
    """Strength of a diffuse base under an absorber, and share of its samples in the tail.

    The strength is albedo / (n_base² (1 - albedo F_i)), by square of the wave vector along
    the interface, F_i what the interface throws back into the base. The tail is what an
    absorber takes in beyond the angle of total reflection of a medium that does not absorb.
    """
    top, middle = n_base**2, min(n, n_base) ** 2
    inner, outer = (
        (high - low) / top
        * shares_into_absorber(n_base, n, kappa, low, high, NODES, WEIGHTS)
        for low, high in ((0.0, middle), (middle, top))
    )  # fmt: skip
    sent = inner + outer
    return albedo / (top * (1.0 - albedo * (1.0 - sent))), outer / sent


def world_of(
    field: Field, placement: Placement, media: events.Media, *, skips_deep: bool = True
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
    deep = DEEP if skips_deep else np.inf
    return events.World(terrain, film, bodies, media, deep), float(top)


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
