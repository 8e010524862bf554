"""Remarks on a scan are obeyed, or refused with a cure that works; others change nothing."""

# One remark a line
# ruff: noqa: E501

import re
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

from data_io import ConventionWarning, read_goniometer, write_goniometer
from pbrdf.errors import DataFileError

HEAD = "theta_i_deg,theta_view_deg,M00\n"
ROWS = "30,-60,0.032\n30,-20,0.033\n30,20,0.09\n30,30,0.12\n30,60,0.045\n"
BACK = "30,-60,0.032\n30,-20,0.033\n"
FORE = "30,20,0.09\n30,30,0.12\n"


def read(tmp_path, text, **more):
    """Return a scan that is read without a warning."""
    path = tmp_path / "scan.csv"
    path.write_text(text, encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("error", ConventionWarning)
        return read_goniometer(path, **more)


def refused(tmp_path, text, **more):
    with pytest.raises(DataFileError) as error:
        read(tmp_path, text, **more)
    return str(error.value)


def options(message, which):
    """Return what one of the commands of a cure declares."""
    columns = dict(re.findall(r"(\w+)=(\w+)", message)[which : which + 1])
    quantity = re.search(r"--quantity ([a-z-]+)", message)
    return {"columns": columns} | ({"quantity": quantity[1]} if quantity else {})


@pytest.mark.parametrize(
    "remark",
    [
        "Quantity,reflectance factor", "# Quantity,reflectance factor",
        "# Measured quantity: reflectance factor", "# type: reflectance factor",
        '# "quantity": "reflectance-factor",', "# quantity\tBRF",
        "# data type = bidirectional reflectance factor",
        "# quantity: reflectance factor # see manual",
    ],
)  # fmt: skip
def test_a_quantity_is_read_in_any_punctuation(tmp_path, remark):
    scan = read(tmp_path, f"{remark}\n{HEAD}{ROWS}")
    assert_allclose(scan.M00[3], 0.12 / np.pi)
    write_goniometer(scan, tmp_path / "own.csv")
    assert_allclose(read_goniometer(tmp_path / "own.csv").M00, scan.M00)


def test_lines_of_a_spreadsheet_are_remarks(tmp_path):
    text = (
        '"Quantity";"Reflectance factor"\n"Wavelength";"633 nm"\n"phi_i [deg]";"40"\n'
        + (HEAD + ROWS).replace(",", ";").replace(".", ",")
    )
    scan = read(tmp_path, text)
    assert_allclose(scan.M00[3], 0.12 / np.pi)
    assert_allclose(scan.wavelength, 0.633)
    assert_allclose(np.degrees(scan.phi_i), 40.0)


def test_per_cent_of_a_remark_count_once(tmp_path):
    remark = "# Quantity: Reflectance Factor (%)\n"
    rows = "30,20,9,0.3\n30,30,12,0.4\n"
    for names in ("M00,M00_stderr", "M00 [%],M00_stderr [%]"):
        (tmp_path / "s.csv").write_text(
            f"{remark}theta_i_deg,theta_view_deg,{names}\n{rows}"
        )
        with pytest.warns(ConventionWarning, match=r"M00_stderr is taken .* 3\.33 %"):
            scan = read_goniometer(tmp_path / "s.csv")
        assert_allclose(scan.M00, np.array([0.09, 0.12]) / np.pi)
        assert_allclose(scan.M00_stderr, np.array([0.003, 0.004]) / np.pi)
    message = refused(tmp_path, f"# quantity: BRDF [%]\n{HEAD}30,20,9\n30,30,12\n")
    assert "expected a BRDF in 1/sr, the file writes %" in message
    scan = read(
        tmp_path,
        f"# quantity: BRF in %\n{HEAD}30,20,9\n30,30,12\n",
        quantity="reflectance-factor",
    )
    assert_allclose(scan.M00[1], 0.12 / np.pi)


@pytest.mark.parametrize(
    ("said", "name", "by_name"),
    [
        ("brdf", "BRF", "reflectance-factor"), ("brdf-cos", "BRF", "reflectance-factor"),
        ("reflectance factor", "BRDF", "brdf"), ("BRF", "M00 [1/sr]", "brdf"),
    ],
)  # fmt: skip
def test_a_remark_must_not_contradict_a_name(tmp_path, said, name, by_name):
    text = f"# quantity: {said}\n{HEAD.replace('M00', name)}{ROWS}"
    message = refused(tmp_path, text)
    assert "expected one quantity, a remark says" in message
    factors = {
        "brdf": 1.0,
        "reflectance-factor": 1 / np.pi,
        "brdf-cos": 1 / np.cos(np.pi / 6),
    }
    cures = re.findall(r"--quantity ([a-z-]+)", message)
    assert by_name in cures
    for quantity in cures:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConventionWarning)
            assert_allclose(
                read_goniometer(tmp_path / "scan.csv", quantity=quantity).M00[3],
                0.12 * factors[quantity],
            )


