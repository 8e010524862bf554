"""Surface statistics on profiles and maps whose truth is known, and on bad input."""

import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import special
from scipy.ndimage import gaussian_filter1d

from fitting import surface_statistics

HEIGHT, LENGTH = 2.6, 14.5
TRUTH = np.array([HEIGHT, LENGTH, np.sqrt(2) * HEIGHT / LENGTH])


def smooth_heights(n, spacing, rng, *, height=HEIGHT, length=LENGTH):
    """White noise under a kernel whose autocorrelation is exp(-r²/l²)."""
    reach = int(np.ceil(4 * length / spacing))
    kernel = np.exp(-2 * (np.arange(-reach, reach + 1) * spacing / length) ** 2)
    kernel *= height / np.sqrt(np.sum(kernel**2))
    return np.convolve(rng.normal(size=n + 2 * reach), kernel, "valid")


def smooth_map(shape, lengths, rng, *, height=1.0, turned=0.0):
    """Heights on a unit grid, the axes of their correlation turned by an angle."""
    fx, fy = np.meshgrid(*(np.fft.fftfreq(2 * n) for n in shape), indexing="ij")
    u = fx * np.cos(turned) + fy * np.sin(turned)
    v = -fx * np.sin(turned) + fy * np.cos(turned)
    lx, ly = lengths
    power = np.pi * lx * ly * np.exp(-((np.pi * lx * u) ** 2) - (np.pi * ly * v) ** 2)
    white = np.fft.fft2(rng.normal(size=power.shape))
    return height * np.fft.ifft2(white * np.sqrt(power)).real[: shape[0], : shape[1]]


def profile(z, spacing=1.0):
    return SimpleNamespace(x=np.arange(z.size) * spacing, z=z)


def main_values(found):
    return np.array(
        [e.value for e in (found.height_rms, found.corr_length, found.slope_rms)]
    )


@pytest.mark.parametrize(
    ("spacing", "noise", "step"),
    [
        pytest.param(1.0, 0.0, 0.0, id="clean"),
        pytest.param(1.0, 0.5, 0.0, id="noise", marks=pytest.mark.slow),
        pytest.param(0.5, 0.0, 0.5, id="half-micron pixels", marks=pytest.mark.slow),
        pytest.param(2.0, 0.0, 2.0, id="two-micron pixels"),
        pytest.param(1.0, 0.3, 1.0, id="noise and pixels"),
    ],
)
def test_truth_is_recovered_whatever_the_instrument(spacing, noise, step):
    """40 profiles of 50 correlation lengths.

    Mean deviations against their scatter (5 standard errors), coverage of the 95 %
    intervals against the binomial law (1 in 10 000), stated against actual scatter.
    """
    rng = np.random.default_rng(17)
    n_real, covered, values, errors = 40, np.zeros(3), [], []
    for _ in range(n_real):
        n = int(50 * LENGTH / spacing)
        z = smooth_heights(n, spacing, rng) + noise * rng.normal(size=n)
        if step:
            z = step * np.round(z / step)
        found = surface_statistics(profile(z, spacing))
        parts = (found.height_rms, found.corr_length, found.slope_rms)
        covered += [e.low <= t <= e.high for e, t in zip(parts, TRUTH, strict=True)]
        values.append(main_values(found))
        errors.append([e.stderr for e in parts])
        assert found.autocorrelation.is_gaussian
        assert_allclose(found.quantisation, step, atol=1e-9)
    # Squares are what is unbiased: the rms of an rms over realisations
    rms = np.sqrt(np.mean(np.square(values), axis=0))
    scatter = np.std(values, axis=0)
    assert (np.abs(rms - TRUTH) < 5 * scatter / np.sqrt(n_real)).all()
    assert (covered >= special.bdtrik(1e-4, n_real, 0.95)).all()
    # A height that comes out below a two-micron step leaves its slope undetermined
    ratio = scatter / np.median(errors, axis=0)
    assert (np.abs(np.log(ratio)) < 4 / np.sqrt(2 * n_real)).all()


