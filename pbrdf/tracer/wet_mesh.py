"""A mesh that light goes through and what lies on it, as the kernels take them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pbrdf.contaminants.bodies import place
from pbrdf.kernels.bodies import bodies as bodies_kernel
from pbrdf.kernels.bodies import world as scenes
from pbrdf.kernels.bodies.media import DEEP
from pbrdf.scene.scene import Scene
from pbrdf.surface.mesh import MeshSurface
from pbrdf.tracer.media import covering_materials
from pbrdf.tracer.mesh_field import MeshField
from pbrdf.tracer.wet_field import register

__all__ = ["WetMesh"]

NO_FILM = scenes.Film(scenes.NO_FILM, 0.0, 0, None)


@dataclass(frozen=True, kw_only=True)
class WetMesh:
    """A mesh and the bodies on it, built once for all directions.

    Attributes
    ----------
    field : MeshField
        The mesh, a finite one moved to begin at 0; its top is above all that lies on it.
    behind : ndarray of int, shape (solids + 1,)
        Medium of each transparent solid, and before them 0 of none.
    bodies : pbrdf.kernels.bodies.bodies.Bodies
        What lies on the mesh.
    media : pbrdf.kernels.bodies.world.Media
        Optical constants.
    deep : float
        Optical depth from which on light is not followed.
    reports : tuple of mappings
        What each contaminant became.
    notes : tuple of str
        Warnings of the placement.
    """

    field: MeshField
    behind: np.ndarray
    bodies: bodies_kernel.Bodies
    media: scenes.Media
    deep: float
    reports: tuple[Mapping[str, Any], ...]
    notes: tuple[str, ...]

    @classmethod
    def of(
        cls,
        surface: MeshSurface,
        scene: Scene,
        media: scenes.Media,
        seed: np.random.SeedSequence,
        skips: frozenset[str],
    ) -> "WetMesh":
        """Lay the contaminants of a scene on its mesh."""
        order = covering_materials(scene)
        behind = np.array(
            [0] + [1 + order.index(scene.materials[k]) for k in surface.solid_labels],
            dtype=np.int64,
        )
        listed: Any = scene.contaminants
        placement = place(listed, surface, seed)
        laid = placement.bodies
        if listed and surface.period is None:
            # The grid of bodies begins at 0
            low = surface.bounds[0, :2]
            surface = surface.moved(-low)
            laid = replace(laid, x=laid.x - low[0], y=laid.y - low[1])
        bodies = register(
            laid, size=np.array(surface.size), periodic=surface.periodic,
            z_bottom=float(surface.bounds[0, 2]),
        )  # fmt: skip
        medium = [1 + order.index(laid.materials[k]) for k in laid.material]
        bodies = bodies._replace(medium=np.array(medium, dtype=np.int64))
        return cls(
            field=MeshField.of(surface, skips, top=bodies.z_high),
            behind=behind,
            bodies=bodies,
            media=media,
            deep=DEEP if "deep" in skips else np.inf,
            reports=placement.reports,
            notes=placement.notes,
        )

    def world(self) -> scenes.World:
        """Give the scene with room for one ray: each thread takes one of its own."""
        mesh = self.field.facets(self.behind)
        return scenes.World(None, mesh, NO_FILM, self.bodies, self.media, self.deep)
