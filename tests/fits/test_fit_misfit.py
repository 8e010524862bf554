"""The size of the misfit, its verdict, tables, files, and what is needed to fit again."""

import hashlib
import json
import tomllib

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import data_io
from fitting import Noise, fit
from pbrdf import Material, MicrofacetModel
from pbrdf.cli import main
from tests.fits.scans import VINYL, scan

FREE = ("specular_gain", "diffuse_albedo", "slope_rms")
HELD = MicrofacetModel(Material(1.53), slope_rms=0.252, specular_gain=0.8)


def changed(measurement, factor, where):
    """The scan with some readings of M00 multiplied."""
    values = measurement.M00.values.copy()
    values[where] *= factor
    return measurement.assign(M00=("geometry", values))


def test_a_right_model_is_good_and_says_how_good():
    result = fit(scan(VINYL, noise=0.02, seed=3), VINYL)
    assert result.misfit.verdict == "good"
    # Half of Gaussian deviations exceed 0.674 standard errors
    assert_allclose(result.misfit.median, 0.674 * 0.02, rtol=0.35)
    assert_allclose(result.misfit.rms_stderr, 1.0, atol=0.15)
    assert str(result.misfit) in result.summary()


@pytest.mark.parametrize("stderr", [True, False])
def test_a_missed_peak_is_poor_however_the_noise_was_found(stderr):
    exact = scan(VINYL, noise=0.02, seed=1, stderr=stderr, elements=("M00",))
    away = np.hypot(exact.theta_s - np.deg2rad(30.0), exact.dphi - np.pi)
    peak = int(np.argmin(away.values))
    for noise in (None, "relative", "absolute"):
        if stderr and noise is None:
            continue
        result = fit(
            changed(exact, 12_400.0, [peak]), HELD, ("diffuse_albedo",), noise=noise
        )
        misfit = result.misfit
        assert misfit.verdict == "poor"
        assert misfit.worst.measured > 500.0
        assert_allclose(np.rad2deg(misfit.worst.theta_s), 30.0)
        assert "view 30 deg" in str(misfit)
        assert "a factor of" in str(misfit)


def test_the_rule_is_by_size_where_the_noise_is_open():
    exact = scan(VINYL, elements=("M00",))
    sign = np.where(np.arange(exact.sizes["geometry"]) % 4 < 2, 1.0, -1.0)
    words = []
    for part in (0.02, 0.15, 0.5):
        wavy = exact.assign(M00=exact.M00 * (1.0 + part * sign))
        words.append(fit(wavy, HELD, ("diffuse_albedo",), noise="relative").misfit.verdict)
    assert words == ["good", "fair", "poor"]


def test_stated_errors_decide_before_size():
    # 15 % scatter that was announced is no misfit
    rough = scan(VINYL, noise=0.15, seed=2)
    assert fit(rough, VINYL).misfit.verdict == "good"
    # Where twice the errors would do the numbers still tell something; where 20 times, not
    read = scan(VINYL, noise=0.02, seed=2)
    words = [fit(read, VINYL, noise=Noise(relative=part)).misfit.verdict
             for part in (0.02, 0.01, 0.001)]  # fmt: skip
    assert words == ["good", "fair", "poor"]


def test_a_wrong_slope_is_not_good_whether_or_not_the_noise_is_stated():
    wrong = VINYL.with_parameters(slope_rms=0.30)
    for noise, size in ((0.02, "fair"), (0.005, "poor")):
        stated = fit(scan(VINYL, noise=noise, seed=2), wrong)
        # It drives the gain many of its standard errors away
        miss = stated.values["specular_gain"] - VINYL.specular_gain
        assert miss > 15.0 * stated.stderr["specular_gain"]
        assert stated.misfit.verdict == size
    open_ = fit(scan(VINYL, noise=0.005, seed=2, stderr=False), wrong, noise="relative")
    assert open_.misfit.median < 0.05
    assert open_.misfit.verdict == "fair"
    free = fit(scan(VINYL, noise=0.005, seed=2, stderr=False), wrong, FREE)
    assert free.misfit.verdict == "good"


def test_readings_that_noise_hides_do_not_count_as_factors():
    black = VINYL.with_parameters(diffuse_albedo=0.0)
    rng = np.random.default_rng(4)
    exact = scan(black, elements=("M00",))
    noisy = exact + 0.001 * rng.standard_normal(exact.sizes["geometry"])
    result = fit(noisy, black.with_parameters(slope_rms=0.25), FREE, noise="absolute")
    assert float(noisy.M00.min()) < 0.0
    assert result.misfit.verdict == "good"


