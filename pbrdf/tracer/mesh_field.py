"""A mesh made ready for tracing: Embree's tree over it, its images, and entry points."""

import ctypes
import functools
import threading
import weakref
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

from pbrdf.kernels import compiled_callback
from pbrdf.kernels.meshes import facets as kernel
from pbrdf.kernels.meshes.packets import LANES, Packet
from pbrdf.kernels.meshes.search import (
    AT_ADDRESSES,
    AT_QUERY,
    N_ADDRESSES,
    N_QUERY,
    judge,
)
from pbrdf.kernels.terrain.embree import N_WORDS
from pbrdf.surface.mesh.surface import MeshSurface
from pbrdf.tracer.embree import (
    ALIGNMENT,
    SCENE_ASKS_BACK,
    SCENE_ROBUST,
    build_images,
    build_tree,
    library,
)
from pbrdf.tracer.field import (
    GUARD_HEIGHTS,
    GUARD_SHARE,
    LEAST_INTERIOR,
    cone_rim,
    count_lines,
)

# Units in the last place of float32 by which a ray is lifted off its facet, and lifts of
# free space above and below a mesh
LIFT_ULPS = 16
MARGIN_LIFTS = 16
# Tolerance of places in float64, in units of Embree
TOLERANCE = 1e-12
# Share of a period that is left out at the rim of the box of images
RIM = 1e-3
KINDS = {"ground": kernel.GROUND, "bodies": kernel.BODIES, "sheet": kernel.SHEET}
# A cache alone lets two threads compile one each
_JUDGE_LOCK = threading.Lock()
NO_LABELS, NO_SOLIDS = np.empty(0, dtype=np.uint8), np.empty(0, dtype=np.int32)
for _none in (NO_LABELS, NO_SOLIDS):
    # Of the same kind as others, or the kernels would be compiled once more
    _none.setflags(write=False)
OPAQUE = np.zeros(1, dtype=np.int64)
# Bytes of a ray, then of RTCIntersectArguments and of the context with the query behind
RAY_BYTES, ARGUMENTS_BYTES = 4 * N_WORDS, 64
CONTEXT_BYTES = AT_ADDRESSES + 8 * N_ADDRESSES
# Numbers of RTCIntersectArguments: call back for every facet; all features
INVOKE_FILTER, ALL_FEATURES, NO_INSTANCE = 1 << 1, 0xFFFFFFFF, 0xFFFFFFFF
PACKET_BYTES = 4 * N_WORDS * LANES


@functools.cache
def _compiled_judge() -> Any:
    return compiled_callback(judge, numba.void(numba.intp))


def judge_address() -> int:
    """Address of the call back that judges candidates, compiled once and kept."""
    with _JUDGE_LOCK:
        return int(_compiled_judge().address)


def packet_room(context: int) -> Packet:
    """Room for a packet of rays, with the context of a query at this address."""
    memory = np.zeros(PACKET_BYTES + 2 * ALIGNMENT + ALIGNMENT, np.uint8)
    memory = memory[-memory.ctypes.data % ALIGNMENT :]
    rays, arguments = memory[:PACKET_BYTES], memory[PACKET_BYTES:][:ALIGNMENT]
    valid = memory[PACKET_BYTES + ALIGNMENT :][: 4 * LANES].view(np.int32)
    arguments[4:8].view(np.uint32)[:] = ALL_FEATURES
    arguments[8:16].view(np.int64)[:] = context
    call = ctypes.cast(library().rtcIntersect8, ctypes.c_void_p).value
    return Packet(
        call, valid.ctypes.data, rays.ctypes.data, arguments.ctypes.data,
        arguments[:4].view(np.uint32), rays.view(np.float32), rays.view(np.uint32), valid,
        np.zeros(LANES, dtype=np.int64), np.zeros(1, dtype=np.int64),
    )  # fmt: skip


def scene_flags(surface: MeshSurface) -> int:
    """Say whether Embree has to be robust: not where a ray that slips through is noticed.

    In a closed opaque body it meets a back next, or falls through the ground, and is
    traced again.
    """
    quick = surface.kind != "sheet" and not surface.intersecting and not surface.transparent
    return SCENE_ASKS_BACK | (0 if quick else SCENE_ROBUST)


