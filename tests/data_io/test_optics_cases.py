"""Goniometer tables as people have them: every case gives what it must, or a named refusal."""

# One line a file: the tables are read across
# ruff: noqa: E501

import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from data_io import ConventionWarning, read_goniometer, write_goniometer
from pbrdf import Material, MicrofacetModel, materials
from pbrdf.cli import main
from pbrdf.errors import DataFileError

CASES = Path(__file__).parents[1] / "cases/optics"
MODEL = MicrofacetModel(
    Material(1.5), slope_rms=0.25, specular_gain=0.9, diffuse_albedo=0.4
)


def degrees(scan, name):
    return np.degrees(scan[name].to_numpy())


@pytest.mark.parametrize("name", ["good.csv", "flipped.csv"])
def test_synthetic_scans_are_those_of_their_model(name):
    turn = 0.0 if name == "flipped.csv" else None
    scan = read_goniometer(CASES / name, azimuth_of_forward=turn)
    brdf = MODEL.brdf(scan.theta_i.values, scan.theta_s.values, scan.dphi.values)
    assert_allclose(scan.M00, brdf[:, 0, 0], rtol=1e-5)


@pytest.mark.parametrize("name", ["semi.csv", "tab.csv"])
def test_separators_and_decimal_commas(name):
    scan = read_goniometer(CASES / name)
    assert_allclose(degrees(scan, "theta_s")[:2], [20, 10])
    assert_allclose(scan.M00[:2], 0.05)


def test_text_columns_are_left_out_with_a_word():
    with pytest.warns(
        ConventionWarning, match=r"note.csv: columns of text are left out: note"
    ):
        scan = read_goniometer(CASES / "note.csv")
    assert_allclose(scan.M00, [0.05, 0.05, 0.06])


def test_elements_without_m00_are_ratios():
    with pytest.warns(
        ConventionWarning, match=r"M01, M10, .* divided by M00, because there is no M00"
    ):
        scan = read_goniometer(CASES / "normalised_no_M00.csv")
    assert {"m01", "m10", "m11", "m22", "m33"} == set(scan.data_vars)
    brdf = MODEL.brdf(scan.theta_i.values, scan.theta_s.values, scan.dphi.values)
    assert_allclose(scan.m10, (brdf[:, 1, 0] / brdf[:, 0, 0]), rtol=1e-4, atol=1e-9)
    absolute = read_goniometer(CASES / "normalised_no_M00.csv", quantity="brdf")
    assert_array_equal(absolute.M10, scan.m10)


def test_readings_of_polarised_light():
    stokes = read_goniometer(CASES / "stokes.csv")
    assert_allclose(stokes.M00, [0.05, 0.06])
    assert_allclose(stokes.M10, [0.012, 0.015])
    assert_allclose(stokes.M30, 0.0)
    crossed = read_goniometer(CASES / "sp.csv")
    assert_allclose(crossed.I_s + crossed.I_p, [0.05, 0.08])
    with pytest.warns(ConventionWarning, match="DOLP below zero is taken as signed Q/I"):
        signed = read_goniometer(CASES / "signed_dolp.csv")
    assert_allclose(signed.m10, [0.1, -0.02, 0.12])


