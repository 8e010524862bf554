"""Energy: what comes in goes out, is absorbed, or is counted as lost."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from pbrdf import GaussianSurface, HeightMap, Material, Scene, simulate

STEEP = np.deg2rad([10.0, 30.0, 60.0, 75.0, 85.0])


def mirror_budget(slope, n_rays, realizations, skips):
    surface = GaussianSurface(
        shape=(256, 256), spacing=1.0, corr_length=16.0, slope_rms=slope
    )
    result = simulate(
        Scene(surface, Material.mirror()), STEEP, n_rays=n_rays, realizations=realizations,
        n_theta=9, n_dphi=12, skips=skips,
    )  # fmt: skip
    missing = result.albedo.sum("bounces") + result.truncated + result.leaked - 1
    assert np.abs(missing).max() < 1e-6
    assert result.absorbed.values.max() < 1e-12
    assert (result.truncated >= 0).all()
    return result


@pytest.mark.parametrize("slope", [0.05, 0.47])
@pytest.mark.parametrize("skips", [True, False])
def test_perfect_mirror_loses_nothing(slope, skips):
    result = mirror_budget(slope, 2000, 8, skips)
    assert result.attrs["rays_leaked"] == [0] * 5
    assert result.attrs["rays_truncated"] == [0] * 5
    assert result.attrs["rays_left_sideways"] == [0] * 5
    assert result.attrs["rays_escaped"] == [16_000] * 5
    # Unpolarised light stays so in every bin of a perfect mirror
    polarised = result.brdf_total.sel(stokes_in="I", stokes_out=["Q", "U", "V"])
    assert np.abs(polarised).max() < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("skips", [True, False])
def test_a_million_rays_an_angle_on_a_steep_mirror(skips):
    """At most 3 rays in ten million may leak: none is expected here."""
    result = mirror_budget(0.47, 125_000, 8, skips)
    assert max(result.attrs["rays_leaked"]) == 0
    assert result.attrs["self_hits"] == 0
    assert max(result.attrs["rays_truncated"]) == 0


@settings(max_examples=15)
@given(
    st.integers(0, 10**6), st.floats(0.3, 3.0), st.floats(0.0, 8.0),
    st.floats(0.0, 1.5), st.floats(-7, 7), st.booleans(), st.integers(1, 3),
)  # fmt: skip
def test_budget_of_any_material_on_any_map(seed, n, kappa, theta_i, phi_i, skips, cut):
    heights = 0.5 * np.random.default_rng(seed).standard_normal((12, 9))
    result = simulate(
        Scene(HeightMap(heights, (1.0, 1.3), periodic=True), Material(n, kappa)), theta_i,
        phi_i=phi_i, n_rays=640, max_bounces=cut, n_theta=4, n_dphi=4, skips=skips,
    )  # fmt: skip
    parts = [result[name].item() for name in ("absorbed", "truncated", "leaked")]
    parts += result.albedo.values.ravel().tolist()
    assert min(parts) >= 0
    assert max(parts) <= 1 + 1e-12
    assert_allclose(sum(parts), 1.0, atol=1e-9)
    assert np.isfinite(result.brdf).all()
    if cut < 3:
        assert result.albedo.sel(bounces="3+").item() == 0


def test_black_surface_absorbs_all():
    surface = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=8.0, slope_rms=0.3)
    result = simulate(Scene(surface, Material.black()), 0.6, n_rays=320, realizations=8)
    assert result.absorbed.item() == 1.0
    assert result.brdf.values.max() == 0.0


def test_what_a_cut_takes_is_truncated():
    """Paths cut after one bounce carry what later bounces would have had."""
    surface = GaussianSurface(
        shape=(128, 128), spacing=1.0, corr_length=8.0, slope_rms=0.47
    )
    scene = Scene(surface, Material.mirror())
    options = {"n_rays": 2000, "realizations": 8, "n_theta": 9, "n_dphi": 12}
    whole = simulate(scene, 1.0, **options)
    cut = simulate(scene, 1.0, max_bounces=1, **options)
    assert_allclose(cut.albedo.sel(bounces="1"), whole.albedo.sel(bounces="1"), rtol=1e-12)
    assert_allclose(
        cut.truncated, whole.albedo.sel(bounces=["2", "3+"]).sum("bounces"), rtol=1e-9
    )
    assert cut.truncated.item() > 0.05
