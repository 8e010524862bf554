"""Readings known up to a factor, elements over M00, several wavelengths, dark readings."""

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

from fitting import Noise, fit
from pbrdf import Material, MicrofacetModel
from tests.fits.scans import VINYL, scan

GAINS = ("specular_gain", "diffuse_albedo")
START = MicrofacetModel(Material(1.53), slope_rms=0.3)
RATIO = "diffuse_albedo / specular_gain"


def relative(measurement, factor=1453.0):
    """The scan in the counts of a detector, declared as such."""
    return measurement.map(lambda values: factor * values).assign_attrs(quantity="relative")


def normalised(measurement):
    """Elements over M00, as an ellipsometer writes them, in lower case."""
    names = [name for name in measurement.data_vars if name != "M00"]
    return xr.Dataset({f"m{n[1:]}": measurement[n] / measurement.M00 for n in names})


def spectrum(albedos, **options):
    """One table of several wavelengths [um] that differ in their albedo."""
    scans = [
        scan(
            VINYL.with_parameters(diffuse_albedo=albedo), wavelength=wave, seed=k, **options
        )
        for k, (wave, albedo) in enumerate(albedos.items())
    ]
    return xr.concat(scans, "geometry")


@pytest.mark.parametrize("albedo", [0.13, 0.95])
def test_a_relative_scan_gives_ratio_and_slope_and_no_absolute_number(albedo):
    truth = VINYL.with_parameters(diffuse_albedo=albedo, specular_gain=0.4)
    result = fit(relative(scan(truth)), START, free=(*GAINS, "slope_rms"), noise="relative")
    assert_allclose(result.ratios[RATIO].value, albedo / 0.4, rtol=1e-9)
    assert_allclose(result.values["slope_rms"], 0.252, rtol=1e-9)
    assert set(result.values) == {*GAINS, "slope_rms", "scale"}
    for name in (*GAINS, "scale"):
        assert np.isinf(result.stderr[name])
    # What cannot be known may still not be impossible
    assert 0.0 <= result.values["diffuse_albedo"] <= 1.0
    assert_allclose(
        result.values["scale"] * result.values["specular_gain"], 0.4 * 1453.0, rtol=1e-9
    )
    (text,) = (w for w in result.warnings if "only a combination" in w)
    assert "an absolute albedo or gain needs a calibrated one" in text
    assert f"{RATIO} = " in result.summary()
    assert result.as_dict()["ratios"][RATIO]["value"] == result.ratios[RATIO].value


def test_a_factor_changes_nothing_that_a_relative_scan_can_know():
    noisy = scan(VINYL, noise=0.02, seed=4)
    one, other = (
        fit(relative(noisy, f), START, free=(*GAINS, "slope_rms")) for f in (1.0, 2e-5)
    )
    assert_allclose(one.chi2, other.chi2, rtol=1e-9)
    for key in ("value", "stderr", "low", "high"):
        first, second = (getattr(r.ratios[RATIO], key) for r in (one, other))
        assert_allclose(first, second, rtol=1e-6)
    # The absolute scan knows the same ratio
    both = fit(noisy, START, free=(*GAINS, "slope_rms"))
    expected = both.values["diffuse_albedo"] / both.values["specular_gain"]
    assert_allclose(one.ratios[RATIO].value, expected, rtol=1e-5)
    parts = np.array([1.0 / both.values[name] for name in GAINS[::-1]]) * [1.0, -1.0]
    covariance = both.covariance[:2, :2][::-1, ::-1]
    stderr = expected * np.sqrt(parts @ covariance @ parts)
    assert_allclose(one.ratios[RATIO].stderr, stderr, rtol=1e-4)


def test_each_relative_scan_has_its_own_factor_and_an_absolute_one_settles_the_rest():
    first, second = scan(VINYL), scan(VINYL, 55.0)
    scans = {"a": relative(first, 30.0), "b": relative(second, 7.0)}
    loose = fit(scans, START, noise="relative", free=(*GAINS, "slope_rms"))
    assert_allclose(loose.values["scale[a]"] / loose.values["scale[b]"], 30.0 / 7.0)
    assert np.isinf(loose.stderr["diffuse_albedo"])
    tied = fit(
        {"a": scans["a"], "b": second}, START, noise="relative", free=(*GAINS, "slope_rms")
    )
    expected = {"specular_gain": 0.8, "diffuse_albedo": 0.13, "scale[a]": 30.0}
    for name, value in expected.items():
        assert_allclose(tied.values[name], value, rtol=1e-8)
        assert np.isfinite(tied.stderr[name])


def test_a_held_gain_is_named_beside_what_depends_on_it():
    result = fit(relative(scan(VINYL)), START, ("diffuse_albedo", "slope_rms"),
                 noise="relative", fixed={"specular_gain": 0.8})  # fmt: skip
    assert_allclose(result.values["diffuse_albedo"], 0.13, rtol=1e-9)
    assert any("specular_gain is the 0.8 at which it is held" in w for w in result.warnings)


