"""Embree as the intersector: batches of rays in spatial order over a triangle mesh."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from pbrdf.kernels import shading, wavefront
from pbrdf.kernels.entry import Source
from pbrdf.tracer.field import Field
from pbrdf.tracer.mesh import Mesh, build_mesh

# Rays traced together; their state stays in the cache of one core
CHUNK = 16_384


@dataclass(frozen=True, kw_only=True, eq=False)
class EmbreeField:
    """A field with its mesh and Embree's tree over it, built once for all directions."""

    field: Field
    mesh: Mesh
    scene: Any

    @classmethod
    def of(cls, field: Field) -> "EmbreeField":
        """Build the mesh and the tree."""
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        mesh = build_mesh(field)
        scene = EmbreeScene(robust=True)
        TriangleMesh(scene, mesh.vertices, mesh.faces)
        # The first query commits the scene; later ones may then run in parallel
        down = np.array([[0.0, 0.0, -1.0]], dtype=np.float32)
        scene.run(-down, down, output=True)
        return cls(field=field, mesh=mesh, scene=scene)

    def first_faces(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Find the first face met by each ray (rays, 3), -1 for none."""
        faces: np.ndarray = self.scene.run(origins, directions, output=True)["primID"]
        return faces


def trace_waves(
    target: EmbreeField,
    source: Source,
    max_bounces: int,
    optics: shading.Optics,
    tally: shading.Tally,
) -> None:
    """Trace one incident direction in chunks of rays, and add to the tally."""
    terrain, frame = target.field.terrain, target.mesh.frame
    size = min(CHUNK, source.n_rays)
    state = np.empty((size, wavefront.N_STATE))
    cell = np.empty((size, wavefront.N_CELL), dtype=np.int64)
    record = np.empty((max_bounces + 1, size, shading.N_RECORD))
    for first in range(0, source.n_rays, size):
        active = np.empty(min(size, source.n_rays - first), dtype=np.int64)
        wavefront.enter_rays(terrain, source, first, state, cell, active)
        while active.size:
            origins = np.empty((active.size, 3), dtype=np.float32)
            directions = np.empty((active.size, 3), dtype=np.float32)
            wavefront.emit_rays(terrain, frame, state, cell, active, origins, directions)
            faces = target.first_faces(origins, directions)
            kept = wavefront.advance_rays(
                terrain, frame, faces, state, cell, active, record, optics, tally
            )
            active = active[:kept]
