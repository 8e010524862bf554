"""Drops and spheres that absorb: by order of the light, and without a jump in kappa."""

import cmath
import math

import numpy as np
import pytest

from pbrdf import (
    AccuracyWarning,
    Drops,
    Film,
    GaussianSurface,
    HeightMap,
    Material,
    MicrofacetModel,
    Scene,
    Spheres,
    simulate,
)
from pbrdf.analytic.hemisphere import reflectance
from tests.contaminants.scenes import assert_within, clean_counters
from tests.slab_reference import amplitudes
from tests.sphere_reference import orders_of_a_sphere

# Some of these bodies are smaller than the light, which warns
pytestmark = pytest.mark.filterwarnings("ignore::pbrdf.errors.AccuracyWarning")

# One sphere on a finite black plane has no neighbours; the guard rim is an eighth of a side
PLANE = HeightMap(np.zeros((33, 33)), 1.0 / 32)
RADIUS = 0.3


@pytest.mark.parametrize("depth", [0.3, 2.0])
@pytest.mark.parametrize("kappa", [2e-3, 0.03, 0.4])
def test_absorbing_sphere_by_order(kappa, depth):
    # Of such a size that the diameter has this optical depth
    wavelength = 8 * math.pi * kappa * RADIUS / depth
    index = 1.45 + 1j * kappa
    sphere = Spheres.at([[0.5, 0.5, RADIUS]], radius=RADIUS, material=Material(1.45, kappa))
    scene = Scene(PLANE, Material.black(), sphere)
    options = {"wavelength": wavelength, "n_rays": 40_000, "n_theta": 9, "n_dphi": 2}
    result = simulate(scene, 0.0, **options)
    lit = math.pi * RADIUS**2 / 0.75**2
    upwards, cut = orders_of_a_sphere(index, RADIUS, wavelength)
    albedo, stderr = (
        result.albedo.values[:, 0] / lit,
        result.albedo_stderr.values[:, 0] / lit,
    )
    # The sum over impacts is coarse where a direction turns over the horizon
    assert_within(albedo, stderr, upwards, limit=4.0, extra=5e-5)
    lost = result.absorbed + result.truncated + result.left_sideways + result.leaked
    error = np.hypot(stderr[0], stderr[2]) * lit
    assert_within(result.albedo.values.sum() + lost.values, error, 1.0, limit=3.0)
    clean_counters(result)
    short = simulate(scene, 0.0, max_bounces=2, **options)
    assert_within(short.truncated.values / lit, stderr.sum(), cut, limit=4.0, extra=5e-5)


def cap(angle, radius):
    """Volume of a spherical cap of some contact angle and radius of curvature."""
    return math.pi * radius**3 / 3 * (2 + math.cos(angle)) * (1 - math.cos(angle)) ** 2


FLAT = HeightMap.flat(size=(100.0, 100.0))
SHALLOW = math.radians(15.0)
CASES = {
    "film": lambda m: Film(thickness=3.0, material=m),
    "cap": lambda m: Drops.at(
        [[50.0, 50.0]], volume=cap(SHALLOW, 150.0), contact_angle=SHALLOW, material=m
    ),
    "hemisphere": lambda m: Drops.at(
        [[50.0, 50.0]], volume=cap(math.pi / 2, 45.0), contact_angle=math.pi / 2,
        material=m,
    ),
    "sphere": lambda m: Spheres.at([[50.0, 50.0]], radius=45.0, material=m),
}  # fmt: skip


def swept(make, kappas, n_rays):
    """Reflectance on a mirror against kappa, with errors, all of one seed."""
    found = []
    for kappa in kappas:
        result = simulate(
            Scene(FLAT, Material.mirror(), make(Material(1.333, kappa))), 0.5,
            wavelength=1.0, n_rays=n_rays, stokes="unpolarized", seed=3,
        )  # fmt: skip
        found.append((result.albedo.sum(), np.sqrt((result.albedo_stderr**2).sum())))
    return np.array(found).T


def assert_no_step(albedo, stderr, limit=5.0):
    """No step beyond its neighbours' by more than errors allow."""
    steps = np.abs(np.diff(albedo))
    around = np.maximum(np.r_[0.0, steps[:-1]], np.r_[steps[1:], 0.0])
    allowed = 2.5 * around + limit * np.hypot(stderr[1:], stderr[:-1]) + 1e-9
    worst = int(np.argmax(steps - allowed))
    assert (steps <= allowed).all(), (worst, albedo[worst : worst + 2])


@pytest.mark.parametrize("name", CASES)
def test_no_jump_at_the_old_threshold(name):
    albedo, stderr = swept(CASES[name], [0.0097, 0.0099, 0.0101, 0.0103], 20_000)
    assert_no_step(albedo, stderr)
    assert albedo.max() - albedo.min() < 0.03


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_no_jump_over_six_decades_of_kappa(name):
    albedo, stderr = swept(CASES[name], np.geomspace(1e-5, 10.0, 60), 20_000)
    assert_no_step(albedo, stderr)
    assert albedo[0] > 0.95


