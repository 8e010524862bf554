"""A diffuse base under the interface, material by cell, and mended maps."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from pbrdf import GaussianSurface, HeightMap, Material, Scene, simulate

FLAT = HeightMap.flat(size=(1.0, 1.0))
ROUGH = GaussianSurface(shape=(96, 96), spacing=1.0, corr_length=8.0, slope_rms=0.3)


def total(result):
    return result.albedo.sum("bounces").values


@pytest.mark.parametrize(
    ("albedo", "expected"), [(0.13, [0.09168454, 0.09623130, 0.12814016]), (1.0, [1, 1, 1])]
)
def test_reflectance_of_a_lambertian_base_under_a_flat_interface(albedo, expected):
    """R12 + T12 rho (1 - F_i)/(1 - rho F_i), with F_i by the closed form of Walsh."""
    result = simulate(
        Scene(FLAT, Material(1.333, diffuse_albedo=albedo)), np.deg2rad([0.0, 41.4, 60.0]),
        n_rays=200_000, n_theta=9, n_dphi=12, seed=4,
    )  # fmt: skip
    error = np.sqrt((result.albedo_stderr**2).sum("bounces")).values
    assert (np.abs(total(result) - expected) < 4.5 * error).all()
    assert error.max() < 5e-4
    assert_allclose(total(result) + result.absorbed, 1.0, atol=1e-9)


def test_light_of_the_base_is_polarised_along_the_plane_of_exit():
    """What leaves through the interface prefers p, where reflection prefers s."""
    base = Scene(FLAT, Material(1.5, diffuse_albedo=0.9))
    result = simulate(base, 0.3, n_rays=100_000, n_theta=9, n_dphi=4, seed=1)
    grazing = result.brdf_total.isel(theta_i=0, theta_s=-2, dphi=1)
    share = float(grazing.sel(stokes_out="Q", stokes_in="I") / grazing[0, 0])
    # T_s and T_p at the middle of the bin, 75 degrees, n = 1.5
    cos_out = np.cos(np.deg2rad(75.0))
    q = np.sqrt(1.5**2 - 1 + cos_out**2)
    t_s = 1 - ((cos_out - q) / (cos_out + q)) ** 2
    t_p = 1 - ((2.25 * cos_out - q) / (2.25 * cos_out + q)) ** 2
    assert_allclose(share, (t_s - t_p) / (t_s + t_p), rtol=0.05)
    assert share < 0


def test_a_lossless_base_on_a_rough_surface_returns_all_light():
    result = simulate(
        Scene(ROUGH, Material(1.5, diffuse_albedo=1.0)), 0.8,
        n_rays=20_000, realizations=16, n_theta=9, n_dphi=12,
    )  # fmt: skip
    assert_allclose(total(result), 1.0, atol=2e-3)


def test_each_cell_reflects_as_its_own_material():
    """A quarter of a plane is black, the rest a mirror."""
    heights = np.zeros((8, 8))
    labels = np.zeros((8, 8), dtype=int)
    labels[2:4] = 1
    surface = HeightMap(heights, 1.0, periodic=True, labels=labels)
    scene = Scene(surface, [Material.mirror(), Material.black()])
    result = simulate(scene, 0.4, n_rays=64_000)
    assert_allclose(total(result), 0.75, atol=2e-3)
    with pytest.raises(ValueError, match="one material for each label"):
        Scene(surface, Material.mirror())


@pytest.mark.parametrize("other", [(), ("sweep",), ("steep",), ("horizon",)])
def test_skips_change_no_bit(other):
    options = {"n_rays": 4000, "realizations": 8, "seed": 2, "n_theta": 9, "n_dphi": 12}
    scene = Scene(ROUGH, Material(1.4, 0.2))
    every = simulate(scene, [0.2, 1.2], **options)
    some = simulate(scene, [0.2, 1.2], skips=("walk", *other), explain=True, **options)
    assert_array_equal(every.brdf, some.brdf)
    assert "Embree: not built" in some.attrs["explanation"][0]


def test_holes_are_filled_with_the_membrane_of_their_rim():
    """A plane is its own membrane."""
    x, y = np.meshgrid(np.arange(9.0), np.arange(7.0), indexing="ij")
    plane = 0.3 * x - 0.2 * y
    holed = plane.copy()
    holed[3:6, 2:5] = np.nan
    mended = HeightMap(holed, 1.0).filled()
    assert_allclose(mended.heights, plane, atol=1e-12)
    mirrored = mended.mirrored()
    assert mirrored.periodic
    assert mirrored.shape == (16, 12)
    assert_allclose(np.abs(mirrored.slopes()[0]), 0.3)
