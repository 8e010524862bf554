"""Paths over meshes: against every triangle tried in turn, and against the walk."""

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose

from pbrdf import GaussianSurface, Material, MeshSurface, Scene, simulate
from pbrdf.errors import AccuracyWarning
from pbrdf.kernels.meshes.seek import seek_facet
from pbrdf.kernels.meshes.shots import BELOW, WRONG
from pbrdf.kernels.terrain.heightfield import ESCAPED, HIT, LOST
from pbrdf.tracer.mesh_field import MeshField
from tests.meshes.shapes import (
    SlowMesh,
    bent_tube,
    corner_cube,
    joined,
    mushrooms,
    pair,
    plate,
)


def mirror(k, n):
    k = k - 2.0 * (k @ n) * n
    return k / np.linalg.norm(k)


def path(mesh, facets, place, k, most=40):
    """Faces of a path as the tracer finds them, its last direction and its fate."""
    face, delicate, faces = -1, 0, []
    for _ in range(most):
        fate, face, delicate, *place = seek_facet(facets, face, delicate, *place, *k)
        if fate != HIT:
            return faces, k, fate
        faces.append(face)
        k = mirror(k, mesh.normals[face])
    return faces, k, HIT


def beams(mesh, count, seed):
    """Places above a mesh and directions down to it."""
    rng = np.random.default_rng(seed)
    low, high = mesh.bounds
    phi, cos = rng.uniform(0, 2 * np.pi, count), rng.uniform(0.08, 1.0, count)
    sin = np.sqrt(1 - cos**2)
    k = -np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], axis=1)
    size = np.asarray(mesh.size)
    place = np.empty((count, 3))
    place[:, :2] = low[:2] + size * rng.random((count, 2))
    place[:, 2] = high[2]
    return place, k


# A ray this near an edge may go either way in float32, and all after it [um]
UNSURE = 2e-5


@pytest.mark.parametrize(
    "shape", [pytest.param("mushrooms", marks=pytest.mark.slow), "bodies", "tube", "rough"]
)
def test_paths_are_those_of_every_triangle_tried_in_turn(shape):
    if shape == "mushrooms":
        mesh = mushrooms()
    elif shape == "bodies":
        ring = trimesh.creation.torus(2.0, 0.6, major_sections=20, minor_sections=11)
        ring.apply_transform(trimesh.transformations.rotation_matrix(0.5, [1.0, 0.2, 0.0]))
        box = trimesh.creation.box((1.1, 0.9, 1.3))
        mesh = MeshSurface(joined(pair(ring), pair(box, (0.1, 0.2, 0.3))))
    elif shape == "tube":
        with pytest.warns(AccuracyWarning, match="cuts through itself"):
            mesh = MeshSurface(bent_tube(steps=30))
    else:
        rough = GaussianSurface(
            shape=(12, 10), spacing=0.7, corr_length=1.7, slope_rms=0.7
        ).sample(5)
        mesh = MeshSurface.of_map(rough)
    slow, field = SlowMesh(mesh), MeshField.of(mesh)
    facets = field.facets()
    compared, bounces = 0, 0
    for place, k in zip(*beams(mesh, 500, 11), strict=True):
        expected, leaves, margin = slow.path(place, k)
        if margin < UNSURE:
            continue
        found, out, fate = path(mesh, facets, place, k)
        assert fate in (ESCAPED, BELOW, HIT)
        assert found == expected
        assert_allclose(out, leaves, atol=1e-11)
        compared += 1
        bounces += len(found)
    assert compared > 300
    # Overhangs were met
    assert bounces > 1.2 * compared or mesh.kind == "bodies"


