"""The project's goniometer CSV: round trips, and an answer to everything wrong in it."""

# One line a bad file: the table is read across
# ruff: noqa: E501

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from data_io import in_plane, read_goniometer, view_angle, write_goniometer
from pbrdf.errors import DataFileError

ELEMENTS = [f"M{i}{j}" for i in range(4) for j in range(4)]


def write(folder, text, name="run07.csv"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@st.composite
def datasets(draw):
    """Scans with any subset of quantities, gaps, and with or without wavelength."""
    count = draw(st.integers(1, 8))
    steps = st.integers(0, 359)
    geometry = draw(
        st.lists(
            st.tuples(st.integers(2, 89), st.integers(2, 90), steps),
            min_size=count,
            max_size=count,
            unique=True,
        )
    )
    names = draw(st.lists(st.sampled_from([*ELEMENTS, "DOLP"]), min_size=1, unique=True))
    theta_i, theta_s, dphi = np.radians(np.add(geometry, (0, 0, 0.37))).T
    coords = {
        "theta_i": ("geometry", theta_i),
        "theta_s": ("geometry", np.minimum(theta_s, np.pi / 2)),
        "dphi": ("geometry", dphi),
    }
    if draw(st.booleans()):
        coords["wavelength"] = ("geometry", draw(_columns(count, 0.2, 20.0)))
    m00 = draw(_columns(count, 0.5, 10.0))
    data = {}
    for name in names:
        values = {"M00": m00, "DOLP": draw(_columns(count, 0, 1))}.get(
            name, draw(_columns(count, -0.5, 0.5))
        )
        gaps = np.array(draw(st.lists(st.booleans(), min_size=count, max_size=count)))
        gaps[0] = False
        data[name] = ("geometry", np.where(gaps, np.nan, values))
        if draw(st.booleans()):
            data[f"{name}_stderr"] = ("geometry", draw(_columns(count, 0, 1)))
    if {"M00", "M10", "M20"} <= data.keys():
        data.pop("DOLP", None)
        data.pop("DOLP_stderr", None)
    return xr.Dataset(data, coords)


def _columns(count, low, high):
    number = st.floats(low, high, allow_subnormal=False)
    return st.lists(number, min_size=count, max_size=count).map(np.array)


@given(scan=datasets())
def test_round_trip(tmp_path_factory, scan):
    path = tmp_path_factory.mktemp("scan") / "scan.csv"
    write_goniometer(scan, path)
    again = read_goniometer(path)
    assert set(again.data_vars) == set(scan.data_vars)
    for name in scan.data_vars:
        assert_array_equal(again[name], scan[name])
    for name in scan.coords:
        assert_allclose(again[name], scan[name], rtol=4e-16)


def test_a_second_writing_is_the_same_file(tmp_path):
    text = "# sample 7\n# day 2\ntheta_i_deg,theta_view_deg,M00,M10_stderr,M10\n30,-10,0.02,,\n30,30,0.5,0.01,0.2\n"
    first, second = tmp_path / "1.csv", tmp_path / "2.csv"
    write_goniometer(read_goniometer(write(tmp_path, text)), first)
    write_goniometer(read_goniometer(first), second)
    assert first.read_text() == second.read_text()
    assert first.read_text().startswith("# sample 7\n# day 2\n")
    assert read_goniometer(first).attrs["title"] == "sample 7"


def test_the_signed_view_angle_names_the_side(tmp_path):
    text = "theta_i_deg,theta_view_deg,M00\n40,25,3\n40,-35,2\n40,0,1\n"
    scan = read_goniometer(write(tmp_path, text))
    assert_allclose(np.degrees(scan.theta_s), [25, 35, 0], atol=1e-12)
    assert_allclose(np.degrees(scan.dphi), [180, 0, 180], atol=1e-12)
    assert_allclose(np.degrees(view_angle(scan)), [25, -35, 0], atol=1e-12)
    assert_array_equal(in_plane(scan).M00, [2, 1, 3])


def test_out_of_plane_rows_have_no_view_angle(tmp_path):
    text = "theta_i_deg,theta_s_deg,dphi_deg,M00\n40,25,180,3\n40,35,90,2\n40,0,77,1\n40,9,-180,5\n"
    scan = read_goniometer(write(tmp_path, text))
    assert_array_equal(np.isnan(view_angle(scan)), [False, True, False, False])
    assert_array_equal(in_plane(scan).M00, [1, 5, 3])


def test_units_gaps_comments_and_order_of_columns(tmp_path):
    text = (
        '\ufeff# title\r\n# quantity: brdf\r\n"DOLP",wavelength_nm,dphi_deg,theta_s_deg,theta_i_deg,M31\r\n'
        ' "0.25" ,532,-90,20,30,\r\n\r\n# half time\r\n,532,270,21,30,-0.001\r\n'
    )
    scan = read_goniometer(write(tmp_path, text))
    assert_allclose(scan.wavelength, 0.532)
    assert_allclose(scan.dphi, np.radians(270))
    assert_array_equal(scan.DOLP, [0.25, np.nan])
    assert_array_equal(scan.M31, [np.nan, -0.001])
    assert scan.M31.attrs["units"] == "sr-1"
    assert scan.DOLP.attrs["units"] == "1"


def test_a_repeat_that_says_the_same_is_one_geometry(tmp_path):
    text = "theta_i_deg,theta_s_deg,dphi_deg,M00\n30,10,180,1\n30,10,-180,1\n30,11,180,2\n"
    assert_array_equal(read_goniometer(write(tmp_path, text)).M00, [1, 2])


VIEW = "theta_i_deg,theta_view_deg,M00"
FULL = "theta_i_deg,theta_s_deg,dphi_deg,M00"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        # The file
        (b"", r"run07\.csv: expected data, the file is empty"),
        (b"\x89PNG\r\n\x1a\n\x00", "expected a text file, found binary data"),
        ("# only\n# comments\n", "found comments only"),
        ("just a letter\n", "line 1: expected a goniometer file in a known format"),
        (f"{VIEW}\n", "line 1: expected rows below the header, found none"),
        # The header
        ("30,10,0.5\n", "line 1: expected a header line with column names, got '30'"),
        ("theta_i,theta_view_deg,M00\n30,10,1\n", "line 1: .*unit of the angles 'theta_i', found none. Did you mean theta_i_deg"),
        ("AOI,VZA,refl,M00\n30,10,1,1\n", "line 1: expected known columns, got 'VZA', 'refl'; expected the unit of the angles 'AOI'"),
        ("theta_i_deg,theta_s_deg,phi_s_deg,M00\n30,30,180,1\n", "column phi_s_deg: expected the azimuth of the source .*--azimuth-of-forward 0 or 180"),
        (f"{VIEW},m1o\n30,10,1,0\n", "expected known columns, got 'm1o'. Say what they hold by --columns"),
        (f"{VIEW},M00\n30,10,1,2\n", "line 1, column M00: expected one column of M00, found M00 too"),
        ("theta_view_deg,M00\n10,1\n", "column theta_i_deg: expected this column, found none"),
        ("theta_i_deg,M00\n10,1\n", "column theta_s_deg: expected this column"),
        ("theta_i_deg,theta_s_deg,M00\n30,10,1\n", "column dphi_deg: expected this column"),
        ("theta_i_deg,dphi_deg,M00\n30,10,1\n", "column theta_s_deg: expected this column"),
        ("theta_i_deg,theta_view_deg,theta_s_deg,M00\n30,10,10,1\n", "column dphi_deg"),
        ("theta_i_deg,theta_view_deg\n30,10\n", "column M00: expected this column"),
        (f"{VIEW},DOLP_stderr\n30,10,1,0.1\n", "column DOLP_stderr: expected a column DOLP beside it"),
        (f"{VIEW},wavelength_um,wavelength_nm\n30,10,1,0.5,500\n", "line 1, column wavelength_nm: expected one column of wavelength, found wavelength_um too"),
        # Cells
        (f"{VIEW}\n30,10,1\n30,20,1x\n", "line 3, column M00: expected a number, got '1x'. Leave gaps"),
        (f'{VIEW}\n30,10,1\n30,"20,1\n30,30,1\n', "line 3: expected 3 cells as in the header, got 2"),
        (f"{VIEW}\n30,10,1\n30,20\n", "line 3: expected 3 cells as in the header, got 2"),
        (f"{VIEW}\n30,10,1\n30,20,0,5\n", "line 3: expected 3 cells .*, got 4"),
        (f"{VIEW}\n30,10,1\n30,,2\n", "line 3, column theta_view_deg: expected a number in every row"),
        (f"{VIEW}\n30,nan,1\n", "line 2, column theta_view_deg: expected a number"),
        (f"{VIEW}\n30,10,1\n30,20,inf\n", "line 3, column M00: expected a finite number, got inf"),
        (f"{VIEW}\n30,10,\n30,20,nan\n", "expected measured values, every cell is empty"),
        # Angles
        (f"{VIEW}\n30,10,1\n95,20,1\n", r"line 3, column theta_i_deg: .*\[0, 90\] deg, got 95"),
        (f"{VIEW}\n-30,10,1\n", "column theta_i_deg: .*got -30.*positive"),
        (f"{VIEW}\n30,-91,1\n", "column theta_view_deg: .*got 91"),
        (f"{FULL}\n30,10,7200,1\n", "column dphi_deg: .*got 7200"),
        (f"{VIEW}\n30,-1.2,1\n30,0,1\n30,0.6,1\n", "line 2, column theta_view_deg: expected degrees.*radians"),
        (f"{VIEW}\n30,-20,1\n0.5236,20,1\n", "line 3, column theta_i_deg: expected degrees, got 0.5236, which looks like 30 degrees in radians"),
        (f"{VIEW},M10\n30,10,1,0.1\n30,20,1,-7\n30,30,2,0.2\n", "line 3, column M10: expected at most M00 = 1 in size, got -7, which no surface reflects"),
        (f"{VIEW},M11,M11_stderr\n30,10,2,0.9,0.01\n30,20,1,1.2,0.03\n30,30,1,0.2,0.01\n", "line 3, column M11: expected at most M00 = 1 in size, got 1.2"),
        (f"{VIEW}\n0.5236,0.3,1\n", "column theta_i_deg: expected degrees.*radians.*1.5708 rad are 90"),
        (f"{FULL}\n30,10,0,1\n30,10,3.14159,1\n", "line 3, column dphi_deg: expected degrees, got 3.14159"),
        (
            "theta_i_deg,theta_view_deg,theta_s_deg,dphi_deg,M00\n30,10,10,180,1\n30,10,10,0,2\n",
            "line 3, column theta_view_deg: expected the direction .*dphi_deg = 0, got 10",
        ),
        # Values
        (f"{VIEW}\n30,10,1\n30,20,-0.01\n", "line 3, column M00: expected a value >= 0, got -0.01"),
        (f"{VIEW},M00_stderr\n30,10,1,-1\n", "column M00_stderr: expected a value >= 0, got -1"),
        (f"{VIEW},DOLP\n30,10,1,25\n", "column DOLP: expected a fraction .*got 25. Divide per cent"),
        (
            f"{VIEW},M10\n30,10,0.01,0.3\n30,20,0.02,0.2\n",
            "line 2, column M10: expected an element in 1/sr, at most M00 = 0.01, got 0.3",
        ),
        (
            f"{VIEW},M10,M20,DOLP\n30,10,1,0.3,0.4,0.5\n30,20,2,0.6,0.8,0.3\n",
            r"line 3, column DOLP: expected sqrt.* = 0.5, got 0.3",
        ),
        (f"{VIEW},wavelength_um\n30,10,1,532\n", "column wavelength_um: .*got 532 um. Give micrometres"),
        (f"{VIEW}\n30,10,1\n30,20,2\n30,10,1.5\n", "line 4, column M00: expected one value a geometry, got 1.5, line 2 has 1"),
        (f"{FULL}\n30,10,-90,1\n30,10,270,2\n", "line 3, column M00: expected one value a geometry"),
    ],
)  # fmt: skip
def test_a_bad_file_names_line_column_value_and_cure(tmp_path, text, message):
    with pytest.raises(DataFileError, match=message) as caught:
        read_goniometer(write(tmp_path, text))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("cut", range(8, 150, 3))
