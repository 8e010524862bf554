"""The rays that the engine sends to Embree, written down and sent again by embreex alone.

The kernel calls Embree by its address, so another function can stand in between: one that
writes each ray down before it passes it on.
"""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from llvmlite import ir
from numba import carray, cfunc, types
from numba.extending import intrinsic

from pbrdf.kernels.terrain.embree import DIRECTION, N_WORDS, call_embree

BATCH = 16_384


@intrinsic
def to_pointer(typing_context, address):
    """Pointer of an address."""

    def generate(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], ir.IntType(8).as_pointer())

    return types.voidptr(types.intp), generate


def recorder(intersect, rays, count):
    """Make a function that writes rays down and passes them on to `intersect`."""
    size = len(rays)
    rays_at, count_at = rays.ctypes.data, count.ctypes.data

    @cfunc(types.void(types.intp, types.intp, types.intp))
    def record(scene, place, arguments):
        ray = carray(to_pointer(place), (N_WORDS,), dtype=np.float32)
        room = carray(to_pointer(rays_at), (size, 6), dtype=np.float32)
        number = carray(to_pointer(count_at), (1,), dtype=np.int64)
        for c in range(3):
            room[number[0], c] = ray[c]
            room[number[0], 3 + c] = ray[DIRECTION + c]
        number[0] += 1
        call_embree(intersect, scene, place)

    return record


@dataclass(frozen=True)
class Replay:
    """The rays of a run in their order, and embreex's own scene of the same mesh."""

    scene: EmbreeScene
    batches: list[tuple[np.ndarray, np.ndarray]]

    @classmethod
    def of(cls, target, trace, most):
        """Run `trace` on an `EmbreeField` and write down at most `most` rays."""
        rays, count = np.empty((most, 6), dtype=np.float32), np.zeros(1, dtype=np.int64)
        tree = target.tree()
        record = recorder(tree.intersect, rays, count)
        between = tree._replace(intersect=record.address)
        trace(SimpleNamespace(field=target.field, tree=lambda: between))
        scene = EmbreeScene(robust=True)
        TriangleMesh(scene, target.mesh.vertices, target.mesh.faces)
        taken = rays[: count[0]]
        return cls(
            scene,
            [
                (np.ascontiguousarray(part[:, :3]), np.ascontiguousarray(part[:, 3:]))
                for part in np.array_split(taken, -(-len(taken) // BATCH))
            ],
        )

    @property
    def segments(self):
        """Number of rays."""
        return sum(len(origins) for origins, _ in self.batches)

    def run(self):
        """Send all rays through embreex."""
        for origins, directions in self.batches:
            self.scene.run(origins, directions, output=True)
