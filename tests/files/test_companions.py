"""What a mesh file names beside itself: nothing is read but the buffers of glTF."""

import json
import logging
import os
import time

import numpy as np
import pytest

from pbrdf import MeshSurface
from pbrdf.errors import DataFileError
from tests.files.test_hostile_kinds import glb, gltf, ply

TRIANGLE = "v 0 0 0\nv 4 0 0\nv 0 4 0\nf 1 2 3\n"
POINTS = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]], dtype="<f4").tobytes()
PICTURE = {
    "textures": [{"source": 0}],
    "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
}


@pytest.fixture
def folder(tmp_path):
    """Opening the pipe would last for ever."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "points.bin").write_bytes(POINTS)
    return tmp_path


@pytest.mark.parametrize("words", ["mtllib pipe\n", "mtllib m.mtl\nusemtl a\nvt 0 0\n"])
def test_materials_of_obj_are_not_read(folder, words):
    (folder / "m.mtl").write_text("newmtl a\nmap_Kd pipe\n")
    (folder / "a.obj").write_text(words + TRIANGLE)
    assert len(MeshSurface(folder / "a.obj").faces) == 1


def test_pictures_of_ply_are_not_read(folder, caplog):
    held = ply("ascii", 3, 1, "uchar", b"0 0 0\n4 0 0\n0 4 0\n3 0 1 2\n")
    held = held.replace(b"element vertex", b"comment TextureFile pipe\nelement vertex")
    (folder / "a.ply").write_bytes(held)
    with caplog.at_level(logging.DEBUG):
        assert len(MeshSurface(folder / "a.ply").faces) == 1
    assert not caplog.records


@pytest.mark.parametrize("name", ["points.bin", "p%6Fints.bin"])
def test_buffers_of_gltf_are_read(folder, name):
    described = gltf(buffers=[{"byteLength": 36, "uri": name}])
    (folder / "a.gltf").write_text(json.dumps(described))
    assert len(MeshSurface(folder / "a.gltf").faces) == 1


@pytest.mark.parametrize("name", ["pipe", "../a.bin", "/dev/zero", "points"])
def test_other_buffers_are_not(folder, name):
    described = gltf(buffers=[{"byteLength": 36, "uri": name}])
    (folder / "a.gltf").write_text(json.dumps(described))
    with pytest.raises(DataFileError, match=r"a\.gltf|pipe|points"):
        MeshSurface(folder / "a.gltf")


def test_pictures_of_glb_are_not_read(folder):
    held = glb(gltf(images=[{"uri": "pipe"}], **PICTURE))[:-36] + POINTS
    (folder / "a.glb").write_bytes(held)
    assert len(MeshSurface(folder / "a.glb").faces) == 1


@pytest.mark.parametrize(
    ("suffix", "held"),
    [
        (".obj", 20_000 * b"o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -3\n"),
        (
            ".glb",
            glb(gltf(meshes=[{"primitives": [{"attributes": {"POSITION": 0}}] * 20_000}])),
        ),
    ],
)
def test_many_thousands_of_parts_are_refused(tmp_path, suffix, held):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(held)
    begin = time.process_time()
    with pytest.raises(DataFileError, match=r"has (19999|20000) (objects|parts)"):
        MeshSurface(path)
    assert time.process_time() - begin < 2.0
