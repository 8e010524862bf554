"""Units in headers, rows and cells of tables: honoured, or refused with a cure that works."""

# One line a file: the tables are read across
# ruff: noqa: E501
import re
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

from data_io import ConventionWarning, read_goniometer
from pbrdf import materials
from pbrdf.errors import DataFileError

FACTOR = "reflectance-factor"


def read(tmp_path, head, rows=("30,-30,0.32", "30,30,1.2"), **more):
    path = tmp_path / "scan.csv"
    path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConventionWarning)
        return read_goniometer(path, **more)


def told(name):
    return f"theta_i_deg,theta_view_deg,{name}"


@pytest.mark.parametrize(
    ("head", "rows", "columns"),
    [
        (told("R [%]"), None, {"R": "M00"}),
        (told("R [%]"), None, {"R [%]": "M00"}),
        (told("R_percent"), None, {"R_percent": "M00"}),
        (told("R") + "\ndeg,deg,%", None, {"R": "M00"}),
        (told("R"), ("30,-30,0.32%", "30,30,1.2 %"), {"R": "M00"}),
        (told("Refl [%]"), None, {"Refl": FACTOR}),
        (told("BRDF [%]"), None, {}),
    ],
)
def test_per_cent_stays_per_cent_under_any_name(tmp_path, head, rows, columns):
    rows = {} if rows is None else {"rows": rows}
    scan = read(tmp_path, head, **rows, columns=columns, quantity=FACTOR)
    assert_allclose(scan.M00, np.array([0.0032, 0.012]) / np.pi, rtol=1e-12)


def test_per_cent_of_polarised_light(tmp_path):
    rows = ("30,-30,10,0.2", "30,30,20,0.5")
    scan = read(tmp_path, told("DoP [%],BRDF"), rows, columns={"DoP": "DOLP"})
    assert_allclose(scan.DOLP, [0.1, 0.2])
    scan = read(
        tmp_path, told("Rs [%],Rp [%]"), rows,
        columns={"Rs": "I_s", "Rp": "I_p"}, quantity=FACTOR,
    )  # fmt: skip
    assert_allclose(scan.I_s, np.array([0.1, 0.2]) / np.pi)


def options(message):
    """Return the mappings and quantities that a message names, as they are written."""
    pair = r"[^=,]+=[\w-]+"
    said = re.findall(
        rf"--columns ({pair}(?:,{pair})*)(?: with --quantity ([\w-]+))?", message
    )
    for pairs, quantity in said:
        mapping = dict(pair.rsplit("=", 1) for pair in pairs.split(","))
        yield mapping, quantity or None


@pytest.mark.parametrize(
    ("head", "row", "columns", "named"),
    [
        (told("BRDF [1/msr]"), "30,20,30", {"BRDF": "M00"}, "1/msr"),
        (told("BRDF [x 1000]"), "30,20,30", {"BRDF": "M00"}, "x 1000"),
        (told("S [V]"), "30,20,30", {"S": "M00"}, "V"),
        (told("S") + "\ndeg,deg,mV", "30,20,30", {"S": "M00"}, "mV"),
        (told("BRDF,L [A]"), "30,20,.1,5500", {"L": "wavelength_nm"}, "angstrom"),
        (told("BRDF,Laser [um]"), "30,20,.1,.55", {"Laser": "wavelength_nm"}, "um"),
        (told("BRDF,wavelength_nm") + "\ndeg,deg,1/sr,um", "30,20,.1,10.6", {}, "um"),
        ("theta_i_deg,theta_s_deg,RAA [rad],BRDF", "30,20,3,.1", {"RAA": "dphi_deg"}, "rad"),
        ("AOI_rad,theta_view_deg,BRDF", "0.5,20,.1", {"AOI_rad": "theta_i_deg"}, "rad"),
    ],
)  # fmt: skip
def test_a_mapping_that_contradicts_a_unit_is_refused(tmp_path, head, row, columns, named):
    with pytest.raises(DataFileError) as refused:
        read(tmp_path, head, [row], columns=columns)
    message = str(refused.value)
    assert f"[{named}]" in message
    cures = list(options(message))
    assert cures
    for mapping, quantity in cures:
        scan = read(tmp_path, head, [row], columns=mapping, quantity=quantity)
        if "10.6" in row:
            chosen = {"wavelength_um": 10.6, "wavelength_nm": 0.0106}[
                next(iter(mapping.values()))
            ]
            assert_allclose(scan.wavelength, chosen)
        elif "wavelength" in scan.coords:
            assert_allclose(scan.wavelength, 0.55)


