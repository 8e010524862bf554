"""The walk over a height field against every triangle tried in turn."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from pbrdf import HeightMap
from pbrdf.kernels import from_python
from pbrdf.kernels.terrain.heightfield import ESCAPED, HIT, SIDE, block_maxima, walk
from pbrdf.tracer.field import Field
from tests.brute_force import intersect

walk = from_python(walk)

STEPS = 100_000
# A place is known to so many cells, a time to so many times its scale
ROUND = 1e-9


def rough(seed, shape, amplitude):
    return amplitude * np.random.default_rng(seed).standard_normal(shape)


def terrain(heights, periodic):
    """The field as the tracer prepares it, its steepest slope included."""
    return Field.of(HeightMap(heights, 1.0, periodic=periodic)).terrain


def send(heights, periodic, place, speed, facet=-1):
    """Walk from place = (x, y, z); returns fate, cell, facet and the place there."""
    nx, ny = heights.shape if periodic else (heights.shape[0] - 1, heights.shape[1] - 1)
    i, j = min(int(place[0]), nx - 1), min(int(place[1]), ny - 1)
    leave_rate = 0.0
    if facet >= 0:
        slope = gradient(heights, i, j, facet)
        leave_rate = speed[2] - slope[0] * speed[0] - slope[1] * speed[1]
        assert leave_rate > 0
    return walk(
        terrain(heights, periodic),
        i, j, facet, place[0] - i, place[1] - j, place[2], *speed, leave_rate, STEPS,
    )  # fmt: skip


def gradient(heights, i, j, facet):
    nx, ny = heights.shape
    z00, z10 = heights[i, j], heights[(i + 1) % nx, j]
    z01, z11 = heights[i, (j + 1) % ny], heights[(i + 1) % nx, (j + 1) % ny]
    return (z10 - z00, z11 - z10) if facet == 0 else (z11 - z01, z01 - z00)


def check(heights, periodic, place, speed, facet=-1):
    """The walk's answer agrees with brute force, up to hits within rounding of an edge."""
    place, speed = np.asarray(place, dtype=float), np.asarray(speed, dtype=float)
    skip = None if facet < 0 else (int(place[0]), int(place[1]), facet)
    fate, i, j, found, u, v, z = send(heights, periodic, place, speed, facet)
    hits = intersect(heights, periodic, place, speed, skip=skip)
    certain = hits.t[hits.inside > ROUND]
    first = certain.min() if certain.size else np.inf
    if fate != HIT:
        # A ray that starts on an edge may meet the next facet there, within rounding
        assert first == np.inf or first < ROUND, (fate, first)
        assert fate == ESCAPED or (fate == SIDE and not periodic)
        return fate
    # The hit is one that brute force finds too, in the facet or within rounding of its edge
    end = np.array([i + u, j + v, z])
    size = np.array([*heights.shape, np.inf])
    places = place + hits.t[:, None] * speed
    apart = places - end
    if periodic:
        apart[:, :2] -= np.rint(apart[:, :2] / size[:2]) * size[:2]
    scale = 1.0 + np.abs(places).max(axis=1, initial=0.0)
    nx, ny = heights.shape
    same = (hits.column % nx == i) & (hits.row % ny == j) & (hits.facet == found)
    close = np.abs(apart).max(axis=1) < 10 * ROUND * scale
    good = same & close & (hits.inside > -10 * ROUND)
    assert good.any(), (end, hits)
    # and nothing lies before it
    assert hits.t[good].min() <= first + ROUND * (
        1 + abs(first) if np.isfinite(first) else 1
    )
    return fate


def ray_direction(rng, grazing):
    """Any direction; with grazing >= 0 within about 10^-grazing of the horizontal."""
    azimuth = rng.uniform(0, 2 * np.pi)
    rise = rng.uniform(-1, 1) * 10.0**-grazing
    level = np.sqrt(1 - rise**2)
    return np.array([level * np.cos(azimuth), level * np.sin(azimuth), rise])


