"""The triangle mesh of a height field, as Embree takes it."""

from dataclasses import dataclass

import numpy as np

from pbrdf.kernels.terrain.embree import MeshFrame
from pbrdf.tracer.field import Field

# The mesh of a periodic surface goes on this many height ranges beyond the period
GUARD_HEIGHTS = 2.0


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """Vertices and faces, centred and in units of one grid step, so that float32 suffices.

    Face 2 (c ny + r) + f is facet f of the cell in column c, row r of the guarded grid.

    Attributes
    ----------
    vertices : ndarray, shape (nodes, 3), float32
        In units of one grid step about the centre.
    faces : ndarray, shape (2 cells, 3), int32
        Node numbers.
    frame : MeshFrame
        Centre, unit, guard band and lift of the rays.
    """

    vertices: np.ndarray
    faces: np.ndarray
    frame: MeshFrame


def build_mesh(field: Field) -> Mesh:
    """Triangulate a field; a periodic one with a guard band of wrapped cells."""
    unit = float(np.sqrt(field.pitch[0] * field.pitch[1]))
    nodes = field.terrain.heights.shape
    guard = (0, 0)
    if field.periodic:
        reach = GUARD_HEIGHTS * field.height_range
        guard = (
            int(np.clip(np.ceil(reach / field.pitch[0]), 2, max(2, nodes[0] // 2))),
            int(np.clip(np.ceil(reach / field.pitch[1]), 2, max(2, nodes[1] // 2))),
        )
    extra = 1 if field.periodic else 0
    columns = np.arange(-guard[0], nodes[0] + guard[0] + extra)
    rows = np.arange(-guard[1], nodes[1] + guard[1] + extra)
    heights = field.terrain.heights[np.ix_(columns % nodes[0], rows % nodes[1])]

    center = (nodes[0] / 2, nodes[1] / 2, 0.5 * (field.terrain.z_top + field.z_bottom))
    vertices = np.empty((*heights.shape, 3), dtype=np.float32)
    vertices[..., 0] = ((columns - center[0]) * field.pitch[0] / unit)[:, None]
    vertices[..., 1] = ((rows - center[1]) * field.pitch[1] / unit)[None, :]
    vertices[..., 2] = (heights - center[2]) / unit

    number = np.arange(heights.size, dtype=np.int32).reshape(heights.shape)
    z00, z10 = number[:-1, :-1], number[1:, :-1]
    z01, z11 = number[:-1, 1:], number[1:, 1:]
    low = np.stack([z00, z10, z11], axis=-1)
    high = np.stack([z00, z11, z01], axis=-1)
    # 32 units in the last place of the largest coordinate, as hazard B3 asks
    largest = float(np.abs(vertices).max())
    return Mesh(
        vertices=vertices.reshape(-1, 3),
        faces=np.stack([low, high], axis=2).reshape(-1, 3),
        frame=MeshFrame(
            *center, field.pitch[0] / unit, field.pitch[1] / unit, 1.0 / unit,
            max(1e-4, 32.0 * float(np.spacing(np.float32(largest)))),
            *guard, rows.size - 1, 1.0 / (rows.size - 1), field.z_bottom,
        ),
    )  # fmt: skip
