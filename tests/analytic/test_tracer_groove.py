"""Check C12: a 90-degree groove sends vertical light back after two bounces at 45."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import HeightMap, Material, Scene, simulate
from tests.reference_optics import path_mueller

LEFT = np.array([1.0, 0.0, 1.0]) / np.sqrt(2)
RIGHT = np.array([-1.0, 0.0, 1.0]) / np.sqrt(2)


def groove(along="y", cells=6):
    """Ridges at every other node, slopes of exactly 1."""
    heights = np.tile([[0.0, 3.0], [0.0, 3.0]], (1, cells)) if along == "x" else np.tile(
        [[0.0, 0.0], [3.0, 3.0]], (cells, 1)
    )  # fmt: skip
    return HeightMap(heights, (3.0, 3.0), periodic=True)


def total(result):
    return (
        (result.brdf_total * result.projected_solid_angle)
        .sum(("theta_s", "dphi"))
        .values[0]
    )


@pytest.mark.parametrize("skips", [True, False])
def test_c12_normal_incidence(skips):
    scene = Scene(groove(), Material(1.5))
    result = simulate(scene, 0.0, n_rays=3200, n_theta=18, n_dphi=36, skips=skips)
    mueller = total(result)
    expected = np.diag([0.0042690700, 0.0042690700, 0.0007790274, 0.0007790274])
    expected[0, 1] = expected[1, 0] = 0.0041973890
    assert_allclose(mueller, expected, atol=6e-11)
    # Retro-reflection only, and dphi = 0 by convention
    lit = result.brdf_total.sel(stokes_out="I", stokes_in="I").values[0] > 0
    assert np.argwhere(lit).tolist() == [[0, 0]]
    assert_allclose(result.albedo.sel(bounces="2").item(), mueller[0, 0], rtol=1e-12)


@pytest.mark.parametrize("phi_i", [0.3, 2.0])
@pytest.mark.parametrize(("n", "kappa"), [(1.5, 0.0), (0.958, 6.69)])
def test_frames_turn_with_the_azimuth_of_the_source(n, kappa, phi_i):
    scene = Scene(groove(), Material(n, kappa))
    result = simulate(scene, 0.0, phi_i=phi_i, n_rays=3200, n_theta=18, n_dphi=36)
    expected, _ = path_mueller([0, 0, 1], [LEFT, RIGHT], n, kappa, phi_i=phi_i)
    assert_allclose(total(result), expected, atol=1e-12)


def test_groove_along_x_is_the_groove_along_y_turned():
    along_y = simulate(
        Scene(groove("y"), Material(1.5)), 0.2, phi_i=0.4, n_rays=3200, n_theta=9, n_dphi=12
    )
    along_x = simulate(
        Scene(groove("x"), Material(1.5)), 0.2, phi_i=0.4 + np.pi / 2,
        n_rays=3200, n_theta=9, n_dphi=12,
    )  # fmt: skip
    # Entry points differ, so the shares do by the lattice's rounding
    assert_allclose(along_x.albedo.values, along_y.albedo.values, atol=2e-4)


def test_two_bounces_out_of_plane_in_every_element():
    """Light along the groove's length: both orders of facets, weighted alike."""
    theta, phi_i = np.deg2rad(35.0), np.pi / 2
    dir_i = [0.0, np.sin(theta), np.cos(theta)]
    n, kappa = 0.958, 6.69
    result = simulate(
        Scene(groove(), Material(n, kappa)), theta, phi_i=phi_i,
        n_rays=32000, n_theta=18, n_dphi=36,
    )  # fmt: skip
    first, out = path_mueller(dir_i, [LEFT, RIGHT], n, kappa)
    second, same = path_mueller(dir_i, [RIGHT, LEFT], n, kappa)
    assert_allclose(out, same, atol=1e-12)
    # The two orders share the light evenly, but for the places of the rays
    lit = result.brdf_total.isel(stokes_out=0, stokes_in=0) > 0
    error = (result.brdf_total_stderr * result.projected_solid_angle).where(lit)
    error = error.sum(("theta_s", "dphi"))
    assert (
        np.abs(total(result) - 0.5 * (first + second)) < 5 * error.values[0] + 1e-12
    ).all()
    assert error.max() < 2e-3
    assert abs(0.5 * (first + second)[2, 3]) > 0.1