def test_an_option_that_overrules_a_remark_is_named(tmp_path):
    (tmp_path / "s.csv").write_text(f"# quantity: BRF\n{HEAD}{ROWS}")
    with pytest.warns(
        ConventionWarning,
        match="--quantity brdf overrules the remark, which says reflectance-factor",
    ):
        scan = read_goniometer(tmp_path / "s.csv", quantity="brdf")
    assert_allclose(scan.M00[3], 0.12)
    unknown = read(
        tmp_path, f"# quantity: reflectance\n{HEAD}{ROWS}", quantity="reflectance-factor"
    )
    assert_allclose(unknown.M00[3], 0.12 / np.pi)


@pytest.mark.parametrize(
    ("remark", "wave"),
    [
        ("# wavelength: 450 nm", 0.45), ("# Wavelength;650 nm", 0.65), ("# lambda = 0.45 um", 0.45),
        ("# 450 nm", 0.45), ("# 2.75 eV", 0.450851631), ("# 4500 A", 0.45), ("# 15800 cm-1", 0.632911392),
        ("# red laser (650 nm, 3.5 mm spot)", 0.65), ("# wavelength_nm: 633", 0.633),
        ("Wavelength [nm],633", 0.633), ("# HeNe 633 nm, bandwidth 10 nm", 0.633), ("# 532 nm laser", 0.532),
        ("# Wavelength: 633 nm\n# Cr coating 120 nm", 0.633), ("# λ = 0,633 µm", 0.633),
    ],
)  # fmt: skip
def test_a_wavelength_is_that_of_all_rows(tmp_path, remark, wave):
    scan = read(tmp_path, f"{remark}\n{HEAD}{ROWS}")
    assert_allclose(scan.wavelength, np.full(5, wave), rtol=1e-8)


@pytest.mark.parametrize(
    "remark",
    [
        "Sample: Cr coating 120 nm on glass", "rms roughness 4.5 nm", "black paint, 50 nm roughness",
        "film thickness: 0.3 um", "laser spot 500 um", "laser power 5 mW", "cut-off wavelength 800 um",
        "lambda_c = 0.8 mm", "laser textured, pitch 20 um", "lambda/4 plate", "calibrated at wavelengths 400-700 nm",
        "wavelength range 400-700 nm", "mean of s-polarised and p-polarised readings", "unpolarised light",
        "Polarization: none", "polarizer: Glan-Thompson", "polarisation: (s+p)/2", "quantity of paint 3 g",
        "type: goniometer", "values, see below", "phi_i = 0 points along the brushing", "gain 10",
        "dphi = phi_s - phi_i, specular at dphi = 180", "rotation stage 3",
    ],
)  # fmt: skip
def test_other_remarks_change_nothing(tmp_path, remark):
    scan = read(tmp_path, f"# {remark}\n{HEAD}{BACK}# {remark}\n{FORE}")
    assert not {"wavelength", "phi_i"} & set(scan.coords)
    assert_allclose(scan.M00, [0.032, 0.033, 0.09, 0.12])


@pytest.mark.parametrize("one", ["wavelength 450", "black paint, 650 nm", "chassis 650 nm"])
def test_a_doubtful_wavelength_is_named_with_what_is_understood(tmp_path, one):
    (tmp_path / "s.csv").write_text(f"# {one}\n{HEAD}{ROWS}")
    with pytest.warns(ConventionWarning, match="is left out: write wavelength 6") as caught:
        assert "wavelength" not in read_goniometer(tmp_path / "s.csv").coords
    cure = re.search(r"write (.*)\.$", str(caught[0].message))[1]
    assert "wavelength" in read(tmp_path, f"# {cure}\n{HEAD}{ROWS}").coords


