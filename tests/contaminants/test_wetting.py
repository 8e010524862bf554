"""Contact angles on rough surfaces, against published formulas."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import erfc

from pbrdf import GaussianSurface, HeightMap
from pbrdf.contaminants.ground import Ground
from pbrdf.contaminants.wetting import (
    cassie_contact_angle,
    effective_contact_angle,
    hemiwicking_angle,
    wenzel_contact_angle,
    wenzel_factor,
    young_contact_angle,
)


def gaussian(slope, length=8.0):
    return GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=length, slope_rms=slope)


@pytest.mark.parametrize(
    ("slope", "factor", "angle"),
    [(0.05, 1.00249, 14.46), (0.15, 1.0220, 9.18), (0.30, 1.0835, 0.0), (0.47, 1.189, 0.0)],
)
def test_wenzel_numbers_of_gaussian_surfaces(slope, factor, angle):
    found = wenzel_factor(gaussian(slope))
    exact = 1 + slope * np.sqrt(np.pi / 2) * np.exp(0.5 / slope**2) * erfc(
        1 / (slope * np.sqrt(2))
    )
    assert_allclose(found, exact, rtol=1e-9)
    assert_allclose(found, factor, atol=6e-4)
    degrees = np.rad2deg(wenzel_contact_angle(np.deg2rad(15.0), found))
    assert_allclose(degrees, angle, atol=0.02)


def test_complete_wetting_starts_where_wenzel_says():
    # r = 1 / cos 15° at the slope 0.191005, by bisection of the closed form
    slopes = np.array([0.1909, 0.1911])
    wet = [wenzel_contact_angle(np.deg2rad(15.0), wenzel_factor(gaussian(s))) == 0.0
           for s in slopes]  # fmt: skip
    assert wet == [False, True]


def test_factor_of_a_map_is_the_area_of_its_facets():
    # A roof of slope 3/4 along x, level along y: every facet is 5/4 of its projection
    x = np.array([0.0, 1.0, 2.0, 1.0])
    roof = HeightMap(np.repeat(0.75 * x[:, None], 3, axis=1), 1.0, periodic=True)
    assert_allclose(wenzel_factor(roof), 1.25, rtol=1e-14)
    anisotropic = GaussianSurface(
        shape=(256, 256), spacing=1.0, corr_length=(6, 20), slope_rms=0.3
    )
    samples = [wenzel_factor(anisotropic.sample(seed)) for seed in range(12)]
    error = np.std(samples, ddof=1) / np.sqrt(12)
    assert abs(np.mean(samples) - wenzel_factor(anisotropic)) < 4 * error


def test_young_cassie_and_hemiwicking():
    assert_allclose(
        young_contact_angle(gamma_sv=[10.0, 60.0, 0.0], gamma_sl=[46.375, 10.0, 90.0],
                            gamma_lv=72.75),
        [np.deg2rad(120.0), np.arccos(50 / 72.75), np.pi],
    )  # fmt: skip
    # 179 degrees of a solid with 119 needs a solid fraction of 3e-4
    assert_allclose(
        cassie_contact_angle(np.deg2rad(119.0), 2.956e-4), np.deg2rad(179.0), rtol=1e-5
    )
    # Without tops that stay dry the law is Wenzel's cos θ = 1/r
    assert_allclose(np.cos(hemiwicking_angle(1.0835)), 1 / 1.0835)
    assert_allclose(np.cos(hemiwicking_angle(2.0, 0.25)), 0.75 / 1.75)
    with pytest.raises(ValueError, match="gamma_lv must be positive"):
        young_contact_angle(gamma_sv=1.0, gamma_sl=1.0, gamma_lv=0.0)


@pytest.mark.parametrize(("degrees", "told"), [(40.0, True), (60.0, False), (140.0, True)])
def test_roughness_is_told_where_it_changes_the_angle_beyond_half_a_hysteresis(
    degrees, told
):
    # Wenzel's factor 1.083 turns 40, 60 and 140 degrees into 33.9, 57.2 and 146.1
    ground = Ground(gaussian(0.3).sample(3))
    angle, notes = effective_contact_angle(np.deg2rad(degrees), ground, "warn")
    assert angle == np.deg2rad(degrees)
    assert any("Wenzel's law" in note for note in notes) == told
    assert effective_contact_angle(np.deg2rad(degrees), ground, "ignore")[1] == []