MAPS = st.tuples(
    st.integers(0, 2**32 - 1),
    st.sampled_from([(2, 2), (3, 5), (8, 8), (17, 9), (20, 13)]),
    st.sampled_from([0.05, 0.5, 3.0]),
)


@settings(max_examples=30)
@given(MAPS, st.booleans(), st.sampled_from([0.0, 0.5, 1.0]))
def test_rays_from_above(case, periodic, grazing):
    heights = rough(*case)
    rng = np.random.default_rng(case[0])
    sides = np.array(heights.shape) - (0 if periodic else 1)
    for _ in range(5):
        speed = ray_direction(rng, grazing)
        speed[2] = -max(abs(speed[2]), 0.05)
        place = [*(rng.random(2) * sides), heights.max()]
        check(heights, periodic, place, speed)


@settings(max_examples=30)
@given(MAPS, st.booleans(), st.sampled_from([0.0, 0.5, 1.0, 1.5]))
def test_rays_from_facets_in_any_direction(case, periodic, grazing):
    heights = rough(*case)
    rng = np.random.default_rng(case[0])
    cells = np.array(heights.shape) - (0 if periodic else 1)
    sent = 0
    while sent < 6:
        i, j = (int(k) for k in rng.integers(cells))
        u, v = rng.random(2)
        facet = 0 if u > v else 1
        slope = gradient(heights, i, j, facet)
        speed = ray_direction(rng, grazing)
        if (
            speed[2] - slope[0] * speed[0] - slope[1] * speed[1] <= 1e-6
            or abs(speed[2]) < 1e-3
        ):
            continue
        z = heights[i, j] + slope[0] * u + slope[1] * v
        check(heights, periodic, [i + u, j + v, z], speed, facet)
        sent += 1


# Steps and slopes in sixteenths are exact in binary, so the rays meet vertices exactly
SIXTEENTHS = st.integers(-32, 32)
TARGETS = ["vertex", "middle of x", "middle of y", "diagonal"]


@given(
    st.integers(0, 2**32 - 1), st.booleans(), SIXTEENTHS, SIXTEENTHS,
    st.integers(1, 40), st.sampled_from(TARGETS),
)  # fmt: skip
def test_rays_aimed_at_vertices_and_edges(seed, periodic, step_x, step_y, drop, target):
    rng = np.random.default_rng(seed)
    heights = rng.integers(-16, 17, (12, 9)) / 16
    speed = np.array([step_x, step_y, -drop]) / 16
    i, j = rng.integers(3, 8), rng.integers(3, 6)
    ends = {
        "vertex": ([i, j], [i, j]), "middle of x": ([i, j], [i + 1, j]),
        "middle of y": ([i, j], [i, j + 1]), "diagonal": ([i, j], [i + 1, j + 1]),
    }[target]  # fmt: skip
    (p, q) = (np.array([*k, heights[tuple(k)]], dtype=float) for k in ends)
    aim = 0.5 * (p + q)
    place = aim - speed * ((aim[2] - heights.max()) / speed[2])
    if not periodic and (place[:2].min() < 0 or (place[:2] > [11, 8]).any()):
        return
    place[:2] %= heights.shape
    fate = check(heights, periodic, place, speed)
    assert fate == HIT


@pytest.mark.parametrize("periodic", [True, False])
def test_vertical_rays(periodic):
    heights = rough(5, (7, 6), 1.0)
    nodes = [(i, j) for i in range(6) for j in range(5)]
    places = [
        (i + u, j + v)
        for i, j in nodes
        for u, v in ((0, 0), (0.5, 0), (0.3, 0.3), (0.2, 0.7))
    ]
    for x, y in places:
        fate = check(heights, periodic, [x, y, heights.max()], [0.0, 0.0, -1.0])
        assert fate == HIT
        end = send(heights, periodic, [x, y, heights.max()], [0.0, 0.0, -1.0])
        assert (end[1] + end[4], end[2] + end[5]) == (x, y)
    fate, *_ = send(heights, periodic, [1.5, 1.5, heights.max() + 1], [0.0, 0.0, 1.0])
    assert fate == ESCAPED


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rays_along_grid_lines(axis, sign):
    """No component across: the ray stays on a line of vertices."""
    heights = rough(11, (10, 12), 0.6)
    for line in (0.0, 3.0, 4.5):
        for drop in (0.02, 0.3, 2.0):
            speed = np.zeros(3)
            speed[axis], speed[2] = sign, -drop
            place = np.array([5.25, 5.25, heights.max()])
            place[1 - axis] = line
            assert check(heights, True, place, speed) == HIT


