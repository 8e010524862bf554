"""Optical constants without kappa, and tables with columns that are none."""

# One line a file

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pbrdf
from pbrdf import materials
from pbrdf.cli import main
from pbrdf.errors import AccuracyWarning, DataFileError
from pbrdf.optics.dispersion import Table
from pbrdf.optics.published.transparency import doubt_of

METAL = "wavelength_nm,n\n400,0.49\n500,0.77\n600,1.26\n"
GLASS = "wavelength_nm,n\n400,1.53\n500,1.52\n600,1.515\n"


@pytest.mark.parametrize(
    ("name", "text", "doubt"),
    [
        ("layer.csv", METAL, "n is 0.49, below 1 at 0.4 um"),
        ("layer.csv", METAL.replace("0.", "1.").replace("1.26", "2"), "n rises by 0.5"),
        ("layer.csv", GLASS.replace("1.5", "4.5"), "n is 4.53 at 0.4 um"),
        ("Al-film.csv", GLASS, "'al' absorbs"),
        ("gold.csv", GLASS, "'gold' absorbs"),
    ],
)
def test_an_index_that_no_clear_medium_has_is_warned_of(tmp_path, name, text, doubt):
    (tmp_path / name).write_text(text)
    with pytest.warns(
        AccuracyWarning, match=f"{name} gives n and no kappa.*{doubt}.*kappa"
    ):
        material = materials.read(tmp_path / name)
    assert material.index(0.5)[1] == 0.0
    # Said, it is as said
    for kappa in (0.0, 6.08):
        assert materials.read(tmp_path / name, kappa=kappa).index(0.5)[1] == kappa


def test_clear_media_are_noted_and_not_warned_of(tmp_path):
    (tmp_path / "bk7.csv").write_text("# source: nobody\n" + GLASS)
    assert materials.read(tmp_path / "bk7.csv").source == "nobody; n alone: kappa = 0"
    (tmp_path / "k.csv").write_text("wavelength_nm,n,k\n400,1.53,0\n500,1.52,0\n")
    assert materials.read(tmp_path / "k.csv").source is None
    with pytest.raises(DataFileError, match="kappa of the file or beside it, got both"):
        materials.read(tmp_path / "k.csv", kappa=0.1)
    for name in ("bk7", "fused-silica", "water", "pvc", "pmma", "polystyrene"):
        # What is known of it where it is clear
        waves = np.linspace(0.4, 0.8, 9)
        n = materials.get(name).indices(waves)[0]
        assert not doubt_of(name, Table(tuple(waves), tuple(n)))


def test_columns_that_are_left_out(tmp_path, capsys):
    path = tmp_path / "film.csv"
    path.write_text("wavelength_nm,T,n,k\n400,20,1.5,0.1\n500,,1.4,0.2\n")
    with pytest.raises(DataFileError, match=r"got 'T'\. .*--material-ignore NAME, ignore="):
        materials.read(path)
    assert_allclose(materials.read(path, ignore=["T"]).index(0.45), (1.45, 0.15))
    with pytest.raises(DataFileError, match="expected the columns 'x', found none"):
        materials.read(path, ignore=["T", "x"])
    path.write_text("wl;T;n;k\nnm;°C;;\n400;20;1,5;0,1\n500;20;1,4;0,2\n")
    assert_allclose(materials.read(path, ignore=["T"]).index(0.45), (1.45, 0.15))
    path.write_text("wavelength_nm,T,n,k\n400,20,1.5,0.1\n400,80,1.6,0.1\n")
    with pytest.raises(DataFileError, match="400 twice"):
        materials.read(path, ignore=["T"])


@pytest.mark.parametrize(
    ("text", "encoding"),
    [
        ("wavelength_nm n k\n400 1,5 0,1\n500 1,4 0,2\n", "utf-8"),
        ("wavelength_nm\tn\tk\n400\t1.5\t0.1\n500\t1.4\t0.2\n", "utf-16-le"),
        ("wavelength_nm\tn\tk\n400\t1.5\t0.1\n500\t1.4\t0.2\n", "utf-16-be"),
        (",wavelength_nm,n,k\n0,400,1.5,0.1\n1,500,1.4,0.2\n", "utf-8"),
        ("lambda,n,k\nnm,1,1\n400,1.5,0.1\n500,1.4,0.2\n", "utf-8"),
        ("wavenumber (cm-1);n;k\n25000;1,5;1e\u22121\n20000;1,4;2e\u22121\n", "utf-8"),
    ],
)
def test_ways_to_write_one_table(tmp_path, text, encoding):
    (tmp_path / "film.csv").write_bytes(text.encode(encoding))
    found = materials.read(tmp_path / "film.csv")
    assert_allclose([found.index(0.4), found.index(0.5)], [(1.5, 0.1), (1.4, 0.2)])


