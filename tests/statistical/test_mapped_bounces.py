"""Single bounces by the facets of a map, against rays over the same map."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import GaussianSurface, HeightMap, Material, Scene, simulate
from pbrdf.simulation import simulate_parts, simulate_together
from tests.statistical.estimators import hold_together

GOLD_LIKE, GLASS = Material(0.958, 6.69), Material(1.5)
ROUGH = GaussianSurface(
    shape=(48, 40), spacing=(1.0, 1.2), corr_length=6.0, slope_rms=0.45
).sample(4)
FINITE = HeightMap(
    GaussianSurface(shape=(160, 150), spacing=1.0, corr_length=5.0, slope_rms=0.25)
    .sample(2)
    .heights,
    1.0,
)
STRIPES = HeightMap(
    ROUGH.heights,
    ROUGH.spacing,
    periodic=True,
    labels=np.indices(ROUGH.heights.shape)[0] % 2,
)
BINS = {"n_theta": 6, "n_dphi": 8}
REDUCED = "single bounces by facet"


@pytest.mark.parametrize(
    ("surface", "material", "theta_i"),
    [
        pytest.param(ROUGH, GOLD_LIKE, [20.0, 65.0], id="periodic"),
        pytest.param(FINITE, GLASS, [20.0], id="finite"),
        pytest.param(STRIPES, [GLASS, GOLD_LIKE], [50.0], id="labels"),
    ],
)
def test_all_elements_of_all_bounces_agree_with_rays(surface, material, theta_i):
    scene, theta_i = Scene(surface, material), np.deg2rad(theta_i)
    reduced, plain = (
        simulate(
            scene, theta_i, phi_i=0.6, n_rays=60_000, realizations=1, seed=seed,
            variance_reduction=wanted, **BINS,
        )
        for seed, wanted in ((13, True), (23, False))
    )  # fmt: skip
    assert reduced.attrs["variance_reduction"] == REDUCED
    assert plain.attrs["variance_reduction"] == "none"
    hold_together(reduced, plain, fewest=400, most_rms=1.25)
    budget = reduced.albedo.sum("bounces") + reduced.absorbed
    budget += reduced.truncated + reduced.leaked
    assert_allclose(budget, 1.0, atol=1e-12)


def test_there_is_less_noise():
    """Of single bounces, and of further ones what it was."""
    smooth = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=8.0, slope_rms=0.3)
    run = {
        wanted: simulate(
            Scene(smooth.sample(2), GLASS),
            0.7,
            n_rays=40_000,
            variance_reduction=wanted,
            explain=True,
            **BINS,
        )
        for wanted in (True, False)
    }
    one = {"theta_i": 0, "stokes_out": 0, "stokes_in": 0}
    light = run[False].brdf.isel(one).values
    squares = {}
    for wanted, each in run.items():
        error = each.brdf_stderr.isel(one).values
        bright = light > 0.1 * light.max(axis=(1, 2), keepdims=True)
        squares[wanted] = [
            np.mean((error[k][bright[k]] / light[k][bright[k]]) ** 2) for k in range(2)
        ]
    assert squares[False][0] > 20 * squares[True][0]
    assert 0.7 < squares[False][1] / squares[True][1] < 1.5
    told = ["facets of the map" in " ".join(run[k].explanation) for k in (True, False)]
    assert told == [True, False]


def test_the_mean_is_that_of_rays():
    """Few rays, many seeds: what single bounces of a bin are in the mean of short runs."""
    scene = Scene(ROUGH, GLASS)
    runs = np.array(
        [
            simulate(
                scene, 1.1, n_rays=640, seed=seed, stokes="unpolarized", **BINS
            ).brdf.values[0].squeeze()
            for seed in range(60)
        ]
    )  # fmt: skip
    plain = simulate(
        scene, 1.1, n_rays=400_000, stokes="unpolarized", variance_reduction=False, **BINS
    )
    truth, error = plain.brdf.values[0].squeeze(), plain.brdf_stderr.values[0].squeeze()
    lit = truth > 8 * error
    mean = runs.mean(axis=0)
    noise = np.hypot(runs.std(axis=0, ddof=1) / np.sqrt(len(runs)), error)
    z = ((mean - truth) / noise)[lit]
    assert z.size > 20
    assert np.abs(z).max() < 4.5
    assert np.mean(z**2) < 1.8


def test_stated_errors_are_the_spread_of_runs():
    scene = Scene(ROUGH, GLASS)
    runs = [
        simulate(scene, 0.9, n_rays=2000, seed=seed, stokes="unpolarized", **BINS)
        for seed in range(60)
    ]
    value = np.array([one.brdf_total.values.squeeze() for one in runs])
    stated = np.array([one.brdf_total_stderr.values.squeeze() for one in runs])
    bright = value.mean(axis=0) > 0.1 * value.mean(axis=0).max()
    ratio = value.std(axis=0, ddof=1)[bright] / np.sqrt((stated**2).mean(axis=0))[bright]
    # 60 runs tell a spread to 9 %, of some twenty bins
    assert bright.sum() > 8
    assert 0.85 < np.sqrt(np.mean(ratio**2)) < 1.12


def test_where_nothing_is_hidden_no_ray_is_needed():
    surface = GaussianSurface(shape=(32, 32), spacing=1.0, corr_length=8.0, slope_rms=0.04)
    scene = Scene(surface.sample(1), Material.mirror())
    runs = [
        simulate(scene, 0.6, phi_i=0.4, n_rays=3200, seed=seed, explain=True)
        for seed in (1, 2)
    ]
    for run in runs:
        assert_allclose(run.albedo.values.ravel(), [1.0, 0.0, 0.0], atol=1e-12)
        assert run.attrs["rel_error"] < 1e-12
        assert "Rays: none." in " ".join(run.attrs["explanation"])
    assert (runs[0].brdf == runs[1].brdf).all()
    plain = simulate(scene, 0.6, phi_i=0.4, n_rays=400_000, variance_reduction=False)
    value, error = plain.brdf_total.values[0], plain.brdf_total_stderr.values[0]
    lit = (value[..., :1, :1] > 8 * error[..., :1, :1]) & (error > 1e-9)
    z = (runs[0].brdf_total.values[0] - value)[lit] / error[lit]
    assert z.size > 60
    assert np.abs(z).max() < 5


@pytest.mark.filterwarnings("ignore:The tangent plane errs")
@pytest.mark.parametrize("waves", [2, 5])
def test_wavelengths_share_facets_and_rays(waves):
    """Also those that are summed by bin, among which each is as it is alone."""
    wavelength = np.linspace(0.4, 0.7, waves)
    material = Material.from_table(wavelength=[0.4, 0.7], n=[1.4, 1.9], kappa=[0.0, 2.0])
    options = {"n_rays": 6400, "seed": 3, "phi_i": 0.3, **BINS}
    together = simulate(Scene(ROUGH, material), 0.9, wavelength=wavelength, **options)
    assert together.attrs["variance_reduction"] == REDUCED
    for k in (0, waves - 1):
        alone = simulate(Scene(ROUGH, material), 0.9, wavelength=wavelength[k], **options)
        own = together.isel(wavelength=k)
        for name in ("brdf", "brdf_stderr", "brdf_total_stderr", "albedo", "absorbed"):
            most = np.abs(alone[name].values).max()
            assert_allclose(own[name], alone[name], rtol=0, atol=2e-8 * most)


def test_azimuths_workers_parts_and_company_do_not_change_a_bit():
    scene, theta_i = Scene(ROUGH, GLASS), [0.3, 0.9]
    options = {"n_rays": 3200, "seed": 4, **BINS}
    both = simulate(scene, theta_i, phi_i=[0.2, 1.1], workers=2, **options)
    alone = simulate(scene, theta_i, phi_i=1.1, workers=1, **options)
    assert alone.attrs["variance_reduction"] == REDUCED
    assert (both.brdf.isel(phi_i=1) == alone.brdf).all()
    parts = list(simulate_parts(scene, theta_i, phi_i=1.1, at_once=1, **options))
    lights = [(GLASS, None), (GOLD_LIKE, None)]
    company, _ = simulate_together(ROUGH, theta_i, lights, phi_i=1.1, **options)
    for name in ("brdf", "brdf_stderr", "albedo_stderr"):
        for k, part in enumerate(parts):
            assert (part[name][:, 0] == alone[name][:, k]).all()
        assert (company[name] == alone[name]).all()
    embree = simulate(scene, theta_i, phi_i=1.1, skips=False, **options)
    # Of several bounces a path or two ends elsewhere, at a rounding of Embree
    assert_allclose(embree.brdf[0], alone.brdf[0], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    "options",
    [{"phi_i": "uniform"}, {"source_half_angle": 0.05}, {"n_rays": 64}],
    ids=["uniform", "wide", "few rays"],
)
def test_where_facets_do_not_serve_rays_do(options):
    given = {"n_rays": 3200, **options, **BINS}
    runs = [
        simulate(Scene(ROUGH, GLASS), 0.7, variance_reduction=wanted, **given)
        for wanted in (False, True)
    ]
    assert [run.attrs["variance_reduction"] for run in runs] == ["none", "none"]
    assert (runs[0].brdf == runs[1].brdf).all()
