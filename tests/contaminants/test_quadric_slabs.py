"""Rays through convex slabs of quadrics, against points along the ray tried in turn."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf.kernels import from_python
from pbrdf.kernels.bodies.bodies import (
    Bodies,
    body_normal,
    heights_in_cylinder,
    slab_interval,
)

# r^2 = a + b s + c s^2 between two heights
SLABS = {
    "sphere": (4.0, 0.0, -1.0, -2.0, 2.0),
    "cap of an ellipsoid": (2.0, 0.3, -0.4, 0.5, 1.9),
    "cylinder": (2.0, 0.0, 0.0, -1.0, 1.0),
    "paraboloid": (0.5, 1.2, 0.0, -0.4, 2.0),
    "cone": (0.0, 0.0, 1.0, 0.0, 2.0),
    "cone with its point below": (0.25, 1.0, 1.0, -0.5, 1.5),
    "one sheet of two": (-1.0, 0.0, 1.0, 1.0, 3.0),
    "cone upside down": (4.0, -4.0, 1.0, 0.0, 2.0),
}
SAMPLES = 20_001


def rays(rng):
    """Starts and ways: any, steep, vertical, level, and along the sides of cones."""
    for number in range(120):
        start, way = rng.normal(size=3) * 1.5, rng.normal(size=3)
        if number % 4 == 1:
            way[:2] *= 0.2
        elif number % 12 == 2:
            way = np.array([0.0, 0.0, rng.choice([-1.0, 1.0])])
        elif number % 12 == 6:
            way[2] = 0.0
        elif number % 4 == 3:
            turn = rng.uniform(0, 2 * np.pi)
            way = np.array([np.cos(turn), np.sin(turn), rng.choice([-1.0, 1.0])])
        yield start, way / np.linalg.norm(way)


@pytest.mark.parametrize("name", SLABS)
def test_a_ray_is_inside_where_its_points_are(name):
    a, b, c, low, high = SLABS[name]
    interval = from_python(slab_interval)
    met = 0
    for start, way in rays(np.random.default_rng(5)):
        t_low, t_high = -30.0, 30.0
        if way[2] != 0.0:
            t_low, t_high = sorted(((low - start[2]) / way[2], (high - start[2]) / way[2]))
        elif not low < start[2] < high:
            continue
        t = np.linspace(max(t_low, -60.0), min(t_high, 60.0), SAMPLES)
        x, y, s = (start[i] + way[i] * t for i in range(3))
        inside = t[a + b * s + c * s * s - x * x - y * y > 0.0]
        first, last = interval(a, b, c, *start, *way, t_low, t_high)
        step = t[1] - t[0]
        if inside.size == 0:
            assert last - first < 2 * step
            continue
        met += 1
        assert abs(first - inside[0]) < 1.01 * step
        assert abs(last - inside[-1]) < 1.01 * step
    assert met > 25


def test_heights_of_a_line_within_a_radius():
    within = from_python(heights_in_cylinder)
    for start, way in rays(np.random.default_rng(6)):
        t = np.linspace(-40.0, 40.0, 80_001)
        x, y, z = (start[i] + way[i] * t for i in range(3))
        inside = z[x * x + y * y < 2.25]
        lowest, highest = within(1.5, *start, *way)
        if way[0] == way[1] == 0.0:
            assert (lowest < -1e200) == (np.hypot(*start[:2]) <= 1.5)
        elif inside.size == 0:
            assert highest - lowest < 0.1
        elif abs(inside).max() < 20.0:
            assert abs(lowest - inside.min()) < 2e-3
            assert abs(highest - inside.max()) < 2e-3


def test_normals_of_a_stack_are_those_of_the_whole():
    """Slices of nearly a sphere, and a body whose radius is linear in the height too."""
    radius, cuts = 2.0, (-2.0, -0.7, 0.4, 2.0)
    slabs = [
        [low, high, radius**2 + 0.1 * k, 0.05 * k, -1.0 + 0.02 * k]
        for k, (low, high) in enumerate(pairwise(cuts))
    ]
    tilted = [[0.0, 3.0, 1.0, 0.8, -0.3]]
    for rows in (slabs, tilted):
        body = Bodies(*[np.zeros(1)] * len(Bodies._fields))._replace(
            slab_start=np.array([0, 1, 1 + len(rows), 2 + len(rows)]),
            slabs=np.array([[0.0, 9.0, 5.0, 0.3, 0.0], *rows, [-9.0, 9.0, 5.0, -0.3, 0.0]]),
        )
        for s in np.linspace(rows[0][0] + 0.05, rows[-1][1] - 0.05, 23):
            _, _, a, b, c = next(row for row in rows if s <= row[1])
            r, turn = np.sqrt(a + b * s + c * s * s), 3.0 * s
            point = r * np.cos(turn), r * np.sin(turn), s
            gradient = np.array([2 * point[0], 2 * point[1], -(b + 2 * c * s)])
            expected = gradient / np.linalg.norm(gradient)
            assert_allclose(from_python(body_normal)(body, 1, *point), expected, atol=1e-14)