def test_elements_over_m00_are_ratios():
    exact = scan(VINYL, elements=("M00", "M10", "M11", "M22"))
    result = fit(normalised(exact), START, (*GAINS, "slope_rms", "n"), noise="relative")
    assert_allclose(result.ratios[RATIO].value, 0.13 / 0.8, rtol=1e-9)
    assert_allclose(result.values["slope_rms"], 0.252, rtol=1e-9)
    assert_allclose(result.values["n"], 1.53, rtol=1e-9)
    (text,) = (w for w in result.warnings if "only a combination" in w)
    assert "up to a common factor; fix one or add M00" in text
    # Beside M00 they determine everything
    both = normalised(exact).assign(M00=exact.M00)
    result = fit(both, START, (*GAINS, "slope_rms"), noise="relative")
    assert_allclose(list(result.values.values()), [0.8, 0.13, 0.252], rtol=1e-9)
    assert result.ratios == {}


def test_an_element_counts_once_in_whatever_form():
    exact = scan(VINYL, noise=0.01)
    again = exact.assign(m10=exact.M10 / exact.M00, DOLP=abs(exact.M10) / exact.M00)
    assert fit(again, START).dof == fit(exact, START).dof


def test_wavelengths_are_never_pooled():
    two = spectrum({0.45: 0.1, 0.65: 0.5})
    result = fit(two, START, free=(*GAINS, "slope_rms"), noise="relative")
    expected = {
        "specular_gain[0.45]": 0.8, "specular_gain[0.65]": 0.8,
        "diffuse_albedo[0.45]": 0.1, "diffuse_albedo[0.65]": 0.5, "slope_rms": 0.252,
    }  # fmt: skip
    assert set(result.values) == set(expected)
    for name, value in expected.items():
        assert_allclose(result.values[name], value, rtol=1e-9)
    assert result.models["0, 0.45"].diffuse_albedo == result.values["diffuse_albedo[0.45]"]
    assert result.models["0, 0.65"].diffuse_albedo == result.values["diffuse_albedo[0.65]"]
    # Those who know better may say so
    shared = fit(two, START, separate={"specular_gain": "nothing"}, noise="relative")
    assert "specular_gain" in shared.values
    assert "diffuse_albedo[0.65]" in shared.values


def test_wavelengths_fitted_together_equal_wavelengths_apart():
    two = spectrum({0.45: 0.1, 0.65: 0.5}, noise=0.02)
    together = fit(two, START)
    for wave in (0.45, 0.65):
        apart = fit(two.isel(geometry=np.flatnonzero(two.wavelength.values == wave)), START)
        for name in GAINS:
            label = f"{name}[{wave}]"
            assert_allclose(together.values[label], apart.values[name], rtol=1e-9)
            assert_allclose(together.stderr[label], apart.stderr[name], rtol=1e-9)


def test_relative_wavelengths_have_a_factor_each():
    two = spectrum({0.45: 0.1, 0.65: 0.5})
    lamp = xr.where(two.wavelength == 0.45, 20.0, 3.0)
    result = fit(relative(two, lamp), START, (*GAINS, "slope_rms"), noise="relative")
    for wave, albedo in {0.45: 0.1, 0.65: 0.5}.items():
        name = f"diffuse_albedo[{wave}] / specular_gain[{wave}]"
        assert_allclose(result.ratios[name].value, albedo / 0.8, rtol=1e-9)
    assert_allclose(result.values["scale[0.45]"] / result.values["scale[0.65]"], 20 / 3)


def test_readings_below_zero_are_kept():
    # A black surface after subtraction of the dark signal: half the readings are negative
    black = VINYL.with_parameters(diffuse_albedo=0.0)
    exact = scan(black, elements=("M00",))
    covered, kept = 0, True
    for seed in range(40):
        rng = np.random.default_rng(seed)
        measurement = exact + 0.004 * rng.standard_normal(exact.sizes["geometry"])
        measurement["M00_stderr"] = ("geometry", np.full(exact.sizes["geometry"], 0.004))
        result = fit(measurement, START.with_parameters(slope_rms=0.252))
        kept &= len(result.residuals) == exact.sizes["geometry"]
        estimate = result.estimates["diffuse_albedo"]
        covered += estimate.low <= 0.0 <= estimate.high
    assert kept
    assert float(measurement.M00.min()) < 0.0
    # Fewer than 33 of 40 occur by chance once in 10 000
    assert covered >= 33


def test_an_unknown_quantity_is_refused():
    measurement = scan(VINYL).assign_attrs(quantity="reflectance-factor")
    with pytest.raises(ValueError, match=r"attribute quantity 'brdf' or 'relative', got"):
        fit(measurement, VINYL)


def test_an_unnamed_wavelength_is_named_as_such():
    scans = [scan(VINYL, wavelength=0.55), scan(VINYL, 50.0)]
    result = fit(scans, VINYL, noise=Noise(relative=0.01))
    assert any("name no wavelength; they were taken as of the 0.55 um" in w
               for w in result.warnings)  # fmt: skip