def test_a_wavelength_agrees_with_the_column_and_with_others(tmp_path):
    table = "wavelength_nm," + HEAD + "".join(f"633,{row}\n" for row in ROWS.split())
    assert_allclose(read(tmp_path, f"# HeNe laser, 632.8 nm\n{table}").wavelength, 0.633)
    assert "wavelength of the remark, 650 nm, in the column, got 633 nm" in refused(
        tmp_path, f"# laser 650 nm\n{table}"
    )
    two = "# wavelength 450 nm\n# laser 650 nm\n"
    assert "remarks name 450 nm, 650 nm" in refused(tmp_path, f"{two}{HEAD}{ROWS}")
    assert_allclose(read(tmp_path, two.replace("450", "633") + table).wavelength, 0.633)


def test_an_azimuth_of_the_source_is_that_of_all_rows(tmp_path):
    assert_allclose(np.degrees(read(tmp_path, f"# phi_i = 90\n{HEAD}{ROWS}").phi_i), 90.0)
    assert_allclose(read(tmp_path, f"# phi_i: 1.2 rad\n{HEAD}{ROWS}").phi_i, 1.2)
    turned = read(tmp_path, f"# sample rotation: 30 deg\n{HEAD}{ROWS}")
    assert_allclose(np.degrees(turned.phi_i), 330.0)
    message = refused(tmp_path, f"# phi_i = 22.5\n{HEAD}{ROWS}")
    cure = re.search(r"Write (.*) \(or rad\)", message)[1]
    assert_allclose(np.degrees(read(tmp_path, f"# {cure}\n{HEAD}{ROWS}").phi_i), 22.5)
    column = "phi_i_deg," + HEAD + "".join(f"0,{row}\n" for row in ROWS.split())
    assert "phi_i of the remark, 90, in the column, got 0" in refused(
        tmp_path, f"# phi_i = 90\n{column}"
    )
    absolute = "theta_i_deg,theta_s_deg,phi_s_deg,M00\n30,20,220,0.09\n30,20,40,0.03\n"
    assert_allclose(
        np.degrees(read(tmp_path, f"# phi_i = 40\n{absolute}").dphi),
        [180.0, 0.0],
        atol=1e-9,
    )


@pytest.mark.parametrize(
    ("remark", "end"),
    [
        ("Polarization: p", "p"), ("polarisation;TE", "s"), ("s-polarised source", "s"),
        ("Polarizer angle: 90 deg", "s"), ("analyser = parallel", "p"), ('"polarization": "p",', "p"),
    ],
)  # fmt: skip
def test_polarised_readings_are_not_of_unpolarised_light(tmp_path, remark, end):
    message = refused(tmp_path, f"# {remark}\n{HEAD}{ROWS}")
    assert "expected unpolarised light in M00, a remark says" in message
    for which, name in enumerate((f"I_{end}", f"f_{end}{end}", "M00")):
        scan = read(tmp_path, f"# {remark}\n{HEAD}{ROWS}", **options(message, which))
        assert_allclose(scan[name][3], 0.12)
        write_goniometer(scan, tmp_path / "own.csv")
        assert_allclose(read_goniometer(tmp_path / "own.csv")[name], scan[name])
    message = refused(tmp_path, f"# {remark}\n{HEAD.replace('M00', 'BRF')}{ROWS}")
    scan = read(
        tmp_path, (tmp_path / "scan.csv").read_text(encoding="utf-8"), **options(message, 0)
    )
    assert_allclose(scan[f"I_{end}"][3], 0.12 / np.pi)


@pytest.mark.parametrize(
    ("first", "second", "what"),
    [
        ("wavelength = 450", "wavelength = 650", "wavelength"), ("lambda: 450", "lambda: 650", "wavelength"),
        ("lambda=0.45", "lambda=0.65", "wavelength"), ("2.75 eV", "1.9 eV", "wavelength"),
        ("4500 A", "6500 A", "wavelength"), ("15800 cm-1", "9400 cm-1", "wavelength"), ("HeNe", "Nd:YAG laser", "wavelength"),
        ("polarizer 0", "polarizer 90", "polarisation"), ("TE", "TM", "polarisation"),
        ("parallel", "perpendicular", "polarisation"), ("co-pol", "cross-pol", "polarisation"),
        ("azimuth 0 deg", "azimuth 90 deg", "azimuth of the sample"), ("gain x10", "gain x1", "gain"),
        ("BRDF", "BRF", "quantity"), ("lamp on", "reflectance factor below", "quantity"),
    ],
)  # fmt: skip
def test_two_settings_among_the_rows_are_refused(tmp_path, first, second, what):
    text = f"{HEAD}# {first}\n{BACK}# {second}\n{FORE}"
    message = refused(tmp_path, text)
    assert f"line 5: expected one {what}," in message
    # Each setting a file
    for part in (f"{HEAD}{BACK}", f"{HEAD}{FORE}"):
        read(tmp_path, part)


