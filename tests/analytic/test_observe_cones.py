"""Detector to source on surfaces whose readings are known: mirrors, plates, a sphere."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import HeightMap, Material, Scene, observe
from pbrdf.conventions import direction
from pbrdf.kernels.cones.lens import lens_direction, lens_flux
from pbrdf.kernels.optics.vectors import Vec
from tests.reference_optics import path_mueller, spherical

LOSSY = Material(1.9, 0.4)


def cap_points(axis, half, count, seed):
    """Directions spread evenly over a cap."""
    rng = np.random.default_rng(seed)
    across = np.linalg.svd(axis[None])[2][1:]
    cosine = 1 - rng.random(count) * (1 - np.cos(half))
    turn = 2 * np.pi * rng.random(count)
    ring = np.cos(turn)[:, None] * across[0] + np.sin(turn)[:, None] * across[1]
    return cosine[:, None] * axis + np.sqrt(1 - cosine**2)[:, None] * ring


# Apart, crossing, with the smaller centre outside and inside the other, one in the other
LENSES = [
    (0.3, 0.2, 0.2), (0.05, 0.04, 0.03), (0.05, 0.05, 0.02), (0.045, 0.05, 0.02),
    (0.01, 0.05, 0.02), (0.01, 0.02, 0.05), (0.0, 0.03, 0.04),
]  # fmt: skip


@pytest.mark.parametrize(("between", "half_1", "half_2"), LENSES)
def test_flux_and_directions_of_a_lens(between, half_1, half_2):
    axis, other = direction(0.7, 0.4), direction(0.7 + between, 0.4)
    normal = direction(0.3, 1.1)
    points = cap_points(axis, half_1, 400_000, 1)
    inside = points[points @ other >= np.cos(half_2)]
    solid = 2 * np.pi * (1 - np.cos(half_1)) / len(points)
    flux = lens_flux(
        axis @ other, normal @ axis, normal @ other,
        np.cos(half_1), np.sin(half_1), np.cos(half_2), np.sin(half_2),
    )  # fmt: skip
    share = len(inside) / len(points)
    noise = np.sqrt((1 - share) / max(len(inside), 1))
    assert_allclose(flux, solid * (inside @ normal).sum(), rtol=5 * noise + 1e-4)
    if flux == 0.0:
        assert between > half_1 + half_2
        return

    # The directions drawn: inside both caps, and with the mean of the cosine-weighted lens
    drawn = np.array(
        [
            lens_direction(Vec(*axis), Vec(*other), half_1, half_2, Vec(*normal), 7, name)
            for name in range(4000)
        ]
    )
    assert (drawn @ axis >= np.cos(half_1) - 1e-12).all()
    assert (drawn @ other >= np.cos(half_2) - 1e-12).all()
    expected = np.average(inside, axis=0, weights=inside @ normal)
    stderr = drawn.std(axis=0) / np.sqrt(len(drawn)) + 1e-12
    stderr = np.hypot(stderr, inside.std(axis=0) / np.sqrt(len(inside)))
    assert (np.abs(drawn.mean(axis=0) - expected) / stderr).max() < 5


@pytest.mark.parametrize("estimator", ["facets", "paths", "corners", "count"])
@pytest.mark.parametrize("start", ["detector", "source"])
@pytest.mark.parametrize(("half_i", "half_s"), [(0.02, 0.02), (0.05, 0.02), (0.02, 0.05)])
def test_a_flat_mirror_shows_the_larger_cone(estimator, start, half_i, half_s):
    theta = 0.6
    seen = observe(
        Scene(HeightMap.flat(), Material.mirror()), theta, theta, np.pi, n_rays=6400,
        source_half_angle=half_i, detector_half_angle=half_s, estimator=estimator,
        start=start,
    )  # fmt: skip
    half = max(half_i, half_s)
    expected = 1 / (np.pi * np.sin(half) ** 2 * np.cos(theta))
    tight = estimator != "count"
    launched = half_s if start == "detector" else half_i
    # Counting from the larger cone misses at times; each ray also has its own cosine.
    # Polarisers on two axes are crossed by about the square of the angle between
    noise = max(launched / min(half_i, half_s), 2 * launched) / np.sqrt(6400)
    assert_allclose(
        seen.brdf_total.values[0], expected * np.diag([1.0, 1, -1, -1]),
        rtol=1e-3 if tight else 5 * noise, atol=2 * expected * half**2,
    )  # fmt: skip
    assert seen.rays_leaked == seen.rays_truncated == 0


def test_a_mirror_beside_the_specular_direction_shows_the_lens():
    """Two equal small discs, their centres 1.2 radii apart: 0.2848 of the area."""
    half, theta = 0.01, 0.5
    seen = observe(
        Scene(HeightMap.flat(), Material.mirror()), theta, theta + 1.2 * half, np.pi,
        n_rays=320, source_half_angle=half, detector_half_angle=half,
    )  # fmt: skip
    lens = (2 * np.arccos(0.6) - 1.2 * np.sqrt(1 - 0.36)) / np.pi
    expected = lens / (np.pi * half**2 * np.cos(theta))
    assert_allclose(lens, 0.2848, atol=5e-5)
    assert_allclose(seen.brdf_total[0, 0, 0], expected, rtol=0.02)


@pytest.mark.parametrize("estimator", ["facets", "paths", "corners", "count"])
@pytest.mark.parametrize("start", ["detector", "source"])
@pytest.mark.parametrize("phi_i", [0.7, 4.0])
def test_plate_tilted_out_of_the_plane_has_all_elements(estimator, start, phi_i):
    """A plate of 10 degrees about an oblique axis: reciprocity puts each element right."""
    normal = direction(np.deg2rad(10.0), -0.9)
    x, y = np.arange(40)[:, None] * 0.7, np.arange(30)[None, :] * 1.3
    plate = HeightMap(
        -(normal[0] * x + normal[1] * y) / normal[2], (0.7, 1.3), periodic=False
    )
    theta_i = np.deg2rad(38.0)
    mueller, out = path_mueller(
        direction(theta_i, phi_i), [normal], LOSSY.n, LOSSY.kappa, phi_i=phi_i
    )
    theta_s, phi_s = spherical(out)
    half = 0.004
    seen = observe(
        Scene(plate, LOSSY), theta_i, theta_s, phi_s - phi_i, phi_i=phi_i,
        n_rays=1600, source_half_angle=half, detector_half_angle=half,
        estimator=estimator, start=start,
    ).brdf_total.values[0]  # fmt: skip
    assert_allclose(seen / seen[0, 0], mueller / mueller[0, 0], atol=2e-3)
    assert abs(mueller[2, 0]) > 0.02
    # Facets count by their horizontal area. Rays that enter above a tilted plate fall on
    # another area than they entered through, by some per cent here
    expected = (normal @ out) / normal[2] / (np.pi * half**2 * out[2] * np.cos(theta_i))
    by_area = estimator in ("facets", "paths")
    assert_allclose(seen[0, 0] / mueller[0, 0], expected, rtol=1e-4 if by_area else 0.08)


@pytest.mark.parametrize("estimator", ["facets", "corners"])
def test_a_mirror_sphere_dims_the_source_by_a_quarter_of_its_radius_squared(estimator):
    """The solid angle grows on a curved mirror: every direction gets R^2/4 a steradian."""
    radius, nodes, step = 60.0, 400, 0.25
    x = (np.arange(nodes) - (nodes - 1) / 2) * step
    square = x[:, None] ** 2 + x[None, :] ** 2
    rim = (0.62 * radius) ** 2
    heights = np.sqrt(radius**2 - np.minimum(square, rim))
    bump = HeightMap(heights, step, periodic=True)
    theta_i, theta_s, dphi = 0.3, np.array([0.5, 0.35, 0.62]), np.array([2.6, 0.8, 2.0])
    seen = observe(
        Scene(bump, Material.mirror()), theta_i, theta_s, dphi, n_rays=200_000,
        max_bounces=1, source_half_angle=0.05, detector_half_angle=0.05,
        estimator=estimator,
    )  # fmt: skip
    area = (nodes * step) ** 2
    expected = radius**2 / 4 / (area * np.cos(theta_i) * np.cos(theta_s))
    assert_allclose(seen.brdf_total[:, 0, 0], expected, rtol=0.02)