def test_four_polarisers_are_three_elements(tmp_path):
    (tmp_path / "s.csv").write_text(
        "theta_i_deg,theta_view_deg,I0,I45,I90,I135,I0_stderr,I45_stderr,I90_stderr,I135_stderr\n"
        "30,20,3.0,2.6,1.0,1.4,0.1,0.2,0.3,0.4\n30,25,3.1,2.4,1.2,1.6,0.1,0.2,0.3,0.4\n"
    )
    scan = read_goniometer(tmp_path / "s.csv")
    assert_allclose(scan.M00, [4.0, 4.15])
    assert_allclose(scan.M10, [2.0, 1.9])
    assert_allclose(scan.M20, [1.2, 0.8])
    assert_allclose(scan.M00_stderr, np.sqrt(0.3) / 2)
    assert_allclose(scan.M10_stderr, np.sqrt(0.1))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("phis.csv", r"column phi_s_deg: .*phi_i_deg, or --azimuth-of-forward 0 or 180"),
        (
            "syn.csv",
            r"got 'measure_angle'; expected the unit of the angles 'incident_angle'",
        ),
        (
            "thorlabs.csv",
            r"line 3: expected known columns, got 'Time.date.*'Normalized s 1'",
        ),
        ("astm.txt", r"column Intensity: expected a quantity with a unit.* --quantity"),
        ("klems.xml", "got a matrix of window software"),
        ("lt.bsdf", "got a LightTools file"),
        ("zem_xyz.bsdf", "column SpectralContent: expected Monochrome, got 'XYZ'"),
    ],
)
def test_named_refusals(capsys, name, message):
    with pytest.raises(DataFileError, match=message) as caught:
        read_goniometer(CASES / name)
    assert "dphi_deg?" not in str(caught.value)
    assert main(["check", str(CASES / name)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_absolute_azimuths_need_the_forward_side():
    scan = read_goniometer(CASES / "phis.csv", azimuth_of_forward=np.pi)
    assert_allclose(degrees(scan, "dphi"), [180, 0], atol=1e-9)
    turned = read_goniometer(CASES / "phis.csv", azimuth_of_forward=0.0)
    assert_allclose(degrees(turned, "dphi"), [0, 180], atol=1e-9)


def test_reflectance_factors_and_cosines(tmp_path):
    factor = read_goniometer(CASES / "factor_pi_dark.csv")
    scan = read_goniometer(CASES / "factor_pi_dark.csv", quantity="reflectance-factor")
    assert_allclose(scan.M00, factor.M00 / np.pi, rtol=1e-15)
    assert scan.attrs["converted_from"] == "reflectance-factor"
    assert scan.attrs["quantity"] == "brdf"
    write_goniometer(scan, tmp_path / "s.csv")
    assert_array_equal(read_goniometer(tmp_path / "s.csv").M00, scan.M00)
    (tmp_path / "c.csv").write_text(
        "theta_i_deg,theta_view_deg,M00,M00_stderr,m10\n30,60,0.1,0.01,0.3\n30,-30,0.2,0.02,0.1\n"
    )
    cosine = read_goniometer(tmp_path / "c.csv", quantity="brdf-cos")
    assert_allclose(cosine.M00, [0.2, 0.2 / np.cos(np.pi / 6)])
    assert_allclose(cosine.M00_stderr, cosine.M00 / 10)
    assert_array_equal(cosine.m10, [0.3, 0.1])
    assert (
        read_goniometer(tmp_path / "c.csv", quantity="relative").attrs["quantity"]
        == "relative"
    )


@pytest.mark.parametrize("name", ["aniso.txt", "aniso_nocollide.txt"])
def test_two_azimuths_of_the_source_stay_apart(tmp_path, name):
    scan = read_goniometer(CASES / name)
    assert_allclose(np.unique(degrees(scan, "phi_i")), [0, 90])
    lobes = [float(scan.M00[scan.phi_i == phi].max()) for phi in np.unique(scan.phi_i)]
    assert_allclose(lobes, [0.06, 0.025] if name == "aniso.txt" else [0.9, 0.03])
    write_goniometer(scan, tmp_path / "again.csv")
    again = read_goniometer(tmp_path / "again.csv")
    for coordinate in ("theta_i", "theta_s", "dphi", "phi_i"):
        assert_allclose(again[coordinate], scan[coordinate], atol=1e-15)
    assert_array_equal(again.M00, scan.M00)


def test_wavelengths_stay_with_their_rows():
    scan = read_goniometer(CASES / "twow.csv")
    assert_allclose(scan.M00.where(scan.wavelength == 0.45, drop=True), 0.0318)
    assert_allclose(scan.M00.where(scan.wavelength == 0.65, drop=True), 0.159)


def test_the_text_format_of_the_standard():
    scan = read_goniometer(CASES / "astm.txt", quantity="brdf")
    assert scan.attrs["format"] == "astm"
    assert scan.attrs["title"] == "made up"
    assert_allclose(degrees(scan, "dphi"), [180, 180, 180, 0], atol=1e-9)
    assert_allclose(scan.M00, [0.05, 0.06, 0.05, 0.01])


# The same scan in other clothes, each with what must be said
TRUTH = {
    "theta_i": [30, 30, 50],
    "theta_s": [20, 35, 10],
    "dphi": [180, 0, 180],
    "M00": [0.25, 0.125, 0.5],
}
VARIANTS = {
    "units below": ("theta_i,theta_s,dphi,BRDF\ndeg,deg,deg,1/sr\n30,20,180,0.25\n30,35,0,0.125\n50,10,180,0.5\n", {}),
    "units in brackets": ("theta_i (deg);theta_s (deg);dphi (deg);M00 [1/sr]\n30;20;180;0,25\n30;35;0;0,125\n50;10;180;0,5\n", {}),
    "preamble": ("Instrument: made up\n\nAngle of incidence [°]\ttheta_r [°]\tdelta phi [°]\tBRDF [sr-1]\n30\t20\t180\t0.25\n30\t35\t0\t0.125\n50\t10\t180\t0.5\n", {}),
    "spaces": ("# made up\ntheta_i_deg theta_s_deg dphi_deg M00\n30 20 180 0.25\n30 35 0 0.125\n50 10 180 0.5\n", {}),
    "separator at the end": ("theta_i_deg;theta_view_deg;M00;\n30;20;0.25;\n30;-35;0.125;\n50;10;0.5;\n", {}),
    "mapped": ("AOI,VZA,refl\n30,20,0.25\n30,-35,0.125\n50,10,0.5\n", {"columns": {"AOI": "theta_i_deg", "VZA": "theta_view_deg", "refl": "M00"}}),
    "ignored": ("no,theta_i_deg,theta_view_deg,M00\n1,30,20,0.25\n2,30,-35,0.125\n3,50,10,0.5\n", {"columns": {"no": "ignore"}}),
    "radians declared": ("theta_i,theta_view,M00\n0.5235987755982988,0.3490658503988659,0.25\n0.5235987755982988,-0.6108652381980153,0.125\n0.8726646259971648,0.17453292519943295,0.5\n", {"angles": "rad"}),
    "radians named": ("theta_i_rad,theta_view_rad,M00\n0.5235987755982988,0.3490658503988659,0.25\n0.5235987755982988,-0.6108652381980153,0.125\n0.8726646259971648,0.17453292519943295,0.5\n", {}),
    "absolute, forward 0": ("theta_i_deg,phi_i_deg,theta_s_deg,phi_s_deg,M00\n30,40,20,40,0.25\n30,0,35,180,0.125\n50,90,10,90,0.5\n", {"azimuth_of_forward": 0.0}),
    "absolute": ("theta_i_deg,phi_i_deg,theta_s_deg,phi_s_deg,M00\n30,40,20,220,0.25\n30,0,35,0,0.125\n50,90,10,-90,0.5\n", {}),
    "views turned": ("theta_i_deg,theta_view_deg,M00\n30,-20,0.25\n30,35,0.125\n50,-10,0.5\n", {"azimuth_of_forward": 0.0}),
    "percent factor": ("theta_i_deg,theta_view_deg,reflectance_factor [%]\n30,20,78.53981633974483\n30,-35,39.269908169872416\n50,10,157.07963267948966\n", {}),
}  # fmt: skip


@pytest.mark.parametrize("name", VARIANTS)
def test_the_same_scan_in_other_clothes(tmp_path, name):
    text, declared = VARIANTS[name]
    (tmp_path / "scan.csv").write_text(text)
    scan = read_goniometer(tmp_path / "scan.csv", **declared)
    for angle in ("theta_i", "theta_s", "dphi"):
        assert_allclose(degrees(scan, angle), TRUTH[angle], rtol=1e-9, atol=1e-9)
    assert_allclose(scan.M00, TRUTH["M00"], rtol=1e-9)


def test_one_column_a_wavelength(tmp_path):
    (tmp_path / "s.csv").write_text(
        "theta_i_deg,theta_view_deg,450nm,M00_0.65um,M00_stderr_450nm,M00_stderr_650nm\n"
        "30,20,0.1,0.3,0.01,0.03\n30,25,0.2,,0.02,\n"
    )
    scan = read_goniometer(tmp_path / "s.csv")
    assert_allclose(scan.wavelength, [0.45, 0.65, 0.45, 0.65])
    assert_array_equal(scan.M00, [0.1, 0.3, 0.2, np.nan])
    assert_array_equal(scan.M00_stderr, [0.01, 0.03, 0.02, np.nan])
    assert_allclose(degrees(scan, "theta_s"), [20, 20, 25, 25])


def test_samples_turned_under_the_source(tmp_path):
    (tmp_path / "s.csv").write_text(
        "theta_i_deg,theta_view_deg,sample_rotation_deg,M00\n30,20,0,0.1\n30,20,30,0.2\n"
    )
    scan = read_goniometer(tmp_path / "s.csv")
    assert_allclose(degrees(scan, "phi_i"), [0, 330])


def test_m00_of_one_everywhere_means_ratios(tmp_path):
    text = "theta_i_deg,theta_view_deg,M00,M10,M10_stderr\n30,20,1,0.2,0.01\n30,25,1.0,-0.3,0.02\n"
    (tmp_path / "s.csv").write_text(text)
    with pytest.warns(
        ConventionWarning, match="M10 are taken as divided by M00, because M00 is 1"
    ):
        scan = read_goniometer(tmp_path / "s.csv")
    assert set(scan.data_vars) == {"m10", "m10_stderr"}
    (tmp_path / "s.csv").write_text(text.replace(",1,", ",0.5,").replace(",1.0,", ",0.25,"))
    declared = read_goniometer(tmp_path / "s.csv", normalised=True)
    assert_array_equal(declared.m10, [0.2, -0.3])
    assert_array_equal(declared.M00, [0.5, 0.25])


def test_a_mapping_file_says_it_once_for_many(tmp_path):
    (tmp_path / "lab.toml").write_text(
        'azimuth_of_forward_deg = 0\nangles = "deg"\nquantity = "reflectance-factor"\n'
        "detector_half_angle_deg = 0.5\n[columns]\nAOI = 'theta_i_deg'\nR = 'M00'\n"
    )
    (tmp_path / "s.csv").write_text("AOI,theta_s,phi_s,R\n30,20,0,0.5\n30,25,180,0.25\n")
    scan = read_goniometer(tmp_path / "s.csv", columns=tmp_path / "lab.toml")
    assert_allclose(scan.M00, np.array([0.5, 0.25]) / np.pi)
    assert_allclose(degrees(scan, "dphi"), [180, 0], atol=1e-9)
    assert_allclose(degrees(scan, "detector_half_angle"), 0.5)
    assert "reflectance-factor" in scan.attrs["declared"]
    (tmp_path / "lab.toml").write_text("angle = 'deg'\n")
    with pytest.raises(DataFileError, match="expected known keys, got 'angle'"):
        read_goniometer(tmp_path / "s.csv", columns=tmp_path / "lab.toml")


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        (
            {"columns": {"AOI": "theta_i_deg"}},
            "expected the columns 'AOI' to rename, found none",
        ),
        ({"columns": {"M00": "theta"}}, "expected a known meaning, got 'theta'"),
        (
            {"azimuth_of_forward": 1.0},
            r"azimuth_of_forward must be 0 or pi rad \(180 degrees\), got 1 rad",
        ),
        ({"angles": "gon"}, "angles must be one of deg, rad, got 'gon'"),
        ({"quantity": "bsdf"}, "quantity must be one of brdf, .*got 'bsdf'"),
        ({"source_half_angle": 1.0}, r"source_half_angle must lie in \[0, 45\] degrees"),
    ],
)
def test_declarations_are_checked(declared, message):
    with pytest.raises(ValueError, match=message):
        read_goniometer(CASES / "good.csv", **declared)


