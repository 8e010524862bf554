"""Physical optics of maps: a mirror, the mean over random maps, refusals."""

import numpy as np
import pytest

from pbrdf import GaussianSurface, HeightMap, Material, WaveModel
from pbrdf.wave import map_scattering

GIVEN = {"wavelength": 0.6, "phi_i": 0.4, "n_theta": 18, "n_dphi": 24}
SURFACE = GaussianSurface(shape=(192, 192), spacing=0.2, corr_length=1.6, height_rms=0.1)


def test_a_flat_map_is_a_mirror() -> None:
    flat = HeightMap(np.zeros((32, 32)), 0.2, periodic=True)
    found = map_scattering(flat, Material(1.5), 0.6, **GIVEN)
    smooth = WaveModel(Material(1.5), height_rms=1e-9, corr_length=1.0)
    assert np.allclose(found.coherent, smooth.coherent(0.6, 0.6), rtol=1e-9, atol=1e-12)
    assert np.nanmax(np.abs(found.brdf)) < 1e-20


@pytest.mark.parametrize("periodic", [True, False])
def test_random_maps_scatter_on_average_as_their_statistics(periodic) -> None:
    metal = Material(1.2, 6.9)
    runs = []
    for seed in range(10):
        sample = SURFACE.sample(seed)
        one = HeightMap(sample.heights, sample.spacing, periodic=periodic)
        runs.append(map_scattering(one, metal, 0.6, **GIVEN))
    found = np.array([run.brdf.values for run in runs])
    mean, error = found.mean(0), found.std(0, ddof=1) / np.sqrt(len(runs))
    model = WaveModel(metal, height_rms=0.1, corr_length=1.6, method="kirchhoff")
    x, w = np.polynomial.legendre.leggauss(4)
    theta_s = runs[0].theta_s.values[:, None] + x * np.pi / 4 / 18
    dphi = runs[0].dphi.values[:, None] + x * np.pi / 24
    weight = (np.cos(theta_s) * np.sin(theta_s) * w)[:, :, None, None] * w
    expected = model.brdf(0.6, theta_s[:, :, None, None], dphi, 0.6)
    expected = (expected * weight[..., None, None]).sum((1, 3))
    expected /= weight.sum((1, 3))[..., None, None]
    bright = expected[..., 0, 0] > 0.05 * expected[..., 0, 0].max()
    assert bright.sum() > 30
    total = mean[bright][:, 0, 0].sum() / expected[bright][:, 0, 0].sum()
    assert total == pytest.approx(1.0, abs=0.03)
    # All elements, against the scatter over the maps (Student, 9 degrees of freedom)
    scale = expected[bright][:, :1, :1]
    off = np.abs(mean - expected)[bright] / np.hypot(error[bright], 0.01 * scale)
    assert np.sqrt(np.mean(off[:, 0, 0] ** 2)) < 1.6
    assert off.max() < 6.0
    # Speckle within a bin says what maps differ by
    stated = np.sqrt(np.mean([run.brdf_stderr.values**2 for run in runs], axis=0))
    ratio = (stated / found.std(0, ddof=1))[bright][:, 0, 0]
    assert 0.7 < np.median(ratio) < 1.5


def test_coarse_maps_are_refused() -> None:
    with pytest.raises(ValueError, match="spacing must be below half the wavelength"):
        map_scattering(SURFACE.sample(1), Material(1.5), 0.6, wavelength=0.3)