@pytest.mark.parametrize(
    ("head", "row", "columns"),
    [
        ("AOI [steps],theta_view_deg,BRDF", "30,20,.1", {"AOI": "theta_i_deg"}),
        ("AOI [gon],theta_view_deg,BRDF", "30,20,.1", {"AOI": "theta_i_deg"}),
        (told("BRDF,half angle [mrad]"), "30,20,.1,9", {"half angle": "detector_half_angle_deg"}),
        (told("BRDF,err [%]"), "30,20,.03,2", {"err": "M00_stderr"}),
        (told("BRDF,err_pct"), "30,20,.03,2", {"err_pct": "M00_stderr"}),
        (told("BRDF [%]"), "30,20,3", {}),
        (told("R [%]"), "30,20,3", {"R": "M00"}),
        (told("DoP [1/msr],BRDF"), "30,20,.1,.1", {"DoP": "DOLP"}),
    ],
)  # fmt: skip
def test_a_unit_that_cannot_be_honoured_is_refused(tmp_path, head, row, columns):
    with pytest.raises(DataFileError, match=r"gon|steps|mrad|standard error|per cent|%"):
        read(tmp_path, head, [row], columns=columns)


def test_errors_in_per_cent_say_of_what(tmp_path):
    (tmp_path / "s.csv").write_text(told("BRF [%],BRF_stderr [%]") + "\n30,20,10,2\n")
    with pytest.warns(ConventionWarning, match="20 % of the middle reading"):
        scan = read_goniometer(tmp_path / "s.csv")
    assert_allclose(scan.M00_stderr, 0.02 / np.pi)
    read_goniometer(tmp_path / "s.csv", columns={"BRF_stderr": "ignore"})


def test_units_may_stand_in_names_and_below(tmp_path):
    head = "theta_i [deg],theta_view_deg,BRDF [1/sr],wavelength_nm\ndeg,°,sr^-1,nm"
    scan = read(tmp_path, head, ["30,20,.1,550"])
    assert_allclose(scan.wavelength, 0.55)
    assert_allclose(scan.M00, 0.1)


def test_names_with_brackets_are_mapped_as_they_stand(tmp_path):
    rows = ("30,-30,0.03,0.001", "30,30,0.1,0.002")
    with pytest.raises(DataFileError) as refused:
        read(tmp_path, told("BRDF,u(BRDF)"), rows)
    mapping, _ = next(options(str(refused.value)))
    assert mapping == {"u(BRDF)": "M00_stderr"}
    scan = read(tmp_path, told("BRDF,u(BRDF)"), rows, columns=mapping)
    assert_allclose(scan.M00_stderr, [0.001, 0.002])


def test_wavelengths_in_brackets_head_columns(tmp_path):
    scan = read(tmp_path, told("BRDF (450 nm),BRDF (0.55 um) [1/sr]"), ["30,20,.1,.2"])
    assert_allclose(scan.wavelength, [0.45, 0.55])
    assert_allclose(scan.M00, [0.1, 0.2])
    mapping = {"R (450 nm)": "M00_450nm"}
    scan = read(tmp_path, told("R (450 nm)"), ["30,20,.1"], columns=mapping)
    assert_allclose(scan.wavelength, 0.45)


def test_constants_may_repeat_their_unit_below(tmp_path):
    path = tmp_path / "constants.csv"
    path.write_text("wavelength_nm,n,k\nnm,-,-\n400,1.6,.1\n800,1.5,.2\n")
    assert_allclose(materials.read(path).index(0.8), (1.5, 0.2))
    path.write_text("wavelength_nm,n,k\num,-,-\n400,1.6,.1\n800,1.5,.2\n")
    with pytest.raises(DataFileError, match=r"wavelength_nm \[um\]"):
        materials.read(path)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("BRDF [per sr]", 0.5),
        ("BRDF [sr\u22121]", 0.5),
        ("BRDF (1 / steradian)", 0.5),
        ("BRF [percent]", 0.005 / np.pi),
        ("BRF (per cent)", 0.005 / np.pi),
    ],
)
def test_units_may_be_spelled(tmp_path, name, expected):
    assert_allclose(read(tmp_path, told(name), ["30,20,.5"]).M00, expected)


def test_per_cent_of_m00_is_a_ratio(tmp_path):
    row = ["30,20,.1,40"]
    with pytest.raises(DataFileError, match="of M00, --columns M10=m10") as refused:
        read(tmp_path, told("M00,M10 [%]"), row)
    (mapping, _) = next(options(str(refused.value)))
    assert_allclose(read(tmp_path, told("M00,M10 [%]"), row, columns=mapping).m10, 0.4)


