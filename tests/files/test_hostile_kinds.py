"""Hostile files of each kind: refused within 5 s, and without the memory they promise."""

import io
import json
import os
import resource
import struct
import time
import warnings
import zipfile
import zlib
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import data_io
import pbrdf
from pbrdf.errors import DataFileError

MANY = 2_000_000_000
PLY = (
    "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
    "property float z\nelement face {}\nproperty list {} int vertex_indices\nend_header\n"
)


def ply(kind: str, vertices: int, faces: int, of_list: str, data: bytes) -> bytes:
    return PLY.format(kind, vertices, faces, of_list).encode() + data


def gltf(**changes: object) -> dict[str, object]:
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
    } | changes


def glb(described: object, held: int = 36) -> bytes:
    text = json.dumps(described).encode()
    text += b" " * (-len(text) % 4)
    size = 12 + 8 + len(text) + 8 + held
    return (
        struct.pack("<4sII", b"glTF", 2, size)
        + struct.pack("<I4s", len(text), b"JSON")
        + text
        + struct.pack("<I4s", held, b"BIN\0")
        + bytes(held)
    )


def accessor(**changes: object) -> list[dict[str, object]]:
    return [{"componentType": 5126, "count": MANY, "type": "VEC3"} | changes]


def npz(rows: int, held: int) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("vertices", "faces"):
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                head = {"descr": "<f8", "fortran_order": False, "shape": (rows, 3)}
                np.lib.format.write_array_header_1_0(member, head)
                member.write(bytes(held))
    return content.getvalue()


def laughs(line: str) -> bytes:
    rows = [line.format(k, ",".join([f"*a{k - 1}"] * 10)) for k in range(1, 10)]
    return (
        "REFERENCES: x\na0: &a0 {x: 1}\n" + "".join(rows) + "DATA:\n  - type: *a9\n"
    ).encode()


@cache
def tiff(side: int) -> bytes:
    """Write a square picture of one grey that is packed a thousand times."""
    squeeze = zlib.compressobj(9)
    rows = b"".join(squeeze.compress(bytes(side)) for _ in range(side)) + squeeze.flush()
    tags = [(256, side), (257, side), (258, 8), (259, 8), (262, 1), (273, 8), (277, 1),
            (278, side), (279, len(rows))]  # fmt: skip
    rows += bytes(len(rows) % 2)
    table = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags)
    start = struct.pack("<2sHI", b"II", 42, 8 + len(rows))
    return start + rows + struct.pack("<H", len(tags)) + table + bytes(4)


def heights(path: Path) -> object:
    return data_io.read_height_map(path, spacing=1.0, um_per_level=0.1)


