"""The parts of the surface statistics against closed forms and brute force."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import integrate, special

from fitting.statistics.axis.autocorrelation import (
    gaussian,
    matern,
    multi_scale,
    periodic,
    two_scale,
)
from fitting.statistics.axis.rounding import Rounding, find_step
from fitting.statistics.axis.scatter import (
    Extent,
    form_losses,
    form_scatter,
    increment_covariance,
)
from fitting.statistics.axis.spectrum import line_spectrum
from fitting.statistics.axis.structure_function import line_sampling, profile_sampling
from fitting.statistics.form import form_degree, remove_form_map, remove_form_profile
from fitting.statistics.gaussianity import judge_gaussianity

FORMS = [
    gaussian(3.7),
    periodic(8.3, 6.1),
    matern(2.9, 0.5),
    matern(4.1, 1.7),
    two_scale(5.0, 1.1, 0.2),
    multi_scale(np.array([0.9, 3.0, 11.0]), np.array([0.2, 0.5, 0.3])),
]


@pytest.mark.parametrize("form", FORMS, ids=lambda f: f.form)
def test_spectrum_and_autocorrelation_are_a_fourier_pair(form):
    r = 1.3
    f = np.linspace(-60, 60, 300_001)
    total = integrate.simpson(form.spectrum(f) * np.cos(2 * np.pi * f * r), x=f)
    # The exponential's spectrum falls as f^-2: up to 1/(pi^2 f l) = 6e-4 lies outside
    assert_allclose(total, form.rho(np.array(r)), atol=6e-4)
    assert_allclose(form.rho(np.array(form.corr_length)), np.exp(-1), rtol=1e-9)
    assert_allclose(form.rho(np.array(0.0)), 1.0, rtol=1e-5)


@pytest.mark.parametrize("form", FORMS, ids=lambda f: f.form)
def test_blur_acts_on_the_spectrum(form):
    """exp(-(2 pi f blur)²) on the power: the blurred autocorrelation is its transform."""
    blur = 0.6 * form.shortest_length()
    share, left = form.blurred(blur)
    f = np.linspace(-3 / blur, 3 / blur, 100_001)
    power = form.spectrum(f) * np.exp(-((2 * np.pi * f * blur) ** 2))
    # 24 nodes see the exponential's kink at zero to 1 %, smooth forms to their digits
    limit = 0.02 if form.parameters.get("smoothness", 1.0) <= 0.5 else 2e-3
    assert_allclose(share, integrate.simpson(power, x=f), atol=limit)
    for lag in (0.3 * form.corr_length, 1.2 * form.corr_length):
        blurred = integrate.simpson(power * np.cos(2 * np.pi * f * lag), x=f)
        assert_allclose(share * left.rho(np.array(lag)), blurred, atol=limit)
    assert_allclose(share * left.spectrum(f), power, rtol=1e-9)
    # Without blur nothing is lost
    assert form.blurred(0.0) == (1.0, form)


def test_matern_of_one_half_is_exponential_and_of_large_smoothness_gaussian():
    r = np.array([0.05, 0.8, 2.9, 9.0])
    assert_allclose(matern(2.9, 0.5).rho(r), np.exp(-r / 2.9), rtol=1e-10)
    assert_allclose(matern(2.9, 8.0).rho(r), gaussian(2.9).rho(r), atol=0.02)


def test_slope_of_all_wavelengths_is_the_curvature_of_the_autocorrelation_at_zero():
    for form in (*FORMS[:2], *FORMS[4:]):
        h = 1e-3
        second = 2 * (1 - form.rho(np.array(h))) / h**2
        assert_allclose(form.band_variance(0.0), second, rtol=1e-4)
    assert np.isinf(matern(2.9, 0.5).band_variance(0.0))


def test_slope_of_a_band_of_an_exponential_surface():
    length, cutoff = 2.9, 0.7
    # 2 int_0^F (2 pi f)^2 2 l / (1 + (2 pi f l)^2) df in closed form
    top = 2 * np.pi / cutoff * length
    exact = 2 / (np.pi * length**2) * (top - np.arctan(top))
    assert_allclose(matern(length, 0.5).band_variance(cutoff), exact, rtol=1e-4)


@pytest.mark.parametrize("tilt", [0.0, 0.37, 1.21])
@pytest.mark.parametrize("rms_increment", [0.15, 0.6, 2.0])
def test_rounded_increments_match_brute_force(tilt, rms_increment):
    step, n = 0.8, 400_000
    rng = np.random.default_rng(5)
    start = rng.uniform(0, step, n)
    increment = rng.normal(scale=rms_increment, size=n)
    rounded = step * np.round((start + increment + tilt) / step)
    squared = (rounded - step * np.round(start / step) - tilt) ** 2
    rounding = Rounding.of_form(step, np.full((3, 1), tilt), rms_increment**2)
    expected = rounding.increments(np.array([rms_increment**2]))[0]
    assert abs(squared.mean() - expected) < 4 * squared.std() / np.sqrt(n)
    # Its derivative, by finite differences
    d = 1e-5
    ends = rounding.increments(np.array([rms_increment**2 + d, rms_increment**2 - d]))
    gain = rounding.gain(np.array([rms_increment**2]))[0]
    assert_allclose(gain, (ends[0] - ends[1]) / (2 * d), rtol=1e-6)


def test_a_lattice_is_found_and_continuous_heights_have_none():
    rng = np.random.default_rng(2)
    z = rng.normal(scale=2, size=500)
    assert find_step(z) == 0
    assert_allclose(find_step(0.7 * np.round(z / 0.7) + 11.3), 0.7, rtol=1e-9)
    # Written with few digits
    assert_allclose(
        find_step(np.round(0.1176 * np.round(z / 0.1176), 4)), 0.1176, rtol=1e-3
    )


def _realisations(n_real, n, rho, rng):
    """Exact draws by the Cholesky factor of the covariance; rows."""
    x = np.arange(n)
    factor = np.linalg.cholesky(rho(np.abs(x[:, None] - x)) + 1e-10 * np.eye(n))
    return rng.normal(size=(n_real, n)) @ factor.T


def test_covariance_of_mean_squares_matches_simulation():
    """Variances and correlations of 6000 profiles, to 5 standard errors of a variance."""
    n, length, noise, n_real = 240, 6.0, 0.15, 6000
    rng = np.random.default_rng(8)
    rho = gaussian(length).rho
    z = 1.3 * _realisations(n_real, n, rho, rng) + noise * rng.normal(size=(n_real, n))
    lags = np.array([1, 3, 8])
    rows = [np.mean(z**2, axis=1)]
    rows += [np.mean((z[:, k:] - z[:, :-k]) ** 2, axis=1) for k in lags]
    simulated = np.cov(rows)
    expected = increment_covariance(
        lags.astype(float), gaussian(length), (1.3**2, noise**2), Extent(float(n), n)
    )
    scale = np.sqrt(np.diag(simulated))
    deviation = (expected - simulated) / np.outer(scale, scale)
    # Edges shorten each mean by its lag, up to 8 of 240 points
    assert np.abs(deviation).max() < 5 * np.sqrt(2 / n_real) + 8 / 240


@pytest.mark.parametrize(("degree", "length"), [(1, 200.0), (3, 900.0), (1, 2000.0)])
def test_form_removal_takes_the_expected_share(degree, length):
    n = int(length)
    rng = np.random.default_rng(4)
    # Independent of the module: white noise smoothed by a kernel whose square is the form
    kernel = np.exp(-2 * (np.arange(-60, 61) / 14.0) ** 2)
    kernel /= np.sqrt(np.sum(kernel**2))
    x = np.arange(n, dtype=float)
    left, scatter = [], []
    for _ in range(600):
        z = np.convolve(rng.normal(size=n + 120), kernel, "valid")
        left.append(np.mean(remove_form_profile(x, z, degree)[0] ** 2))
        scatter.append(np.mean(z**2))
    share = form_losses(gaussian(14.0), length, degree).sum()
    error = np.std(left) / np.sqrt(len(left))
    assert abs(np.mean(left) - (1 - share)) < 4 * error
    expected = 1 - form_scatter(gaussian(14.0), length, degree)
    # A ratio of two variances from 600 draws that share most of their chance
    assert_allclose(np.var(left) / np.var(scatter), expected, atol=0.15)


@pytest.mark.parametrize("length", [150.0, 700.0, 3000.0])
def test_share_of_the_mean_in_closed_form(length):
    # (2/L) int_0^L (1 - r/L) exp(-r²/l²) dr
    u = length / 14.0
    exact = np.sqrt(np.pi) * special.erf(u) / u - (1 - np.exp(-(u**2))) / u**2
    assert_allclose(form_losses(gaussian(14.0), length, 0), [exact], rtol=1e-3)


def test_form_removal_is_exact_for_polynomials():
    x = np.sort(np.random.default_rng(0).uniform(3, 90, 150))
    residual, form = remove_form_profile(x, 2 - 0.3 * x + 0.01 * x**2, 2)
    assert_allclose(residual, 0, atol=1e-10)
    assert_allclose(
        form.along(0, x + 1) - form.along(0, x), -0.3 + 0.01 * (2 * x + 1), atol=1e-9
    )
    i, j = np.mgrid[:40, :30]
    heights = 1 + 0.2 * i * 0.5 - 0.7 * j * 0.9 + 0.03 * i * j
    heights[3:9, 4:7] = np.nan
    residual, surface = remove_form_map(heights, (0.5, 0.9), 2)
    assert_allclose(residual[np.isfinite(residual)], 0, atol=1e-9)
    assert surface.n_terms == 6
    # Along x at y = 9 um: 0.2 + 0.03 * 10 / 0.5 a um
    rise = surface.along(0, np.array([6.0]), np.array([9.0])) - surface.along(
        0, np.array([5.0]), np.array([9.0])
    )
    assert_allclose(rise, 0.2 + 0.03 * 10 / 0.5, rtol=1e-9)


def test_increments_with_gaps_match_brute_force():
    rng = np.random.default_rng(1)
    lines = np.cumsum(rng.normal(size=(3, 50)), axis=1)
    lines[rng.random(lines.shape) < 0.2] = np.nan
    sampling = line_sampling(lines, 0.4)
    for k in (1, 5, 13):
        expected = np.nanmean((lines[:, k:] - lines[:, :-k]) ** 2)
        assert_allclose(sampling.mean_square[k], expected, rtol=1e-10)
    assert_allclose(sampling.variance, np.nanmean(lines**2), rtol=1e-12)


def test_uneven_increments_match_brute_force():
    rng = np.random.default_rng(1)
    x = np.sort(rng.uniform(0, 60, 90))
    z = np.sin(x) + 0.1 * rng.normal(size=90)
    found = profile_sampling(x, z).increments(12.0, 10)
    distance = x[:, None] - x
    squares = (z[:, None] - z)[distance > 0] ** 2
    distance = distance[distance > 0]
    # Sums over all bins, and the shortest bin alone
    inside = distance <= np.sort(distance)[int(found.pairs.sum()) - 1]
    assert_allclose(found.pairs @ found.mean_square, squares[inside].sum(), rtol=1e-10)
    first = np.argsort(distance)[: int(found.pairs[0])]
    assert_allclose(found.mean_square[0], squares[first].mean(), rtol=1e-10)
    assert_allclose(found.lags[0], np.sqrt(np.mean(distance[first] ** 2)), rtol=1e-10)


def test_a_profile_with_points_left_out_keeps_its_grid():
    x = np.delete(np.arange(80) * 0.5, [3, 4, 17, 50])
    sampling = profile_sampling(x, np.cos(x))
    assert_allclose(sampling.spacing, 0.5)
    assert sampling.n_points == 76
    expected = [
        (np.cos(a) - np.cos(b)) ** 2 for a in x for b in x if abs(a - b - 1.5) < 1e-9
    ]
    assert_allclose(sampling.mean_square[3], np.mean(expected), rtol=1e-9)


def test_spectrum_of_noise_is_flat_and_sums_to_its_variance():
    noise = np.random.default_rng(0).normal(scale=0.7, size=(40, 512))
    frequency, psd = line_spectrum(noise, 0.3)
    assert_allclose(psd.sum() * frequency[0], 0.49, rtol=0.03)
    assert_allclose(psd[100:150].mean(), 2 * 0.49 * 0.3, rtol=0.06)


def test_gaussianity_keeps_its_level_on_correlated_gaussian_heights():
    """False alarms of a 5 % test in 500 profiles: binomial, 1 in 10 000 on either side."""
    n, length, n_real = 900, 12.0, 500
    rng = np.random.default_rng(3)
    kernel = np.exp(-2 * (np.arange(-40, 41) / length) ** 2)
    lags = np.arange(-60, 61) / length
    samples = [n / np.sum(np.exp(-p * lags**2)) for p in (3, 4)]
    rejected = sum(
        not judge_gaussianity(
            np.convolve(rng.normal(size=n + 80), kernel, "valid"), *samples
        ).is_gaussian
        for _ in range(n_real)
    )
    low, high = special.bdtrik([1e-4, 1 - 1e-4], n_real, 0.05)
    assert low <= rejected <= high


def test_gaussianity_sees_a_skewed_surface_and_admits_too_few_heights():
    rng = np.random.default_rng(3)
    kernel = np.exp(-2 * (np.arange(-40, 41) / 12.0) ** 2)
    z = np.convolve(rng.normal(size=6000), kernel, "valid")
    z = np.exp(0.4 * z / z.std())
    verdict = judge_gaussianity(z, 300, 340)
    assert not verdict.is_gaussian
    assert verdict.skewness.low > 0
    assert "cannot be decided" in judge_gaussianity(z[:100], 6, 7).verdict


def test_form_names():
    assert form_degree("3") == form_degree(3) == 3
    with pytest.raises(
        ValueError, match=r"form must be one of none, mean, tilt.* got 'bent'"
    ):
        form_degree("bent")
    with pytest.raises(ValueError, match="got True"):
        form_degree(True)
