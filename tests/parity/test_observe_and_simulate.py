"""Two ways to look at one surface: source to hemisphere, and detector to source.

Rays of `simulate` start at the source and fall into bins; those of `observe` start at the
other end, or are asked of the facets, and come home by reciprocity. Cones and bins differ
in shape, but both are small against the lobe of the surface.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from pbrdf import GaussianSurface, HeightMap, Material, Scene, observe, simulate

GLASS = Material(1.5)
ALUMINIUM = Material(0.958, 6.69)
PAINT = Material(1.5, diffuse_albedo=0.6)
SURFACE = GaussianSurface(shape=(128, 128), spacing=1.0, corr_length=8.0, slope_rms=0.3)
THETA_I = np.deg2rad(41.0)
N_THETA, N_DPHI = 45, 90
# Bins in the plane of incidence and out of it, at the peak and on both wings
THETA_BIN = np.array([10, 15, 20, 20, 25, 27, 30])
DPHI_BIN = np.array([45, 40, 45, 35, 42, 50, 44])
SCAN = {
    "theta_s": (THETA_BIN + 0.5) * (np.pi / 2 / N_THETA),
    "dphi": DPHI_BIN * (2 * np.pi / N_DPHI),
}
CONES = {"source_half_angle": 0.02, "detector_half_angle": 0.02}


def scores(there, back):
    """Differences in standard errors, and where (bounces, geometry, 4, 4) to look."""
    value = there.brdf.values[:, 0][:, THETA_BIN, DPHI_BIN]
    error = there.brdf_stderr.values[:, 0][:, THETA_BIN, DPHI_BIN]
    # A polarised element far below M00 has skewed noise
    size = np.abs(value) + np.abs(back.brdf.values)
    seen = size > 0.02 * value[..., :1, :1]
    combined = np.hypot(error, back.brdf_stderr.values)[seen]
    return (back.brdf.values - value)[seen] / combined, seen


MATERIALS = {"glass": GLASS, "aluminium": ALUMINIUM, "paint": PAINT}


@pytest.fixture(scope="module")
def hemisphere():
    """Bins of `simulate` for each material, made once."""
    made = {}

    def bins(name):
        if name not in made:
            made[name] = simulate(
                Scene(SURFACE, MATERIALS[name]), THETA_I, n_rays=24_000, realizations=48,
                phi_i="uniform", seed=1, n_theta=N_THETA, n_dphi=N_DPHI,
            )  # fmt: skip
        return made[name]

    return bins


@pytest.mark.parametrize(
    ("name", "estimator", "start", "n_rays"),
    [
        pytest.param("glass", "facets", "detector", 12_000, marks=pytest.mark.slow),
        ("glass", "corners", "source", 12_000),
        ("aluminium", "facets", "source", 12_000),
        ("aluminium", "paths", "source", 12_000),
        ("aluminium", "count", "source", 12_000),
        pytest.param("paint", "paths", "detector", 4000, marks=pytest.mark.slow),
        ("paint", "corners", "source", 4000),
        ("paint", "count", "source", 12_000),
    ],
)
def test_both_ways_give_all_elements_by_bounces(hemisphere, name, estimator, start, n_rays):
    # With less noise a cone differs from its bin: by up to 0.2 % of M00, as the closed form
    seen = observe(
        Scene(SURFACE, MATERIALS[name]), THETA_I, **SCAN, **CONES, n_rays=n_rays,
        realizations=48, phi_i="uniform", seed=2, estimator=estimator, start=start,
        variance_reduction=False,
    )  # fmt: skip
    z, where = scores(hemisphere(name), seen)
    # Elements of one geometry are correlated. Of 10 seeds of 7 cases the largest was 3.6
    assert np.abs(z).max() < 4.5
    assert 0.5 < np.sqrt(np.mean(z**2)) < 1.5
    # Every class of bounces, and elements of every row and column
    assert (where.any(axis=1).sum(axis=(1, 2)) >= 9).all()
    assert where[:2, :, 0, 0].all()


def test_a_wrong_sign_is_seen(hemisphere):
    """Without the signs of reciprocity, or without its transpose, the test above fails."""
    scene = Scene(SURFACE, ALUMINIUM)
    seen = observe(
        scene, THETA_I, **SCAN, **CONES, n_rays=12_000, realizations=48, phi_i="uniform",
        seed=2, max_bounces=1,
    )  # fmt: skip
    signs = np.array([1.0, 1.0, -1.0, 1.0])
    unsigned = seen.copy(deep=True)
    unsigned.brdf.values *= signs[:, None] * signs
    z, _ = scores(hemisphere("aluminium"), unsigned)
    assert np.abs(z).max() > 20
    straight = seen.copy(deep=True)
    straight.brdf.values[:] = seen.brdf.values.swapaxes(-1, -2)
    z, _ = scores(hemisphere("aluminium"), straight)
    assert np.abs(z).max() > 20


@pytest.mark.parametrize("estimator", ["paths", "corners", "count"])
def test_either_end_may_start_the_rays(estimator):
    """An anisotropic surface under a source at an azimuth: only reciprocity links both."""
    surface = GaussianSurface(
        shape=(96, 96), spacing=1.0, corr_length=(6.0, 12.0), slope_rms=0.25
    )
    scene = Scene(surface, Material(1.5, diffuse_albedo=0.4))
    scan = {"theta_i": 0.6, "theta_s": np.array([0.5, 0.8]), "dphi": np.array([2.8, 3.5])}
    there, back = (
        observe(
            scene, **scan, phi_i=0.8, source_half_angle=0.05, detector_half_angle=0.04,
            n_rays=4000, realizations=48, seed=seed, start=start, estimator=estimator,
        )
        for seed, start in enumerate(["detector", "source"])
    )  # fmt: skip
    value = there.brdf_total.values
    error = np.hypot(there.brdf_total_stderr, back.brdf_total_stderr).values
    seen = np.abs(value) > 0.02 * value[:, :1, :1]
    z = (value - back.brdf_total.values)[seen] / error[seen]
    assert seen.any(axis=0).sum() >= 10
    assert np.abs(z).max() < 4.5
    assert np.sqrt(np.mean(z**2)) < 1.8


def test_workers_do_not_change_a_bit():
    scene = Scene(SURFACE, PAINT)
    one, two = (
        observe(
            scene, THETA_I, **SCAN, **CONES, n_rays=400, realizations=8, workers=workers
        )
        for workers in (1, 2)
    )
    assert_array_equal(one.brdf.values, two.brdf.values)
    assert_array_equal(one.brdf_stderr.values, two.brdf_stderr.values)


def test_wavelengths_and_labels_share_the_rays():
    """Two wavelengths at once are two runs; a map of equal labels is one material."""
    heights = SURFACE.sample(5).heights
    table = Material.from_table(
        wavelength=[0.5, 0.6], n=[1.5, 0.958], kappa=[0.0, 6.69], name="both"
    )
    labels = np.add.outer(np.arange(128), np.arange(128)) // 8 % 2
    options = {**SCAN, **CONES, "n_rays": 3200, "seed": 4}
    plain = HeightMap(heights, 1.0, periodic=True)
    striped = HeightMap(heights, 1.0, periodic=True, labels=labels)
    both = observe(
        Scene(striped, [table, table]), THETA_I, **options, wavelength=[0.5, 0.6]
    )
    for index, material in enumerate((GLASS, ALUMINIUM)):
        alone = observe(Scene(plain, material), THETA_I, **options)
        assert_allclose(
            both.brdf.isel(wavelength=index).values, alone.brdf.values,
            rtol=1e-9, atol=1e-12,
        )  # fmt: skip
