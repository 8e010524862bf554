"""Rays let go because they rise above all that lies ahead, against the walk."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from pbrdf import GaussianSurface, HeightMap
from pbrdf.kernels import from_python
from pbrdf.kernels.terrain.heightfield import ESCAPED, corner_heights, facet_steps, walk
from pbrdf.kernels.terrain.horizon import build_horizon, is_free
from pbrdf.tracer.field import Field

is_free = from_python(is_free)
facet_steps = from_python(facet_steps)
corner_heights = from_python(corner_heights)
walk = from_python(walk)

RNG = np.random.default_rng(8)
SMOOTH = GaussianSurface(
    shape=(144, 100), spacing=(1.0, 1.3), corr_length=9.0, slope_rms=0.4
).sample(3)
MAPS = {
    # 100 is no multiple of the blocks of 8 cells: the last of a row is narrow
    "smooth": SMOOTH,
    "finite": HeightMap(SMOOTH.heights, SMOOTH.spacing),
    "white": HeightMap(RNG.standard_normal((72, 64)), 1.0, periodic=True),
    "tilted": HeightMap(0.3 * np.arange(80.0)[:, None] - np.zeros(70), (1.0, 0.7)),
}


def send(terrain, n_rays):
    """Rays upwards from random places: whether known to be free, and their true fate."""
    rng = np.random.default_rng(1)
    nx, ny = terrain.heights.shape
    if not terrain.periodic:
        nx, ny = nx - 1, ny - 1
    free, fates = np.empty(n_rays, dtype=bool), np.empty(n_rays, dtype=int)
    for ray in range(n_rays):
        i, j, facet = int(rng.integers(nx)), int(rng.integers(ny)), int(rng.integers(2))
        small, large = np.sort(rng.random(2))
        u, v = (large, small) if facet == 0 else (small, large)
        z00 = corner_heights(terrain.heights, i, j, terrain.periodic)[0]
        step_x, step_y = facet_steps(terrain, i, j, facet)
        z = z00 + step_x * u + step_y * v
        # Every eighth ray runs exactly along an axis or a diagonal of the grid
        phi = rng.integers(8) * np.pi / 4 if ray % 8 == 0 else rng.uniform(0, 2 * np.pi)
        speed = np.array([np.cos(phi), np.sin(phi), 3.0 * rng.random() ** 2])
        rate = speed[2] - step_x * speed[0] - step_y * speed[1]
        if rate <= 0.0:
            free[ray], fates[ray] = False, -1
            continue
        free[ray] = is_free(terrain.horizon, terrain.z_top, i, j, z, *speed)
        fates[ray] = walk(terrain, i, j, facet, u, v, z, *speed, rate, 10**6)[0]
    return free, fates


@pytest.mark.parametrize("name", list(MAPS))
def test_no_ray_is_let_go_that_meets_the_surface(name):
    free, fates = send(Field.of(MAPS[name]).terrain, 8000)
    assert (fates[free] == ESCAPED).all()
    if name in ("smooth", "finite"):
        # And it is worth while: many of the rays that escape are known to
        assert free.sum() > 0.25 * (fates == ESCAPED).sum()


def test_one_peak_is_seen_from_every_block_that_looks_towards_it():
    """A needle on a plane: within 32 cells ahead a low ray is never let go."""
    heights = np.zeros((128, 128))
    heights[64, 64] = 50.0
    horizon = build_horizon(heights, True, 50.0)
    for phi in np.linspace(0.0, 2 * np.pi, 97)[:-1]:
        for distance in (3.0, 9.0, 17.0, 31.0):
            x, y = 64 - distance * np.cos(phi), 64 - distance * np.sin(phi)
            speed = (np.cos(phi), np.sin(phi), 49.0 / distance)
            assert not is_free(horizon, 50.0, int(x), int(y), 0.0, *speed)
    # Away from the needle the plane behind it sets no limit but its own height
    away = (1.0, 0.2, 50.0 / 32.0)
    assert is_free(horizon, 50.0, 66 + 16, 64, 0.0, *away)


def test_small_maps_have_no_horizon():
    """Round the period a ray would come back within what is looked at."""
    assert Field.of(HeightMap.flat(size=(1.0, 1.0))).terrain.horizon.size == 0


def test_scale_of_heights_and_steps_does_not_matter():
    """Powers of two change no bit of the answers."""
    doubled = HeightMap(SMOOTH.heights * 8.0, (8.0, 10.4), periodic=True)
    plain, other = (Field.of(map_).terrain.horizon for map_ in (SMOOTH, doubled))
    assert_array_equal(8.0 * plain, other)
