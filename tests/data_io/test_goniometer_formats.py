"""Foreign goniometer files: small hand-made ones for each convention, and the measured ones.

The conventions are not only restated here but checked against physics: two files of one
sample agree, and the Mueller table obeys reciprocity and mirror symmetry as converted.
"""

# One line a bad file: the table is read across
# ruff: noqa: E501

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from data_io import ConventionWarning, in_plane, read_goniometer
from data_io.goniometer.scatter import standard_errors
from fitting import check_scan
from pbrdf.errors import DataFileError

FRED = """type bsdf_data
format angles=deg bsdf=value scale=2
30 0
10 0 0.25
10 90 0.20
20 180 0.15
50 40
10 40 0.5
"""

ZEMAX = """# Sample: black
# Light source: red laser (650 nm, 3 mm spot)
Source\tMeasured
Symmetry\tPlaneSymmetrical
SpectralContent\tMonochrome
ScatterType\tBRDF
SampleRotation\t1
0
AngleOfIncidence\t2
20\t60
ScatterAzimuth\t3
0\t90\t180
ScatterRadial\t3
0\t25\t40

Monochrome
DataBegin
TIS\t6.17
9\t8\t7
9\t6\t0
9\t5\t4
TIS\t1.37
3\t2.5\t2
3\t2.25\t1
3\t3.5\t0
DataEnd
"""

SPACECRAFT = """# BRDF of a chassis
# at a wavelength lambda = 532 nm
# phi_i     theta_i     phi_o     theta_o     brdf
40.00  -180.00  -20.00  0.00  1.0e-04
40.00  -180.00  -10.00  0.00  3.0e-02
40.00  -180.00   40.00  0.00  5.0e+02
40.00  -180.00   80.00  0.00  1.0e-04
40.00  -180.00   85.00  0.00  1.0e-04
"""

NIST_HEADER = "lambda,thetai,phi,thetar,phir,f_r11," + ",".join(
    f"f_r{i}{j}/f_r11" for i in range(1, 5) for j in range(1, 5) if (i, j) != (1, 1)
)
NIST_ELEMENTS = [0.12, -0.13, 0.14, 0.21, 0.22, -0.23, 0.24, 0.31, -0.32, 0.33, 0.34, 0.41,
                 0.42, 0.43, -0.44]  # fmt: skip


def nist_text(*rows):
    elements = ",".join(map(str, NIST_ELEMENTS))
    return "\n".join([NIST_HEADER, *(f"{row},0.5,{elements}" for row in rows)]) + "\n"


def write(folder, text, name="scan.txt"):
    path = folder / name
    path.write_text(text)
    return path


def degrees(scan, name):
    return np.degrees(scan[name].to_numpy())


def test_fred_angles_are_absolute_and_zero_azimuth_is_forward(tmp_path):
    scan = read_goniometer(write(tmp_path, FRED))
    assert scan.attrs["format"] == "fred"
    assert_allclose(degrees(scan, "theta_i"), [30, 30, 30, 50])
    assert_allclose(degrees(scan, "theta_s"), [10, 10, 20, 10])
    assert_allclose(degrees(scan, "dphi"), [180, 270, 0, 180], atol=1e-12)
    assert_allclose(scan.M00, [0.5, 0.4, 0.3, 1.0])


def test_fred_sources_at_several_azimuths_stay_apart(tmp_path):
    text = FRED.replace("50 40", "30 90").replace("10 40 0.5", "10 90 0.5")
    scan = read_goniometer(write(tmp_path, text))
    assert_allclose(degrees(scan, "phi_i"), [0, 0, 0, 90])
    assert_allclose(degrees(scan, "dphi"), [180, 270, 0, 180], atol=1e-12)
    assert_allclose(scan.M00, [0.5, 0.4, 0.3, 1.0])


