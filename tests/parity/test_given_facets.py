"""Facets of given slopes on a random mesh, against dense linear algebra and brute force."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import GaussianSurface
from pbrdf.kernels import from_python, jit
from pbrdf.kernels.sights.looks import facet_place, set_ray
from pbrdf.kernels.sights.walk import N_OF_RAY, Mesh, Rays, lift_clear
from pbrdf.simulation.plan import Plan
from pbrdf.simulation.singles.single_bounce import SingleBounce
from pbrdf.simulation.trace import prepare

# Uneven in every respect: steps, lengths, nodes (a block of 8 cells is cut off), slopes
SURFACE = GaussianSurface(
    shape=(75, 90), spacing=(1.0, 0.8), corr_length=(7.0, 5.0), slope_rms=0.4
)
ALL_SKIPS = frozenset({"walk", "sweep", "steep", "horizon"})


@jit
def placed(mesh, ensemble, i, j, u, v):
    """Compiled `facet_place` for the tests."""
    return facet_place(mesh, ensemble, i, j, u, v)


@jit
def add_ray(rays, k, place, slope_x, slope_y):
    """Compiled `set_ray` for the tests."""
    set_ray(rays, k, place, slope_x, slope_y)


def steps(low, slope):
    """First and second step along the edges of a facet."""
    along = slope[0] * 1.0, slope[1] * 0.8
    return along if low else along[::-1]


def first_corner(place, low, slope):
    """Height of a facet's first corner without lift."""
    first, second = steps(low, slope)
    z = place.start_x * slope[0] + place.start_y * slope[1]
    u, v = (place.u, place.v) if low else (place.v, place.u)
    return z - first * u - second * v


@pytest.fixture(scope="module", params=[ALL_SKIPS, ALL_SKIPS - {"horizon"}])
def scene(request):
    plan = Plan(
        theta_i=np.array([0.7]), phi_i=0.3, n_rays=2000, max_bounces=8,
        n=np.array([[1.5]]), kappa=np.zeros((1, 1)), base=np.empty((1, 0)), n_stokes=1,
        n_theta=9, n_dphi=12,
    )  # fmt: skip
    single = SingleBounce.of(SURFACE, plan)
    terrain = prepare(SURFACE.sample(4), request.param).terrain
    return single.ensemble, Mesh(terrain, single.along_x, single.along_y)


def corners(i, j, low):
    """Corners of a facet in the order of their steps."""
    nx, ny = SURFACE.shape
    middle = (i + 1, j) if low else (i, j + 1)
    return [(a % nx, b % ny) for a, b in ((i, j), middle, (i + 1, j + 1))]


def bent(ensemble, mesh, place, low, slope, lift):
    """Heights of the whole mesh given a facet, by dense kriging on three corners."""
    heights = mesh.terrain.heights
    nodes = corners(*place, low)

    def covariance(node, other):
        factor = 1.0
        for axis in range(2):
            factor *= SURFACE.correlation(axis)[
                (node[axis] - other[axis]) % SURFACE.shape[axis]
            ]
        return factor

    point = (0.7, 0.2) if low else (0.2, 0.7)
    first = first_corner(placed(mesh, ensemble, *place, *point), low, slope)
    step, second = steps(low, slope)
    wanted = np.array([first, first + step, first + step + second]) + lift
    change = wanted - [heights[node] for node in nodes]
    among = np.array([[covariance(a, b) for b in nodes] for a in nodes])
    factors = np.linalg.solve(among, change)
    grid = np.indices(SURFACE.shape)
    out = heights.copy()
    for factor, node in zip(factors, nodes, strict=True):
        along = [
            SURFACE.correlation(axis)[(grid[axis] - node[axis]) % SURFACE.shape[axis]]
            for axis in range(2)
        ]
        out += factor * along[0] * along[1]
    return out


@pytest.mark.parametrize("low", [True, False])
def test_the_mesh_is_bent_to_hold_the_facet(scene, low):
    ensemble, mesh = scene
    slope = (0.61, -0.23)
    field = bent(ensemble, mesh, (74, 20), low, slope, 0.4)
    a, b, d = (field[node] for node in corners(74, 20, low))
    first, second = (b - a, d - b) if low else (d - b, b - a)
    assert_allclose([first / 1.0, second / 0.8], slope, rtol=1e-9)
    # Given the slopes alone the mean height of the facet is that of the regression
    expected = ensemble.regression[0 if low else 1] @ slope
    assert_allclose((a + b + d) / 3, expected + 0.4, rtol=1e-9)


