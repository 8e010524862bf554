"""Profiles: what is read, in which unit, and what a bad file is answered."""

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose, assert_array_equal

from data_io import (
    MendWarning,
    MissingUnitWarning,
    Profile,
    ScaleWarning,
    read_profile,
    write_profile,
)
from pbrdf.errors import DataFileError

FINITE = st.floats(-1e6, 1e6, allow_subnormal=False)


def write(folder, text, name="edge.csv"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("x_um,z_um\n0,1.5\n1,-2\n3,0.25\n", None),
        ("# scan 7\n# x_nm, z_nm (raw)\n0,1500\n1000,-2000\n3000,250\n", None),
        ("x [mm]\tz [nm]\r\n0\t1500\r\n0.001\t-2000\r\n0.003\t250\r\n", None),
        ("x_mm;z_µm\n0;1.5\n0.001;-2\n0.003;0.25\n", None),
        ("z_um,x_um\n1.5,0\n-2,1\n0.25,3\n", None),
        ("x_um,quality,z_um\n0,9,1.5\n1,9,-2\n3,9,0.25\n", None),
        ("  0  1.5\n  1 -2.0\n\n  3  0.25\n", "um"),
        ("0\t1500\n0.001\t-2000\n0.003\t250\n", ("mm", "nm")),
        ("x_um,z_um\n3,0.25\n1,-2\n0,1.5\n", None),
        ("x_nm,z_um\n0,1.5\n# dust here\n\n1000,-2\n3000,0.25\n# end [mm]\n", None),
    ],
    ids=[
        "own",
        "comments",
        "brackets",
        "semicolon",
        "swapped",
        "extra",
        "spaces",
        "two units",
        "right to left",
        "comments among rows",
    ],
)
def test_layouts_and_units_give_the_same_profile(tmp_path, text, unit):
    profile = read_profile(write(tmp_path, text), unit=unit)
    assert_allclose(profile.x, [0, 1, 3], rtol=1e-14)
    assert_allclose(profile.z, [1.5, -2, 0.25], rtol=1e-14)
    assert not profile.evenly_spaced


@given(
    steps=arrays(float, st.integers(3, 40), elements=st.floats(1e-3, 1e3)),
    data=st.data(),
)
def test_round_trip_is_exact(tmp_path_factory, steps, data):
    x = np.cumsum(steps)
    z = data.draw(arrays(float, x.size, elements=FINITE))
    path = tmp_path_factory.mktemp("profile") / "p.csv"
    write_profile(Profile(x, z), path)
    # Such numbers can be slopes of no surface, or numbers far from the rest
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ScaleWarning)
        warnings.simplefilter("ignore", MendWarning)
        profile = read_profile(path, mend="none")
    assert_array_equal(profile.x, x)
    assert_array_equal(profile.z, z)


def test_uneven_positions_with_digits_to_spare_are_no_rounded_grid(tmp_path):
    x = 2.0 * np.arange(10) - (np.arange(10) > 1)
    rows = [f"{a:.1f},{i % 3}" for i, a in enumerate(x)]
    path = write(tmp_path, "x_um,z_um\n" + "\n".join(rows))
    assert_array_equal(read_profile(path).x, x)
    # Printed without decimals the same may be steps of 1.9
    path = write(tmp_path, "x_um,z_um\n" + "\n".join(rows).replace(".0,", ","))
    assert read_profile(path).evenly_spaced


