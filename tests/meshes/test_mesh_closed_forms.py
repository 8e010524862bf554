"""Meshes of simple bodies against what their smooth shapes reflect."""

from itertools import pairwise

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose

from pbrdf import HeightMap, Material, MeshSurface, Scene, simulate
from tests.meshes.shapes import groove, joined, mushrooms, pair, plate
from tests.reference_optics import fresnel, path_mueller

LEFT = np.array([1.0, 0.0, 1.0]) / np.sqrt(2)
RIGHT = np.array([-1.0, 0.0, 1.0]) / np.sqrt(2)


def total(result):
    """Integral of the matrices over the hemisphere."""
    weighted = result.brdf_total * result.projected_solid_angle
    return weighted.sum(("theta_s", "dphi")).values


def elements(beta, n, kappa):
    """A and B of a mirror at these angles of incidence."""
    pairs = [fresnel(np.cos(b), n, kappa) for b in np.atleast_1d(beta)]
    r_s, r_p = (np.abs(np.array(one)) ** 2 for one in zip(*pairs, strict=True))
    return 0.5 * (r_s + r_p), 0.5 * (r_s - r_p)


def test_a_flat_plate_is_a_mirror_however_it_is_cut():
    theta, phi = 1.1, 0.4
    mesh = MeshSurface(plate(cells=9), (10.0, 8.0))
    result = simulate(Scene(mesh, Material(1.3, 2.1)), theta, phi_i=phi, n_rays=3200)
    dir_i = [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    expected, _ = path_mueller(dir_i, [np.array([0.0, 0.0, 1.0])], 1.3, 2.1)
    assert_allclose(total(result)[0], expected, atol=1e-12)
    assert result.attrs["rays_leaked"] == [0]


@pytest.mark.parametrize("period", [(3.0, 4.0), (3.0, 1.3)])
def test_a_groove_sends_vertical_light_back_in_two_bounces(period):
    mesh = MeshSurface(groove(3.0, period[1]), period)
    result = simulate(
        Scene(mesh, Material(0.958, 6.69)), 0.0, phi_i=0.7, n_rays=6400, n_theta=9
    )
    expected, _ = path_mueller([0, 0, 1], [LEFT, RIGHT], 0.958, 6.69, phi_i=0.7)
    assert_allclose(total(result)[0], expected, atol=1e-12)
    assert result.albedo.sel(bounces="2").item() == pytest.approx(expected[0, 0], abs=1e-12)


def sphere(subdivisions, radius=1.5):
    ball = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return MeshSurface(ball)


def shadow(mesh, theta):
    """Area of the entry points times the cosine: the light that is sent, per irradiance."""
    low, high = mesh.bounds
    length_x, length_y, height = high - low
    return (length_x + height * np.tan(theta)) * length_y * np.cos(theta)


def test_the_shadow_of_a_sphere_converges_as_the_square_of_its_facets():
    theta, radius = 0.5, 1.5
    errors = []
    for subdivisions in (1, 2, 3):
        mesh = sphere(subdivisions, radius)
        scene = Scene(mesh, Material.black())
        result = simulate(scene, theta, n_rays=100_000, phi_i=0.0, n_theta=4, n_dphi=4)
        errors.append(
            1.0 - result.absorbed.item() * shadow(mesh, theta) / (np.pi * radius**2)
        )
        sent = result.absorbed.item() + result.transmitted.item()
        assert sent == pytest.approx(1.0, abs=1e-12)
    # Four times as many facets, a quarter of the error
    assert 0.0 < errors[2] < 0.01
    assert_allclose(errors[0] / errors[1], 4.0, atol=0.7)
    assert_allclose(errors[1] / errors[2], 4.0, atol=0.7)


def test_a_mirror_sphere_sends_half_of_its_light_up_and_loses_none():
    theta, radius = 0.5, 1.5
    mesh = sphere(5, radius)
    result = simulate(Scene(mesh, Material.mirror()), theta, n_rays=100_000)
    share = result.albedo.sum("bounces").item() * shadow(mesh, theta)
    assert share == pytest.approx(np.pi * radius**2 / 2, rel=5e-3)
    assert result.absorbed.item() == 0.0
    assert result.leaked.item() == 0.0
    sent = result.albedo.sum().item() + result.transmitted.item()
    assert sent == pytest.approx(1.0, abs=1e-12)


def test_a_dielectric_sphere_under_vertical_light_polarises_as_its_facets_tilt():
    """Intensity R²/4 F(theta_s / 2), whatever the azimuth; A and B of F by bins."""
    radius, n, kappa = 1.5, 1.5, 0.4
    mesh = sphere(6, radius)
    result = simulate(Scene(mesh, Material(n, kappa)), 0.0, n_rays=200_000, n_theta=9)
    edges = np.linspace(0.0, np.pi / 2, 10)
    sent = shadow(mesh, 0.0)
    for k, (low, high) in enumerate(pairwise(edges)):
        middle = low + (high - low) * (np.arange(64) + 0.5) / 64
        a, b = elements(middle / 2, n, kappa)
        ring = 2 * np.pi * np.sin(middle) * (high - low) / 64 * radius**2 / 4 / sent
        for (row, column), expected in (
            ((0, 0), (ring * a).sum()),
            ((1, 0), (ring * b).sum()),
        ):
            found = (
                result.brdf_total[0, k, :, row, column] * result.projected_solid_angle[k]
            )
            error = result.brdf_total_stderr[0, k, :, row, column]
            error = np.sqrt(((error * result.projected_solid_angle[k]) ** 2).sum())
            # Beyond the noise, facets send the light of a degree into the next bin
            assert abs(found.sum().item() - expected) < 5 * error.item() + 0.01 * expected
    # Depolarisation and the other elements vanish by symmetry
    assert abs(total(result)[0, 2, 0]) < 1e-3 * total(result)[0, 0, 0]


def test_a_cylinder_scatters_as_the_cosine_of_half_the_angle():
    radius, length, theta = 0.8, 6.0, 0.0
    rod = trimesh.creation.cylinder(radius=radius, height=length, sections=720)
    rod.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1.0, 0.0, 0.0]))
    mesh = MeshSurface(rod)
    result = simulate(Scene(mesh, Material.mirror()), theta, n_rays=100_000, n_theta=18)
    weighted = (result.brdf_total * result.projected_solid_angle)[0, :, :, 0, 0]
    # Light that meets the rod at x = R sin(beta) leaves at 2 beta in the plane across it
    edges = np.linspace(0.0, np.pi / 2, 19)
    expected = np.diff(np.sin(edges / 2)) * 2 * radius * length / shadow(mesh, theta)
    across = np.isclose(np.cos(result.dphi.values) ** 2, 1.0)
    assert_allclose(weighted.sum("dphi"), expected, rtol=0.02)
    assert weighted[:, ~across].sum().item() == 0.0
    assert_allclose(weighted.sum().item(), np.sqrt(0.5), rtol=1e-3)


