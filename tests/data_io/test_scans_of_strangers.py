"""Scans as other programs write them: read right, or refused with what would mend them."""

# One line a file: the tables are read across
# ruff: noqa: E501

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from data_io import ConventionWarning, read_goniometer
from fitting import check_scan
from fitting.readings.observations import observe
from pbrdf.errors import DataFileError

HEAD = "theta_i_deg,theta_view_deg,M00\n"


def read(tmp_path, text, **more):
    (tmp_path / "scan.csv").write_text(text, encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConventionWarning)
        return read_goniometer(tmp_path / "scan.csv", **more)


@pytest.mark.parametrize(
    "mark", ["n/a", "NA", "--", "nan", "", "-", "#N/A", "No Data", "null", "—", "***"]
)
def test_marks_of_gaps_are_missing_readings(tmp_path, mark):
    scan = read(tmp_path, f"{HEAD}30,10,0.05\n30,20,{mark}\n30,30,0.07\n")
    assert_allclose(scan.M00, [0.05, np.nan, 0.07])
    with pytest.raises(DataFileError, match=r"line 3.*theta_view_deg.*got a gap"):
        read(tmp_path, f"{HEAD}30,10,0.05\n30,{mark or 'nan'},0.06\n")


def test_words_for_gaps_are_counted(tmp_path):
    (tmp_path / "s.csv").write_text(f"{HEAD}30,10,NA\n30,20,--\n30,30,0.07\n")
    with pytest.warns(ConventionWarning, match="'--', 'NA' count as not measured: 2 of 3"):
        scan = read_goniometer(tmp_path / "s.csv")
    notes = [finding.what for finding in check_scan(scan) if finding.name == "missing"]
    assert notes == ["readings that are missing: 2 of 3 of M00"]


@pytest.mark.parametrize(
    "text",
    [
        f"{HEAD}30,10,0.05,\n30,20,0.06\n30.5,30,0.07,,\n",
        f"{HEAD}30,10,0.05\n# lamp changed\n30,20,0.06\n  // note 2\n! x\n; y\n30.5,30,0.07\nEND\n",
        f"{HEAD}30,10,0.05\n\n{HEAD}30,20,0.06\n30.5,30,0.07\n",
        "theta_i_deg theta_view_deg M00\n30 10 0,05\n30 20 0,06\n30,5 30 0,07\n",
        "theta_i_deg theta_view_deg M00\n30,0 10,0 0,05\n30 20 0,06\n30,5 30 0,07\n",
        f"\ufeff\ufeff{HEAD}30,10,0.05\n\ufeff{HEAD}30,20,0.06\n30.5,30,0.07\n",
        "sep=;\ntheta_i_deg;theta_view_deg;M00\n30;10;0,05\n30;20;0,06\n30,5;30;0,07\n",
        'theta_i_deg,theta_view_deg,M00\n"30","10","0,05"\n"30","20","0,06"\n"30,5","30","0,07"\n',
        "theta_i,theta_view,M00\n30°,10°,.05\n30 °,20°,.06\n30.5°,30°,.07\n",
        "theta_i;theta_view;M00\n[º];[º];[sr⁻¹]\n30;10;.05\n30;20;.06\n30.5;30;.07\n",
        "theta_i_deg,theta_view_deg,M00,M00\n30,10,0.05,0.05\n30,20,0.06,0.06\n30.5,30,0.07,0.07\n",
        ",theta_i_deg,theta_view_deg,M00\n0,30,10,0.05\n1,30,20,0.06\n2,30.5,30,0.07\n",
        "Unnamed: 0,\u03b8_i [\u00b0],theta_view_deg,BRDF [sr\u207b\u00b9]\n4,30,10,0.05\n5,30,20,0.06\n6,30.5,30,0.07\n",
        "date;theta_i_deg;theta_view_deg;M00\n01.02.2024;30;10;0,05\n01.02.2024;30;20;0,06\n02.02.2024;30,5;30;0,07\n",
    ],
)
def test_ways_to_write_one_scan(tmp_path, text):
    scan = read(tmp_path, text)
    assert_allclose(np.degrees(scan.theta_i), [30, 30, 30.5])
    assert_allclose(np.degrees(scan.theta_s), [10, 20, 30])
    assert_allclose(scan.M00, [0.05, 0.06, 0.07])


