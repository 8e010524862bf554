"""Surfaces drawn from statistics have those statistics."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fitting import surface_statistics
from pbrdf.surface.measured import MeasuredSurface

LAGS = np.geomspace(0.01, 8, 100)


def draw(surface, n_real):
    return np.array([surface.sample(seed).heights for seed in range(n_real)])


@pytest.mark.parametrize("skewed", [False, True])
@pytest.mark.parametrize("power", [1.0, 2.0])
def test_ensemble_has_the_tabulated_autocorrelation_and_slope(skewed, power):
    """Sample moments of 60 periodic surfaces, to 5 standard errors between them."""
    scores = np.linspace(-3, 3, 25)
    surface = MeasuredSurface(
        shape=(96, 120),
        spacing=(0.5, 0.4),
        height_rms=1.7,
        corr_length=(3.0, 2.0),
        lags=LAGS,
        autocorrelation=np.exp(-(LAGS**power)),
        quantiles=np.exp(0.5 * scores) if skewed else None,
    )
    z = draw(surface, 60)
    assert surface.clipped < 0.02

    def check(per_surface, expected, allowed=0.0):
        error = per_surface.std() / np.sqrt(len(per_surface))
        assert abs(per_surface.mean() - expected) < 5 * error + allowed

    check(np.mean(z, axis=(1, 2)), 0.0)
    # The Hermite series of a heavy tail stops, and clipping moves what it cuts
    check(np.mean(z**2, axis=(1, 2)), 1.7**2, 0.01 * 1.7**2)
    for shift, axis, u in ((1, 1, 0.5 / 3), (6, 1, 1.0), (1, 2, 0.2), (5, 2, 1.0)):
        product = np.mean(z * np.roll(z, shift, axis=axis), axis=(1, 2))
        check(product / 1.7**2, np.exp(-(u**power)), 0.015)
    for axis, step, slope in zip((1, 2), (0.5, 0.4), surface.facet_slope_rms, strict=True):
        rise = (np.roll(z, -1, axis=axis) - z) / step
        check(np.mean(rise**2, axis=(1, 2)), slope**2, 0.02 * slope**2)
    third = np.mean(z**3, axis=(1, 2)) / 1.7**3
    if skewed:
        # Lognormal of shape 1/2 within its quantiles
        assert 1.2 < third.mean() < 1.9
    else:
        check(third, 0.0)


def test_gaussian_surface_keeps_slope_and_length():
    rng = np.random.default_rng(1)
    kernel = np.exp(-2 * (np.arange(-50, 51) / 14.5) ** 2)
    z = (
        2.6
        / np.sqrt(np.sum(kernel**2))
        * np.convolve(rng.normal(size=3100), kernel, "valid")
    )
    found = surface_statistics(SimpleNamespace(x=np.arange(3000.0), z=z))
    surface = found.to_surface((128, 128), 1.0)
    assert surface.slope_rms == found.slope_rms.value
    assert surface.corr_length == found.corr_length.value
    # The Gaussian form ties the height to them; both estimates know it to a few per cent
    assert_allclose(surface.ensemble_height_rms, found.height_rms.value, rtol=0.1)
    with pytest.raises(
        ValueError, match="kind must be one of gaussian, measured, got 'map'"
    ):
        found.to_surface((128, 128), 1.0, kind="map")


def test_anisotropic_map_gives_an_anisotropic_surface():
    source = MeasuredSurface(
        shape=(512, 512),
        spacing=1.0,
        height_rms=0.8,
        corr_length=(12.0, 6.0),
        lags=LAGS,
        autocorrelation=np.exp(-(LAGS**2)),
    )
    found = surface_statistics(source.sample(3))
    surface = found.to_surface((256, 256), 1.0)
    assert_allclose(surface.corr_length, (12, 6), rtol=0.08)
    assert_allclose(surface.facet_slope_rms, source.facet_slope_rms, rtol=0.06)


def test_measured_surface_brings_back_a_jagged_skewed_one():
    scores = np.linspace(-3, 3, 25)
    source = MeasuredSurface(
        shape=(600, 600),
        spacing=0.5,
        height_rms=1.3,
        corr_length=5.0,
        lags=LAGS,
        autocorrelation=np.exp(-LAGS),
        quantiles=np.exp(0.4 * scores),
    )
    first = surface_statistics(source.sample(1))
    assert first.autocorrelation.form == "matern"
    assert not first.gaussianity.is_gaussian
    again = surface_statistics(first.to_surface((600, 600), 0.5, kind="measured").sample(2))
    for name in ("height_rms", "corr_length", "slope_rms"):
        a, b = getattr(first, name), getattr(again, name)
        assert abs(a.value - b.value) < 4 * np.hypot(a.stderr, b.stderr)
    # Skewness follows the histogram; its error is that of a Gaussian surface, so allow more
    assert_allclose(again.skewness.value, first.skewness.value, rtol=0.35)


def test_a_failed_measurement_makes_no_surface():
    z = 4.0 * np.round(np.sin(np.arange(400.0) / 9) * 0.8 + 0.3)
    found = surface_statistics(SimpleNamespace(x=np.arange(400.0), z=z))
    assert not found.reliable
    with pytest.raises(ValueError, match="must be determined, got a failed measurement"):
        found.to_surface((64, 64), 1.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"height_rms": 0.0}, "height_rms must be positive"),
        ({"autocorrelation": [1.0, 0.3]}, r"autocorrelation must lie in \[-1, 1\)"),
        ({"lags": [0.5, 0.4]}, "lags must be at least two rising values"),
        ({"lags": [0.5, 0.7, 0.9]}, "must be of one length of at least 2, got 3 and 2"),
    ],
)
def test_bad_tables_are_refused(change, message):
    table = {"lags": [0.4, 1.0], "autocorrelation": [0.8, 0.3], "height_rms": 1.0}
    with pytest.raises(ValueError, match=message):
        MeasuredSurface(shape=(32, 32), spacing=1.0, corr_length=4.0, **(table | change))