def test_cap_of_the_issue():
    """Of 15 degrees and 5 um height: light passes, where all of kappa 0.01 was opaque."""
    albedo, _ = swept(CASES["cap"], [0.0099, 0.0101], 20_000)
    assert ((albedo > 0.76) & (albedo < 0.79)).all()


def test_flat_drops_without_a_wavelength_are_warned_of():
    """A cap of 15 degrees and kappa 0.05 lets light through; a hemisphere does not."""

    def run(angle, **options):
        drop = Drops.at(
            [[50.0, 50.0]], volume=9e3, contact_angle=angle, material=Material(1.333, 0.05)
        )
        return simulate(Scene(FLAT, Material.mirror(), drop), 0.5, n_rays=320, **options)

    with pytest.warns(AccuracyWarning, match=r"15 deg and kappa 0.05 are taken as opaque"):
        flat = run(np.deg2rad(15.0))
    assert any("Pass wavelength" in note for note in flat.attrs["warnings"])
    assert run(np.deg2rad(85.0)).attrs["warnings"] == []
    known = run(np.deg2rad(15.0), wavelength=1.0)
    assert not any("Pass wavelength" in note for note in known.attrs["warnings"])
    assert known.albedo.sum() > flat.albedo.sum() + 0.01


# Fresnel, unpolarised, from the constants of the library
@pytest.mark.parametrize("wavelength", [3.8, 8.0, 10.0, 12.0])
@pytest.mark.parametrize("deep", [False, True])
def test_emissivity_of_flat_water(wavelength, deep):
    from pbrdf import materials

    water = materials.get("water")
    scene = Scene(FLAT, water)
    if deep:
        scene = Scene(FLAT, Material(1.5), Film(thickness=3000.0, material=water))
    for theta in (0.3, 1.2):
        result = simulate(scene, theta, wavelength=wavelength, n_rays=3200)
        (r_s, r_p), _ = amplitudes(math.sin(theta), 1.0, complex(*water.index(wavelength)))
        expected = (abs(r_s) ** 2 + abs(r_p) ** 2) / 2
        assert_within(
            result.absorbed.values,
            result.albedo_stderr.values.max(),
            1 - expected,
            limit=4.0,
            floor=1e-9,
        )


@pytest.mark.parametrize("wavelength", [3.8, 8.0, 10.0, 12.0])
def test_emissivity_of_rough_water(wavelength):
    sea = GaussianSurface(shape=(128, 128), spacing=4.0, corr_length=60.0, slope_rms=0.15)
    result = simulate(
        Scene(sea, "water"), 0.6, wavelength=wavelength, n_rays=4000, realizations=16,
        stokes="unpolarized", phi_i="uniform",
    )  # fmt: skip
    model = MicrofacetModel("water", 0.15, shadowing="smith-correlated")
    expected = reflectance(model, 0.6, wavelength, rel_error=1e-4).value
    single = result.albedo.sel(bounces="1").item()
    assert abs(single / expected - 1) < 0.02
    budget = result.absorbed + result.albedo.sum() + result.truncated
    assert_within(budget.values, 0.0, 1.0, floor=1e-9)


def test_a_beam_inside_an_absorber_finds_snell_and_its_decay():
    """The prism: into an absorber, on to another side, out; by complex wave vectors."""
    index, tilt = 1.5 + 0.3j, 0.2
    k = math.sin(0.7)
    q = cmath.sqrt(index**2 - k * k)
    turned = math.atan2(k, q.real)
    # The phase's index and Snell's law of real angles
    assert math.isclose(math.hypot(k, q.real) * math.sin(turned), k, rel_tol=1e-12)
    from pbrdf.kernels.optics.absorbing import interface_elements

    a, b, _, _, a_t, b_t, _, _, ratio = interface_elements(
        math.cos(0.7), 1.0, 1.0, 0.0, 1.5, 0.3
    )
    assert math.isclose(ratio, math.hypot(k, q.real), rel_tol=1e-12)
    assert math.isclose(a + a_t, 1.0, rel_tol=1e-12)
    assert math.isclose(b, -b_t, rel_tol=1e-9)
    # Back out through a side that leans: the angle inside is no longer that of the entry
    (r_s, r_p), _ = amplitudes(ratio * math.sin(turned + tilt), index, 1.0)
    out = interface_elements(math.cos(turned + tilt), ratio, 1.5, 0.3, 1.0, 0.0)
    assert math.isclose(out[0] + out[1], abs(r_s) ** 2, rel_tol=1e-9)
    assert math.isclose(out[0] - out[1], abs(r_p) ** 2, rel_tol=1e-9)
    cross = r_s * r_p.conjugate()
    assert math.isclose(out[2], cross.real, rel_tol=1e-9)
    assert math.isclose(out[3], cross.imag, rel_tol=1e-9)
