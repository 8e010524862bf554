"""Limits of wave scattering in closed form: first order, facets, sums over orders."""

import mpmath
import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import Material, MicrofacetModel, WaveModel
from pbrdf.kernels.wave.orders import EXPONENTIAL, GAUSSIAN, fill_moments
from tests.wave_by_the_book import gaussian_first_order

GEOMETRIES = [
    (0.3, 0.8, 2.1),
    (1.2, 0.5, 5.0),
    (0.0, 0.6, 1.0),
    (0.7, 0.7, np.pi),
    (1.1, 1.1, 0.0),
    (0.9, 1.3, 3.3),
]
MATERIALS = [(1.5, 0.0), (1.3, 6.9), (4.0, 0.02)]


@pytest.mark.parametrize(("n", "kappa"), MATERIALS)
@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_first_order_is_that_of_the_reciprocity_theorem(geometry, n, kappa) -> None:
    model = WaveModel(
        Material(n, kappa), height_rms=0.004, corr_length=0.7, method="first-order"
    )
    expected = gaussian_first_order(*geometry, 0.55, complex(n, kappa), 0.004, 0.7)
    found = model.brdf(*geometry, 0.55)
    assert_allclose(found, expected, rtol=1e-11, atol=1e-12 * expected[0, 0])


@pytest.mark.parametrize("method", ["auto", "order-weighted", "local-curvature"])
@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_smooth_surfaces_scatter_by_first_order(geometry, method) -> None:
    # So short a length that order 2 is small in every direction
    height, length = 1e-7, 0.2
    model = WaveModel(
        Material(1.3, 6.9), height_rms=height, corr_length=length, method=method
    )
    expected = gaussian_first_order(*geometry, 0.55, 1.3 + 6.9j, height, length)
    found = model.brdf(*geometry, 0.55)
    assert_allclose(found, expected, rtol=1e-10, atol=1e-10 * expected[0, 0])


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_a_conductor_is_the_limit_of_a_large_index(geometry) -> None:
    given = {"height_rms": 0.05, "corr_length": 0.6}
    mirror = WaveModel(Material.mirror(), **given).brdf(*geometry, 0.5)
    metal = WaveModel(Material(1e6), **given).brdf(*geometry, 0.5)
    assert_allclose(metal, mirror, rtol=0, atol=2e-5 * mirror[0, 0])


@pytest.mark.parametrize("geometry", GEOMETRIES)
@pytest.mark.parametrize(("n", "kappa"), MATERIALS)
def test_facets_without_waves_are_those_of_the_microfacet_model(geometry, n, kappa) -> None:
    material = Material(n, kappa)
    facets = WaveModel(material, height_rms=2.0, corr_length=14.0, method="geometric").brdf(
        *geometry, 0.5
    )
    slope = np.sqrt(2) * 2.0 / 14.0
    expected = MicrofacetModel(material, slope_rms=slope, shadowing="none").brdf(*geometry)
    hidden = facets[0, 0] / expected[0, 0]
    assert 0.5 < hidden <= 1.0 + 1e-12
    assert_allclose(facets, hidden * expected, rtol=1e-9, atol=1e-11 * facets[0, 0])


@pytest.mark.parametrize("method", ["auto", "order-weighted", "kirchhoff"])
def test_rough_surfaces_scatter_as_facets(method) -> None:
    theta_s = np.linspace(0.0, 1.0, 6)
    dphi = np.linspace(np.pi, 2.4, 6)
    given = {"height_rms": 8.0, "corr_length": 60.0}
    wave = WaveModel(Material(1.3, 6.9), method=method, **given)
    facets = WaveModel(Material(1.3, 6.9), method="geometric", **given)
    found, expected = (m.brdf(0.5, theta_s, dphi, 0.5) for m in (wave, facets))
    assert_allclose(found, expected, rtol=0, atol=2e-3 * expected[:, :1, :1].max())


@pytest.mark.parametrize("law", [GAUSSIAN, EXPONENTIAL])
@pytest.mark.parametrize("dimensions", [1, 2])
@pytest.mark.parametrize("g", [1e-4, 0.7, 40.0, 130.0, 5e3])
@pytest.mark.parametrize("kappa", [0.0, 3.0, 700.0])
def test_sums_over_orders_take_every_order(law, dimensions, g, kappa) -> None:
    if law == GAUSSIAN and g * kappa < 1.0 and kappa > 100:
        pytest.skip("below the smallest number")
    length = 1.7
    wave = 2 * np.sqrt(kappa) / length
    found = np.empty((5, 1))
    one = np.ones(1)
    fill_moments(law, dimensions, np.sqrt(g) * one, length * one, wave * one, one, found)
    # Every order about the heaviest, in the digits of mpmath
    bound = int(g + 14 * np.sqrt(g) + 60 + 3 * np.sqrt(kappa))
    least = max(1, int(g - 14 * np.sqrt(g) - 30))
    mpmath.mp.dps = 30
    total = [mpmath.mpf(0)] * 5
    weight = mpmath.exp(
        -mpmath.mpf(g) + (least - 1) * mpmath.log(g) - mpmath.loggamma(least)
    )
    for n in range(least, bound):
        weight *= mpmath.mpf(g) / n
        if law == GAUSSIAN:
            unit = mpmath.sqrt(mpmath.pi / n) ** dimensions
            spectrum = unit * length**dimensions * mpmath.exp(-mpmath.mpf(kappa) / n)
        else:
            fall = 1 + (mpmath.mpf(wave) * length / n) ** 2
            unit = 2 * length / n if dimensions == 1 else 2 * mpmath.pi * (length / n) ** 2
            spectrum = unit / fall ** (1 if dimensions == 1 else mpmath.mpf(3) / 2)
        for j, power in enumerate((2, 1, 0, -1, -2)):
            total[j] += weight * spectrum * mpmath.mpf(n) ** power
    assert_allclose(found[:, 0], [float(t) for t in total], rtol=3e-12)
