"""Detector bins: their projected solid angle, and the light of known patterns in them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from pbrdf import GaussianSurface, HeightMap, Material, Scene, simulate
from pbrdf.conventions import detector_bins


@pytest.mark.parametrize(("n_theta", "n_dphi"), [(1, 2), (18, 36), (45, 90), (7, 10)])
def test_projected_solid_angle_is_the_integral_of_the_cosine(n_theta, n_dphi):
    theta_s, dphi, weight = detector_bins(n_theta, n_dphi)
    width = np.pi / 2 / n_theta
    assert_allclose(theta_s, (np.arange(n_theta) + 0.5) * width)
    # Bins are centred on 0 and on pi
    assert dphi[0] == 0
    assert_allclose(dphi[n_dphi // 2], np.pi)
    ring = [
        quad(lambda t: np.cos(t) * np.sin(t), a, a + width, epsabs=0)[0]
        for a in np.arange(n_theta) * width
    ]
    assert_allclose(weight, np.tile(np.array(ring)[:, None] * 2 * np.pi / n_dphi, n_dphi))
    assert_allclose(weight.sum(), np.pi)


@pytest.mark.parametrize(("n_theta", "n_dphi"), [(9, 12), (45, 90)])
@pytest.mark.parametrize("theta_deg", [[10.0, 60.0], 75.0])
def test_bins_add_up_to_the_albedo(n_theta, n_dphi, theta_deg):
    surface = GaussianSurface(shape=(80, 80), spacing=0.5, corr_length=4.0, slope_rms=0.4)
    result = simulate(
        Scene(surface, Material(1.3, 0.7)), np.deg2rad(theta_deg), n_rays=2000,
        realizations=8, n_theta=n_theta, n_dphi=n_dphi, phi_i=0.5,
    )  # fmt: skip
    weight = result.projected_solid_angle
    m00 = result.brdf.sel(stokes_out="I", stokes_in="I")
    assert_allclose((m00 * weight).sum(("theta_s", "dphi")), result.albedo, rtol=1e-12)
    assert_allclose(result.brdf.sum("bounces"), result.brdf_total, rtol=1e-12, atol=1e-15)
    lost = result.absorbed + result.truncated + result.leaked + result.transmitted
    assert_allclose(result.albedo.sum("bounces") + lost, 1.0, rtol=1e-12)


def cap(radius, half_angle, nodes, period):
    """A mirror cap of a sphere on a mirror plane, periodic."""
    x = (np.arange(nodes) + 0.5) / nodes * period - period / 2
    r2 = x[:, None] ** 2 + x[None, :] ** 2
    floor = radius * np.cos(half_angle)
    return np.maximum(np.sqrt(np.maximum(radius**2 - r2, floor**2)) - floor, 0.0)


def facet_flux(surface, n_theta, n_dphi):
    """Share of vertical light that single reflections put in each bin, by facet."""
    dx, dy = surface.spacing
    z = surface.heights
    right, up = np.roll(z, -1, axis=0), np.roll(z, -1, axis=1)
    diagonal = np.roll(right, -1, axis=1)
    slope_x = np.stack([right - z, diagonal - up]).ravel() / dx
    slope_y = np.stack([diagonal - right, up - z]).ravel() / dy
    # A facet of tilt t sends vertical light to the zenith angle 2 t, downhill
    theta = 2 * np.arctan(np.hypot(slope_x, slope_y))
    phi = np.arctan2(-slope_y, -slope_x)
    i_theta = np.floor(theta / (np.pi / 2) * n_theta).astype(int)
    i_dphi = np.floor(phi / (2 * np.pi) * n_dphi + 0.5).astype(int) % n_dphi
    flux = np.zeros((n_theta, n_dphi))
    np.add.at(flux, (i_theta, i_dphi), 1.0 / len(theta))
    return flux


def test_b24_cap_of_a_mirror_sphere_spreads_light_evenly_over_solid_angle():
    """Checks C9 and C11: R^2/4 a steradian within twice the half angle, in every bin.

    Light that comes down on a cap of half angle 32.5 degrees leaves within 65 degrees of
    the zenith, above every facet: one bounce, and f = R^2 / (4 A cos theta_s).
    """
    nodes, period, radius = 800, 2.2, 2.0
    half_angle = np.deg2rad(32.5)
    surface = HeightMap(
        cap(radius, half_angle, nodes, period), period / nodes, periodic=True
    )
    result = simulate(
        Scene(surface, Material.mirror()), 0.0, n_rays=2_000_000, n_theta=18, n_dphi=8,
        stokes="unpolarized",
    )  # fmt: skip
    assert_allclose(result.albedo.sel(bounces="1"), 1.0, atol=1e-9)
    f = result.brdf_total.isel(theta_i=0, stokes_out=0, stokes_in=0)
    weight = result.projected_solid_angle
    facets = facet_flux(surface, 18, 8)
    assert_allclose((f * weight).sum("dphi")[:13], facets.sum(axis=1)[:13], rtol=1e-3)
    assert_allclose((f * weight)[1:12], facets[1:12], rtol=1e-2)
    assert f.isel(theta_s=slice(13, None)).values.max() == 0
    # Bin average of 1 / cos theta_s: solid angle over projected solid angle. Bin 0 holds
    # the plane; facets across the rim, 2 steps a radius of the cap, add to the inner bins
    edges = np.linspace(0, np.pi / 2, 19)
    solid = (np.cos(edges[:-1]) - np.cos(edges[1:])) * 2 * np.pi / 8
    expected = radius**2 / (4 * period**2) * solid[:, None] / weight
    ratio = (f / expected).isel(theta_s=slice(4, 12)).mean("dphi")
    rim = 2 * (period / nodes) / (radius * np.sin(half_angle))
    assert 1 - 2e-3 < ratio.values.min() < ratio.values.max() < 1 + rim + 2e-3
