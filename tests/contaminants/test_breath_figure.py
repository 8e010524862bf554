"""Dew that grows and merges, and drops thrown at random."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from pbrdf import Drops, GaussianSurface, HeightMap, Material, Spheres
from pbrdf.contaminants import place
from pbrdf.contaminants.condensation import (
    breath_figure,
    coalesce,
    contact_distance,
    touching,
)
from pbrdf.contaminants.shapes import cap_radius

SEED = np.random.SeedSequence(12)
FLAT = HeightMap.flat(size=(400.0, 300.0))
ROUGH = GaussianSurface(
    shape=(128, 128), spacing=1.5, corr_length=15.0, slope_rms=0.08
).sample(4)
WATER = Material(1.333)


def gaps(axes, radii, period, contact):
    """Distance of every pair less that of contact, by all images."""
    off = axes[:, None] - axes[None]
    off -= np.asarray(period) * np.round(off / np.asarray(period))
    distance = np.hypot(*np.moveaxis(off, -1, 0))
    gap = distance - contact(radii[:, None], radii[None])
    return gap[np.triu_indices(len(radii), 1)]


@pytest.mark.parametrize("degrees", [40.0, 90.0, 150.0])
def test_two_equal_drops_that_touch_become_one(degrees):
    angle = np.deg2rad(degrees)
    radius = float(cap_radius(8.0, angle))
    reach = 2 * radius * (np.sin(angle) if degrees < 90 else 1.0)
    # Across the corner of the period
    apart = np.array([[0.3 * reach, 0.2], [100.0 - 0.69 * reach, 0.2]])
    axes, volumes = coalesce(apart, np.array([8.0, 8.0]), (100.0, 80.0), angle)
    assert_allclose(volumes, [16.0])
    assert_allclose(cap_radius(volumes, angle) / radius, 2 ** (1 / 3), rtol=1e-12)
    # Area of the new base over the sum of the old
    assert_allclose((cap_radius(volumes, angle) / radius) ** 2 / 2, 0.793701, atol=1e-6)
    assert_allclose((axes[0, 0] + 50) % 100, 50 - 0.195 * reach, rtol=1e-12)
    far = np.array([[0.31 * reach, 0.2], [100.0 - 0.7 * reach, 0.2]])
    _, two = coalesce(far, np.array([8.0, 8.0]), (100.0, 80.0), angle)
    assert_allclose(two, [8.0, 8.0])


def test_a_merged_drop_may_touch_a_third():
    # Hemispheres of radius 1, 1 and 0.5; the merged one has 1.26 and its axis in between
    volumes = 2 / 3 * np.pi * np.array([1.0, 1.0, 0.125])
    axes = np.array([[10.0, 10.0], [11.9, 10.0], [10.95, 11.74]])
    assert (np.hypot(*(axes[2] - axes[:2]).T) > 1.5).all()
    found, merged = coalesce(axes, volumes, (50.0, 50.0), np.pi / 2)
    assert_allclose(merged, [volumes.sum()], rtol=1e-12)
    assert_allclose(found[0], volumes @ axes / volumes.sum(), rtol=1e-12)


def test_spheres_on_a_plane_touch_by_the_distance_of_their_centres():
    # Two spheres of 180 degrees: d² = 4 R1 R2; hemispheres and below touch with their bases
    assert_allclose(contact_distance(4.0, 1.0, np.pi), 4.0)
    assert_allclose(contact_distance(4.0, 1.0, np.pi / 2), 5.0)
    assert_allclose(contact_distance(4.0, 1.0, np.pi / 6), 2.5)


@settings(max_examples=25, deadline=None)
@given(
    st.integers(1, 120), st.floats(5.0, 178.0), st.floats(0.01, 3.0), st.integers(0, 99)
)  # fmt: skip
def test_growth_conserves_volume_and_leaves_no_contact(number, degrees, thickness, seed):
    period = (400.0, 300.0)
    nuclei = np.random.default_rng(seed).random((number, 2)) * period
    angle, volume = np.deg2rad(degrees), thickness * 120_000.0
    axes, volumes = breath_figure(
        nuclei=nuclei, period=period, contact_angle=angle, volume=volume
    )
    assert_allclose(volumes.sum(), volume, rtol=1e-12)
    radii = cap_radius(volumes, angle)
    if len(radii) > 1:
        gap = gaps(axes, radii, period, lambda a, b: contact_distance(a, b, angle))
        assert gap.min() >= -1e-9 * radii.max()
    assert len(touching(axes, radii, period, angle)) == 0


def test_coverage_of_a_breath_figure_stays_the_same_while_it_coarsens():
    # Beysens & Knobler: in the regime of coalescence about 0.55 for hemispheres
    covered, number = [], []
    for thickness in (6.0, 12.0):
        _, volumes = breath_figure(
            nuclei=np.random.default_rng(3).random((700, 2)) * FLAT.size,
            period=FLAT.size,
            contact_angle=np.pi / 2,
            volume=thickness * 120_000.0,
        )
        number.append(len(volumes))
        covered.append(np.pi * np.sum(cap_radius(volumes, np.pi / 2) ** 2) / 120_000.0)
    assert number[1] < 0.5 * number[0]
    assert_allclose(covered, 0.55, atol=0.09)


@pytest.mark.parametrize("degrees", [30.0, 90.0, 165.0])
def test_a_breath_figure_on_a_rough_surface_holds_its_volume(degrees):
    dew = Drops(contact_angle=np.deg2rad(degrees), volume_per_area=0.8, material=WATER,
                number_density=0.01, sizes="breath-figure", roughness="ignore")  # fmt: skip
    placement = place([dew], ROUGH, SEED)
    report = placement.reports[0]
    assert_allclose(report["volume_placed"], 0.8 * 192.0**2, rtol=1e-9)
    # What is above the surface does not overlap, so the volumes add
    assert report["notes"] == ()


@pytest.mark.parametrize("sizes", ["equal", "lognormal"])
@pytest.mark.parametrize("degrees", [25.0, 90.0, 170.0])
def test_thrown_drops_hold_what_was_asked_and_do_not_overlap(sizes, degrees):
    def throw(surface, **amount):
        water = Drops(contact_angle=np.deg2rad(degrees), material=WATER, sizes=sizes,
                      width=0.3, roughness="ignore", **amount)  # fmt: skip
        return place([water], surface, SEED)

    placement = throw(ROUGH, volume_per_area=0.1, number_density=1e-3)
    report = placement.reports[0]
    assert report["number"] == round(1e-3 * 192.0**2)
    assert_allclose(report["volume_placed"], 0.1 * 192.0**2, rtol=1e-9)
    assert report["notes"] == ()
    flat = throw(FLAT, coverage=0.2, number_density=1e-3)
    assert_allclose(flat.reports[0]["coverage_projected"], 0.2, rtol=1e-9)
    axes = np.column_stack([flat.bodies.x, flat.bodies.y])
    assert gaps(axes, flat.bodies.radius, FLAT.size, np.add).min() > 0
    third = throw(FLAT, coverage=0.2, volume_per_area=0.4)
    assert_allclose(third.reports[0]["volume_placed"], 0.4 * 120_000, rtol=1e-9)
    assert_allclose(third.reports[0]["coverage_projected"], 0.2, rtol=0.2)


def test_lognormal_radii_have_the_width_asked():
    many = Spheres(radius=2.0, number_density=0.005, material="bk7", sizes="lognormal",
                   width=0.35, seed=4)  # fmt: skip
    placement = place([many], FLAT, SEED)
    logs = np.log(placement.bodies.radius)
    number = len(logs)
    assert abs(logs.mean() - np.log(2.0)) < 4 * 0.35 / np.sqrt(number)
    assert abs(logs.std(ddof=1) - 0.35) < 4 * 0.35 / np.sqrt(2 * number)


def test_seeds_repeat_drops_or_draw_them_anew():
    def axes(seed, realisation):
        water = Drops(contact_angle=1.0, volume_per_area=0.1, number_density=3e-4,
                      material=WATER, seed=seed, roughness="ignore")  # fmt: skip
        bodies = place([water], ROUGH, np.random.SeedSequence(realisation)).bodies
        return bodies.x

    assert_array_equal(axes(None, 1), axes(None, 1))
    assert not np.array_equal(axes(None, 1), axes(None, 2))
    assert_array_equal(axes(7, 1), axes(7, 2))
    assert not np.array_equal(axes(7, 1), axes(8, 1))


def test_two_contaminants_do_not_share_their_random_numbers():
    dust = Spheres(radius=2.0, number_density=1e-3, material="bk7")
    bodies = place([dust, dust], FLAT, SEED).bodies
    half = len(bodies) // 2
    assert not np.array_equal(bodies.x[:half], bodies.x[half:])


def test_amounts_that_say_too_little_or_too_much_are_refused():
    for amount in (
        {},
        {"coverage": 0.1},
        {"volume_per_area": 1.0},
        {"volume_per_area": 1.0, "coverage": 0.1, "number_density": 1e-3},
    ):
        with pytest.raises(ValueError, match=r"amount must be two of volume_per_area"):
            Drops(contact_angle=1.0, **amount)
    with pytest.raises(ValueError, match=r"number_density \(of nuclei\) for a breath fig"):
        Drops(contact_angle=1.0, coverage=0.1, number_density=1.0, sizes="breath-figure")
    with pytest.raises(ValueError, match=r"sizes must be one of 'equal', 'lognormal'"):
        Drops(contact_angle=1.0, coverage=0.1, number_density=1.0, sizes="gamma")
    with pytest.raises(ValueError, match=r"coverage must lie in \[0, 1\]"):
        Drops(contact_angle=1.0, coverage=1.1, number_density=1.0)
    with pytest.raises(ValueError, match=r"seed must be a whole number >= 0, got 1.5"):
        Drops(contact_angle=1.0, coverage=0.1, number_density=1.0, seed=1.5)
    with pytest.raises(ValueError, match=r"gravity must be one of 'auto', True, False"):
        Drops(contact_angle=1.0, coverage=0.1, number_density=1.0, gravity=1)
    with pytest.raises(ValueError, match=r"amount must be number_density or coverage"):
        Spheres(radius=1.0, material="bk7")
    with pytest.raises(ValueError, match=r"find room on the surface, got \d+ of \d+"):
        place([Spheres(radius=20.0, coverage=0.7, material="bk7")], FLAT, SEED)
    dew = Drops(
        contact_angle=1.0, volume_per_area=0.1, number_density=1e-3, sizes="breath-figure"
    )  # fmt: skip
    with pytest.raises(ValueError, match=r"surface must be periodic for a breath figure"):
        place([dew], HeightMap(np.zeros((40, 40)), 5.0), SEED)


def test_what_spreads_is_a_film():
    spread = Drops(contact_angle=0.0, volume_per_area=2.0, material=WATER)
    placement = place([spread], FLAT, SEED)
    assert placement.film == (False, 2.0, 0)
    assert len(placement.bodies) == 0
    with pytest.raises(ValueError, match=r"What spreads is a Film"):
        Drops.at([[1.0, 1.0]], volume=1.0, contact_angle=0.0)
