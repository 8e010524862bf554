"""Single bounces beside drops and spheres, corrected by the clean surface, against rays."""

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

from pbrdf import Drops, Film, GaussianSurface, Material, Scene, Spheres, simulate
from pbrdf.simulation import simulate_parts
from pbrdf.simulation.pilot import BODY_TIME, _times
from tests.statistical.estimators import hold_together

GLASS, WATER = Material(1.5), Material(1.333)
SURFACE = GaussianSurface(shape=(72, 72), spacing=1.0, corr_length=6.0, slope_rms=0.2)
SMOOTH = GaussianSurface(shape=(96, 96), spacing=1.0, corr_length=8.0, slope_rms=0.05)
# They throw long shadows, and are laid sooner than drops
SPHERES = Spheres(radius=6.0, coverage=0.12, material=WATER)
DROPS = Drops(contact_angle=1.2, coverage=0.2, number_density=6e-4, material=WATER)
BINS = {"n_theta": 6, "n_dphi": 8}
REDUCED = "single bounces beside bodies"


def mirror_errors(run, theta_i):
    """Stated errors of M00 relative to it, about the mirror direction."""
    one = {"theta_i": 0, "stokes_out": 0, "stokes_in": 0}
    near = np.abs(run.theta_s - theta_i) < 0.15
    near = (near & (np.abs(run.dphi - np.pi) < 0.3)).values
    light = run.brdf_total.isel(one).values[near]
    return run.brdf_total_stderr.isel(one).values[near] / light


@pytest.mark.parametrize(
    ("phi_i", "wet"),
    [
        pytest.param(0.6, SPHERES, id="spheres-0.6"),
        pytest.param("uniform", DROPS, id="drops-uniform"),
        pytest.param("uniform", SPHERES, id="spheres-uniform", marks=pytest.mark.slow),
        pytest.param(0.6, DROPS, id="drops-0.6", marks=pytest.mark.slow),
    ],
)
def test_all_elements_of_all_bounces_agree_with_rays(phi_i, wet):
    scene, theta_i = Scene(SURFACE, GLASS, wet), np.deg2rad([20.0, 50.0])
    # More realisations of the plain estimator, from other seeds
    reduced, plain = (
        simulate(
            scene, theta_i, phi_i=phi_i, n_rays=1500, realizations=number, seed=seed,
            variance_reduction=wanted, **BINS,
        )
        for number, seed, wanted in ((64, 1, True), (128, 2, False))
    )  # fmt: skip
    assert reduced.attrs["variance_reduction"] == REDUCED
    assert plain.attrs["variance_reduction"] == "none"
    hold_together(reduced, plain, fewest=150, most_rms=1.3)
    budget = reduced.albedo.sum("bounces") + reduced.absorbed
    budget += reduced.truncated + reduced.leaked
    # Chance decides on the weakest parts of split rays
    assert_allclose(budget, 1.0, atol=1e-4)


@pytest.mark.parametrize("wet", [SPHERES, DROPS], ids=["spheres", "drops"])
def test_there_is_less_noise_about_the_mirror_direction(wet):
    plain, reduced = (
        simulate(
            Scene(SMOOTH, GLASS, wet), 0.7, n_rays=4000, realizations=16, seed=3,
            variance_reduction=wanted, explain=True, n_theta=18, n_dphi=24,
        )
        for wanted in (False, True)
    )  # fmt: skip
    squares = [np.mean(mirror_errors(run, 0.7) ** 2) for run in (plain, reduced)]
    assert squares[0] > 4 * squares[1]
    told = ["noise of the slopes" in " ".join(run.explanation) for run in (plain, reduced)]
    assert told == [False, True]
    # The rays are the same: what takes more than one bounce is the same to the bit
    assert (plain.brdf[1:] == reduced.brdf[1:]).all()