def test_minus_signs_of_typesetting(tmp_path):
    scan = read(tmp_path, f"{HEAD}30,\u221210,0.05\n30,\u201320,0.06\n")
    assert_allclose(np.degrees(scan.theta_s), [10, 20])
    assert_array_equal(scan.dphi, [0, 0])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (f"{HEAD}30,10,<0.001\n", "line 2, column M00: .*'<0.001'. A limit is no reading"),
        (f"{HEAD}30,10,1'234\n", "without thousands marks"),
        ("theta_i_deg;theta_view_deg;M00\n30;10;1,234\n30;20;950\n", "decimal commas or thousands, got '1,234' for either"),
        ("theta_i_deg;theta_view_deg;M00\n30.0;10;0,05\n", "got '0,05' beside '30.0'"),
        ("theta_i_deg,theta_view_deg,M00,M10\n30,10,0,05\n30,20,0,06\n", "'05' stands behind a decimal one. Separate columns by semicolons"),
        (f"{HEAD}30,10,0.05\n# 450 nm\n30,20,0.06\n# 650 nm\n30,30,0.07\n", "line 5: expected one wavelength, .*450 nm, 650 nm.*column wavelength_nm"),
        (f"# p-polarised\n{HEAD}30,10,0.05\n# s-polarised\n30,20,0.06\n", "expected one polarisation"),
        (f"{HEAD}30,10,0.05\nWavelength 650\n30,20,0.06\n", "line 3: expected a row of numbers, got 'Wavelength 650'. Begin remarks with #"),
        (f"{HEAD}30,10,0.05\ntheta_i_deg,theta_view_deg,DOLP\n30,20,0.06\n", "line 3: expected a row of numbers.*another table"),
        ("theta_i_deg,theta_view_deg,pol,M00\n30,10,s,0.05\n30,10,p,0.04\n", "column pol: expected no polarisation by rows, got 's', 'p'. Give each polarisation a column"),
        ("theta_i_deg,theta_view_deg,pol,M00\n30,10,s,0.05\n30,20,s,0.04\n", "light of one polarisation: --columns NAME=I_s,pol=ignore"),
        ("theta_i_deg,theta_view_deg,sample,M00\n30,10,A,0.05\n30,10,B,0.04\n", "text of sample tells the rows apart"),
        ("theta_i_deg,theta_view_deg,450,550,650\n30,10,0.05,0.06,0.07\n", "--columns 450=M00_450nm,550=M00_550nm,650=M00_650nm"),
        ("theta_i_deg,theta_view_deg,M00\ndeg,deg,counts\n30,10,0.05\n", r"M00 \[counts\] is not in 1/sr: give --columns M00=M00 with --quantity relative"),
        ("theta_i_deg,theta_view_deg,M00,M00\n30,10,0.05,0.06\n", "expected one column of M00, found M00 too. Remove one, or give it a name"),
        ("theta_i_deg,theta_view_deg,M00,I_s\n30,10,0.05,0.03\n30,20,0.05,0.08\n", "line 3, column I_s: expected at most M00 = 0.05, got 0.08"),
        ("theta_i_deg;theta_view_deg;M00\n30,10,0.05\n", "expected cells that ';' separates, as it does the names, got '30,10,0.05'"),
        (f"{HEAD}1,0.5,0.05\n1,1,0.06\n", "Or give --angles rad; deg if they are so small"),
        ("theta_i_deg,theta_view_deg,M00,flag\n30,10,0.05,ok\n30,20,9.0,bad\n", "line 3, column flag: expected readings that all count, got 'ok' and 'bad'. Empty the cells"),
        ("theta_i_deg,theta_view_deg,M00,saturated\n30,10,0.05,\n30,20,9.0,yes\n", "line 3, column saturated: .*--columns saturated=ignore"),
        ("theta_i_mrad,theta_view_mrad,M00\n523,174,0.05\n", r"got 'theta_i_mrad', 'theta_view_mrad'\. Say what they hold"),
        ("theta_i_deg,theta_view_deg,counts\n30,10,500\n", "--columns counts=M00 with --quantity relative"),
        ("theta_i_deg,theta_view_deg,ARS\n30,10,0.05\n", "--columns ARS=M00 with --quantity brdf-cos"),
        ("theta_i_deg,theta_view_deg,R\n30,10,0.05\n", "--columns R=M00 with --quantity reflectance-factor"),
        ("theta_i_deg,theta_view_deg,Rs,Rp\n30,10,0.05,0.04\n", "--columns Rs=I_s; that of a source polarised so"),
        ("theta_i_deg,theta_view_deg,energy,M00\n30,10,1.96,0.05\n", "energy names no unit: head it energy_ev"),
        ("theta_i_deg,theta_view_deg,wavenumber,M00\n30,10,1.96,0.05\n", "wavenumber names no unit"),
        ("theta_i_deg,theta_view_deg,N,C,S\n30,10,0.1,0.1,0.1\n", "expected known columns, got 'N', 'C', 'S'"),
        (f"{HEAD}30,10,0.05\n30,20,9999\n30,30,0.07\n", "line 3, column M00: expected a reading, got 9999 beside at most 0.07"),
        (f"{HEAD}30,10,-1.5\n30,20,-1.4\n30,30,-1.2\n", "Of logarithms or decibels write the numbers themselves"),
        (f"{HEAD}30,10,950\n30,20,870\n30,30,1.050\n30,40,1.120\n", "expected decimals or thousands, got '1.050' beside '950'"),
        ("theta_i_deg,theta_view_deg,M00,\n30,10,0.05,7\n", "got 'column 4'"),
        ("theta_i_deg,theta_view_deg,M10,m10\n30,10,0.01,0.2\n", "expected one column of m10, found M10 too"),
        ("theta_i_deg,theta_view_deg,I0,I45,I90,I135,I0_stderr,I90_stderr\n30,10,3,2,1,2,0.1,0.1\n", "found no I45_stderr, I135_stderr. Give all four; .*I0_stderr=ignore,I90_stderr=ignore"),
    ],
)  # fmt: skip
def test_refusals_name_the_cure(tmp_path, text, message):
    with pytest.raises(DataFileError, match=message):
        read(tmp_path, text)


