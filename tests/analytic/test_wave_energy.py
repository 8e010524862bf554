"""Energy of mirrors, the mean field of surfaces, statistics by table, stated errors."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import AccuracyWarning, Material, WaveModel
from pbrdf.kernels.wave.orders import EXPONENTIAL, GAUSSIAN, fill_moments
from pbrdf.wave.order_table import OrderTable
from pbrdf.wave.statistics import Exponential, Gaussian
from tests import wave_reference


@pytest.mark.parametrize(("height", "length"), [(0.02, 0.4), (0.1, 1.0), (0.5, 6.0)])
@pytest.mark.parametrize("theta_i", [0.0, 0.5])
def test_a_mirror_returns_all_light(height, length, theta_i) -> None:
    model = WaveModel(Material.mirror(), height_rms=height, corr_length=length)
    energy = model.energy(theta_i, 1.0)
    assert energy.below == 0.0
    assert abs(energy.multiple) < 0.01
    # and the Kirchhoff factor would not: the shorter the length, the less
    if height == 0.02:
        plain = model.with_method("kirchhoff").coherent(theta_i, 1.0)[0, 0]
        assert abs(plain - energy.coherent) > 0.002


def test_the_mean_field_loses_what_first_order_scatters() -> None:
    """Of a mirror, to second order in the heights, for every length and incidence."""
    for length in (0.2, 0.6, 2.0):
        for theta_i in (0.0, 0.9):
            model = WaveModel(
                Material.mirror(),
                height_rms=2e-4,
                corr_length=length,
                method="first-order",
            )
            lost = 1.0 - model.coherent(theta_i, 1.0)[0, 0]
            assert model.energy(theta_i, 1.0).incoherent == pytest.approx(lost, rel=2e-3)


def test_the_mean_field_of_a_conductor_is_the_limit_of_a_large_index() -> None:
    given = {"height_rms": 0.005, "corr_length": 0.4}
    for theta_i in (0.0, 0.7, 1.2):
        metal = WaveModel(Material(1e6), **given).coherent(theta_i, 1.0)
        mirror = WaveModel(Material.mirror(), **given).coherent(theta_i, 1.0)
        # p is summed to all heights in two ways, which differ by the fourth order
        assert_allclose(metal, mirror, atol=3e-5)


@pytest.mark.parametrize(
    ("kind", "law"), [(Gaussian, GAUSSIAN), (Exponential, EXPONENTIAL)]
)
@pytest.mark.parametrize("dimensions", [1, 2])
@pytest.mark.parametrize(("height", "length"), [(0.05, 1.0), (1.5, 9.0)])
def test_tables_of_orders_are_their_closed_forms(
    kind, law, dimensions, height, length
) -> None:
    k = 2 * np.pi / 0.5
    rng = np.random.default_rng(2)
    rise, wave = rng.uniform(0.05, 2.0, 500), rng.uniform(0.0, 1.4, 500) ** 2
    expected = np.empty((5, 500))
    same = np.ones(500)
    fill_moments(
        law, dimensions, k * height * same, k * length * same, wave, rise, expected
    )
    table = OrderTable(kind(height, length), dimensions, 2 * k * height, 2 * k)
    found = table.moments(rise * k * height, wave * k) * k**dimensions
    counted = expected[2] > 1e-5 * expected[2].max()
    assert_allclose(found[:, counted], expected[:, counted], rtol=6e-3)


@pytest.mark.parametrize("given", ["psd", "function", "table"])
def test_statistics_mean_the_same_in_other_words(given) -> None:
    height, length = 0.1, 1.2
    direct = WaveModel(Material(1.5), height_rms=height, corr_length=length)
    frequency = np.geomspace(1e-3, 2.5, 300)
    bell = np.exp(-((np.pi * frequency * length) ** 2))
    lag = np.linspace(0, 8, 200)
    surface, profile = {
        "psd": (
            {"psd": (frequency, np.pi * (height * length) ** 2 * bell)},
            {"psd": (frequency, np.sqrt(np.pi) * height**2 * length * bell)},
        ),
        "function": (
            {
                "height_rms": height,
                "autocorrelation": lambda x: np.exp(-((x / length) ** 2)),
            },
        )
        * 2,
        "table": (
            {
                "height_rms": height,
                "autocorrelation": (lag, np.exp(-((lag / length) ** 2))),
            },
        )
        * 2,
    }[given]
    theta_s, dphi = np.linspace(0, 1.2, 7), np.linspace(0, np.pi, 7)
    found = WaveModel(Material(1.5), **surface)
    expected = direct.brdf(0.4, theta_s, dphi, 0.5)
    scale = expected[:, :1, :1]
    counted = scale > 1e-3 * scale.max()
    off = np.abs(found.brdf(0.4, theta_s, dphi, 0.5) - expected) / scale
    assert off.max(where=counted, initial=0.0) < 2e-3
    mean = direct.coherent(0.4, 0.5)
    assert_allclose(found.coherent(0.4, 0.5), mean, rtol=0, atol=2e-3 * mean[0, 0])
    view = np.linspace(-1.2, 1.2, 9)
    lines = WaveModel(Material(1.5), **profile)
    # Those without a closed form take the curvature form in full
    found_power = lines.profile_scattering(0.4, view, 0.5)
    full = direct.with_method("local-curvature").profile_scattering(0.4, view, 0.5)
    assert_allclose(found_power, full, atol=1e-3 * full.max())
    assert_allclose(
        lines.profile_coherent(0.4, 0.5), direct.profile_coherent(0.4, 0.5), rtol=2e-3
    )


def test_the_density_of_a_profile_is_for_the_methods_of_profiles() -> None:
    frequency = np.geomspace(1e-3, 2.5, 200)
    bell = np.exp(-((np.pi * frequency * 1.2) ** 2))
    lines = WaveModel(
        Material(1.5), height_rms=0.1, psd=(frequency, np.sqrt(np.pi) * 0.012 * bell)
    )
    assert lines.profile_coherent(0.4, 0.5).shape == (2,)
    with pytest.raises(ValueError, match="two-sided density of a surface"):
        lines.coherent(0.4, 0.5)


def test_faults_of_the_heights_are_named() -> None:
    glass = Material(1.5)
    frequency = np.geomspace(0.01, 2, 50)
    with pytest.raises(ValueError, match=r"height_rms must be given .* Got neither"):
        WaveModel(glass)
    with pytest.raises(ValueError, match="corr_length must be given"):
        WaveModel(glass, height_rms=0.1)
    with pytest.raises(ValueError, match="psd must integrate to height_rms 5 um, got"):
        WaveModel(glass, height_rms=5.0, psd=(frequency, 1e-3 / (1 + frequency**4)))
    with pytest.raises(ValueError, match="autocorrelation must be one of gaussian"):
        WaveModel(glass, height_rms=0.1, corr_length=1.0, autocorrelation="gauss")
    with pytest.raises(ValueError, match="exponent must be given"):
        WaveModel(glass, height_rms=0.1, corr_length=1.0, autocorrelation="k-correlation")
    with pytest.raises(ValueError, match="corr_length must be the lag where"):
        WaveModel(
            glass, height_rms=0.1, corr_length=1.0, autocorrelation=lambda x: 1 / (1 + x)
        )
    endless = WaveModel(
        glass, height_rms=0.8, corr_length=12.0, autocorrelation="k-correlation",
        exponent=1.1, method="kirchhoff",
    )  # fmt: skip
    with pytest.raises(ValueError, match=r"autocorrelation must fall within 30\d\d um at"):
        endless.brdf(0.1, 0.2, 0.3, 0.5)
    ripples = WaveModel(
        glass, height_rms=0.1, method="geometric",
        autocorrelation=lambda x: np.exp(-(x**2)) * np.cos(2 * x),
    )  # fmt: skip
    assert np.isfinite(ripples.brdf(0.1, 0.2, 0.3, 0.5)).all()
    with pytest.raises(ValueError, match="must have roughness coarser than half the"):
        ripples.brdf(0.1, 0.2, 0.3, 20.0)
    with pytest.warns(AccuracyWarning, match=r"rms slope 0\.\d+ exceeds 0.45"):
        WaveModel(glass, height_rms=0.4, corr_length=1.0).brdf(0.1, 0.2, 0.3, 0.5)


@pytest.mark.filterwarnings("ignore:The rms slope")
def test_the_stated_error_covers_the_true_one() -> None:
    within, twice, low = [], [], []
    for name, material in (("n1.5", Material(1.5)), ("pec", Material.mirror())):
        for (height, length, theta), group in wave_reference.table(name).groupby(
            wave_reference.CASE
        ):
            model = WaveModel(material, height_rms=height, corr_length=length)
            for i, pol in enumerate("sp"):
                rows = group[group.pol == pol]
                true = rows.mdrc_incoherent.to_numpy()
                view = np.deg2rad(rows.theta_s_deg.to_numpy(dtype=float))
                counted = (rows.quality == 0).to_numpy() & (true > 0.05 * true.max())
                counted &= np.abs(view) <= np.deg2rad(80)
                found = wave_reference.averaged(model, theta, view)[counted, i]
                stated = model.profile_error(np.deg2rad(theta), view, 1.0)[counted, i]
                noise = rows.stderr.to_numpy()[counted] / true[counted]
                off = np.abs(np.log(found / true[counted]))
                limit = np.hypot(np.log1p(stated), noise)
                within.append(off < limit)
                twice.append(off < 2 * limit)
                low.append(np.abs(view[counted]) > np.deg2rad(70))
    within, twice, low = (np.concatenate(part) for part in (within, twice, low))
    # A standard error: no less than 68 and 95 %, and not by being far too large
    assert 0.68 < within.mean() < 0.86
    assert twice.mean() > 0.95
    # Low rays err most: there it held 45 and 70 % before it knew of the slope
    assert within[low].mean() > 0.64
    assert twice[low].mean() > 0.9


def waves_of(correlation):
    """One matrix of heights with a correlation."""
    model = WaveModel(Material(1.5), height_rms=0.05, autocorrelation=correlation)
    return model.brdf(0.0, 0.1, 0.0, 0.5)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (np.cos, "must fall to 0, got -0.999"),
        (lambda x: 0.5 + 0.5 * np.exp(-x * x), "must fall to 0, got 0.5"),
        (lambda x: 1 / (1 + x * x), "must fall below 1e-09 within"),
        (lambda x: np.where(x > 5, np.nan, np.exp(-x)), "must be finite, got nan"),
    ],
)
def test_autocorrelations_that_do_not_end_are_refused(given, said) -> None:
    # Their transform took all memory
    with pytest.raises(ValueError, match=said):
        waves_of(given)


def test_high_roughness_finer_than_the_wave_is_warned_of() -> None:
    model = WaveModel(Material(1.5), height_rms=0.05, corr_length=0.05)
    with pytest.warns(AccuracyWarning, match="finer than the wavelength of 0.5 um is high"):
        model.brdf(0.1, 0.4, 2.0, 0.5)
    # k h^2 times the mean wave vector of a Gaussian spectrum beyond k, in closed form
    k = 2 * np.pi / 0.5
    closed = k * 0.05**2 / 0.05 * 2 / np.sqrt(np.pi) * np.exp(-((k * 0.05) ** 2) / 4)
    assert model.profile.fineness(np.array([0.5]))[0] == pytest.approx(closed, rel=1e-6)
