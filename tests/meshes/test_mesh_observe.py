"""Meshes seen from the detector's end: as the map of the same facets, and as `simulate`."""

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose

from pbrdf import GaussianSurface, Material, MeshSurface, Scene, observe, simulate
from tests.meshes.shapes import mushrooms, plate

ROUGH = GaussianSurface(shape=(64, 48), spacing=0.8, corr_length=4.0, slope_rms=0.4)
SCAN = {
    "theta_i": np.array([0.5, 0.5, 0.9]),
    "theta_s": np.array([0.5, 0.2, 1.1]),
    "dphi": np.array([np.pi, 0.4, 2.6]),
    "phi_i": 0.3,
    "source_half_angle": 0.06,
    "detector_half_angle": 0.08,
}


@pytest.mark.parametrize("estimator", ["facets", "paths", "corners", "count"])
@pytest.mark.parametrize("albedo", [0.0, 0.5])
def test_a_mesh_of_a_map_reads_as_the_map(estimator, albedo):
    heights = ROUGH.sample(2)
    material = Material(1.5, diffuse_albedo=albedo) if albedo else Material(1.4, 0.8)
    options = {"n_rays": 6400, "estimator": estimator, "max_bounces": 12, **SCAN}
    walked = observe(Scene(heights, material), **options)
    meshed = observe(Scene(MeshSurface.of_map(heights), material), **options)
    combined = np.hypot(walked.brdf_total_stderr, meshed.brdf_total_stderr)
    apart = np.abs(meshed.brdf_total - walked.brdf_total)
    assert (apart <= 5.0 * combined + 1e-12).all()
    assert meshed.attrs["rays_leaked"] == 0
    assert walked.brdf_total[..., 0, 0].min() > 0.0
    if estimator == "facets" and not albedo:
        # The same points of facets, but in another order
        single = meshed.brdf.sel(bounces="1")[..., 0, 0]
        error = np.hypot(
            *(one.brdf_stderr.sel(bounces="1")[..., 0, 0] for one in (walked, meshed))
        )
        assert (
            np.abs(single - walked.brdf.sel(bounces="1")[..., 0, 0]) < 4 * error + 1e-12
        ).all()


def test_a_mirror_plate_shows_the_source():
    mesh = MeshSurface(plate(cells=4), (10.0, 8.0))
    seen = observe(
        Scene(mesh, Material.mirror()), 0.5, 0.5, np.pi, n_rays=320, source_half_angle=0.02
    )
    solid_angle = np.pi * np.sin(0.02) ** 2 * np.cos(0.5)
    assert seen.brdf_total[0, 0, 0].item() * solid_angle == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("start", ["detector", "source"])
def test_overhangs_read_as_bins_of_simulate(start):
    """Wide cones against bins of the hemisphere: ground white and grey among mushrooms."""
    scene = Scene(mushrooms(), Material(1.5, diffuse_albedo=0.7))
    whole = simulate(
        scene, 0.6, phi_i=0.2, n_rays=200_000, n_theta=18, n_dphi=36,
        source_half_angle=0.05, max_bounces=60,
    )  # fmt: skip
    theta_s, dphi = whole.theta_s.values[7], whole.dphi.values[9]
    seen = observe(
        scene, 0.6, theta_s, dphi, phi_i=0.2, source_half_angle=0.05,
        detector_half_angle=0.06, n_rays=60_000, start=start, max_bounces=60,
    )  # fmt: skip
    near = whole.brdf_total.isel(theta_i=0)[6:9, 8:11, 0, 0]
    error = np.hypot(
        seen.brdf_total_stderr[0, 0, 0].item(),
        whole.brdf_total_stderr.isel(theta_i=0)[6:9, 8:11, 0, 0].mean().item() / 2,
    )
    # The mean over nine bins is that of the cone up to its curvature
    difference = seen.brdf_total[0, 0, 0].item() - near.mean().item()
    assert abs(difference) < 4 * error + 0.01 * near.mean().item()


def test_light_below_bodies_is_told():
    ring = trimesh.creation.torus(1.0, 0.3, major_sections=16, minor_sections=8)
    mesh = MeshSurface(ring, (4.0, 4.0))
    seen = observe(
        Scene(mesh, Material.mirror()), 0.4, 0.4, np.pi, n_rays=6400, estimator="corners"
    )
    assert 0.3 < seen.transmitted.item() < 1.0
    assert_allclose(seen.leaked, 0.0)
    with pytest.raises(ValueError, match="bodies that stand alone"):
        observe(Scene(MeshSurface(ring), "gold"), 0.4, 0.4, np.pi, wavelength=0.6)
