"""Waves for the first bounce, rays for the later ones: energy, sums, refusals."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import (
    AccuracyWarning,
    GaussianSurface,
    HeightMap,
    Material,
    Scene,
    WaveModel,
    simulate,
)
from pbrdf.derived.bins import bin_averages

SURFACE = GaussianSurface(shape=(128, 128), spacing=0.125, corr_length=1.0, height_rms=0.25)
GIVEN = {
    "n_rays": 4000,
    "realizations": 8,
    "phi_i": "uniform",
    "n_theta": 18,
    "n_dphi": 24,
}


def test_waves_and_later_rays_return_all_light_of_a_mirror() -> None:
    theta_i = [0.0, 0.5]
    run = simulate(
        Scene(SURFACE, Material.mirror()), theta_i, wavelength=1.0, wave="auto", **GIVEN
    )
    later = run.albedo.sel(bounces=["2", "3+"]).sum("bounces").values
    total = run.albedo.sum("bounces").values + run.coherent[:, 0, 0].values
    assert (later > 0.05).all()
    assert_allclose(total, 1.0, atol=0.03)
    seen = (run.brdf_total[..., 0, 0] * run.projected_solid_angle).sum(["theta_s", "dphi"])
    assert_allclose(seen, run.albedo.sum("bounces"), rtol=1e-12)


def test_the_first_bounce_is_the_model_and_the_rest_the_rays() -> None:
    given = GIVEN | {"wavelength": [0.8, 3.0]}
    scene = Scene(SURFACE, Material(1.5))
    waves = simulate(scene, 0.5, wave="order-weighted", **given)
    # The rays alone warn of the wavelength
    with pytest.warns(AccuracyWarning) as said:
        rays = simulate(scene, 0.5, variance_reduction=False, **given)
    assert len(said) > 1
    model = WaveModel(
        Material(1.5),
        height_rms=SURFACE.ensemble_height_rms,
        corr_length=1.0,
        method="order-weighted",
    )
    where = {"theta_s": 9, "dphi": 14}
    bin_centre = waves.theta_s.values[9], waves.dphi.values[14]
    expected = model.brdf(0.5, *bin_centre, [0.8, 3.0])
    found = waves.brdf.sel(bounces="1").isel(theta_i=0, **where)
    assert_allclose(found, expected, atol=0.03 * expected[:, :1, :1].max())
    beam = model.coherent(0.5, [0.8, 3.0])
    assert_allclose(waves.coherent.isel(theta_i=0), beam)
    # Only what leaves the mean field goes on to a second bounce
    flat = WaveModel(Material(1.5), height_rms=1e-9, corr_length=1.0)
    scattered = 1 - beam[:, 0, 0] / flat.coherent(0.5, 1.0)[0, 0]
    second = rays.albedo.sel(bounces="2").values[0] * scattered
    assert_allclose(waves.albedo.sel(bounces="2").values[0], second, rtol=1e-6)
    assert scattered[1] < 0.7 < scattered[0]
    # What is not reflected goes below
    sum_of_all = waves.absorbed + waves.albedo.sum("bounces") + waves.coherent[..., 0, 0]
    assert_allclose(sum_of_all, 1.0, atol=1e-12)


COARSE = GaussianSurface(
    shape=(128, 128), spacing=0.5, corr_length=8.0, height_rms=1.6
)  # fmt: skip


def test_fine_structure_under_traced_facets_keeps_the_light_of_a_mirror():
    fine = WaveModel(Material.mirror(), height_rms=0.05, corr_length=0.5)
    given = GIVEN | {"n_rays": 1000, "n_theta": 9, "n_dphi": 12}
    run = simulate(
        Scene(COARSE, Material.mirror()), 0.3, wavelength=1.0, wave=fine, **given
    )
    assert run.albedo.sum("bounces").values == pytest.approx(1.0, abs=0.03)
    assert not run.coherent.any()
    assert run.attrs["wave"].startswith("two scales: auto, height_rms 0.05 um")
    once = run.brdf.sel(bounces="1").isel(theta_i=0)[..., 0, 0]
    share = (once * run.projected_solid_angle).sum().item()
    # Nearly all of it leaves at once
    assert share == pytest.approx(0.97, abs=0.02)


def test_brushed_surfaces_turn_with_the_source():
    brushed = GaussianSurface(
        shape=(96, 64), spacing=0.2, corr_length=(4.0, 1.0), height_rms=0.1
    )
    given = GIVEN | {"n_rays": 500, "phi_i": 0.6, "wavelength": 1.0}
    run = simulate(Scene(brushed, Material(1.2, 6.9)), 0.5, wave="auto", **given)
    model = WaveModel(Material(1.2, 6.9), height_rms=0.1, corr_length=(4.0, 1.0))
    assert_allclose(run.coherent[0], model.coherent(0.5, 1.0, phi_i=0.6), atol=1e-9)
    bins = {"n_theta": 18, "n_dphi": 24, "wavelength": 1.0}
    expected, other = (
        bin_averages(model, 0.5, phi_i=phi_i, **bins) for phi_i in (0.6, -0.6)
    )
    found = run.brdf.sel(bounces="1").isel(theta_i=0).values
    bright = expected[..., 0, 0] > 0.05 * expected[..., 0, 0].max()
    scale = expected[bright][:, :1, :1]
    assert np.abs((found - expected)[bright] / scale).max() < 0.02
    assert np.abs((found - other)[bright] / scale).max() > 0.3
    around = simulate(
        Scene(brushed, Material(1.2, 6.9)), 0.5, wave="auto", **given | {"phi_i": "uniform"}
    )
    # All light of all azimuths, with what goes below
    total = around.albedo.sum() + around.coherent[0, 0, 0] + around.absorbed[0]
    assert total.item() == pytest.approx(1.0, abs=1e-9)
    # Each of several azimuths had the waves of the first
    with pytest.raises(ValueError, match="phi_i must be one azimuth with wave over two"):
        simulate(Scene(brushed, "pvc"), 0.5, wave="auto", **given | {"phi_i": [0.0, 1.5]})


@pytest.mark.parametrize(
    ("surface", "material", "given", "fault"),
    [
        (SURFACE, Material(1.5), {}, "wavelength must be given with wave"),
        (
            SURFACE,
            Material(1.5),
            {"wavelength": 1.0, "wave": "rice"},
            "wave must be one of",
        ),
        (
            SURFACE,
            Material(1.5),
            {"wavelength": 1.0, "stokes": "linear"},
            "stokes must be 'full' with wave",
        ),
        (
            SURFACE,
            Material(1.5, diffuse_albedo=0.5),
            {"wavelength": 1.0},
            "diffuse_albedo of the substrate must be 0",
        ),
        (
            HeightMap.flat(size=(1.0, 1.0)),
            Material(1.5),
            {"wavelength": 1.0},
            "must be a GaussianSurface with wave, got HeightMap",
        ),
        (
            SURFACE,
            Material(1.5),
            {
                "wavelength": 9.0,
                "wave": WaveModel(Material(1.5), height_rms=0.1, corr_length=1.0),
            },
            "must be rough on the scale of the wavelength",
        ),
        (
            COARSE,
            Material(1.5),
            {
                "wavelength": 0.5,
                "wave": WaveModel(Material(1.6), height_rms=0.1, corr_length=1.0),
            },
            "wave must have the material of the substrate",
        ),
    ],
)
def test_what_waves_do_not_know_is_refused(surface, material, given, fault) -> None:
    with pytest.raises(ValueError, match=fault):
        simulate(Scene(surface, material), 0.3, **({"wave": "auto"} | given), n_rays=320)
