"""Readings of single bounces less the noise of the slopes, against the plain estimator."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import GaussianSurface, HeightMap, Material, MicrofacetModel, Scene
from pbrdf.observation import observe

GLASS = Material(1.5)
# Facets are a sixth of the correlation length wide: what depends on the mesh is seen
SURFACE = GaussianSurface(shape=(60, 60), spacing=1.0, corr_length=6.0, slope_rms=0.35)
THETA_I = np.full(4, np.deg2rad(55.0))
THETA_S = np.deg2rad([55.0, 40.0, 68.0, 30.0])
DPHI = np.array([np.pi, np.pi, np.pi, 2.2])
CONES = {"source_half_angle": 0.06, "detector_half_angle": 0.04}


def look(seed, *, reduced=True, **options):
    given = {"phi_i": 0.3, "n_rays": 600, "realizations": 24, **CONES, **options}
    return observe(
        Scene(SURFACE, GLASS), THETA_I, THETA_S, DPHI, seed=seed,
        variance_reduction=reduced, **given,
    )  # fmt: skip


@pytest.mark.parametrize(
    "options",
    [{"estimator": "facets"}, {"estimator": "paths"}, {"phi_i": "uniform"}],
    ids=["facets", "paths", "uniform"],
)
def test_all_elements_of_all_bounces_agree_with_the_plain_estimator(options):
    reduced = look(1, realizations=24, **options)
    plain = look(2, reduced=False, realizations=100, **options)
    assert reduced.attrs["variance_reduction"] == "single bounces"
    assert plain.attrs["variance_reduction"] == "none"
    for name in ("brdf", "brdf_total"):
        value, error = reduced[name].values, reduced[f"{name}_stderr"].values
        other, spread = plain[name].values, plain[f"{name}_stderr"].values
        lit = (other[..., :1, :1] > 10 * spread[..., :1, :1]) & (spread > 0.0)
        z = (value - other)[lit] / np.hypot(error, spread)[lit]
        assert z.size >= 40
        assert np.abs(z).max() < 4.5
        assert np.mean(z**2) < 2.5


def test_there_is_less_noise_and_errors_state_it():
    """Of single bounces a hundredth, and the spread over runs is what is stated."""
    once = {"max_bounces": 1, "stokes": "unpolarized"}
    runs = {
        reduced: [
            look(seed, reduced=reduced, realizations=16, **once) for seed in range(20)
        ]
        for reduced in (True, False)
    }
    squares = {}
    for reduced, each in runs.items():
        value = np.array([one.brdf.values[0].ravel() for one in each])
        stated = np.array([one.brdf_stderr.values[0].ravel() for one in each])
        squares[reduced] = np.mean((stated / value) ** 2)
        # Four readings of 20 runs tell a spread to 8 %
        ratio = value.var(axis=0, ddof=1) / np.mean(stated**2, axis=0)
        assert 0.78 < np.sqrt(np.mean(ratio)) < 1.25
    assert squares[False] > 15 * squares[True]


def test_where_nothing_is_hidden_a_reading_is_an_integral():
    """The closed form without shadowing, at the middle of narrow cones."""
    surface = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=8.0, slope_rms=0.05)
    theta_s, dphi = np.array([0.5, 0.55, 0.45]), np.array([np.pi, np.pi, 2.9])
    seen = observe(
        Scene(surface, GLASS), 0.5, theta_s, dphi, phi_i=0.4, source_half_angle=1e-3,
        detector_half_angle=1e-3, n_rays=200, realizations=8,
    )  # fmt: skip
    # Slopes of the facets of a mesh are correlated by -1/(2 m^2), 0.8 % of their variance
    model = MicrofacetModel(GLASS, slope_rms=0.05, shadowing="none")
    expected = model.brdf(0.5, theta_s, dphi)
    value = seen.brdf_total.values
    assert_allclose(value[:, 0, 0], expected[:, 0, 0], rtol=2e-2)
    assert_allclose(value / value[:, :1, :1], expected / expected[:, :1, :1], atol=1e-4)
    assert (seen.brdf_total_stderr.values[:, 0, 0] < 1e-9 * value[:, 0, 0]).all()


@pytest.mark.parametrize(
    ("surface", "options"),
    [
        (SURFACE, {"estimator": "corners"}),
        (SURFACE, {"realizations": 1}),
        (HeightMap.flat(size=(9.0, 9.0)), {"realizations": 1}),
    ],
    ids=["corners", "one realisation", "map"],
)
@pytest.mark.filterwarnings("ignore::pbrdf.errors.AccuracyWarning")
def test_where_nothing_is_known_the_estimator_is_plain(surface, options):
    given = {"n_rays": 320, "realizations": 8, **CONES, **options}
    runs = [
        observe(Scene(surface, GLASS), 0.5, 0.5, np.pi, variance_reduction=wanted, **given)
        for wanted in (True, False)
    ]
    assert [run.attrs["variance_reduction"] for run in runs] == ["none", "none"]
    assert (runs[0].brdf == runs[1].brdf).all()


def test_the_switch_is_on_or_off():
    with pytest.raises(TypeError, match="variance_reduction"):
        look(1, reduced="yes")