def test_a_ray_across_many_periods_keeps_its_place():
    heights = np.zeros((8, 8))
    heights[3, 4] = 1e-3
    speed = np.array([0.8, 0.6, -1e-5])
    fate, i, j, _, u, v, z = send(heights, True, [2.3, 1.7, 10e-3], speed)
    assert fate == HIT
    # Follow the shadow of the tip and the plane by hand: t from the height reached
    t = (10e-3 - z) / 1e-5
    assert_allclose((i + u - 2.3 - 0.8 * t + 4) % 8 - 4, 0, atol=1e-9)
    assert_allclose((j + v - 1.7 - 0.6 * t + 4) % 8 - 4, 0, atol=1e-9)


def test_block_maxima_bound_every_cell_of_their_block():
    for periodic in (True, False):
        heights = rough(3, (21, 13), 1.0)
        maxima, levels = block_maxima(heights, periodic)
        cells = np.array(heights.shape) - (0 if periodic else 1)
        for level, (offset, row) in enumerate(levels, start=1):
            for i in range(cells[0]):
                for j in range(cells[1]):
                    corners = heights[
                        np.ix_(np.array([i, i + 1]) % 21, np.array([j, j + 1]) % 13)
                    ]
                    assert (
                        maxima[offset + (i >> level) * row + (j >> level)] >= corners.max()
                    )


CORNERS = [(0, 0), (1, 1), (0.5, 0.5), (1, 0.25), (0.25, 0)]


@given(st.integers(0, 2**32 - 1), st.integers(0, 1), st.sampled_from(CORNERS))
def test_rays_that_leave_from_vertices_and_edges(seed, facet, corner):
    """A neighbour facet the ray moves away from is not met at the common edge."""
    rng = np.random.default_rng(seed)
    heights = rng.integers(-16, 17, (12, 9)) / 16
    i, j = (int(k) for k in rng.integers([2, 2], [9, 6]))
    u, v = corner if facet == 0 else corner[::-1]
    for reach in (2, 2, 4, 4, 8, 8, 32, 32):
        speed = rng.integers(-reach, reach + 1, 3) / 16
        check_departure(heights, i, j, facet, u, v, speed)


def check_departure(heights, i, j, facet, u, v, speed):
    slope = gradient(heights, i, j, facet)
    if speed[2] - slope[0] * speed[0] - slope[1] * speed[1] <= 0 or speed[2] == 0:
        return
    z = heights[i, j] + slope[0] * u + slope[1] * v
    leave_rate = speed[2] - slope[0] * speed[0] - slope[1] * speed[1]
    fate, ci, cj, found, _, _, cz = walk(
        terrain(heights, True),
        i, j, facet, u, v, z, *speed, leave_rate, STEPS,
    )  # fmt: skip
    place = np.array([i + u, j + v, z])
    hits = intersect(heights, True, place, speed, skip=(i, j, facet))
    certain = hits.t[hits.inside > ROUND]
    possible = hits.t[hits.inside > -ROUND]
    if fate == HIT:
        slope = gradient(heights, ci, cj, found)
        approach = speed[2] - slope[0] * speed[0] - slope[1] * speed[1]
        # Along the plane of the facet within rounding, either answer is right
        assert approach < 1e-12
        t = (cz - z) / speed[2]
        assert np.abs(possible - t).min() < ROUND
        assert t <= certain.min(initial=np.inf) + ROUND
    else:
        assert fate == ESCAPED
        assert certain.size == 0