@pytest.mark.slow
def test_known_blur_and_correlated_noise_are_made_good():
    """As a located edge has them; unsaid, blur takes slope and such noise adds it."""
    rng = np.random.default_rng(12)
    blur, noise = 0.25 * LENGTH, 0.3
    # Neighbours share half of their noise, those beyond none of it
    white, grain = np.ones(1), np.array([1.0, 0.5])
    found = []
    for _ in range(20):
        z = smooth_heights(1100, 1.0, rng)
        steps = noise / np.sqrt(2) * rng.normal(size=z.size + 1)
        seen = (gaussian_filter1d(z, blur) + steps[1:] + steps[:-1])[50:-50]
        true = surface_statistics(profile(z[50:-50])).slope_rms.value
        row = []
        for said in ((blur, grain), (0.0, grain), (blur, white)):
            located = SimpleNamespace(x=np.arange(1000.0), z=seen)
            located.blur, located.grain = said
            picture = SimpleNamespace(x=located.x, z=np.zeros(1000), located=located)
            result = surface_statistics(picture)
            row.append([result.slope_rms.value / true, result.noise_rms.value / noise])
        found.append(row)
    told, without_blur, as_white = np.mean(found, axis=0)
    # 200 others scattered by 0.027 and 0.029 each: three standard errors
    assert_allclose(told, 1.0, atol=0.02)
    # A blur of l/4 leaves (1 + 1/4)^(-3/4) = 0.85 of the slope
    assert without_blur[0] == pytest.approx(0.85, abs=0.03)
    assert as_white[0] > 1.2


def test_noise_is_measured():
    rng = np.random.default_rng(4)
    for noise in (0.05, 0.26, 1.0):
        z = smooth_heights(3000, 1.0, rng) + noise * rng.normal(size=3000)
        found = surface_statistics(profile(z))
        # 4 standard errors of the noise alone: sigma / sqrt(2 n), and what the fit adds
        assert abs(found.noise_rms.value - noise) < 4 * found.noise_rms.stderr
        assert found.noise_rms.stderr < 0.12 * noise + 0.01
    assert any("noise decides the slope" in text for text in found.warnings)


def test_a_step_above_the_height_is_said_to_fail():
    z = smooth_heights(800, 1.0, np.random.default_rng(0))
    found = surface_statistics(profile(4.0 * np.round(z / 4.0)))
    assert not found.reliable
    assert not np.isfinite(found.slope_rms.high)
    assert "height step 4 um exceeds height_rms" in found.warnings[0]
    assert surface_statistics(profile(np.round(z))).reliable


@settings(deadline=None, max_examples=8)
@given(stretch=st.floats(0.01, 300), lift=st.floats(0.001, 50), seed=st.integers(0, 2**31))
def test_units_carry_through(stretch, lift, seed):
    rng = np.random.default_rng(seed)
    z = smooth_heights(500, 1.0, rng) + 0.1 * rng.normal(size=500)
    found = surface_statistics(profile(z))
    scaled = surface_statistics(profile(lift * z, stretch))
    factors = np.array([lift, stretch, lift / stretch])
    assert_allclose(main_values(scaled), factors * main_values(found), rtol=2e-3)
    assert_allclose(
        scaled.curvature_rms.value,
        lift / stretch**2 * found.curvature_rms.value,
        rtol=5e-3,
    )


def test_mirror_images_and_tilt_change_nothing_but_the_skewness():
    rng = np.random.default_rng(9)
    z = smooth_heights(700, 0.8, rng) + 0.2 * rng.normal(size=700)
    found = surface_statistics(profile(z, 0.8))
    for other in (-z, z[::-1], z + 3 - 0.4 * np.arange(700)):
        assert_allclose(
            main_values(surface_statistics(profile(other, 0.8))),
            main_values(found),
            rtol=1e-4,
        )
    turned = surface_statistics(profile(-z, 0.8))
    assert_allclose(turned.skewness.value, -found.skewness.value, rtol=1e-9)


@pytest.mark.parametrize("form", ["curvature", 4])
def test_what_form_removal_takes_is_made_good(form):
    """Mean height and length over 60 short profiles with a bend, to 4 standard errors."""
    rng = np.random.default_rng(6)
    n = int(40 * LENGTH)
    x = np.linspace(-1, 1, n)
    values = [
        main_values(
            surface_statistics(profile(smooth_heights(n, 1.0, rng) + 30 * x**2), form=form)
        )
        for _ in range(60)
    ]
    rms = np.sqrt(np.mean(np.square(values), axis=0))
    assert (np.abs(rms - TRUTH) < 4 * np.std(values, axis=0) / np.sqrt(60)).all()


def test_uneven_spacing():
    rng = np.random.default_rng(12)
    inside, n_real = np.zeros(3), 15
    for _ in range(n_real):
        fine = smooth_heights(40 * 145, 0.1, rng)
        chosen = np.sort(rng.choice(fine.size, 450, replace=False))
        x = chosen * 0.1 + rng.uniform(-0.02, 0.02, chosen.size)
        found = surface_statistics(SimpleNamespace(x=np.sort(x), z=fine[chosen]))
        parts = (found.height_rms, found.corr_length, found.slope_rms)
        inside += [e.low <= t <= e.high for e, t in zip(parts, TRUTH, strict=True)]
    assert (inside >= special.bdtrik(1e-3, n_real, 0.95)).all()


