"""What a mesh file says that it holds, checked before anything is made of it."""

import json
import math
import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.errors import DataFileError
from pbrdf.files import read_bounded

__all__ = ["buffers_of", "check_promises"]

HOSTILE = "The file is damaged or hostile."
# Arrays of vertices and faces are packed by less, and small files may be anything
_MOST_EXPANSION, _SMALL = 50, 64 * 2**20
_MOST_NODES = 5000
_MOST_DESCRIPTION = 64 * 2**20


def check_promises(path: Path) -> None:
    """Refuse arrays and parts that a file promises and cannot hold.

    The other formats are read by libraries that take only what is there.

    Raises
    ------
    DataFileError
        If it promises more than it can hold.
    """
    suffix = path.suffix.lower()
    try:
        if suffix == ".npz":
            _check_archive(path)
        elif suffix == ".obj":
            _check_objects(path)
        elif suffix in (".glb", ".gltf"):
            _check_scene(path, _description(path))
    except DataFileError:
        raise
    except Exception as error:
        # A description can be wrong in every way that nested lists and names can
        problem = f"cannot be read as a mesh ({type(error).__name__}: {error})"[:200]
        raise DataFileError(path, problem, HOSTILE) from error


def _check_archive(path: Path) -> None:
    most = max(_SMALL, _MOST_EXPANSION * path.stat().st_size)
    with zipfile.ZipFile(path) as archive:
        members = archive.infolist()
        total = sum(one.file_size for one in members)
        if total > most:
            problem = f"its arrays would take {total / 2**20:.0f} MiB"
            raise DataFileError(path, problem, HOSTILE)
        for one in members:
            with archive.open(one) as stream:
                version = np.lib.format.read_magic(stream)
                read = (
                    np.lib.format.read_array_header_1_0
                    if version == (1, 0)
                    else np.lib.format.read_array_header_2_0
                )
                shape, _, dtype = read(stream)
            if dtype.itemsize * math.prod(shape) > one.file_size:
                problem = f"{one.filename[:40]} promises {shape} values, and holds less"
                raise DataFileError(path, problem, HOSTILE)


def _check_objects(path: Path) -> None:
    """Count the lines that begin an object or a material; each costs a millisecond."""
    content = read_bounded(path)
    parts = sum(content.count(word) for word in (b"\no ", b"\nusemtl "))
    if parts > _MOST_NODES:
        problem = f"has {parts} objects and materials"
        raise DataFileError(path, problem, f"At most {_MOST_NODES}.")


def _description(path: Path) -> Any:
    """Return the JSON of a glTF file, plain or binary."""
    with path.open("rb") as stream:
        if path.suffix.lower() == ".gltf":
            return json.loads(stream.read(_MOST_DESCRIPTION))
        _, _, _, length, _ = struct.unpack("<4sIII4s", stream.read(20))
        return json.loads(stream.read(min(length, _MOST_DESCRIPTION)))


def buffers_of(path: Path) -> set[str]:
    """Return the names of the files in which a glTF file says that its arrays are."""
    if path.suffix.lower() != ".gltf":
        return set()
    return {str(one.get("uri")) for one in _description(path).get("buffers", [])}


def _check_scene(path: Path, described: dict[str, Any]) -> None:
    nodes = described.get("nodes", [])
    children = [child for node in nodes for child in node.get("children", [])]
    if len(nodes) > _MOST_NODES or len(children) > len(set(children)):
        problem = f"has {len(nodes)} nodes, or nodes in several places"
        raise DataFileError(path, problem, f"At most {_MOST_NODES}, each in one place.")
    parts = sum(len(mesh.get("primitives", [])) for mesh in described.get("meshes", []))
    if parts > _MOST_NODES:
        problem = f"has {parts} parts of meshes"
        raise DataFileError(path, problem, f"At most {_MOST_NODES}.")
    size = path.stat().st_size
    for buffer in described.get("buffers", []):
        beside = path.parent / str(buffer.get("uri", "")[:200])
        if "uri" in buffer and not buffer["uri"].startswith("data:") and beside.is_file():
            size += beside.stat().st_size
    counts = [int(one.get("count", 0)) for one in described.get("accessors", [])]
    # Each value takes a byte at the least
    if max(counts, default=0) > size:
        problem = f"promises {max(counts)} values, and holds {size} bytes"
        raise DataFileError(path, problem, HOSTILE)
    drawn = [node["mesh"] for node in nodes if "mesh" in node]
    of_mesh = [
        sum(
            counts[part["attributes"]["POSITION"]]
            for part in mesh.get("primitives", [])
            if "POSITION" in part.get("attributes", {})
        )
        for mesh in described.get("meshes", [])
    ]
    total = sum(of_mesh[mesh] for mesh in drawn)
    if total > max(_SMALL // 64, _MOST_EXPANSION * size):
        problem = f"draws {total} vertices of a file of {size} bytes"
        raise DataFileError(path, problem, HOSTILE)
