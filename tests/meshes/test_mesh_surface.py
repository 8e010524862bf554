"""Meshes are checked: mended with a count, or refused by name."""

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose, assert_array_equal

from pbrdf import (
    AccuracyWarning,
    DataFileError,
    GaussianSurface,
    HeightMap,
    Material,
    MeshSurface,
    Scene,
    load_scene,
)
from tests.meshes.shapes import joined, mushrooms, pair, plate


def ball(**options):
    return trimesh.creation.icosphere(subdivisions=2, **options)


def test_kinds_of_meshes():
    assert MeshSurface(ball()).kind == "bodies"
    assert MeshSurface(plate()).kind == "sheet"
    assert MeshSurface(plate(), (10.0, 8.0)).kind == "ground"
    assert mushrooms().kind == "ground"
    # A slab has two sides and light on both
    below = plate()
    slab = joined(plate(), (below[0] - [0.0, 0.0, 1.0], below[1][:, ::-1]))
    assert MeshSurface(slab, (10.0, 8.0)).kind == "bodies"


def test_a_body_across_the_seam_is_whole():
    whole = trimesh.creation.uv_sphere(radius=1.0, count=[12, 12])
    right = whole.triangles_center[:, 0] > 0
    halves, others = whole.copy(), whole.copy()
    halves.update_faces(right)
    others.update_faces(~right)
    # Two halves at opposite ends of the period, open where they are cut
    mesh = MeshSurface(joined(pair(halves), pair(others, (4.0, 0.0, 0.0))), (4.0, 3.0))
    assert mesh.kind == "bodies"
    assert mesh.repairs == ()
    with pytest.raises(ValueError, match="open edges"):
        MeshSurface(joined(pair(halves), pair(others, (4.0, 0.0, 0.0))), (4.1, 3.0))


def test_inverted_faces_and_bodies_are_turned_and_counted():
    whole = MeshSurface(ball())
    inside_out = ball()
    inside_out.invert()
    with pytest.warns(AccuracyWarning, match="1 of 1 parts looked inwards"):
        assert_allclose(MeshSurface(inside_out).normals, whole.normals)
    faces = np.array(ball().faces)
    faces[[4, 17]] = faces[[4, 17], ::-1]
    with pytest.warns(AccuracyWarning, match=r"2 of 320 faces .* faces 4, 17"):
        assert_allclose(MeshSurface((ball().vertices, faces)).normals, whole.normals)
    upside_down = plate()[0], plate()[1][:, ::-1]
    with pytest.warns(AccuracyWarning, match="looked inwards"):
        turned = MeshSurface(upside_down, (10.0, 8.0))
    assert (turned.normals[:, 2] > 0).all()
    # Among others the one that is wrong
    hidden = pair(inside_out, (5.0, 4.0, 2.0))
    with pytest.warns(AccuracyWarning, match="1 of 2 parts looked inwards"):
        both = MeshSurface(joined(plate(), hidden), (10.0, 8.0))
    assert both.kind == "ground"


def test_the_wall_of_a_hollow_looks_inwards_rightly():
    hollow = ball(radius=0.4)
    hollow.invert()
    mesh = MeshSurface(joined(pair(ball(radius=1.0)), pair(hollow)))
    assert mesh.repairs == ()


def test_a_body_half_sunk_in_the_ground_may_be_open_where_no_light_comes():
    cap = ball(radius=2.0)
    cap.update_faces((cap.vertices[cap.faces][:, :, 2] > -0.1).any(axis=1))
    mesh = MeshSurface(joined(plate(), pair(cap, (5.0, 4.0, 0.0))), (10.0, 8.0))
    assert mesh.kind == "ground"
    with pytest.raises(ValueError, match=r"open edges, the first at \("):
        MeshSurface(joined(plate(), pair(cap, (5.0, 4.0, 1.5))), (10.0, 8.0))


def test_a_hole_is_refused_with_its_place():
    holed = ball()
    holed.update_faces(np.arange(320) != 7)
    with pytest.raises(ValueError, match=r"3 open edges, the first at \(.*\) um, face"):
        MeshSurface(holed)
    vertices, faces = plate(cells=5)
    with pytest.raises(ValueError, match="open edges"):
        MeshSurface((vertices, np.delete(faces, 12, axis=0)), (10.0, 8.0))