def free_slope(surface: MeshSurface) -> float:
    """Slope from which on a rising ray is free: infinite where the mesh hangs over."""
    level = surface.normals[:, 2]
    if surface.kind == "bodies" or surface.transparent or level.min() <= 0.0:
        return np.inf
    # A hair more than the steepest facet, for the rounding of its normal
    return float(np.sqrt(1.0 / level.min() ** 2 - 1.0) * (1.0 + 1e-9))


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshField:
    """A mesh with Embree's tree over it, built once for all directions.

    Attributes
    ----------
    surface : MeshSurface
        The mesh.
    frame : pbrdf.kernels.meshes.facets.MeshFrame
        Its extent.
    images : ndarray, shape (images, 2)
        Shift of each image. [um]
    scene : int
        Embree's scene of the images.
    top : float
        Height of the entry points: that of the highest vertex, or of what lies on it. [um]
    """

    surface: MeshSurface
    frame: kernel.MeshFrame
    images: np.ndarray
    scene: int
    top: float

    @classmethod
    def of(
        cls,
        surface: MeshSurface,
        skips: frozenset[str] = frozenset(),
        *,
        top: float = -np.inf,
    ) -> "MeshField":
        """Build the tree over a mesh, for tracing with the skips allowed.

        `top` is the highest point of what lies on it. [um]
        """
        low, high = surface.bounds
        center = 0.5 * (low + high)
        half = 0.5 * (high - low)
        if surface.period is None:
            images = np.zeros((1, 2))
            box = np.stack([low[:2], high[:2]])
        else:
            lengths = np.asarray(surface.period)
            reach = np.maximum(np.ceil((high - low)[:2] / lengths - 1e-9), 1.0)
            counts = [np.arange(-n, n + 1) for n in reach]
            images = np.stack(np.meshgrid(*counts, indexing="ij"), axis=-1).reshape(-1, 2)
            images = images * lengths
            # Where every image that could be there is at hand
            box = np.stack(
                [high[:2] - (reach + 1) * lengths, low[:2] + (reach + 1) * lengths]
            )
            box += RIM * lengths * np.array([[1.0], [-1.0]])
            half[:2] = 0.5 * (box[1] - box[0])
        unit = float(half.max())
        lift = LIFT_ULPS * 2.0**-24 * unit
        margin = MARGIN_LIFTS * lift
        if surface.period is None:
            box += margin * np.array([[-1.0], [1.0]])
        period = surface.period or (np.inf, np.inf)
        frame = kernel.MeshFrame(
            kind=KINDS[surface.kind],
            crossing=surface.intersecting,
            periodic=surface.period is not None,
            period_x=period[0],
            period_y=period[1],
            cell_x=float(low[0]),
            cell_y=float(low[1]),
            low_x=float(box[0, 0]),
            high_x=float(box[1, 0]),
            low_y=float(box[0, 1]),
            high_y=float(box[1, 1]),
            z_bottom=float(low[2]) - margin,
            z_top=float(high[2]) + margin,
            z_high=float(high[2]),
            free_slope=free_slope(surface) if "steep" in skips else np.inf,
            center_x=float(center[0]),
            center_y=float(center[1]),
            center_z=float(center[2]),
            scale=1.0 / unit,
            lift=lift,
            tolerance=TOLERANCE * unit,
        )
        vertices = ((surface.vertices - center) / unit).astype(np.float32)
        flags = scene_flags(surface)
        scene = build_tree(vertices, surface.faces, flags)
        if surface.period is not None:
            tree, scene = scene, build_images(scene, images / unit, flags)
            library().rtcReleaseScene(tree)
        made = cls(
            surface=surface, frame=frame, images=images, scene=scene,
            top=max(frame.z_high, float(top)),
        )  # fmt: skip
        weakref.finalize(made, library().rtcReleaseScene, made.scene)
        return made

    @property
    def periodic(self) -> bool:
        """Whether the mesh repeats."""
        return bool(self.frame.periodic)

    def entry_lines(self, launch: np.ndarray, n_rays: int, half_angle: float = 0.0) -> int:
        """Count the lines of entry points of a launch rectangle; see `count_lines`."""
        return count_lines(launch[2], launch[3], n_rays, half_angle)

    def entry_rectangle(
        self, theta_i: float, phi_i: float | None, half_angle: float = 0.0
    ) -> np.ndarray:
        """Corner x, y and lengths [um] of the entry points in the top plane, shape (4,).

        On a periodic mesh it is the period; around bodies alone it is where their shadow
        can fall from, seen along the light; on a sheet it is where light reaches the lowest
        point inside the sheet, less a guard rim.

        Raises
        ------
        ValueError
            If less than a tenth of a sheet is left.
        """
        low, high = self.surface.bounds
        if self.surface.period is not None:
            return np.array([*low[:2], *self.surface.period])
        height = self.top - self.frame.z_bottom
        if phi_i is None:
            reach = np.tan(theta_i + half_angle) * height
            drift = np.array([[-reach, reach], [-reach, reach]])
        else:
            x, y = cone_rim(theta_i, phi_i, half_angle)
            drift = np.stack([x, y]) / np.sqrt(1.0 - x * x - y * y) * height
        # A point z below the top is reached from its place plus this share of the drift
        least, most = np.minimum(drift.min(axis=1), 0.0), np.maximum(drift.max(axis=1), 0.0)
        sides = (high - low)[:2]
        if self.surface.kind == "bodies":
            return np.concatenate([low[:2] + least, sides + most - least])
        guard = np.minimum(GUARD_HEIGHTS * height, GUARD_SHARE * sides)
        corner, lengths = guard + most, sides - 2.0 * guard - most + least
        if lengths.min() <= 0.0 or lengths.prod() < LEAST_INTERIOR * sides.prod():
            msg = (
                f"theta_i must suit the size of the finite mesh, got {theta_i:g} rad: "
                f"light crosses {np.abs(drift).max():.3g} um of it on its way down "
                f"{height:.3g} um. Use a larger mesh, a steeper source or a period."
            )
            raise ValueError(msg)
        return np.concatenate([low[:2] + corner, lengths])

    def facets(self, behind: np.ndarray = OPAQUE) -> kernel.Facets:
        """Give the mesh with room for one ray: each thread takes one of its own.

        `behind` is the medium of each transparent solid, and before them 0 of none.
        """
        memory = np.zeros(RAY_BYTES + ARGUMENTS_BYTES + CONTEXT_BYTES + ALIGNMENT, np.uint8)
        memory = memory[-memory.ctypes.data % ALIGNMENT :]
        ray = memory[:RAY_BYTES].view(np.float32)
        arguments = memory[RAY_BYTES : RAY_BYTES + ARGUMENTS_BYTES]
        context = memory[RAY_BYTES + ARGUMENTS_BYTES :][:CONTEXT_BYTES]
        surface = self.surface
        normals = surface.normals
        within = np.zeros(len(behind) + 1, dtype=np.int64)
        arguments[:8].view(np.uint32)[:] = INVOKE_FILTER, ALL_FEATURES
        arguments[8:24].view(np.int64)[:] = context.ctypes.data, judge_address()
        context[:8].view(np.uint32)[:] = NO_INSTANCE
        labels = NO_LABELS if surface.labels is None else surface.labels
        solids = NO_SOLIDS if surface.solids is None else surface.solids
        packet = packet_room(context.ctypes.data)
        context[AT_ADDRESSES:].view(np.int64)[:] = [
            array.ctypes.data if array.size else 0
            for array in (
                surface.vertices, surface.faces, normals, self.images, solids, within,
            )
        ]  # fmt: skip
        first, any_one = (
            ctypes.cast(one, ctypes.c_void_p).value
            for one in (library().rtcIntersect1, library().rtcOccluded1)
        )
        return kernel.Facets(
            surface.vertices, surface.faces, normals, labels, solids, self.frame, behind,
            within, first, any_one, self.scene, ray.ctypes.data, arguments.ctypes.data, ray,
            ray.view(np.uint32), self.images,
            context[AT_QUERY : AT_QUERY + 8 * N_QUERY].view(np.float64),
            np.zeros(1, dtype=np.int64), packet,
        )  # fmt: skip