def test_a_truncated_file_is_refused_or_shorter_by_whole_rows(tmp_path, cut):
    rows = "".join(f"30.5,{10 + i}.25,0.{5 + i}5,0.1{i}\n" for i in range(4))
    text = "theta_i_deg,theta_view_deg,M00,M10\n" + rows
    kept = text[:cut]
    try:
        scan = read_goniometer(write(tmp_path, kept))
    except DataFileError:
        return
    # What is left of the last number may pass for a number; nothing else may
    assert kept.count("\n") <= scan.sizes["geometry"] + 1


def test_azimuths_of_the_source_cones_and_ratios_make_the_round_trip(tmp_path):
    text = (
        "# quantity: relative\n"
        "theta_i_deg,phi_i_deg,theta_s_deg,dphi_deg,source_half_angle_deg,"
        "detector_half_angle_deg,M00,m10,m10_stderr,I_s\n"
        "30,0,20,180,0.5,1.25,3,0.25,0.01,2\n30,90,20,180,0.5,1.25,7,-0.5,0.02,4\n"
        "30,90,20,181.5,0.5,1.5,8,0.1,0.03,5\n"
    )
    scan = read_goniometer(write(tmp_path, text))
    assert scan.sizes == {"geometry": 3}
    assert_allclose(np.degrees(scan.phi_i), [0, 90, 90])
    assert_allclose(np.degrees(scan.detector_half_angle), [1.25, 1.25, 1.5])
    assert scan.attrs["quantity"] == "relative"
    assert scan.M00.attrs["units"] == scan.m10.attrs["units"] == "1"
    write_goniometer(scan, tmp_path / "again.csv")
    again = read_goniometer(tmp_path / "again.csv")
    xr.testing.assert_equal(again, scan)
    assert again.attrs["quantity"] == "relative"