def test_an_exponential_surface_is_not_forced_to_be_gaussian():
    rng = np.random.default_rng(3)
    n, length, spacing = 6000, 20.0, 0.5
    z = np.zeros(n)
    step = np.exp(-spacing / length)
    kicks = np.sqrt(1 - step**2) * rng.normal(size=n)
    z[0] = rng.normal()
    for i in range(1, n):
        z[i] = step * z[i - 1] + kicks[i]
    found = surface_statistics(profile(1.7 * z, spacing))
    assert found.autocorrelation.form == "matern"
    assert_allclose(found.autocorrelation.parameters["smoothness"], 0.5, atol=0.08)
    assert found.corr_length.low < length < found.corr_length.high
    assert any("changes with the cut-off" in text for text in found.warnings)
    bands = found.slope_against_cutoff([2.0, 5.0, 20.0])
    for cutoff, band in zip(bands.cutoff, bands.slope_rms, strict=True):
        top = 2 * np.pi / cutoff * length
        exact = 1.7 / length * np.sqrt(2 / np.pi * (top - np.arctan(top)))
        assert abs(band.value - exact) < 4 * band.stderr
    assert bands.measured.all()
    assert not found.slope_against_cutoff([0.3]).measured.any()


def test_two_scales_are_told_apart():
    rng = np.random.default_rng(5)
    z = smooth_heights(8000, 0.5, rng, height=2.0, length=40.0)
    z += smooth_heights(8000, 0.5, rng, height=0.5, length=4.0)
    found = surface_statistics(profile(z + 0.02 * rng.normal(size=8000), 0.5))
    assert found.autocorrelation.form == "two-scale"
    exact = np.sqrt(2 * (2.0 / 40) ** 2 + 2 * (0.5 / 4) ** 2)
    assert abs(found.slope_rms.value - exact) < 4 * found.slope_rms.stderr
    # The share of a Gaussian scale above a wavelength is erf(u) - 2 u exp(-u²) / sqrt(pi)
    u = np.pi * np.array([40.0, 4.0]) / 15.0
    share = special.erf(u) - 2 * u * np.exp(-(u**2)) / np.sqrt(np.pi)
    exact = np.sqrt(2 * (share * [(2.0 / 40) ** 2, (0.5 / 4) ** 2]).sum())
    band = found.slope_at(15.0)
    assert abs(band.value - exact) < 4 * band.stderr


def test_a_sine_has_its_own_slope():
    x = np.arange(4000) * 0.25
    wave = 2 * np.pi / 20
    found = surface_statistics(SimpleNamespace(x=x, z=1.5 * np.sin(wave * x)))
    assert_allclose(found.height_rms.value, 1.5 / np.sqrt(2), rtol=0.02)
    assert_allclose(found.slope_rms.value, 1.5 * wave / np.sqrt(2), rtol=0.02)
    assert_allclose(found.curvature_rms.value, 1.5 * wave**2 / np.sqrt(2), rtol=0.04)
    assert_allclose(found.autocorrelation.parameters["period"], 20, rtol=0.02)
    # The autocorrelation cos(2 pi r / 20) falls to 1/e at 3.80 um
    assert_allclose(
        found.corr_length.value, 20 / (2 * np.pi) * np.arccos(np.exp(-1)), rtol=0.1
    )


def test_map_slopes_lengths_and_texture():
    rng = np.random.default_rng(2)
    z = smooth_map((420, 380), (9.0, 18.0), rng, height=1.4)
    i, j = np.mgrid[:420, :380]
    z = z + 0.1 * rng.normal(size=z.shape) + 0.02 * i - 0.05 * j
    z[rng.random(z.shape) < 0.05] = np.nan
    found = surface_statistics(SimpleNamespace(heights=z, spacing=(0.5, 0.5)))
    for axis, length in zip(found.axes, (4.5, 9.0), strict=True):
        slope = np.sqrt(2) * 1.4 / length
        assert abs(axis.corr_length.value - length) < 4 * axis.corr_length.stderr
        assert abs(axis.slope_rms.value - slope) < 4 * axis.slope_rms.stderr
        assert axis.slope_rms.stderr < 0.05 * slope
    assert abs(found.height_rms.value - 1.4) < 4 * found.height_rms.stderr
    assert_allclose(found.noise_rms.value, 0.1, rtol=0.05)
    expected = np.sqrt((1.4 / 4.5) ** 2 + (1.4 / 9.0) ** 2)
    assert abs(found.slope_rms.value - expected) < 4 * found.slope_rms.stderr


@pytest.mark.parametrize("turned", [0.5, -1.1])
def test_texture_direction(turned):
    rng = np.random.default_rng(7)
    # Long correlation along x before it is turned: the texture runs at that angle
    z = smooth_map((400, 440), (22.0, 8.0), rng, turned=turned)
    found = surface_statistics(SimpleNamespace(heights=z, spacing=(1.0, 1.0))).anisotropy
    assert not found.is_isotropic
    assert abs(found.direction.value - turned) < 4 * found.direction.stderr
    assert abs(found.ratio.value - 22 / 8) < 4 * found.ratio.stderr
    assert found.direction.stderr < 0.1


