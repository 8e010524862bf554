"""Physical optics of maps: a mirror, the mean over random maps, refusals."""

import numpy as np
import pytest

from pbrdf import AccuracyWarning, GaussianSurface, HeightMap, Material, WaveModel
from pbrdf.wave import map_scattering
from tests import wave_by_the_book as by_the_book

# These maps are coarse on purpose: bins behind the source are left out
pytestmark = pytest.mark.filterwarnings("ignore:steps of .* leave directions behind")

GIVEN = {"wavelength": 0.6, "phi_i": 0.4, "n_theta": 18, "n_dphi": 24}
SURFACE = GaussianSurface(shape=(192, 192), spacing=0.2, corr_length=1.6, height_rms=0.1)


def test_a_flat_map_is_a_mirror() -> None:
    flat = HeightMap(np.zeros((32, 32)), 0.2, periodic=True)
    found = map_scattering(flat, Material(1.5), 0.6, **GIVEN)
    smooth = WaveModel(Material(1.5), height_rms=1e-9, corr_length=1.0)
    assert np.allclose(found.coherent, smooth.coherent(0.6, 0.6), rtol=1e-9, atol=1e-12)
    assert np.nanmax(np.abs(found.brdf)) < 1e-20


@pytest.mark.parametrize("material", [Material(1.5), Material(1.2, 6.9)])
def test_a_grating_of_small_height_scatters_as_first_order_says(material) -> None:
    """All elements out of plane, against a kernel written from the books."""
    count, step, height, theta_i, phi_i = 64, 0.2, 2e-5, 0.6, 0.4
    side = count * step
    x = np.arange(count) * step
    steps = np.array([7, -4])
    phase = 2 * np.pi * (steps[0] * x[:, None] + steps[1] * x) / side
    one = HeightMap(height * np.cos(phase + 0.3), step, periodic=True)
    found = map_scattering(one, material, theta_i, **GIVEN | {"phi_i": phi_i})
    k = 2 * np.pi / 0.6
    source = np.array([np.cos(phi_i), np.sin(phi_i)])
    index = complex(material.n, material.kappa)
    bright = 0
    for sign in (1, -1):
        lateral = -np.sin(theta_i) * source + sign * 2 * np.pi * steps / side / k
        theta_s = np.arcsin(np.hypot(*lateral))
        dphi = np.arctan2(lateral[1], lateral[0]) - phi_i
        jones = by_the_book.first_order(theta_i, theta_s, dphi, index)
        # |2 k cos_i b h/2|^2 cos_s/cos_i of the light
        share = (k * np.cos(theta_i) * height) ** 2 * np.cos(theta_s) / np.cos(theta_i)
        expected = share * by_the_book.mueller(jones)
        cell = found.sel(theta_s=theta_s, method="nearest")
        cell = cell.isel(dphi=round(dphi / (2 * np.pi / 24)) % 24)
        total = cell.brdf.values * float(cell.waves) * (0.6 / side) ** 2
        assert np.abs(total - expected).max() < 1e-6 * expected[0, 0]
        bright += 1
    assert bright == 2


def averaged_over_maps(surface, material, count, periodic, method):
    """Mean and its error over maps, the runs, and the bins of the detector."""
    runs = []
    for seed in range(count):
        sample = surface.sample(seed)
        one = HeightMap(sample.heights, sample.spacing, periodic=periodic)
        runs.append(map_scattering(one, material, 0.6, **GIVEN, method=method))
    found = np.array([run.brdf.values for run in runs])
    return found.mean(0), found.std(0, ddof=1) / np.sqrt(count), runs


def over_bins(model, run):
    """BRDF of a model averaged over the bins of a run."""
    x, w = np.polynomial.legendre.leggauss(4)
    theta_s = run.theta_s.values[:, None] + x * np.pi / 4 / 18
    dphi = run.dphi.values[:, None] + x * np.pi / 24
    weight = (np.cos(theta_s) * np.sin(theta_s) * w)[:, :, None, None] * w
    values = model.brdf(0.6, theta_s[:, :, None, None], dphi, 0.6)
    return (values * weight[..., None, None]).sum((1, 3)) / weight.sum((1, 3))[
        ..., None, None
    ]


@pytest.mark.parametrize("periodic", [True, False])
def test_random_maps_scatter_on_average_as_their_statistics(periodic) -> None:
    metal = Material(1.2, 6.9)
    mean, error, runs = averaged_over_maps(SURFACE, metal, 10, periodic, "kirchhoff")
    model = WaveModel(metal, height_rms=0.1, corr_length=1.6, method="kirchhoff")
    expected = over_bins(model, runs[0])
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
    found = np.array([run.brdf.values for run in runs])
    stated = np.sqrt(np.mean([run.brdf_stderr.values**2 for run in runs], axis=0))
    ratio = (stated / found.std(0, ddof=1))[bright][:, 0, 0]
    assert 0.7 < np.median(ratio) < 1.5


def test_maps_short_against_the_wave_scatter_by_orders() -> None:
    """Where tangent plane and first order differ, in all 16 elements."""
    short = GaussianSurface(shape=(192, 192), spacing=0.1, corr_length=0.4, height_rms=0.06)
    metal = Material(1.2, 6.9)
    mean, error, runs = averaged_over_maps(short, metal, 10, True, "order-weighted")
    given = {"height_rms": 0.06, "corr_length": 0.4}
    expected = over_bins(WaveModel(metal, **given, method="order-weighted"), runs[0])
    bright = expected[..., 0, 0] > 0.1 * expected[..., 0, 0].max()
    bright &= (runs[0].waves > 1).values
    assert bright.sum() > 100
    scale = expected[bright][:, :1, :1]
    limit = np.hypot(error[bright], 0.01 * scale)
    off = np.abs(mean - expected)[bright] / limit
    assert np.sqrt(np.mean(off**2, axis=0)).max() < 1.6
    assert off.max() < 7.0
    # Sums over bins have little noise: all elements within 1.5 % of M00, the plane not
    plane = over_bins(WaveModel(metal, **given, method="kirchhoff"), runs[0])
    sums = [part[bright].sum(0) for part in (mean, expected, plane)]
    assert np.abs(sums[0] - sums[1]).max() < 0.015 * sums[1][0, 0]
    assert np.abs(sums[0] - sums[2]).max() > 0.05 * sums[1][0, 0]


def test_forms_that_need_statistics_are_refused() -> None:
    with pytest.raises(ValueError, match="method must be one of order-weighted, kirchhoff"):
        map_scattering(SURFACE.sample(1), Material(1.5), 0.6, **GIVEN, method="auto")


def test_coarse_maps_are_refused() -> None:
    with pytest.raises(ValueError, match="spacing must be below half the wavelength"):
        map_scattering(SURFACE.sample(1), Material(1.5), 0.6, wavelength=0.3)


def test_directions_behind_the_source_want_finer_steps() -> None:
    # The lateral change is k (sin theta_s + sin theta_i), up to pi over the step
    surface = GaussianSurface(
        shape=(64, 64), spacing=0.25, corr_length=1.0, height_rms=0.01
    )
    with pytest.warns(AccuracyWarning, match="behind the source out .beyond 44.4 deg"):
        map_scattering(surface.sample(1), Material(1.5), np.pi / 6, **GIVEN)