def test_a_boss_on_a_mirror_plate_is_the_sphere_with_its_image():
    """Vertical light on a hemisphere: what it sends down, the plate sends up again."""
    radius, side = 1.0, 20.0
    ball = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    # The lower half lies in the solid
    mesh = MeshSurface(
        joined(plate(side, side, cells=4), pair(ball, (13.0, 7.0, 0.0))), (side, side)
    )
    result = simulate(
        Scene(mesh, Material.mirror()), 0.0, n_rays=400_000, n_theta=9, max_bounces=8
    )
    assert result.leaked.item() == 0.0
    disc = np.pi * radius**2 / side**2
    # Facets steeper than 45 degrees send light down to the plate: half of the disc
    assert result.albedo.sel(bounces="1").item() == pytest.approx(
        1 - disc / 2, abs=0.03 * disc
    )
    assert result.albedo.sel(bounces="2").item() == pytest.approx(disc / 2, rel=0.06)
    # Evenly over the hemisphere, as the sphere and its image share the directions; near
    # the horizon the next boss is in the way
    weighted = (result.brdf_total * result.projected_solid_angle)[0, 1:7, :, 0, 0]
    errors = (result.brdf_total_stderr * result.projected_solid_angle)[0, 1:7, :, 0, 0]
    edges = np.linspace(0.0, np.pi / 2, 10)[1:8]
    rings = disc * -np.diff(np.cos(edges))
    noise = np.sqrt((errors**2).sum("dphi"))
    assert (np.abs(weighted.sum("dphi") - rings) < 4 * noise + 0.02 * rings).all()
    assert (noise < 0.1 * rings).all()


