"""The whole way on a small example, through the command as a user types it."""

import json
import re
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import data_io
from fitting import run_pipeline
from fitting.quick import run_quick
from fitting.report.layers import fitted_layers
from pbrdf import GaussianSurface, HeightMap, Material, MicrofacetModel
from pbrdf.cli import main
from tests.pictures.browser import asked, assert_sound

SLOPE, CORR_LENGTH, GAIN, DIFFUSE = 0.2, 8.0, 0.7, 0.1
FEW = ["--n-rays", "20000", "--realizations", "12"]


def write_profile(path: Path) -> None:
    """A Gaussian profile of 300 correlation lengths, drawn as a sum of cosines."""
    rng = np.random.default_rng(11)
    x = np.arange(0.0, 300 * CORR_LENGTH, 1.0)
    height_rms = SLOPE * CORR_LENGTH / np.sqrt(2)
    # exp(-r²/l²) is the characteristic function of wavenumbers of deviation sqrt(2)/l
    wavenumber = rng.normal(scale=np.sqrt(2) / CORR_LENGTH, size=3000)
    phase = rng.uniform(0, 2 * np.pi, wavenumber.size)
    z = np.cos(x[:, None] * wavenumber + phase).sum(axis=1)
    z *= height_rms * np.sqrt(2 / wavenumber.size)
    rows = "".join(f"{a:.3f},{b:.6f}\n" for a, b in zip(x, z, strict=True))
    path.write_text("x_um,z_um\n" + rows)


