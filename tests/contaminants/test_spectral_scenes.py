"""Scenes whose constants depend on the wavelength, from files and on the command line."""

import csv
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose
from typer.testing import CliRunner

from pbrdf import Material, MicrofacetModel, load_scene, simulate
from pbrdf.cli.app import app

SCENE = """
[surface]
type = "flat"

[substrate]
wavelength_um = [0.4, 0.8, 1.2]
n = [1.55, 1.5, 1.48]
diffuse_albedo = [0.1, 0.5, 0.3]

[[contaminants]]
type = "film"
thickness_um = 300.0
material = { wavelength_um = [0.4, 1.2], n = 1.33, kappa = [0.0, 2e-4] }
"""


def test_constants_by_wavelength_in_a_scene_file(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    scene = load_scene(path)
    assert_allclose(scene.substrate.albedo([0.4, 0.6, 1.2]), [0.1, 0.3, 0.3])
    with warnings.catch_warnings(action="ignore"):
        waves = [0.4, 0.8, 1.1]
        together = simulate(scene, 0.3, wavelength=waves, n_rays=3200, seed=2)
        assert together.sizes["wavelength"] == 3
        for k, wave in enumerate(waves):
            one = Material(
                float(scene.substrate.index(wave)[0]),
                diffuse_albedo=float(scene.substrate.albedo(wave)),
            )
            film = scene.contaminants[0]
            liquid = Material(*film.material.index(wave))
            alone = type(scene)(
                scene.surface, one, type(film)(thickness=300.0, material=liquid)
            )
            result = simulate(alone, 0.3, wavelength=wave, n_rays=3200, seed=2)
            assert_allclose(together.brdf.isel(wavelength=k), result.brdf, rtol=1e-9)
    again = tmp_path / "again.toml"
    scene.to_toml(again)
    assert load_scene(again).substrate == scene.substrate
    assert load_scene(again).contaminants == scene.contaminants


def test_a_tabulated_albedo_is_refused_where_it_has_no_meaning():
    painted = Material.from_table(
        wavelength=[0.4, 0.8], n=[1.5, 1.5], diffuse_albedo=[0.1, 0.4]
    )
    with pytest.raises(ValueError, match="diffuse_albedo of the material must be one"):
        MicrofacetModel(painted, 0.2)
    with pytest.raises(ValueError, match="wavelength must be given for a tabulated diff"):
        painted.albedo()
    with pytest.raises(ValueError, match=r"diffuse_albedo must lie in \[0, 1\]"):
        Material.from_table(wavelength=[0.4, 0.8], n=1.5, diffuse_albedo=[0.1, 1.4])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::pbrdf.errors.AccuracyWarning")
def test_dew_at_several_wavelengths(tmp_path):
    target = tmp_path / "dew"
    words = ["dew", "--contact-angles-deg", "90", "--n-rays", "1000", "--runs", "4"]
    words += ["--wavelength-um", "0.55,2.95", "--volume-per-area-um", "5", "-o"]
    done = CliRunner().invoke(app, [*words, str(target)])
    assert done.exit_code == 0, done.output
    with (target / "dew.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert {row["wavelength_um"] for row in rows} == {"0.55", "2.95"}
    dry = [float(row["M00"]) for row in rows if row["state"] == "dry"]
    # The substrate has one index: dry it is the same at both
    assert np.isclose(dry[0], dry[len(dry) // 2])
    assert (target / "hemisphere_40deg_2.95um.png").exists()
