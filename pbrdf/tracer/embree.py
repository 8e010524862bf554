"""Embree as the intersector, through the library that embreex brings along.

embreex itself takes whole arrays of rays; a compiled kernel calls `rtcIntersect1` ray by
ray instead, without a pass over memory before and after.
"""

import ctypes
import functools
import importlib.metadata
import threading
import weakref
from dataclasses import dataclass

import numpy as np

from pbrdf.kernels.terrain.embree import N_WORDS, Tree
from pbrdf.tracer.field import Field
from pbrdf.tracer.mesh import Mesh, build_mesh

# Numbers of Embree's C interface, the same in every version 4
EMBREE = 4
PROPERTY_VERSION = 0
GEOMETRY_TRIANGLES, GEOMETRY_INSTANCE = 0, 121
BUFFER_INDEX, BUFFER_VERTEX = 0, 1
FORMAT_UINT3, FORMAT_FLOAT3, FORMAT_FLOAT3X4_COLUMNS = 0x5003, 0x9003, 0x9234
SCENE_ROBUST, SCENE_ASKS_BACK = 1 << 2, 1 << 3
ALIGNMENT = 64

# A scene takes no geometry of another device, and a cache alone lets two threads make one
_DEVICE_LOCK = threading.Lock()
_HANDLE = ctypes.c_void_p
_NUMBER = ctypes.c_uint
_SIGNATURES = {
    "rtcNewDevice": (_HANDLE, [ctypes.c_char_p]),
    "rtcGetDeviceProperty": (ctypes.c_ssize_t, [_HANDLE, _NUMBER]),
    "rtcGetDeviceError": (_NUMBER, [_HANDLE]),
    "rtcNewScene": (_HANDLE, [_HANDLE]),
    "rtcSetSceneFlags": (None, [_HANDLE, _NUMBER]),
    "rtcNewGeometry": (_HANDLE, [_HANDLE, _NUMBER]),
    "rtcSetNewGeometryBuffer": (
        _HANDLE,
        [_HANDLE, _NUMBER, _NUMBER, _NUMBER, ctypes.c_size_t, ctypes.c_size_t],
    ),
    "rtcSetGeometryInstancedScene": (None, [_HANDLE, _HANDLE]),
    "rtcSetGeometryTransform": (None, [_HANDLE, _NUMBER, _NUMBER, _HANDLE]),
    "rtcOccluded1": (None, [_HANDLE, _HANDLE, _HANDLE]),
    "rtcIntersect8": (None, [_HANDLE, _HANDLE, _HANDLE, _HANDLE]),
    "rtcCommitGeometry": (None, [_HANDLE]),
    "rtcAttachGeometry": (_NUMBER, [_HANDLE, _HANDLE]),
    "rtcReleaseGeometry": (None, [_HANDLE]),
    "rtcCommitScene": (None, [_HANDLE]),
    "rtcReleaseScene": (None, [_HANDLE]),
}


@functools.cache
def library() -> ctypes.CDLL:
    """Embree's C library out of the package embreex.

    Raises
    ------
    RuntimeError
        If the package has none, or one of another version than 4.
    """
    for file in importlib.metadata.files("embreex") or []:
        if "embree4" in file.name:
            found = ctypes.CDLL(str(file.locate()))
            break
    else:
        msg = (
            "The Embree route needs the library embree4 out of the package embreex, and "
            f"embreex {importlib.metadata.version('embreex')} holds none. Install the "
            'version in the lock file, or leave the skip "walk" on.'
        )
        raise RuntimeError(msg)
    for name, (result, arguments) in _SIGNATURES.items():
        function = getattr(found, name)
        function.restype, function.argtypes = result, arguments
    return found


@functools.cache
def _make_device() -> int:
    made: int = library().rtcNewDevice(None)
    version = library().rtcGetDeviceProperty(made, PROPERTY_VERSION)
    if version // 10_000 != EMBREE:
        msg = f"The Embree route needs Embree {EMBREE}, got version number {version}."
        raise RuntimeError(msg)
    return made


