"""Height maps and Gaussian surfaces: slopes, heights, autocorrelation, one-seed results."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from pbrdf import GaussianSurface, HeightMap, Material, Scene, simulate

SEEDS = 300


def ensemble(surface):
    return np.array([surface.sample(seed).heights for seed in range(SEEDS)])


def close_to(sample, expected, sigmas=4.5):
    """The mean of independent values agrees with a number within its standard error."""
    stderr = sample.std(ddof=1) / np.sqrt(len(sample))
    assert abs(sample.mean() - expected) < sigmas * stderr, (
        sample.mean(),
        expected,
        stderr,
    )


@pytest.mark.parametrize(
    ("shape", "spacing", "corr_length"),
    [
        ((64, 64), 1.0, 4.0),
        # Unequal steps, lengths and sides; facets coarse enough for the correction to show
        ((64, 48), (0.5, 1.1), (2.5, 6.3)),
        ((40, 90), (1.0, 0.4), (8.0, 1.6)),
    ],
)
def test_facet_slopes_are_exact_in_the_ensemble(shape, spacing, corr_length):
    wanted = 0.31
    surface = GaussianSurface(
        shape=shape, spacing=spacing, corr_length=corr_length, slope_rms=wanted
    )
    squares = np.array(
        [[np.mean(s**2) for s in surface.sample(seed).slopes()] for seed in range(SEEDS)]
    )
    close_to(0.5 * squares.sum(axis=1), wanted**2)
    lx, ly = np.broadcast_to(corr_length, 2)
    dx, dy = np.broadcast_to(spacing, 2)
    # The structure function of exp(-r^2/l^2) at one step, written out
    share = np.array(
        [(1 - np.exp(-((d / c) ** 2))) / d**2 for d, c in ((dx, lx), (dy, ly))]
    )
    per_axis = wanted**2 * share / share.mean()
    for axis in (0, 1):
        close_to(squares[:, axis], per_axis[axis])
        assert_allclose(surface.facet_slope_rms[axis] ** 2, per_axis[axis], rtol=1e-6)


def test_heights_are_exact_in_the_ensemble_and_gaussian():
    surface = GaussianSurface(
        shape=(64, 48), spacing=(0.5, 1.1), corr_length=4.0, height_rms=0.8
    )
    heights = ensemble(surface)
    close_to((heights**2).mean(axis=(1, 2)), 0.64)
    # The mean height is random too, as the spectrum's first term is
    close_to(heights.mean(axis=(1, 2)), 0.0)
    # Fourth moment of a Gaussian: random amplitudes, not phases alone
    close_to((heights**4).mean(axis=(1, 2)), 3 * 0.8**4)
    values = heights[:, 5, 7]
    assert abs((values**4).mean() / (values**2).mean() ** 2 - 3) < 1.2
    assert surface.ensemble_height_rms == 0.8
    # Equation (19) with the facets' correction 1 - 1/(4 m^2), m cells a length
    slope = np.sqrt(2) * 0.8 / 4.0
    assert_allclose(surface.facet_slope_rms[0], slope * (1 - (0.5 / 4) ** 2 / 4), rtol=1e-4)
    assert_allclose(surface.facet_slope_rms[1], slope * (1 - (1.1 / 4) ** 2 / 4), rtol=1e-3)


@pytest.mark.parametrize("lag", [(1, 0), (0, 1), (3, 0), (0, 5), (2, 3), (2, -3), (-5, 1)])
def test_autocorrelation(lag):
    lx, ly, dx, dy = 3.0, 6.0, 0.7, 1.3
    surface = GaussianSurface(
        shape=(50, 60), spacing=(dx, dy), corr_length=(lx, ly), height_rms=1.0
    )
    heights = np.array([surface.sample(seed).heights for seed in range(150)])
    product = heights * np.roll(heights, lag, axis=(1, 2))
    expected = np.exp(-((lag[0] * dx / lx) ** 2) - (lag[1] * dy / ly) ** 2)
    close_to(product.mean(axis=(1, 2)), expected)


def test_paper_slope_grows_with_height_over_length():
    """Equation (19) for cells much finer than the correlation length."""
    surface = GaussianSurface(
        shape=(512, 512), spacing=0.5, corr_length=14.5, height_rms=2.6
    )
    assert_allclose(surface.facet_slope_rms, np.sqrt(2) * 2.6 / 14.5, rtol=5e-4)


def test_one_seed_gives_one_surface_bit_for_bit():
    surface = GaussianSurface(shape=(32, 40), spacing=1.0, corr_length=4.0, slope_rms=0.2)
    assert_array_equal(surface.sample(5).heights, surface.sample(5).heights)
    assert (surface.sample(5).heights != surface.sample(6).heights).all()
    assert (surface.sample().heights != surface.sample().heights).any()


def test_facet_slopes_of_a_height_map():
    rng = np.random.default_rng(2)
    heights = rng.standard_normal((5, 4))
    for periodic in (False, True):
        surface = HeightMap(heights, (0.5, 2.0), periodic=periodic)
        along_x, along_y = surface.slopes()
        assert along_x.shape == ((5, 4) if periodic else (4, 4))
        assert along_y.shape == ((5, 4) if periodic else (5, 3))
        assert_allclose(along_x[2, 1], (heights[3, 1] - heights[2, 1]) / 0.5)
        assert_allclose(along_y[3, 2], (heights[3, 3] - heights[3, 2]) / 2.0)
        assert surface.size == ((2.5, 8.0) if periodic else (2.0, 6.0))
    assert_allclose(along_x[4, 1], (heights[0, 1] - heights[4, 1]) / 0.5)


def test_a_height_map_keeps_its_own_copy():
    heights = np.zeros((3, 3))
    surface = HeightMap(heights, 1.0)
    heights[1, 1] = 5.0
    assert surface.heights[1, 1] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        surface.heights[0, 0] = 1.0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: HeightMap([1.0, 2.0], 1.0), "at least 2 x 2 nodes"),
        (lambda: HeightMap([[0, np.inf], [0, 0]], 1.0), r"got inf at index \(0, 1\)"),
        (lambda: HeightMap(np.zeros((3, 3)), -1.0), "spacing must be positive"),
        (lambda: HeightMap(np.zeros((3, 3)), [1, 2, 3]), "spacing"),
        (lambda: HeightMap.flat(size=(0.0, 1.0)), "size must be positive"),
        (
            lambda: GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=4.0),
            "give exactly one",
        ),
        (
            lambda: GaussianSurface(
                shape=(64, 64), spacing=1.0, corr_length=4.0, slope_rms=0.1, height_rms=1.0
            ),
            "give exactly one",
        ),
        (
            lambda: GaussianSurface(
                shape=(64, 64), spacing=1.0, corr_length=40, slope_rms=0.1
            ),
            "at least 4 corr_length",
        ),
        (
            lambda: GaussianSurface(
                shape=(4, 64), spacing=1.0, corr_length=1, slope_rms=0.1
            ),
            "at least 8 nodes",
        ),
        (
            lambda: GaussianSurface(
                shape=(64.5, 64), spacing=1.0, corr_length=4, slope_rms=0.1
            ),
            "shape",
        ),
        (
            lambda: GaussianSurface(
                shape=(64, 64), spacing=1.0, corr_length=4, slope_rms=-0.1
            ),
            "slope_rms must be positive",
        ),
    ],
)
def test_wrong_surfaces_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_a_height_map_shares_only_what_nobody_can_write_to():
    heights = np.arange(12.0).reshape(3, 4).copy()
    copied = HeightMap(heights, 1.0)
    view = heights.view()
    view.setflags(write=False)
    through_a_view = HeightMap(view, 1.0)
    heights[0, 0] = 99.0
    assert copied.heights[0, 0] == through_a_view.heights[0, 0] == 0.0
    heights.setflags(write=False)
    assert HeightMap(heights, 1.0).heights is heights


@pytest.mark.parametrize(
    ("given", "shape", "spacing"),
    [
        ({"corr_length": 16.0}, (256, 256), 2.0),
        # 16 lengths of the longer axis, an eighth of each length a step
        ({"corr_length": (4.0, 24.0)}, (256, 256), (0.5, 3.0)),
        ({"corr_length": 10.0, "spacing": 0.2}, (1024, 1024), 0.2),
        ({"corr_length": (10.0, 3.0), "spacing": 0.25}, (1024, 256), 0.25),
        ({"corr_length": 8.0, "shape": (96, 128)}, (96, 128), 1.0),
    ],
)
def test_a_surface_without_a_grid_takes_one(given, shape, spacing):
    surface = GaussianSurface(slope_rms=0.2, **given)
    assert surface.shape == shape
    assert surface.spacing == spacing
    assert surface.sample(1).shape == shape


@pytest.mark.slow
def test_the_grid_it_takes_changes_no_light_beyond_its_bound():
    """Shadows and second bounces of the default grid against one twice as fine."""
    light = []
    for given in ({}, {"spacing": 1.0, "shape": (512, 512)}):
        surface = GaussianSurface(corr_length=16.0, slope_rms=0.35, **given)
        result = simulate(
            Scene(surface, Material.mirror()), np.deg2rad(60.0), n_rays=40_000,
            realizations=48, n_theta=9, n_dphi=18, stokes="unpolarized", seed=5,
        )  # fmt: skip
        light.append((result.albedo.values.ravel(), result.albedo_stderr.values.ravel()))
    (ours, own), (finer, error) = light
    # Single and double bounces within 0.5 %, three and more within 3 %
    bound = np.array([0.005, 0.005 * ours[0] / ours[1], 0.03]) * finer
    assert np.all(np.abs(ours - finer) < bound + 3.0 * np.hypot(own, error))
