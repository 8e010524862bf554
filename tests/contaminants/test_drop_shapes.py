"""Shapes of drops on a plane: caps in closed form, and flattened by gravity."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from pbrdf.contaminants.sessile import ShapeMaker, flattened
from pbrdf.contaminants.shapes import cap, cap_radius, cap_volume, contact_depth, sphere
from pbrdf.kernels.bodies.sessile import trace_profile

LENGTH = 2725.7  # capillary length of water


@pytest.mark.parametrize(
    ("degrees", "radius", "base", "height"),
    [
        (15.0, 6.52109, 1.68778, 0.22220),
        (90.0, 0.78159, 0.78159, 0.78159),
        (179.0, 0.62035, 0.010827, 1.24061),
    ],
)
def test_caps_of_unit_volume_have_the_tabulated_sizes(degrees, radius, base, height):
    shape = cap(1.0, np.deg2rad(degrees))
    assert_allclose(cap_radius(1.0, np.deg2rad(degrees)), radius, atol=6e-6)
    assert_allclose(shape.base_radius, base, atol=6e-6)
    assert_allclose(shape.height, height, atol=6e-6)
    # V from base and height, which the shape was not made with
    volume = np.pi * shape.height * (3 * shape.base_radius**2 + shape.height**2) / 6
    assert_allclose(volume, 1.0, rtol=1e-12)
    angle = 2 * np.arctan2(shape.height, shape.base_radius)
    assert_allclose(np.rad2deg(angle), degrees, rtol=1e-10)


def test_equal_volumes_cover_in_the_ratio_of_the_contact_angles():
    covered = [np.pi * cap(1.0, np.deg2rad(t)).radius ** 2 for t in (15.0, 90.0, 179.0)]
    assert_allclose(covered, [8.949, 1.919, 1.209], atol=5e-4)


@given(
    st.floats(1e-3, 1e9), st.floats(0.01, np.pi), st.floats(0.1, 10.0)
)  # fmt: skip
def test_volume_of_a_cap_scales_with_the_cube_of_its_size(volume, angle, factor):
    shape = cap(volume, angle)
    assert_allclose(
        cap(volume * factor**3, angle).height, shape.height * factor, rtol=1e-12
    )
    assert_allclose(shape.volume, volume, rtol=1e-9)
    whole = 4 / 3 * np.pi * cap_radius(volume, angle) ** 3
    assert_allclose(shape.whole_volume, whole, rtol=1e-12)


def test_volumes_are_refused_nowhere_near_zero_angle():
    # (π R³ / 4) θ⁴ for a flat cap: 1 - cos θ must not cancel
    assert_allclose(cap_volume(2.0, 1e-5), np.pi / 4 * 8 * 1e-20, rtol=1e-9)


# Errors of the cap against Young-Laplace in percent: height, base radius, largest radius
@pytest.mark.parametrize(
    ("degrees", "sphere_radius", "height", "base", "largest"),
    [
        (15.0, 200.0, 0.2, -0.06, -0.06),
        (15.0, 500.0, 1.2, -0.36, -0.36),
        (90.0, 200.0, 0.1, -0.07, -0.07),
        (90.0, 500.0, 0.8, -0.4, -0.4),
        (150.0, 200.0, 0.3, -1.1, -0.1),
        (150.0, 500.0, 1.9, -6.0, -0.6),
        (179.0, 20.0, 0.01, -10.0, 0.0),
        (179.0, 50.0, 0.05, -33.0, 0.0),
        (179.0, 200.0, 0.6, -75.0, -0.08),
    ],
)
def test_gravity_changes_drops_as_tabulated(degrees, sphere_radius, height, base, largest):
    volume = 4 / 3 * np.pi * sphere_radius**3
    heavy, light = (
        flattened(volume, np.deg2rad(degrees), LENGTH),
        cap(volume, np.deg2rad(degrees)),
    )
    # The table has one or two digits
    digit = 0.05 if height >= 0.1 else 0.005
    assert_allclose(100 * (light.height / heavy.height - 1), height, atol=1.1 * digit)
    assert_allclose(100 * (light.base_radius / heavy.base_radius - 1), base, rtol=0.1)
    assert_allclose(100 * (light.radius / heavy.radius - 1), largest, rtol=0.2, atol=0.01)


def profile_by_scipy(apex, angle):
    """Integrate Young-Laplace with another program: φ is the independent variable."""

    def rates(phi, state):
        x, z, _ = state
        bend = 1 / apex if x == 0 else 2 / apex + z - np.sin(phi) / x
        return [
            np.cos(phi) / bend,
            np.sin(phi) / bend,
            np.pi * x**2 * np.sin(phi) / bend,
        ]

    run = solve_ivp(rates, (0, angle), [0.0, 0.0, 0.0], rtol=1e-12, atol=1e-14,
                    method="DOP853", dense_output=True)  # fmt: skip
    return run.sol


@pytest.mark.parametrize(("degrees", "apex"), [(40.0, 0.9), (100.0, 0.5), (172.0, 0.3)])
def test_slabs_follow_the_profile_to_a_millionth_of_the_size(degrees, apex):
    angle = np.deg2rad(degrees)
    profile = profile_by_scipy(apex, angle)
    x_end, z_end, volume = profile(angle)
    shape = flattened(volume * LENGTH**3, angle, LENGTH)
    assert_allclose(shape.volume, volume * LENGTH**3, rtol=1e-12)
    assert_allclose(shape.base_radius, x_end * LENGTH, rtol=3e-6)
    phi = np.linspace(0.02, 0.999, 400) * angle
    x, z, _ = profile(phi) * LENGTH
    height = z_end * LENGTH - z
    slabs = shape.slabs[np.searchsorted(shape.slabs[:, 1], height)]
    squared = slabs[:, 2] + height * (slabs[:, 3] + height * slabs[:, 4])
    slope = slabs[:, 3] + 2 * height * slabs[:, 4]
    off = np.abs(squared - x**2) / np.sqrt(4 * x**2 + slope**2)
    assert off.max() < 2e-6 * shape.height


@pytest.mark.parametrize("degrees", [15.0, 90.0, 150.0, 179.0])
def test_slabs_join_smoothly_and_the_body_is_convex(degrees):
    shape = flattened(4 / 3 * np.pi * 700.0**3, np.deg2rad(degrees), LENGTH)
    low, high, a, b, c = shape.slabs.T
    size = shape.height
    at = high[:-1]
    for order in range(2):
        lower, upper = (
            part[2] + at * (part[3] + at * part[4])
            if order == 0
            else part[3] + 2 * at * part[4]
            for part in (shape.slabs[:-1].T, shape.slabs[1:].T)
        )
        assert_allclose(upper, lower, atol=1e-12 * size ** (2 - order))
    assert_allclose(low[1:], high[:-1], rtol=1e-14, atol=1e-12 * size)
    # r(s) is concave where 4 a c <= b²
    assert (4 * a * c <= b**2).all()
    # Both ends are closed
    for slab, end in ((shape.slabs[0], low[0]), (shape.slabs[-1], high[-1])):
        assert abs(slab[2] + end * (slab[3] + end * slab[4])) < 1e-9 * size**2
    slope = np.diff(np.sqrt(a[1:] + at * (b[1:] + at * c[1:]))) / np.diff(at)
    assert (np.diff(slope) < 1e-9).all()


@pytest.mark.parametrize("degrees", [15.0, 90.0, 150.0])
def test_large_drops_approach_the_height_of_a_puddle(degrees):
    angle = np.deg2rad(degrees)
    limit = 2 * np.sin(angle / 2)
    excess, radius = [], []
    for apex in (1e10, 1e20):
        points = np.empty((20_000, 4))
        count, _ = trace_profile(apex, angle, 0.01, points)
        excess.append(points[count - 1, 1] - limit)
        radius.append(points[:count, 0].max())
    assert 0 < excess[1] < 0.015 * limit
    # The curvature round the axis adds a share that falls as one over the radius
    assert radius[1] > 40
    assert_allclose(excess[1] / excess[0], radius[0] / radius[1], rtol=0.03)


@pytest.mark.parametrize("degrees", [15.0, 90.0, 150.0, 179.0])
@pytest.mark.parametrize("sphere_radius", [30.0, 1500.0])
def test_the_plane_carries_the_weight_of_a_drop(degrees, sphere_radius):
    # Weight + surface tension along the rim = pressure on the base; 1/b from the apex
    angle, volume = np.deg2rad(degrees), 4 / 3 * np.pi * sphere_radius**3
    shape = flattened(volume, angle, LENGTH)
    _, top, _, b, c = shape.slabs[-1]
    apex = -0.5 * (b + 2 * c * top) / LENGTH
    base, height = shape.base_radius / LENGTH, shape.height / LENGTH
    pressure = np.pi * base**2 * (2 / apex + height)
    pull = 2 * np.pi * base * np.sin(angle)
    weight = volume / LENGTH**3
    assert_allclose(pressure - pull, weight, rtol=0, atol=1e-5 * (pressure + weight))


def test_puddles_are_refused():
    with pytest.raises(ValueError, match=r"volume must be that of a drop .* Lay a Film"):
        flattened(1e14, np.deg2rad(60.0), LENGTH)


def test_gravity_is_taken_where_the_bond_number_asks_for_it():
    def slabs(sphere_radius, gravity):
        maker = ShapeMaker(np.deg2rad(150.0), gravity, LENGTH)
        return len(maker.shape(4 / 3 * np.pi * sphere_radius**3).slabs)

    # Bo = 0.0084 and 0.0121
    assert slabs(250.0, "auto") == 1
    assert slabs(300.0, "auto") > 1
    assert slabs(300.0, False) == 1
    assert slabs(20.0, True) > 1


def test_bodies_touch_where_their_radii_meet_at_one_height():
    # Two spheres on a plane: d² = 4 R1 R2
    one, other = sphere(5.0, 5.0), sphere(2.0, 2.0)
    assert_allclose(contact_depth(one, other, 0.0), np.sqrt(40.0), rtol=1e-9)
    assert_allclose(contact_depth(one, other, 3.0), 7.0, rtol=1e-9)
    assert contact_depth(one, other, 20.0) == 0.0
