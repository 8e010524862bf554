"""Stated standard errors against the spread of independent runs."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import chi2

from pbrdf import GaussianSurface, Material, Scene, simulate
from pbrdf.conventions import detector_bins
from pbrdf.kernels import from_python
from pbrdf.kernels.bins.neighbours import share_noise
from pbrdf.simulation.moments import neighbour_room

SURFACE = GaussianSurface(shape=(128, 128), spacing=1.0, corr_length=8.0, slope_rms=0.3)
FIXED = SURFACE.sample(3)


def repeat(surface, seeds, **options):
    """Total M00 and M10 and albedos: values and stated errors (seeds, numbers)."""
    values, errors = [], []
    for seed in range(seeds):
        result = simulate(
            Scene(surface, Material(1.5)), np.deg2rad(40.0), seed=100 + seed,
            n_theta=6, n_dphi=8, stokes="linear", variance_reduction=False, **options,
        )  # fmt: skip
        column = {"stokes_in": 0, "stokes_out": slice(2)}
        values.append(
            [*result.brdf_total.isel(column).values.ravel(), *result.albedo.values.ravel()]
        )
        errors.append(
            [
                *result.brdf_total_stderr.isel(column).values.ravel(),
                *result.albedo_stderr.values.ravel(),
            ]
        )
    return np.array(values), np.array(errors)


def spread_over_stated(values, errors):
    """Root mean square over the well-lit numbers of spread / stated, both as variances."""
    stated = (errors**2).mean(axis=0)
    lit = np.sqrt(stated) < 0.2 * np.abs(values.mean(axis=0))
    assert lit.sum() > 20
    return np.sqrt(values.var(axis=0, ddof=1)[lit] / stated[lit])


@pytest.mark.parametrize(
    ("surface", "options"),
    [
        (SURFACE, {"realizations": 16, "n_rays": 800}),
        # 32 batches of rays on one surface, entry points in shifted lattices
        (FIXED, {"n_rays": 6400}),
    ],
    ids=["realisations", "batches"],
)
def test_b22_stated_errors_are_the_spread(surface, options, measured):
    values, errors = repeat(surface, 40, **options)
    ratio = spread_over_stated(values, errors)
    # One spread of 40 seeds is known to 11 %; false-alarm level about 0.001
    off = abs(np.sqrt(np.mean(ratio**2)) - 1)
    measured("B22", "spread of 40 seeds over stated errors, less 1", off, 0.15)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("surface", "options"),
    [
        (SURFACE, {"realizations": 16, "n_rays": 4000}),
        (SURFACE, {"realizations": 64, "n_rays": 1000, "phi_i": "uniform"}),
        (FIXED, {"n_rays": 32_000}),
    ],
    ids=["realisations", "uniform azimuth", "batches"],
)
def test_b22_spread_over_100_seeds_within_a_tenth(surface, options, measured):
    values, errors = repeat(surface, 100, **options)
    ratio = spread_over_stated(values, errors)
    off = abs(np.sqrt(np.mean(ratio**2)) - 1)
    measured("B22", "spread of 100 seeds over stated errors, less 1", off, 0.1)
    # Each number alone: chi-square of 99 degrees of freedom, Sidak at 0.001 over all
    level = 1 - (1 - 0.001) ** (1 / len(ratio))
    low, high = np.sqrt(chi2.ppf([level / 2, 1 - level / 2], 99) / 99)
    # The stated error itself is known to 1 / sqrt(2 * 15 * 100)
    assert low * 0.95 < ratio.min()
    assert ratio.max() < high * 1.05


def test_dark_bins_have_the_error_of_one_path():
    """What no path reached is not known to be dark: it has the error of one mean path.

    Of rays: without them the light of dark bins is an integral.
    """
    gentle = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=8.0, slope_rms=0.1)
    result = simulate(
        Scene(gentle, Material(1.5)), np.deg2rad(40.0), n_rays=200, realizations=8,
        n_theta=18, n_dphi=36, variance_reduction=False,
    )  # fmt: skip
    value = result.brdf.sel(stokes_out="I", stokes_in="I").values
    stderr = result.brdf_stderr.sel(stokes_out="I", stokes_in="I").values
    flux = stderr[0, 0] * result.projected_solid_angle.values
    # Far from all light, on the other side of the zenith
    assert (value[0, 0, :, :6] == 0.0).all()
    one = result.albedo.values[0, 0] / np.asarray(result.attrs["rays_escaped"])[0]
    assert_allclose(flux[:, :6], one, rtol=0.05)
    assert (stderr[value > 0] > 0).all()


def rare_light(seeds):
    """Deviations of M00 in standard errors where few paths reach a bin, all bounces."""
    values, errors = [], []
    for seed in range(seeds):
        result = simulate(
            Scene(SURFACE, Material(1.5, diffuse_albedo=0.5)), np.deg2rad(40.0),
            n_rays=2400, realizations=32, seed=seed, n_theta=24, n_dphi=36,
            phi_i="uniform", stokes="unpolarized",
        )  # fmt: skip
        values.append(result.brdf.values[:, 0, ..., 0, 0])
        errors.append(result.brdf_stderr.values[:, 0, ..., 0, 0])
    mean, spread = np.mean(values, axis=0), np.std(values, axis=0, ddof=1)
    paths = np.divide(mean, spread, out=np.zeros_like(mean), where=spread > 0.0) ** 2
    few = (paths > 1.0) & (paths < 12.0)
    assert few[1].sum() > 100
    assert few[2].sum() > 100
    z = (np.array(values) - mean)[:, few] / np.array(errors)[:, few]
    return z * np.sqrt(seeds / (seeds - 1))


def test_rare_strong_paths_have_honest_errors():
    """A bin that strong paths missed by chance looks dark; its neighbours know better."""
    z = rare_light(24)
    # The spread of one bin alone gave an rms above 1000: light of weak paths and no noise
    assert 0.9 < np.sqrt(np.mean(z**2)) < 1.1
    # Student's t of 8 degrees of freedom has 0.4 % beyond 4
    assert np.mean(np.abs(z) > 4) < 0.004
    assert np.abs(z).max() < 8


def test_a_glint_lends_no_noise_to_the_dark_around_it():
    """One noisy peak among bins that no path reached, as a facet of a groove makes it."""
    one, peak, noise = 1e-5, 0.3, 0.01
    mean = np.zeros((18, 36, 1))
    variance = np.full_like(mean, one**2)
    mean[9, 18], variance[9, 18] = peak, noise**2
    _, _, weight = detector_bins(18, 36)
    from_python(share_noise)(mean, variance, weight, one, neighbour_room((18, 36), 1))
    error = np.sqrt(variance)
    assert_allclose(error[9, 18], noise, rtol=0.01)
    error[9, 18] = one
    # The peak stands out of its noise by 30: its neighbours share a thousandth of that
    assert error.max() < noise**2 / peak