def test_each_scan_and_wavelength_is_judged():
    good = scan(VINYL, noise=0.02, seed=1, wavelength=0.45)
    bad = scan(VINYL.with_parameters(slope_rms=0.5), noise=0.02, seed=2, wavelength=0.65)
    result = fit({"a": good, "b": bad}, HELD, ("specular_gain", "diffuse_albedo"))
    frame = result.misfit.to_frame()
    assert list(frame.scan) == ["a", "b"]
    assert list(frame.wavelength) == [0.45, 0.65]
    assert frame.verdict[0] == "good"
    assert frame.verdict[1] in ("fair", "poor")
    assert result.misfit.verdict == frame.verdict[1]
    assert result.misfit.worst.scan == "b"
    numbers = result.as_dict()["misfit"]
    assert numbers["by_scan_and_wavelength"][1]["verdict"] == frame.verdict[1]
    assert numbers["rule"].startswith("good: the errors given explain")
    json.dumps(numbers, allow_nan=False)


def test_a_fit_is_a_table():
    two = xr.concat(
        [scan(VINYL, noise=0.02, seed=k, wavelength=w) for k, w in enumerate((0.45, 0.65))],
        "geometry",
    )
    result = fit(two, VINYL, free=FREE)
    frame = result.to_frame()
    assert list(frame.index) == list(result.values)
    row = frame.loc["diffuse_albedo[0.65]"]
    assert row["value"] == result.values["diffuse_albedo[0.65]"]
    assert row["high"] == result.estimates["diffuse_albedo[0.65]"].high
    assert (row["parameter"], row["wavelength"]) == ("diffuse_albedo", 0.65)
    assert np.isnan(frame.loc["slope_rms", "wavelength"])


def test_what_is_held_is_named():
    result = fit(scan(VINYL, noise=0.02), VINYL, ("specular_gain",), fixed={"kappa": 0.01})
    assert result.held["kappa"] == 0.01
    assert result.held["slope_rms"] == 0.252
    assert result.held["diffuse_albedo"] == 0.13
    assert "specular_gain" not in result.held


def test_the_files_of_a_fit_suffice_to_repeat_it(tmp_path, capsys):
    two = xr.concat(
        [scan(VINYL, noise=0.02, seed=k, wavelength=w) for k, w in enumerate((0.45, 0.65))],
        "geometry",
    )
    data_io.write_goniometer(two, tmp_path / "scan.csv")
    command = ["fit", str(tmp_path / "scan.csv"), "--n", "1.53", "--slope-rms", "0.252",
               "--detector-half-angle-deg", "0.5", "-o", str(tmp_path / "out")]  # fmt: skip
    assert main(command) == 0
    said = capsys.readouterr().out
    assert "diffuse_albedo[0.65]" in said
    assert "misfit: good: half of the readings" in said
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["fit.json", "model_scan_0.45um.toml", "model_scan_0.65um.toml",
                     "scan_0.45um.png", "scan_0.65um.png", "spectrum.csv",
                     "spectrum.png"]  # fmt: skip
    numbers = json.loads((tmp_path / "out" / "fit.json").read_text())
    record = numbers["record"]
    digest = hashlib.sha256((tmp_path / "scan.csv").read_bytes()).hexdigest()
    assert record["inputs"] == [{"role": "scan", "name": "scan.csv", "sha256": digest}]
    assert record["options"]["n"] == 1.53
    assert record["options"]["detector_half_angle_deg"] == 0.5
    assert record["program"].startswith("pbrdf ")
    assert numbers["held"]["slope_rms"] == 0.252
    assert numbers["misfit"]["verdict"] == "good"
    model = tomllib.loads((tmp_path / "out" / "model_scan_0.65um.toml").read_text())
    assert model["made_by"]["inputs"] == record["inputs"]
    table = (tmp_path / "out" / "spectrum.csv").read_text().splitlines()
    assert table[0].startswith("wavelength,specular_gain,specular_gain_stderr")
    assert [line.split(",")[0] for line in table[1:]] == ["0.45", "0.65"]
    loaded = data_io.read_model(tmp_path / "out" / "model_scan_0.65um.toml")
    value = numbers["parameters"]["diffuse_albedo[0.65]"]["value"]
    assert loaded.diffuse_albedo == value