@pytest.mark.parametrize("theta", [0.2, 1.3])
def test_mirror_energy_is_kept_among_overhangs(theta):
    result = simulate(
        Scene(mushrooms(), Material.mirror()), theta, n_rays=64_000, phi_i=0.3,
        max_bounces=200,
    )  # fmt: skip
    assert abs(result.absorbed.item()) < 1e-12
    assert result.attrs["rays_leaked"] == [0]
    assert result.attrs["medium_mismatches"] == 0
    sent = result.albedo.sum().item() + result.truncated.item()
    assert sent == pytest.approx(1.0, abs=1e-12)
    # Overhangs hold light for many bounces
    assert result.albedo.sel(bounces="3+").item() > 0.05


def test_a_furnace_over_a_white_base_is_closed():
    """Light held among overhangs is followed by chance, and none of it is lost."""
    white = Material(1.0, diffuse_albedo=1.0)
    result = simulate(Scene(mushrooms(), white), 0.6, n_rays=32_000, max_bounces=300)
    albedo = (result.brdf_total * result.projected_solid_angle).sum(("theta_s", "dphi"))
    error = np.hypot.reduce(result.albedo_stderr.values.ravel())
    assert albedo[0, 0, 0].item() == pytest.approx(1.0, abs=4 * error)
    assert error < 5e-3
    assert abs(result.truncated.item()) < 1e-6
    assert abs(result.absorbed.item()) < 4 * error


def test_light_of_one_and_two_bounces_carries_the_albedo_once_and_twice():
    options = {"n_rays": 16_000, "max_bounces": 300, "n_theta": 9, "n_dphi": 12}
    grey, white = (
        simulate(Scene(mushrooms(), Material(1.0, diffuse_albedo=a)), 0.6, **options)
        for a in (0.5, 1.0)
    )
    for bounces, power in (("1", 1), ("2", 2)):
        ratio = (
            grey.albedo.sel(bounces=bounces) / white.albedo.sel(bounces=bounces)
        ).item()
        assert ratio == pytest.approx(0.5**power, rel=1e-12)


def test_light_through_a_porous_sheet_is_transmitted():
    """A square sheet with a square hole, thick: vertical light passes or comes back."""
    outer, inner, thick = 4.0, 1.0, 0.5
    points, faces = [], []
    for z in (thick, 0.0):
        for half in (outer / 2, inner / 2):
            points += [
                (-half, -half, z),
                (half, -half, z),
                (half, half, z),
                (-half, half, z),
            ]
    quads = []
    for a in range(4):
        b = (a + 1) % 4
        # Above, below, and the walls of the hole
        quads += [
            (a, b, 4 + b, 4 + a),
            (8 + b, 8 + a, 12 + a, 12 + b),
            (4 + a, 4 + b, 12 + b, 12 + a),
        ]
    for a, b, c, d in quads:
        faces += [(a, b, c), (a, c, d)]
    mesh = MeshSurface((np.array(points), faces), (outer, outer))
    assert mesh.kind == "bodies"
    result = simulate(Scene(mesh, Material.mirror()), 0.0, n_rays=32_000)
    assert result.transmitted.item() == pytest.approx((inner / outer) ** 2, rel=0.01)
    assert result.albedo.sum().item() + result.transmitted.item() == pytest.approx(1.0)


@pytest.mark.filterwarnings(
    "ignore:The tangent plane errs",
    "ignore:.*such roughness diffracts",
    "ignore:.*of the surface is flat",
)
def test_many_wavelengths_take_one_trace():
    waves = np.linspace(0.4, 0.9, 12)
    glass = Material.from_table(wavelength=[0.4, 0.9], n=[1.6, 1.4], kappa=[0.2, 0.0])
    scene = Scene(mushrooms(), glass)
    together = simulate(scene, 0.7, n_rays=6400, wavelength=waves)
    alone = simulate(scene, 0.7, n_rays=6400, wavelength=waves[5])
    assert any("tangent plane" in note for note in alone.attrs["warnings"])
    assert_allclose(
        together.brdf_total.isel(wavelength=5), alone.brdf_total, rtol=2e-5, atol=1e-9
    )
    assert np.unique(together.albedo.sum("bounces")).size == 12


def test_a_flat_map_and_its_mesh_are_the_same():
    flat = HeightMap.flat((3.0, 2.0))
    options = {"n_rays": 3200, "n_theta": 6, "n_dphi": 8}
    walked = simulate(Scene(flat, "gold"), 0.4, wavelength=0.6, **options)
    meshed = simulate(
        Scene(MeshSurface.of_map(flat), "gold"), 0.4, wavelength=0.6, **options
    )
    assert_allclose(meshed.brdf, walked.brdf, atol=1e-15)