def test_a_column_of_names_is_left_out_before_the_numbers(tmp_path):
    text = "material,wavelength_nm,n,k\nfilm,400,1.5,0.1\nfilm,500,1.4,0.2\n"
    (tmp_path / "film.csv").write_text(text)
    found = materials.read(tmp_path / "film.csv", ignore=["material"])
    assert_allclose(found.index(0.45), (1.45, 0.15))


@pytest.mark.parametrize(
    ("rows", "cure"),
    [
        ("400,1.5,-0.1\n", "write the second without its sign"),
        ("400,1.5+0.1i,0\n", "real and the imaginary part of a complex number a column"),
        ("400,1.5,n/a\n", "Leave rows with a gap out"),
        ("400,1.5,0.1\n500,1.5,0.1\nSource: me\n", "Remarks begin with #"),
    ],
)
def test_refusals_of_constants_name_the_cure(tmp_path, rows, cure):
    (tmp_path / "film.csv").write_text("wavelength_nm,n,k\n" + rows)
    with pytest.raises(DataFileError, match=cure):
        materials.read(tmp_path / "film.csv")


def scene(tmp_path, substrate):
    text = '[surface]\ntype = "flat"\nsize_um = [1, 1]\n[substrate]\n' + substrate
    (tmp_path / "scene.toml").write_text(text)
    return pbrdf.load_scene(tmp_path / "scene.toml").materials[0]


def test_scene_files_say_what_is_left_out_and_give_kappa(tmp_path):
    (tmp_path / "f.csv").write_text("wavelength_nm,T,n,k\n400,20,1.5,0.1\n500,20,1.4,0.2\n")
    (tmp_path / "n.csv").write_text(METAL)
    found = scene(tmp_path, 'file = "f.csv"\nignore = ["T"]\n')
    assert_allclose(found.index(0.45), (1.45, 0.15))
    apart = (
        'n = { file = "f.csv", ignore = ["T"] }\nkappa = { file = "f.csv", ignore = ["T"] }'
    )
    assert_allclose(scene(tmp_path, apart).index(0.45), (1.45, 0.15))
    assert_allclose(
        scene(tmp_path, 'file = "n.csv"\nkappa = 6.0\n').index(0.5), (0.77, 6.0)
    )
    for substrate in ('file = "n.csv"\n', 'n = { file = "n.csv" }\n',
                      "n = [0.5, 0.7]\nwavelength_um = [0.4, 0.5]\n"):  # fmt: skip
        with pytest.warns(AccuracyWarning, match=r"gives n and no kappa.*below 1"):
            scene(tmp_path, substrate)
    for substrate, message in (
        ('file = "f.csv"\nignore = "T"\n', "'ignore' must be a list of names"),
        ('n = 1.5\nignore = ["T"]\n', "'ignore' stands without 'file'"),
        ('file = "n.csv"\nkappa = "x"\n', "kappa beside 'file' must be a number"),
        ('file = "f.csv"\nignore = ["T"]\nkappa = 1.0\n', "got both, 1 beside it"),
    ):
        with pytest.raises(DataFileError, match=message):
            scene(tmp_path, substrate)


def test_command_line_gives_kappa_and_leaves_columns_out(tmp_path, capsys):
    scan = tmp_path / "scan.csv"
    rows = "".join(f"30,{v},{0.1 + 0.001 * v}\n" for v in range(-60, 61, 10))
    scan.write_text("theta_i_deg,theta_view_deg,M00\n" + rows)
    (tmp_path / "film.csv").write_text("wavelength_nm,T,n\n400,20,0.5\n700,20,0.6\n")
    words = ["fit", str(scan), "--slope-rms", "0.2", "--material-file"]

    def said(*more):
        with warnings.catch_warnings():
            warnings.simplefilter("always")
            main([*words, *more])
        return capsys.readouterr().err

    film = str(tmp_path / "film.csv")
    assert "got 'T'" in said(film)
    assert "no kappa" in said(film, "--material-ignore", "T")
    assert "no kappa" not in said(film, "--material-ignore", "T", "--kappa", "3")
    words = ["fit", str(scan), "--slope-rms", "0.2"]
    assert "--n 0.5 gives n and no kappa" in said("--n", "0.5")
    assert "no kappa" not in said("--n", "0.5", "--kappa", "0")
    assert "--material-ignore names columns" in said("--n", "1.5", "--material-ignore", "T")