def test_isotropic_maps_are_seldom_called_anisotropic():
    rng = np.random.default_rng(1)
    n_real = 20
    alarms = sum(
        not surface_statistics(
            SimpleNamespace(
                heights=smooth_map((120, 120), (5.0, 5.0), rng), spacing=(1.0, 1.0)
            )
        ).anisotropy.is_isotropic
        for _ in range(n_real)
    )
    assert alarms <= special.bdtrik(1 - 1e-4, n_real, 0.05)


def test_histograms_and_spectrum_agree_with_the_numbers():
    rng = np.random.default_rng(10)
    z = smooth_heights(5000, 1.0, rng) + 0.3 * rng.normal(size=5000)
    found = surface_statistics(profile(z))
    heights = found.height_histogram()
    slopes = found.slope_histogram()
    for histogram, rms in ((heights, HEIGHT), (slopes, TRUTH[2])):
        width = np.diff(histogram.edges)
        assert_allclose(np.sum(width * histogram.density), 1)
        measured = np.sqrt(np.sum(width * histogram.density * histogram.centres**2))
        # Bins and the allowed tenth of noise widen it a little
        assert_allclose(measured, rms, rtol=0.12)
        assert_allclose(np.sum(width * histogram.gaussian()), 1, atol=0.01)
    assert slopes.lag > 1
    psd = found.psd()
    step = psd.frequency[1] - psd.frequency[0]
    assert_allclose(psd.psd_1d.sum() * step, HEIGHT**2 + 0.09, rtol=0.2)
    assert_allclose(psd.noise, 2 * 0.09, rtol=0.1)


def test_report_form_is_plain_data():
    z = smooth_heights(600, 1.0, np.random.default_rng(0))
    found = surface_statistics(profile(z))
    numbers = found.to_dict()
    assert numbers["slope_rms"]["units"] == "1"
    assert numbers["autocorrelation"]["x"]["form"] == "gaussian"
    assert {row[0] for row in found.table()} >= {"height_rms", "corr_length", "slope_rms"}
    assert "slope_rms" in str(found)


@pytest.mark.parametrize(
    ("surface", "options", "message"),
    [
        (profile(np.zeros(50)), {}, "heights must vary, got 0 um everywhere"),
        (profile(np.arange(5.0) ** 2), {}, "at least 12 heights, got 5"),
        (profile(np.arange(50.0) ** 2), {"form": "wavy"}, "form must be one of none"),
        (
            profile(np.arange(50.0) ** 2),
            {"quantisation": -1.0},
            "quantisation must be >= 0",
        ),
        (profile(np.r_[np.inf, np.arange(50.0)]), {}, "heights must be finite"),
    ],
)
def test_bad_input_is_refused(surface, options, message):
    with pytest.raises(ValueError, match=message):
        surface_statistics(surface, **options)


def test_other_types_are_refused():
    with pytest.raises(TypeError, match=r"must be a Profile .* got list"):
        surface_statistics([1, 2, 3])
    z = smooth_heights(300, 1.0, np.random.default_rng(0))
    with pytest.raises(ValueError, match="axis must be one of x, got 'y'"):
        surface_statistics(profile(z)).slope_histogram("y")


@pytest.mark.slow
def test_intervals_of_nearly_straight_edges_in_noise_hold_the_truth():
    """Five correlation lengths in noise of twice the height; first order held 3 in 4."""
    n, step, height, length, noise = 340, 0.1176, 0.02, 8.0, 0.05
    filtered = np.exp(-((np.pi * np.fft.rfftfreq(8 * n, step) * length) ** 2) / 2)
    scale = height / np.sqrt(np.fft.irfft(filtered**2)[0])
    held = np.zeros(2)
    for seed in range(24):
        rng = np.random.default_rng(seed)
        z = np.fft.irfft(np.fft.rfft(rng.normal(size=8 * n)) * filtered)[:n] * scale
        z += noise * rng.normal(size=n)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = surface_statistics(SimpleNamespace(x=np.arange(n) * step, z=z))
        truth = np.sqrt(2) * height / length, length
        pair = found.slope_rms, found.corr_length
        held += [e.low <= t <= e.high for e, t in zip(pair, truth, strict=True)]
        # 2 / n, which was the floor, would be 3.8 %
        assert found.height_rms.stderr > 0.05 * found.height_rms.value
    # Of 24 intervals of 95 % fewer than 20 hold by chance once in 170
    assert held.min() >= 20, held
