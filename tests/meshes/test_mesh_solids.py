"""Solids of a mesh that light goes through: closed forms, energy, spectra and refusals."""

import math

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose

from pbrdf import Material, MeshSurface, Scene, load_scene, observe, simulate
from tests.contaminants.scenes import assert_within, clean_counters, whole
from tests.meshes.shapes import joined, pair, plate
from tests.slab_reference import slab
from tests.sphere_reference import orders_of_a_sphere

# Some of these bodies are smaller than the light, which warns
pytestmark = pytest.mark.filterwarnings("ignore::pbrdf.errors.AccuracyWarning")
RADIUS = 0.3


def ball(subdivisions=3, radius=RADIUS):
    return trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)


def layer(top, bottom, lx=10.0, ly=8.0):
    """Upper and lower side of a layer over a period, triangles of their own each."""
    points, faces = plate(lx, ly, cells=4)
    below, turned = plate(lx, ly, cells=5, seed=3)
    up, down = np.array([0.0, 0.0, top]), np.array([0.0, 0.0, bottom])
    return joined((points + up, faces), (below + down, turned[:, ::-1]))


def crossing_boxes():
    """A plate, and two boxes that cut into it and into each other; labels 0, 1, 2."""
    boxes = [plate()]
    for sides, angle, axis, place in (
        ((3.0, 2.0, 1.4), 0.6, [0.3, 1.0, 0.2], (5.0, 4.0, 0.2)),
        ((1.0, 6.0, 0.9), 0.9, [1.0, 0.4, 0.1], (5.3, 4.1, 0.7)),
    ):
        box = trimesh.creation.box(sides)
        box.apply_transform(trimesh.transformations.rotation_matrix(angle, axis))
        boxes.append(pair(box, place))
    labels = np.concatenate([np.full(len(f), k) for k, (_, f) in enumerate(boxes)])
    return joined(*boxes), (10.0, 8.0), labels


@pytest.mark.parametrize(("kappa", "depth"), [(0.0, 0.0), (0.03, 2.0)])
def test_sphere_by_order_and_its_facets_by_refinement(kappa, depth):
    # Of such a size that the diameter has this optical depth
    wavelength = 8 * math.pi * kappa * RADIUS / depth if kappa else 1.0
    upwards, _ = orders_of_a_sphere(1.45 + 1j * kappa, RADIUS, wavelength)
    off = []
    for subdivisions in (2, 4):
        mesh = MeshSurface(ball(subdivisions), transparent=True)
        scene = Scene(mesh, Material(1.45, kappa))
        options = {"wavelength": wavelength, "n_rays": 32_000, "n_theta": 9, "n_dphi": 6}
        result = simulate(scene, 0.0, **options)
        lit = math.pi * RADIUS**2 / np.prod(mesh.size)
        albedo = result.albedo.values[:, 0] / lit
        stderr = result.albedo_stderr.values[:, 0] / lit
        off.append(np.abs(albedo - upwards))
        clean_counters(result)
        # Facets hold a little light for ever; weak beams go on by chance
        sent = result.absorbed + result.transmitted + result.truncated + result.albedo.sum()
        assert sent.item() == pytest.approx(1.0, abs=3e-6 if kappa else 1e-12)
        assert result.truncated.item() < 1e-4
    assert (off[1] < 5.0 * stderr + 0.02 * upwards + 2e-5).all()
    # Facets err by the square of their size
    assert off[1][0] < off[0][0] / 5