def test_fred_row_without_its_value_is_not_taken_for_a_source_in_silence(tmp_path):
    rows = [f"{theta} {phi} 0.1" for phi in (180, 0) for theta in range(0, 60, 10)]
    head = "type bsdf_data\nformat angles=deg bsdf=value\n30 0\n"
    broken = [*rows[:8], "20 0", *rows[9:]]
    path = tmp_path / "broken.txt"
    path.write_text(head + "\n".join(broken))
    with pytest.warns(ConventionWarning, match=r"broken.txt line 12: .* lost its value"):
        read_goniometer(path)
    path.write_text(head + "\n".join([*rows, "50 0", *rows[:5]]))
    assert read_goniometer(path).sizes["geometry"] == 17


def test_fred_in_radians(tmp_path):
    text = "type bsdf_data\nformat angles=rad bsdf=value\n0.5 0\n0.2 0 0.25\n0.3 3.14159265 1\n"
    scan = read_goniometer(write(tmp_path, text))
    assert_allclose(scan.theta_s, [0.2, 0.3])
    assert_allclose(np.cos(scan.dphi), [-1, 1], atol=1e-12)


def test_zemax_angles_turn_about_the_specular_ray(tmp_path):
    scan = read_goniometer(write(tmp_path, ZEMAX))
    assert scan.attrs["format"] == "zemax"
    assert scan.attrs["title"] == "Sample: black"
    assert_allclose(scan.wavelength, 0.65)
    plane = in_plane(scan)
    view = np.degrees(plane.theta_view.to_numpy())
    steep = np.isclose(plane.theta_i, np.radians(20))
    # 20 + 40 and 20 + 25 away from the normal; 20 - 25, 20 - 40 across it
    assert_allclose(view[steep], [-20, -5, 20, 45, 60], atol=1e-9)
    assert_array_equal(plane.M00[steep], [7, 8, 9, 5, 4])
    # 60 + 40 lies below the horizon
    assert_allclose(view[~steep], [20, 35, 60, 85], atol=1e-9)
    assert_array_equal(plane.M00[~steep], [2, 2.5, 3, 3.5])
    assert scan.attrs["below_horizon"] == 1
    assert scan.attrs["not_measured"] == int(np.isnan(scan.M00).sum()) == 1


def test_zemax_rotations_of_the_sample_stay_apart(tmp_path):
    turned = ZEMAX.replace("Rotation\t1\n0", "Rotation\t2\n0\t90")
    begin, end = turned.index("TIS\t6.17"), turned.index("DataEnd")
    brighter = turned[begin:end].replace("\t8\t", "\t8.5\t")
    scan = read_goniometer(write(tmp_path, turned[:end] + brighter + turned[end:]))
    one = read_goniometer(write(tmp_path, ZEMAX))
    assert "phi_i" not in one.coords
    assert scan.sizes["geometry"] == 2 * one.sizes["geometry"]
    assert_array_equal(np.unique(degrees(scan, "phi_i")), [0, 90])
    lobe = np.isclose(scan.theta_s, np.radians(5)) & np.isclose(
        scan.theta_i, np.radians(20)
    )
    assert_array_equal(scan.M00[lobe], [8, 8.5])


def test_zemax_total_scatter_is_compared_with_the_table(tmp_path):
    # A Lambertian table of albedo 0.6 on a fine grid integrates to it, whatever the incidence
    radial = np.linspace(0.0, 170.0, 171)
    azimuth = np.linspace(0.0, 180.0, 91)
    head, _, tail = ZEMAX.partition("AngleOfIncidence")
    assert tail
    rows = "\n".join(" ".join(["0.190985931710274"] * radial.size) for _ in azimuth)
    text = (
        f"{head}AngleOfIncidence 1\n40\nScatterAzimuth 91\n{' '.join(map(str, azimuth))}\n"
        f"ScatterRadial 171\n{' '.join(map(str, radial))}\n\nMonochrome\nDataBegin\n"
        f"TIS 0.6\n{rows}\nDataEnd\n"
    )
    scan = read_goniometer(write(tmp_path, text))
    assert scan.attrs["tis"] == [0.6]
    assert_allclose(scan.attrs["tis_of_table"], [0.6], rtol=1e-3)
    with pytest.warns(ConventionWarning, match=r"3\.14 times the TIS stated .* at 40 deg"):
        read_goniometer(write(tmp_path, text.replace("0.190985931710274", "0.6")))


