"""Surfaces that corrections do not apply to: planes, lattices, waves, offsets, slopes."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import ndimage

from data_io import Profile, read_height_map, read_profile
from fitting import surface_statistics
from pbrdf import HeightMap

CASES = Path(__file__).parents[1] / "cases" / "surface"


@pytest.mark.parametrize("name", ["line.csv", "plane2.csv"])
def test_exact_planes_have_no_roughness(name):
    reader = read_profile if name == "line.csv" else read_height_map
    found = surface_statistics(reader(CASES / name, unit="um"))
    for estimate in (found.height_rms, found.slope_rms, found.noise_rms):
        assert (estimate.value, estimate.stderr, estimate.high) == (0, 0, 0)
    assert all(axis.slope_rms.value == 0 for axis in found.axes)
    assert "exact to the digits" in found.warnings[0]
    assert "slope_rms  0" in str(found)
    assert found.to_dict()["slope_rms"]["value"] == 0


def test_facets_of_a_lattice_keep_their_slope():
    i, j = np.arange(200), np.arange(160)
    ridge = np.add.outer(0.1 * np.abs((i + 13) % 20 - 10), 0.05 * np.abs((j + 3) % 14 - 7))
    found = surface_statistics(HeightMap(ridge, (1.0, 0.5)))
    assert_allclose([a.slope_rms.value for a in found.axes], 0.1, rtol=2e-3)
    assert_allclose(found.slope_rms.value, 0.1, rtol=2e-3)
    assert found.quantisation == 0
    assert "neighbours differ by 0.1 um almost everywhere" in found.warnings[0]


def test_a_square_wave_keeps_its_height():
    wave = np.sign(np.sin(np.arange(600) / 9 + 0.1))
    found = surface_statistics(SimpleNamespace(x=np.arange(600.0), z=wave))
    assert_allclose(found.height_rms.value, 1, rtol=0.01)
    jumps = np.count_nonzero(np.diff(wave))
    assert_allclose(found.slope_rms.value, np.sqrt(4 * jumps / 599), rtol=0.01)
    assert "two levels only" in found.warnings[0]
    # It may as well be a surface rounded beyond recognition
    assert not found.reliable


def test_offsets_between_rows_are_named():
    rng = np.random.default_rng(3)
    smooth = ndimage.gaussian_filter(rng.standard_normal((160, 160)), 5, mode="wrap")
    smooth *= 0.3 / np.std(np.diff(smooth, axis=0))
    offset = smooth + 0.5 * rng.standard_normal(160)
    found = surface_statistics(HeightMap(offset, 1.0))
    assert "rows are offset from each other by 0." in found.warnings[0]
    assert not found.reliable
    sound = surface_statistics(HeightMap(smooth, 1.0))
    assert not any("offset" in text for text in sound.warnings)


def test_the_slope_of_a_slope_profile_is_the_measured_one():
    rng = np.random.default_rng(5)
    slope = 2e-6 * ndimage.gaussian_filter1d(rng.standard_normal(4000), 6, mode="wrap")
    slope *= 3e-6 / np.std(slope)
    profile = Profile.from_slope(100.0 * np.arange(4000), slope + 1e-3)
    found = surface_statistics(profile)
    # A tilt of a milliradian is form, and no roughness
    assert_allclose(found.slope_rms.value, 3e-6, rtol=0.02)
    assert found.slope_rms.low < 3e-6 < found.slope_rms.high


def test_uneven_bands_are_drawn_over():
    rng = np.random.default_rng(8)
    white = np.fft.rfft2(rng.standard_normal((384, 384)))
    f = np.hypot(np.fft.fftfreq(384)[:, None], np.fft.rfftfreq(384))
    true = np.fft.irfft2(white * np.exp(-((np.pi * 12 * f) ** 2) / 2))[:192, :192]
    true *= 0.3 / np.sqrt(np.mean(np.diff(true, axis=0) ** 2))
    wanted = np.sqrt(sum(np.mean(np.diff(true, axis=k) ** 2) for k in (0, 1)) / 2)
    width = np.ptp(true) / 16
    picture = ndimage.gaussian_filter(np.round(true / width) * width, 0.5)
    picture = np.round(picture / (width / 8)) * (width / 8)
    found = surface_statistics(HeightMap(picture, 1.0))
    assert "bands of" in found.warnings[0]
    assert_allclose(found.slope_rms.value, wanted, rtol=0.03)