def test_declarations_that_a_format_fixes_are_refused():
    with pytest.raises(ValueError, match="angles does not belong to a fred file"):
        read_goniometer(CASES / "aniso.txt", angles="rad")


def test_what_writes_and_reads_again_says_the_same(tmp_path):
    """Elements without M00 are not taken for ratios once their quantity is written."""
    (tmp_path / "s.csv").write_text(
        "theta_i_deg,theta_view_deg,M10\n30,20,0.2\n30,25,0.3\n"
    )
    scan = read_goniometer(tmp_path / "s.csv", quantity="brdf")
    write_goniometer(scan, tmp_path / "again.csv")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert_array_equal(read_goniometer(tmp_path / "again.csv").M10, scan.M10)


def test_columns_headed_by_numbers_are_said_to_be_wavelengths(tmp_path):
    (tmp_path / "s.csv").write_text(
        "theta_i_deg,theta_view_deg,450,650\n30,20,0.1,0.3\n,,,\n"
    )
    with pytest.raises(DataFileError, match="expected known columns, got '450', '650'"):
        read_goniometer(tmp_path / "s.csv")
    columns = {"450": "M00_450nm", "650": "M00_650nm"}
    scan = read_goniometer(tmp_path / "s.csv", columns=columns)
    assert_allclose(scan.wavelength, [0.45, 0.65])
    assert_allclose(scan.M00, [0.1, 0.3])