def test_zemax_sideways_directions_keep_their_distance_from_the_specular_ray(tmp_path):
    scan = read_goniometer(write(tmp_path, ZEMAX))
    scan = scan.isel(geometry=np.flatnonzero(scan.M00.to_numpy() == 2.25))
    theta_i, theta_s, dphi = (
        float(scan[name][0]) for name in ("theta_i", "theta_s", "dphi")
    )
    specular = np.array([np.sin(theta_i), 0, np.cos(theta_i)])
    phi = dphi - np.pi
    seen = np.array(
        [np.sin(theta_s) * np.cos(phi), np.sin(theta_s) * np.sin(phi), np.cos(theta_s)]
    )
    assert_allclose(np.degrees(np.arccos(seen @ specular)), 25)
    # Azimuth 90: perpendicular to the arc from the specular ray to the normal
    assert_allclose(
        (seen - specular * (seen @ specular)) @ np.array([0, 0, 1]), 0, atol=1e-12
    )


def test_spacecraft_phi_is_the_signed_zenith(tmp_path):
    scan = read_goniometer(write(tmp_path, SPACECRAFT))
    assert scan.attrs["format"] == "spacecraft"
    assert_allclose(scan.wavelength, 0.532)
    assert_allclose(degrees(in_plane(scan), "theta_view"), [-20, -10, 40, 80, 85])
    assert_array_equal(in_plane(scan).M00, [np.nan, 0.03, 500, np.nan, np.nan])
    assert scan.attrs["floor"] == 1e-4


def test_nist_in_plane_rows(tmp_path):
    """Forward, source side: no rotation, f11 multiplied in, elements with one V change sign."""
    scan = read_goniometer(
        write(tmp_path, nist_text("0.351,-45,0,30,0", "0.351,-45,0,20,180"))
    )
    assert_allclose(degrees(scan, "theta_i"), 45)
    assert_allclose(degrees(scan, "dphi"), [180, 0], atol=1e-9)
    assert_allclose(scan.wavelength, 0.351)
    assert_allclose(scan.M00, 0.5)
    for row in range(2):
        found = [[float(scan[f"M{i}{j}"][row]) for j in range(4)] for i in range(4)]
        expected = 0.5 * np.array([1, *NIST_ELEMENTS]).reshape(4, 4)
        expected[:3, 3] *= -1
        expected[3, :3] *= -1
        assert_allclose(found, expected, atol=1e-15)


def test_nist_scattered_frame_turns_into_the_meridian_plane(tmp_path):
    """At phir = 45 degrees the file's +45 polarisation is the meridian frame's Q."""
    scan = read_goniometer(write(tmp_path, nist_text("0.351,-45,0,30,45")))
    raw = 0.5 * np.array([1, *NIST_ELEMENTS]).reshape(4, 4)
    assert_allclose(degrees(scan, "dphi"), 225)
    assert_allclose(scan.M10, raw[2, 0])
    assert_allclose(scan.M20, -raw[1, 0])
    assert_allclose(scan.M12, raw[2, 2])
    assert_allclose(scan.M01, raw[0, 1])
    assert_allclose(scan.M33, raw[3, 3])
    assert_allclose(scan.M13, -raw[2, 3])


