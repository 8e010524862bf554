"""Scenes whose constants depend on the wavelength, from files and on the command line."""

import csv
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose
from typer.testing import CliRunner

from pbrdf import Material, MicrofacetModel, load_scene, materials, simulate
from pbrdf.analytic import reflectance
from pbrdf.cli.app import app
from pbrdf.errors import DataFileError

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


def test_one_constant_from_a_file_of_its_own(tmp_path):
    (tmp_path / "base.csv").write_text("wavelength_nm,diffuse_albedo\n400,0.2\n800,0.6\n")
    (tmp_path / "dye.csv").write_text("wavelength_um,n,k\n0.3,9,0.1\n0.9,9,0.3\n")
    path = tmp_path / "scene.toml"
    path.write_text("""
[surface]
type = "flat"
[substrate]
n = { wavelength_um = [0.4, 0.8], values = [1.6, 1.5] }
diffuse_albedo = { file = "base.csv" }
[[contaminants]]
type = "film"
thickness_um = 300.0
material = { n = 1.33, kappa = { file = "dye.csv" } }
""")
    scene = load_scene(path)
    assert_allclose(scene.substrate.albedo([0.4, 0.7]), [0.2, 0.5])
    assert_allclose(scene.substrate.index(0.6), (1.55, 0.0))
    assert_allclose(scene.contaminants[0].material.index(0.4), (1.33, 0.1 + 0.2 / 6))
    scene.to_toml(tmp_path / "again.toml")
    again = load_scene(tmp_path / "again.toml")
    assert (again.substrate, again.contaminants) == (scene.substrate, scene.contaminants)


def test_a_file_of_constants_may_hold_the_albedo_of_the_base(tmp_path):
    path = tmp_path / "paint.csv"
    path.write_text("wavelength_um,n,diffuse_albedo\n0.4,1.5,0.2\n0.8,1.5,0.6\n")
    assert_allclose(materials.read(path).albedo(0.5), 0.3)
    scene = '[surface]\ntype = "flat"\n[substrate]\nfile = "paint.csv"\n'
    (tmp_path / "scene.toml").write_text(scene + "diffuse_albedo = 0.1\n")
    with pytest.raises(DataFileError, match="stands beside a file that has it"):
        load_scene(tmp_path / "scene.toml")
    path.write_text("wavelength_um,n,diffuse_albedo\n0.4,1.5,20\n0.8,1.5,60\n")
    with pytest.raises(DataFileError, match=r"line 2.*expected diffuse_albedo in \[0, 1\]"):
        materials.read(path)


@pytest.mark.parametrize(
    ("substrate", "message"),
    [
        ("n = 1.4\nwavelength_um = [0.4, 0.8]", "nothing listed by 'wavelength_um'"),
        ("n = [1.3, 1.4]", "'n' without 'wavelength_um'. Write one of n, kappa"),
        ("n = [1.3, true]\nwavelength_um = [0.4, 0.8]", "'n' holds true"),
        ("n = 1.4\nkappa = '0.1'", "'kappa' holds '0.1'"),
        ("n = [1.3, 1.4]\nwavelength_um = [0.8, 0.4]", "wavelength must"),
        ("n = {formula = 1, coefficients = [0, '1'], range_um = [0.4, 0.8]}",
         r".n\]: 'coefficients' holds '1'"),
        ("n = {formula = 11, coefficients = [0, 1], range_um = [0.4, 0.8]}",
         r".n\]: formula must be one of 1 to 9"),
        ("n = {formula = 1, coefficients = [0, 1], range_um = [0.4]}",
         r".n\]: range_um must be two wavelengths"),
    ],
)  # fmt: skip
def test_constants_that_are_none_are_named_with_their_table(tmp_path, substrate, message):
    path = tmp_path / "scene.toml"
    path.write_text(f"[surface]\ntype = 'flat'\n[substrate]\n{substrate}\n")
    with pytest.raises(DataFileError, match=rf"^scene.toml: \[substrate.*{message}"):
        load_scene(path)


@pytest.mark.parametrize(
    ("constant", "message"),
    [
        ('{ file = "n.csv" }', "n.csv: expected kappa, got n only"),
        ('{ file = "absent.csv" }', "absent.csv: cannot be read"),
        ("{ file = 7 }", r"\[substrate\] kappa: 'file' must be a path, got 7"),
        ('{ file = "../n.csv" }', r"\[substrate\] kappa: file .* outside the folder"),
        ('{ file = "n.csv", unit = "nm" }', "or file, or|or file, got 'file', 'unit'"),
    ],
)
def test_files_of_one_constant_that_do_not_hold_it(tmp_path, constant, message):
    (tmp_path / "n.csv").write_text("wavelength_nm,n\n400,1.4\n800,1.5\n")
    path = tmp_path / "scene.toml"
    path.write_text(f'[surface]\ntype = "flat"\n[substrate]\nn = 1.5\nkappa = {constant}\n')
    with pytest.raises(DataFileError, match=message):
        load_scene(path)


def test_the_model_takes_a_tabulated_albedo_at_its_wavelength():
    painted = Material.from_table(
        wavelength=[0.4, 0.8], n=[1.5, 1.45], diffuse_albedo=[0.1, 0.4]
    )
    model = MicrofacetModel(painted, 0.2)
    waves, theta_s = np.array([0.5, 0.7]), np.array([[0.2], [0.9], [1.1]])
    together = model.brdf(0.3, theta_s, 2.1, waves)
    out = np.empty((3, 2, 4, 4))
    assert model.brdf(0.3, theta_s, 2.1, waves, out=out) is out
    for k, (n, albedo) in enumerate([(1.4875, 0.175), (1.4625, 0.325)]):
        one = MicrofacetModel(Material(n, diffuse_albedo=albedo), 0.2)
        expected = one.brdf(0.3, theta_s[:, 0], 2.1)
        assert_allclose(together[:, k], expected, rtol=1e-12)
        assert_allclose(out[:, k], expected, rtol=1e-12)
        assert_allclose(
            reflectance(model, 0.3, waves[k]).value, reflectance(one, 0.3).value, rtol=1e-9
        )
    with pytest.raises(ValueError, match="wavelength must be given for a tabulated"):
        model.brdf(0.3, 0.2, 2.1)
    with pytest.raises(ValueError, match="volume_albedo must be 0 over a material"):
        MicrofacetModel(painted, 0.2, volume_albedo=0.1)


def test_albedos_of_tables_are_checked():
    painted = Material.from_table(wavelength=[0.4, 0.8], n=1.5, diffuse_albedo=[0.1, 0.4])
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