def test_a_rough_surface_as_mesh_and_as_map_takes_the_same_paths():
    rough = GaussianSurface(
        shape=(96, 80), spacing=0.5, corr_length=5.0, slope_rms=0.45
    ).sample(2)
    options = {"n_rays": 64_000, "phi_i": 0.7, "n_theta": 15, "n_dphi": 24}
    material = Material(1.4, 0.6)
    # The same rays over both, where a map has other means for single bounces
    options["variance_reduction"] = False
    walked = simulate(Scene(rough, material), [0.3, 1.25], **options)
    meshed = simulate(Scene(MeshSurface.of_map(rough), material), [0.3, 1.25], **options)
    assert meshed.attrs["rays_leaked"] == [0, 0]
    # A ray that float32 sends over the other side of an edge changes one bin by one ray
    one = 1.0 / walked.projected_solid_angle / options["n_rays"]
    apart = np.abs(meshed.brdf - walked.brdf).sel(stokes_out="I", stokes_in="I")
    strayed = (apart / one).sum(("bounces", "theta_s", "dphi"))
    assert (strayed.values < 1e-3 * options["n_rays"]).all()
    # All 16 elements within their combined errors
    combined = np.hypot(walked.brdf_total_stderr, meshed.brdf_total_stderr)
    assert (np.abs(meshed.brdf_total - walked.brdf_total) <= 5.0 * combined + 1e-12).all()
    assert_allclose(meshed.albedo, walked.albedo, atol=2e-4)


def test_labels_and_a_diffuse_base_as_on_the_map():
    rough = GaussianSurface(shape=(32, 32), spacing=0.5, corr_length=4, slope_rms=0.3)
    heights = rough.sample(3)
    numbers = np.random.default_rng(1).integers(0, 2, heights.cells)
    heights = type(heights)(heights.heights, heights.spacing, periodic=True, labels=numbers)
    materials = [Material(1.5, diffuse_albedo=0.6), Material(1.3)]
    options = {"n_rays": 32_000, "n_theta": 9, "n_dphi": 12}
    walked = simulate(Scene(heights, materials), 0.8, **options)
    meshed = simulate(Scene(MeshSurface.of_map(heights), materials), 0.8, **options)
    combined = np.hypot(walked.brdf_total_stderr, meshed.brdf_total_stderr)
    assert (np.abs(meshed.brdf_total - walked.brdf_total) <= 5.0 * combined + 1e-12).all()
    assert_allclose(meshed.albedo, walked.albedo, atol=3e-4)
    # The base matters here, and so does which facets have it
    assert walked.albedo.sum().item() > 0.2


@pytest.mark.parametrize("shape", ["plate", "sphere", "mushrooms"])
def test_rays_at_vertices_and_along_edges_are_caught(shape):
    if shape == "plate":
        mesh = MeshSurface(plate(cells=7), (10.0, 8.0))
    elif shape == "sphere":
        mesh = MeshSurface(trimesh.creation.icosphere(subdivisions=2, radius=3.0))
    else:
        mesh = mushrooms()
    field = MeshField.of(mesh)
    facets = field.facets()
    corners = np.asarray(mesh.vertices)[np.asarray(mesh.faces)]
    weights = np.array(
        [[1, 0, 0], [0.5, 0.5, 0], [0.25, 0.75, 0], [0, 0.5, 0.5], [1 / 3, 1 / 3, 1 / 3]]
    )
    # Seen from the front, and all around them, or a ray may pass by rightly
    around = np.full(len(mesh.vertices), np.inf)
    np.minimum.at(around, mesh.faces.ravel(), np.repeat(mesh.normals[:, 2], 3))
    front = around[mesh.faces].min(axis=1) > 0.45
    targets = np.einsum("wc,fcx->fwx", weights, corners[front])
    top = mesh.bounds[1, 2]
    for k in ([0.0, 0.0, -1.0], [0.2, -0.1, -0.9], [-0.3, 0.0, -1.0]):
        k = np.array(k) / np.linalg.norm(k)
        for target, normal in zip(targets[::3], mesh.normals[front][::3], strict=True):
            assert normal @ k < 0.0
            for point in target:
                start = point + k * (top + 0.01 - point[2]) / k[2]
                fate, face, delicate, *place = seek_facet(facets, -1, 0, *start, *k)
                assert fate == HIT, (fate, point)
                # And on from there, exactly at the edge
                out = mirror(k, mesh.normals[face])
                fate, *_ = seek_facet(facets, face, delicate, *place, *out)
                assert fate not in (LOST, WRONG), (fate, place)


