"""What lies on a rough surface: volume above it, contact, extent."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
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
from pbrdf.contaminants import place
from pbrdf.contaminants.ground import Ground
from pbrdf.contaminants.shapes import cap
from pbrdf.validity import contamination_warnings

SEED = np.random.SeedSequence(5)
ROUGH = GaussianSurface(
    shape=(128, 96), spacing=(1.0, 1.25), corr_length=14.0, slope_rms=0.15
).sample(8)
WATER = Material(1.333, name="test water")


def heights_at(surface, x, y):
    """Heights of the facets at many places, by the plane of each, periodic."""
    nx, ny = surface.heights.shape
    u, v = x / surface.spacing[0] % nx, y / surface.spacing[1] % ny
    i, j = np.minimum(u.astype(int), nx - 1), np.minimum(v.astype(int), ny - 1)
    u, v = u - i, v - j
    z = surface.heights
    i1, j1 = (i + 1) % nx, (j + 1) % ny
    far = np.where(u > v, z[i1, j], z[i, j1])
    # Barycentric: the near corner, the far corner and the one between them
    high, low = np.maximum(u, v), np.minimum(u, v)
    return z[i, j] * (1 - high) + far * (high - low) + z[i1, j1] * low


def columns(surface, bodies, k, count=1000):
    """Volume of a body above the surface by midpoint columns, apart from the slabs."""
    reach = bodies.radius[k]
    steps = (np.arange(count) + 0.5) / count * 2 * reach - reach
    x, y = np.meshgrid(steps, steps, indexing="ij")
    squared = x**2 + y**2
    ground = heights_at(surface, bodies.x[k] + x, bodies.y[k] + y)
    (slab,) = bodies.shape(k).slabs
    centre, radius = bodies.z[k] + 0.5 * (slab[0] + slab[1]), 0.5 * (slab[1] - slab[0])
    half = np.sqrt(np.maximum(radius**2 - squared, 0.0))
    column = centre + half - np.maximum(ground, centre - half)
    return np.sum(np.maximum(column, 0.0) * (half > 0)) * (2 * reach / count) ** 2


def drops(degrees, volume=(3000.0, 40.0), positions=((30.0, 40.0), (126.0, 118.0))):
    return Drops.at(
        positions, volume=volume, contact_angle=np.deg2rad(degrees), material=WATER,
        roughness="ignore", gravity=False,
    )  # fmt: skip


@pytest.mark.parametrize("degrees", [25.0, 60.0, 90.0, 120.0, 179.0])
def test_clipped_volume_is_the_volume_asked(degrees):
    placement = place([drops(degrees)], ROUGH, SEED)
    report = placement.reports[0]
    assert_allclose(report["volume_placed"], 3040.0, rtol=1e-9)
    # Independent columns, one drop across the corner of the period; their own error is
    # that of the rim, seen by doubling their number
    found = [columns(ROUGH, placement.bodies, k) for k in range(2)]
    assert_allclose(found, [3000.0, 40.0], rtol=2e-5)


def test_the_mean_plane_is_not_where_the_drop_lies():
    # Without the surface the volume would be wrong: the test above can fail
    flat = place([drops(60.0)], HeightMap.flat(size=(128.0, 120.0)), SEED).bodies
    wrong = flat.z[0] + ROUGH.heights.mean()
    bodies = place([drops(60.0)], ROUGH, SEED).bodies
    assert abs(bodies.z[0] - wrong) > 0.05
    moved = type(bodies)(**{**vars(bodies), "z": np.full(2, wrong)})
    assert abs(columns(ROUGH, moved, 0) / 3000.0 - 1) > 1e-3


def test_flat_placement_is_a_sphere_with_its_centre_at_minus_r_cos():
    surface = HeightMap(np.full((4, 4), 2.5), 25.0, periodic=True)
    bodies = place([drops(115.0, 700.0, [[50.0, 20.0]])], surface, SEED).bodies
    radius = np.cbrt(
        3
        * 700.0
        / np.pi
        / (2 + np.cos(np.deg2rad(115)))
        / (1 - np.cos(np.deg2rad(115))) ** 2
    )
    ((low, high, a, b, c),) = bodies.slabs
    assert_allclose(bodies.z, 2.5)
    assert_allclose(0.5 * (low + high), -radius * np.cos(np.deg2rad(115)), rtol=1e-12)
    assert_allclose(b / 2, 0.5 * (low + high), rtol=1e-12)
    assert_allclose(a + b**2 / 4, radius**2, rtol=1e-12)
    assert c == -1.0
    assert_allclose(bodies.radius, radius, rtol=1e-12)
    assert_allclose(bodies.z_high, 2.5 + high)


@settings(max_examples=40, deadline=None)
@given(
    st.floats(5.0, 180.0), st.floats(0.5, 2000.0), st.floats(-300.0, 300.0),
    st.floats(-300.0, 300.0),
)  # fmt: skip
def test_volume_is_conserved_wherever_a_drop_lies(degrees, volume, x, y):
    placement = place([drops(degrees, volume, [[x, y]])], ROUGH, SEED)
    report = placement.reports[0]
    assert_allclose(report["volume_placed"], volume, rtol=1e-9)
    assert 0 <= placement.bodies.x[0] < 128.0
    assert 0 <= placement.bodies.y[0] < 120.0


def test_the_sum_over_azimuths_is_good_to_a_millionth():
    ground, found = Ground(ROUGH), []
    for degrees, volume, x in ((30.0, 2000.0, 20.3), (90.0, 30.0, 71.7), (30.0, 3.0, 99.1)):
        shape = cap(volume, np.deg2rad(degrees))
        rest = ground.settle(shape, x, 50.9)
        found.append(ground.volume_above(shape, x, 50.9, rest.z, 2**15).volume / volume)
    # Measured over many drops: 5e-7 rms, 1.4e-6 at worst
    assert_allclose(found, 1.0, rtol=2e-6)


def test_flattened_drops_are_volume_true_as_well():
    heavy = Drops.at(
        [[60.0, 60.0]], volume=9000.0, contact_angle=np.deg2rad(100.0), material=WATER,
        gravity=True, capillary_length=25.0, roughness="ignore",
    )  # fmt: skip
    placement = place([heavy], ROUGH, SEED)
    assert placement.reports[0]["flattened"] == 1
    assert len(placement.bodies.slabs) > 4
    bodies = placement.bodies
    reach = float(bodies.radius[0])
    steps = (np.arange(600) + 0.5) / 600 * 2 * reach - reach
    x, y = np.meshgrid(steps, steps, indexing="ij")
    ground = heights_at(ROUGH, bodies.x[0] + x, bodies.y[0] + y)
    # Slice by slice: the area inside the body and above the surface
    edges = np.linspace(bodies.z_low[0], bodies.z_high[0], 401)
    heights = 0.5 * (edges[1:] + edges[:-1])
    volume = 0.0
    for z in heights:
        s = z - bodies.z[0]
        slab = bodies.slabs[np.searchsorted(bodies.slabs[:, 1], s)]
        squared = slab[2] + s * (slab[3] + s * slab[4])
        volume += np.sum((x**2 + y**2 < squared) & (ground < z))
    volume *= (2 * reach / 600) ** 2 * (edges[1] - edges[0])
    assert_allclose(volume, 9000.0, rtol=1e-3)


def test_resting_spheres_touch_and_do_not_enter():
    spheres = Spheres.at(
        [[20.0, 30.0], [90.0, 100.0], [127.9, 0.1]], radius=[3.0, 12.0, 25.0],
        material="aluminium",
    )  # fmt: skip
    bodies = place([spheres], ROUGH, SEED).bodies
    for k, radius in enumerate((3.0, 12.0, 25.0)):
        steps = np.linspace(-radius, radius, 1201)
        x, y = np.meshgrid(steps, steps, indexing="ij")
        room = np.maximum(radius**2 - x**2 - y**2, 0.0)
        ground = heights_at(ROUGH, bodies.x[k] + x, bodies.y[k] + y)
        gap = np.where(room > 0, bodies.z[k] - np.sqrt(room) - ground, np.inf)
        # Between nodes of this comb the gap can only be a little smaller
        assert -1e-12 <= gap.min() < 2e-3


def test_a_sphere_rests_on_a_slope_and_in_a_groove():
    # On a slope of 3/4 the centre is R √(1 + 9/16) above the axis' foot
    x = np.arange(40.0)
    slope = HeightMap(np.repeat(0.75 * x[:, None], 40, axis=1), 1.0)
    bodies = place([Spheres.at([[20.3, 19.6]], radius=4.0, material="bk7")], slope, SEED)
    assert_allclose(bodies.bodies.z, 0.75 * 20.3 + 4.0 * 1.25, rtol=1e-12)
    # Between two walls of slope 1 it touches both, at R √2 above the bottom
    groove = HeightMap(np.repeat(np.abs(x - 20)[:, None], 40, axis=1), 1.0)
    bodies = place([Spheres.at([[20.0, 19.6]], radius=4.0, material="bk7")], groove, SEED)
    assert_allclose(bodies.bodies.z, 4.0 * np.sqrt(2), rtol=1e-12)
    # On a single spike it stands on the node
    heights = np.zeros((40, 40))
    heights[20, 20] = 7.0
    spike = HeightMap(heights, 1.0)
    bodies = place([Spheres.at([[21.0, 20.0]], radius=2.0, material="bk7")], spike, SEED)
    assert_allclose(bodies.bodies.z, 7.0 + np.sqrt(3.0), rtol=1e-12)


def test_sunk_spheres_and_given_centres():
    flat = HeightMap.flat(size=(50.0, 50.0))
    sunk = Spheres.at([[10.0, 10.0]], radius=4.0, material="bk7", sink=0.25)
    placement = place([sunk], flat, SEED)
    assert_allclose(placement.bodies.z, 2.0)
    # A quarter of the diameter below: cap of height 2 cut off
    lost = np.pi * 2.0**2 * (3 * 4.0 - 2.0) / 3
    report = placement.reports[0]
    assert_allclose(report["volume"] - report["volume_placed"], lost, rtol=1e-4)
    given_z = Spheres.at([[10.0, 10.0, 9.0]], radius=4.0, material="bk7")
    assert_allclose(place([given_z], flat, SEED).bodies.z, 9.0)


def test_a_level_film_holds_its_volume():
    film = place([Film(thickness=0.7, level=True)], ROUGH, SEED).film
    x, y = np.meshgrid(
        (np.arange(1600) + 0.5) * 0.08, (np.arange(1500) + 0.5) * 0.08, indexing="ij"
    )
    depth = np.maximum(film.value - heights_at(ROUGH, x, y), 0.0)
    assert film.level
    assert_allclose(depth.mean(), 0.7, rtol=1e-5)
    report = place([Film(thickness=0.7, level=True)], ROUGH, SEED).reports[0]
    assert_allclose(report["coverage_wetted"], np.mean(depth > 0), atol=1e-4)
    # Deep enough, it is the mean height plus the thickness
    deep = place([Film(thickness=30.0, level=True)], ROUGH, SEED).film
    assert_allclose(deep.value, ROUGH.heights.mean() + 30.0, rtol=1e-12)
    conformal = place([Film(thickness=3.0)], ROUGH, SEED).film
    assert conformal == (False, 3.0, 0)


def test_materials_are_numbered_in_the_order_of_the_scene():
    contaminants = [
        drops(70.0),
        Spheres.at([[70.0, 20.0]], radius=3.0, material="aluminium"),
        Film(thickness=0.1, material=WATER),
    ]
    placement = place(contaminants, ROUGH, SEED)
    assert [m.name for m in placement.bodies.materials] == ["test water", "aluminium"]
    assert_array_equal(placement.bodies.material, [0, 0, 1])
    assert placement.film.material == 0
    assert_array_equal(placement.bodies.slab_start, [0, 1, 2, 3])


def test_wide_bodies_and_finite_maps():
    with pytest.raises(ValueError, match=r"bodies must be narrower than the period 120"):
        place([drops(60.0, 3e6, [[1.0, 1.0]])], ROUGH, SEED)
    finite = HeightMap(ROUGH.heights, ROUGH.spacing)
    place([drops(60.0, 3000.0, [[60.0, 60.0]])], finite, SEED)
    with pytest.raises(ValueError, match=r"bodies must lie inside the finite map of 127"):
        place([drops(60.0, 3000.0, [[5.0, 60.0]])], finite, SEED)
    holed = HeightMap(np.where(ROUGH.heights > 3, np.nan, ROUGH.heights), 1.0)
    with pytest.raises(ValueError, match=r"heights must be complete under contaminants"):
        place([drops(60.0)], holed, SEED)
    below = Spheres.at([[10.0, 10.0, -50.0]], radius=3.0, material="bk7")
    with pytest.raises(ValueError, match=r"leave a part of every sphere above"):
        place([below], ROUGH, SEED)


def test_roughness_is_reported_or_applied():
    def angle(option, degrees=15.0):
        water = Drops(
            contact_angle=np.deg2rad(degrees), volume_per_area=0.3, coverage=0.1,
            material=WATER, roughness=option, seed=1,
        )  # fmt: skip
        return place([water], ROUGH, SEED)

    warned = angle("warn")
    assert_allclose(np.rad2deg(warned.reports[0]["contact_angle"]), 15.0)
    assert any("Wenzel's law" in note for note in warned.notes)
    assert any("steeper than the contact angle" in note for note in warned.notes)
    assert angle("ignore").notes == ()
    applied = np.rad2deg(angle("wenzel").reports[0]["contact_angle"])
    assert 7.0 < applied < 11.0  # 9.18 in the ensemble
    # 10 degrees spread on this slope: a film of the same volume
    film = angle("wenzel", 10.0)
    assert film.film == (False, 0.3, 0)
    assert len(film.bodies) == 0
    assert any("spread to a film" in note for note in angle("warn", 10.0).notes)


def test_scenes_check_contaminants():
    flat = HeightMap.flat(size=(50.0, 50.0))
    with pytest.raises(TypeError, match=r"contaminants must be Drops, Spheres or Film"):
        Scene(flat, "bk7", ["water"])
    with pytest.raises(ValueError, match=r"at most one Film, got 2"):
        Scene(flat, "bk7", [Film(thickness=1.0), Film(thickness=2.0)])
    with pytest.raises(TypeError, match=r"material must be a Material"):
        Film(thickness=1.0, material=1.333)
    with pytest.raises(ValueError, match=r"thickness must be positive \[um\], got -1"):
        Film(thickness=-1.0)
    with pytest.raises(ValueError, match=r"contact_angle must lie in \[0, 3.1416\] rad"):
        drops(200.0)
    with pytest.raises(ValueError, match=r"positions must have shape \(N, 2\)"):
        Drops.at([1.0, 2.0], volume=1.0, contact_angle=1.0)
    with pytest.raises(ValueError, match=r"volume must be a number or one for each of"):
        Drops.at([[1.0, 2.0]], volume=[1.0, 2.0], contact_angle=1.0)
    with pytest.raises(ValueError, match=r"sink must be 0 where centres are given"):
        Spheres.at([[1.0, 2.0, 3.0]], radius=1.0, material="bk7", sink=0.5)
    with pytest.raises(ValueError, match=r"two contaminants|at most one film"):
        place([Film(thickness=1.0), Film(thickness=1.0)], flat, SEED)


def test_small_drops_and_thin_films_are_reported_where_a_wavelength_is_known():
    placement = place([drops(90.0, 3000.0, [[9.0, 9.0]]), Film(thickness=3.0)], ROUGH, SEED)
    # R = 11.27 um: 2 π R / λ = 129 at 0.55 um
    notes = contamination_warnings(placement.reports, 0.55)
    assert "size parameter of 129 " in notes[0]
    assert "film of 3 um" in notes[1]
    large = place([drops(90.0, 3e5, [[9.0, 9.0]]), Film(thickness=40.0)], ROUGH, SEED)
    assert contamination_warnings(large.reports, 0.55) == []
    # A broad band makes thin films incoherent
    assert len(contamination_warnings(placement.reports, 0.55, bandwidth=0.2)) == 1


def test_of_two_bodies_that_are_the_same_the_first_is_there():
    """Black after clear changes nothing, bit for bit; before it, it is all."""
    places = [(10.0, 20.0), (159.9, 90.0)]

    def spheres(material, radius=6.0, positions=places):
        return Spheres.at(positions, radius=radius, material=material)

    def run(*contaminants):
        return simulate(Scene(ROUGH, Material.mirror(), contaminants), 0.6, n_rays=3200)

    clear, black = spheres(Material(1.4)), spheres(Material.black())
    alone = run(clear)
    # The second names one place by its image a period further
    moved = spheres(Material.black(), positions=[(10.0 + 128.0, 20.0), (159.9, 90.0)])
    assert_array_equal(run(clear, moved).brdf, alone.brdf)
    assert_array_equal(run(black, clear).brdf, run(black).brdf)
    assert float(alone.albedo.sum()) == pytest.approx(1.0, abs=1e-12)
    # Bodies that only have the same axis stay, as does one of two that differs
    small = spheres(Material.black(), radius=(6.0, 5.0))
    counts = [len(place([clear, one], ROUGH, SEED).bodies) for one in (black, small)]
    assert counts == [2, 3]
    # Drops of one seed lie at the same places
    dew = [
        Drops(contact_angle=1.2, coverage=0.1, number_density=1e-3, seed=3, material=one)
        for one in (WATER, Material(1.333, 0.05))
    ]
    assert len(place(dew, ROUGH, SEED).bodies) == len(place(dew[:1], ROUGH, SEED).bodies)
