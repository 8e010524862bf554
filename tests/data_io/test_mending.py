"""Faults put into made surfaces: found, counted, mended; sound surfaces left alone."""

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from data_io import MendedMap, MendWarning, mend_map
from data_io.mending.sentinels import find_spikes_along
from pbrdf import HeightMap


def surface(seed=0, n=160, length=9.0, slope=0.3):
    """Random heights with the slope asked for along both axes."""
    rng = np.random.default_rng(seed)
    f = np.hypot(np.fft.fftfreq(2 * n)[:, None], np.fft.rfftfreq(2 * n))
    white = np.fft.rfft2(rng.standard_normal((2 * n, 2 * n)))
    z = np.fft.irfft2(white * np.exp(-((np.pi * length * f) ** 2) / 2))[:n, :n]
    return z * slope / np.sqrt((slope_rms(z, 0) ** 2 + slope_rms(z, 1) ** 2) / 2)


def slope_rms(z, axis):
    return np.sqrt(np.nanmean(np.diff(z, axis=axis) ** 2))


TRUE = surface()
RNG = np.random.default_rng(4)
NOISE = 0.01 * RNG.standard_normal(TRUE.shape)


def with_zeros(level):
    z = TRUE + level
    z[30:40, 50:58] = 0
    return z


def with_values():
    z = TRUE.copy()
    z[5, 5], z[9, 60] = -9999, 1e30
    return z


def with_spikes():
    z = TRUE + NOISE
    z[17::31, 11::29] += 4
    return z


def with_offsets(axis):
    offsets = 0.3 * np.random.default_rng(8).standard_normal(TRUE.shape[axis])
    return TRUE + NOISE + (offsets if axis else offsets[:, None])


def with_lost_lines():
    z = TRUE + NOISE
    z[:, 70] = z[:, 69]
    z[:, 120] = 3 * RNG.standard_normal(len(z)) + 2
    return z


@pytest.mark.parametrize(
    ("heights", "kind", "count", "text"),
    [
        (with_zeros(1), "sentinels", 80, "80 of 25600 heights are 0"),
        (with_zeros(50), "sentinels", 80, "80 of 25600 heights are 0"),
        (with_values(), "sentinels", 2, "are -9999, 1e"),
        (with_spikes(), "spikes", 30, "30 of 25600 heights jump"),
        (with_offsets(1), "offsets", 160, "rows are offset .* by 0.2"),
        (with_offsets(0), "offsets", 160, "columns are offset .* by 0.2"),
        (with_lost_lines(), "lines", 320, "rows 71, 121"),
    ],
)
def test_faults_are_named_counted_and_mended(heights, kind, count, text):
    assert max(slope_rms(heights, axis) for axis in (0, 1)) > 0.3
    with pytest.warns(MendWarning, match=text):
        mended = mend_map(HeightMap(heights, 1.0))
    assert [(one.kind, one.count) for one in mended.mends] == [(kind, count)]
    for axis in (0, 1):
        assert_allclose(slope_rms(mended.heights, axis), slope_rms(TRUE, axis), rtol=0.02)
    assert_array_equal(mended.raw.heights, heights)
    with pytest.warns(MendWarning, match="left as they are"):
        left = mend_map(HeightMap(heights, 1.0), kinds="none")
    assert_array_equal(left.heights, heights)
    assert not left.mends[0].mended


GROOVES = np.sin(np.arange(160) / 5.0) * np.ones((160, 1))
WALK = np.cumsum(0.1 * RNG.choice([-1, 1], size=(160, 160)), axis=0)
X, Y = np.mgrid[:160, :160]
PARTICLES = sum(
    3 * np.exp(-((X - a) ** 2 + (Y - b) ** 2) / (2 * 1.2**2))
    for a, b in RNG.uniform(5, 155, (9, 2))
)
SCRATCH = np.where(np.abs(X + Y / 2 - 110) < 1.5, -2.0, 0.0)
HONED = np.minimum(TRUE, np.quantile(TRUE, 0.7))
EDGE = np.where(np.add.outer(np.arange(160), np.arange(160)) > 170, 3.0, 0.0)


@pytest.mark.parametrize(
    "heights",
    [
        TRUE,
        TRUE + 3 * NOISE,
        RNG.standard_normal((120, 120)),
        GROOVES,
        GROOVES.T + NOISE,
        TRUE[:1].repeat(160, 0) + NOISE,
        WALK,
        np.sign(GROOVES),
        EDGE + NOISE,
        np.outer(np.sin(np.arange(64) / 7), np.cos(np.arange(64) / 9)),
        np.add.outer(0.1 * np.arange(60), 0.2 * np.arange(60)),
        np.zeros((40, 40)),
        np.exp(TRUE),
        # Smooth, with much steeper edges than inside is curved
        surface(1, n=200, length=20.0) + 0.5 * np.arange(200),
        np.exp(0.8 * surface(2, length=12.0)),
        surface(3) ** 3,
        PARTICLES + 0.05 * TRUE + NOISE,
        SCRATCH + 0.1 * TRUE + NOISE,
        HONED,
    ],
)
def test_sound_surfaces_are_left_alone(heights):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = mend_map(HeightMap(heights, 1.0))
    assert not isinstance(found, MendedMap)


def test_a_needle_makes_no_line_lost():
    z = 0.05 * TRUE + NOISE
    z[40:42, 70] += 3
    with pytest.warns(MendWarning, match="2 of 25600 heights jump"):
        mended = mend_map(HeightMap(z, 1.0))
    assert_array_equal(np.argwhere(np.isnan(mended.heights)), [[40, 70], [41, 70]])


def test_terraces_are_drawn_with_their_uncertainty():
    width = 0.4
    raw = np.round((TRUE + 5 * NOISE) / width) * width
    raw[20:30, 40:60] = np.nan
    with pytest.warns(MendWarning, match=r"heights are equal, in \d+ bands of 0.4"):
        mended = mend_map(HeightMap(raw, 1.0))
    for axis in (0, 1):
        assert_allclose(slope_rms(mended.heights, axis), slope_rms(TRUE, axis), rtol=0.03)
    # Nothing is invented where nothing was measured
    assert_array_equal(np.isnan(mended.heights), np.isnan(raw))
    assert 0.02 * width < np.nanmean(mended.uncertainty) < 0.3 * width


def test_an_unknown_kind_is_refused():
    with pytest.raises(ValueError, match=r"mend must be all, none or some .* 'dust'"):
        mend_map(HeightMap(TRUE, 1.0), kinds="spikes,dust")


@pytest.mark.parametrize("size", [20, 60, 199])
def test_one_jump_of_a_short_profile_is_found(size):
    x = np.arange(float(size))
    z = np.sin(x / 4)
    z[7] += 9
    assert_array_equal(np.flatnonzero(find_spikes_along(x, z)), 7)
    assert not find_spikes_along(x, np.sin(x / 4)).any()