def write_scan(path: Path, elements: tuple[str, ...]) -> None:
    """A scan of the analytical model with 2 % noise."""
    model = MicrofacetModel(
        Material(1.5), SLOPE, specular_gain=GAIN, diffuse_albedo=DIFFUSE
    )
    view = np.deg2rad(np.arange(-60.0, 61.0, 4.0))
    theta_s, dphi = np.abs(view), np.where(view > 0, np.pi, 0.0)
    brdf = model.brdf(0.5, theta_s, dphi)
    rng = np.random.default_rng(3)
    data = {}
    for element in elements:
        sigma = 0.02 * brdf[:, 0, 0]
        value = brdf[:, int(element[1]), int(element[2])]
        data[element] = ("geometry", value + sigma * rng.standard_normal(view.size))
        data[f"{element}_stderr"] = ("geometry", sigma)
    coords = {"theta_i": np.full(view.size, 0.5), "theta_s": theta_s, "dphi": dphi}
    data_io.write_goniometer(
        xr.Dataset(data, {name: ("geometry", value) for name, value in coords.items()}),
        path,
    )


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a pipeline run on a polarised scan."""
    folder = tmp_path_factory.mktemp("pipeline")
    write_profile(folder / "profile.csv")
    write_scan(folder / "scan.csv", ("M00", "M10"))
    arguments = ["pipeline", str(folder / "profile.csv"), str(folder / "scan.csv"),
                 "--n", "1.5", "-o", str(folder / "out"), *FEW]  # fmt: skip
    assert main(arguments) == 0
    return folder


def test_every_file_is_there_and_nothing_else(finished: Path) -> None:
    assert sorted(path.name for path in finished.iterdir()) == [
        "out", "profile.csv", "scan.csv",
    ]  # fmt: skip
    assert sorted(path.name for path in (finished / "out").iterdir()) == [
        "model.toml", "report.html", "result.nc", "scan.png", "surface.png",
    ]  # fmt: skip


def test_what_was_put_in_comes_out(finished: Path) -> None:
    attrs = data_io.read_result(finished / "out" / "result.nc").attrs
    slope = attrs["statistics"]["slope_rms"]
    assert slope["low"] < SLOPE < slope["high"]
    for curve in ("analytic_fit", "monte_carlo_fit"):
        found = attrs[curve]["parameters"]
        for name, true in (("specular_gain", GAIN), ("diffuse_albedo", DIFFUSE)):
            assert abs(found[name]["value"] - true) < 3.5 * found[name]["stderr"], curve


def test_the_model_can_be_loaded_again(finished: Path) -> None:
    attrs = data_io.read_result(finished / "out" / "result.nc").attrs
    model = data_io.read_model(finished / "out" / "model.toml")
    fitted = attrs["analytic_fit"]["parameters"]
    assert model.specular_gain == fitted["specular_gain"]["value"]
    assert model.slope_rms == attrs["statistics"]["slope_rms"]["value"]
    assert model.brdf(0.5, 0.5, np.pi).shape == (4, 4)


def test_the_report_needs_no_other_file(finished: Path) -> None:
    page = (finished / "out" / "report.html").read_text()
    assert page.count('src="data:image/png;base64,') == 2
    assert not re.findall(r'(?:src|href)="(?!data:)', page)
    for word in ("specular_gain", "slope_rms", "chi2 / dof", "Monte Carlo", "seconds"):
        assert word in page
    for name in ("curves.csv", "readings.csv", "in_plane.csv", "model.toml"):
        assert f'download="{name}"' in page
    # A number of the fits never stands without its error
    assert re.search(r"specular_gain</td><td>0\.\d+ ± 0\.\d+", page)


def test_the_page_of_the_result_is_that_of_the_pipeline(finished: Path, tmp_path) -> None:
    held = []
    assert main(["report", str(finished / "out"), "-o", str(tmp_path / "r.html")]) == 0
    for file in (finished / "out" / "report.html", tmp_path / "r.html"):
        page = file.read_text()
        held.append(re.search(r'id="hemisphere-data">(.*?)</script>', page, re.S)[1])
    first, second = map(json.loads, held)
    readings = [one.pop("readings") for one in (first, second)]
    assert first == second
    assert len(readings[0][0]["M00"]) == len(readings[1][0]["M00"]) > 10


def test_the_page_is_sound_in_a_browser(finished: Path, tmp_path: Path) -> None:
    page = (finished / "out" / "report.html").read_text()
    found = asked(page, [({"show": "Monte Carlo - model"}, 20, 40, 45, 90)], tmp_path)
    assert_sound(found)
    assert "M00 - model = " in found[390]["answers"][0][0]


def test_the_hemisphere_holds_the_fitted_values(finished: Path) -> None:
    result = data_io.read_result(finished / "out" / "result.nc")
    layers = fitted_layers(result)
    fit = {n: p["value"] for n, p in result.attrs["monte_carlo_fit"]["parameters"].items()}
    expected = fit["specular_gain"] * result.brdf_total
    expected[..., 0, 0] += fit["diffuse_albedo"] / np.pi
    assert_allclose(layers.bounces["all"].brdf_total, expected, rtol=1e-12)
    single = fit["specular_gain"] * result.brdf.sel(bounces="1", drop=True)
    assert_allclose(layers.bounces["1"].brdf_total, single, rtol=1e-12)
    model = data_io.read_model(finished / "out" / "model.toml")
    at = {"theta_s": 20, "dphi": 7}
    here = layers.model.brdf_total[{"theta_i": 0, **at}]
    middle = model.brdf(float(here.theta_i), float(here.theta_s), float(here.dphi))
    assert_allclose(here, middle[:3, :3], rtol=0.01, atol=1e-4)


def test_the_first_look_is_the_analytical_fit(finished: Path, tmp_path: Path) -> None:
    words = ["pipeline", str(finished / "profile.csv"), str(finished / "scan.csv"),
             "--n", "1.5", "--quick", "-o", str(tmp_path / "look")]  # fmt: skip
    assert main(words) == 0
    names = sorted(path.name for path in (tmp_path / "look").iterdir())
    assert names == ["model.toml", "report.html", "scan.png", "surface.png"]
    first, whole = (
        data_io.read_model(folder / "model.toml")
        for folder in (tmp_path / "look", finished / "out")
    )
    assert first == whole
    page = (tmp_path / "look" / "report.html").read_text()
    assert "Nothing was simulated" in page
    assert "--quick" in page


def test_results_are_replaced_only_on_demand(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = (finished / "out" / "result.nc").stat().st_mtime_ns
    arguments = ["pipeline", str(finished / "profile.csv"), str(finished / "scan.csv"),
                 "--n", "1.5", "-o", str(finished / "out")]  # fmt: skip
    assert main(arguments) == 2
    assert "--force" in capsys.readouterr().err
    assert (finished / "out" / "result.nc").stat().st_mtime_ns == before


def test_an_unpolarised_scan_says_what_cannot_be_known(
    finished: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_scan(tmp_path / "scan.csv", ("M00",))
    arguments = ["pipeline", str(finished / "profile.csv"), str(tmp_path / "scan.csv"),
                 "--n", "1.5", "-o", str(tmp_path / "out"), *FEW]  # fmt: skip
    assert main(arguments) == 0
    said = capsys.readouterr().out
    assert "Only unpolarised reflectance was measured" in said
    assert "not measured" not in said
    assert "no measurement supports them" in (tmp_path / "out" / "report.html").read_text()


@pytest.mark.slow
def test_each_wavelength_has_its_folder_and_a_place_in_the_spectrum(tmp_path: Path) -> None:
    write_profile(tmp_path / "profile.csv")
    write_scan(tmp_path / "one.csv", ("M00", "M10"))
    scan = data_io.read_goniometer(tmp_path / "one.csv")
    waves = [
        scan.assign_coords(wavelength=("geometry", np.full(scan.sizes["geometry"], wave)))
        for wave in (0.45, 0.65)
    ]
    waves[1]["M00"] = waves[1].M00 + 0.2 / np.pi
    data_io.write_goniometer(xr.concat(waves, "geometry"), tmp_path / "scan.csv")
    arguments = ["pipeline", str(tmp_path / "profile.csv"), str(tmp_path / "scan.csv"),
                 "--n", "1.5", "-o", str(tmp_path / "out"), "--n-rays", "4000",
                 "--realizations", "8", "--source-half-angle-deg", "0.5"]  # fmt: skip
    assert main(arguments) == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "0.45um", "0.65um", "spectrum.csv", "spectrum.png",
    ]  # fmt: skip
    table = pd.read_csv(tmp_path / "out/spectrum.csv").set_index(["wavelength", "curve"])
    for curve in ("analytical", "monte carlo"):
        low, high = (table.loc[(wave, curve)] for wave in (0.45, 0.65))
        step = high.diffuse_albedo - low.diffuse_albedo
        assert abs(step - 0.2) < 3.5 * np.hypot(
            high.diffuse_albedo_stderr, low.diffuse_albedo_stderr
        )
    read = data_io.read_result(tmp_path / "out/0.65um/result.nc")
    assert np.rad2deg(read.scan_source_half_angle.values) == pytest.approx(0.5)


@pytest.mark.parametrize("whole_way", [run_pipeline, run_quick])
def test_a_raw_map_is_mended_and_one_left_by_choice_is_not(
    tmp_path: Path, whole_way: Callable[..., object]
) -> None:
    """Also profiles; only the statistics are computed here."""
    true = GaussianSurface(
        shape=(160, 160), spacing=1.0, corr_length=12.0, slope_rms=0.3
    ).sample(seed=3)
    banded = HeightMap(np.round(true.heights / 0.6) * 0.6, 1.0)
    z = np.sin(np.arange(200) / 5)
    z[7] = -9999
    path = tmp_path / "scan.csv"
    write_scan(path, ("M00",))
    scan = data_io.read_goniometer(path)

    class Enough(Exception):
        """What follows the statistics is not of interest."""

    def stop(stage: str, done: int, total: int) -> None:
        if stage == "analytical fit":
            raise Enough

    def run(surface: object) -> None:
        with pytest.raises(Enough):
            whole_way(surface, scan, material=Material(1.5), progress=stop)

    with pytest.warns(data_io.MendWarning, match="in [0-9]+ bands of 0.6"):
        run(banded)
    with pytest.warns(data_io.MendWarning, match="1 of 200 points is -9999"):
        run(data_io.Profile(np.arange(200.0), z))
    with pytest.warns(data_io.MendWarning, match="left as they are"):
        left = data_io.mend_map(banded, kinds="none")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(left)
