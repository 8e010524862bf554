"""De-terracing: slopes of surfaces digitised to bands, against the surfaces themselves."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import ndimage

from data_io import MendWarning, deterrace, find_bands, mend_map
from pbrdf import GaussianSurface, HeightMap
from studies.terraces.run import KINDS, digitise, draw_case

SHARES = np.arange(0.10, 0.951, 0.05)


def random_surface(slope, length, seed, shape=(192, 224), *, jagged=False):
    """Heights of a random field by its spectrum, on a cut of a larger torus."""
    rng = np.random.default_rng(seed)
    full = [2 * n for n in shape]
    f = np.hypot(np.fft.fftfreq(full[0])[:, None], np.fft.rfftfreq(full[1]))
    if jagged:
        power = (1 + (2 * np.pi * length * f) ** 2 / 3) ** -2.5
    else:
        power = np.exp(-((np.pi * length * f) ** 2))
    white = np.fft.rfft2(rng.standard_normal(full))
    z = np.fft.irfft2(white * np.sqrt(power), s=full)[: shape[0], : shape[1]]
    return z * slope / slope_rms(z)


def slopes(z):
    return np.concatenate([np.diff(z, axis=0).ravel(), np.diff(z, axis=1).ravel()])


def slope_rms(z):
    return np.sqrt(np.mean(slopes(z) ** 2))


def digitised(z, bands, noise, seed, *, top=1.0):
    """Centres of bands over the range of the heights, noise in bands added before."""
    low, width = z.min(), top * np.ptp(z) / bands
    rng = np.random.default_rng(seed)
    noisy = z + noise * width * rng.standard_normal(z.shape)
    number = np.clip(np.floor((noisy - low) / width), 0, bands - 1)
    return low + (number + 0.5) * width, width


CASES = [
    (0.15, 14, 8, 0.0, 0.0, False),
    (0.60, 9, 16, 0.0, 0.3, False),
    (0.30, 12, 64, 1.0, 0.3, False),
    (0.40, 10, 24, 1.0, 0.15, True),
]


@pytest.mark.parametrize(("slope", "length", "bands", "blur", "noise", "jagged"), CASES)
def test_slopes_between_the_bands(slope, length, bands, blur, noise, jagged):
    true = random_surface(slope, length, bands, jagged=jagged)
    true = ndimage.gaussian_filter(true, blur) if blur else true
    raw, width = digitised(true, bands, noise, 5)
    found = deterrace(HeightMap(raw, 1.0), seed=1)
    mended = found.surface.heights
    assert_allclose(found.bands.width, width, rtol=0.08)
    assert_allclose(slope_rms(mended), slope_rms(true), rtol=0.03)
    wanted = np.quantile(np.abs(slopes(true)), SHARES)
    assert_allclose(np.quantile(np.abs(slopes(mended)), SHARES), wanted, rtol=0.08)
    # As it is the map has slopes of nothing but steps
    assert abs(np.quantile(np.abs(slopes(raw)), 0.3) / wanted[4] - 1) > 0.3
    # Noise that was put in is found, and none where none was
    assert_allclose(found.noise, max(noise, 0.12) * width, rtol=0.2)


def test_the_uncertainty_is_that_of_the_heights():
    true = random_surface(0.3, 10, 7)
    raw, width = digitised(true, 16, 0.25, 3)
    smooth = deterrace(HeightMap(raw, 1.0), draw=False, seed=2)
    error = smooth.surface.heights - true
    assert np.std(error) < 0.2 * width
    ratio = np.sqrt(np.mean(smooth.uncertainty**2)) / np.sqrt(np.mean(error**2))
    assert 0.75 < ratio < 1.3
    drawn = deterrace(HeightMap(raw, 1.0), seed=2).surface.heights
    assert slope_rms(smooth.surface.heights) < slope_rms(drawn)
    assert_array_equal(drawn, deterrace(HeightMap(raw, 1.0), seed=2).surface.heights)
    assert np.std(drawn - deterrace(HeightMap(raw, 1.0), seed=3).surface.heights) > 0


@pytest.mark.parametrize("seed", [2001, 2002])
def test_the_uncertainty_is_that_of_bands_without_noise(seed):
    true, raw = digitise(draw_case("plain", seed), 256)
    smooth = deterrace(HeightMap(raw, 1.0), draw=False)
    error = smooth.surface.heights - true
    assert np.std(error) < 0.055 * smooth.bands.width
    share = np.mean(np.abs(error) < 1.96 * smooth.uncertainty)
    assert 0.92 < share < 0.985


def test_heights_stay_near_their_bands_and_holes_are_free():
    true = random_surface(0.3, 12, 11)
    raw, width = digitised(true, 12, 0.0, 3)
    raw[40:100, 50:120] = np.nan
    found = deterrace(HeightMap(raw, (0.5, 0.7)))
    mended = found.surface.heights
    beyond = np.abs(mended - raw)[np.isfinite(raw)] - width / 2
    # Noise of the least amount is all that leaves the band
    assert np.quantile(beyond, 0.999) < 0.5 * width
    assert found.surface.spacing == (0.5, 0.7)
    outside = found.uncertainty[np.isfinite(raw)].mean()
    assert found.uncertainty[60:80, 75:95].mean() > 3 * outside
    # Inside a hole there is a surface as rough as the rest, and not a membrane
    assert_allclose(slope_rms(mended[60:80, 75:95]), slope_rms(true), rtol=0.5)


def test_stretched_surfaces_on_a_turned_axis():
    surface = GaussianSurface(shape=(192, 192), spacing=1.0, corr_length=(24, 8),
                              height_rms=1.0).sample(seed=2)  # fmt: skip
    true = surface.heights
    raw, _ = digitised(true, 20, 0.2, 3)
    mended = deterrace(HeightMap(raw, 1.0, periodic=True)).surface.heights
    for axis in (0, 1):
        ratio = np.std(np.diff(mended, axis=axis)) / np.std(np.diff(true, axis=axis))
        assert abs(ratio - 1) < 0.03


def test_bands_of_a_blurred_picture_with_finer_colours():
    true = random_surface(0.3, 12, 5)
    raw, width = digitised(true, 12, 0.0, 3)
    picture = np.round(ndimage.gaussian_filter(raw, 0.5) / (width / 8)) * width / 8
    found = deterrace(HeightMap(picture, 1.0))
    # The finest step of the picture is an eighth of a band
    assert_allclose(found.bands.width, width, rtol=0.15)
    assert_allclose(slope_rms(found.surface.heights), slope_rms(true), rtol=0.03)


SMEARED = [
    (0.50, 9, 12, 0.7, 0.0, None),
    (0.30, 12, 50, 0.7, 0.0, 256),
    (0.40, 10, 24, 0.0, 0.08, None),
]


@pytest.mark.parametrize(("slope", "length", "bands", "blur", "noise", "colours"), SMEARED)
def test_pictures_smeared_after_digitisation(slope, length, bands, blur, noise, colours):
    true = random_surface(slope, length, bands)
    raw, width = digitised(true, bands, 0.0, 3)
    picture = ndimage.gaussian_filter(raw, blur) if blur else raw
    picture = picture + noise * width * np.random.default_rng(6).standard_normal(raw.shape)
    if colours is not None:
        fine = np.ptp(true) / colours
        picture = np.round(picture / fine) * fine
    found = deterrace(HeightMap(picture, 1.0), seed=1)
    assert found.bands.smeared
    assert_allclose(found.bands.width, width, rtol=0.01)
    mended = found.surface.heights
    assert_allclose(slope_rms(mended), slope_rms(true), rtol=0.03)
    wanted = np.quantile(np.abs(slopes(true)), SHARES)
    assert_allclose(np.quantile(np.abs(slopes(mended)), SHARES), wanted, rtol=0.08)


@pytest.mark.parametrize("seed", [2000, 2004, 2006, 2007])
def test_rounded_blur_adds_no_levels(seed):
    case = draw_case("blurred picture, 256 colours", seed)
    true, raw = digitise(case, 384)
    found = find_bands(raw)
    assert found.levels.size == case.bands
    assert_allclose(found.width, np.ptp(true) / case.bands, rtol=0.01)


def test_terraces_of_a_crystal_are_named_and_left():
    # Steps of 0.4 nm across a tilted face, and the noise of the microscope [um]
    noise = 4e-5 * np.random.default_rng(2).standard_normal((120, 150))
    wavy = np.add.outer(np.arange(120) / 9, np.sin(np.arange(150) / 20))
    heights = 4e-4 * np.floor(wavy) + noise
    crystal = HeightMap(heights, 0.01)
    with pytest.warns(MendWarning, match="the terraces of a crystal; left as they are"):
        assert_array_equal(mend_map(crystal).heights, heights)
    with pytest.warns(MendWarning, match="the surface under them is drawn"):
        assert np.any(mend_map(crystal, kinds="terraces").heights != heights)


def lenslets():
    """Eight levels that fall back from the last to the first, with noise."""
    noise = 0.002 * np.random.default_rng(3).standard_normal((160, 160))
    radius = np.hypot(*np.meshgrid(*2 * [np.arange(160) % 120 - 60]))
    return 0.1 * np.floor(8 * (radius / 36 % 1)) + noise


@pytest.mark.parametrize(
    "heights",
    [
        lenslets(),
        np.random.default_rng(1).normal(size=(40, 40)),
        # Rounded far below the differences of neighbours
        np.random.default_rng(1).normal(size=(60, 60)).round(2),
        # Few levels: steps, not a surface in bands
        np.sign(np.sin(np.arange(60) / 4))[:, None] * np.ones(60),
        np.zeros((30, 30)),
    ],
)
def test_other_maps_have_no_bands(heights):
    assert find_bands(heights) is None
    with pytest.raises(ValueError, match="heights must lie in bands"):
        deterrace(HeightMap(heights, 1.0))


def test_uneven_bands_of_a_colour_bar():
    true = random_surface(0.3, 12, 9)
    # The last band is 1.7 times as wide as the first
    edges = true.min() + np.ptp(true) * np.linspace(0.5, 1, 15) ** 1.8
    edges = (edges - edges[0]) * np.ptp(true) / np.ptp(edges) + true.min()
    place = np.clip(np.searchsorted(edges, true) - 1, 0, edges.size - 2)
    raw = ((edges[1:] + edges[:-1]) / 2)[place]
    found = deterrace(HeightMap(raw, 1.0))
    assert found.bands.levels.size == edges.size - 1
    assert_allclose(slope_rms(found.surface.heights), slope_rms(true), rtol=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_surfaces_of_the_study(kind):
    """Drawn over the range of the study: slopes 0.15 to 0.6, 8 to 64 bands."""
    for seed in range(3):
        true, raw = digitise(draw_case(kind, seed), 256)
        mended = deterrace(HeightMap(raw, 1.0)).surface.heights
        assert_allclose(slope_rms(mended), slope_rms(true), rtol=0.03)
        wanted = np.quantile(np.abs(slopes(true)), SHARES)
        assert_allclose(np.quantile(np.abs(slopes(mended)), SHARES), wanted, rtol=0.08)