def test_nist_placeholders_are_zero(tmp_path):
    scan = read_goniometer(write(tmp_path, nist_text("0.351,-0.001,0,0.001,3.2e-14")))
    assert float(scan.theta_i[0]) == float(scan.theta_s[0]) == 0
    assert_allclose(scan.dphi, np.pi)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (FRED.replace("0.20", "x"), r"scan.txt line 5, column brdf: expected a finite number, got 'x'"),
        (FRED.replace("0.20", "-0.20"), "line 5, column brdf: expected a value >= 0, got -0.4"),
        (FRED.replace("0.20", "nan"), "line 5, column brdf: .*'nan'"),
        (FRED.replace("10 90 0.20", "10 90 0.20 1"), "line 5: expected .*, got 4 cells"),
        (FRED.replace("20 180", "120 180"), r"line 6, column theta_s: .*got 120"),
        (FRED.replace("30 0\n", ""), "line 3: expected a line 'theta_i phi_i' before the first row"),
        (FRED.replace("angles=deg", "angles=gon"), "line 2, column angles: expected deg or rad, got 'gon'"),
        (FRED.replace("bsdf=value", "bsdf=log"), "column bsdf: expected value, got 'log'"),
        (FRED.replace("scale=2", "scale=0"), "column scale: expected a positive number, got '0'"),
        (FRED.replace("10 90 0.20", "10 0 0.20"), "line 5, column brdf: expected one value a geometry.*line 4 has 0.5"),
        ("type bsdf_data\nformat angles=deg bsdf=value scale=1\n30 0\n", "found none. The file is truncated"),
        (ZEMAX.replace("9\t6\t0", "9\t6"), "line 20: expected 3 values, one a ScatterRadial, got 2"),
        (ZEMAX.replace("9\t6\t0\n", ""), "expected 1 x 2 x 3 rows, rotation x incidence x azimuth, got 5"),
        (ZEMAX.replace("9\t6\t0", "9.5\t6\t0"), "line 20, column BRDF: expected one value a geometry"),
        (ZEMAX.replace("9\t6\t0", "9\t6\t-1"), "line 20, column BRDF: expected a value >= 0"),
        (ZEMAX.replace("DataEnd\n", ""), "expected a line DataEnd"),
        ("DataBegin\nDataEnd\nScatterRadial 1\n", "column AngleOfIncidence: expected this axis"),
        ("NUM_POINTS 0\nVARS\n", "expected names of columns and rows of numbers, found none"),
        (ZEMAX.replace("\tBRDF", "\tBTDF"), "line 6, column ScatterType: expected BRDF, got 'BTDF'"),
        (ZEMAX.replace("Radial\t3", "Radial\t4"), "column ScatterRadial: expected 4 values as announced, got 3"),
        (ZEMAX.replace("Rotation\t1\n0", "Rotation\t2\n0\t90"), "expected 2 x 2 x 3 rows, rotation"),
        (ZEMAX.replace("TIS\t6.17", "TIS x"), "line 18, column TIS: expected a finite number, got 'x'"),
        (SPACECRAFT.replace("3.0e-02", "n/a"), "line 5, column brdf: .*'n/a'"),
        (SPACECRAFT.replace("3.0e-02", "nan"), "line 5, column brdf: expected a number, got nan"),
        (SPACECRAFT.replace("0.00  3.0e-02", ""), "line 5: expected 5 columns as in line 4, got 3"),
        (SPACECRAFT.replace("-10.00", "-110.00"), "line 5, column phi_o: .*got 110"),
        (nist_text("0.351,-45,0,30,45").replace("f_r13/f_r11", "f_r14/f_r11"), "line 1, column f_r13: expected this as column 8"),
        (nist_text("0.351,-45,0,30,45").replace("0.42", "x"), "line 2, column f_r42/f_r11: .*'x'"),
        (nist_text("0.351,-45,0,30,45", "0.351,-45,0,30").replace("30,0.5", "30,0.5,"), "line 3"),
        (nist_text("351,-45,0,30,45"), "column lambda: .*got 351 um"),
        (nist_text("0.351,-95,0,30,45"), "line 2, column thetai: .*got 95"),
        (NIST_HEADER + "\n", "found none"),
    ],
)  # fmt: skip
def test_a_bad_file_names_line_column_and_value(tmp_path, text, message):
    with pytest.raises(DataFileError, match=message):
        read_goniometer(write(tmp_path, text))


