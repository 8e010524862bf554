"""Films that absorb, on all kinds of base, against closed forms that share no code."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import (
    Drops,
    Film,
    GaussianSurface,
    HeightMap,
    Material,
    Scene,
    materials,
    simulate,
)
from tests.contaminants.scenes import assert_within, clean_counters, whole
from tests.slab_reference import slab, slab_on_lambertian

# Films thinner than the coherence length warn, which is tested elsewhere
pytestmark = pytest.mark.filterwarnings("ignore::pbrdf.errors.AccuracyWarning")
FLAT = HeightMap.flat(size=(1.0, 1.0))
ROUGH = GaussianSurface(shape=(64, 64), spacing=2.0, corr_length=16.0, slope_rms=0.1)
BASES = {
    "mirror": (Material.mirror(), np.inf),
    "glass": (Material(1.62), 1.62),
    "aluminium": (Material(0.95, 6.4), 0.95 + 6.4j),
    "absorbing glass": (Material(1.5, 0.2), 1.5 + 0.2j),
}
# kappa and thickness [um]; 0.0099 and 0.0101 lie on both sides of an old threshold
FILMS = (
    (0.0, 7.0), (1e-5, 300.0), (3e-3, 2.0), (0.0099, 1.3), (0.0101, 1.3), (0.07, 0.4),
    (0.5, 0.03), (2.0, 0.01), (10.0, 0.01), (10.0, 1000.0),
)  # fmt: skip


def run(substrate, film, theta, wavelength=0.53, **options):
    """Whole Mueller matrix of a flat film, its error, and the result."""
    settings = {"n_rays": 3200, "n_theta": 9, "n_dphi": 4, "phi_i": 0.3, "seed": 5}
    result = simulate(
        Scene(FLAT, substrate, film), theta, wavelength=wavelength, **(settings | options)
    )
    squares = (result.brdf_total_stderr * result.projected_solid_angle) ** 2
    stderr = np.sqrt(squares.isel(theta_i=0).sum(("theta_s", "dphi")).values)
    budget = result.albedo.sum("bounces") + result.absorbed + result.truncated
    assert_within(budget.values, stderr[0, 0], 1.0, limit=3.0, floor=1e-9)
    clean_counters(result)
    return whole(result), stderr, result


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("theta", [0.0, 0.7, 1.25])
def test_film_on_a_smooth_base(base, theta):
    substrate, index = BASES[base]
    for kappa, thickness in FILMS:
        film = Film(thickness=thickness, material=Material(1.333, kappa))
        mean, stderr, _ = run(substrate, film, theta)
        expected = slab(theta, 1.333 + 1j * kappa, index, thickness, 0.53)
        assert_within(mean, stderr, expected, limit=4.0, floor=1e-9)


@pytest.mark.parametrize(("n_film", "n_base"), [(1.333, 1.333), (1.4, 1.0), (1.3, 1.7)])
@pytest.mark.parametrize("theta", [0.15, 1.0])
def test_film_on_a_lambertian_base(n_film, n_base, theta):
    for kappa, thickness in (
        (0.0, 1.0),
        (2e-3, 5.0),
        (0.05, 0.5),
        (0.4, 0.05),
        (10.0, 0.01),
    ):
        film = Film(thickness=thickness, material=Material(n_film, kappa))
        mean, stderr, _ = run(
            Material(n_base, diffuse_albedo=0.7), film, theta, n_rays=8000
        )
        expected = slab_on_lambertian(
            theta, n_film + 1j * kappa, n_base, 0.7, thickness, 0.53
        )
        assert_within(mean, stderr, expected, limit=4.0, floor=1e-8)


def test_a_weak_absorber_on_a_lambertian_base_joins_the_clear_film():
    base = Material(1.7, diffuse_albedo=0.7)
    clear, stderr, _ = run(base, Film(thickness=2.0, material=Material(1.3)), 0.6)
    weak, other, _ = run(base, Film(thickness=2.0, material=Material(1.3, 1e-9)), 0.6)
    assert_within(weak, np.hypot(stderr, other), clear, limit=4.0, floor=1e-7)


def test_a_thick_film_of_metal_is_that_metal():
    gold = materials.get("gold")
    for level in (False, True):
        film = Film(thickness=1.0, material=gold, level=level)
        mean, _, _ = run(Material(1.5), film, 0.7, wavelength=0.65)
        bare = simulate(
            Scene(FLAT, gold), 0.7, wavelength=0.65, n_rays=3200, n_theta=9, n_dphi=4,
            phi_i=0.3,
        )  # fmt: skip
        assert_allclose(mean, whole(bare), atol=1e-9)


def test_films_that_nothing_crosses():
    kinds = {Material.mirror(): 1.0, Material.black(): 0.0}
    for material, albedo in kinds.items():
        mean, _, _ = run(Material(1.5), Film(thickness=0.3, material=material), 0.4)
        assert_allclose(mean[0, 0], albedo, atol=1e-12)
    paint = Material(1.5, diffuse_albedo=0.6)
    mean, stderr, _ = run(Material.black(), Film(thickness=0.3, material=paint), 0.4)
    bare = simulate(Scene(FLAT, paint), 0.4, n_rays=20_000, n_theta=9, n_dphi=4, phi_i=0.3)
    assert_within(mean[0, 0], stderr[0, 0], whole(bare)[0, 0], floor=1e-3)
    both = Film(thickness=1.0, material=Material(1.5, 0.1, diffuse_albedo=0.6))
    with pytest.raises(ValueError, match="kappa must be 0 over a diffuse base"):
        simulate(Scene(FLAT, Material(1.5), both), 0.4, wavelength=0.5)


def test_a_material_is_what_its_constants_say_and_not_its_name():
    air = Film(thickness=0.3, material=Material(1.0, name="black"))
    mean, _, _ = run(Material(1.5), air, 0.4)
    assert mean[0, 0] > 0.03
    with pytest.raises(ValueError, match="absorbs_all must stand with n = 1"):
        Material(1.5, absorbs_all=True)


@pytest.mark.parametrize("skipped", [0.9, 3.0])
def test_what_cannot_come_out_again_need_not_be_followed(skipped):
    """The skip and the full search agree; both parts are strong, so no chance is in it."""
    film = Film(thickness=4.0, material=Material(1.4, skipped))
    scene = Scene(ROUGH.sample(3), Material(1.5), film)
    options = {"n_rays": 3200, "phi_i": 0.2, "seed": 2, "wavelength": 0.5, "n_theta": 9}
    every = ("walk", "sweep", "steep", "horizon")
    with_skip = simulate(scene, [0.2, 0.9], skips=(*every, "deep"), explain=True, **options)
    without = simulate(scene, [0.2, 0.9], skips=every, **options)
    assert with_skip.attrs["path_segments"] < without.attrs["path_segments"]
    assert_allclose(with_skip.brdf, without.brdf, atol=1e-12)
    assert any("optical depth" in line for line in with_skip.attrs["explanation"])


@pytest.mark.parametrize("wavelength", [1.94, 2.7, 2.95, 3.8, 6.1, 8.0, 10.0, 12.0])
def test_water_on_a_mirror_at_infrared_wavelengths(wavelength):
    water = materials.get("water")
    n, kappa = water.index(wavelength)
    for thickness in (1.0, 500.0):
        mean, stderr, _ = run(
            Material.mirror(), Film(thickness=thickness), 0.5, wavelength=wavelength
        )
        expected = slab(0.5, complex(n, kappa), np.inf, thickness, wavelength)
        assert_within(mean, stderr, expected, limit=4.0, floor=1e-9)


def test_drops_that_spread_are_a_film():
    steep = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=8.0, slope_rms=0.3)
    options = {"n_rays": 2000, "realizations": 8, "wavelength": 2.95, "phi_i": "uniform"}
    drops = Drops(
        contact_angle=np.deg2rad(10.0), volume_per_area=2.0, number_density=1e-3,
        roughness="wenzel",
    )  # fmt: skip
    spread = simulate(Scene(steep, Material.mirror(), drops), 0.5, **options)
    film = Film(thickness=2.0)
    covered = simulate(Scene(steep, Material.mirror(), film), 0.5, **options)
    assert spread.albedo.sum() < 0.2
    assert_within(
        spread.albedo.sum(), spread.albedo_stderr.sum(), covered.albedo.sum(), floor=1e-9
    )