def test_settings_that_columns_hold_may_head_blocks(tmp_path):
    """Azimuths of the detector, sides of the sample, and one quantity in every block."""
    blocks = (("azimuth 0 deg", "0"), ("azimuth 90 deg", "90"))
    for column, remarks in (
        ("dphi_deg", blocks),
        ("phi_i_deg", (("parallel", "0"), ("perpendicular", "90"))),
    ):
        angles = "theta_s_deg" if column == "dphi_deg" else "theta_view_deg"
        text = f"theta_i_deg,{angles},{column},M00\n"
        for remark, value in remarks:
            text += f"# {remark}\n30,20,{value},0.05\n30,40,{value},0.04\n"
        assert read(tmp_path, text).sizes["geometry"] == 4
    block = "# quantity: BRF [%]\n"
    scan = read(
        tmp_path, f"{block}{HEAD}30,20,9\n30,30,12\n{block}{HEAD}30,40,8\n30,50,6\n"
    )
    assert_allclose(scan.M00[-1], 0.06 / np.pi)
    text = f"{HEAD}{BACK}# BRF\n{FORE}"
    message = refused(tmp_path, text)
    cure = re.search(r"write (# quantity: [a-z-]+) above", message)[1]
    assert_allclose(read(tmp_path, f"{cure}\n{HEAD}{BACK}{FORE}").M00[0], 0.032 / np.pi)
    assert_allclose(
        read(tmp_path, text, quantity="reflectance-factor").M00[0], 0.032 / np.pi
    )


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("Analyzer", ("par", "perp")),
        ("channel", ("co", "cross")),
        ("state", ("unpol", "s")),
    ],
)
def test_a_column_of_polarisations_is_refused(tmp_path, name, words):
    rows = "".join(
        f"{word},{row}\n" for word, row in zip(words, ROWS.split(), strict=False)
    )
    message = refused(tmp_path, f"{name},{HEAD}{rows}")
    assert "expected no polarisation by rows" in message
    scan = read(tmp_path, f"{name},{HEAD}{rows}", columns={name: "ignore"})
    assert scan.sizes["geometry"] == 2


ZEMAX = """# {}
Source Measured
Symmetry PlaneSymmetrical
SpectralContent Monochrome
ScatterType BRDF
SampleRotation 1
0
AngleOfIncidence 1
30
ScatterAzimuth 2
0 180
ScatterRadial 2
0 10
Monochrome
DataBegin
TIS 0.1
0.5 0.2
0.5 0.1
DataEnd
"""
CHASSIS = "# {}\n# phi_i theta_i phi_o theta_o brdf\n30 0 -20 0 0.5\n30 0 -30 0 0.8\n"
ASTM = "{}\nVARS theta_i,phi_i,theta_s,phi_s,BRDF\n30,0,20,180,0.05\n"


def test_what_was_converted_is_not_written(tmp_path):
    remarks = "QUANTITY reflectance factor\nPOLARIZATION s\nWAVELENGTH 633 nm"
    text = ASTM.format(remarks).replace("BRDF", "M00")
    assert "unpolarised light in M00" in refused(tmp_path, text)
    scan = read(tmp_path, text, columns={"M00": "M00"})
    assert_allclose(scan.M00, 0.05 / np.pi)
    for one in (scan, read(tmp_path, ZEMAX.format("Polarization: p"))):
        write_goniometer(one, tmp_path / "own.csv")
        assert_allclose(read_goniometer(tmp_path / "own.csv").M00, one.M00)


@pytest.mark.parametrize("text", [ZEMAX, CHASSIS, ASTM])
def test_formats_know_the_same_wavelengths(tmp_path, text):
    for remark in (
        "Wavelength: 633 nm",
        "HeNe laser (633 nm)",
        "WAVELENGTH_NM 633",
        "WAVELENGTH (nm) 633",
        "WAVELENGTH 6.33E-7 m",
    ):
        assert_allclose(read(tmp_path, text.format(remark)).wavelength, 0.633)
    for remark in (
        "Sample: Cr coating 120 nm on glass",
        "rms roughness 4.5 nm",
        "black paint, 50 nm roughness",
    ):
        assert "wavelength" not in read(tmp_path, text.format(remark)).coords
    mark = "\n" if text is ASTM else "\n# "
    two = f"WAVELENGTH 633 nm{mark}WAVELENGTH 1064 nm"
    assert "remarks name 633 nm, 1064 nm" in refused(tmp_path, text.format(two))
