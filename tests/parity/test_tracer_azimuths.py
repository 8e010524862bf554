"""Several azimuths of the source in one run."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from data_io import read_result, write_result
from pbrdf import Drops, GaussianSurface, HeightMap, Material, Scene, simulate

GROOVES = GaussianSurface(
    shape=(64, 96), spacing=1.0, corr_length=(6.0, 24.0), slope_rms=0.2
)
FINITE = HeightMap(GROOVES.sample(2).heights, 1.0)
DEW = Drops.at([[30.0, 30.0]], volume=300.0, contact_angle=1.0, material=Material(1.333))
GLASS = Material(1.5)
AZIMUTHS = np.deg2rad([0.0, 35.0, 90.0])


@pytest.mark.filterwarnings("ignore::pbrdf.errors.AccuracyWarning")
@pytest.mark.parametrize(
    ("scene", "options"),
    [
        (Scene(GROOVES, GLASS), {"realizations": 8}),
        (Scene(GROOVES, GLASS), {"realizations": 8, "source_half_angle": 0.1}),
        (Scene(FINITE, GLASS), {"wavelength": [0.4, 0.5, 0.6, 0.7]}),
        (Scene(FINITE, GLASS), {"skips": False}),
        (Scene(GROOVES, GLASS, DEW), {"realizations": 8, "stokes": "linear"}),
    ],
)
def test_each_azimuth_is_what_it_is_alone(scene, options):
    theta = np.deg2rad([20.0, 50.0])
    options = {"n_rays": 640, "n_theta": 9, "n_dphi": 12, "seed": 7} | options
    together = simulate(scene, theta, phi_i=AZIMUTHS, **options)
    assert together.brdf.dims[:3] == ("bounces", "theta_i", "phi_i")
    assert_array_equal(together.phi_i, AZIMUTHS)
    for k, azimuth in enumerate(AZIMUTHS):
        alone = simulate(scene, theta, phi_i=azimuth, **options)
        here = together.isel(phi_i=k)
        for name in alone.data_vars:
            assert_array_equal(here[name], alone[name], err_msg=str(name))
        assert alone.brdf.dims == here.brdf.dims
    assert together.attrs["rel_error"] >= alone.attrs["rel_error"]
    assert max(together.attrs["rays_escaped"]) > 2 * max(alone.attrs["rays_escaped"])


@pytest.mark.filterwarnings("ignore:.*left the finite map sideways")
@pytest.mark.filterwarnings("ignore:A period of")
def test_grooves_are_seen_and_files_keep_them(tmp_path):
    result = simulate(
        Scene(GROOVES, GLASS), 0.3, phi_i=AZIMUTHS[[0, 2]], n_rays=3000, realizations=16
    )
    # Across the grooves light is spread in the plane of incidence, along them out of it
    forward = abs(np.cos(result.dphi)) > 0.9
    share = result.brdf_total[..., 0, 0] * result.projected_solid_angle
    inside = share.where(forward).sum(("theta_s", "dphi")) / share.sum(("theta_s", "dphi"))
    across, along = inside.isel(theta_i=0)
    assert across > along + 0.2
    write_result(result, tmp_path / "result.nc")
    back = read_result(tmp_path / "result.nc")
    assert_allclose(back.brdf, result.brdf)
    assert back.attrs["phi_i"] == result.attrs["phi_i"] == list(AZIMUTHS[[0, 2]])


@pytest.mark.filterwarnings("ignore:A period of")
def test_one_target_holds_for_all_azimuths():
    options = {"n_rays": 2000, "realizations": 8, "n_theta": 9, "n_dphi": 4}
    scene = Scene(GROOVES, GLASS)
    alone = [
        simulate(scene, 0.3, phi_i=a, target_rel_error=0.03, **options) for a in AZIMUTHS
    ]
    together = simulate(scene, 0.3, phi_i=AZIMUTHS, target_rel_error=0.03, **options)
    assert together.attrs["rel_error"] <= 0.03
    counts = [one.attrs["realizations"] for one in alone]
    assert together.attrs["realizations"] >= max(counts) > min(counts)


@pytest.mark.parametrize(
    ("azimuths", "message"),
    [
        ([], r"one-dimensional \[rad\], got shape \(0,\)"),
        ([[0.1]], r"got shape \(1, 1\)"),
        ([0.1, np.nan], "finite"),
        ("all", '"uniform", got'),
    ],
)
def test_bad_azimuths_are_refused(azimuths, message):
    with pytest.raises(ValueError, match=message):
        simulate(Scene(FINITE, GLASS), 0.3, phi_i=azimuths)