def test_double_and_flat_faces_are_left_out_and_counted():
    vertices, faces = pair(ball())
    with pytest.warns(AccuracyWarning, match="2 faces given twice"):
        mesh = MeshSurface((vertices, np.concatenate([faces, faces[[3, 9]]])))
    assert len(mesh.faces) == 320
    with pytest.warns(AccuracyWarning, match="1 of 321 faces with two corners in one"):
        MeshSurface((vertices, np.concatenate([faces, [[0, 0, 5]]])))
    # A face without area between three vertices of one edge
    middle = 0.5 * (vertices[faces[0, 0]] + vertices[faces[0, 1]])
    a, b, c = faces[0]
    new = len(vertices)
    split = [[a, new, c], [new, b, c], [a, b, new]]
    with pytest.warns(AccuracyWarning, match="without an area were left out"):
        cut = MeshSurface(
            (np.vstack([vertices, middle]), np.concatenate([faces[1:], split]))
        )
    assert len(cut.faces) == 321
    assert_allclose(cut.areas.sum(), mesh.areas.sum())


def test_what_has_no_inside_is_refused():
    vertices, faces = plate()
    with pytest.raises(ValueError, match="pairs back to back"):
        MeshSurface((vertices, np.concatenate([faces, faces[:2, ::-1]])), (10.0, 8.0))
    t = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    rims = [
        np.stack(
            [(2 + w * np.cos(t / 2)) * np.cos(t), (2 + w * np.cos(t / 2)) * np.sin(t),
             w * np.sin(t / 2)], axis=1,
        )
        for w in (-0.5, 0.5)
    ]  # fmt: skip
    strip = []
    for k in range(40):
        a, b, c, d = k, (k + 1) % 40, 40 + k, 40 + (k + 1) % 40
        if k == 39:
            b, d = d, b
        strip += [(a, b, d), (a, d, c)]
    with pytest.raises(ValueError, match="Möbius"):
        MeshSurface((np.concatenate(rims), strip))
    with pytest.raises(ValueError, match="2 layers that each cover the period"):
        MeshSurface(joined(plate(), (plate()[0] - [0, 0, 1.0], plate()[1])), (10.0, 8.0))
    with pytest.raises(ValueError, match="three or more"):
        MeshSurface(([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1)],
                     [(0, 1, 2), (1, 0, 3), (0, 1, 4)]))  # fmt: skip


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (
            lambda v, f: (np.where(np.arange(len(v))[:, None] == 3, np.nan, v), f),
            "vertex 3",
        ),
        (lambda v, f: (v, f + 1), "must name vertices from 0 to"),
        (lambda v, f: (v[:, :2], f), "vertices must have shape"),
        (lambda v, f: (v, f[:0]), "faces must have shape"),
        (lambda v, f: (v, f + 0.5), "faces must be whole numbers"),
        (lambda v, f: (v * 0.0, f), "corners apart"),
    ],
)
def test_arrays_that_are_no_mesh(change, match):
    with pytest.raises((TypeError, ValueError), match=match):
        MeshSurface(change(*pair(ball())))


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"period": (10.0, -1.0)}, "period must be positive"),
        ({"period": (5.0, 8.0)}, "of which a closed part covers 2 times"),
        ({"labels": [0, 1]}, "one number for each of the 18 faces"),
        ({"labels": np.full(18, 300)}, "0, 255"),
        ({"labels": "colours"}, 'numbers of materials or "parts"'),
        ({"unit": "ell"}, "unit must be one of"),
    ],
)
def test_arguments_are_checked(options, match):
    with pytest.raises(ValueError, match=match):
        MeshSurface(plate(), **({"period": (10.0, 8.0)} | options))


def test_a_mesh_is_not_a_map():
    with pytest.raises(TypeError, match="Heights on a grid are a HeightMap"):
        MeshSurface(np.zeros((4, 4)))


def test_units_and_labels_of_faces():
    labels = np.arange(18) % 3
    mesh = MeshSurface(plate(), (1e4, 8e3), labels, unit="mm")
    assert_allclose(mesh.bounds[1, :2], [1e4, 8e3])
    assert_array_equal(mesh.labels, labels)
    scene = Scene(mesh, ["gold", "bk7", "water"])
    assert len(scene.materials) == 3
    with pytest.raises(ValueError, match="one material for each label"):
        Scene(mesh, ["gold", "bk7"])
    inches = ball()
    inches.units = "inches"
    assert_allclose(MeshSurface(inches).bounds[1, 2], 25400.0)


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj", "glb", "off"])
def test_files_give_the_mesh_that_was_written(tmp_path, suffix):
    mesh = mushrooms()
    path = tmp_path / f"mushrooms.{suffix}"
    mesh.to_trimesh().export(path)
    again = MeshSurface(path, mesh.period)
    assert again.kind == "ground"
    assert len(again.faces) == len(mesh.faces)
    assert_allclose(again.bounds, mesh.bounds, atol=1e-6)
    assert_allclose(again.areas.sum(), mesh.areas.sum(), rtol=1e-6)


