"""`pbrdf radiance`: the table holds what the library gives, and refusals name options."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

import pbrdf
from data_io import read_result, write_model
from pbrdf import Material, MicrofacetModel
from pbrdf.cli import main
from pbrdf.signatures import ClearSky, RayleighSky, Sun, rayleigh_optical_depth

SCENE = """
[surface]
type = "gaussian"
shape = [48, 48]
spacing_um = 1.0
corr_length_um = 6.0
slope_rms = 0.2

[substrate]
n = 1.5
kappa = 0.3
"""

NOON = ["--time", "2026-06-21T12:00Z", "--latitude-deg", "1", "--longitude-deg", "2"]
WARM = ["--temperature-k", "300", "--wavelength-um", "10"]

MODEL = MicrofacetModel(Material(1.5, 0.2), slope_rms=0.3, diffuse_albedo=0.1)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    write_model(MODEL, tmp_path / "model.toml")
    (tmp_path / "scene.toml").write_text(SCENE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_model_under_sun_and_sky(folder: Path) -> None:
    place = ["--sun-zenith-deg", "40", "--sun-azimuth-deg", "100", "--planck-sun"]
    views = ["--view-zenith-deg", "20,50", "--view-azimuth-deg", "-30"]
    light = ["--sky", "rayleigh", "--wavelength-um", "0.5,0.6"]
    assert main(["radiance", "model.toml", *place, *views, *light]) == 0
    table = pd.read_csv("model-radiance.csv", comment="#")
    sun = Sun.planck(
        theta=np.deg2rad(40),
        phi=np.deg2rad(100),
        optical_depth=lambda w: float(rayleigh_optical_depth(w)),
    )
    row = table[(table.theta_s_deg == 50) & (table.wavelength_um == 0.6)].iloc[0]
    seen = pbrdf.signature(
        MODEL, np.deg2rad(50), phi_s=np.deg2rad(-30), wavelength=0.6, sun=sun,
        sky=RayleighSky(sun=sun),
    )  # fmt: skip
    assert len(table) == 4
    assert_allclose(row[list("IQUV")].to_numpy(float), seen.radiance, rtol=1e-6, atol=1e-9)
    assert_allclose(row.reflected_sky_Q, seen.reflected_sky[1], rtol=1e-6)
    assert (table.I_stderr > 0).all()
    assert main(["radiance", "model.toml", *place]) == 2


def test_a_clear_sky_over_bright_ground_in_the_mountains(folder: Path) -> None:
    place = ["--sun-zenith-deg", "50", "--sun-azimuth-deg", "20"]
    light = ["--sky", "clear", "--ground-albedo", "0.3", "--pressure-hpa", "700"]
    view = ["--view-zenith-deg", "40", "--wavelength-um", "0.45"]
    assert main(["radiance", "model.toml", *place, *light, *view]) == 0
    row = pd.read_csv("model-radiance.csv", comment="#").iloc[0]
    depth = float(rayleigh_optical_depth(0.45, 700.0))
    sun = Sun(theta=np.deg2rad(50), phi=np.deg2rad(20), optical_depth=depth)
    sky = ClearSky(sun=sun, pressure=700.0, ground_albedo=0.3)
    seen = pbrdf.signature(MODEL, np.deg2rad(40), wavelength=0.45, sun=sun, sky=sky)
    assert_allclose(row[list("IQUV")].to_numpy(float), seen.radiance, rtol=1e-6, atol=1e-9)


def test_a_result_that_is_warm(folder: Path, capsys: pytest.CaptureFixture) -> None:
    quick = ["--n-rays", "1000", "--realizations", "8", "--phi-i-deg", "uniform"]
    assert (
        main(["simulate", "scene.toml", "--theta-i-deg", "50", "-o", "r.nc", *quick]) == 0
    )
    warm = ["--temperature-k", "300", "--wavelength-um", "10", "--view-zenith-deg", "50"]
    sky = ["--sky-temperature-k", "300"]
    assert main(["radiance", "r.nc", *warm, *sky, "-o", "seen.nc"]) == 0
    seen = read_result("seen.nc")
    assert_allclose(seen.radiance.sel(stokes="I"), 9.924, atol=1e-3)
    assert main(["radiance", "r.nc", *warm, "-o", "cold.csv"]) == 0
    assert main(["radiance", "r.nc", *warm[:-1], "40", "-o", "no.csv"]) == 2
    assert "--view-zenith-deg must be an incident zenith" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["model.toml"], "give --sun-zenith-deg"),
        (["scene.toml", "--sun-zenith-deg", "30"], "is a scene"),
        (["model.toml", "--sky", "rayleigh"], "--sky rayleigh needs --sun-zenith-deg"),
        (["model.toml", "--sky", "clear"], "--sky clear needs --sun-zenith-deg"),
        (["model.toml", "--sky", "overcast"], "needs --sky-radiance"),
        (
            [
                "model.toml",
                "--ground-albedo",
                "0.2",
                "--sun-zenith-deg",
                "3",
                "--sky",
                "rayleigh",
            ],
            "--ground-albedo needs --sky clear",
        ),
        (
            [
                "model.toml",
                "--pressure-hpa",
                "700",
                "--sun-zenith-deg",
                "3",
                "--sky",
                "clear",
                "--optical-depth",
                "0.2",
            ],
            "two atmospheres",
        ),
        (["model.toml", "--sun-zenith-deg", "30", "--sky", "rayleigh"], "--wavelength-um"),
        (["model.toml", "--sun-zenith-deg", "30", "-o", "a.txt"], ".csv or .nc"),
        (["model.toml", "--sun-azimuth-deg", "30"], "needs --sun-zenith-deg"),
        (["model.toml", *NOON, "--sun-azimuth-deg", "3"], "and --sun-azimuth-deg"),
        (["model.toml", "--sun-zenith-deg", "30", "--view-azimuth-deg", "800"], "got 800."),
        (["model.toml", "--sun-zenith-deg", "30", *WARM], "--planck-sun must be given"),
        (["model.toml", "--sun-zenith-deg", "30", "--at", "n=2"], "is for a store of a s"),
    ],
)
def test_refusals_name_options(
    folder: Path, capsys: pytest.CaptureFixture, arguments: list[str], words: str
) -> None:
    assert main(["radiance", *arguments]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1


def test_a_model_that_notes_its_surface_is_no_scene(folder: Path) -> None:
    notes = {"surface": {"slope_rms": {"value": 0.3, "stderr": 0.01}}}
    write_model(MODEL, folder / "noted.toml", notes=notes)
    options = ["--sun-zenith-deg", "30", "--wavelength-um", "0.55"]
    assert main(["radiance", "noted.toml", *options, "-o", "noted.csv"]) == 0
    assert main(["radiance", "model.toml", *options, "-o", "plain.csv"]) == 0
    assert pd.read_csv("noted.csv", comment="#").equals(
        pd.read_csv("plain.csv", comment="#")
    )
