"""Contaminants in scene files: there and back, and what a wrong file is told."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from data_io import read_result
from pbrdf import Drops, Film, HeightMap, Material, Scene, Spheres, load_scene
from pbrdf.cli import main
from pbrdf.errors import DataFileError

FLAT = HeightMap.flat(size=(100.0, 80.0))
HEAD = '[surface]\ntype = "flat"\nsize_um = [100.0, 80.0]\n\n[substrate]\nn = 1.5\n\n'

EVERYTHING = (
    Drops(contact_angle=np.deg2rad(87.3), volume_per_area=1.7, number_density=4.1e-4,
          material=Material(1.333), sizes="breath-figure", seed=3, gravity=False,
          capillary_length=1900.0, roughness="ignore"),
    Drops(contact_angle=1.1, coverage=0.13, number_density=7e-4, sizes="lognormal",
          width=0.4),
    Drops.at([[10.0, 20.0], [3.0, 4.5]], volume=[30.0, 7.0], contact_angle=3.0),
    Spheres(radius=3.5, coverage=0.1, material=Material(1.5, 0.1, name="soot"), sink=0.2),
    Spheres.at([[1.0, 2.0, 9.0]], radius=4.0, material="aluminium"),
    Film(thickness=0.3, level=True),
)  # fmt: skip


def test_everything_round_trips(tmp_path):
    path = tmp_path / "scene.toml"
    scene = Scene(FLAT, "bk7", EVERYTHING)
    scene.to_toml(path)
    again = load_scene(path)
    assert again.to_toml() == scene.to_toml()
    for one, other in zip(scene.contaminants, again.contaminants, strict=True):
        assert type(one) is type(other)
        for name in one.__dataclass_fields__:
            was, now = getattr(one, name), getattr(other, name)
            if isinstance(was, np.ndarray):
                assert_array_equal(now, was)
            elif isinstance(was, float):
                assert_allclose(now, was, rtol=1e-15)
            else:
                assert now == was, name


def test_units_are_those_of_the_keys(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(HEAD + '''
[[contaminants]]
type = "drops"
contact_angle_deg = 60
volume_per_area_um = 12
number_density_per_mm2 = 40
material = "water"

[[contaminants]]
type = "spheres"
radius_um = 2
number_density_per_mm2 = 1000
material = { n = 1.5, kappa = 0.02 }
''')  # fmt: skip
    drops, spheres = load_scene(path).contaminants
    assert_allclose(drops.contact_angle, np.pi / 3)
    assert_allclose(drops.number_density * 1e6, 40.0)
    assert drops.volume_per_area == 12.0
    assert drops.material.name == "water"
    assert_allclose(spheres.number_density, 1e-3)
    assert spheres.material == Material(1.5, 0.02)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('type = "rain"', r"\[contaminants\]: type is 'rain'. Known: drops, spheres, film"),
        ("thickness_um = 1", r"\[contaminants\]: type is None"),
        ('type = "film"', r"\[contaminants film\]: key 'thickness_um' is missing"),
        ('type = "film"\nthickness = 1', r"unknown key 'thickness'. Known: level"),
        ('type = "film"\nthickness_um = -1', r"thickness_um must be positive \[um\], got"),
        ('type = "film"\nthickness_um = "1 um"', r"'thickness_um' holds '1 um'. Write"),
        ('type = "film"\nthickness_um = 1\nmaterial = "wter"', r"material must be one"),
        ('type = "film"\nthickness_um = 1\nmaterial = 1.3', r"material must be a Mat"),
        ('type = "film"\nthickness_um = 1\nmaterial = {m = 1.3}', r"unknown key 'm'"),
        ('type = "film"\nthickness_um = 1\nlevel = 1', r"level must be one of False"),
        ('type = "drops"\ncontact_angle_deg = 700', "contact_angle_deg is 700"),
        ('type = "drops"\ncontact_angle_deg = 70', r"amount must be two of"),
        ('type = "drops"\ncontact_angle_deg = true', r"'contact_angle_deg' holds true"),
        ('type = "spheres"\nradius_um = "3"\nmaterial = "water"',
         r"\[contaminants spheres\]: 'radius_um' holds '3'"),
        ('type = "drops"\ncontact_angle_deg = 9\npositions_um = [[1, true]]', "holds true"),
        ('type = "drops"\ncontact_angle_deg = 9\npositions_um = [[1, 2], [3]]',
         r"'positions_um' is \[\[1, 2\], \[3\]\]"),
        ('type = "spheres"\nradius_um = 1', r"key 'material' is missing"),
        ('type = "film"\nthickness_um = 1e300', r"thickness_um must be at most 1e9 um"),
    ],
)  # fmt: skip
def test_wrong_tables_are_told_what_is_wrong(text, message, tmp_path):
    path = tmp_path / "dew.toml"
    path.write_text(f"{HEAD}[[contaminants]]\n{text}\n")
    with pytest.raises(DataFileError, match=rf"^dew.toml: .*{message}"):
        load_scene(path)


def test_contaminants_must_be_a_list_of_tables(tmp_path):
    path = tmp_path / "dew.toml"
    path.write_text(f'contaminants = "water"\n{HEAD}')
    with pytest.raises(DataFileError, match=r"Write \[\[contaminants\]\]"):
        load_scene(path)


def test_the_command_simulates_what_the_file_says(tmp_path, capsys):
    path = tmp_path / "wet.toml"
    path.write_text(HEAD + '[[contaminants]]\ntype = "film"\nthickness_um = 4\n'
                    'material = { n = 1.333 }\n')  # fmt: skip
    arguments = ["--theta-i-deg", "0", "--n-rays", "1000", "--realizations", "1"]
    assert main(["simulate", str(path), *arguments]) == 0
    capsys.readouterr()
    result = read_result(tmp_path / "wet.nc")
    # Water on n = 1.5 reflects 2.37 %, dry 4 %; beams are split at random
    error = float(np.linalg.norm(result.albedo_stderr.values))
    assert abs(float(result.albedo.sum()) - 0.02370816) < 5 * error < 1e-3
    assert "thickness_um = 4" in result.attrs["scene"]
    assert "film" in result.attrs["contaminants"][0]