def test_a_forced_format_is_obeyed(tmp_path):
    with pytest.raises(DataFileError, match="expected known columns"):
        read_goniometer(write(tmp_path, nist_text("0.351,-45,0,30,45")), format="csv")


# Measured files


@pytest.fixture(scope="module")
def goniometer(shared):
    return shared / "data" / "goniometer"


@pytest.fixture(scope="module")
def ptfe(goniometer):
    return read_goniometer(goniometer / "nist_ptfe_mueller.csv")


@pytest.mark.parametrize("sample", ["AnoBlackEC1onAlum", "AnoBlackNiTEonSteel"])
def test_two_files_of_one_sample_agree_where_both_measured(goniometer, sample):
    """Absolute and specular-relative angles describe one measurement.

    The .bsdf is interpolated from the raw scan, so a single value at a steep flank may be
    a quarter off; a wrong reading of the angles moves every value.
    """
    plane = {}
    for suffix in ("txt", "bsdf"):
        scan = in_plane(read_goniometer(goniometer / f"ualoft_{sample}.{suffix}"))
        keys = zip(
            *(degrees(scan, n).round(3) for n in ("theta_i", "theta_view")), strict=True
        )
        plane[suffix] = dict(zip(keys, scan.M00.to_numpy(), strict=True))
    both = [k for k in plane["bsdf"] if k in plane["txt"] and np.isfinite(plane["bsdf"][k])]
    ratio = np.array([plane["bsdf"][k] / plane["txt"][k] for k in both])
    assert len(both) == 64
    assert min(k[1] for k in both) < -40
    assert max(k[1] for k in both) == 80
    assert abs(np.median(ratio) - 1) < 0.01
    assert np.median(np.abs(ratio - 1)) < 0.03
    assert np.abs(np.log(ratio)).max() < 0.25


def test_spacecraft_lobe_lies_forward(goniometer):
    scan = in_plane(read_goniometer(goniometer / "spacecraft_chassis_brdf.csv"))
    for theta_i in np.unique(scan.theta_i):
        one = scan.isel(geometry=np.flatnonzero(scan.theta_i == theta_i))
        peak = float(one.theta_view[int(np.nanargmax(one.M00))])
        assert_allclose(peak, theta_i, atol=np.radians(1))
    assert int(np.isnan(scan.M00).sum()) == scan.attrs["not_measured"] == 15


def test_derived_in_plane_file_agrees_with_the_mueller_table(goniometer, ptfe):
    table = in_plane(ptfe)
    plane = in_plane(read_goniometer(goniometer / "nist_ptfe_inplane.csv"))
    assert plane.sizes == table.sizes == {"geometry": 432}
    for name in ("theta_i", "theta_view", "wavelength"):
        # The derived file prints three decimals, degrees or um
        assert_allclose(plane[name], table[name], atol=np.radians(0.0011))
    for name in ("M00", "M01", "M10", "M20", "M11", "M22", "M33"):
        assert_allclose(plane[name], table[name], atol=1e-6)
    assert_allclose(np.hypot(table.M10, table.M20) / table.M00, plane.DOLP, atol=1e-6)
    # That file kept the table's sense of V, positive for left-circular
    assert_allclose(plane.M30, -table.M30, atol=1e-6)


def test_table_is_read_row_by_row(goniometer, ptfe):
    raw = pd.read_csv(goniometer / "nist_ptfe_mueller.csv")
    assert len(raw) == ptfe.sizes["geometry"]
    assert_allclose(ptfe.M00, raw["f_r11"])
    assert_allclose(ptfe.M33, raw["f_r44/f_r11"] * raw["f_r11"])
    # The intensity of any incident state does not depend on the frame of the scattered beam
    assert_allclose(ptfe.M02, raw["f_r13/f_r11"] * raw["f_r11"])
    # Nor does the length of (Q, U)
    assert_allclose(
        np.hypot(ptfe.M10, ptfe.M20),
        np.hypot(raw["f_r21/f_r11"], raw["f_r31/f_r11"]) * raw["f_r11"],
    )


