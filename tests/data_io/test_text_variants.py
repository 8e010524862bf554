"""Text as instruments write it: read right, or refused with what to do; never guessed."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from data_io import holds_profile, read_height_map, read_profile
from pbrdf.errors import DataFileError

# x in mm, z in um, with decimal commas
COMMAS = "0,000;1,50\n0,500;-2,25\n1,000;0,125\n"
X, Z = [0, 500, 1000], [1.5, -2.25, 0.125]
ROWS = [[1.5, 2.5, 3.5, 0.5], [1, np.nan, 3, 4], [0.25, 0.5, 0.75, 1]]


def write(folder, text, *, encoding="utf-8", name="scan.txt"):
    path = folder / name
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize(
    "text",
    [
        "x_mm;z_um\n" + COMMAS,
        "x [mm]\tz [µm]\n" + COMMAS.replace(";", "\t"),
        "x_mm z_um\n" + COMMAS.replace(";", " "),
        "x [mm];z [µm]\r\n" + COMMAS.replace("\n", "\r\n"),
        "Instrument 7, 2024-03-12\nx/mm;z/µm\n" + COMMAS,
        "X mm;Z µm\n" + COMMAS,
        "x;z\nmm;µm\n" + COMMAS,
        "X unit: mm\nZ unit: µm\nCut-off (mm): 0.8\nPosition;Height\n" + COMMAS,
        "x (millimeters); z (micrometers)\n" + COMMAS,
        '"x_mm","z_um"\n"0,0","1,5"\n"0,5","-2,25"\n"1,0","0,125"\n',
        "x_mm,z_um,\n0,1.5,\n.5,-2.25,\n1,.125,\n",
        "x_mm\tz_um\t\n0\t1.5\t\n.5\t\u22122.25\t\n1\t.125\t\n",
        "# x_mm, z_um\n3\n0,1.5\n.5,-2.25\n1,.125\n",
        "z;x\nµm;mm\n1,5;0,0\n-2,25;0,5\n0,125;1,0\n",
        "Point;X mm;Z µm\n1;0;1,5\n2;0,5;-2,25\n3;1;0,125\n",
    ],
)
def test_profiles_of_many_programs_are_the_same(tmp_path, text):
    path = write(tmp_path, text)
    profile = read_profile(path)
    assert_allclose(profile.x, X)
    assert_allclose(profile.z, Z)
    assert holds_profile(path)


@pytest.mark.parametrize(
    ("encoding", "micro"),
    [
        ("utf-8-sig", "µ"), ("utf-16", "µ"), ("utf-16-le", "µ"), ("utf-16-be", "μ"),
        ("latin-1", "µ"), ("cp1252", "µ"), ("cp850", "µ"), ("shift-jis", "μ"),
        ("gb2312", "μ"), ("utf-8", "Âµ"),
    ],
)  # fmt: skip
def test_units_survive_every_encoding(tmp_path, encoding, micro):
    quotes = "\u201eProfil\u201c \u2013 7\n" if encoding == "cp1252" else ""
    text = f"{quotes}x [mm];z [{micro}m]\n" + COMMAS
    profile = read_profile(write(tmp_path, text, encoding=encoding))
    assert_allclose(profile.x, X)
    assert_allclose(profile.z, Z)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x_um;z_um\n1,500;1,200\n2,500;2,500\n", "got '1,500' for either.*with a point"),
        ("x_um;z_um\n0;1,25\n2;2.5\n3;1.5\n", "got '1,25' for either.*with a point"),
        ("x_um;z_um\n1.000,5;1,2\n2.000,5;2,5\n", "without separators of thousands"),
        ("0,05\n1,02\n2,07\n", "'05' stands behind a decimal one.*semicolons"),
        ("x_um,z_um\n0,5,1,2\n1,5,2,5\n", "two columns, x and z, got 4.*not decimals"),
        ("x [mm]\tz\n0\t1\n1\t2\n", "line 1: expected a unit for both columns.* mm"),
        ("x [px]\tz [um]\n0\t1\n1\t2\n", r"line 1, column x \[px\]: .*'px'.*Convert"),
        ("Lengths (mm)\nHeights (nm)\n0\t1\n1\t2\n", "belong to columns, got mm, nm"),
        ("x_um;z_um\n0;1\n1;word\n2;3\n", "line 3, column z_um: .*got 'word'"),
    ],
)
def test_what_can_be_read_in_two_ways_is_refused(tmp_path, text, message):
    with pytest.raises(DataFileError, match=message):
        read_profile(write(tmp_path, text))


def matrix(mark="nan", delimiter="\t"):
    cells = [[mark if np.isnan(z) else f"{z:.2f}" for z in row] for row in ROWS]
    return "\n".join(delimiter.join(row) for row in cells) + "\n"


@pytest.mark.parametrize(
    "text",
    [
        matrix().replace(".", ","),
        matrix("***", ";").replace(".", ","),
        matrix("No Data"),
        matrix("BAD", " "),
        matrix("", ","),
        matrix("-1.#IND", ";"),
        '"Height"\n'
        + matrix(delimiter='","').replace("\n", '"\n"').join('"\n').rstrip('"'),
    ],
)
def test_maps_of_many_programs_are_the_same(tmp_path, text):
    path = write(tmp_path, text)
    assert_allclose(
        read_height_map(path, spacing=1.0, unit="um").heights, np.transpose(ROWS)
    )
    assert not holds_profile(path)


@pytest.mark.parametrize(
    "header",
    [
        "# Channel: H\n# Width: 2,0 µm\n# Height: 1500 nm\n# Value units: nm\n",
        "# Kanal: H\n# Breite: 2,0 µm\n# Höhe: 1,5 µm\n# Einheiten: nm\n",
    ],
)
def test_a_gwyddion_export_of_another_country(tmp_path, header):
    surface = read_height_map(write(tmp_path, header + matrix().replace(".", ",")))
    assert_allclose(surface.spacing, (0.5, 0.5))
    assert_allclose(surface.heights, np.transpose(ROWS) * 1e-3)


@pytest.mark.parametrize(
    "header",
    ["X mm;Y mm;Z µm\n", "X;Y;Z\nmm;mm;µm\n", "x/mm;y/mm;z/µm\n", "X (mm);Y (mm);Z (µm)\n"],
)
def test_lists_name_their_units_in_many_ways(tmp_path, header):
    rows = "0,0;0,0;1,5\n0,1;0,0;No Data\n0,0;0,1;1\n0,1;0,1;3\n"
    surface = read_height_map(write(tmp_path, f"{header}\n{rows}", name="map.xyz"))
    assert_allclose(surface.spacing, (100, 100))
    assert_allclose(surface.heights, [[1.5, 1], [np.nan, 3]])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,05,2,15\n1,00,2,00\n", "'05' stands behind a decimal one"),
        ("1,500\t2,500\n3,500\t4,500\n", "got '1,500' for either"),
        ("Zygo XYZ Data File - Format 1\n1 1 5\n#\n0 0 1\n", "counts pixels.*x3p"),
    ],
)
def test_a_map_that_can_be_read_in_two_ways_is_refused(tmp_path, text, message):
    with pytest.raises(DataFileError, match=message):
        read_height_map(write(tmp_path, text, name="map.xyz"), spacing=1.0)


@pytest.mark.parametrize(
    ("text", "cure"),
    [
        ("x_um,z_um\n0.5D+00,1.5D-01\n1.0D+00,1.6D-01\n", "with E instead of Fortran's D"),
        ("x_um,z_um\n0,1.5\n1,2.5\n2,0.5\nMean,1.5\n", "Delete the line if it belongs"),
        ("x (in),z (in)\n0,1.5\n1,2.5\n2,0.5\n", "written 'inch'"),
    ],
)
def test_refused_tables_say_what_to_change(tmp_path, text, cure):
    with pytest.raises(DataFileError, match=cure):
        read_profile(write(tmp_path, text))


def test_the_step_of_an_esri_grid_is_not_taken_without_a_unit(tmp_path):
    rows = "\n".join("0.1 0.2 0.3 0.4" for _ in range(4))
    path = write(tmp_path, f"ncols 4\nnrows 4\ncellsize 0.5\n{rows}\n", name="grid.asc")
    with pytest.raises(DataFileError, match=r"line 3: .* cellsize '0\.5'"):
        read_height_map(path)
    with pytest.warns(UserWarning, match="no length unit"):
        assert read_height_map(path, spacing=0.5).spacing == (0.5, 0.5)