def test_m00_among_ratios_is_one(tmp_path):
    (tmp_path / "s.csv").write_text(
        "theta_i_deg,theta_view_deg,m00,m10\n30,20,1,0.2\n30,25,1,-0.1\n"
    )
    scan = read_goniometer(tmp_path / "s.csv")
    assert set(scan.data_vars) == {"m10"}
    (tmp_path / "s.csv").write_text(
        "theta_i_deg,theta_view_deg,m00,m10\n30,20,1,0.2\n30,25,0.5,-0.1\n"
    )
    with pytest.raises(DataFileError, match=r"line 3, column m00: .* got 0\.5"):
        read_goniometer(tmp_path / "s.csv")


HEAD = "theta_i_deg,theta_view_deg"


@pytest.mark.parametrize(
    ("header", "row", "message"),
    [
        # A hint must never turn a refused file into a wrong answer
        ("f_s,f_p", "0.3,0.2", r"expected known columns, got 'f_s', 'f_p'\. Say what"),
        ("M00,M_10", "0.3,0.2", r"--columns M_10=M10"),
        ("BRDF,BRDF_err", "0.3,0.2", r"--columns BRDF_err=M00_stderr"),
        ("BRDF,sigma", "0.3,0.2", r"--columns sigma=M00_stderr"),
        ("BRDF,u(BRDF)", "0.3,0.2", r"--columns u\(BRDF\)=M00_stderr"),
        (
            "M11,M12,M44",
            "0.3,0.1,0.2",
            r"got 'M44'\. Elements are counted from 0 here: --columns M11=M00",
        ),
        ("M00", "-999", r"got -999\. If -999 marks a gap, leave the cell empty"),
    ],
)
def test_names_that_others_give(tmp_path, header, row, message):
    (tmp_path / "s.csv").write_text(f"{HEAD},{header}\n30,20,{row}\n30,25,{row}\n")
    with pytest.raises(DataFileError, match=message) as caught:
        read_goniometer(tmp_path / "s.csv")
    assert "f_ss" not in str(caught.value).partition("Known")[0]


