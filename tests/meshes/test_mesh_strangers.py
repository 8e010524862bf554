"""Meshes as strangers have them: order of parts, far from the origin, nearly closed."""

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose, assert_array_equal

from pbrdf import Material, MeshSurface, Scene, load_scene, simulate
from pbrdf.errors import AccuracyWarning, DataFileError
from tests.meshes.shapes import SlowMesh, joined, mushrooms, pair, plate


def test_parts_of_a_scene_are_numbered_in_the_order_of_the_file(tmp_path):
    scene = trimesh.Scene()
    for number, name in enumerate(("ground", "bead", "a rod", "zinc")):
        box = trimesh.creation.box((1.0 + number, 1.0, 1.0))
        place = trimesh.transformations.translation_matrix([9.0 * number, 0.0, 0.0])
        scene.add_geometry(box, geom_name=name, node_name=name, transform=place)
    scene.export(tmp_path / "parts.glb")
    for source in (scene, tmp_path / "parts.glb"):
        mesh = MeshSurface(source, labels="parts")
        for number in range(4):
            corners = mesh.vertices[mesh.faces[mesh.labels == number]]
            assert_allclose(corners[..., 0].mean(), 9.0 * number, atol=0.6)
            assert_allclose(np.ptp(corners[..., 0]), 1.0 + number, atol=1e-5)


OBJ = """\
v 0 0 0
v 4 0 0
v 4 4 0
v 0 4 0
v 2 0 1
v 2 4 1
o roof
usemtl zinc
f 1 5 6
usemtl asphalt
f 5 2 3 6
usemtl zinc
f 1 6 4
o kiosk
v 4 0 0
v 8 0 0
v 8 4 0
v 4 4 0
usemtl asphalt
f 7 8 9 10
"""
PLY = """\
ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face {faces}
property list uchar int vertex_indices
property int label
end_header
0 0 0
4 0 0
4 4 0
0 4 0
"""


def test_objects_and_materials_of_an_obj_file_are_its_parts_in_their_order(tmp_path):
    (tmp_path / "roof.obj").write_text(OBJ)
    mesh = MeshSurface(tmp_path / "roof.obj", (8.0, 4.0), labels="parts")
    middle = mesh.vertices[mesh.faces].mean(axis=1)[:, 0]
    # Zinc on the left of the roof, asphalt on its right, then asphalt of the kiosk
    expected = np.where(middle < 2.0, 0, np.where(middle < 4.0, 1, 2))
    assert_array_equal(mesh.labels, expected)
    assert sorted(expected) == [0, 0, 1, 1, 2, 2]


def test_labels_of_faces_in_a_ply_file_are_its_parts(tmp_path):
    path = tmp_path / "plate.ply"
    path.write_text(PLY.format(faces=2) + "3 0 1 2 1\n3 0 2 3 0\n")
    assert_array_equal(MeshSurface(path, (4.0, 4.0), labels="parts").labels, [1, 0])
    assert MeshSurface(path, (4.0, 4.0)).labels is None
    path.write_text(PLY.format(faces=1) + "4 0 1 2 3 1\n")
    assert MeshSurface(path, (4.0, 4.0)).labels is None
    with pytest.raises(DataFileError, match=r"a file that numbers polygons\. Cut them"):
        MeshSurface(path, (4.0, 4.0), labels="parts")


