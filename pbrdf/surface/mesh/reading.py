"""Vertices and faces out of what a user has: a file, or what trimesh made."""

import logging
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote

import numpy as np

from pbrdf.errors import DataFileError, real_array
from pbrdf.files import companion, file_size, read_bounded
from pbrdf.surface.mesh.promises import buffers_of, check_promises

FORMATS = (".stl", ".ply", ".obj", ".glb", ".gltf", ".off")
# Arrays `vertices`, `faces` and perhaps `labels`, in float64
OWN_FORMAT = ".npz"
# Face properties of a PLY file that number its parts
FACE_LABELS = ("label", "labels", "part", "material", "material_index")
# Micrometres in a unit
UNITS = {"nm": 1e-3, "um": 1.0, "mm": 1e3, "cm": 1e4, "m": 1e6, "inch": 25400.0}
# What trimesh calls them
_OTHER_NAMES = {
    "nanometers": "nm", "micrometers": "um", "microns": "um", "micron": "um",
    "millimeters": "mm", "centimeters": "cm", "meters": "m", "inches": "inch",
}  # fmt: skip


class Raw(NamedTuple):
    """Vertices, faces, part of a file that each face comes from, unit, labels if known.

    Of parts nothing is known where a file labels polygons that were cut into triangles.
    """

    vertices: np.ndarray
    faces: np.ndarray
    parts: np.ndarray | None
    unit: str | None
    labels: np.ndarray | None = None


def read_mesh_file(path: Path) -> Raw:
    """Read a mesh file through trimesh.

    Raises
    ------
    DataFileError
        If the file is missing, of another format, damaged or without triangles.
    """
    suffix = path.suffix.lower()
    if suffix not in (*FORMATS, OWN_FORMAT):
        raise DataFileError(
            path, f"is no mesh file by its name: {suffix or 'no suffix'!r}",
            f"Known: {', '.join((*FORMATS, OWN_FORMAT))}.",
        )  # fmt: skip
    if not path.is_file():
        raise DataFileError(path, "is not there, or no file", "Check the path.")
    file_size(path)
    check_promises(path)
    try:
        if suffix == OWN_FORMAT:
            return _own(path)
        # Of OBJ trimesh takes the parts from the last one on
        raw = _raw_of(_loaded(path), backwards=suffix == ".obj")
    except DataFileError:
        raise
    except Exception as error:
        # Its readers fail in every way that a damaged file can make an array fail
        reason = f"{type(error).__name__}: {error}"[:200]
        raise DataFileError(
            path, f"cannot be read as a mesh ({reason})", "Write it again, or as PLY."
        ) from error
    if raw is None or len(raw.faces) == 0:
        raise DataFileError(
            path, "holds no triangles, or is cut short", "Write it again with faces."
        )
    # Numbers of a file are micrometres unless the caller says otherwise
    return raw._replace(unit=None)


def _loaded(path: Path) -> Any:
    """Load a mesh by trimesh, which gets no other files but the buffers of glTF."""
    import trimesh

    buffers = buffers_of(path)

    class Buffers(trimesh.resolvers.FilePathResolver):
        def get(self, name: str) -> bytes:
            if name not in buffers:
                return b""
            return read_bounded(companion(path, unquote(name), "buffers"))

    more: dict[str, Any] = {"split_objects": True} if path.suffix.lower() == ".obj" else {}
    # It tells of colours and pictures that are not there
    told = trimesh.util.log
    told.addFilter(_mute)
    try:
        return trimesh.load(path, process=False, resolver=Buffers(str(path)), **more)
    finally:
        told.removeFilter(_mute)


def _mute(_: logging.LogRecord) -> bool:
    return False


def _own(path: Path) -> Raw:
    """Arrays that a scene was written with."""
    with path.open("rb") as stream, np.load(stream, allow_pickle=False) as arrays:
        faces = arrays["faces"]
        labels = arrays.get("labels")
        parts = np.zeros(len(faces), int) if labels is None else labels
        return Raw(arrays["vertices"], faces, parts, "um", labels)


def _raw_of(loaded: Any, *, backwards: bool = False) -> Raw | None:
    """Take a Trimesh, or a scene of several, apart; None of anything else."""
    if hasattr(loaded, "geometry"):
        pieces = []
        # The nodes of a graph come in an order of their own, not that of the file
        names = list(loaded.geometry)[:: -1 if backwards else 1]
        place = {name: k for k, name in enumerate(names)}
        nodes = sorted(
            loaded.graph.nodes_geometry, key=lambda node: place[loaded.graph[node][1]]
        )
        for node in nodes:
            transform, name = loaded.graph[node]
            piece = loaded.geometry[name]
            if hasattr(piece, "faces"):
                pieces.append(piece.copy().apply_transform(transform))
        if not pieces:
            return None
        first = np.cumsum([0, *(len(piece.vertices) for piece in pieces[:-1])])
        return Raw(
            np.concatenate([piece.vertices for piece in pieces]),
            np.concatenate(
                [piece.faces + k for piece, k in zip(pieces, first, strict=True)]
            ),
            np.repeat(np.arange(len(pieces)), [len(piece.faces) for piece in pieces]),
            loaded.units,
        )
    if not hasattr(loaded, "faces"):
        return None
    faces = np.asarray(loaded.faces)
    return Raw(np.asarray(loaded.vertices), faces, _face_labels(loaded), loaded.units)


def _face_labels(loaded: Any) -> np.ndarray | None:
    """Numbers of faces that a PLY file holds, else 0; None if they are not of triangles."""
    raw = loaded.metadata.get("_ply_raw", {}).get("face", {}).get("data")
    names = () if raw is None else getattr(raw, "dtype", np.dtype(int)).names or tuple(raw)
    for name in FACE_LABELS:
        if name in names:
            numbers = np.asarray(raw[name]).ravel()
            return numbers if len(numbers) == len(loaded.faces) else None
    return np.zeros(len(loaded.faces), dtype=int)


def raw_mesh(mesh: Any) -> Raw:
    """Vertices and faces of a Trimesh, a scene of trimesh, a pair of arrays or a file.

    Raises
    ------
    TypeError
        If it is none of these.
    """
    if isinstance(mesh, str | Path):
        return read_mesh_file(Path(mesh))
    if isinstance(mesh, tuple) and len(mesh) == 2:
        vertices, faces = mesh
        if np.ma.is_masked(faces):
            msg = "faces must be whole numbers, got a masked value. Leave out those faces."
            raise ValueError(msg)
        if np.ma.is_masked(vertices):
            # Missing; what no face uses may be so
            vertices = real_array("vertices", vertices)
        faces = np.asarray(faces)
        return Raw(np.asarray(vertices), faces, np.zeros(len(faces), int), None)
    raw = _raw_of(mesh)
    if raw is None:
        msg = (
            "mesh must be a trimesh.Trimesh, a mesh file or (vertices, faces), got "
            f"{type(mesh).__name__}. Heights on a grid are a HeightMap."
        )
        raise TypeError(msg)
    return raw


def micrometres(unit: str | None, own: str | None) -> float:
    """Micrometres in the unit asked for, else in the mesh's own, else one.

    Raises
    ------
    ValueError
        If the unit is unknown.
    """
    name = unit if unit is not None else own
    if name is None:
        return 1.0
    name = _OTHER_NAMES.get(name, name)
    if name not in UNITS:
        msg = f"unit must be one of {', '.join(UNITS)}, got {name!r}."
        raise ValueError(msg)
    return UNITS[name]