@pytest.mark.parametrize("unit", ["a.u.", "1/msr", "1e-3/sr", "counts"])
def test_any_unit_is_taken_where_the_scale_is_unknown(tmp_path, unit):
    head = told(f"BRDF [{unit}]")
    with pytest.raises(DataFileError, match="BRDF=M00 with --quantity relative") as refused:
        read(tmp_path, head)
    mapping, quantity = next(options(str(refused.value)))
    scan = read(tmp_path, head, columns=mapping, quantity=quantity)
    assert_allclose(scan.M00, [0.32, 1.2])


@pytest.mark.parametrize("columns", [{}, {"BRDF": "M00"}])
def test_logarithms_have_no_scale_to_be_free_of(tmp_path, columns):
    with pytest.raises(DataFileError, match="write the numbers themselves"):
        read(tmp_path, told("BRDF [dB]"), columns=columns, quantity="relative")


@pytest.mark.parametrize("columns", [{}, {"M00": "M00"}])
def test_values_have_one_unit(tmp_path, columns):
    with pytest.raises(DataFileError, match=r"writes \[%\] and \[1/sr\]"):
        read(tmp_path, told("M00 [1/sr]") + "\ndeg,deg,%", columns=columns, quantity=FACTOR)


def test_errors_keep_their_name_in_a_cure(tmp_path):
    head, row = told("BRDF,BRF_stderr [1/sr]"), ["30,20,.1,.01"]
    with pytest.raises(DataFileError, match="BRF_stderr=M00_stderr with --quantity brdf"):
        read(tmp_path, head, row)
    scan = read(tmp_path, head, row, columns={"BRF_stderr": "M00_stderr"}, quantity="brdf")
    assert_allclose(scan.M00_stderr, 0.01)


# Of one wavelength and one angle: in this unit, with this number
WAVES = {
    "nm": 550.0,
    "um": 0.55,
    "µm": 0.55,
    "A": 5500.0,
    "eV": 1.239841984 / 0.55,
    "cm-1": 1e4 / 0.55,
}
TURNS = {
    "deg": 30.0,
    "rad": np.pi / 6,
    "gon": 100 / 3,
    "mrad": 1e3 * np.pi / 6,
    "grads": 100 / 3,
}


@pytest.mark.parametrize("form", ["X [{}]", "X ({})", "X_{}", "X/{}", "X {}", "below"])
@pytest.mark.parametrize(
    ("target", "unit", "right"),
    [
        *((t, u, 0.55) for u in WAVES for t in ("wavelength_nm", "wavelength_um", "energy_ev")),
        *((f"theta_i_{t}", u, np.pi / 6) for u in TURNS for t in ("deg", "rad")),
    ],
)  # fmt: skip
def test_no_mapping_changes_a_number(tmp_path, form, target, unit, right):
    """Every unit in every place under every target: the number is right, or refused."""
    angle = target.startswith("theta")
    name = "X" if form == "below" else form.format(unit)
    below = f"\n{unit},deg,1/sr" if form == "below" else ""
    value = TURNS[unit] if angle else WAVES[unit]
    head, row = f"{name},theta_view_deg,BRDF{below}", f"{value:.12g},20,.1"
    if not angle:
        head = f"{name},theta_i_deg,theta_view_deg,BRDF" + below.replace(",deg", ",deg,deg")
        row = f"{value:.12g},30,20,.1"
    try:
        scan = read(tmp_path, head, [row], columns={name: target})
    except DataFileError:
        assert not target.endswith(f"_{unit.lower()}")
    else:
        assert_allclose(scan.theta_i if angle else scan.wavelength, right, rtol=1e-9)


# Of a reflectance factor of 0.5: in this unit, with this number
SCALES = {"%": 50.0, "percent": 50.0, "‰": 500.0, "ppm": 5e5, "x 1000": 500.0, "10^-3": 500.0, "1e-2": 50.0, "1/msr": 5e-4, "mV": 38.5, "a.u.": 38.5}  # fmt: skip


@pytest.mark.parametrize("form", ["X [{}]", "X ({})", "X_{}", "X {}", "below"])
@pytest.mark.parametrize("unit", SCALES)
@pytest.mark.parametrize("target", ["M00", FACTOR, "I_s"])
def test_no_mapping_changes_a_reading(tmp_path, form, unit, target):
    name = "X" if form == "below" else form.format(unit)
    below = f"\ndeg,deg,{unit}" if form == "below" else ""
    declared = {} if target == FACTOR else {"quantity": FACTOR}
    row = f"30,20,{SCALES[unit]:.12g}"
    try:
        scan = read(tmp_path, told(name) + below, [row], columns={name: target}, **declared)
    except DataFileError:
        assert unit not in ("%", "percent")
    else:
        value = scan["M00" if target == FACTOR else target]
        assert_allclose(value, 0.5 / np.pi, rtol=1e-9)