def test_a_scene_file_says_how_several_materials_are_written(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text("[surface]\n[[substrate]]\nn = 1.5\n[[substrate]]\nn = 1.3\n")
    with pytest.raises(DataFileError, match=r"is a list of tables. .*materials = \[\{n"):
        load_scene(path)


def test_a_file_far_from_its_origin_is_warned_of(tmp_path):
    far = trimesh.creation.icosphere(subdivisions=3, radius=5.0)
    far.apply_translation([1e6, -2e6, 3e5])
    # In float64 nothing is lost
    assert MeshSurface(far).repairs == ()
    far.export(tmp_path / "far.stl")
    with pytest.warns(AccuracyWarning, match=r"numbers of a file are 0\.12 apart: 17 %"):
        MeshSurface(tmp_path / "far.stl")


def test_corners_that_meet_but_for_rounding_are_one():
    """Every face with corners of its own, each off by less than a billionth."""
    ball = trimesh.creation.icosphere(subdivisions=2, radius=5.0)
    corners = np.asarray(ball.vertices)[ball.faces].reshape(-1, 3)
    corners = corners + np.random.default_rng(0).uniform(-1e-9, 1e-9, corners.shape)
    mesh = MeshSurface((corners, np.arange(len(corners)).reshape(-1, 3)))
    assert (mesh.kind, mesh.parts, len(mesh.vertices)) == ("bodies", 1, len(ball.vertices))


def test_a_period_that_is_not_that_of_the_mesh_says_how_wide_the_mesh_is(tmp_path):
    with pytest.raises(ValueError, match=r"is 10 x 8 um wide.* over the period \(10.5, 8"):
        MeshSurface(plate(), (10.5, 8.0))
    trimesh.Trimesh(*plate()).export(tmp_path / "plate.ply")
    with pytest.raises(DataFileError, match=r"plate.ply.*is 10 x 8 um wide"):
        MeshSurface(tmp_path / "plate.ply", (10.5, 8.0))


def fresnel(cos_in, index):
    """Mueller matrix of a facet in its own frame, from the text of the conventions."""
    cos_out = np.sqrt(1.0 - (1.0 - cos_in**2) / index**2 + 0j)
    r_s = (cos_in - index * cos_out) / (cos_in + index * cos_out)
    r_p = (index * cos_in - cos_out) / (index * cos_in + cos_out)
    a, b = (abs(r_s) ** 2 + abs(r_p) ** 2) / 2, (abs(r_s) ** 2 - abs(r_p) ** 2) / 2
    both = r_s * np.conj(r_p)
    c, d = both.real, both.imag
    return np.array([[a, b, 0, 0], [b, a, 0, 0], [0, 0, c, -d], [0, 0, d, c]])


def turn(k, old, new):
    """Rotation of the frame of a beam along k from one s axis to another."""
    cos, sin = new @ old, new @ np.cross(k, old)
    c2, s2 = (np.array([cos**2 - sin**2, 2 * cos * sin])) / (cos**2 + sin**2)
    return np.array([[1, 0, 0, 0], [0, c2, s2, 0], [0, -s2, c2, 0], [0, 0, 0, 1.0]])


def by_bounces(tilt, width, arrives, index, starts):
    """Light that a row of V-grooves along y sends out, by bounces: ray by ray."""
    up = np.array([0.0, 0.0, 1.0])
    depth = 0.5 * width * np.tan(tilt)
    normals = [np.array([side * np.sin(tilt), 0.0, np.cos(tilt)]) for side in (1, -1)]
    light = np.zeros((3, 4, 4))
    for x in starts:
        k, place, last, bounces = -arrives, np.array([x, 0.0, depth]), None, 0
        s, mueller = np.cross(up, k), np.eye(4)
        while True:
            hits = []
            for groove in range(-9, 10):
                for side, n in enumerate(normals):
                    if (side, groove) == last or k @ n >= 0.0:
                        continue
                    # Both ridges lie at z = depth
                    ridge = np.array([(groove + side) * width, 0.0, depth])
                    time = (ridge - place) @ n / (k @ n)
                    across = (place + time * k)[0] / width - groove
                    if time > -1e-12 and 0.5 * side <= across < 0.5 * (1 + side):
                        hits.append((time, side, groove))
            if not hits:
                break
            time, *last = min(hits)
            last, n = tuple(last), normals[last[0]]
            axis = np.cross(k, n)
            mueller = fresnel(-k @ n, index) @ turn(k, s, axis) @ mueller
            place, k, s = place + time * k, k - 2.0 * (k @ n) * n, axis
            bounces += 1
        light[min(bounces, 3) - 1] += turn(k, s, np.cross(up, k)) @ mueller
    return light / len(starts)


@pytest.mark.parametrize(
    ("tilt", "theta", "phi"), [(35.0, 52.0, 63.0), (55.0, 17.0, 115.0), (20.0, 29.0, 17.0)]
)
def test_grooves_lit_from_aside_send_out_all_16_elements_by_bounces(tilt, theta, phi):
    tilt, theta, phi = np.deg2rad([tilt, theta, phi])
    width, length = 4.0, 10.0
    depth = 0.5 * width * np.tan(tilt)
    points = [
        [x, y, z]
        for y in (0.0, length)
        for x, z in ((0.0, depth), (width / 2, 0.0), (width, depth))
    ]
    faces = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]]
    mesh = MeshSurface((np.array(points), np.array(faces)), (width, length))
    material = Material(1.5, 0.3)
    seen = simulate(
        Scene(mesh, material), theta, phi_i=phi, n_rays=50_000, n_theta=90, n_dphi=180
    )
    arrives = np.array(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    )
    starts = (np.arange(500) + 0.5) / 500 * width
    expected = by_bounces(tilt, width, arrives, 1.5 + 0.3j, starts)
    weights = seen.projected_solid_angle
    found = (seen.brdf.isel(theta_i=0) * weights).sum(("theta_s", "dphi"))
    # Entry points spread evenly on both sides: the edges of a few are all that differs
    assert_allclose(found, expected, atol=1.5e-3 * np.abs(expected).max())
    assert np.abs(expected[:2]).sum() > 0.01


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["block", "mushrooms"])
def test_overhangs_lit_from_aside_send_out_all_16_elements_by_bounces(shape):
    """Against every triangle tried in turn, and matrices from the text of conventions."""
    if shape == "block":
        block = trimesh.creation.box((3.0, 2.0, 1.5))
        turned = trimesh.transformations.rotation_matrix(0.9, [0.5, 0.3, 1.0])
        block.apply_transform(turned)
        mesh = MeshSurface(joined(plate(), pair(block, (4.0, 3.0, 0.6))), (10.0, 8.0))
    else:
        mesh = mushrooms()
    theta, phi = 0.8, 0.7
    seen = simulate(
        Scene(mesh, Material(1.5, 0.3)), theta, phi_i=phi, n_rays=200_000, n_theta=45,
        n_dphi=90,
    )  # fmt: skip
    up = np.array([0.0, 0.0, 1.0])
    arrives = np.array(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    )
    slow, count = SlowMesh(mesh), 600
    light = np.zeros((count, 3, 4, 4))
    for ray in range(count):
        # Points that fill the period evenly (Roberts 2018)
        share = np.array([(ray + 0.5) / count, ray * 0.7548776662466927 % 1.0])
        place = np.append(
            mesh.bounds[0, :2] + share * mesh.period, mesh.bounds[1, 2] + 1e-6
        )
        k, s, mueller = -arrives, np.cross(up, -arrives), np.eye(4)
        faces, *_ = slow.path(place, k)
        for n in mesh.normals[faces]:
            axis = np.cross(k, n)
            mueller = fresnel(-k @ n, 1.5 + 0.3j) @ turn(k, s, axis) @ mueller
            k, s = k - 2.0 * (k @ n) * n, axis
        light[ray, min(len(faces), 3) - 1] = turn(k, s, np.cross(up, k)) @ mueller
    error = light.std(axis=0) / np.sqrt(count)
    weights = seen.projected_solid_angle
    found = (seen.brdf.isel(theta_i=0) * weights).sum(("theta_s", "dphi"))
    # One and two bounces; of three a few rays only are here
    apart = np.abs(found - light.mean(axis=0))[:2]
    assert (apart < 4.0 * error[:2] + 1e-5).all()
    assert (np.abs(light.mean(axis=0))[0] > 8.0 * error[0]).sum() >= 8


def test_a_size_that_no_surface_has_raises_doubt_about_the_unit(tmp_path):
    path = tmp_path / "ball.stl"
    trimesh.creation.icosphere(subdivisions=1, radius=0.02).export(path)
    with pytest.warns(AccuracyWarning, match=r"0\.04 um long, less than a wave.*--unit"):
        MeshSurface(path)
    assert MeshSurface(path, unit="mm").repairs == ()
    assert MeshSurface(path, unit="um").size[0] == pytest.approx(0.04, rel=1e-6)
    big = trimesh.creation.box((2e6, 1e6, 1.0))
    with pytest.warns(AccuracyWarning, match="more than a metre"):
        MeshSurface(big)
    big.units = "nanometers"
    assert MeshSurface(big).size[0] == pytest.approx(2e3)
