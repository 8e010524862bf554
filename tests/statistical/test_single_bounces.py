"""Single bounces without rays against the plain estimator, and runs towards an error."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import GaussianSurface, Material, Scene, simulate
from pbrdf.simulation.singles.ensemble import facet_ensemble
from pbrdf.simulation.singles.single_bounce import _averaged
from tests.statistical.estimators import hold_together

GOLD_LIKE = Material(0.958, 6.69)
# Facets are a sixth of the correlation length wide: what depends on the mesh is seen
SURFACE = GaussianSurface(shape=(72, 72), spacing=1.0, corr_length=6.0, slope_rms=0.4)
# A quarter of a turn makes another surface of this one, half a turn does not
UNEQUAL = GaussianSurface(
    shape=(96, 72), spacing=1.0, corr_length=(9.0, 5.0), slope_rms=0.4
)
BINS = {"n_theta": 6, "n_dphi": 8}


@pytest.mark.parametrize(
    ("surface", "phi_i"), [(SURFACE, 0.6), (SURFACE, "uniform"), (UNEQUAL, 0.2)]
)
def test_all_elements_of_all_bounces_agree_with_rays(surface, phi_i):
    scene, theta_i = Scene(surface, GOLD_LIKE), np.deg2rad([20.0, 65.0])
    reduced = simulate(
        scene, theta_i, phi_i=phi_i, n_rays=1000, realizations=64, seed=1, **BINS
    )
    plain = simulate(
        scene, theta_i, phi_i=phi_i, n_rays=1000, realizations=128, seed=2,
        variance_reduction=False, **BINS,
    )  # fmt: skip
    assert reduced.attrs["variance_reduction"] == "single bounces"
    assert plain.attrs["variance_reduction"] == "none"
    hold_together(reduced, plain, fewest=400, most_rms=1.25)


def test_single_bounces_have_less_noise():
    """Also on a tenth of the rays that the bins would need by themselves."""
    scene = Scene(SURFACE, Material(1.5))
    options = {"n_rays": 2000, "realizations": 16, "seed": 3, **BINS}
    reduced, plain = (
        simulate(scene, 0.7, variance_reduction=wanted, **options)
        for wanted in (True, False)
    )
    one = {"bounces": 0, "theta_i": 0, "stokes_out": 0, "stokes_in": 0}
    light = plain.brdf.isel(one).values
    bright = light > 0.1 * light.max()
    errors = [
        run.brdf_stderr.isel(one).values[bright] / light[bright] for run in (plain, reduced)
    ]
    assert np.mean(errors[0] ** 2) > 6 * np.mean(errors[1] ** 2)


def test_where_nothing_is_hidden_the_answer_is_an_integral():
    surface = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=8.0, slope_rms=0.04)
    scene = Scene(surface, Material.mirror())
    runs = [
        simulate(scene, 0.6, phi_i=0.4, n_rays=200, realizations=8, seed=seed, explain=True)
        for seed in (1, 2)
    ]
    for run in runs:
        assert_allclose(run.albedo.values.ravel(), [1.0, 0.0, 0.0], atol=1e-11)
        assert run.attrs["rel_error"] < 1e-12
        assert "no facet hides another" in " ".join(run.attrs["explanation"]).lower()
    assert_allclose(runs[0].brdf.values, runs[1].brdf.values, rtol=1e-12)
    # Against rays over the facets of a realisation or two
    plain = simulate(
        scene, 0.6, phi_i=0.4, n_rays=4000, realizations=64, variance_reduction=False
    )
    value = runs[0].brdf_total.values[0]
    error = plain.brdf_total_stderr.values[0]
    lit = plain.brdf_total.values[0][..., :1, :1] > 8 * error[..., :1, :1]
    lit = np.broadcast_to(lit, error.shape) & (error > 1e-9)
    z = (value - plain.brdf_total.values[0])[lit] / error[lit]
    assert z.size > 60
    assert np.abs(z).max() < 5


@pytest.mark.filterwarnings("ignore:The tangent plane errs")
@pytest.mark.parametrize("phi_i", [0.3, "uniform"])
def test_many_wavelengths_are_each_what_they_are_alone(phi_i):
    """Summed by bin; the rays and looks are those of one wavelength."""
    material = Material.from_table(wavelength=[0.4, 0.7], n=[1.4, 1.9], kappa=[0.0, 2.0])
    scene, wavelength = Scene(SURFACE, material), np.linspace(0.4, 0.7, 5)
    options = {"n_rays": 400, "realizations": 8, "seed": 3, "phi_i": phi_i, **BINS}
    together = simulate(scene, 0.9, wavelength=wavelength, **options)
    assert together.attrs["variance_reduction"] == "single bounces"
    for k in (0, 3):
        alone = simulate(scene, 0.9, wavelength=wavelength[k], **options)
        own = together.isel(wavelength=k)
        for name in ("brdf", "brdf_stderr", "brdf_total_stderr", "albedo", "absorbed"):
            most = np.abs(alone[name].values).max()
            assert_allclose(own[name], alone[name], rtol=0, atol=2e-8 * most)


def test_a_target_error_alone_is_planned_for_and_met():
    scene = Scene(SURFACE, Material(1.5))
    heard = []
    result = simulate(
        scene, 0.7, target_rel_error=0.1,
        progress=lambda done, most: heard.append((done, most)), **BINS,
    )  # fmt: skip
    assert result.attrs["rel_error"] <= 0.1
    assert "realisations, for 10 %" in result.attrs["plan"][0]
    assert result.attrs["realizations"] >= 16
    assert heard[-1][0] == heard[-1][1] == result.attrs["realizations"]
    again = simulate(scene, 0.7, target_rel_error=0.1, workers=1, **BINS)
    assert (again.brdf == result.brdf).all()
    with pytest.raises(ValueError, match="target_rel_error must lie in"):
        simulate(scene, 0.7, target_rel_error=2.0)


@pytest.mark.slow
def test_time_to_an_error_falls():
    """Paired on one machine: mean square of the error times the wall time."""
    import time

    surface = GaussianSurface(
        shape=(256, 256), spacing=1.0, corr_length=16.0, slope_rms=0.15
    )
    scene, theta_i = Scene(surface, Material(1.5)), np.deg2rad(41.4)
    cost = {}
    for wanted in (True, False, True, False):
        start = time.perf_counter()
        run = simulate(
            scene, theta_i, n_rays=15_000, realizations=32, n_theta=18, n_dphi=36,
            variance_reduction=wanted, stokes="unpolarized",
        )  # fmt: skip
        seconds = time.perf_counter() - start
        light = run.brdf_total.values.squeeze()
        bright = light > 0.1 * light.max()
        square = np.mean(
            (run.brdf_total_stderr.values.squeeze()[bright] / light[bright]) ** 2
        )
        # The second of each is free of compiling
        cost[wanted] = square * seconds
    assert cost[False] > 8 * cost[True]


def test_a_spread_source_is_the_mean_of_azimuths_all_around():
    """Over grooves, which tell a half circle from a quarter."""
    law = facet_ensemble(UNEQUAL).law
    what = law, (6, 8), (12, 16), (((1.5, 0.2),), 4)
    light, _ = _averaged.__wrapped__(0.9, None, *what)
    around = [
        _averaged.__wrapped__(0.9, phi_i, *what)[0]
        for phi_i in np.arange(64) * (2.0 * np.pi / 64)
    ]
    assert_allclose(light, np.mean(around, axis=0), rtol=0, atol=1e-9 * light.max())
    assert np.abs(around[0] - light).max() > 0.1 * light.max()
