"""Slopes of two axes from scans at several azimuths of the source."""

import numpy as np
import xarray as xr
from numpy.testing import assert_allclose

import data_io
from fitting import Noise, fit
from pbrdf import Material, MicrofacetModel
from tests.fits.scans import scan

FREE = ("specular_gain", "diffuse_albedo", "slope_rms_x", "slope_rms_y")
BRUSHED = MicrofacetModel(
    Material(1.53), slope_rms=(0.12, 0.28), specular_gain=0.8, diffuse_albedo=0.13
)
START = MicrofacetModel(Material(1.53), slope_rms=0.2)
EXACT = Noise(relative=0.01)


def turned(azimuths, *, by=0.0):
    """Scans at azimuths of the source on a sample mounted askew, as one table. [deg]"""
    scans = []
    for azimuth in azimuths:
        one = scan(BRUSHED, step=5.0, phi_i=np.deg2rad(azimuth - by))
        there = np.full(one.sizes["geometry"], np.deg2rad(azimuth))
        scans.append(one.assign_coords(phi_i=("geometry", there)))
    return xr.concat(scans, "geometry")


def test_a_written_scan_gives_both_slopes_again(tmp_path):
    data_io.write_goniometer(turned([0.0, 90.0]), tmp_path / "brushed.csv")
    read = data_io.read_goniometer(tmp_path / "brushed.csv")
    assert_allclose(np.unique(read.phi_i.values.round(9)), [0.0, np.pi / 2])
    result = fit(read, START, free=FREE, noise=EXACT)
    assert_allclose(list(result.values.values()), [0.8, 0.13, 0.12, 0.28], rtol=1e-6)
    assert result.model.slope_rms == (
        result.values["slope_rms_x"], result.values["slope_rms_y"],
    )  # fmt: skip


def test_the_axes_may_lie_askew():
    measurement = turned([0.0, 50.0, 110.0], by=20.0)
    result = fit(measurement, START, free=(*FREE, "orientation"), noise=EXACT)
    values = result.values
    # Exchanged slopes a quarter turn on, or half a turn on, are the same surface
    quarter = abs(values["slope_rms_x"] - 0.28) < 0.01
    slopes = [values[f"slope_rms_{axis}"] for axis in ("yx" if quarter else "xy")]
    assert_allclose(slopes, [0.12, 0.28], rtol=1e-6)
    expected = 20.0 + 90.0 * quarter
    miss = np.mod(np.rad2deg(values["orientation"]) - expected + 90.0, 180.0) - 90.0
    assert abs(miss) < 1e-4
    (text,) = (w for w in result.warnings if "turned by" in w)
    assert "give the model phi_i - (" in text


def test_one_slope_for_several_azimuths_is_questioned():
    result = fit(turned([0.0, 90.0]), START, ("specular_gain", "slope_rms"), noise=EXACT)
    assert any("2 azimuths of the source and one slope_rms" in w for w in result.warnings)
    assert result.misfit.verdict != "good"


def test_one_azimuth_does_not_tell_where_the_axes_lie():
    result = fit(turned([30.0]), START, free=(*FREE, "orientation"), noise=EXACT)
    assert np.isinf(result.stderr["orientation"])
