"""Signatures of traced scenes: the furnace by two ways, and against the closed model."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import pbrdf
from pbrdf import (
    Drops,
    Film,
    GaussianSurface,
    Material,
    MicrofacetModel,
    Scene,
    WaveModel,
)
from pbrdf.errors import AccuracyWarning
from pbrdf.signatures import OvercastSky, RayleighSky, Sun, ThermalSky, black_body

ROUGH = GaussianSurface(shape=(96, 96), spacing=1.0, corr_length=6.0, slope_rms=0.25)
PAINT = Material(1.5, 0.3)
COUNTS = {"n_rays": 4000, "realizations": 16, "n_theta": 18, "n_dphi": 24}


@pytest.fixture(scope="module")
def traced() -> object:
    return pbrdf.simulate(
        Scene(ROUGH, PAINT), [0.3, 0.9], phi_i="uniform", seed=5,
        **(COUNTS | {"n_rays": 20_000}),
    )  # fmt: skip


SCENES = {
    "rough": Scene(ROUGH, PAINT),
    "glass over paint": Scene(ROUGH, Material(1.5, diffuse_albedo=0.5)),
    "steep metal": Scene(replace(ROUGH, slope_rms=0.6), Material(1.2, 4.0)),
    "film": Scene(ROUGH, PAINT, (Film(thickness=30.0, material=Material(1.33)),)),
    "drops": Scene(
        ROUGH,
        PAINT,
        (
            Drops(
                contact_angle=1.2,
                coverage=0.2,
                number_density=1e-3,
                material=Material(1.33),
                seed=3,
            ),
        ),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_furnace_of_scenes(name: str) -> None:
    """Emission at a sensor by reciprocity, reflection traced forward from the whole sky.

    The sky is a quadrature of incidences, Gauss-Legendre in sin^2; what they send into the
    bins about the sensor and what the surface emits there make a black body without
    polarisation, within 3.5 standard errors of each element in each of two bins.
    """
    node, weight = np.polynomial.legendre.leggauss(10)
    incidences = np.arcsin(np.sqrt(0.5 + 0.5 * node))
    forward = pbrdf.simulate(SCENES[name], incidences, phi_i="uniform", seed=1, **COUNTS)
    # Per incidence pi * weight/2 of projected solid angle, over all azimuths alike
    share = pi * 0.5 * weight
    column = forward.brdf_total[..., 0].mean("dphi").to_numpy()
    stderr = forward.brdf_total_stderr[..., 0].to_numpy()
    for ring in (4, 9):
        view = float(forward.theta_s[ring])
        # Geometric optics knows no wavelength; only Planck's law does
        traced = pbrdf.simulate(SCENES[name], [view], phi_i="uniform", seed=2, **COUNTS)
        seen = pbrdf.signature(traced, view, wavelength=10.0, temperature=300.0)
        reflected = (share[:, None] * column[:, ring]).sum(0)
        # Rings of bins of one surface may err together
        spread = np.sqrt(((share[:, None] * stderr[:, ring].mean(1)) ** 2).sum(0))
        both = reflected + seen.emissivity.to_numpy()
        error = np.hypot(spread, seen.emissivity_stderr.to_numpy())
        assert (error < 0.03).all()
        assert (np.abs(both - [1, 0, 0, 0]) < 3.5 * error + 1e-12).all(), (both, error)


def test_isothermal_sky_and_surface_are_black_and_the_parts_are_not(traced) -> None:
    body = float(black_body(10.0, 300.0))
    seen = pbrdf.signature(
        traced, 0.9, wavelength=10.0, sky=ThermalSky(temperature=300.0), temperature=300.0
    )
    assert_allclose(seen.radiance, [body, 0, 0, 0], atol=1e-12 * body)
    # Both parts come of the same rays, so their errors cancel too
    assert_allclose(seen.radiance_stderr, 0.0, atol=1e-9 * body)
    assert seen.emissivity[1] < -10 * seen.emissivity_stderr[1]
    assert_allclose(
        seen.emissivity[2:], 0.0, atol=4 * float(seen.emissivity_stderr[2:].max())
    )
    assert_allclose(seen.emissivity[0], 1 - traced.albedo.sum("bounces")[1], rtol=1e-12)


def test_a_traced_surface_and_the_model_agree_under_sun_and_sky(traced) -> None:
    """Frames and signs by two ways: bins by reciprocity, the closed form forward."""
    sun = Sun(theta=0.75, phi=2.0)
    sky = RayleighSky(sun=sun, optical_depth=0.2)
    model = MicrofacetModel(PAINT, slope_rms=0.25)
    # The model knows one bounce
    single = traced.assign(brdf_total=traced.brdf.sel(bounces="1", drop=True))
    for light in ({"sky": sky}, {"sun": sun}):
        simulated = pbrdf.signature(single, [0.3, 0.9], phi_s=0.5, **light)
        closed = pbrdf.signature(model, [0.3, 0.9], phi_s=0.5, rel_error=1e-4, **light)
        error = simulated.radiance_stderr.to_numpy()
        peak = float(closed.radiance[..., 0].max())
        # The model's heights are uncorrelated, and the sun is smeared over bins
        difference = np.abs(simulated.radiance - closed.radiance).to_numpy()
        assert (difference < 0.03 * peak + 3 * error).all()
        assert error.max() < 0.06 * peak
        assert np.abs(closed.radiance[..., 2]).max() > 0.05 * peak


def test_sunlight_by_the_suns_incidence_and_by_the_sensors(traced) -> None:
    """Sensor and sun exchange places: two different traces of one matrix."""
    there = pbrdf.signature(traced, 0.3, phi_s=1.0, sun=Sun(theta=0.9, phi=-1.0))
    only_sun = traced.isel(theta_i=[1])
    back = pbrdf.signature(only_sun, 0.3, phi_s=1.0, sun=Sun(theta=0.9, phi=-1.0))
    error = np.hypot(there.radiance_stderr, back.radiance_stderr)
    difference = np.abs(there.radiance - back.radiance)
    assert (difference < 4 * error + 0.02 * there.radiance[0]).all()
    assert abs(there.radiance[2]) > 0.05 * there.radiance[0]


def test_refusals_name_what_is_missing(traced) -> None:
    cloud = OvercastSky(radiance=1.0)
    with pytest.raises(ValueError, match="theta_s must be an incident zenith"):
        pbrdf.signature(traced, 0.5, sky=cloud)
    with pytest.raises(ValueError, match='stokes="full"'):
        pbrdf.signature(traced.isel(stokes_out=[0], stokes_in=[0]), 0.3, sky=cloud)
    fixed = traced.assign_attrs(phi_i=0.0)
    with pytest.warns(AccuracyWarning, match="isotropic"):
        pbrdf.signature(fixed, 0.3, phi_s=0.2, sky=cloud)
    lost = traced.assign(truncated=traced.truncated + 0.01)
    with pytest.warns(AccuracyWarning, match="lost in the simulation"):
        pbrdf.signature(lost, 0.3, wavelength=10.0, temperature=300.0)


POLISHED = GaussianSurface(shape=(48, 48), spacing=1.0, corr_length=6.0, height_rms=0.04)


@pytest.fixture(scope="module")
def polished() -> object:
    return pbrdf.simulate(
        Scene(POLISHED, PAINT), [0.4, 0.9], phi_i="uniform", wave="auto", wavelength=0.6,
        n_rays=1000, realizations=8, n_theta=18, n_dphi=24, seed=2,
    )  # fmt: skip


@pytest.mark.filterwarnings("ignore:sun has theta 0.9, but the sun of RayleighSky")
def test_the_beam_of_waves_is_part_of_what_is_seen(polished) -> None:
    """Most light of a polished surface is a beam, which no bin holds; the model has it."""
    model = WaveModel(PAINT, height_rms=0.04, corr_length=6.0)
    beam = polished.coherent[1, 0, 0].item()
    assert beam > polished.albedo[:, 1].sum().item()
    sun = Sun(theta=0.9, phi=2.0, irradiance=900.0)
    # The sky of another sun, whose light is not polarised along the plane of the view
    sky = RayleighSky(sun=replace(sun, theta=0.4, phi=0.8))
    behind = replace(sun, optical_depth=sky.depth(0.6))
    light = {"sun": behind, "sky": sky, "temperature": 3000.0, "wavelength": 0.6}
    at = {"theta_s": 0.9, "phi_s": 2.0 - pi + 0.001}
    traced, closed = (pbrdf.signature(one, **at, **light) for one in (polished, model))
    # The beam is the same; what is scattered differs by bins
    for name in ("reflected_sun", "reflected_sky", "emissivity"):
        assert_allclose(traced[name], closed[name], rtol=0, atol=0.01 * closed[name][0])
    assert abs(traced.reflected_sky[2].item()) > 0.02 * traced.reflected_sky[0].item()
    # Beside the mirror direction there is none; at it, the sun's incidence knows it too
    for turn, lit in ((0.0, True), (0.006, False)):
        at["phi_s"] = 2.0 - pi + turn
        by_sensor = pbrdf.signature(polished, **at, sun=sun, wavelength=0.6).radiance
        by_sun = pbrdf.signature(
            polished, 0.9 - 1e-5, phi_s=at["phi_s"], sun=sun, wavelength=0.6
        ).radiance  # fmt: skip
        radiance = 900.0 / (pi * np.sin(sun.half_angle) ** 2) * polished.coherent[1, :, 0]
        assert (by_sensor[0].item() > 0.9 * radiance[0].item()) is lit
        if lit:
            assert_allclose(by_sun, by_sensor, rtol=0, atol=1e-3 * radiance[0].item())


def test_isothermal_surface_of_waves_is_black(polished) -> None:
    seen = pbrdf.signature(
        polished, 0.4, wavelength=0.6, temperature=3000.0,
        sky=ThermalSky(temperature=3000.0),
    )  # fmt: skip
    body = float(black_body(0.6, 3000.0))
    assert_allclose(seen.radiance / body, [1, 0, 0, 0], rtol=0, atol=1e-12)
    reflected = 1.0 - float(polished.absorbed[0])
    assert_allclose(1.0 - seen.emissivity[0], reflected, atol=1e-3)


def test_a_sweep_of_several_surfaces_is_refused_by_its_axis(traced) -> None:
    both = xr.concat([traced, traced], dim=xr.DataArray([0.1, 0.2], dims="slope_rms"))
    both.attrs = traced.attrs
    with pytest.raises(ValueError, match="it varies along slope_rms"):
        pbrdf.signature(both, 0.9, sun=Sun(theta=0.5))
    alone = pbrdf.signature(both.sel(slope_rms=0.2), 0.9, sun=Sun(theta=0.5))
    assert_allclose(
        alone.radiance, pbrdf.signature(traced, 0.9, sun=Sun(theta=0.5)).radiance
    )