def test_parts_of_a_file_are_labels(tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.Trimesh(*plate(), process=False))
    scene.add_geometry(
        ball(), transform=trimesh.transformations.translation_matrix([5, 4, 2])
    )
    scene.export(tmp_path / "two.glb")
    mesh = MeshSurface(tmp_path / "two.glb", (10.0, 8.0), "parts")
    heights = mesh.vertices[mesh.faces].mean(axis=1)[:, 2]
    assert sorted(np.unique(mesh.labels)) == [0, 1]
    assert np.ptp(heights[mesh.labels == mesh.labels[heights.argmin()]]) < 1e-6


DAMAGED = {
    "cut.stl": lambda whole: whole[:500],
    "empty.stl": lambda whole: b"",
    "noise.stl": lambda whole: bytes(range(256)) * 9,
    "huge.stl": lambda whole: b"x" * 80 + b"\xff" * 4 + b"0" * 50,
    "cut.ply": lambda whole: b"ply\nformat ascii 1.0\nelement vertex 3\n",
    "points.ply": lambda whole: (
        b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
        b"property float z\nend_header\n0 0 0\n"
    ),
    "huge.ply": lambda whole: (
        b"ply\nformat binary_little_endian 1.0\nelement vertex 999999999999\n"
        b"property float x\nproperty float y\nproperty float z\nend_header\n0000"
    ),
    "beyond.obj": lambda whole: b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
    "nan.obj": lambda whole: b"v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n",
    "cut.glb": lambda whole: b"glTF\x02\x00",
    "words.off": lambda whole: b"OFF\nthree vertices\n",
    "zip.npz": lambda whole: b"PK\x03\x04 no archive",
    "mesh.step": lambda whole: b"ISO-10303-21;",
}


@pytest.mark.parametrize("name", DAMAGED)
def test_damaged_files_are_refused_as_files(tmp_path, name):
    path = tmp_path / name
    whole = ball().export(file_type="stl")
    path.write_bytes(DAMAGED[name](whole))
    with pytest.raises(DataFileError, match=name):
        MeshSurface(path)
    with pytest.raises(DataFileError, match="not there"):
        MeshSurface(tmp_path / "nowhere.ply")


def test_faults_of_the_mesh_in_a_file_name_the_file(tmp_path):
    holed = ball()
    holed.update_faces(np.arange(320) != 7)
    holed.export(tmp_path / "holed.ply")
    with pytest.raises(DataFileError, match=r"holed.ply: .*open edges.* Fill the holes"):
        MeshSurface(tmp_path / "holed.ply")


@pytest.mark.parametrize("large", [False, True])
def test_scenes_with_meshes_survive_their_files(tmp_path, large):
    if large:
        rough = GaussianSurface(shape=(40, 40), spacing=0.5, corr_length=4, slope_rms=0.3)
        mesh = MeshSurface.of_map(rough.sample(1))
    else:
        mesh = MeshSurface(plate(), (10.0, 8.0), np.arange(18) % 2)
    materials = [Material(1.4, 0.2), Material(1.6)] if not large else Material(1.4)
    Scene(mesh, materials).to_toml(tmp_path / "scene.toml")
    assert bool(list(tmp_path.glob("scene-*.npz"))) == large
    again = load_scene(tmp_path / "scene.toml")
    assert isinstance(again.surface, MeshSurface)
    assert_array_equal(again.surface.vertices, mesh.vertices)
    assert_array_equal(again.surface.faces, mesh.faces)
    assert again.surface.period == mesh.period
    if not large:
        assert_array_equal(again.surface.labels, mesh.labels)


def test_a_scene_file_names_a_mesh_file(tmp_path):
    mushrooms().to_trimesh().export(tmp_path / "part.stl")
    text = '[surface]\ntype = "mesh"\nfile = "part.stl"\nperiod_um = [6.0, 5.0]\n'
    path = tmp_path / "scene.toml"
    path.write_text(text + '[substrate]\nmaterial = "bk7"\n')
    assert load_scene(path).surface.kind == "ground"
    path.write_text(text + "faces = [[0, 1, 2]]\nvertices_um = []\n[substrate]\nn = 1.5\n")
    with pytest.raises(DataFileError, match="exactly one"):
        load_scene(path)
    path.write_text(text.replace("part.stl", "gone.stl") + "[substrate]\nn = 1.5\n")
    with pytest.raises(DataFileError, match=r"gone\.stl: is not there"):
        load_scene(path)
    path.write_text(text + 'colour = "red"\n[substrate]\nn = 1.5\n')
    with pytest.raises(DataFileError, match="unknown key 'colour'"):
        load_scene(path)


def test_a_map_with_holes_makes_no_mesh():
    with pytest.raises(ValueError, match="complete"):
        MeshSurface.of_map(HeightMap([[0.0, 1.0], [np.nan, 2.0]], 1.0))


def test_labels_in_words_are_refused_in_a_line():
    with pytest.raises(TypeError, match="labels must be real numbers") as refused:
        MeshSurface(plate(cells=9), (10.0, 8.0), labels=["glass"] * 162)
    assert len(str(refused.value)) < 200
