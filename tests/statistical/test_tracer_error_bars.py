"""Stated standard errors against the spread of independent runs."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import chi2

from pbrdf import GaussianSurface, Material, Scene, simulate

SURFACE = GaussianSurface(shape=(128, 128), spacing=1.0, corr_length=8.0, slope_rms=0.3)
FIXED = SURFACE.sample(3)


def repeat(surface, seeds, **options):
    """Total M00 and M10 and albedos: values and stated errors (seeds, numbers)."""
    values, errors = [], []
    for seed in range(seeds):
        result = simulate(
            Scene(surface, Material(1.5)), np.deg2rad(40.0), seed=100 + seed,
            n_theta=6, n_dphi=8, stokes="linear", **options,
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
def test_b22_stated_errors_are_the_spread(surface, options):
    values, errors = repeat(surface, 40, **options)
    ratio = spread_over_stated(values, errors)
    # One spread of 40 seeds is known to 11 %; false-alarm level about 0.001
    assert 0.85 < np.sqrt(np.mean(ratio**2)) < 1.15


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
def test_b22_spread_over_100_seeds_within_a_tenth(surface, options):
    values, errors = repeat(surface, 100, **options)
    ratio = spread_over_stated(values, errors)
    assert 0.9 < np.sqrt(np.mean(ratio**2)) < 1.1
    # Each number alone: chi-square of 99 degrees of freedom, Sidak at 0.001 over all
    level = 1 - (1 - 0.001) ** (1 / len(ratio))
    low, high = np.sqrt(chi2.ppf([level / 2, 1 - level / 2], 99) / 99)
    # The stated error itself is known to 1 / sqrt(2 * 15 * 100)
    assert low * 0.95 < ratio.min()
    assert ratio.max() < high * 1.05


def test_dark_bins_have_the_error_of_one_path_and_rare_light_its_own():
    """What no path reached is not known to be dark: it has the error of one mean path."""
    result = simulate(
        Scene(SURFACE, Material(1.5)), np.deg2rad(40.0), n_rays=200, realizations=8,
        n_theta=18, n_dphi=36,
    )  # fmt: skip
    value = result.brdf.sel(stokes_out="I", stokes_in="I").values
    stderr = result.brdf_stderr.sel(stokes_out="I", stokes_in="I").values
    assert (value == 0).any()
    # One path of each class of bounces carries its share of that albedo
    escaped = np.asarray(result.attrs["rays_escaped"])[0]
    for order in range(3):
        dark = value[order, 0] == 0
        flux = (stderr[order, 0] * result.projected_solid_angle.values)[dark]
        assert_allclose(flux, flux[0])
        assert flux[0] >= result.albedo.values[order, 0] / escaped
    assert (stderr[value > 0] > 0).all()
    # One realisation of eight with light: the error is as large as the value
    rare = (value > 0) & (stderr > 0.999 * value)
    assert rare.any()
    assert (stderr[value > 0] <= 1.000001 * value[value > 0]).all()
