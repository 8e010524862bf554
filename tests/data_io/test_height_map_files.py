"""Height maps: orientation, units and missing points survive every format."""

import hashlib
import zipfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose, assert_array_equal

from data_io import MissingUnitWarning, read_height_map, read_profile
from pbrdf.cli import main
from pbrdf.errors import DataFileError

# Rows of constant y: 3 rows, 4 columns, no symmetry, one missing point
ROWS = np.array([[0.0, 1.0, 2.0, 3.5], [0.5, np.nan, -1.0, 4.0], [7.0, 0.25, 6.0, -2.0]])


def write(folder, content, name="map.csv"):
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def matrix_text(scale=1.0, delimiter=","):
    return "\n".join(delimiter.join(repr(float(z)) for z in row * scale) for row in ROWS)


def list_text(order=1):
    rows = [
        f"{0.5 * i},{0.2 * j + 3},{ROWS[j, i]}"
        for j in range(3)
        for i in range(4)
        if np.isfinite(ROWS[j, i])
    ]
    return "x_um,y_um,z_um\n" + "\n".join(rows[::order]) + "\n"


def x3p_bytes(*, namespace="", folder="", kind="D", mask=None, edit=None, scale=1e-6):
    """Write an x3p archive by the standard, independently of the reader."""
    dtype, increment = {"D": ("<f8", 1.0), "F": ("<f4", 1.0), "I": ("<i2", 0.25e-6)}[kind]
    heights = ROWS * scale / increment
    if kind == "I":
        heights = np.where(np.isnan(heights), 0, np.rint(heights))
    data = heights.astype(dtype).tobytes()
    md5 = hashlib.md5(data).hexdigest()
    link = (
        "<PointDataLink>bindata/data.bin</PointDataLink>"
        f"<MD5ChecksumPointData>{md5}</MD5ChecksumPointData>"
    )
    if mask is not None:
        link += "<ValidPointsLink>bindata/valid.bin</ValidPointsLink>"
    axes = "".join(
        f"<{axis}><AxisType>{t}</AxisType><DataType>{kind}</DataType>"
        f"<Increment>{step}</Increment><Offset>0</Offset></{axis}>"
        for axis, t, step in (
            ("CX", "I", 0.5e-6),
            ("CY", "I", 0.2e-6),
            ("CZ", "A", increment),
        )
    )
    prefix = "p:" if namespace else ""
    xml = (
        f'<?xml version="1.0"?><{prefix}ISO5436_2{namespace}><Record1><FeatureType>SUR'
        f"</FeatureType><Axes>{axes}</Axes></Record1><Record3><MatrixDimension><SizeX>4</SizeX>"
        f"<SizeY>3</SizeY><SizeZ>1</SizeZ></MatrixDimension><DataLink>{link}</DataLink></Record3>"
        f"</{prefix}ISO5436_2>"
    )
    return {
        "main.xml": (edit or str)(xml).encode(),
        "bindata/data.bin": data,
        **({"bindata/valid.bin": mask} if mask is not None else {}),
    }, folder


def write_x3p(path, **options):
    members, folder = x3p_bytes(**options)
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(folder + name, content)
    return path


@pytest.mark.parametrize(
    ("text", "options"),
    [
        (matrix_text(), {"spacing": (0.5, 0.2), "unit": "um"}),
        ("# dx_um = 0.5\n# dy_um = 0.2\n" + matrix_text(delimiter="\t"), {"unit": "um"}),
        ("# dx_nm: 500\n# dy_nm: 200\n# unit: nm\n" + matrix_text(1e3, " "), {}),
        (
            "# Channel: H\n# Width: 2 µm\n# Height: 600 nm\n# Value units: m\n"
            + matrix_text(1e-6),
            {},
        ),
        (matrix_text(1e3), {"spacing": (0.5, 0.2), "unit": "nm"}),
        (list_text(), {}),
        (list_text(-1), {}),
    ],
    ids=[
        "matrix",
        "header",
        "nm",
        "gwyddion text",
        "unit argument",
        "list",
        "reversed list",
    ],
)
def test_text_layouts_give_the_same_map(tmp_path, text, options):
    surface = read_height_map(write(tmp_path, text), **options)
    assert_allclose(surface.heights, ROWS.T, rtol=1e-12)
    assert_allclose(surface.spacing, (0.5, 0.2), rtol=1e-12)
    assert not surface.periodic


@pytest.mark.parametrize(
    ("text", "options"),
    [(list_text().partition("\n")[2], {}), (matrix_text(), {"spacing": (0.5, 0.2)})],
    ids=["list", "matrix"],
)
def test_a_map_without_unit_is_micrometres_and_says_so(tmp_path, text, options):
    path = write(tmp_path, text, "map.xyz")
    with pytest.warns(MissingUnitWarning, match=r"map\.xyz.*micrometres") as caught:
        assert_allclose(read_height_map(path, **options).heights, ROWS.T)
    assert caught[0].filename == __file__