def mueller(scan):
    return np.stack([scan[f"M{i}{j}"] for i in range(4) for j in range(4)], -1).reshape(
        -1, 4, 4
    )


def dipole(theta_i, theta_s, dphi):
    """Mueller matrix of a small sphere: the field driven across the line of sight is lost.

    From the definitions of the frames alone, e_s = z x k and e_p = k x e_s.
    """

    def frame(k):
        e_s = np.cross([0.0, 0.0, 1.0], k)
        e_s /= np.linalg.norm(e_s)
        return e_s, np.cross(k, e_s)

    k_i = -np.array([np.sin(theta_i), 0, np.cos(theta_i)])
    k_s = np.array(
        [np.sin(theta_s) * np.cos(dphi), np.sin(theta_s) * np.sin(dphi), np.cos(theta_s)]
    )
    jones = np.array([[e_out @ e_in for e_in in frame(k_i)] for e_out in frame(k_s)])
    # Columns: <E E*> of I, Q, U; V is left out, it only decays
    stokes = []
    for field in (np.eye(2) / 2, np.diag([0.5, -0.5]), np.array([[0, 0.5], [0.5, 0]])):
        out = jones @ field @ jones.T
        stokes.append([np.trace(out), out[0, 0] - out[1, 1], 2 * out[0, 1]])
    return np.array(stokes).T


def test_out_of_plane_frames_follow_single_scattering(ptfe):
    """What is polarised in PTFE resembles dipole scattering, in all eight linear elements.

    With the frame of the scattered beam left as in the file, or the azimuth or U reversed,
    some of the correlations vanish or change sign.
    """
    azimuth = np.abs(np.degrees(ptfe.dphi) - 180)
    rows = np.flatnonzero(
        (ptfe.theta_i > np.radians(25)) & (ptfe.theta_s > np.radians(25))
        & (azimuth > 5) & (azimuth < 175)
    )  # fmt: skip
    scan = ptfe.isel(geometry=rows)
    geometry = zip(scan.theta_i.values, scan.theta_s.values, scan.dphi.values, strict=True)
    expected = np.array([dipole(*angles) for angles in geometry])
    found = mueller(scan)[:, :3, :3] / scan.M00.values[:, None, None]
    for i, j in np.ndindex(3, 3):
        if (i, j) != (0, 0):
            correlation = np.corrcoef(found[:, i, j], expected[:, i, j])[0, 1]
            assert correlation > 0.5, (i, j, correlation)


def test_table_is_reciprocal_and_mirror_symmetric_as_converted(ptfe):
    """Isotropic: at equal zeniths M = P M^T P with P = diag(1, 1, 1, -1)."""
    near = np.flatnonzero(
        (np.abs(ptfe.theta_i - ptfe.theta_s) < np.radians(4)) & (ptfe.theta_i > np.radians(40))
        & (np.abs(np.sin(ptfe.dphi)) > 0.2)
    )  # fmt: skip
    scan = ptfe.isel(geometry=near)
    assert scan.sizes["geometry"] > 100
    m = mueller(scan)
    sense = np.sign(np.sin(scan.dphi.values))
    for i, j in ((1, 2), (0, 2)):
        kept = sense * (m[:, i, j] + m[:, j, i])
        broken = sense * (m[:, i, j] - m[:, j, i])
        assert np.abs(broken.mean()) < 0.2 * np.abs(kept.mean()), (i, j)


def test_readings_of_one_level_have_standard_errors():
    """A Lambertian scan has no brighter half."""
    view = np.linspace(-80.0, 80.0, 33)
    curve = np.zeros(view.size, dtype=int)
    assert_array_equal(standard_errors(np.full(33, 0.2), None, curve, view), 0.0)
    noise = 0.01 * np.random.default_rng(3).standard_normal(33)
    found = standard_errors(0.2 + noise, None, curve, view, brightness=np.full(33, 0.2))
    assert 0.006 < np.median(found) < 0.02


