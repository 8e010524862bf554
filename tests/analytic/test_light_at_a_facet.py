"""What a facet does to light, function by function, against matrices and rotations."""

import numpy as np
from numpy.testing import assert_allclose

from pbrdf.kernels import from_python
from pbrdf.kernels.optics.frames import axis_of_exit, carried_axis, exit_turn, turn_frame
from pbrdf.kernels.optics.light import (
    cosine_law,
    cosine_of_hit,
    direction_about,
    mirror_image,
    near_unit,
    reflected,
    returned,
    turned,
)
from pbrdf.kernels.optics.vectors import Vec, axes_across

# Parts of other kernels, with entries of their own
turn_frame = from_python(turn_frame)
cosine_of_hit = from_python(cosine_of_hit)
mirror_image = from_python(mirror_image)
exit_turn = from_python(exit_turn)
reflected = from_python(reflected)
turned = from_python(turned)
returned = from_python(returned)
cosine_law = from_python(cosine_law)
carried_axis = from_python(carried_axis)
near_unit = from_python(near_unit)
direction_about = from_python(direction_about)
axis_of_exit = from_python(axis_of_exit)
axes_across = from_python(axes_across)

LIGHT = np.array([1.3, 0.3, -0.5, 0.7])
DOWN = np.array([0.36, -0.48, -0.8])
NORMAL = np.array([2.0, 1.0, 6.0]) / np.sqrt(41.0)


def vec(array):
    return Vec(*(float(part) for part in array))


def rotation(axis, angle):
    """Rodrigues' rotation about a unit axis."""
    x, y, z = axis
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * across + (1 - np.cos(angle)) * across @ across


def test_reflection_is_the_matrix_of_the_conventions():
    a, b, c, d = 0.31, 0.07, -0.21, 0.11
    matrix = np.array([[a, b, 0, 0], [b, a, 0, 0], [0, 0, c, -d], [0, 0, d, c]])
    assert_allclose(reflected((a, b, c, d), *LIGHT), matrix @ LIGHT, rtol=1e-14)


def test_a_turn_is_the_matrix_of_the_conventions():
    """The axis turned by 0.4 about k, against the projections on it."""
    k = DOWN
    s = np.cross([0.2, 0.5, 0.1], k)
    s /= np.linalg.norm(s)
    new = rotation(k, 0.4) @ s
    c2, s2 = turn_frame(vec(k), vec(s), vec(3.0 * new))
    assert_allclose([c2, s2], [np.cos(0.8), np.sin(0.8)], rtol=1e-13)
    matrix = np.array([[c2, s2], [-s2, c2]])
    assert_allclose(turned(c2, s2, *LIGHT[1:3]), matrix @ LIGHT[1:3], rtol=1e-14)
    # Light polarised along an axis 0.4 beyond s has Q alone in the frame of that axis
    along = np.array([np.cos(0.8), np.sin(0.8)])
    assert_allclose(turned(c2, s2, *along), [1.0, 0.0], atol=1e-13)


def test_head_on_the_frame_stays_whatever_the_length_of_the_axes():
    """Below 1e-14 of the length of s the new axis is rounding."""
    s = np.cross([0.2, 0.5, 0.1], DOWN)
    s *= 1000.0 / np.linalg.norm(s)
    new = rotation(DOWN, 0.4) @ s / 1000.0
    assert turn_frame(vec(DOWN), vec(s), vec(3e-15 * new)) == (1.0, 0.0)
    found = turn_frame(vec(DOWN), vec(s), vec(3e-14 * new))
    assert_allclose(found, [np.cos(0.8), np.sin(0.8)], rtol=1e-13)


def test_light_through_a_base_keeps_the_polarisation_of_its_way_out_only():
    into = np.array([[0.8, 0.1, 0, 0], [0.1, 0.8, 0, 0], [0, 0, 0.7, 0], [0, 0, 0, 0.7]])
    out = np.array([[0.6, -0.2, 0, 0], [-0.2, 0.6, 0, 0], [0, 0, 0.5, 0], [0, 0, 0, 0.5]])
    expected = out @ np.diag([0.25, 0, 0, 0]) @ into @ LIGHT
    assert_allclose(returned(0.25, 0.8, 0.1, 0.6, -0.2, *LIGHT[:2]), expected[:2])
    assert_allclose(expected[2:], 0.0)


def test_a_mirror_is_a_householder_reflection():
    cosine = cosine_of_hit(vec(DOWN), vec(NORMAL))
    image = mirror_image(vec(DOWN), vec(NORMAL), cosine)
    assert_allclose(image, DOWN - 2 * NORMAL * (NORMAL @ DOWN), rtol=1e-14)
    # Nearer to a unit vector: the error is squared
    assert_allclose(np.linalg.norm(near_unit(vec(1.00001 * DOWN))), 1.0, rtol=2e-10)


def test_a_direction_about_a_normal_has_its_angle_and_its_plane_of_exit():
    for normal in (NORMAL, -NORMAL, np.array([0.0, 0.0, 1.0])):
        first, second = (np.array(axis) for axis in axes_across(vec(normal)))
        assert_allclose(np.stack([first, second]) @ normal, 0.0, atol=1e-15)
        assert_allclose(np.cross(first, second), normal, atol=1e-15)
        sine, cosine = cosine_law(0.36)
        assert_allclose([sine, cosine], [0.6, 0.8])
        k = np.array(direction_about(vec(normal), sine, cosine, 0.3))
        assert_allclose(k @ normal, 0.8)
        turned_by = np.arctan2(k @ second, k @ first)
        assert_allclose(turned_by, 0.6 * np.pi)
        s = np.array(axis_of_exit(vec(k), vec(normal)))
        assert_allclose(s, np.cross(k, normal) / 0.6, atol=1e-14)
        # Along the normal there is no such plane, and every axis across serves
        s = np.array(axis_of_exit(vec(normal), vec(normal)))
        assert_allclose([s @ normal, s @ s], [0.0, 1.0], atol=1e-15)


def test_an_axis_is_carried_on_the_shortest_way():
    a = np.array([0.48, 0.6, 0.64])
    s = np.array([0.6, -0.48, 0.0]) / np.hypot(0.6, 0.48)
    about = np.cross(a, [0.3, -0.2, 0.9])
    about /= np.linalg.norm(about)
    turn = rotation(about, 0.35)
    assert_allclose(carried_axis(vec(a), vec(s), vec(turn @ a)), turn @ s, atol=1e-14)


def test_the_exit_frame_lies_in_the_meridian_plane():
    k = np.array([0.48, -0.6, 0.64])
    meridian = np.cross([0.0, 0.0, 1.0], k)
    s = rotation(k, -0.7) @ meridian
    c2, s2 = exit_turn(vec(k), vec(s), 1.0, 0.0)
    assert_allclose([c2, s2], [np.cos(1.4), np.sin(1.4)], rtol=1e-13)
    # Straight up the azimuth of the source decides: s along z x (cos, sin, 0)
    up, phi = np.array([0.0, 0.0, 1.0]), 0.9
    s = rotation(up, 0.2) @ np.array([-np.sin(phi), np.cos(phi), 0.0])
    c2, s2 = exit_turn(vec(up), vec(s), np.cos(phi), np.sin(phi))
    assert_allclose([c2, s2], [np.cos(-0.4), np.sin(-0.4)], rtol=1e-13)