@pytest.mark.parametrize(
    ("header", "row", "cure"),
    [
        ("M11,M12", "0.3,0.1", "M11=M00,M12=M01. Counted from 0: --columns M11=M11,M12"),
        ("M11,M11_stderr", "3,0.1", "M11=M00,M11_stderr=M00_stderr"),
        # An element 33 may be the last of nine or of sixteen
        ("M11,M22,M33", "0.3,0.2,0.1", "M11=M00,M22=M11,M33=M22"),
        ("m11,m12,DOLP", "1,0.1,0.1", "m11=m00,m12=m01"),
    ],
)
def test_elements_that_may_be_counted_from_one_are_refused(tmp_path, header, row, cure):
    (tmp_path / "s.csv").write_text(f"{HEAD},{header}\n30,20,{row}\n30,25,{row}\n")
    for said in ({}, {"quantity": "brdf"}, {"normalised": True}):
        with pytest.raises(DataFileError, match=r"M11 is the reflectance M00") as caught:
            read_goniometer(tmp_path / "s.csv", **said)
        assert cure in str(caught.value)


def test_constants_without_a_common_wavelength_are_refused(tmp_path):
    path = tmp_path / "apart.csv"
    path.write_text("wl,n\n0.4,1.5\n0.5,1.4\n\nwl,k\n0.6,0.1\n0.7,0.2\n")
    with pytest.raises(DataFileError, match=r"n from 0.4 to 0.5 um, kappa from 0.6 to 0.7"):
        materials.read(path)