@pytest.mark.parametrize("kappa", [0.0, 0.02])
@pytest.mark.parametrize("base", ["air", "metal"])
def test_slab_and_film_on_a_metal_in_all_elements(base, kappa):
    """Powers add up, incoherently; the lower side of the film lies below the metal's."""
    theta, index, metal = 0.7, 1.5 + 1j * kappa, 0.9 + 2.4j
    options = {"n_rays": 16_000, "phi_i": 0.4, "n_theta": 9, "n_dphi": 12}
    results = []
    for seed in range(6):
        if base == "air":
            scene = Scene(
                MeshSurface(layer(1.0, 0.0), (10.0, 8.0), transparent=True),
                Material(1.5, kappa),
            )
        else:
            sides = layer(1.0, -0.7)
            mesh = joined(plate(cells=2, seed=5), sides)
            labels = np.r_[np.zeros(8, int), np.ones(len(sides[1]), int)]
            surface = MeshSurface(mesh, (10.0, 8.0), labels, transparent=[1])
            assert surface.kind == "ground"
            scene = Scene(surface, [Material(0.9, 2.4), Material(1.5, kappa)])
        results.append(simulate(scene, theta, wavelength=0.7, seed=seed, **options))
    matrices = np.array([whole(one) for one in results])
    stderr = matrices.std(axis=0, ddof=1) / np.sqrt(len(matrices))
    expected = slab(theta, index, 1.0 if base == "air" else metal, 1.0, 0.7)
    assert_within(matrices.mean(axis=0), stderr, expected, limit=8.0, floor=2e-5)
    for one in results[:1]:
        clean_counters(one)
        sent = one.albedo.sum() + one.absorbed + one.transmitted + one.truncated
        assert sent.item() == pytest.approx(1.0, abs=1e-6)
        if base == "air" and kappa == 0.0:
            assert one.absorbed.item() == 0.0


def test_energy_is_kept_in_clear_solids_over_a_mirror():
    points, period, labels = crossing_boxes()
    mesh = MeshSurface(points, period, labels, transparent=[1, 2])
    scene = Scene(mesh, [Material.mirror(), Material(1.5), Material(1.8)])
    for theta in (0.6, 1.3):
        result = simulate(scene, theta, n_rays=32_000, phi_i=0.4, n_theta=9, n_dphi=12)
        assert abs(result.absorbed.item()) < 1e-12
        assert result.leaked.item() < 1e-6
        sent = result.albedo.sum() + result.truncated + result.leaked
        assert sent.item() == pytest.approx(1.0, abs=1e-9)
        assert result.albedo.sel(bounces="3+").item() > 0.1


def test_what_has_the_index_of_air_is_not_there():
    """Its facets are met, and change nothing."""
    points, period, labels = crossing_boxes()
    mesh = MeshSurface(points, period, labels, transparent=[1, 2])
    options = {"n_rays": 6400, "phi_i": 0.4, "n_theta": 9, "n_dphi": 12}
    air, base = Material(1.0), Material(1.6, 0.3, name="base")
    result = simulate(Scene(mesh, [base, air, air]), 0.6, wavelength=0.5, **options)
    bare = simulate(
        Scene(MeshSurface(plate(), period), base), 0.6, wavelength=0.5, **options
    )
    assert_allclose(result.brdf.values, bare.brdf.values, atol=1e-12)
    clean_counters(result)


def test_a_hollow_and_a_core_of_the_same_glass():
    """A hollow is air; what is filled with the same glass is as if it were whole."""
    inner = ball(2, 0.5 * RADIUS)
    inner.invert()
    hollow = joined(pair(ball()), pair(inner, (0.02, 0.01, 0.05)))
    filled = joined(hollow, pair(ball(2, 0.6 * RADIUS), (0.02, 0.01, 0.05)))
    glass = Material(1.5)
    options = {"n_rays": 32_000, "n_theta": 9, "n_dphi": 12}
    seen = [
        simulate(Scene(MeshSurface(one, transparent=True), glass), 0.3, **options)
        for one in (pair(ball()), hollow, filled)
    ]
    for one in seen:
        clean_counters(one)
    light, error = (
        np.array([one[name].values.ravel() for one in seen])
        for name in ("albedo", "albedo_stderr")
    )
    assert_within(light[2], np.hypot(error[2], error[0]), light[0])
    # A bubble reflects more
    assert light[1].sum() > 1.05 * light[0].sum()
    # The lowest label rules: a core of the index of air is a bubble, or not there
    core = joined(pair(ball()), pair(ball(2, 0.5 * RADIUS), (0.02, 0.01, 0.05)))
    for label, materials, same in (
        (0, [glass, Material(1.0)], 0), (1, [Material(1.0), glass], 1),
    ):  # fmt: skip
        labels = np.repeat([label, 1 - label], [1280, 320])
        mesh = MeshSurface(core, None, labels, transparent=True)
        one = simulate(Scene(mesh, materials), 0.3, seed=8, **options)
        both = np.hypot(error[same], one.albedo_stderr.values.ravel())
        assert_within(light[same], both, one.albedo.values.ravel())


