"""A class of bounces that no path reached has the error of one path, never 0."""

import numpy as np
import pytest

from pbrdf import GaussianSurface, Material, Scene, simulate

SLOPES = GaussianSurface(shape=(128, 128), spacing=1.0, corr_length=15.0, slope_rms=0.15)


@pytest.mark.filterwarnings("ignore::pbrdf.errors.AccuracyWarning")
def test_double_bounces_too_rare_to_be_seen():
    theta, rays, drawn = np.deg2rad(10.0), 2000, 16
    scene = Scene(SLOPES, Material(1.5))
    result = simulate(scene, theta, n_rays=rays, realizations=drawn, seed=1)
    albedo, stderr = result.albedo.values[:, 0], result.albedo_stderr.values[:, 0]
    assert albedo[1] == 0.0
    # One path of as much light as a single bounce has, of all rays
    assert np.isclose(stderr[1], albedo[0] / (rays * drawn), rtol=1e-9)
    # What is expected from many more rays lies within
    assert 2 * stderr[1] > 1.8e-7
    error = result.brdf_stderr.isel(theta_i=0, stokes_out=0, stokes_in=0)
    share = error.sel(bounces="2") * result.projected_solid_angle
    assert np.allclose(share.where(share > 0).min(), stderr[1], rtol=0.05)