def test_heights_are_as_the_slopes_let_expect():
    """Regression of facet heights on facet slopes over many realisations."""
    plan = Plan(
        theta_i=np.array([0.7]), phi_i=0.0, n_rays=100, max_bounces=1,
        n=np.array([[1.5]]), kappa=np.zeros((1, 1)), base=np.empty((1, 0)), n_stokes=1,
        n_theta=3, n_dphi=4,
    )  # fmt: skip
    coarse = GaussianSurface(
        shape=(60, 60), spacing=(1.0, 1.5), corr_length=(3.0, 4.0), slope_rms=0.4
    )
    ensemble = SingleBounce.of(coarse, plan).ensemble
    sums = np.zeros((2, 3, 3))
    for seed in range(60):
        z = coarse.sample(seed).heights
        z10, z01 = np.roll(z, -1, axis=0), np.roll(z, -1, axis=1)
        z11 = np.roll(z10, -1, axis=1)
        for k, middle in enumerate((z10, z01)):
            steps = (middle - z, z11 - middle)
            p, q = steps if k == 0 else steps[::-1]
            rows = np.stack([p / 1.0, q / 1.5, (z + middle + z11) / 3]).reshape(3, -1)
            sums[k] += rows @ rows.T / rows.shape[1] / 60
    law = ensemble.law
    for found in sums:
        assert_allclose(found[0, 0], law.xx, rtol=0.03)
        assert_allclose(found[1, 1], law.yy, rtol=0.03)
        assert_allclose(found[0, 1], law.xy, atol=0.004)
    # Six per cent of the product of the slopes, for steps of a third of the length
    assert law.xy < -0.008
    for k in range(2):
        expected = np.linalg.solve(sums[k, :2, :2], sums[k, :2, 2])
        assert_allclose(ensemble.regression[k], expected, atol=0.03)
        rest = sums[k, 2, 2] - sums[k, 2, :2] @ expected
        assert_allclose(ensemble.remainder[k] ** 2, rest, rtol=0.06)
    assert np.abs(ensemble.regression).min() > 0.1


def clearance(field, place, point, low, direction, most=300.0):
    """Least height of a ray above a mesh beyond its first crossing, by dense sampling."""
    nx, ny = field.shape
    z00, z10 = field, np.roll(field, -1, axis=0)
    z01, z11 = np.roll(field, -1, axis=1), np.roll(z10, -1, axis=1)

    def height(x, y):
        i, j = np.floor(x).astype(int), np.floor(y).astype(int)
        u, v, i, j = x - i, y - j, i % nx, j % ny
        below = z00[i, j] + (z10 - z00)[i, j] * u + (z11 - z10)[i, j] * v
        above = z00[i, j] + (z11 - z01)[i, j] * u + (z01 - z00)[i, j] * v
        return np.where(u > v, below, above)

    x0, y0 = place[0] + point[0], place[1] + point[1]
    speed = np.array(direction) / [1.0, 0.8, 1.0]
    # Every crossing of the three families of lines, in order, and nothing else
    times = []
    for start, rate in ((x0, speed[0]), (y0, speed[1]), (x0 - y0, speed[0] - speed[1])):
        first = np.ceil(start) - start if rate > 0 else start - np.floor(start)
        times.append((first + np.arange(most)) / abs(rate))
    t = np.sort(np.concatenate(times))
    t = t[t < most / np.abs(speed[:2]).max()]
    z0 = height(np.array([x0]), np.array([y0]))[0]
    gap = z0 + speed[2] * t - height(x0 + speed[0] * t, y0 + speed[1] * t)
    return gap[1:].min()


def test_the_least_lift_is_where_each_ray_begins_to_clear(scene):
    """Rays of one azimuth, each from a facet of its own slopes, against brute force."""
    ensemble, mesh = scene
    rng = np.random.default_rng(5)
    unit = ensemble.remainder[0]
    lifts = []
    for _ in range(60):
        cell = tuple(int(n * r) for n, r in zip(SURFACE.shape, rng.random(2), strict=True))
        point = rng.random(2)
        low = bool(point[0] > point[1])
        phi = rng.uniform(0, 2 * np.pi)
        along = np.array([np.cos(phi), np.sin(phi)])
        slopes, rises = [], []
        for rise in 1 / np.tan(rng.uniform(0.6, 1.5, size=5)):
            slope = 0.4 * rng.standard_normal(2)
            if rise > slope @ along + 0.01:  # else turned away
                slopes.append(slope)
                rises.append(rise)
        place = placed(mesh, ensemble, *cell, *point)
        rays = Rays(*np.zeros((N_OF_RAY, len(slopes))))
        for k, slope in enumerate(slopes):
            add_ray(rays, k, place, *slope)
        rays.rise[:] = rises
        rays.lift[:] = -3.0 * unit
        most = 5.0 * unit
        from_python(lift_clear)(
            mesh, place, ensemble.reach, rays, most, along[0], along[1] / 0.8
        )
        lifts.extend(rays.lift / unit)
        for slope, rise, lift in zip(slopes, rises, rays.lift, strict=True):
            for change, clears in ((-1e-6, False), (1e-6, True)):
                if (lift <= -3.0 * unit and not clears) or (lift >= most and clears):
                    continue
                field = bent(ensemble, mesh, cell, low, slope, min(lift, most) + change)
                gap = clearance(field, cell, point, low, (*along, rise))
                assert (gap > 0) == clears, (cell, rise, phi, lift / unit, gap)
    lifts = np.array(lifts)
    assert ((lifts > -3.0) & (lifts < 5.0)).sum() > 40
    assert (lifts == -3.0).sum() > 10
