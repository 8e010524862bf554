"""Looks along lines of drawn heights, against dense linear algebra and over surfaces."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import GaussianSurface
from pbrdf.kernels import jit
from pbrdf.kernels.sights.drawn import share_above
from pbrdf.simulation.plan import Plan
from pbrdf.simulation.singles import single_bounce
from pbrdf.simulation.singles.profiles import NO_PROFILES
from pbrdf.simulation.singles.single_bounce import SingleBounce
from pbrdf.simulation.trace import prepare

# Uneven in every respect: steps, lengths, nodes, slopes
SURFACE = GaussianSurface(
    shape=(75, 90), spacing=(1.0, 0.8), corr_length=(7.0, 5.0), slope_rms=0.4
)
PLAN = Plan(
    theta_i=np.array([0.9]), phi_i=0.3, n_rays=2000, max_bounces=8, n=np.array([[1.5]]),
    kappa=np.zeros((1, 1)), base=np.empty((1, 0)), n_stokes=1, n_theta=6, n_dphi=8,
)  # fmt: skip
CORNERS = {0: ((0, 0), (1, 0), (1, 1)), 1: ((0, 0), (0, 1), (1, 1))}


@jit
def above(x):
    """Compiled `share_above` for the tests."""
    return share_above(x)


@pytest.fixture(scope="module")
def single():
    return SingleBounce.of(SURFACE, PLAN)


def covariance(one, other):
    """Covariance of the heights of nodes (n, 2) and (m, 2)."""
    lag = one[:, None, :] - other[None, :, :]
    along = [
        SURFACE.correlation(axis)[lag[..., axis] % SURFACE.shape[axis]] for axis in (0, 1)
    ]
    return SURFACE.ensemble_height_rms**2 * along[0] * along[1]


@pytest.mark.parametrize("path", [0, 7, 130, 201])
def test_heights_are_drawn_with_what_the_corners_leave_open(single, path):
    profiles = single.directions[0].profiles
    nodes, gain = profiles.nodes[path], profiles.bent[path, :, 0]
    corners = np.array(CORNERS[path % 2])
    across, among = covariance(nodes, corners), covariance(corners, corners)
    expected = covariance(nodes, nodes) - across @ np.linalg.solve(among, across.T)
    factor = profiles.factor[path] / gain
    assert_allclose(factor.T @ factor, expected, atol=1e-7)
    # The first lie along the azimuth of the source, within rounding to nodes
    aside = nodes[: profiles.sources] * [1.0, 0.8] @ [-np.sin(0.3), np.cos(0.3)]
    assert np.abs(aside).max() < 1.2
    assert profiles.sources > 2
    assert len(nodes) > profiles.sources + 10


def test_a_ray_from_a_facet_so_lifted_touches_the_node(single):
    """By the mean height that three corners let expect."""
    profiles, rng = single.directions[0].profiles, np.random.default_rng(2)
    for path in rng.integers(len(profiles.nodes), size=30):
        k, low = path % 2, path % 2 == 0
        nodes, corners = profiles.nodes[path], np.array(CORNERS[k])
        u, v = (2 / 3, 1 / 3) if low else (1 / 3, 2 / 3)
        slope, rise = 0.3 * rng.standard_normal(2), rng.uniform(0.1, 1.0)
        by_gain, by_x, by_y, way = profiles.bent[path].T
        lift = by_gain * 0.2 + slope[0] * by_x + slope[1] * by_y - rise * way
        for a in range(len(nodes)):
            # Heights of the corners: the regression's mean, the lift and the slopes
            mean = single.ensemble.regression[k] @ slope + lift[a]
            flat = corners * [1.0, 0.8] @ slope
            z = flat - flat.mean() + mean
            start = z[0] + u * slope[0] * 1.0 + v * slope[1] * 0.8
            weights = np.linalg.solve(
                covariance(corners, corners), covariance(corners, nodes[a : a + 1])
            )[:, 0]
            ahead = way[a] / by_gain[a]
            assert_allclose(start + rise * ahead, weights @ z + 0.2, atol=1e-8)
            # The way lies along one of two directions, to within half a node
            assert ahead <= np.hypot(*((nodes[a] - [u, v]) * [1.0, 0.8])) + 1e-9
            assert ahead > np.hypot(*((nodes[a] - [u, v]) * [1.0, 0.8])) - 0.2


def test_share_above_is_that_of_a_normal_number():
    from scipy.stats import norm

    x = np.linspace(-6.0, 8.0, 57)
    assert_allclose([above(one) for one in x], norm.sf(x), atol=3e-7)
    assert above(-1e30) == 1.0
    assert above(1e30) < 1e-40


def without_lines(single):
    """Looks over realisations alone."""
    one = single.directions[0]
    looked = one.wanted.any(axis=0)
    one = replace(
        one, pairs=np.zeros_like(one.pairs), profiles=NO_PROFILES,
        places=np.where(looked, 2.0, 0.0),
    )  # fmt: skip
    return replace(single, directions=(one,))


def seen_over(single, first):
    """Shares of the bins by looks at several realisations (samples, bins)."""
    found = []
    for seed in range(first, first + 400):
        terrain = prepare(SURFACE.sample(seed), frozenset({"walk", "horizon"})).terrain
        found.append(single.seen_by_bin(terrain, PLAN, 0, np.uint64(977 * seed)))
    return np.array(found).reshape(len(found), -1)


def score(one, other):
    """Differences of means in standard errors, of bins that count."""
    bright = other.mean(axis=0) > 1e-2 * other.mean(axis=0).max()
    error = np.hypot(*(x[:, bright].std(axis=0) for x in (one, other))) / np.sqrt(len(one))
    return (one.mean(axis=0) - other.mean(axis=0))[bright] / error


def test_the_mean_is_that_of_looks_over_surfaces(single):
    """Also where lines of nodes half a length apart miss much of what hides a facet."""
    over_surfaces, corrected = seen_over(without_lines(single), 0), seen_over(single, 1000)
    z = score(corrected, over_surfaces)
    assert z.size > 20
    assert np.abs(z).max() < 4.5
    assert np.mean(z**2) < 2.2
    assert corrected.var(axis=0).sum() < 0.4 * over_surfaces.var(axis=0).sum()
    # Drawn heights alone, uncorrected, differ: the comparison can tell
    one = single.directions[0]
    blind = replace(one, places=np.where(one.places > 0.0, 1e-9, 0.0))
    alone = seen_over(replace(single, directions=(blind,)), 1000)
    assert np.mean(score(alone, over_surfaces) ** 2) > 4.4


def test_of_all_looks_few_are_over_the_surface(single):
    one = single.directions[0]
    assert one.pairs.sum() > 0.9 * single_bounce.PAIRS_PER_RAY * PLAN.n_rays
    assert single.looks().max() > 2 * one.places.max()
    anywhere = SingleBounce.of(SURFACE, replace(PLAN, phi_i=None)).directions[0]
    assert anywhere.pairs.sum() == 0
    assert anywhere.places.sum() > one.places.sum()