def test_angles_are_written_as_they_were_set(tmp_path):
    degrees = np.concatenate([np.arange(0.0, 90.0, 0.5), [41.4, 17.0625]])
    rows = "".join(f"{angle},{angle / 2},{2 * angle},1\n" for angle in degrees)
    write_goniometer(
        read_goniometer(write(tmp_path, f"{FULL}\n{rows}")), tmp_path / "2.csv"
    )
    lines = (tmp_path / "2.csv").read_text().splitlines()
    assert lines[0].startswith("# Angles in degrees")
    body = [line for line in lines if not line.startswith("#")][1:]
    assert [line.split(",")[:3] for line in body] == [
        [repr(float(v)) for v in (angle, angle / 2, 2 * angle)] for angle in degrees
    ]


def test_readings_below_zero_within_their_noise_are_kept(tmp_path):
    text = (
        "theta_i_deg,theta_view_deg,M00,M00_stderr\n30,10,1,0.01\n30,60,-0.00019,0.0002\n"
    )
    assert float(read_goniometer(write(tmp_path, text)).M00[1]) == -0.00019
    with pytest.raises(DataFileError, match=r"got -0.00019.*give it as M00_stderr"):
        read_goniometer(write(tmp_path, text.replace("0.0002", "0.00003")))
    # Without stated errors the dark readings tell their noise
    dark = np.random.default_rng(5).normal(0.0, 0.01, 40)
    rows = "".join(
        f"30,{view},{value}\n" for view, value in zip(range(-60, -20), dark, strict=True)
    )
    scan = read_goniometer(write(tmp_path, f"{VIEW}\n{rows}30,30,1\n"))
    assert (scan.M00 < 0).sum() == (dark < 0).sum() > 10
    with pytest.raises(DataFileError, match=r"got -0\.1\."):
        read_goniometer(write(tmp_path, f"{VIEW}\n{rows}30,30,1\n30,31,-0.1\n"))


