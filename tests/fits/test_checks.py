"""What a look at a scan finds: each slip with its option, and nothing in good scans."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

from data_io import read_goniometer, write_goniometer
from fitting import PhysicsError, check_scan, fit
from fitting.checks.curves import curves_of
from fitting.checks.energy import reflectance_bounds
from pbrdf import Material, MicrofacetModel
from pbrdf.cli import main

CASES = Path(__file__).parents[1] / "cases/optics"
MODEL = MicrofacetModel(
    Material(1.5), slope_rms=0.25, specular_gain=0.9, diffuse_albedo=0.4
)


def scan_of(model=MODEL, incidences=(30, 60), views=None, **more):
    """A scan in the plane of incidence, exact."""
    views = np.arange(-75, 76, 5) if views is None else views
    theta_i, view = (
        a.ravel() for a in np.meshgrid(np.radians(incidences), np.radians(views))
    )
    dphi = np.where(view > 0, np.pi, 0.0)
    brdf = model.brdf(theta_i, np.abs(view), dphi)
    data = {"M00": brdf[:, 0, 0], "M10": brdf[:, 1, 0]}
    coords = {"theta_i": theta_i, "theta_s": np.abs(view), "dphi": dphi} | more
    return xr.Dataset(
        {name: ("geometry", values) for name, values in data.items()},
        {name: ("geometry", values) for name, values in coords.items()},
    )


def names(scan, severity=("error", "warning")):
    return {finding.name for finding in check_scan(scan) if finding.severity in severity}


@pytest.mark.parametrize("slope", [0.05, 0.25, 0.5])
@pytest.mark.parametrize("albedo", [0.0, 0.4])
def test_a_good_scan_gives_no_error(slope, albedo):
    model = MicrofacetModel(Material(1.5), slope_rms=slope, diffuse_albedo=albedo)
    assert names(scan_of(model), ("error",)) == set()


def test_exchanged_sides_are_an_error_that_names_the_option():
    turned = scan_of()
    turned = turned.assign_coords(dphi=np.pi - turned.dphi)
    error = check_scan(turned)[0]
    assert (error.name, error.severity) == ("exchanged", "error")
    assert "--azimuth-of-forward 0" in error.cure
    with pytest.raises(PhysicsError, match=r"\[exchanged\].*--azimuth-of-forward 0"):
        fit(turned, MODEL)
    result = fit(turned, MODEL, accept=("exchanged",))
    assert any("brighter than the forward side" in warning for warning in result.warnings)
    with pytest.raises(ValueError, match="accept must name any of exchanged"):
        fit(turned, MODEL, accept=("everything",))


@pytest.mark.parametrize(
    ("factor", "option"), [(np.pi, "reflectance-factor"), (1000.0, "--quantity relative")]
)
def test_more_light_than_came(factor, option):
    bright = MicrofacetModel(Material(1.5), slope_rms=0.25, diffuse_albedo=0.9)
    scan = scan_of(bright)
    scan = scan.assign(M00=factor * scan.M00, M10=factor * scan.M10)
    error = check_scan(scan)[0]
    assert (error.name, error.severity) == ("energy", "error")
    assert option in error.cure
    assert "energy" not in names(scan.assign_attrs(quantity="relative"))


def test_bounds_of_the_reflectance_hold_a_known_one():
    # A Lambertian sample of albedo 0.6, in plane and over the hemisphere
    for out_of_plane in (False, True):
        theta_s = np.radians(np.arange(0, 90, 5.0))
        dphi = np.radians(np.arange(0, 360, 20.0)) if out_of_plane else np.array([0, np.pi])
        zenith, turn = (a.ravel() for a in np.meshgrid(theta_s, dphi))
        scan = xr.Dataset(
            {"M00": ("geometry", np.full(zenith.size, 0.6 / np.pi))},
            {
                "theta_i": ("geometry", np.full(zenith.size, 0.7)),
                "theta_s": ("geometry", zenith),
                "dphi": ("geometry", turn),
            },
        )
        (curve,) = curves_of(scan)
        low, middle = reflectance_bounds(curve)
        assert low <= 0.6 * (1 + 1e-6)
        assert_allclose(middle, 0.6, rtol=0.02 if out_of_plane else 0.15)


def test_polarisation_beyond_the_light():
    scan = scan_of()
    scan = scan.assign(M10=scan.M10.copy(data=scan.M10.values + 0.01 + scan.M00.values))
    error = check_scan(scan)[0]
    assert (error.name, error.severity) == ("polarisation", "error")
    assert "M10 exceeds M00" in error.what


def dark_scan(seed, stated):
    """A black surface: away from the lobe M00 and M10 are the noise of the instrument."""
    scan = scan_of(
        MicrofacetModel(Material(1.5, 0.2), slope_rms=0.05), views=np.arange(-75, 76, 2.5)
    )
    rng = np.random.default_rng(seed)
    noise = np.hypot(1e-3 * float(scan.M00.max()), 0.02 * scan.M00.values)
    for name in ("M00", "M10"):
        values = scan[name].values + rng.normal(0.0, noise)
        scan = scan.assign({name: ("geometry", values)})
        if stated:
            scan = scan.assign({f"{name}_stderr": ("geometry", noise)})
    return scan


@pytest.mark.parametrize("stated", [True, False])
def test_noise_may_take_an_element_beyond_a_dark_m00(tmp_path, stated):
    for seed in range(6):
        scan = dark_scan(seed, stated)
        assert (abs(scan.M10) > scan.M00).sum() > 10
        assert "polarisation" not in names(scan)
        write_goniometer(scan, tmp_path / "s.csv")
        again = read_goniometer(tmp_path / "s.csv")
        assert_allclose(again.M10, scan.M10)


@pytest.mark.parametrize("stated", [True, False])
def test_a_wrong_scale_shows_through_the_noise(stated):
    scan = dark_scan(3, stated)
    lit = 0.05 * float(scan.M00.max()) < scan.M00
    ratio = scan.assign(M10=(scan.M10 / scan.M00).where(lit, 0.3))
    (found,) = [f for f in check_scan(ratio) if f.name == "polarisation"]
    assert "standard errors beyond" in found.what
    assert ("estimated from the scatter" in found.what) is not stated
    # Beyond M00 by no more than 2 errors anywhere, but everywhere
    rng = np.random.default_rng(4)
    flat = scan_of(views=np.arange(-75, 76, 2.5))
    noise = np.full(flat.sizes["geometry"], 0.05)
    parts = {
        "M00": ("geometry", 0.2 + rng.uniform(-0.05, 0.05, noise.size)),
        "M10": ("geometry", 0.26 + rng.uniform(-0.05, 0.05, noise.size)),
    }
    errors = {f"{name}_stderr": ("geometry", noise) for name in ("M00", "M10") if stated}
    (found,) = [
        f for f in check_scan(flat.assign(**parts, **errors)) if f.name == "polarisation"
    ]
    assert re.search(
        "in the sum of 3[01] readings of one side, .* by .* errors", found.what
    )


def test_a_cosine_breaks_reciprocity_as_itself():
    scan = scan_of(incidences=(15, 30, 45, 60))
    assert "reciprocity" not in names(scan)
    error = check_scan(scan * np.cos(scan.theta_s))[0]
    assert (error.name, error.severity) == ("reciprocity", "error")
    assert "--quantity brdf-cos" in error.cure


@pytest.mark.parametrize("index", [Material(1.5), Material(1.4, 7.6)])
def test_a_lobe_polarised_along_p_is_doubted(index):
    scan = scan_of(MODEL.with_parameters(material=index))
    assert "s-and-p" not in names(scan)
    half = {"I_s": (scan.M00 + scan.M10) / 2.0, "I_p": (scan.M00 - scan.M10) / 2.0}
    ratio = scan.drop_vars("M10").assign(m10=-scan.M10 / scan.M00)
    swapped = scan.drop_vars(["M00", "M10"]).assign(I_s=half["I_p"], I_p=half["I_s"])
    # A metal hardly polarises: it cannot be told
    expected = index.kappa == 0.0
    for turned in (scan.assign(M10=-scan.M10), ratio, swapped):
        assert ("s-and-p" in names(turned)) == expected
    assert "s-and-p" not in names(swapped.assign(**half))


def test_a_scan_divided_by_its_peak_is_doubted():
    scan = scan_of()
    peak = scan / scan.M00.max()
    assert "scale" in names(peak, ("warning",)) - names(scan, ("warning",))
    assert "scale" not in names(peak.assign_attrs(quantity="relative"), ("warning",))


def test_limits_of_the_instrument_repeats_and_noise():
    scan = scan_of(
        MicrofacetModel(Material(1.5), slope_rms=0.15), views=np.arange(-75, 76, 2.5)
    )
    clipped = scan.assign(M00=scan.M00.clip(max=0.7 * float(scan.M00.max())))
    assert "saturation" in names(clipped) - names(scan)
    # A diffuse sample, of which the ceiling takes almost half
    diffuse = scan_of()
    clipped = diffuse.assign(M00=diffuse.M00.clip(max=1.18 * float(diffuse.M00.median())))
    assert "saturation" in names(clipped) - names(diffuse)
    # Neither is what was rounded to two digits, nor a curve without a peak
    for level in (diffuse.M00.round(2), 0.0 * diffuse.M00 + 0.3):
        assert "saturation" not in names(diffuse.assign(M00=level, M10=0.0 * level))
    floored = scan.assign(M00=scan.M00.clip(min=0.02 * float(scan.M00.max())))
    assert "floor" in names(floored)
    assert "duplicates" in names(xr.concat([scan, scan], "geometry")) - names(scan)
    rng = np.random.default_rng(3)
    flat = scan_of(views=np.arange(-75, 76, 2.0))
    noisy = flat.assign(
        M00=flat.M00 + xr.DataArray(rng.normal(0.0, 0.004, flat.M00.size), dims="geometry"),
        M00_stderr=("geometry", np.full(flat.sizes["geometry"], 0.0004)),
    )
    assert "noise" in names(noisy)
    assert "noise" not in names(noisy.assign(M00_stderr=10 * noisy.M00_stderr))


@pytest.mark.parametrize("slope", [0.01, 0.03, 0.1, 0.25])
@pytest.mark.parametrize("step", [1, 2.5, 5])
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_narrow_lobes_and_diffuse_wings_are_no_noise_and_no_floor(slope, step, noise):
    rng = np.random.default_rng(5)
    for albedo in (0.0, 0.05, 0.4):
        model = MicrofacetModel(Material(1.5), slope_rms=slope, diffuse_albedo=albedo)
        scan = scan_of(model, views=np.arange(-75, 76, step))[["M00"]]
        values = scan.M00 * (1.0 + noise * rng.standard_normal(scan.M00.size))
        stderr = 0.02 * scan.M00 + 1e-12 * float(scan.M00.max())
        scan = scan.assign(M00=values, M00_stderr=stderr)
        assert "noise" not in names(scan)
        if albedo:
            assert "floor" not in names(scan)
            loud = scan.M00 * (1.0 + 0.3 * rng.standard_normal(scan.M00.size))
            assert "noise" in names(scan.assign(M00=loud.clip(min=1e-9)))


@pytest.mark.parametrize("level", [1e-4, 0.02])
def test_a_lobe_that_is_cut_off_ends_in_a_floor(level):
    model = MicrofacetModel(Material(1.5), slope_rms=0.12)
    scan = scan_of(model, views=np.arange(-75, 76, 1.0))[["M00"]]
    assert "floor" in names(scan.assign(M00=scan.M00.clip(min=level * scan.M00.max())))
    # The same level as a base that shines through
    assert "floor" not in names(
        scan.assign(M00=(scan.M00 + 0.02 * scan.M00.max()).round(4))
    )


def test_a_weak_dolp_is_said_to_be_lifted_by_noise():
    scan = scan_of().drop_vars("M10")
    rng = np.random.default_rng(8)
    size = scan.sizes["geometry"]
    dolp = np.hypot(0.01 + rng.normal(0, 0.02, size), rng.normal(0, 0.02, size))
    scan = scan.assign(
        DOLP=("geometry", dolp), DOLP_stderr=("geometry", np.full(size, 0.02))
    )
    (finding,) = [f for f in check_scan(scan) if f.name == "dolp"]
    assert "signed Q/I" in finding.cure


def test_the_command_exits_by_what_it_finds(capsys):
    assert main(["check", str(CASES / "good.csv")]) == 0
    assert "Nothing contradicts physics" in capsys.readouterr().out
    assert main(["check", str(CASES / "flipped.csv")]) == 1
    assert "[exchanged]" in capsys.readouterr().out
    assert main(["check", str(CASES / "flipped.csv"), "--azimuth-of-forward", "0"]) == 0
    fitted = ["fit", str(CASES / "flipped.csv"), "--n", "1.5", "--slope-rms", "0.25"]
    assert main(fitted) == 2
    assert "--azimuth-of-forward 0" in capsys.readouterr().err
    assert main([*fitted, "--azimuth-of-forward", "0"]) == 0
    assert "0.8999" in capsys.readouterr().out


def test_rows_that_repeat_each_other_are_counted(tmp_path):
    lines = (CASES / "good.csv").read_text().splitlines()
    path = tmp_path / "twice.csv"
    path.write_text("\n".join([*lines, *lines[-2:]]) + "\n")
    scan = read_goniometer(path)
    assert scan.sizes == read_goniometer(CASES / "good.csv").sizes
    (finding,) = [f for f in check_scan(scan) if f.name == "repeated"]
    assert finding.what.endswith("count once: 2")
    assert not [f for f in check_scan(scan) if f.name == "duplicates"]


def test_numbers_stand_alone_on_standard_output(capsys, tmp_path):
    flipped = str(CASES / "flipped.csv")
    assert main(["check", str(CASES / "good.csv"), flipped, "--json", "-"]) == 1
    good, wrong = json.loads(capsys.readouterr().out)["scans"]
    assert (good["file"], wrong["file"]) == ("good.csv", "flipped.csv")
    (found,) = [f for f in wrong["findings"] if f["severity"] == "error"]
    assert found["name"] == "exchanged"
    assert "--azimuth-of-forward 0" in found["cure"]
    command = ["fit", flipped, "--n", "1.5", "--slope-rms", "0.25"]
    assert main([*command, "--azimuth-of-forward", "0", "--json", "-"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert abs(printed["parameters"]["specular_gain"]["value"] - 0.8999) < 2e-4
    # Or in a file, beside the words
    target = tmp_path / "fit.json"
    assert main([*command, "--azimuth-of-forward", "0", "--json", str(target)]) == 0
    assert "0.8999" in capsys.readouterr().out
    assert json.loads(target.read_text())["parameters"] == printed["parameters"]


def test_declared_cases_are_fitted_to_their_truth():
    factor = read_goniometer(CASES / "factor_pi_dark.csv", quantity="reflectance-factor")
    result = fit(factor, MODEL)
    assert_allclose(result.values["specular_gain"], 0.3, rtol=1e-5)
    assert_allclose(result.values["diffuse_albedo"], 0.05, rtol=1e-5)
    noisy = fit(read_goniometer(CASES / "negative_noise.csv"), MODEL)
    assert noisy.estimates["diffuse_albedo"].low == 0.0


def test_a_dolp_within_its_noise_does_not_bias_the_fit():
    """Weak polarisation read as a length is lifted by noise; the model allows for it."""
    truth = MicrofacetModel(Material(1.5), slope_rms=0.3, diffuse_albedo=0.7)
    scan = scan_of(truth, incidences=(45,), views=np.arange(-60, 61, 4))
    ratio = (scan.M10 / scan.M00).values
    rng, noise, found = np.random.default_rng(11), 0.05, []
    for _ in range(40):
        light = ratio + rng.normal(0, noise, ratio.size)
        dolp = np.hypot(light, rng.normal(0, noise, ratio.size))
        noisy = scan.drop_vars("M10").assign(
            DOLP=("geometry", dolp), DOLP_stderr=("geometry", np.full(dolp.size, noise))
        )
        found.append(fit(noisy, truth, free=("diffuse_albedo",), use=("DOLP",)))
    values = np.array([result.values["diffuse_albedo"] for result in found])
    # Without Rice's mean the fits give 0.61, eight standard errors low
    assert abs(values.mean() - 0.7) < 3.5 * values.std(ddof=1) / np.sqrt(values.size)