def test_a_corner_cube_sends_every_ray_back_whence_it_came():
    mesh = MeshSurface(corner_cube())
    assert mesh.kind == "sheet"
    field = MeshField.of(mesh)
    facets = field.facets()
    rng = np.random.default_rng(8)
    low, high = mesh.bounds
    returned = 0
    for _ in range(400):
        k = -np.array([*rng.normal(0, 0.15, 2), 1.0])
        k /= np.linalg.norm(k)
        place = np.array([*rng.uniform(-0.3, 0.3, 2), high[2] - 1e-3])
        faces, out, fate = path(mesh, facets, place, k)
        assert fate == ESCAPED
        if sorted(faces) == [0, 1, 2]:
            assert_allclose(out, -k, atol=3e-15)
            returned += 1
    assert returned > 350
    # Straight into the corner, and down its edges, within rounding of two and three facets
    for aim in ([0.0, 0.0], [0.1, 0.0], [-0.05, 0.05 * np.sqrt(3)], [1e-13, -1e-13]):
        faces, out, fate = path(mesh, facets, [*aim, high[2]], np.array([0.0, 0.0, -1.0]))
        assert fate == ESCAPED
        assert len(faces) <= 3
    assert low[2] == 0.0


def test_a_thousand_bounces_keep_the_direction_a_unit_vector():
    """Light between the walls of a deep slot; hazard B20."""
    deep = 400.0
    x = np.array([0.0, 1.0, 1.0, 2.0, 2.0, 3.0])
    z = np.array([deep, deep, 0.0, 0.0, deep, deep])
    points = np.array([[a, b, c] for b in (0.0, 4.0) for a, c in zip(x, z, strict=True)])
    quads = [(i, i + 1, i + 7, i + 6) for i in range(5)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    mesh = MeshSurface((points, triangles), (3.0, 4.0))
    assert mesh.kind == "ground"
    field = MeshField.of(mesh)
    facets = field.facets()
    k = np.array([0.81, 0.1, -0.5])
    k /= np.linalg.norm(k)
    faces, out, fate = path(mesh, facets, [1.3, 2.0, deep - 0.1], k, most=3000)
    assert fate == ESCAPED
    assert len(faces) > 1000
    assert_allclose(np.abs(out), np.abs(k), atol=1e-12)


def test_rays_at_the_line_where_bodies_cut_into_each_other_stay_outside():
    """Two facets that cross, neither an edge of the mesh: float32 alone takes either."""
    box = trimesh.creation.box((3.0, 2.0, 1.4))
    box.apply_transform(trimesh.transformations.rotation_matrix(0.6, [0.3, 1.0, 0.2]))
    other = trimesh.creation.box((1.0, 6.0, 0.9))
    other.apply_transform(trimesh.transformations.rotation_matrix(0.9, [1.0, 0.4, 0.1]))
    mesh = MeshSurface(
        joined(plate(), pair(box, (5.0, 4.0, 0.2)), pair(other, (5.3, 4.1, 0.7))),
        (10.0, 8.0),
    )
    field = MeshField.of(mesh)
    facets = field.facets()
    corners = np.asarray(mesh.vertices)[np.asarray(mesh.faces)]
    # Where edges of facets would be if bodies were cut along each other
    lines = trimesh.intersections.mesh_plane(
        mesh.to_trimesh(), plane_normal=[0, 0, 1], plane_origin=[0, 0, 1e-12]
    ).reshape(-1, 2, 3)
    rng = np.random.default_rng(4)
    top = mesh.bounds[1, 2] + 0.5
    delicate = 0
    for _ in range(1500):
        a, b = lines[rng.integers(len(lines))]
        aim = a + rng.random() * (b - a)
        aim[:2] += 10.0 ** rng.uniform(-8, -3.5) * rng.normal(size=2)
        aim[2] = 0.0
        phi, cos = rng.uniform(0, 2 * np.pi), rng.uniform(0.05, 1.0)
        k = -np.array([*(np.sqrt(1 - cos**2) * np.array([np.cos(phi), np.sin(phi)])), cos])
        start = aim - k * top / cos
        face, near, place = -1, 0, start
        for _ in range(60):
            fate, face, near, *place = seek_facet(facets, face, near, *place, *k)
            if fate != HIT:
                break
            delicate += near
            assert mesh.normals[face] @ k < 0.0
            # Above the ground, and never below it inside a body, but for what float32 knows
            assert place[2] >= -4.0 * field.frame.lift
            k = mirror(k, mesh.normals[face])
        assert fate in (ESCAPED, HIT)
    assert delicate > 300
    assert len(corners) == 18 + 24