# Reader and content; one that takes time to make is a function
MESH, CONSTANTS = pbrdf.MeshSurface, pbrdf.materials.read
KINDS = {
    "stl": (".stl", MESH, bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(500)),
    "ply": (".ply", MESH, ply("binary_little_endian", MANY, MANY, "uchar", bytes(99))),
    "ply of text": (".ply", MESH, ply("ascii", MANY, 1, "uchar", b"0 0 0\n")),
    "ply of one face": (
        ".ply", MESH,
        ply("binary_little_endian", 3, 1, "uint", bytes(36) + b"\xff" * 4 + bytes(12)),
    ),
    "obj": (".obj", MESH, b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 2000000000\n"),
    "off": (".off", MESH, f"OFF\n{MANY} {MANY} 0\n0 0 0\n".encode()),
    "glb of nothing": (".glb", MESH, glb(gltf(accessors=accessor()))),
    "glb": (".glb", MESH, glb(gltf(accessors=accessor(bufferView=0)))),
    "glb of nodes": (".glb", MESH, glb(gltf(nodes=[{"mesh": 0}] * 200_000))),
    "glb of itself": (
        ".glb", MESH,
        glb(gltf(nodes=[{"mesh": 0, "children": [k + 1, k + 1]} for k in range(40)])),
    ),
    "glb of no sense": (".glb", MESH, glb([1, 2])),
    "gltf of another": (
        ".gltf", MESH,
        json.dumps(gltf(buffers=[{"byteLength": 36, "uri": "/dev/zero"}])).encode(),
    ),
    "npz of a header": (".npz", MESH, npz(2**40, 10)),
    "npz of zeros": (".npz", MESH, lambda: npz(2**22, 3 * 8 * 2**22)),
    "aliases": (".yml", CONSTANTS, laughs("a{0}: &a{0} [{1}]\n")),
    "merged aliases": (".yml", CONSTANTS, laughs("a{0}: &a{0} {{{{<<: [{1}]}}}}\n")),
    "no date": (".yml", CONSTANTS, b"REFERENCES: x\nDATA:\n  - type: !!timestamp x\n"),
    "deep": (".yml", CONSTANTS, b"DATA:\n  - type: " + b"[" * 100_000),
    "deep keys": (".yml", CONSTANTS, b"? " * 20_000 + b"a"),
    "to base 60": (".yml", CONSTANTS, b"DATA: " + b"1:" * 300_000 + b"1"),
    "said to base 60": (".yml", CONSTANTS, b'DATA: !!int "' + b"1: " * 300_000 + b'1"'),
    "empty lists": (".toml", pbrdf.load_scene, b"a = [" + b"[]," * 2_000_000 + b"]"),
    "escaped": (".toml", pbrdf.load_scene, b'a = "' + b"\\u0041" * 5_000_000 + b'"'),
    "many parts": (".yml", CONSTANTS, b"DATA:\n" + b"  - {type: a}\n" * 400_000),
    "tiff of heights": (".tif", heights, lambda: tiff(16_000)),
    "tiff": (".tif", lambda p: data_io.read_profile_image(p, 1.0), lambda: tiff(16_000)),
}  # fmt: skip


def refused(path: Path, read) -> None:
    start, before = time.process_time(), peak()
    with warnings.catch_warnings(action="ignore"), pytest.raises(DataFileError) as caught:
        read(path)
    assert time.process_time() - start < 5.0
    assert peak() - before < 2**30
    assert path.name in str(caught.value)
    assert len(str(caught.value)) <= 320


def peak() -> int:
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


@pytest.mark.parametrize("kind", KINDS)
def test_hostile_files_are_refused(tmp_path, kind):
    suffix, read, content = KINDS[kind]
    path = tmp_path / f"hostile{suffix}"
    path.write_bytes(content() if callable(content) else content)
    refused(path, read)


READERS = {
    ".stl": MESH, ".ply": MESH, ".obj": MESH, ".glb": MESH, ".npz": MESH,
    ".yml": CONSTANTS, ".csv": CONSTANTS, ".nk": CONSTANTS, ".tif": heights,
    ".sdf": data_io.read_height_map, ".sur": data_io.read_height_map,
    ".h5": data_io.read_height_map, ".mat": data_io.read_height_map,
    ".bsdf": data_io.read_goniometer, ".pbsdf": data_io.read_goniometer,
    ".toml": data_io.read_model,
}  # fmt: skip


@pytest.mark.parametrize("suffix", READERS)
def test_pipes_devices_and_folders_are_no_files(tmp_path, suffix):
    pipe, zero, folder = (tmp_path / f"{name}{suffix}" for name in ("pipe", "zero", "dir"))
    os.mkfifo(pipe)
    zero.symlink_to("/dev/zero")
    folder.mkdir()
    for path in (pipe, zero, folder):
        refused(path, READERS[suffix])


def test_good_files_of_these_kinds_are_read(tmp_path):
    path = tmp_path / "good.glb"
    triangle = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]], dtype="<f4").tobytes()
    path.write_bytes(glb(gltf())[:-36] + triangle)
    from pbrdf.surface.mesh.reading import read_mesh_file

    assert len(read_mesh_file(path).faces) == 1
    path = tmp_path / "good.yml"
    path.write_text(
        "DATA:\n  - type: tabulated n\n    data: |\n      0.4 1.5\n      0.8 1.4\n"
    )
    assert CONSTANTS(path).index(0.4)[0] == pytest.approx(1.5)
