"""A gentle known surface, facet by facet: all elements of all bins."""

import numpy as np
import pytest

from pbrdf import HeightMap, Material, Scene, simulate
from tests.reference_optics import path_mueller, spherical

N_THETA, N_DPHI = 12, 8


def expected_flux(surface, dir_i, n, kappa, phi_i):
    """Flux (n_theta, n_dphi, 4, 4) of single reflections without shadow."""
    dx, dy = surface.spacing
    z = surface.heights
    flux = np.zeros((N_THETA, N_DPHI, 4, 4))
    nx, ny = z.shape
    for i in range(nx):
        for j in range(ny):
            z00, z10 = z[i, j], z[(i + 1) % nx, j]
            z01, z11 = z[i, (j + 1) % ny], z[(i + 1) % nx, (j + 1) % ny]
            for slope in ((z10 - z00, z11 - z10), (z11 - z01, z01 - z00)):
                down = np.array([-slope[0] / dx, -slope[1] / dy, 1.0])
                normal = down / np.linalg.norm(down)
                # Half a cell, as the source sees it over how it sees the flat cell
                share = 0.5 * (down @ dir_i) / dir_i[2] / (nx * ny)
                mueller, out = path_mueller(dir_i, [normal], n, kappa, phi_i=phi_i)
                theta_s, phi_s = spherical(out)
                place = (
                    int(theta_s / (np.pi / 2) * N_THETA),
                    int(np.floor((phi_s - phi_i) / (2 * np.pi) * N_DPHI + 0.5)) % N_DPHI,
                )
                flux[place] += share * mueller
    return flux


@pytest.mark.parametrize(
    ("theta_deg", "phi_i", "n", "kappa"),
    # Vertical light: bins about the zenith, where the meridian frame spins (hazard B7)
    [
        (0.0, 0.0, 1.5, 0.0),
        (0.0, 0.9, 0.958, 6.69),
        (3.0, 2.1, 1.5, 0.0),
        (25.0, -0.7, 0.958, 6.69),
    ],
)
def test_b07_every_element_of_every_bin(theta_deg, phi_i, n, kappa, measured):
    rng = np.random.default_rng(8)
    heights = 0.05 * rng.standard_normal((10, 9))
    surface = HeightMap(heights, (1.0, 0.8), periodic=True)
    theta = np.deg2rad(theta_deg)
    dir_i = np.array(
        [np.sin(theta) * np.cos(phi_i), np.sin(theta) * np.sin(phi_i), np.cos(theta)]
    )
    result = simulate(
        Scene(surface, Material(n, kappa)), theta, phi_i=phi_i, n_rays=640_000,
        n_theta=N_THETA, n_dphi=N_DPHI,
    )  # fmt: skip
    # Slopes are gentle: one bounce, as the reference assumes
    assert result.albedo.sel(bounces=["2", "3+"]).values.max() == 0
    weight = result.projected_solid_angle.values[..., None, None]
    flux = result.brdf_total.values[0] * weight
    stderr = result.brdf_total_stderr.values[0] * weight
    expected = expected_flux(surface, dir_i, n, kappa, phi_i)
    lit = expected[..., 0, 0] > 0
    assert (flux[..., 0, 0] > 0).tolist() == lit.tolist()
    # Noise of entry points on a facet edge; sub-1e-9 where a bin holds whole facets only
    error = np.abs(flux - expected) / (stderr + 1e-9)
    what = "elements of all bins, zenith included: largest deviation [standard errors]"
    measured("B7", what, error.max(), 6)
    # The rotation elements of the bins about the zenith are there to be compared
    assert np.abs(expected[0, :, 1:3, 0]).max() > 20 * stderr[0, :, 1:3, 0].max()