@pytest.mark.filterwarnings("ignore::pbrdf.errors.AccuracyWarning")
def test_each_wavelength_is_corrected_as_it_is_alone():
    material = Material.from_table(wavelength=[0.4, 0.7], n=[1.4, 1.9], kappa=[0.0, 2.0])
    scene, wavelength = Scene(SMOOTH, material, SPHERES), np.linspace(0.4, 0.7, 5)
    options = {"n_rays": 1500, "realizations": 8, "seed": 4, **BINS}
    together = simulate(scene, 0.7, wavelength=wavelength, **options)
    assert together.attrs["variance_reduction"] == REDUCED
    for k in (0, 4):
        alone = simulate(scene, 0.7, wavelength=wavelength[k], **options)
        for name in ("brdf", "brdf_stderr"):
            # What is split at further bounces draws its own numbers
            own, other = together[name].isel(wavelength=k)[0], alone[name][0]
            assert_allclose(own, other, rtol=0, atol=1e-12 * float(np.abs(other).max()))


def test_a_plan_knows_of_the_bodies_that_are_laid():
    pilot = xr.Dataset(attrs={"contaminants": [str({"kind": "drops", "number": 3})]})
    wet, ray = _times(Scene(SMOOTH, GLASS, DROPS), pilot)
    dry, clean_ray = _times(Scene(SMOOTH, GLASS), xr.Dataset(attrs={"contaminants": []}))
    assert wet - dry == 3 * BODY_TIME
    assert ray > clean_ray


@pytest.mark.slow
def test_the_correction_is_nothing_in_the_mean():
    """Of many seeds, bin by bin: what is added to the very same rays."""
    scene = Scene(SURFACE, GLASS, SPHERES)
    added = []
    for seed in range(24):
        plain, reduced = (
            simulate(
                scene, 0.7, n_rays=1000, realizations=16, seed=seed, stokes="unpolarized",
                variance_reduction=wanted, **BINS,
            ).brdf_total.values.squeeze()
            for wanted in (False, True)
        )  # fmt: skip
        added.append(reduced - plain)
    mean, spread = np.mean(added, axis=0), np.std(added, axis=0, ddof=1)
    touched = spread > 0.0
    assert touched.sum() > 15
    z = mean[touched] / spread[touched] * np.sqrt(len(added))
    # Student's t of 23 degrees of freedom in 48 bins: 5 has a chance of 2e-3
    assert np.abs(z).max() < 5.0
    assert np.mean(z**2) < 2.0


@pytest.mark.parametrize(
    ("substrate", "wet"),
    [
        (Material.mirror(), SPHERES),
        (GLASS, [SPHERES, Film(thickness=0.3, material=WATER)]),
        (GLASS, Spheres(radius=4.0, coverage=0.45, material=WATER)),
    ],
    ids=["mirror", "film", "hidden"],
)
def test_where_nothing_is_gained_rays_do_all(substrate, wet):
    """A mirror keeps all its light; a film covers all facets, and dense spheres most."""
    runs = [
        simulate(
            Scene(SURFACE, substrate, wet), 0.7, n_rays=2000, realizations=8,
            variance_reduction=wanted, **BINS,
        )
        for wanted in (False, True)
    ]  # fmt: skip
    assert [run.attrs["variance_reduction"] for run in runs] == ["none", "none"]
    assert (runs[0].brdf == runs[1].brdf).all()


def test_azimuths_workers_and_parts_do_not_change_a_bit():
    scene, theta_i = Scene(SURFACE, GLASS, SPHERES), [0.3, 0.7]
    options = {"n_rays": 1500, "realizations": 8, "seed": 4, **BINS}
    both = simulate(scene, theta_i, phi_i=[0.2, 1.1], workers=2, **options)
    alone = simulate(scene, theta_i, phi_i=1.1, workers=1, **options)
    assert alone.attrs["variance_reduction"] == REDUCED
    assert (both.brdf.isel(phi_i=1) == alone.brdf).all()
    parts = list(simulate_parts(scene, theta_i, phi_i=1.1, at_once=1, **options))
    for k, part in enumerate(parts):
        assert (part.brdf[:, 0] == alone.brdf[:, k]).all()
        assert (part.brdf_stderr[:, 0] == alone.brdf_stderr[:, k]).all()