@pytest.mark.filterwarnings("always::data_io.MissingUnitWarning")
@pytest.mark.parametrize(
    "words", [["statistics", "MAP"], ["pipeline", "MAP", "none.csv", "--n", "1.5"]]
)
def test_every_command_warns_of_a_matrix_without_unit(tmp_path, words, capsys):
    path = write(tmp_path, matrix_text())
    words = [str(path) if word == "MAP" else word for word in words]
    assert main([*words, "--spacing-um", "1"]) == 2
    said = capsys.readouterr().err
    assert "warning: map.csv: no length unit is named, micrometres are assumed" in said
    assert "(# unit = nm), or give --unit" in said


@pytest.mark.parametrize(
    "remark",
    [
        "# height in nm, step 1 um",
        "# z [nm], pixel size of 1 um",
        "# a steel, unit: nm; spacing 1.0 um",
        "# heights are given in nanometres (sampling interval 1 um)",
        "# Unit of height: nm, step = 1e3 nm",
        "# lateral unit: um, heights (nm), step 1 um",
        "# x, y in um and z in nm, pitch: 1 um",
        "# all values in nm; step 1 um",
    ],
)
def test_a_remark_tells_unit_and_step_of_a_matrix(tmp_path, remark):
    path = write(tmp_path, f"{remark}\n" + matrix_text(1e3))
    surface = read_height_map(path)
    assert_allclose(surface.heights, ROWS.T, rtol=1e-12)
    assert surface.spacing == (1.0, 1.0)
    assert_allclose(read_height_map(path, spacing=1.0, unit="nm").heights, ROWS.T)
    with pytest.raises(DataFileError, match="the unit that was given, um"):
        read_height_map(path, unit="um")
    with pytest.raises(DataFileError, match="names its own: 1 x 1 um"):
        read_height_map(path, spacing=0.5)


@pytest.mark.parametrize(
    "remark",
    ["Data: M 12, at 2 PM", "Data: m-type steel", "lateral unit: nm", "tip radius: 5 nm",
     "x, y in nm", "heights in a plane", "cut-off (mm): 0.8"],
)  # fmt: skip
def test_a_remark_of_something_else_is_no_unit_of_heights(tmp_path, remark):
    path = write(tmp_path, f"# {remark}\n{matrix_text()}")
    with pytest.warns(MissingUnitWarning):
        assert_allclose(read_height_map(path, spacing=(0.5, 0.2)).heights, ROWS.T)


@pytest.mark.parametrize(
    ("remarks", "message"),
    [
        ("# height in nm\n# z [um]\n", "one unit of z, the header names nm, um"),
        ("# unit: nm\n# height in um\n", "one unit of heights"),
        ("# step 1 um, step 2 um\n", "one step of the grid, the header names 1, 2 um"),
    ],
)
def test_remarks_that_contradict_each_other_are_refused(tmp_path, remarks, message):
    with pytest.raises(DataFileError, match=message):
        read_height_map(write(tmp_path, remarks + matrix_text()), unit="nm")


def test_a_unit_of_one_axis_is_not_taken_for_the_others(tmp_path):
    rows = list_text().partition("\n")[2]
    with pytest.raises(DataFileError, match="each of x, y, z, the header says z in nm"):
        read_height_map(write(tmp_path, "# height in nm\n" + rows, "map.xyz"))
    whole = write(tmp_path, "# x, y in um, height in nm\n" + rows, "map.xyz")
    assert_allclose(read_height_map(whole).heights, ROWS.T / 1e3)


@pytest.mark.filterwarnings("ignore::data_io.ScaleWarning", "ignore::data_io.MendWarning")
@given(
    rows=arrays(
        np.float32,
        st.tuples(st.integers(2, 9), st.integers(2, 9)),
        elements=st.floats(-100, 100, width=32) | st.just(np.float32("nan")),
    )
)
def test_npy_round_trip_is_exact(tmp_path_factory, rows):
    rows[0, 0] = 1.25
    path = tmp_path_factory.mktemp("npy") / "map.npy"
    np.save(path, rows)
    surface = read_height_map(path, spacing=0.2268, mend="none")
    assert_array_equal(surface.heights, rows.T.astype(float))
    assert surface.spacing == (0.2268, 0.2268)