def test_ratios_that_may_be_counted_from_one_are_refused(tmp_path):
    (tmp_path / "s.csv").write_text(f"{HEAD},m12,m22,m33\n30,20,0.1,0.9,0.8\n")
    with pytest.raises(DataFileError, match=r"counted from 1, m12 is M01/M00") as caught:
        read_goniometer(tmp_path / "s.csv")
    assert "Counted from 1: --columns m12=m01,m22=m11,m33=m22." in str(caught.value)
    said = {"m12": "m01", "m22": "m11", "m33": "m22"}
    scan = read_goniometer(tmp_path / "s.csv", columns=said)
    assert float(scan.m01[0]) == 0.1


@pytest.mark.parametrize(
    ("header", "row", "good"),
    [
        ("M00,M00_stderr [%]", "0.3,2", False),
        ("DOLP [%],DOLP_stderr", "30,0.02", False),
        ("DOLP [%],DOLP_stderr [%]", "30,2", True),
    ],
)
def test_a_standard_error_has_the_unit_of_its_value(tmp_path, header, row, good):
    path = tmp_path / "s.csv"
    path.write_text(f"{HEAD},{header}\n30,20,{row}\n")
    if good:
        assert float(read_goniometer(path).DOLP_stderr[0]) == 0.02
        return
    with pytest.raises(DataFileError, match=r"standard error in the unit of .* no unit"):
        read_goniometer(path)


def test_an_infinite_angle_is_refused(tmp_path):
    path = tmp_path / "s.csv"
    path.write_text("theta_i_deg,theta_s_deg,dphi_deg,M00\n30,20,1e400,0.1\n")
    with pytest.raises(DataFileError, match=r"column dphi_deg: .* in every row, got inf"):
        read_goniometer(path)


def test_elements_counted_from_one_are_read_as_declared(tmp_path):
    (tmp_path / "s.csv").write_text(f"{HEAD},M11,M12\n30,20,0.3,0.1\n30,25,0.2,0.1\n")
    scan = read_goniometer(tmp_path / "s.csv", columns={"M11": "M00", "M12": "M01"})
    assert_array_equal(scan.M00, [0.3, 0.2])
    assert_array_equal(scan.M01, [0.1, 0.1])
    with pytest.raises(
        DataFileError, match=r"got M11=M00 by --columns, but nothing of M12"
    ):
        read_goniometer(tmp_path / "s.csv", columns={"M11": "M00"})
    own = {"M11": "M11", "M12": "M12"}
    scan = read_goniometer(tmp_path / "s.csv", columns=own, quantity="brdf")
    write_goniometer(scan, tmp_path / "own.csv")
    assert_array_equal(read_goniometer(tmp_path / "own.csv").M11, [0.3, 0.2])


@pytest.mark.parametrize("header", ["M00,M11", "m10,m11", "I_s,I_p,M11", "M11/M00,M22/M00"])
def test_elements_beside_one_of_index_zero_are_counted_from_zero(tmp_path, header):
    row = "0.4,0.3" + ",0.1" * (header.count(",") - 1)
    (tmp_path / "s.csv").write_text(f"{HEAD},{header}\n30,20,{row}\n30,25,{row}\n")
    assert {"M11", "m11"} & read_goniometer(tmp_path / "s.csv").keys()


def test_bars_and_photon_energies(tmp_path):
    (tmp_path / "s.csv").write_text(
        f"{HEAD},energy_eV,M00\n30,20,2.0,0.3\n30,25,2.0,0.2\n".replace(",", "|")
    )
    scan = read_goniometer(tmp_path / "s.csv")
    assert_allclose(scan.wavelength, 1.239841984 / 2.0, rtol=1e-9)
    assert_array_equal(scan.M00, [0.3, 0.2])