def test_a_file_without_unit_is_micrometres_and_says_so(tmp_path):
    path = write(tmp_path, "0 1\n1 2\n2 0\n")
    with pytest.warns(MissingUnitWarning, match=r"edge\.csv.*micrometres.*unit=") as caught:
        assert read_profile(path).length == 2
    assert caught[0].filename == __file__


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", "the file is empty"),
        (b"\n \n", "the file is empty"),
        (b"\x89PNG\r\n\x1a\n\x00\x00\x01", "found binary data"),
        ("just words\n", "found none"),
        (
            "x_um,z_um\n0,1\n1,1x\n2,0\n",
            "line 3, column z_um: expected a finite number.*'1x'",
        ),
        ("x_um,z_um\n0,1\nnan,2\n2,0\n", "line 3, column x: expected a number, got nan"),
        ("x_um,z_um\n0,1\n1,inf\n2,0\n", "expected at least 3 points, got 2"),
        ("x_um,z_um\n0,1\n1,2\n2\n", "line 4: expected 2 columns as in line 2, got 1"),
        ("x_um,z_um\n0,1\n1,2\n1,3\n", "line 4, column x: expected x to go one way"),
        ("x_um,z_um\n0,1\n2,2\n1,3\n4,4\n", "line 4, column x"),
        ("x_um,z_um\n0,1\n", "expected at least 3 points, got 1"),
        (
            "x_um,z_um,x_nm\n0,1,0\n1,2,3\n2,3,4\n",
            "column x: expected one column x, found 2",
        ),
        ("0,1,5\n1,2,5\n2,3,5\n", "line 1: expected two columns, x and z, got 3"),
        ("x_um,z_um\n0|1\n1|2\n2|3\n", "found none|expected"),
    ],
)
def test_a_bad_file_is_refused_by_place_and_value(tmp_path, text, message):
    with pytest.raises(DataFileError, match=message):
        read_profile(write(tmp_path, text))


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(DataFileError, match="none of that name"):
        read_profile(tmp_path / "absent.csv")


def test_a_unit_that_contradicts_the_header_is_refused(tmp_path):
    path = write(tmp_path, "x_um,z_um\n0,1\n1,2\n2,0\n")
    assert read_profile(path, unit="um").size == 3
    with pytest.raises(DataFileError, match="line 1: expected the unit given, nm"):
        read_profile(path, unit="nm")
    with pytest.raises(
        ValueError, match="unit must be one of nm, um, mm, m, got 'furlong'"
    ):
        read_profile(path, unit="furlong")


@pytest.mark.parametrize(
    ("x", "z", "message"),
    [
        ([0, 1, 1], [0, 0, 0], r"x must rise strictly \[um\], got 1 after 1 at index 2"),
        ([0, 1], [0, 0], "at least 3 points, got 2"),
        ([0, 1, 2], [0, 0], "of one length"),
        ([0, 1, 2], [0, np.nan, 0], "z must be finite .* at index 1"),
    ],
)
def test_profile_refuses_what_is_none(x, z, message):
    with pytest.raises(ValueError, match=message):
        Profile(x, z)


def test_profile_neither_keeps_nor_gives_away_the_callers_array():
    x, z = np.arange(4.0), np.ones(4)
    profile = Profile(x, z)
    z[0] = 7
    assert profile.z[0] == 1
    with pytest.raises(ValueError, match="read-only"):
        profile.z[0] = 3


@pytest.mark.parametrize(
    ("name", "unit", "points", "length"),
    [
        ("uncd_tem_side_profile.asc", "nm", 76, 0.2289070382),
        ("uncd_stylus.txt", "mm", 3001, 298.684),
        ("Luftpresser_1_56_ak.csv", None, 8001, 4000.0),
    ],
)
def test_measured_profiles(shared, name, unit, points, length):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        profile = read_profile(shared / "data" / "topography" / name, unit=unit)
    assert profile.size == points
    assert_allclose(profile.length, length, rtol=1e-12)
    assert profile.evenly_spaced == (points != 76)


def test_a_remark_is_no_pair_of_names_and_one_unit_not_both(tmp_path):
    path = tmp_path / "edge.csv"
    path.write_text("# height in nm, step 1 um\n0,10\n1,40\n2,20\n")
    with pytest.raises(DataFileError, match="unit for both columns, the header names nm"):
        read_profile(path)
    assert_allclose(read_profile(path, unit=("um", "nm")).z, [0.01, 0.04, 0.02])
    with pytest.raises(DataFileError, match="expected the unit given, um"):
        read_profile(path, unit="um")
    path.write_text("# x in um, height in nm, step 1 um\n0,10\n1,40\n2,20\n")
    found = read_profile(path)
    assert_allclose(found.x, [0, 1, 2])
    assert_allclose(found.z, [0.01, 0.04, 0.02])
    path.write_text("# heights in nm, step 2 um\n10\n40\n20\n")
    assert_allclose(read_profile(path).x, [0, 2, 4])
    assert_allclose(read_profile(path).z, [0.01, 0.04, 0.02])