def test_wavelengths_over_columns_with_errors(tmp_path):
    head = (
        "theta_i_deg,theta_view_deg,M00_450nm,M00_450nm_stderr,M00_650nm,M00_stderr_650nm\n"
    )
    scan = read(tmp_path, f"{head}30,10,0.05,0.001,0.07,0.002\n")
    assert_allclose(scan.wavelength, [0.45, 0.65])
    assert_allclose(scan.M00_stderr, [0.001, 0.002])
    text = "theta_i_deg,theta_view_deg,450,550,650\n30,10,0.05,0.06,0.07\n"
    named = {f"{wave}": f"M00_{wave}nm" for wave in (450, 550, 650)}
    scan = read(tmp_path, text, columns=named)
    assert_allclose(scan.wavelength, [0.45, 0.55, 0.65])


def test_small_degrees_are_degrees_where_that_is_said(tmp_path):
    scan = read(tmp_path, f"{HEAD}1,0.5,0.05\n1,1,0.06\n", angles="deg")
    assert_allclose(np.degrees(scan.theta_s), [0.5, 1.0])


def test_the_wavelength_of_an_astm_header(tmp_path):
    text = "TITLE x\n{}\nVARS theta_i,phi_i,theta_s,phi_s,BRDF\n30,0,20,180,0.05\n"
    for line, wave in (("WAVELENGTH 633 nm", 0.633), ("Laser wavelength = 10.6 um", 10.6)):
        assert_allclose(read(tmp_path, text.format(line)).wavelength, wave)
    (tmp_path / "bare.txt").write_text(text.format("WAVELENGTH 0.633"))
    with pytest.warns(ConventionWarning, match=r"0\.633 names no unit and is left out"):
        assert "wavelength" not in read_goniometer(tmp_path / "bare.txt").coords


@pytest.mark.parametrize("number", ["9" * 1000, "2", "1e300"])
def test_a_wavelength_that_no_light_has_is_told(tmp_path, number):
    told = r"the wavelength .{1,45} is not between 0\.05 and 1000 um and is left out"
    path = tmp_path / "scan.csv"
    path.write_text(f"# wavelength: {number} nm\n{HEAD}30,10,0.05\n")
    with pytest.warns(ConventionWarning, match=told):
        assert "wavelength" not in read_goniometer(path).coords


def test_a_reading_far_above_its_neighbours_is_found(tmp_path):
    rows = "".join(f"30,{v},{5.0 if v == -20 else 0.05}\n" for v in range(-60, 61, 10))
    found = {one.name: one for one in check_scan(read(tmp_path, HEAD + rows))}
    assert found["spike"].severity == "warning"
    assert "5 at view -20 deg" in found["spike"].what
    lobe = "".join(f"30,{v},{5.0 if v == 30 else 0.05}\n" for v in range(-60, 61, 10))
    assert "spike" not in {one.name for one in check_scan(read(tmp_path, HEAD + lobe))}


