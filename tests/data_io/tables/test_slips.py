"""Slips in the columns of a scan that physics tells: refused, with a cure that reads it."""

import re
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

from data_io import ConventionWarning, read_goniometer
from fitting import check_scan
from pbrdf.errors import DataFileError

ANGLES = "theta_i_deg,theta_view_deg"
VIEWS = (-60, -30, 0, 22, 30, 38, 60)
# A lobe at 30 degrees over a base
LIGHT = np.array([0.032, 0.033, 0.04, 0.09, 0.12, 0.10, 0.045])


def write(tmp_path, **columns):
    rows = [f"30,{view}" for view in VIEWS]
    for values in columns.values():
        each = np.broadcast_to(values, len(VIEWS))
        rows = [f"{row},{value:.6g}" for row, value in zip(rows, each, strict=True)]
    path = tmp_path / "scan.csv"
    path.write_text("\n".join([f"{ANGLES},{','.join(columns)}", *rows]) + "\n")
    return path


def read(path, **declared):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConventionWarning)
        return read_goniometer(path, **declared)


def mapping_of(refused, start):
    """Return the mapping that stands behind some words of a message."""
    found = re.search(start + r"--columns (\S+?)\.(?:\s|$)", str(refused.value))
    return dict(pair.rsplit("=", 1) for pair in found[1].split(","))


@pytest.mark.parametrize("light", ["BRDF", "S0", "M00"])
def test_elements_counted_from_one_beside_a_reflectance(tmp_path, light):
    """In plane m12 from 0 vanishes; what polarises there is m01."""
    degree = np.array([0.0, -0.02, -0.1, -0.4, -0.55, -0.6, -0.7])
    path = write(tmp_path, **{light: LIGHT, "m12": degree, "m33": 0.5})
    with pytest.raises(DataFileError, match=r"column m12: .*vanish in plane.*0\.4") as no:
        read(path)
    scan = read(path, columns=mapping_of(no, r"from 1: "))
    assert_allclose(scan.m01, degree)
    assert "m22" in scan
    scan = read(path, columns=mapping_of(no, r"from 0: "))
    assert_allclose(scan.m12, degree)
    # Noise about zero, and a scan that names an index 0, are no slips
    read(write(tmp_path, **{light: LIGHT, "m12": 0.1 * degree, "m33": 0.5}))
    read(write(tmp_path, **{light: LIGHT, "m12": degree, "m10": 0.5}))


def test_elements_of_the_fourth_row_name_the_whole_mapping(tmp_path):
    path = write(tmp_path, BRDF=LIGHT, m12=-0.3, m33=0.5, m34=0.1)
    with pytest.raises(DataFileError, match="m34") as refused:
        read(path)
    mapping = mapping_of(refused, "from 0 here: ")
    assert mapping == {"m12": "m01", "m33": "m22", "m34": "m23"}
    assert {"M00", "m01", "m22", "m23"} <= set(read(path, columns=mapping))


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"BRDF": LIGHT, "BRDF_stderr": 2.0}, r"BRDF_stderr.* below the brightest.*0\.12"),
        ({"m10": 0.5, "m10_stderr": 2.0, "m11": 0.1}, "m10_stderr.* below 1, got mostly 2"),
        ({"M00": LIGHT, "f_ss": 0.3}, r"f_ss: expected at most 2 M00 = 0\.06"),
        ({"I_s": LIGHT, "I_p": LIGHT / 2 - 0.03}, "I_p: .*dark signal"),
    ],
)
def test_numbers_that_cannot_be(tmp_path, columns, message):
    with pytest.raises(DataFileError, match=message):
        read(write(tmp_path, **columns))


def test_numbers_that_can(tmp_path):
    path = write(tmp_path, BRDF=LIGHT, BRDF_stderr=2.0)
    assert "M00_stderr" not in read(path, columns={"BRDF_stderr": "ignore"})
    read(write(tmp_path, BRDF=LIGHT, BRDF_stderr=0.11))
    read(write(tmp_path, M00=LIGHT, f_ss=1.99 * LIGHT))


def test_elements_divided_by_some_of_their_light(tmp_path):
    """Where fewer than half of the rows show it, the option is named too."""
    path = write(tmp_path, S0=LIGHT, S1=[0.01, 0.02, 0.03, 0.05, 0.5, 0.6, 0.04], S2=0.0)
    with pytest.raises(DataFileError, match="give --normalised"):
        read(path)
    assert {"M00", "m10", "m20"} <= set(read(path, normalised=True))