def test_optical_constants_are_told_from_scans(tmp_path):
    path = tmp_path / "paint.csv"
    path.write_text("wavelength_nm,N,K\n400,1.5,0\n500,1.49,0\n")
    with pytest.raises(DataFileError, match=r"got columns 'N', 'K'.*--material-file"):
        read_goniometer(path)


ROWS = "45,-30,0.2003\n45,0,0.2259\n45,30,0.3692\n45,60,0.6174\n"


@pytest.mark.parametrize(
    "said",
    [
        "quantity: reflectance factor", "Quantity: Reflectance-Factor",
        "quantity = BRF", "quantity reflectance_factor",
        "quantity: reflectance-factor (pi times the BRDF)",
    ],
)  # fmt: skip
def test_a_quantity_is_understood_in_every_spelling(tmp_path, said):
    path = tmp_path / "scan.csv"
    path.write_text(f"# {said}\ntheta_i_deg,theta_view_deg,M00\n{ROWS}")
    np.testing.assert_allclose(read_goniometer(path).M00[1], 0.2259 / np.pi)


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ("quantity: radiance", "got 'radiance'"),
        ("quantity: brdf\n# Quantity: relative", "got 'brdf', 'relative'"),
    ],
)
def test_a_quantity_that_nobody_knows_is_refused(tmp_path, said, words):
    path = tmp_path / "scan.csv"
    path.write_text(f"# {said}\ntheta_i_deg,theta_view_deg,M00\n{ROWS}")
    with pytest.raises(DataFileError, match=words):
        read_goniometer(path)


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ("M00,S0", "one source of M00, got M00, S0"),
        ("M00,brdf_cos", "one source of M00, got M00, brdf_cos"),
        ("BRF,M10", "one quantity, got BRF beside M10"),
    ],
)
def test_one_quantity_has_one_column(tmp_path, names, words):
    path = tmp_path / "scan.csv"
    path.write_text(f"theta_i_deg,theta_view_deg,{names}\n45,0,0.1,0.02\n45,30,0.3,0.1\n")
    with pytest.raises(DataFileError, match=words):
        read_goniometer(path)
    if "BRF" in names:
        both = read_goniometer(path, quantity="reflectance-factor")
        np.testing.assert_allclose(both.M10, np.array([0.02, 0.1]) / np.pi)


def test_settings_of_a_polariser_are_compared(tmp_path):
    """I0 + I90 and I45 + I135 are both all light."""
    path = tmp_path / "scan.csv"
    rows = "".join(f"45,{v},0.3,{0.25 * 1.1},0.2,{0.25 * 1.1}\n" for v in (-40, 0, 40))
    path.write_text(f"theta_i_deg,theta_view_deg,I0,I45,I90,I135\n{rows}")
    found = [f for f in check_scan(read_goniometer(path)) if f.name == "polarisers"]
    assert len(found) == 1
    assert "9.5% more than I0 + I90" in found[0].what


def test_a_setting_read_back_is_one(tmp_path):
    """Jitter of an encoder neither hides too much light nor makes many wavelengths."""
    jitter = np.random.default_rng(2).normal(0, 0.004, 31)
    wave = 650 + 0.02 * np.random.default_rng(3).normal(size=31)
    rows = "".join(
        f"{45 + a:.4f},{view},{w:.4f},4.0\n"
        for a, view, w in zip(jitter, range(-75, 80, 5), wave, strict=True)
    )
    path = tmp_path / "scan.csv"
    path.write_text(f"theta_i_deg,theta_view_deg,wavelength_nm,M00\n{rows}")
    names = {f.name: f for f in check_scan(read_goniometer(path))}
    assert names["energy"].severity == "error"
    assert "of which only 1 lie further apart" in names["wavelengths"].what
