"""Fine structure on facets: its limits, its energy, and waves over both scales at once."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import Material, MicrofacetModel, WaveModel
from pbrdf.optics import coherency_eigenvalues
from pbrdf.wave import TwoScaleModel

METAL = Material(1.2, 6.9)
COARSE, FINE = (1.5, 15.0), (0.05, 0.5)
SLOPE = np.sqrt(2) * COARSE[0] / COARSE[1]
VIEWS = (0.6, np.array([0.1, 0.4, 0.6, 0.9]), np.array([np.pi, 2.8, 3.3, 2.5]))


def test_smooth_facets_are_those_of_the_microfacet_model():
    smooth = WaveModel(Material(1.5, 0.2), height_rms=1e-6, corr_length=0.5)
    found = TwoScaleModel(smooth, SLOPE).brdf(*VIEWS, 0.6)
    facets = MicrofacetModel(Material(1.5, 0.2), slope_rms=SLOPE, shadowing="none")
    expected = facets.brdf(*VIEWS)
    assert_allclose(found, expected, atol=2e-4 * expected[:, :1, :1].max())


def test_level_facets_are_the_fine_structure():
    fine = WaveModel(METAL, height_rms=FINE[0], corr_length=FINE[1])
    _, scattered = TwoScaleModel(fine, 1e-3).parts(*VIEWS, 1.0)
    assert_allclose(scattered, fine.brdf(*VIEWS, 1.0), atol=2e-5 * scattered[0, 0, 0])


@pytest.mark.parametrize("material", [METAL, Material(1.5), Material.mirror()])
def test_waves_over_both_scales_say_the_same(material):
    """One wave model with both scales in its autocorrelation shares no step with it."""
    fine = WaveModel(material, height_rms=FINE[0], corr_length=FINE[1])
    two = TwoScaleModel(fine, SLOPE)
    variance = COARSE[0] ** 2 + FINE[0] ** 2

    def correlation(x):
        return sum(h * h * np.exp(-((x / length) ** 2)) for h, length in (COARSE, FINE)) / (
            variance
        )

    whole = WaveModel(
        material, height_rms=np.sqrt(variance), autocorrelation=correlation
    ).brdf(*VIEWS, 1.0)
    found = two.brdf(*VIEWS, 1.0)
    scale = whole[:, :1, :1]
    assert (np.abs(found - whole) / scale)[:, 0, 0].max() < 0.025
    assert (np.abs(found - whole) / scale).max() < 0.06
    # Facets alone would be off by the third that the fine structure takes
    facets = MicrofacetModel(material, slope_rms=SLOPE).brdf(*VIEWS)
    assert np.abs(facets[1, 0, 0] / whole[1, 0, 0] - 1) > 0.15


def test_two_scales_obey_the_laws():
    fine = WaveModel(METAL, height_rms=0.06, corr_length=0.7)
    model = TwoScaleModel(fine, 0.2)
    rng = np.random.default_rng(4)
    theta_i, theta_s = rng.uniform(0.0, 1.5, (2, 20))
    dphi = rng.uniform(0.0, 2 * np.pi, 20)
    theta_i[0], theta_s[1], theta_i[2:4], theta_s[2:4], dphi[2] = 0.0, 0.0, 0.8, 0.8, np.pi
    dphi[3] = 0.0
    found = model.brdf(theta_i, theta_s, dphi, 0.6)
    back = model.brdf(theta_s, theta_i, -dphi, 0.6)
    p, scale = np.diag([1.0, 1.0, -1.0, 1.0]), found[:, :1, :1]
    assert (np.abs(back - p @ found.swapaxes(1, 2) @ p) / scale).max() < 1e-11
    flip = np.ones((4, 4))
    flip[:2, 2:] = flip[2:, :2] = -1
    mirrored = model.brdf(theta_i, theta_s, -dphi, 0.6)
    assert (np.abs(mirrored - flip * found) / scale).max() < 1e-11
    assert coherency_eigenvalues(found / scale).min() > -1e-12


def test_what_is_taken_from_the_facets_is_scattered():
    fine = WaveModel(Material.mirror(), height_rms=FINE[0], corr_length=FINE[1])
    shares = TwoScaleModel(fine, 0.1).shares(0.3, 1.0)
    alone = fine.energy(0.3, 1.0)
    assert shares["mirrored"] == pytest.approx(float(alone.coherent), abs=0.01)
    assert abs(shares["rest"]) < 0.02
    assert shares["scattered"] > 0.2


def test_what_two_scales_do_not_know():
    with pytest.raises(ValueError, match="fine must be isotropic"):
        TwoScaleModel(WaveModel(METAL, height_rms=0.1, corr_length=(1.0, 2.0)), 0.1)
    with pytest.raises(ValueError, match="slope_rms must lie in"):
        TwoScaleModel(WaveModel(METAL, height_rms=0.1, corr_length=1.0), 0.0)
