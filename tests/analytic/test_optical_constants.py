"""Library values against numbers printed elsewhere; no extrapolation; user tables."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import materials
from pbrdf.errors import DataFileError
from pbrdf.optics import Material, Polynomial, Sellmeier, read_material


@pytest.mark.parametrize(
    ("name", "wavelength", "n", "kappa", "tolerance"),
    [
        # Schott N-BK7 data sheet: n_d, n_F, n_C, n_t
        ("bk7", 0.5875618, 1.51680, 0, 6e-6),
        ("bk7", 0.4861327, 1.52238, 0, 6e-6),
        ("bk7", 0.6562725, 1.51432, 0, 6e-6),
        ("bk7", 1.01398, 1.50731, 0, 6e-6),
        # Malitson 1965, table of computed values
        ("fused-silica", 0.589262, 1.458404, 0, 2e-6),
        ("fused-silica", 2.0, 1.438, 0, 6e-4),
        # Hale and Querry 1973, rows of their table
        ("water", 0.55, 1.333, 1.96e-9, 1e-9),
        ("water", 3.0, 1.371, 0.272, 1e-9),
        ("water", 10.0, 1.218, 0.0508, 1e-9),
        # PMMA at the d line, usually quoted as 1.491
        ("pmma", 0.5876, 1.491, 0, 6e-3),
        # NIST's and most handbooks' aluminium: 1.0 + 6.7i in the green
        ("aluminium", 0.55, 1.0, 6.7, 0.1),
        ("gold", 4.0, 1.9, 27.9, 1.2),
    ],
)
def test_library_gives_the_published_values(name, wavelength, n, kappa, tolerance):
    assert_allclose(materials.get(name).index(wavelength), (n, kappa), atol=tolerance)


@pytest.mark.parametrize(
    "name", [n for n in materials.names() if n not in ("mirror", "black")]
)
def test_every_entry_has_source_and_range_and_refuses_to_extrapolate(name):
    material = materials.get(name)
    low, high = material.valid_range
    assert material.source
    assert 0.1 < low < high <= 200.0
    n, kappa = material.indices(np.geomspace(low, high, 50)[1:-1])
    assert (n > 0).all()
    assert (kappa >= 0).all()
    for outside in (0.99 * low, 1.01 * high):
        with pytest.raises(
            ValueError, match=rf"range of {material.name}, .*not extrapolated"
        ):
            material.index(outside)


def test_the_midwave_infrared_is_covered():
    known = [m for m in map(materials.get, materials.names()) if m.valid_range[1] >= 5]
    assert {"water", "pvc", "pmma", "aluminium", "gold", "copper-infrared", "iron-infrared",
            "graphite"} <= {m.name for m in known}  # fmt: skip


def test_formulas_follow_their_definition():
    law = Sellmeier((0.5,), (0.01,), (0.3, 2.0), constant=1.2)
    assert_allclose(law(0.5), np.sqrt(1.2 + 0.5 * 0.25 / (0.25 - 0.01)))
    law = Polynomial((2.0, 0.1, -0.02), (0, -2, 2), (0.3, 2.0))
    assert_allclose(law(0.5), np.sqrt(2.0 + 0.1 / 0.25 - 0.02 * 0.25))


def test_tabulated_material_needs_a_wavelength():
    with pytest.raises(
        ValueError, match=r"wavelength must be given for water.*0\.2 and 200 um"
    ):
        materials.get("water").index()
    with pytest.raises(ValueError, match="material must be one of aluminium, bk7, black"):
        materials.get("unobtainium")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "paint.csv: expected a table"),
        ("wavelength_um,kappa\n", "paint.csv: expected rows of numbers"),
        ("wavelength_um,n\n0.4,x\n", "line 2, column n: .* got 'x'"),
        (
            "# c\nwavelength_um,n,kappa\n0.4,1,0\n0.5,1,-1\n",
            "line 4, column kappa: .* '-1'",
        ),
        ("wavelength_um,n\n0.4,1\n0.4,2\n", "line 3, column wavelength_um: .*rising"),
        ("wavelength_um,n\n0.4,1\n0.5\n", "line 3, column n: .* got ''"),
        ("wavelength_um,n\n0.4,1\n", "one value per wavelength, at least 2"),
    ],
)
def test_bad_tables_name_line_and_column(tmp_path, text, message):
    path = tmp_path / "paint.csv"
    path.write_text(text)
    with pytest.raises(DataFileError, match=message):
        read_material(path)


def test_unreadable_table_is_refused(tmp_path):
    path = tmp_path / "paint.csv"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DataFileError, match="cannot be read as text"):
        read_material(path)


def test_material_refuses_what_it_cannot_mean():
    with pytest.raises(ValueError, match="kappa must be >= 0"):
        Material(1.5, -0.1)
    with pytest.raises(ValueError, match=r"n must be one number.*from_table"):
        Material([1.5, 1.6])
    with pytest.raises(ValueError, match=r"rise .* got 0.4 after 0.5"):
        Material.from_table(wavelength=[0.5, 0.4], n=[1.5, 1.6])
    with pytest.raises(ValueError, match="diffuse_albedo must lie in"):
        Material(1.5, diffuse_albedo=1.2)
