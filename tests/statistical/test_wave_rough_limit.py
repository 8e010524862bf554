"""Rough surfaces: waves against single bounces of traced rays."""

import numpy as np
import pytest

from pbrdf import GaussianSurface, Material, Scene, WaveModel, simulate

N_THETA, N_DPHI = 30, 36


@pytest.mark.slow
@pytest.mark.parametrize(("slope", "length"), [(0.1, 30.0), (0.25, 12.0)])
@pytest.mark.parametrize("theta_i", [0.0, 0.7, 1.05])
def test_rough_surfaces_scatter_as_single_bounces(slope, length, theta_i) -> None:
    surface = GaussianSurface(
        shape=(256, 256), spacing=length / 16, corr_length=length, slope_rms=slope
    )
    run = simulate(
        Scene(surface, Material(1.5)), theta_i, phi_i="uniform", n_rays=60000,
        realizations=32, seed=5, max_bounces=1, n_theta=N_THETA, n_dphi=N_DPHI,
        # Rays alone: the integral over single bounces has the rule of hiding of the waves
        variance_reduction=False,
    )  # fmt: skip
    once = run.brdf.sel(bounces="1").isel(theta_i=0).values
    error = run.brdf_stderr.sel(bounces="1").isel(theta_i=0).values
    model = WaveModel(
        Material(1.5), height_rms=slope * length / np.sqrt(2), corr_length=length
    )
    x, w = np.polynomial.legendre.leggauss(4)
    theta_s = run.theta_s.values[:, None] + x * np.pi / 4 / N_THETA
    dphi = run.dphi.values[:, None] + x * np.pi / N_DPHI
    weight = (np.cos(theta_s) * np.sin(theta_s) * w)[:, :, None, None] * w
    found = model.brdf(theta_i, theta_s[:, :, None, None], dphi, 1.0)
    found = (found * weight[..., None, None]).sum((1, 3))
    found /= weight.sum((1, 3))[..., None, None]
    bright = (run.theta_s.values[:, None] <= np.deg2rad(70)) & (
        once[..., 0, 0] > 0.05 * once[..., 0, 0].max()
    )
    off = np.abs(found - once)[bright]
    limit = 0.02 * once[bright][:, :1, :1] + 4.0 * error[bright]
    # 4 standard errors, of up to 800 bins and 32 surfaces
    assert (off < limit).all()
    light = found[bright][:, 0, 0].sum() / once[bright][:, 0, 0].sum()
    assert light == pytest.approx(1.0, abs=0.015)
