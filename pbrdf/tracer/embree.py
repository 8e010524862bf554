"""Embree as the intersector: batches of rays in spatial order over a triangle mesh."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from pbrdf.kernels import wavefront
from pbrdf.kernels.binning import bin_edges
from pbrdf.tracer.field import Field
from pbrdf.tracer.mesh import Mesh, build_mesh
from pbrdf.tracer.plan import Plan, Tally

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
        """Number of the first face met by each ray (rays, 3), -1 for none."""
        faces: np.ndarray = self.scene.run(origins, directions, output=True)["primID"]
        return faces


def trace_direction(
    target: EmbreeField, plan: Plan, index: int, shifts: np.ndarray, tally: Tally
) -> None:
    """Trace one incident direction and add to the tally."""
    field, mesh = target.field, target.mesh
    theta = plan.theta_i[index]
    launch = field.entry_rectangle(theta, plan.phi_i)
    lines = field.entry_lines(launch, plan.n_rays)
    size = min(CHUNK, plan.n_rays)
    state = np.empty((size, wavefront.N_STATE))
    cell = np.empty((size, wavefront.N_CELL), dtype=np.int64)
    cos_beta = np.empty((plan.max_bounces, size))
    turn = np.empty((plan.max_bounces + 1, size, 2))
    mueller = np.zeros((4, 4))
    zenith, azimuth = bin_edges(plan.n_theta, plan.n_dphi)
    for first in range(0, plan.n_rays, size):
        active = np.empty(min(size, plan.n_rays - first), dtype=np.int64)
        wavefront.enter_rays(
            first, plan.n_rays, launch, lines, shifts, *field.pitch,
            np.sin(theta), np.cos(theta), plan.phi_i or 0.0, plan.phi_i is None,
            field.z_top, *field.cells, state, cell, active,
        )  # fmt: skip
        while active.size:
            origins = np.empty((active.size, 3), dtype=np.float32)
            directions = np.empty((active.size, 3), dtype=np.float32)
            wavefront.emit_rays(
                field.heights, field.periodic, *field.pitch, *mesh.center, mesh.unit,
                mesh.offset, state, cell, active, origins, directions,
            )  # fmt: skip
            kept = wavefront.advance_rays(
                field.heights, field.periodic, *field.pitch, field.z_top, field.z_bottom,
                *mesh.guard, target.first_faces(origins, directions), plan.max_bounces,
                state, cell, active, cos_beta, turn,
                plan.n, plan.kappa, plan.n_stokes, zenith, azimuth, mueller,
                tally.flux[index], tally.energy[index], tally.counts[index],
            )  # fmt: skip
            active = active[:kept]