def test_cosines_show_at_views_that_are_far_apart(tmp_path):
    cosine = {v: np.cos(np.radians(v)) for v in range(-60, 61, 15)}
    rows = "".join(f"{i},{v},{0.1 * c}\n" for i in (30, 60) for v, c in cosine.items())
    found = check_scan(read(tmp_path, HEAD + rows))[0]
    assert (found.name, found.severity) == ("reciprocity", "error")


def polarised(noise=0.0, rows=30, **wrong):
    """A table of light that columns tell in several ways, with a row of it changed."""
    rng = np.random.default_rng(1)
    view = np.linspace(-60, 60, rows)
    m00 = 0.05 + 0.2 * np.exp(-(((view - 30) / 15) ** 2))
    m10 = 0.3 * m00 * np.cos(np.radians(view)) ** 2
    table = {
        "M00": m00, "M10": m10, "I_s": (m00 + m10) / 2, "I_p": (m00 - m10) / 2,
        "m10": m10 / m00,
    }  # fmt: skip
    for name, column in table.items():
        scale = 1.0 if name == "m10" else m00
        table[name] = column + noise * scale * rng.standard_normal(rows)
    for name, (row, factor) in wrong.items():
        table[name][row] *= factor
    return view, table


def write(view, table, names, stderr=0.0):
    named = [*names, *(f"{name}_stderr" for name in names if stderr)]
    lines = [",".join(["theta_i_deg", "theta_view_deg", *named])]
    for k, angle in enumerate(view):
        cells = [30.0, angle, *(table[name][k] for name in names)]
        cells += [
            stderr * (1.0 if name == "m10" else table["M00"][k]) for name in names if stderr
        ]
        lines.append(",".join(f"{cell:.9g}" for cell in cells))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("names", "rule"),
    [
        (("M00", "I_s", "I_p"), r"M00: expected I_s \+ I_p = "),
        (("M10", "I_s", "I_p"), "M10: expected I_s - I_p = "),
        (("M00", "M10", "m10"), "M10: expected m10 M00 = "),
        (("I_s", "M00", "M10"), r"I_s: expected \(M00 \+ M10\)/2 = "),
        (("m10", "I_s", "I_p"), r"m10: expected \(I_s - I_p\)/\(I_s \+ I_p\) = "),
    ],
)
@pytest.mark.parametrize("noise", [0.0, 0.02])
@pytest.mark.parametrize("stated", [True, False])
def test_columns_that_contradict_each_other(tmp_path, names, rule, noise, stated):
    stderr = noise if stated else 0.0
    view, table = polarised(noise)
    read(tmp_path, write(view, table, names, stderr))
    # One slip in a row, and a wrong scale of all
    view, table = polarised(noise, **{names[0]: (7, 3.0)})
    with pytest.raises(DataFileError, match=f"line 9, column {rule}"):
        read(tmp_path, write(view, table, names, stderr))
    view, table = polarised(noise, **{names[0]: (slice(None), 1.8)})
    with pytest.raises(DataFileError, match=f"column {rule}.*rows differ"):
        read(tmp_path, write(view, table, names, stderr))


def test_light_that_columns_tell_twice_counts_once(tmp_path):
    view, table = polarised()
    table["I_p"][3] = np.nan
    scan = read(tmp_path, write(view, table, ("M00", "M10", "I_s", "I_p", "m10")))
    found = observe({"scan": scan})
    count = {name: int((found.name == name).sum()) for name in found.names}
    # Of the row without I_p the elements count, and I_s follows from them
    assert count == {"I_s": 29, "I_p": 29, "M00": 1, "M10": 1}
    scan = read(tmp_path, write(view, table, ("M00", "M10", "I_s")))
    assert set(observe({"scan": scan}).names) == {"M00", "M10"}


@pytest.mark.parametrize(
    ("name", "cures"),
    [
        ("BRF [1/sr]", ("BRF=reflectance-factor", "BRF=M00")),
        ("m10 [sr-1]", ("m10=m10", "m10=M10")),
    ],
)
def test_a_unit_that_belies_its_name_is_refused(tmp_path, name, cures):
    """Factors and ratios have no unit: BRF [1/sr] was divided by pi."""
    path = tmp_path / "scan.csv"
    path.write_text(
        f"theta_i_deg,theta_view_deg,M11,{name}\n30,10,.01,0.05\n30,20,.01,.06\n"
    )
    with pytest.raises(DataFileError, match="no unit by its name") as refused:
        read_goniometer(path)
    for cure in cures:
        assert cure in str(refused.value)
