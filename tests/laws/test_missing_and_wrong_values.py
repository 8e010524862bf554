"""Values hidden by a mask are missing or refused; complex ones and truth values refused."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal

import fitting
import pbrdf
from data_io import Profile
from fitting import surface_statistics
from pbrdf import (
    GaussianSurface,
    HeightMap,
    Material,
    MeshSurface,
    MicrofacetModel,
    Scene,
    WaveModel,
    simulate,
)
from pbrdf.analytic import SlopeTable
from pbrdf.contaminants import Drops, Spheres
from pbrdf.conventions import direction, meridian_frame
from pbrdf.optics import convert_brdf, dolp, specular_mueller
from pbrdf.validity import judge_contaminants

SCENE = Scene(HeightMap.flat(), Material(1.5, 0.2))
MODEL = MicrofacetModel(Material(1.5), slope_rms=0.2)
SURFACE = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=8.0, slope_rms=0.2)
# A masked value that would wreck any result into which it found its way
ARTEFACT = 500.0


def hidden(values, *at):
    """Masked array whose masked entries hold the artefact."""
    found = np.ma.array(values, dtype=float)
    found.data[list(at)] = ARTEFACT
    found[list(at)] = np.ma.masked
    return found


def test_masked_heights_are_missing():
    heights = SURFACE.sample(3).heights
    masked = np.ma.array(heights.copy(), mask=False)
    masked[5, 7] = ARTEFACT
    masked.mask[5, 7] = True
    surface = HeightMap(masked, 1.0, periodic=True)
    assert np.isnan(surface.heights[5, 7])
    assert surface.missing == 1 / heights.size
    rest = ~masked.mask
    assert_array_equal(surface.heights[rest], heights[rest])
    # Rows of masked arrays in a list lose nothing either
    assert np.isnan(HeightMap(list(masked), 1.0).heights[5, 7])
    with pytest.raises(ValueError, match="heights must be complete"):
        simulate(Scene(surface, Material(1.5)), 0.3, n_rays=320)


def test_heights_without_a_masked_entry_are_kept():
    heights = SURFACE.sample(3).heights
    whole = HeightMap(np.ma.array(heights), 1.0, periodic=True)
    assert_array_equal(whole.heights, heights)


def test_masked_points_of_a_profile_are_left_out():
    x, z = np.arange(8.0), np.array([0.3, 0.1, 0.4, 0.2, 0.5, 0.9, 0.2, 0.6])
    profile = Profile(np.ma.array(x, mask=x == 6), hidden(z, 3))
    kept = np.array([0, 1, 2, 4, 5, 7])
    assert_array_equal(profile.x, x[kept])
    assert_array_equal(profile.z, z[kept])


def test_statistics_take_masked_heights_as_missing():
    rng = np.random.default_rng(2)
    x = np.arange(400.0)
    z = np.convolve(rng.normal(size=440), np.hanning(41), "valid")
    gaps = [50, 51, 220]
    masked = surface_statistics(SimpleNamespace(x=x, z=hidden(z, *gaps)))
    known = np.where(np.isin(np.arange(400), gaps), np.nan, z)
    missing = surface_statistics(SimpleNamespace(x=x, z=known))
    assert masked.slope_rms == missing.slope_rms


def test_masked_rows_of_a_table_are_missing():
    waves, n = [0.4, 0.5, 0.6, 0.8], [1.6, 1.55, 1.52, 1.5]
    whole = Material.from_table(wavelength=waves, n=n, kappa=[0.1, 0.2, 0.3, 0.4])
    holed = Material.from_table(
        wavelength=waves, n=hidden(n, 1), kappa=hidden([0.1, 0.2, 0.3, 0.4], 2)
    )
    assert_allclose(holed.index(0.5), (1.56, 0.2), rtol=1e-12)
    assert_allclose(holed.index(0.6), (1.52, 0.2 + 0.2 / 3), rtol=1e-12)
    assert holed.index(0.8) == whole.index(0.8)


def test_masked_slopes_are_missing():
    slopes = np.random.default_rng(1).normal(0.0, 0.2, (2, 1000))
    whole = SlopeTable.from_slopes(*slopes[:, 1:])
    holed = SlopeTable.from_slopes(hidden(slopes[0], 0), slopes[1])
    assert_allclose(holed.slope_rms, whole.slope_rms, rtol=1e-12)


def test_masked_directions_stay_missing():
    assert np.isnan(direction(hidden([0.3, 0.4], 1), 0.2)[1]).all()
    assert np.isnan(meridian_frame(np.ma.masked_equal([0.6, 0.0, 0.8], 0.6))[0]).any()
    assert np.isnan(dolp(hidden([1.0, 0.3, 0.0, 0.0], 1)))


def pyramid(**hidden_at):
    """Four faces over a square, with masks at places of their arrays."""
    corners = np.array([(0, 0, 0), (6, 0, 0), (6, 4, 0), (0, 4, 0), (3, 2, 1.5)])
    arrays = {
        "vertices": np.ma.array(corners, dtype=float),
        "faces": np.ma.array([(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]),
    }
    for name, place in hidden_at.items():
        arrays[name][place] = np.ma.masked
    return arrays["vertices"], arrays["faces"]


def test_masks_of_a_mesh_are_honoured():
    """The apex would be traced at the height under its mask."""
    assert len(MeshSurface(pyramid(), period=(6, 4)).faces) == 4
    with pytest.raises(ValueError, match="vertices must be finite"):
        MeshSurface(pyramid(vertices=(4, 2)), period=(6, 4))
    with pytest.raises(ValueError, match="faces must be whole numbers, got a masked"):
        MeshSurface(pyramid(faces=(1, 1)), period=(6, 4))


@pytest.mark.parametrize(
    "wrong",
    [
        np.ma.array([0.5, ARTEFACT], mask=[False, True]),
        np.array([0.5, -1.0]),
        0.5 + 1j,
        True,
    ],
    ids=["masked", "negative", "complex", "truth value"],
)
def test_wavelengths_are_checked_where_nothing_depends_on_them(wrong):  # fmt: skip
    for call in (
        lambda: MODEL.brdf(0.3, 0.2, 3.0, wavelength=wrong),
        lambda: judge_contaminants([{"kind": "film", "thickness": 1.0}], wrong),
    ):
        with pytest.raises((TypeError, ValueError), match="wavelength must be"):
            call()


@pytest.mark.parametrize("column", ["frequency", "density"])
def test_masked_spectra_are_refused(column):
    table = {"frequency": [0.01, 0.02, 0.04, 0.08], "density": [9.0, 4.0, 1.0, 0.1]}
    WaveModel(Material(1.5), psd=tuple(table.values()))
    table[column] = hidden(table[column], 2)
    with pytest.raises(ValueError, match=f"psd {column} must be finite, got a masked"):
        WaveModel(Material(1.5), psd=tuple(table.values())).brdf(0.3, 0.2, 3.0, 0.5)


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("theta_i", lambda v: simulate(SCENE, v, n_rays=320)),
        ("phi_i", lambda v: simulate(SCENE, 0.3, phi_i=v, n_rays=320)),
        ("wavelength", lambda v: simulate(SCENE, 0.3, wavelength=v, n_rays=320)),
        ("theta_s", lambda v: pbrdf.observe(SCENE, 0.3, v, 0.1, n_rays=320)),
        ("theta_i", lambda v: MODEL.brdf(v, 0.2, 3.0)),
        ("dphi", lambda v: MODEL.brdf(0.3, 0.2, v)),
        ("wavelength", lambda v: pbrdf.materials.get("water").indices(v)),
        ("cos_beta", lambda v: specular_mueller(v, 1.5)),
        ("n", lambda v: specular_mueller(0.4, v)),
        ("spacing", lambda v: HeightMap(np.zeros((4, 4)), v)),
        ("positions", lambda v: Drops.at([v], volume=5.0, contact_angle=1.0)),
        ("radius", lambda v: Spheres.at(np.eye(2), radius=v, material="pvc")),
        ("corr_length", lambda v: GaussianSurface(
            shape=(64, 64), spacing=1.0, corr_length=v, slope_rms=0.2)),
        ("slope_rms", lambda v: MicrofacetModel(Material(1.5), slope_rms=v)),
    ],
)  # fmt: skip
def test_masked_arguments_are_refused_by_name(name, call):
    with pytest.raises(ValueError, match=f"{name} must .* got a masked value"):
        call(np.ma.array([0.5, ARTEFACT], mask=[False, True]))


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("heights", lambda v: HeightMap(np.full((4, 4), v), 1.0)),
        ("z", lambda v: Profile([0.0, 1.0, 2.0], [0.1, 0.2, v])),
        ("n", Material),
        ("theta_i", lambda v: simulate(SCENE, v, n_rays=320)),
        ("theta_i", lambda v: MODEL.brdf(np.array([v]), 0.2, 3.0)),
        ("phi_i", lambda v: simulate(SCENE, 0.3, phi_i=[v], n_rays=320)),
        ("light", lambda v: dolp([1.0, v, 0.0, 0.0])),
        ("mueller", lambda v: convert_brdf(
            np.eye(4) * v, 0.2, 0.3, 1.0, target="scatmech")),
        ("slope_x", lambda v: SlopeTable.from_slopes([v], [0.1])),
        ("M00", lambda v: fitting.fit(
            xr.Dataset(
                {"M00": ("geometry", np.full(3, v))},
                coords={name: ("geometry", np.full(3, 0.4))
                        for name in ("theta_i", "theta_s", "dphi")},
            ), MODEL)),
    ],
)  # fmt: skip
def test_complex_values_are_refused_by_name(name, call):
    with pytest.raises(TypeError, match=f"{name} must be real, got complex"):
        call(0.5 + 0.1j)


@pytest.mark.parametrize("seed", [-1, 1.5, True, "7"])
@pytest.mark.parametrize(
    "call",
    [
        lambda v: simulate(SCENE, 0.3, n_rays=320, seed=v),
        lambda v: pbrdf.observe(SCENE, 0.3, 0.2, 0.1, n_rays=320, seed=v),
        SURFACE.sample,
        lambda v: fitting.SimulatedModel(SCENE, seed=v),
        lambda v: fitting.fit(xr.Dataset(), MODEL, seed=v),
        lambda v: Drops(contact_angle=1.0, coverage=0.1, number_density=1e-3, seed=v),
    ],
)
def test_seeds_are_checked_by_name(seed, call):
    with pytest.raises(ValueError, match="seed must be a whole number >= 0"):
        call(seed)


@pytest.mark.parametrize(
    "name", ["realizations", "n_rays", "max_bounces", "n_theta", "n_dphi", "workers"]
)
def test_counts_are_no_truth_values(name):
    with pytest.raises(TypeError, match=f"{name} must be numbers, got truth values"):
        simulate(SCENE, 0.3, **{"n_rays": 320, name: True})


@pytest.mark.parametrize("name", ["variance_reduction", "explain", "fold"])
@pytest.mark.parametrize("value", [2, 1, "no", None])
def test_switches_are_truth_values(name, value):
    with pytest.raises(TypeError, match=f"{name} must be True or False, got"):
        simulate(SCENE, 0.3, n_rays=320, **{name: value})


def test_a_source_too_near_the_horizon_is_refused():
    scene = Scene(SURFACE.sample(3), Material.mirror())
    with pytest.raises(ValueError, match=r"theta_i must be at most .* cells"):
        simulate(scene, np.deg2rad(89.99995), n_rays=320)
    assert simulate(scene, np.deg2rad(89.99), n_rays=320).albedo.sum() == pytest.approx(1)
