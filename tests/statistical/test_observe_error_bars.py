"""Are the standard errors of `observe` those of its results, and its knobs free?"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import GaussianSurface, HeightMap, Material, Scene, observe, simulate

SURFACE = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=5.0, slope_rms=0.35)
SCAN = {
    "theta_i": 0.7,
    "theta_s": np.array([0.7, 0.3, 0.9, 0.5]),
    "dphi": np.array([np.pi, 2.9, 3.4, 0.4]),
}
CONES = {"source_half_angle": 0.04, "detector_half_angle": 0.03}


def spread_over_stated(scene, seeds, **options):
    """Mean square deviation over seeds in stated variances, of M00 by bounces; expected 1.

    With n samples a stated variance, being noisy, divides by (n - 3)/(n - 1) on average.
    """
    options = SCAN | CONES | options
    runs = [observe(scene, **options, seed=seed) for seed in seeds]
    values = np.array([run.brdf.values[:2, :, 0, 0] for run in runs])
    errors = np.array([run.brdf_stderr.values[:2, :, 0, 0] for run in runs])
    paths = np.mean([run.paths.values[:2] for run in runs], axis=0)
    samples = runs[0].realizations if runs[0].ray_batches == 0 else runs[0].ray_batches
    # The facets of a fixed surface that nothing can hide are known without an error
    many = (paths > 80) & (errors > 1e-9 * values).all(axis=0)
    assert many[0].any()
    assert many[1].any()
    deviation = (values - values.mean(axis=0))[:, many] / errors[:, many]
    excess = len(runs) / (len(runs) - 1) * (samples - 3) / (samples - 1)
    return np.mean(deviation**2) * excess


@pytest.mark.slow
@pytest.mark.parametrize(
    ("estimator", "albedo", "reduced"),
    [
        ("facets", 0.0, False),
        ("facets", 0.0, True),
        ("corners", 0.0, True),
        ("paths", 0.4, False),
    ],
)
def test_errors_over_realizations(estimator, albedo, reduced):
    surface, scan = SURFACE, SCAN
    if reduced:
        # Steep and low, so that many facets are hidden: of few, one more is allowed for
        surface = replace(SURFACE, slope_rms=0.5)
        scan = SCAN | {"theta_i": 1.1, "theta_s": np.array([1.1, 0.8, 1.0, 0.9])}
    # Paths are dear, and of so few each number still has a thousand
    n_rays = 500 if estimator == "paths" else 4000
    ratio = spread_over_stated(
        Scene(surface, Material(1.5, diffuse_albedo=albedo)), range(40), n_rays=n_rays,
        realizations=24, estimator=estimator, start="source", hemisphere_samples=1.0,
        variance_reduction=reduced, **scan,
    )  # fmt: skip
    # Variance of 40 seeds, some of their 8 numbers correlated: a tenth each way
    assert 0.7 < ratio < 1.35


def test_where_nothing_is_hidden_the_error_is_that_of_one_facet_more():
    runs = [
        observe(
            Scene(SURFACE, Material(1.5)), **SCAN, **CONES, n_rays=4000, realizations=24,
            seed=seed, hemisphere_samples=1.0, max_bounces=1,
        )
        for seed in range(6)
    ]  # fmt: skip
    values, errors = (
        np.array([run[name].values[0, :, 0, 0] for run in runs])
        for name in ("brdf", "brdf_stderr")
    )
    assert (values.std(axis=0) < 1.5 * errors.mean(axis=0)).all()
    assert (errors < 2e-3 * values).all()


@pytest.mark.slow
@pytest.mark.parametrize("estimator", ["facets", "corners"])
def test_errors_over_batches_of_a_fixed_surface(estimator):
    surface = HeightMap(SURFACE.sample(3).heights, 1.0, periodic=True)
    # Grazing light, so that the facets have something to hide them
    ratio = spread_over_stated(
        Scene(surface, Material(1.5)), range(40), n_rays=128_000, theta_i=1.2,
        estimator=estimator, start="source",
    )  # fmt: skip
    assert 0.7 < ratio < 1.35


@pytest.mark.slow
def test_rare_glints_have_honest_errors():
    """Three mirrors seldom meet the source, and then outshine all that the base sends."""
    seeds = 24
    runs = [
        observe(
            Scene(SURFACE, Material(1.5, diffuse_albedo=0.5)), **SCAN, **CONES, seed=seed,
            n_rays=1500, realizations=24, estimator="corners", start="source",
            stokes="unpolarized", hemisphere_samples=1.0,
        )
        for seed in range(seeds)
    ]  # fmt: skip
    values = np.array([run.brdf.values[2, :, 0, 0] for run in runs])
    errors = np.array([run.brdf_stderr.values[2, :, 0, 0] for run in runs])
    z = (values - values.mean(axis=0)) / errors * np.sqrt(seeds / (seeds - 1))
    assert np.abs(z).max() < 5
    # Of 96 numbers; without what near misses foretell it was 3.0, the largest 21
    assert 0.75 < np.sqrt(np.mean(z**2)) < 1.25


@pytest.mark.parametrize(
    "knobs",
    [
        {"hemisphere_samples": 6.0, "sample_decay": 0.5},
        {"hemisphere_samples": 1.0, "sample_decay": 0.2},
    ],
)
def test_sampling_of_the_hemisphere_changes_the_noise_only(knobs):
    """Against counting, which asks neither source nor facets, in all classes of bounces."""
    scene = Scene(SURFACE, Material(1.5, diffuse_albedo=0.8))
    cones = {"source_half_angle": 0.15, "detector_half_angle": 0.1}
    options = {"n_rays": 2000, "realizations": 32, "start": "source"}
    with pytest.warns(UserWarning, match="wide beside the rms slope"):
        clever = observe(scene, **SCAN, **cones, **options, seed=1, **knobs)
    plain = observe(
        scene, **SCAN, **cones, **options, seed=2, estimator="count",
        hemisphere_samples=1.0, sample_decay=1.0,
    )  # fmt: skip
    difference = (clever.brdf - plain.brdf).values[..., 0, 0]
    z = difference / np.hypot(clever.brdf_stderr, plain.brdf_stderr).values[..., 0, 0]
    assert np.abs(z).max() < 4
    # Light of three bounces is there, and known to some per cent
    assert (clever.brdf_stderr[2, :, 0, 0] < 0.2 * clever.brdf[2, :, 0, 0]).all()


def test_only_corner_rays_lose_second_bounces_in_wide_cones():
    """Other directions of a wide cone meet other facets than its ray; counting knows."""
    steep = GaussianSurface(shape=(96, 96), spacing=1.0, corr_length=8.0, slope_rms=0.4)
    scene = Scene(HeightMap(steep.sample(3).heights, 1.0, periodic=True), Material(3.0))
    options = {
        "source_half_angle": 0.2, "detector_half_angle": 0.2, "phi_i": "uniform",
        "start": "source", "stokes": "unpolarized", "max_bounces": 2,
    }  # fmt: skip
    seen = {
        name: observe(
            scene, 0.7, 0.7, np.pi, n_rays=n_rays, estimator=name, seed=seed, **options
        )
        for seed, (name, n_rays) in enumerate({"count": 800_000, "paths": 400_000}.items())
    }
    with pytest.warns(UserWarning, match="multiple bounces lose"):
        seen["corners"] = observe(
            scene, 0.7, 0.7, np.pi, n_rays=400_000, estimator="corners", seed=2, **options
        )
    value = {name: run.brdf[1].item() for name, run in seen.items()}
    error = {name: run.brdf_stderr[1].item() for name, run in seen.items()}
    noise = np.hypot(error["count"], error["paths"])
    assert noise < 0.025 * value["count"]
    assert abs(value["paths"] - value["count"]) < 3.5 * noise
    # They lose some 13 % here
    assert value["corners"] < value["count"] - 3.5 * np.hypot(
        error["count"], error["corners"]
    )


def test_a_wide_cone_is_called_wide():
    options = {"n_rays": 320, "realizations": 8, "max_bounces": 1}
    with pytest.warns(UserWarning, match="wide beside the rms slope"):
        observe(
            Scene(SURFACE, Material(1.5)), 0.7, 0.7, np.pi, source_half_angle=0.2, **options
        )


def test_cut_light_is_counted_as_by_the_other_way():
    surface = HeightMap(SURFACE.sample(3).heights, 1.0, periodic=True)
    scene = Scene(surface, Material.mirror())
    options = {"n_rays": 400_000, "phi_i": "uniform", "max_bounces": 2}
    there = simulate(scene, 0.7, **options, seed=1)
    back = observe(
        scene, **SCAN, **CONES, **options, seed=2, start="source", estimator="corners"
    )
    # Some 3000 rays each
    assert 0.005 < there.truncated.item() < 0.02
    assert_allclose(back.truncated.item(), there.truncated.item(), rtol=0.09)
    assert back.leaked.item() == 0.0


def test_what_was_not_followed_is_not_called_zero():
    """Facets alone tell the single bounces; how much light went on is then unknown."""
    seen = observe(
        Scene(SURFACE, Material(1.5)), **SCAN, **CONES, n_rays=320, realizations=8,
        max_bounces=1,
    )  # fmt: skip
    assert seen.bundles == 0
    assert np.isnan(seen.truncated.item())


def test_a_reading_without_a_path_has_the_error_of_one():
    """Far from the specular direction of a gentle surface no facet joins the cones."""
    gentle = GaussianSurface(shape=(32, 32), spacing=1.0, corr_length=8.0, slope_rms=0.02)
    seen, known = (
        observe(
            Scene(gentle, Material(1.5)), 0.7, 0.2, 0.0, n_rays=320, realizations=8,
            source_half_angle=0.004, detector_half_angle=0.004, variance_reduction=wanted,
        )
        for wanted in (False, True)
    )  # fmt: skip
    assert seen.brdf_total[0, 0, 0].item() == 0.0
    assert 0.0 < seen.brdf_total_stderr[0, 0, 0].item() < np.inf
    # The law of the slopes tells how dark it is
    assert 0.0 <= known.brdf_total[0, 0, 0].item() < 1e-30
    assert np.isfinite(known.brdf_total_stderr).all()
