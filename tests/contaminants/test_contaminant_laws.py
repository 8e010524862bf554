"""What must hold in any contaminated scene, whatever lies on the surface."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from pbrdf import (
    Drops,
    Film,
    GaussianSurface,
    HeightMap,
    Material,
    Scene,
    Spheres,
    simulate,
)
from pbrdf.contaminants.bodies import Bodies as Placed
from pbrdf.contaminants.bodies import Placement
from pbrdf.kernels import from_python
from pbrdf.kernels.bodies.bodies import Bodies, body_interval
from pbrdf.tracer.field import Field
from pbrdf.tracer.media import media_of
from pbrdf.tracer.wet_field import world_of
from tests.contaminants.scenes import assert_closed, clean_counters

body_interval = from_python(body_interval)

WATER, OIL, GLASS = Material(1.333), Material(1.47), Material(1.6)
PAINT = Material(1.5, diffuse_albedo=0.3)
DUST = Material(1.5, diffuse_albedo=0.4)
METAL = Material(0.2, 3.4)
ROUGH = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=8.0, slope_rms=0.25)
# Drops that overlap, steep ground, long waves: the warnings are right and not at issue here
pytestmark = pytest.mark.filterwarnings("ignore::pbrdf.errors.AccuracyWarning")


def crowd(*, opaque=True, water=WATER):
    """Bodies that overlap and stand out of each other, some opaque, and shallow oil."""
    bodies = [
        Spheres.at([[20.0, 22.0, 6.0], [50.0, 52.0, 5.0]], radius=5.0, material=OIL),
        Drops.at(
            [[22.0, 24.0], [40.0, 10.0]], volume=900.0, contact_angle=1.2, material=water
        ),
        Drops.at([[24.0, 18.0]], volume=300.0, contact_angle=2.4, material=water),
    ]
    if opaque:
        bodies += [
            Spheres.at([[44.0, 12.0, 8.0]], radius=4.0, material=DUST),
            Spheres.at([[8.0, 50.0]], radius=6.0, material=METAL),
        ]
    return [*bodies, Film(thickness=0.6, material=GLASS, level=True)]


def run(substrate, contaminants, theta_deg=(20.0, 70.0), **options):
    defaults = {"n_rays": 3000, "realizations": 8, "phi_i": "uniform", "seed": 5}
    scene = Scene(ROUGH, substrate, contaminants)
    return simulate(scene, np.deg2rad(theta_deg), **defaults | options)


def test_b16_b17_nothing_is_lost_in_a_lossless_crowd():
    result = run(Material.mirror(), crowd(opaque=False), n_rays=6000)
    clean_counters(result)
    assert assert_closed(result) < 1e-9
    assert result.absorbed.max() < 1e-12
    assert result.truncated.max() < 1e-3


def test_b16_b17_the_budget_closes_with_absorbers_and_dust():
    result = run(
        PAINT, crowd(water=Material(1.333, 2e-4)), n_rays=20_000, wavelength=20.0,
        stokes="unpolarized",
    )  # fmt: skip
    clean_counters(result)
    # Weak beams live or die by chance, at a thousandth of a ray: 1e-3 / sqrt(rays)
    assert assert_closed(result) < 5e-5
    assert (result.absorbed > 0.2).all()


@pytest.mark.slow
def test_b16_three_million_rays_never_lose_count_of_the_media():
    """One wrong in a million would be seen with a chance of 95 %."""
    rays = {"n_rays": 200_000, "realizations": 8, "stokes": "unpolarized"}
    result = run(PAINT, crowd(), **rays)
    assert sum(result.attrs["rays_escaped"]) > 3e6
    clean_counters(result)


@cache
def among_all():
    """All elements by one worker, which other runs are held against."""
    return run(PAINT, crowd(), n_rays=1600, workers=1)


def test_unpolarised_and_linear_output_are_parts_of_the_full():
    full = among_all()
    linear, plain = (
        run(PAINT, crowd(), n_rays=1600, workers=1, stokes=kind)
        for kind in ("linear", "unpolarized")
    )
    assert_array_equal(linear.brdf, full.brdf[..., :3, :3])
    assert_array_equal(plain.brdf, full.brdf[..., :1, :1])


def test_workers_do_not_change_a_bit():
    one, two = among_all(), run(PAINT, crowd(), n_rays=1600, workers=2)
    assert_array_equal(one.brdf, two.brdf)
    assert_array_equal(one.brdf_stderr, two.brdf_stderr)


def test_wavelengths_are_traced_each_for_itself():
    waves = np.array([0.4, 0.7])
    liquid = Material.from_table(wavelength=waves, n=[1.34, 1.32], kappa=[0.0, 2e-4])
    ground = Material.from_table(wavelength=waves, n=[1.6, 1.5])
    both = run(ground, crowd(water=liquid), wavelength=waves, n_theta=9, n_dphi=4)
    for k, wave in enumerate(waves):
        alone = run(
            Material(ground.index(wave)[0]), crowd(water=Material(*liquid.index(wave))),
            wavelength=float(wave), n_theta=9, n_dphi=4,
        )  # fmt: skip
        assert_allclose(both.brdf.isel(wavelength=k), alone.brdf, rtol=1e-12, atol=1e-15)


WET = Film(thickness=0.4, material=WATER)


@pytest.mark.parametrize("finite", [False, True])
@pytest.mark.parametrize("contaminants", [crowd()[:-1], [*crowd()[:-1], WET], WET])
def test_skips_change_nothing(finite, contaminants):
    """Rays let go by their slope, or by what lies ahead, would have met nothing."""
    surface = ROUGH.sample(4)
    if finite:
        surface = HeightMap(surface.heights, surface.spacing)
    scene = Scene(surface, PAINT, contaminants)
    swept, horizon, steep, off = (
        simulate(scene, np.deg2rad([10.0, 40.0]), n_rays=3200, skips=skips)
        for skips in (True, ("walk", "steep", "horizon"), ("walk", "steep"), ("walk",))
    )
    for one in (horizon, steep):
        assert_array_equal(one.brdf, off.brdf)
        assert_array_equal(one.side_exits, off.side_exits)
    clean_counters(swept)
    assert assert_closed(swept) < 2e-4
    # A pass along the line arrives within rounding of the walk; bodies magnify that, and
    # hardly a ray may change its bin or its fate by it
    assert_allclose(swept.albedo, off.albedo, rtol=1e-6)
    apart = abs(swept.brdf_total - off.brdf_total) > 1e-6 * off.brdf_total.max()
    assert apart[..., 0, 0].mean() < 1e-3


def test_a_ray_that_falls_more_slowly_than_the_ground_is_still_searched_for():
    """Over a long roof: what lies ahead falls away first, and rises behind the valley."""
    x = np.abs(np.arange(256.0) - 128.0)
    roof = HeightMap(np.repeat(0.5 * x[:, None], 64, axis=1), 1.0, periodic=True)
    high = Spheres.at([[128.0, 32.0, 120.0]], radius=4.0, material=WATER)
    scene = Scene(roof, PAINT, high)
    light, dark = (
        simulate(scene, np.deg2rad(75.0), phi_i=np.pi, n_rays=3200, skips=skips)
        for skips in (("walk", "steep", "horizon"), ("walk",))
    )
    assert_array_equal(light.brdf, dark.brdf)
    clean_counters(light)


def test_skips_are_explained():
    surface = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=8.0, slope_rms=0.2)
    said = [
        " ".join(
            simulate(
                Scene(surface, PAINT, WET), 0.3, n_rays=320, realizations=8, explain=True,
                skips=skips,
            ).attrs["explanation"]
        )
        for skips in (True, ("walk",))
    ]  # fmt: skip
    assert "steepest facet" in said[0]
    assert "all that lies ahead" in said[0]
    assert "one pass along each line" in said[0]
    assert "lies ahead" not in said[1]
    assert "one pass" not in said[1]


def mean_matrix(zeniths, target, seed):
    """Mean Mueller BRDF from a band of zenith angles into another, by azimuth."""
    result = run(
        PAINT, crowd(), np.rad2deg(zeniths), n_rays=2000, realizations=4, seed=seed,
        n_theta=9, n_dphi=6,
    )  # fmt: skip
    source = np.cos(result.theta_i) * np.sin(result.theta_i)
    over = result.brdf_total.weighted(source).mean("theta_i").isel(theta_s=target)
    return over.transpose("dphi", ...).values


@pytest.mark.slow
def test_reciprocity_among_bodies():
    steps = np.deg2rad((np.arange(4) + 0.5) / 4 * 10)
    there = [mean_matrix(np.deg2rad(10) + steps, 5, 2 * k) for k in range(24)]
    back = [mean_matrix(np.deg2rad(50) + steps, 1, 2 * k + 1) for k in range(24)]
    there, back = np.array(there), np.array(back)
    # dphi -> -dphi, transpose, P M P
    swap = np.diag([1.0, 1.0, -1.0, 1.0])
    back = swap @ np.roll(back[:, ::-1], 1, axis=1).swapaxes(-1, -2) @ swap
    difference = there.mean(axis=0) - back.mean(axis=0)
    stderr = np.sqrt((there.var(axis=0, ddof=1) + back.var(axis=0, ddof=1)) / 24)
    z = difference / stderr
    assert np.abs(z).max() < 5.5
    assert 0.4 < np.mean(z**2) < 1.9
    # Elements that the law moves and flips are well seen
    strength = np.abs(there.mean(axis=0) / stderr)
    assert strength[:, 1, 0].max() > 10
    assert strength[:, 2, 0].max() > 5


def world(bodies):
    """Bodies of one placement, as the kernels take them."""
    field = Field.of(HeightMap.flat(size=(10.0, 10.0)))
    made, _ = world_of(field, Placement(bodies, None, ()), media_of([OIL], [WATER], None))
    return made.bodies


def test_a_sphere_in_slices_is_met_where_the_sphere_is():
    radius, cuts = 2.0, np.linspace(-2.0, 2.0, 8)
    slices = [[a, b, radius**2, 0.0, -1.0] for a, b in pairwise(cuts)]

    def placed(slabs):
        one = np.array([5.0])
        return Placed(
            x=one, y=one, z=one, slab_start=np.array([0, len(slabs)]),
            slabs=np.array(slabs), radius=np.array([radius]), z_low=one - 2, z_high=one + 2,
            material=np.array([0]), materials=(WATER,),
        )  # fmt: skip

    sliced = world(placed(slices))
    whole = world(placed([[-radius, radius, radius**2, 0.0, -1.0]]))
    assert isinstance(sliced, Bodies)
    rng = np.random.default_rng(1)
    met = 0
    for _ in range(4000):
        start = rng.normal(size=3) * 2
        k = rng.normal(size=3) * [1, 1, rng.choice([0.0, 1e-6, 1.0])]
        k /= np.linalg.norm(k)
        expected = body_interval(whole, 0, *start, *k)
        found = body_interval(sliced, 0, *start, *k)
        if expected[0] > expected[1]:
            assert found[0] > found[1] or found[1] - found[0] < 1e-6
            continue
        met += 1
        assert_allclose(found, expected, atol=1e-9)
        # And where geometry puts it
        for t in expected:
            assert_allclose(np.linalg.norm(start + t * k), radius, atol=1e-9)
    assert met > 1000


def test_every_body_keeps_its_own_material():
    """From straight above a black sphere takes its shadow; one of air takes nothing."""
    bodies = [
        Spheres.at([[5.0, 5.0, 4.0]], radius=3.0, material=Material(1.0)),
        Spheres.at([[14.0, 14.0, 4.0]], radius=2.0, material=Material.black()),
    ]
    scene = Scene(HeightMap.flat(size=(20.0, 20.0)), Material.mirror(), bodies)
    result = simulate(scene, 0.0, n_rays=64_000)
    assert_allclose(float(result.absorbed.squeeze()), np.pi * 2.0**2 / 400.0, atol=1e-3)
    assert_allclose(float(result.albedo.sum()), 1.0 - np.pi * 2.0**2 / 400.0, atol=1e-3)