def device() -> int:
    """Embree's device, one for the whole program, whichever threads ask for it first."""
    with _DEVICE_LOCK:
        return _make_device()


def build_tree(vertices: np.ndarray, faces: np.ndarray, flags: int = SCENE_ROBUST) -> int:
    """Build Embree's scene of triangles (float32, int32), whose arrays it copies.

    Raises
    ------
    RuntimeError
        If Embree reports an error, for one too little memory.
    """
    embree, home = library(), device()
    scene: int = embree.rtcNewScene(home)
    embree.rtcSetSceneFlags(scene, flags)
    geometry = embree.rtcNewGeometry(home, GEOMETRY_TRIANGLES)
    for kind, form, array in (
        (BUFFER_VERTEX, FORMAT_FLOAT3, vertices),
        (BUFFER_INDEX, FORMAT_UINT3, faces),
    ):
        # Embree makes its own buffer a little longer, as it reads 16 bytes at a time
        buffer = embree.rtcSetNewGeometryBuffer(
            geometry, kind, 0, form, array.strides[0], len(array)
        )
        if buffer is not None:
            ctypes.memmove(buffer, array.ctypes.data, array.nbytes)
    embree.rtcCommitGeometry(geometry)
    embree.rtcAttachGeometry(scene, geometry)
    embree.rtcReleaseGeometry(geometry)
    embree.rtcCommitScene(scene)
    check_built(scene, f"{len(faces)} faces")
    return scene


def build_images(tree: int, moves: np.ndarray, flags: int = SCENE_ROBUST) -> int:
    """Build a scene of images of a tree, each moved by (x, y); it keeps the tree alive.

    Raises
    ------
    RuntimeError
        If Embree reports an error.
    """
    embree, home = library(), device()
    scene: int = embree.rtcNewScene(home)
    embree.rtcSetSceneFlags(scene, flags)
    for x, y in moves:
        geometry = embree.rtcNewGeometry(home, GEOMETRY_INSTANCE)
        embree.rtcSetGeometryInstancedScene(geometry, tree)
        # The columns of a rotation, here none, and the shift
        columns = np.array([1, 0, 0, 0, 1, 0, 0, 0, 1, x, y, 0], dtype=np.float32)
        embree.rtcSetGeometryTransform(
            geometry, 0, FORMAT_FLOAT3X4_COLUMNS, columns.ctypes.data
        )
        embree.rtcCommitGeometry(geometry)
        embree.rtcAttachGeometry(scene, geometry)
        embree.rtcReleaseGeometry(geometry)
    embree.rtcCommitScene(scene)
    check_built(scene, f"{len(moves)} images")
    return scene


def check_built(scene: int, of: str) -> None:
    """Raise if Embree has built nothing."""
    error = library().rtcGetDeviceError(device())
    if error:
        library().rtcReleaseScene(scene)
        msg = f"Embree built no tree over {of}: error {error}."
        raise RuntimeError(msg)


@dataclass(frozen=True, kw_only=True, eq=False)
class EmbreeField:
    """A field with its mesh and Embree's tree over it, built once for all directions."""

    field: Field
    mesh: Mesh
    scene: int

    @classmethod
    def of(cls, field: Field) -> "EmbreeField":
        """Build the mesh and the tree."""
        mesh = build_mesh(field)
        made = cls(field=field, mesh=mesh, scene=build_tree(mesh.vertices, mesh.faces))
        weakref.finalize(made, library().rtcReleaseScene, made.scene)
        return made

    def tree(self) -> Tree:
        """Give the tree, and room for one ray: each thread takes one of its own."""
        room = np.zeros(4 * N_WORDS + ALIGNMENT, dtype=np.uint8)
        start = -room.ctypes.data % ALIGNMENT
        ray = room[start : start + 4 * N_WORDS].view(np.float32)
        call = ctypes.cast(library().rtcIntersect1, ctypes.c_void_p).value
        return Tree(
            call, self.scene, ray.ctypes.data, ray, ray.view(np.uint32), self.mesh.frame
        )
