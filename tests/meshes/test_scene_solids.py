"""Scenes written as meshes: closed where they claim to be, of the right volume."""

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose

from pbrdf import Drops, Film, GaussianSurface, HeightMap, MeshSurface, Scene, Spheres
from pbrdf.scene.solids import export_scene, scene_solids
from tests.meshes.shapes import mushrooms

ROUGH = GaussianSurface(shape=(20, 24), spacing=1.0, corr_length=5.0, slope_rms=0.2)


def test_a_block_is_watertight_and_has_the_volume_of_the_heights():
    heights = HeightMap(ROUGH.sample(4).heights, (1.0, 1.5))
    block = scene_solids(Scene(heights, "bk7"), base=2.0)["surface"]
    assert block.is_watertight
    assert block.is_winding_consistent
    z = heights.heights - heights.heights.min() + 2.0
    # Mean of the two facets of each cell, each of them over half of it
    cells = (z[:-1, :-1] + z[1:, 1:]) / 3 + (z[1:, :-1] + z[:-1, 1:]) / 6
    assert block.volume == pytest.approx(1.5 * cells.sum(), rel=1e-12)
    assert not scene_solids(Scene(heights, "bk7"))["surface"].is_watertight


def test_drops_and_spheres_are_closed_and_of_their_size():
    drops = Drops.at([[5.0, 5.0]], volume=20.0, contact_angle=1.9)
    balls = Spheres.at([[14.0, 15.0], [4.0, 16.0]], radius=1.5, material="bk7")
    solids = scene_solids(
        Scene(HeightMap.flat((20.0, 24.0)), "bk7", [drops, balls]), sections=200
    )
    assert sorted(solids) == ["body 0", "body 1", "body 2", "surface"]
    for name in ("body 0", "body 1", "body 2"):
        assert solids[name].is_watertight
        assert solids[name].volume > 0.0
    for name in ("body 1", "body 2"):
        assert solids[name].volume == pytest.approx(4 / 3 * np.pi * 1.5**3, rel=2e-3)
        assert_allclose(solids[name].bounds[:, 2], [0.0, 3.0], atol=1e-9)
    # Of a drop the whole sphere is written; above the plane it has its volume
    sphere = solids["body 0"]
    radius = 0.5 * np.ptp(sphere.bounds[:, 2])
    height = radius * (1 - np.cos(1.9))
    assert np.pi * height**2 * (radius - height / 3) == pytest.approx(20.0, rel=1e-6)
    assert sphere.bounds[1, 2] == pytest.approx(height, rel=1e-9)


def test_films_lie_on_the_surface():
    scene = Scene(ROUGH, "bk7", Film(thickness=0.7))
    solids = scene_solids(scene, seed=3)
    rise = solids["film"].vertices - solids["surface"].vertices
    assert rise[:, 2].min() >= 0.0
    assert rise[:, 2].max() > 0.3


@pytest.mark.parametrize("suffix", ["glb", "stl", "ply"])
def test_files_can_be_read_again(tmp_path, suffix):
    balls = Spheres.at([[14.0, 15.0]], radius=1.5, material="bk7")
    path = tmp_path / f"scene.{suffix}"
    export_scene(Scene(ROUGH, "bk7", balls), path, seed=2)
    loaded = trimesh.load(path)
    mesh = loaded.to_mesh() if hasattr(loaded, "geometry") else loaded
    assert_allclose(mesh.extents[:2], [20.0, 24.0], rtol=1e-6)
    if suffix == "glb":
        assert set(loaded.geometry) == {"surface", "body 0"}


def test_a_mesh_is_written_as_it_is(tmp_path):
    mesh = mushrooms()
    export_scene(Scene(mesh, "bk7"), tmp_path / "again.ply")
    assert len(MeshSurface(tmp_path / "again.ply", mesh.period).faces) == len(mesh.faces)
    with pytest.raises(ValueError, match="base must be left out"):
        scene_solids(Scene(mesh, "bk7"), base=1.0)
    with pytest.raises(ValueError, match=r"path must end in one of .glb"):
        export_scene(Scene(mesh, "bk7"), tmp_path / "again.step")