def test_small_angles_beside_large_ones_are_degrees(tmp_path):
    text = f"{VIEW}\n30,0.5,1\n30,1,1\n30,2,1\n"
    assert read_goniometer(write(tmp_path, text)).sizes == {"geometry": 3}
    text = f"{VIEW}\n1,20,1\n1,30,1\n"
    assert_allclose(np.degrees(read_goniometer(write(tmp_path, text)).theta_i), 1)


def test_noise_beyond_the_physical_limits_passes(tmp_path):
    text = f"{VIEW},M10,DOLP\n30,10,1,0.3,0.3\n30,80,1e-4,-2e-4,1\n30,20,1,0.2,0.2\n"
    assert read_goniometer(write(tmp_path, text)).sizes == {"geometry": 3}


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda ds: ds.drop_vars("theta_s"), "must have the coordinate theta_s along the dimension geometry"),
        (lambda ds: ds.rename(M00="I"), r"must have any of M00..M33, m01..m33, DOLP, .*got \['I'\]"),
        (lambda ds: ds.isel(geometry=[]), r"at least one geometry"),
    ],
)  # fmt: skip
def test_writing_refuses_what_is_no_scan(tmp_path, edit, message):
    scan = read_goniometer(write(tmp_path, f"{VIEW}\n30,10,1\n"))
    with pytest.raises(ValueError, match=message):
        write_goniometer(edit(scan), tmp_path / "out.csv")
    assert not (tmp_path / "out.csv").exists()


def test_a_failure_while_writing_leaves_the_old_file(tmp_path, monkeypatch):
    scan = read_goniometer(write(tmp_path, f"{VIEW}\n30,10,1\n"))
    out = write(tmp_path, "old", "out.csv")
    monkeypatch.setattr("builtins.repr", lambda x: 1 / 0, raising=True)
    with pytest.raises(ZeroDivisionError):
        write_goniometer(scan, out)
    monkeypatch.undo()
    assert out.read_text() == "old"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out.csv", "run07.csv"]
    with pytest.raises(ValueError, match="folder that exists"):
        write_goniometer(scan, tmp_path / "absent" / "out.csv")


def test_an_unknown_format_name_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"format must be one of zemax, fred.*got 'klems'"):
        read_goniometer(write(tmp_path, f"{VIEW}\n30,10,1\n"), format="klems")


@pytest.mark.parametrize(
    "rows",
    [
        # Noise in the dark of a bright scan, or within the stated errors
        "30,10,1,0.3,\n30,80,1e-4,-9e-4,\n",
        "30,10,2,0.3,0.1\n30,80,1,1.3,0.1\n30,82,1,-1,0\n",
        # Small incidences that one may set
        "1.0,10,2,0.3,\n1.0,80,1,0.1,\n",
        "0.5,10,1,0.3,\n",
    ],
)
def test_what_noise_or_choice_explains_is_read(tmp_path, rows):
    text = "theta_i_deg,theta_view_deg,M00,M10,M10_stderr\n" + rows
    scan = read_goniometer(write(tmp_path, text))
    assert scan.sizes["geometry"] == rows.count("\n")