def test_many_wavelengths_are_what_each_is_alone():
    mesh = MeshSurface(ball(2), transparent=True)
    glass = Material.from_table(wavelength=[0.4, 0.9], n=[1.6, 1.4], kappa=[0.02, 0.0])
    options = {"n_rays": 3200, "n_theta": 9, "n_dphi": 12}
    waves = np.array([0.45, 0.6, 0.85])
    together = simulate(Scene(mesh, glass), 0.4, wavelength=waves, **options)
    alone = simulate(Scene(mesh, glass), 0.4, wavelength=0.6, **options)
    assert_allclose(together.brdf.isel(wavelength=1), alone.brdf, atol=1e-12)
    assert (np.diff(together.absorbed.values[0]) < 0.0).all()


def test_opaque_results_do_not_know_of_the_word():
    boxes = crossing_boxes()
    materials = [Material(1.5), Material(1.4, 0.1), Material(1.6)]
    plain, none = MeshSurface(*boxes), MeshSurface(*boxes, transparent=[])
    assert plain.transparent == none.transparent == ()
    options = {"n_rays": 640, "n_theta": 4, "n_dphi": 6}
    assert_allclose(
        simulate(Scene(none, materials), 0.4, **options).brdf,
        simulate(Scene(plain, materials), 0.4, **options).brdf,
        rtol=0,
    )


def test_scene_files_keep_what_is_transparent(tmp_path):
    mesh = MeshSurface(*crossing_boxes(), transparent=[2])
    assert "light goes through" in repr(mesh)
    scene = Scene(mesh, ["pvc", Material(1.4), Material(1.5)])
    scene.to_toml(tmp_path / "scene.toml")
    assert "transparent" in (tmp_path / "scene.toml").read_text()
    back = load_scene(tmp_path / "scene.toml")
    assert back.surface.transparent == (2,)
    assert_allclose(back.surface.solids, mesh.solids)
    ball(1).export(tmp_path / "ball.stl")
    (tmp_path / "ball.toml").write_text(
        '[surface]\ntype = "mesh"\nfile = "ball.stl"\ntransparent = true\n'
        '[substrate]\nmaterial = "bk7"\n'
    )
    assert load_scene(tmp_path / "ball.toml").surface.transparent == (0,)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: MeshSurface(plate(), (10.0, 8.0), transparent=True), "lower side"),
        (lambda: MeshSurface(plate(), transparent=True), "must be closed"),
        (
            lambda: MeshSurface(layer(0.0, 1.0), (10.0, 8.0), transparent=True),
            "must face outwards",
        ),
        (
            lambda: MeshSurface(pair(ball(1)), None, np.arange(80) % 2, transparent=[1]),
            "of one label each, got 40 faces",
        ),
        (
            lambda: MeshSurface(
                joined(plate(), pair(trimesh.creation.box((2, 2, 2)), (5, 4, 1.0))),
                (10.0, 8.0), np.repeat([0, 1], [18, 12]), transparent=[1],
            ),
            "gap of air",
        ),
        (lambda: MeshSurface(ball(1), transparent=[1]), "labels of the mesh, got 1"),
        (lambda: MeshSurface(ball(1), transparent="yes"), "labels of the mesh, got 'yes'"),
        (lambda: MeshSurface(ball(1), transparent=1.5), "labels of the mesh, got 1.5"),
        (
            lambda: Scene(MeshSurface(ball(1), transparent=True), Material.mirror()),
            "light goes through for label 0",
        ),
        (
            lambda: simulate(
                Scene(MeshSurface(ball(1), transparent=True), Material(1.5, 0.1)), 0.2,
                n_rays=64,
            ),
            "wavelength must be given",
        ),
        (
            lambda: observe(
                Scene(MeshSurface(layer(1, 0), (10, 8), transparent=True), Material(1.5)),
                0.2, 0.3, 0.0,
            ),
            'estimator must be "count" where light goes through',
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_transparent_is_refused(make, message):
    with pytest.raises((TypeError, ValueError), match=message):
        make()
