"""Scenes written to TOML and read back, and what a wrong file is told."""

import tomllib

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from pbrdf import GaussianSurface, HeightMap, Material, Scene, load_scene, simulate
from pbrdf.errors import DataFileError

GAUSSIAN = GaussianSurface(
    shape=(64, 48), spacing=(0.5, 0.75), corr_length=(4.0, 6.0), slope_rms=0.2
)


def there_and_back(scene, folder):
    path = folder / "scene.toml"
    scene.to_toml(path)
    return load_scene(path)


@pytest.mark.parametrize(
    "surface",
    [
        GAUSSIAN,
        GaussianSurface(shape=(32, 32), spacing=1.0, corr_length=4.0, height_rms=0.3),
        # Numbers as NumPy gives them
        GaussianSurface(
            shape=tuple(np.array([32, 40])),
            spacing=np.array([1.0, 0.5]),
            corr_length=np.float32(4.0),
            slope_rms=np.float64(0.2),
        ),
    ],
)
def test_gaussian_surface_round_trip(surface, tmp_path):
    again = there_and_back(Scene(surface, Material(1.53, 0.2, name="paint")), tmp_path)
    assert again.substrate == Material(1.53, 0.2, name="paint")
    assert again.surface.slope_rms == surface.slope_rms
    assert_array_equal(again.surface.sample(3).heights, surface.sample(3).heights)


@pytest.mark.parametrize("shape", [(5, 7), (80, 60)])
@pytest.mark.parametrize("periodic", [True, False])
def test_height_map_round_trip_inline_or_beside(shape, periodic, tmp_path):
    heights = np.random.default_rng(1).standard_normal(shape)
    surface = HeightMap(heights, (0.1, 0.3), periodic=periodic)
    again = there_and_back(Scene(surface, "bk7"), tmp_path)
    assert_array_equal(again.surface.heights, heights)
    assert again.surface.spacing == (0.1, 0.3)
    assert again.surface.periodic is periodic
    assert again.substrate.name == "bk7"
    assert bool(list(tmp_path.glob("scene-*.npy"))) == (heights.size > 4096)


def test_tabulated_material_round_trip(tmp_path):
    table = Material.from_table(
        wavelength=[0.4, 0.7], n=[1.5, 1.4], kappa=[0.1, 0.2], name="x"
    )
    again = there_and_back(Scene(HeightMap.flat(), table), tmp_path)
    assert again.substrate.index(0.5) == table.index(0.5)


@pytest.mark.parametrize(
    "material", [Material.mirror(), Material.black(), Material(1e6, 0.5)]
)
def test_limiting_materials_round_trip(material, tmp_path):
    again = there_and_back(Scene(HeightMap.flat(), material), tmp_path)
    assert again.substrate.index() == material.index()


@pytest.mark.filterwarnings("ignore:A period of")
def test_result_carries_a_scene_that_can_be_read_again(tmp_path):
    result = simulate(Scene(GAUSSIAN, Material(1.5)), 0.3, n_rays=320, realizations=8)
    path = tmp_path / "from_result.toml"
    path.write_text(result.attrs["scene"])
    assert load_scene(path).surface == GAUSSIAN


FLAT = '[surface]\ntype = "flat"\n'
GLASS = "[substrate]\nn = 1.5\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[surface", "not valid TOML"),
        (GLASS, r"no table \[surface\]"),
        (FLAT, r"no table \[substrate\]"),
        ('[surface]\ntype = "round"\n' + GLASS, "type is 'round'. Known: gaussian"),
        ('[surface]\ntype = ["flat"]\n' + GLASS, "type is"),
        ("foo = 1\n" + FLAT + GLASS, "unknown key 'foo'. A scene has"),
        (FLAT + GLASS + "[[contaminant]]\ntype = 'film'\n", "unknown key 'contaminant'"),
        (FLAT + "[substrate]\nn = " + "9" * 401 + "\n", ".n. holds 9999"),
        (FLAT + "sigma = 1\n" + GLASS, "unknown key 'sigma'. Known: size_um"),
        (FLAT + "[substrate]\nindex = 1.5\n", "unknown key 'index'"),
        (FLAT + "[substrate]\nkappa = 1.5\n", "key 'n' is missing"),
        (FLAT + "[substrate]\nn = 1.5\nkappa = -1\n", "kappa must be >= 0"),
        (FLAT + '[substrate]\nn = "glass"\n', ".n. holds .glass."),
        (FLAT + '[substrate]\nn = 1.0\nabsorbs_all = "yes"\n', "must be true or false"),
        (FLAT + "[substrate]\nn = 1.5\nname = 3\n", "name must be a text"),
        (FLAT + '[substrate]\nmaterial = "unobtainium"\n', "must be one of"),
        (FLAT + '[substrate]\nmaterial = "bk7"\nn = 1.5\n', "stands beside other keys"),
        (
            '[surface]\ntype = "gaussian"\nshape = [64, 64]\n' + GLASS,
            "'corr_length_um' is missing",
        ),
        ('[surface]\ntype = "height_map"\nspacing_um = 1\n' + GLASS, "Give exactly one"),
        (
            '[surface]\ntype = "height_map"\nfile = "gone.npy"\nspacing_um = 1\n' + GLASS,
            "gone.npy: expected a file, found none",
        ),
        ('[surface]\ntype = "height_map"\nfile = 5\nspacing_um = 1\n' + GLASS, "file"),
        (
            '[surface]\ntype = "height_map"\nheights_um = [[0, 1], [1, 2]]\n'
            'spacing_um = 1\nperiodic = "false"\n' + GLASS,
            "periodic",
        ),
    ],
)
def test_wrong_files_are_told_what_is_wrong(text, message, tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    with pytest.raises(DataFileError, match=message) as info:
        load_scene(path)
    assert str(info.value).startswith("wrong.toml")
    assert "\n" not in str(info.value)


def test_missing_and_binary_files(tmp_path):
    with pytest.raises(DataFileError, match="found none of that name"):
        load_scene(tmp_path / "none.toml")
    (tmp_path / "binary.toml").write_bytes(bytes(range(128, 256)))
    with pytest.raises(DataFileError, match="not a text file"):
        load_scene(tmp_path / "binary.toml")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "corr_length_um = -8.0",
            r"\[surface\]: corr_length_um must be positive, got -8\.",
        ),
        (
            "height_rms_um = -0.2",
            r"\[surface\]: height_rms_um must be positive, got -0\.2\.",
        ),
    ],
)
def test_errors_name_the_keys_of_the_file(tmp_path, text, words):
    given = {
        "shape": "[64, 64]", "spacing_um": "0.5", "corr_length_um": "8.0",
        "height_rms_um": "0.7",
    }  # fmt: skip
    key, value = text.split(" = ")
    lines = [f"{k} = {v}" for k, v in (given | {key: value}).items()]
    path = tmp_path / "scene.toml"
    path.write_text(
        "\n".join(['[surface]\ntype = "gaussian"', *lines, "[substrate]\nn=1.5"])
    )
    with pytest.raises(DataFileError, match=words):
        load_scene(path)


def test_a_scene_file_may_leave_the_grid_open(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(
        '[surface]\ntype = "gaussian"\ncorr_length_um = [6.0, 12.0]\nslope_rms = 0.2\n'
        "[substrate]\nn = 1.5\n"
    )
    scene = load_scene(path)
    assert scene.surface == GaussianSurface(corr_length=(6.0, 12.0), slope_rms=0.2)
    # Written out, so that a file says what was traced
    assert tomllib.loads(scene.to_toml())["surface"]["spacing_um"] == [0.75, 1.5]