def turn(tmp_path, first, last):
    path = tmp_path / "turn.csv"
    names = "theta_i_deg,theta_s_deg,dphi_deg,M00,M00_stderr,M20"
    rows = [f"30,20,0,{first}", "30,20,180,0.05,0.0006,0", f"30,20,360,{last}"]
    path.write_text("\n".join([names, *rows]) + "\n")
    return path


def test_a_turn_may_end_where_it_began(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scan = read_goniometer(turn(tmp_path, "0.04,0.0006,0", "0.04,0.0006,-1e-19"))
    assert scan.sizes["geometry"] == 2
    with pytest.warns(ConventionWarning, match="1 readings repeat.*line 4"):
        scan = read_goniometer(turn(tmp_path, "0.04,0.0006,0", "0.04001,0.00061,0"))
    assert_allclose(scan.M00, [0.04, 0.05])
    # Beyond the error, and two readings of one azimuth, are told as before
    with pytest.raises(DataFileError, match="one value a geometry"):
        read(turn(tmp_path, "0.04,0.0006,0", "0.045,0.0006,0"))
    path = turn(tmp_path, "0.04,0.0006,0", "0.04001,0.0006,0")
    path.write_text(path.read_text().replace(",360,", ",0,"))
    with pytest.raises(DataFileError, match="one value a geometry"):
        read(path)


def found(scan, name):
    return [one for one in check_scan(scan) if one.name == name]


def test_single_zeros_beside_light_are_found(tmp_path):
    gap = LIGHT.copy()
    gap[0] = 0.0
    (one,) = found(read(write(tmp_path, BRDF=gap)), "floor")
    assert one.severity == "warning"
    assert "1 readings are exactly 0" in one.what
    assert "view -60 deg beside 0.033" in one.what
    # In the dark of a mirror a rounded 0 is a reading
    dark = [0.0, 1e-4, 1e-3, 0.2, 9.0, 0.3, 1e-3]
    assert not found(read(write(tmp_path, BRDF=dark)), "floor")


def test_ratios_beside_bright_light_are_noted(tmp_path):
    """On a base of albedo 0.8 no ratio exceeds M00; it varies more than M00."""
    lobe = 0.3 * (LIGHT - LIGHT.min())
    light, polarised = 0.255 + lobe, lobe * np.linspace(0.0, 0.9, 7)
    scan = read(write(tmp_path, M00=light, M10=polarised / light))
    (one,) = found(scan, "ratios")
    assert one.severity == "note"
    assert "--normalised" in one.cure
    assert not found(read(write(tmp_path, M00=light, M10=polarised)), "ratios")
    path = write(tmp_path, M00=light, M10=polarised / light)
    scan = read(path, normalised=True)
    assert "m10" in scan
    assert not found(scan, "ratios")


@pytest.mark.parametrize("names", [("I_s", "I_p"), ("Is", "Ip"), ("I0", "I90"), ("a", "b")])
def test_s_and_p_are_exchanged_by_the_names_of_the_file(tmp_path, names):
    one, other = 0.2 * LIGHT, 0.8 * LIGHT
    path = write(tmp_path, **dict(zip(names, (one, other), strict=True)))
    columns = {"a": "I_s", "b": "I_p"} if names[0] == "a" else {}
    (finding,) = found(read(path, columns=columns), "s-and-p")
    pairs = finding.cure.removesuffix(".").partition("--columns ")[2]
    scan = read(path, columns=dict(pair.split("=") for pair in pairs.split(",")))
    assert_allclose(scan.I_s, other)
    assert not found(scan, "s-and-p")


def test_four_polarisers_exchange_two(tmp_path):
    path = write(
        tmp_path, I0=0.2 * LIGHT, I45=0.5 * LIGHT, I90=0.8 * LIGHT, I135=0.5 * LIGHT
    )
    (finding,) = found(read(path), "s-and-p")
    assert "--columns I0=I90,I90=I0." in finding.cure
    assert not found(read(path, columns={"I0": "I90", "I90": "I0"}), "s-and-p")
    path = write(tmp_path, M00=LIGHT, M10=-0.6 * LIGHT)
    (finding,) = found(read(path), "s-and-p")
    assert "--columns" not in finding.cure


def test_expanded_uncertainties_are_no_standard_errors(tmp_path):
    path = write(tmp_path, **{"BRDF": LIGHT, "U (k=2)": 0.001})
    with pytest.raises(DataFileError, match="expanded one, k=2"):
        read(path, columns={"U (k=2)": "M00_stderr"})
    path = write(tmp_path, **{"BRDF": LIGHT, "u (k=1)": 0.001})
    assert "M00_stderr" in read(path, columns={"u (k=1)": "M00_stderr"})
