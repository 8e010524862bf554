"""`pbrdf observe`: the geometries of a measured scan, simulated into a scan."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from data_io import read_goniometer, read_result
from pbrdf.cli import main
from tests.cli.scenes import SCENE

# One geometry at two wavelengths, and one out of the plane
SCAN = """theta_i_deg,theta_s_deg,dphi_deg,wavelength_um,M00
30,30,180,0.5,0.5
30,30,180,0.6,0.4
30,10,150,0.5,0.2
"""
QUICK = ["--n-rays", "1000", "--realizations", "8"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "scene.toml").write_text(SCENE)
    (tmp_path / "measured.csv").write_text(SCAN)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_scan_is_answered_by_a_scan(folder: Path, capsys: pytest.CaptureFixture) -> None:
    command = ["observe", "scene.toml", "--scan", "measured.csv", "-o", "simulated.csv"]
    assert main([*command, *QUICK]) == 0
    assert "largest M00" in capsys.readouterr().out
    scan = read_goniometer(folder / "simulated.csv")
    assert_allclose(np.rad2deg(scan.theta_s), [30.0, 10.0])
    assert_allclose(np.rad2deg(scan.dphi), [180.0, 150.0])
    assert (scan.M00 > 0).all()
    assert (scan.M00_stderr > 0).all()
    assert scan.M33.values[0] < 0
    # Nothing is overwritten unasked
    assert main([*command, *QUICK]) == 2


def test_scans_in_other_words_are_observed_as_declared(folder: Path) -> None:
    (folder / "other.csv").write_text("AOI,theta_s_deg,dphi_deg,R\n30,20,10,0.5\n")
    command = ["observe", "scene.toml", "--scan", "other.csv", "-o", "other-sim.csv"]
    words = ["--columns", "AOI=theta_i_deg,R=M00", "--azimuth-of-forward", "0"]
    assert main([*command, *words, *QUICK]) == 0
    scan = read_goniometer(folder / "other-sim.csv")
    assert_allclose(np.rad2deg(scan.dphi), [190.0])
    assert_allclose(np.rad2deg(scan.theta_s), [20.0])


def test_a_dataset_keeps_the_bounces_apart(folder: Path) -> None:
    angles = ["--theta-i-deg", "20,40", "--theta-view-deg=-10,20"]
    command = ["observe", "scene.toml", *angles, "-o", "result.nc", *QUICK]
    assert main([*command, "--stokes", "linear", "--start", "source"]) == 0
    result = read_result(folder / "result.nc")
    assert result.sizes["geometry"] == 4
    assert result.sizes["stokes_out"] == 3
    assert_allclose(np.rad2deg(result.dphi), [0.0, 180.0, 0.0, 180.0])
    assert_allclose(result.brdf.sum("bounces"), result.brdf_total, rtol=1e-12)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (["--theta-view-deg", "89.9"], "above the horizon"),
        (["--theta-view-deg", "steep"], "--theta-view-deg must be numbers"),
        (["--wavelength-um", "0.5,0.6"], "must be one number for a scan"),
        (["--phi-i-deg", "0,90"], "must be one number or uniform"),
        (["--estimator", "guess"], "guess"),
        (["--scan", "missing.csv"], "missing.csv"),
        (["--azimuth-of-forward", "0"], "--azimuth-of-forward says how to read a --scan"),
    ],
)
def test_bad_input_is_one_line(
    folder: Path, capsys: pytest.CaptureFixture, change: list[str], words: str
) -> None:
    before = sorted(folder.rglob("*"))
    assert main(["observe", "scene.toml", *change, *QUICK]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert words in lines[0]
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize(
    ("names", "options"), [(",wavelength_um", []), ("", ["--wavelength-um", "0.55"])]
)
def test_a_metal_takes_the_wavelength_of_the_scan_or_that_of_the_option(
    folder: Path, names: str, options: list[str]
) -> None:
    metal = SCENE.split("[substrate]")[0] + '[substrate]\nmaterial = "aluminium"\n'
    (folder / "metal.toml").write_text(metal)
    value = ",0.55" if names else ""
    (folder / "one.csv").write_text(
        f"theta_i_deg,theta_s_deg,dphi_deg{names},M00\n30,30,180{value},0.5\n"
    )
    command = ["observe", "metal.toml", "--scan", "one.csv", "-o", "one.nc", *options]
    assert main(["-q", *command, *QUICK]) == 0
    assert read_result(folder / "one.nc").wavelength.item() == pytest.approx(0.55)