@pytest.mark.parametrize("kind", ["D", "F", "I"])
@pytest.mark.parametrize(
    "namespace", ["", ' xmlns:p="http://www.opengps.eu/2008/ISO5436_2"']
)
@pytest.mark.parametrize("folder", ["", "scan-7/"])
def test_x3p_of_any_layout(tmp_path, kind, namespace, folder):
    # Bit n of the mask belongs to point n, lowest bit first
    valid = np.isfinite(ROWS).ravel()
    mask = np.packbits(valid, bitorder="little").tobytes() if kind == "I" else None
    path = write_x3p(
        tmp_path / "a.x3p", kind=kind, namespace=namespace, folder=folder, mask=mask
    )
    surface = read_height_map(path)
    assert_allclose(surface.heights, ROWS.T, rtol=1e-6)
    assert_allclose(surface.spacing, (0.5, 0.2), rtol=1e-12)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (
            lambda xml: xml.replace("<SizeX>4", "<SizeX>5"),
            "expected 15 heights of 8 bytes, got 96",
        ),
        (
            lambda xml: xml.replace("<SizeX>4", "<SizeX>four"),
            "SizeX: expected a number, got 'four'",
        ),
        (lambda xml: xml.replace("5e-07", "-5e-07"), "CX: expected a positive increment"),
        (
            lambda xml: xml.replace("data.bin", "gone.bin"),
            "expected bindata/gone.bin in the archive",
        ),
        (
            lambda xml: xml.replace("Checksum", "").replace("DataLink", "X"),
            "a DataLink or a DataList",
        ),
        (lambda xml: xml[:-20], "well-formed XML"),
        (lambda xml: xml.replace("<AxisType>I", "<AxisType>A"), "incremental axis"),
    ],
)
def test_a_damaged_x3p_names_the_element(tmp_path, edit, message):
    with pytest.raises(DataFileError, match=message):
        read_height_map(write_x3p(tmp_path / "a.x3p", edit=edit))


def test_x3p_checksums_are_checked(tmp_path):
    members, _ = x3p_bytes()
    with zipfile.ZipFile(tmp_path / "a.x3p", "w") as archive:
        archive.writestr("main.xml", members["main.xml"])
        archive.writestr("bindata/data.bin", members["bindata/data.bin"][::-1])
    with pytest.raises(DataFileError, match="content with MD5"):
        read_height_map(tmp_path / "a.x3p")


@pytest.mark.parametrize(
    ("name", "content", "options", "message"),
    [
        ("map.csv", b"", {"spacing": 1.0}, "the file is empty"),
        ("map.csv", "1,2\n3,4\n", {}, "expected a grid spacing.*spacing_um"),
        ("map.csv", "1,2\n3,x\n", {"spacing": 1.0}, "line 2, column 2: .*'x'"),
        ("map.csv", "1,2\n3\n", {"spacing": 1.0}, "line 2: expected 2 columns"),
        ("map.csv", "1,2,3\n", {"spacing": 1.0}, "at least 2 x 2"),
        (
            "map.csv",
            "nan,nan\nnan,nan\n",
            {"spacing": 1.0},
            "every point is marked missing",
        ),
        ("map.csv", "1,2\n3,4\n", {"spacing": -1.0}, "spacing must be positive"),
        (
            "map.csv",
            "# spacing_um=2\n1,2\n3,4\n",
            {"spacing": 1.0},
            "names its own: 2 x 2 um",
        ),
        ("map.csv", "# spacing_um=two\n1,2\n3,4\n", {}, "line 1, column spacing: .*'two'"),
        (
            "map.csv",
            "# unit: volt\n1,2\n3,4\n",
            {"spacing": 1.0},
            "length unit, got 'volt'",
        ),
        (
            "map.csv",
            list_text().replace("0.5,3.0", "0.7,3.0"),
            {},
            "column x: expected x on a regular",
        ),
        (
            "map.csv",
            list_text() + "0.5,3.0,9\n",
            {},
            "line 13: .*line 3 has the same x and y",
        ),
        ("map.npy", b"\x93NUMPY\x01\x00", {"spacing": 1.0}, "expected a .npy file"),
        ("map.npy", b"text", {"spacing": 1.0}, "does not start like one"),
        ("map.x3p", b"PK\x03\x04 truncated", {}, "expected an x3p"),
        ("map.x3p", b"PK\x03\x04", {"unit": "nm"}, "Leave the argument out"),
    ],
)
def test_a_bad_file_is_refused(tmp_path, name, content, options, message):
    with pytest.raises(DataFileError, match=message):
        read_height_map(write(tmp_path, content, name), **options)


@pytest.mark.parametrize(("name", "missing"), [("EC1_1", 13216), ("NiTE_on_Steel_1", 7352)])
# Digitised from pictures: tests of mending have its figures
@pytest.mark.filterwarnings("ignore::data_io.MendWarning")
def test_measured_interferometer_maps(shared, name, missing):
    path = shared / "data" / "topography" / f"{name}.npy"
    surface = read_height_map(path, spacing=0.2268, mend="none")
    assert surface.heights.shape == (732, 733)
    assert np.isnan(surface.heights).sum() == missing
    assert_allclose(surface.heights[100, 7], np.load(path)[7, 100])


def test_x3p_refused_by_other_readers(shared):
    path = shared / "data" / "topography" / "sample-land.x3p"
    surface = read_height_map(path)
    with zipfile.ZipFile(path) as archive:
        raw = np.frombuffer(archive.read("sample-land/bindata/data.bin"), "<f8")
    assert surface.shape == (918, 256)
    assert_allclose(surface.spacing, (2.58, 2.58), rtol=1e-12)
    assert_allclose(surface.heights, raw.reshape(256, 918).T * 1e6, rtol=1e-12)
    with pytest.raises(DataFileError, match=r"a map of 256 lines.*read_height_map"):
        read_profile(path)
