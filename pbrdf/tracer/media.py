"""Optical constants of all that light meets among contaminants and in solids of a mesh."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from pbrdf.contaminants.arguments import material_of
from pbrdf.contaminants.drops import Drops
from pbrdf.contaminants.films import Film
from pbrdf.kernels.bodies.media import DEEP
from pbrdf.kernels.bodies.world import Media
from pbrdf.kernels.optics.absorbing import shares_into_absorber
from pbrdf.kernels.paths.shading import base_strength
from pbrdf.optics.materials import Material
from pbrdf.scene.scene import Scene
from pbrdf.validity.contaminants import LEAST_SIZE_PARAMETER

# Without a wavelength bodies are as large against it as geometric optics asks for: no light
# then crosses one of this kappa, whose optical depth is 4 kappa times the size parameter
OPAQUE_KAPPA = DEEP / (4.0 * LEAST_SIZE_PARAMETER)
# Nodes for the light that a diffuse base sends into an absorber
NODES, WEIGHTS = (0.5 * part for part in np.polynomial.legendre.leggauss(64))
NODES = NODES + 0.5


def clear_materials(scene: Scene) -> list[Material]:
    """Materials of the solids of a mesh that light goes through, each once."""
    labels = getattr(scene.surface, "transparent", ())
    return _each_once(scene.materials[label] for label in labels)


def covering_materials(scene: Scene) -> list[Material]:
    """Materials that light goes through, each once, in the order in which they rule.

    Solids of the mesh come first: what lies on them ends at their surface.
    """
    lying = [material_of(one.material) for one in scene.contaminants]
    return _each_once([*clear_materials(scene), *lying])


def media_of_scene(scene: Scene, waves: np.ndarray | None) -> Media | None:
    """Tell what light goes through in a scene, None on a clean opaque surface."""
    covering = covering_materials(scene)
    if not covering:
        return None
    films = [one.material for one in scene.contaminants if isinstance(one, Film)]
    return media_of(scene.materials, covering, waves, [*films, *clear_materials(scene)])


def _each_once(given: Iterable[Material]) -> list[Material]:
    materials: list[Material] = []
    for material in given:
        if material not in materials:
            materials.append(material)
    return materials


def media_of(
    substrate: Sequence[Material],
    contaminants: Sequence[Material],
    waves: np.ndarray | None,
    thin: Sequence[Material | str] = (),
) -> Media:
    """Optical constants of air, of what light goes through and of solids, by wavelength.

    `contaminants` are materials as of `covering_materials`; `thin` are those of them that
    may be thin, as films and solids of a mesh may.

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
            opaque |= (absorbs >= OPAQUE_KAPPA) & (material not in thin)
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
    return Media(n, kappa, absorption, solid, solid_n, solid_kappa, black, base, tail)


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
