"""`pbrdf sweep` and `pbrdf simulate`: what varies becomes a dimension of the result."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import pbrdf
from data_io import read_result
from pbrdf.cli import main
from pbrdf.sweeps import sweep_of

SCENE = """
[surface]
type = "gaussian"
shape = [48, 48]
spacing_um = 1.0
corr_length_um = 6.0
slope_rms = 0.05

[substrate]
n = 1.5

[[contaminants]]
type = "drops"
contact_angle_deg = 60
coverage = 0.1
number_density_per_mm2 = 4000
material = { n = 1.333 }
"""
DUST = """
[[contaminants]]
type = "spheres"
radius_um = 2
number_density_per_mm2 = 1000
material = { n = 1.5, kappa = 0.1 }

[[contaminants]]
type = "film"
thickness_um = 0.1
material = { n = 1.4 }
"""
QUICK = [
    "--n-rays", "1000", "--realizations", "8", "--n-theta", "9", "--n-dphi", "12",
]  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "scene.toml").write_text(SCENE)
    (tmp_path / "dusty.toml").write_text(SCENE + DUST)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_contact_angle_and_coverage_vary_like_any_key(folder: Path) -> None:
    vary = ["--vary", "contact_angle_deg=30,90", "--vary", "coverage=0.05,0.2"]
    more = ["--fold", "--source-half-angle-deg", "2", "-o", "sweep.nc"]
    assert main(["sweep", "scene.toml", *vary, *more, *QUICK]) == 0
    result = read_result(folder / "sweep.nc")
    assert dict(result.brdf_total.sizes) == {
        "contact_angle_deg": 2, "coverage": 2, "theta_i": 1, "theta_s": 9, "dphi": 12,
        "stokes_out": 4, "stokes_in": 4,
    }  # fmt: skip
    # Each is the scene that a file with these values would give
    scene = pbrdf.Scene(
        pbrdf.GaussianSurface(
            shape=(48, 48), spacing=1.0, corr_length=6.0, slope_rms=0.05
        ),
        pbrdf.Material(1.5),
        pbrdf.Drops(
            contact_angle=np.deg2rad(90), coverage=0.05, number_density=4e-3,
            material=pbrdf.Material(1.333),
        ),
    )  # fmt: skip
    alone = pbrdf.simulate(
        scene, np.deg2rad(30), phi_i="uniform", n_rays=1000, realizations=8, n_theta=9,
        n_dphi=12, fold=True, source_half_angle=np.deg2rad(2),
    )  # fmt: skip
    here = result.sel(contact_angle_deg=90, coverage=0.05)
    assert_array_equal(here.brdf, alone.brdf)
    assert (here.brdf_total != result.brdf_total.isel(coverage=1)).any()


def test_azimuths_are_a_dimension(folder: Path, capsys: pytest.CaptureFixture) -> None:
    azimuths = ["--phi-i-deg", "0,90"]
    assert main(["sweep", "scene.toml", "--vary", "n=1.4,1.6", *azimuths, *QUICK]) == 0
    swept = read_result(folder / "scene-sweep.nc")
    assert_allclose(np.rad2deg(swept.phi_i), [0.0, 90.0])
    assert swept.albedo.sizes["phi_i"] == swept.albedo.sizes["n"] == 2
    capsys.readouterr()
    assert main(["simulate", "scene.toml", *azimuths, *QUICK]) == 0
    assert capsys.readouterr().out.count("azimuth 90°:") == 1
    result = read_result(folder / "scene.nc")
    assert result.brdf.dims[:3] == ("bounces", "theta_i", "phi_i")
    assert abs(result.brdf.isel(phi_i=0) - result.brdf.isel(phi_i=1)).max() > 0
    capsys.readouterr()
    for wrong, words in (
        ([], "several values of n and phi_i. Give --at n=VALUE, one of 1.4, 1.6; --at"),
        (["--at", "n=1.4"], "of phi_i. Give --at phi_i_deg=VALUE, one of 0 deg, 90 deg"),
        (["--at", "phi_i_deg"], "--at must be NAME=VALUE"),
        (["--at", "m=1"], "further dimension of the result, n, phi_i_deg, got 'm'"),
    ):
        assert main(["plot", "scene-sweep.nc", *wrong]) == 2
        assert words in capsys.readouterr().err
    both = ["--at", "n=1.4", "--at", "phi_i_deg=90"]
    absent = ["--at", "n=1.4", "--at", "phi_i_deg=80"]
    assert main(["plot", "scene-sweep.nc", *absent]) == 2
    assert "one of 0 deg, 90 deg" in capsys.readouterr().err
    assert main(["plot", "scene-sweep.nc", *both]) == 0


@pytest.mark.parametrize(
    "key",
    [
        "slope_rms", "height_rms_um", "corr_length_um", "n", "kappa", "contact_angle_deg",
        "coverage", "capillary_length_um", "radius_um", "sink", "thickness_um",
    ],
)  # fmt: skip
def test_every_last_key_changes_the_scene(folder: Path, key: str) -> None:
    document = tomllib.loads((folder / "dusty.toml").read_text())
    source = folder / "dusty.toml"
    # A key beside which another stands is that of the table that has it
    sweep = sweep_of(document, source, {key: [0.25]}, {})
    text = sweep.at({key: 0})[0].to_toml()
    unlike = set(text.splitlines()) - set(pbrdf.load_scene(source).to_toml().splitlines())
    (line,) = (line for line in unlike if "name" not in line)
    assert line.split(" = ")[0] == key
    assert_allclose(float(line.split(" = ")[1]), 0.25)


def test_several_materials_keep_their_surface_sweep(tmp_path: Path) -> None:
    surface = pbrdf.HeightMap(
        np.zeros((4, 4)), 1.0, periodic=True, labels=np.eye(4, dtype=np.uint8)
    )
    scene = pbrdf.Scene(surface, ["pvc", "bk7"], pbrdf.Film(thickness=1.0))
    document = tomllib.loads(scene.to_toml())
    source = tmp_path / "scene.toml"
    sweep = sweep_of(document, source, {"thickness_um": [2.0]}, {})
    assert sweep.at({"thickness_um": 0})[0].contaminants[0].thickness == 2.0
    with pytest.raises(ValueError, match=r"substrate.materials\[0\].n, substrate"):
        sweep_of(document, source, {"n": [1.5]}, {})
    one = sweep_of(document, source, {"substrate.materials[1].material": ["pvc"]}, {})
    assert [m.name for m in one.at({"material": 0})[0].substrate] == ["pvc", "pvc"]


def test_the_incidence_of_a_store_has_no_second_name(
    folder: Path, capsys: pytest.CaptureFixture
) -> None:
    words = ["sweep", "scene.toml", "--vary", "n=1.4,1.6", *QUICK, "-o", "s.zarr"]
    assert main(words) == 0
    capsys.readouterr()
    for command, target, cure in (
        ("plot", "s.png", "Give --theta-i-deg."),
        ("export", "s.csv", "Leave it out, all of the store are written."),
    ):
        at = ["--at", "n=1.5", "--at", "theta_i_deg=30"]
        assert main([command, "s.zarr", *at, "-o", target]) == 2
        told = capsys.readouterr().err
        assert f"must not name the incidence, got theta_i_deg of value 30. {cure}" in told
