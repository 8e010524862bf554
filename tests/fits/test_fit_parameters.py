"""More free parameters: recovery by both solvers, scans together, apertures, warnings."""

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

from fitting import Aperture, Noise, compare, f_test, fit, profile_likelihood
from fitting.models.analytic import AnalyticModel
from fitting.objective.forward import Layout, predict
from fitting.readings.aperture import cones_of
from fitting.readings.masks import blocked_detector, saturated, zeros
from fitting.readings.observations import observe
from fitting.result.likelihood import allowed_rise
from pbrdf import Material, MicrofacetModel
from tests.fits.scans import VINYL, scan

GAINS = ("specular_gain", "diffuse_albedo")
METAL = MicrofacetModel(
    Material(1.6, 0.5), slope_rms=0.2, specular_gain=0.8, diffuse_albedo=0.13
)
START = MicrofacetModel(Material(1.4), slope_rms=0.3)


def wide(model, **options):
    """Two incidences, four elements: everything the isotropic model has is determined."""
    elements = ("M00", "M10", "M22", "M23")
    return [scan(model, theta_i=t, elements=elements, **options) for t in (25.0, 60.0)]


@pytest.mark.parametrize(
    ("changes", "free"),
    [
        ({}, (*GAINS, "n", "kappa", "slope_rms")),
        ({"shadowing": "maxwell-beard", "shadow_omega": 0.9, "shadow_tau": 0.4},
         (*GAINS, "slope_rms", "shadow_omega", "shadow_tau")),
        ({"diffuse_albedo": 0.0, "volume_albedo": 0.3, "volume_depolarization": 0.6},
         ("specular_gain", "volume_albedo", "volume_depolarization")),
        ({"grazing_albedo": 0.05}, (*GAINS, "grazing_albedo")),
    ],
    ids=["optics", "shadowing", "volume", "grazing"],
)  # fmt: skip
@pytest.mark.parametrize("solver", ["casadi", "nlopt"])
def test_noise_free_scans_give_the_truth(changes, free, solver):
    truth = METAL.with_parameters(**changes)
    rules = {k: v for k, v in changes.items() if k in ("shadowing", "slope_rms")}
    start = METAL.with_parameters(**rules)
    measurement = wide(truth, step=5.0)
    result = fit(
        measurement, start, free, {"n": (1.0, 3.0)}, solver, noise=Noise(relative=0.01),
        fixed={} if "diffuse_albedo" in free else {"diffuse_albedo": 0.0},
    )  # fmt: skip
    assert result.converged, result.status
    expected = AnalyticModel(truth, split_slope="slope_rms_x" in free)
    present = expected.values(result.problem.observations.geometry)
    for name in free:
        assert_allclose(result.values[name], present[name][0], rtol=1e-6, err_msg=name)


@pytest.mark.parametrize("solver", ["casadi", "nlopt"])
def test_slopes_of_both_axes_need_two_sample_azimuths(solver):
    truth = METAL.with_parameters(slope_rms=(0.15, 0.3))
    start = METAL.with_parameters(slope_rms=(0.2, 0.2))
    free = (*GAINS, "slope_rms_x", "slope_rms_y")
    along = scan(truth, step=5.0)
    one = fit(along, start, free=free, solver=solver, noise=Noise(relative=0.01))
    assert np.isinf(one.stderr["slope_rms_y"])
    assert np.isfinite(one.stderr["slope_rms_x"])
    assert any(
        w.startswith("only a combination of specular_gain and slope_rms_y")
        for w in one.warnings
    )
    across = scan(truth, step=5.0, phi_i=1.2)
    both = fit([along, across], start, free=free, solver=solver, noise=Noise(relative=0.01))
    assert_allclose(list(both.values.values()), [0.8, 0.13, 0.15, 0.3], rtol=1e-6)
    assert both.model.slope_rms == (both.values["slope_rms_x"], both.values["slope_rms_y"])


def test_both_solvers_reach_one_minimum_on_noisy_data():
    measurement = wide(METAL, noise=0.03, seed=5)
    free = (*GAINS, "n", "kappa", "slope_rms")
    first, second = (
        fit(measurement, START, free=free, solver=s) for s in ("casadi", "nlopt")
    )
    for name in free:
        assert_allclose(first.values[name], second.values[name], rtol=1e-6)
        pull = (first.values[name] - fit_truth(name)) / first.stderr[name]
        assert abs(pull) < 4.0, name
    assert_allclose(first.covariance, second.covariance, rtol=1e-4)


def fit_truth(name):
    return {"n": 1.6, "kappa": 0.5}.get(name) or getattr(METAL, name)


def test_prediction_equals_the_compiled_model():
    measurement = scan(METAL, elements=("M00", "M10", "M20", "M22", "M23"), dphi_offset=0.4)
    truth = AnalyticModel(METAL)
    readings = observe({"0": measurement})
    layout = Layout.of(("n",), readings)
    found = predict(truth, readings, layout).function([1.6]).full().ravel()
    assert_allclose(found, readings.value, rtol=1e-12, atol=1e-15)


def test_jacobian_equals_differences_of_the_compiled_model():
    measurement = scan(METAL, elements=("M00", "M10", "M23"))
    readings = observe({"0": measurement})
    free = ("n", "kappa", "slope_rms", "specular_gain")
    layout = Layout.of(free, readings)
    point = np.array([1.6, 0.5, 0.2, 0.8])
    jacobian = predict(AnalyticModel(METAL), readings, layout).jacobian(point).full()
    step = 1e-6
    for i in range(len(free)):
        sides = []
        for sense in (1.0, -1.0):
            p = point.copy()
            p[i] += sense * step
            model = MicrofacetModel(
                Material(p[0], p[1]), p[2], specular_gain=p[3], diffuse_albedo=0.13
            )
            sides.append(observe({"0": scan(model, elements=("M00", "M10", "M23"))}).value)
        slope = (sides[0] - sides[1]) / (2 * step)
        assert_allclose(jacobian[:, i], slope, rtol=1e-6, atol=1e-8)


def test_scans_share_some_parameters_and_not_others():
    bright = METAL.with_parameters(specular_gain=1.2)
    scans = {
        "a": scan(METAL, noise=0.01, seed=1),
        "b": scan(bright, 50.0, noise=0.01, seed=2),
    }
    start = MicrofacetModel(Material(1.6, 0.5), slope_rms=0.25)
    free = (*GAINS, "slope_rms")
    result = fit(scans, start, free=free, separate=["specular_gain"])
    assert set(result.values) == {
        "specular_gain[a]", "specular_gain[b]", "diffuse_albedo", "slope_rms",
    }  # fmt: skip
    truth = {"specular_gain[a]": 0.8, "specular_gain[b]": 1.2, "slope_rms": 0.2}
    for name, value in truth.items():
        assert abs(result.values[name] - value) < 4 * result.stderr[name]
    assert result.models["a"].specular_gain == result.values["specular_gain[a]"]
    assert result.models["b"].specular_gain == result.values["specular_gain[b]"]
    assert result.models["b"].slope_rms == result.values["slope_rms"]


def test_separate_scans_fitted_together_equal_fits_apart():
    scans = {
        "a": scan(METAL, noise=0.02, seed=1),
        "b": scan(METAL, 50.0, noise=0.02, seed=2),
    }
    start = MicrofacetModel(Material(1.6, 0.5), slope_rms=0.2)
    together = fit(scans, start, separate=GAINS)
    for label, one in scans.items():
        apart = fit(one, start)
        for name in GAINS:
            assert_allclose(
                together.values[f"{name}[{label}]"], apart.values[name], rtol=1e-9
            )
            assert_allclose(
                together.stderr[f"{name}[{label}]"], apart.stderr[name], rtol=1e-9
            )


def test_an_index_for_each_wavelength():
    table = Material.from_table(wavelength=[0.4, 0.8], n=[1.7, 1.5])
    truth = MicrofacetModel(table, slope_rms=0.2, diffuse_albedo=0.1)
    scans = [
        scan(truth, noise=0.01, seed=i, wavelength=w) for i, w in enumerate((0.4, 0.8))
    ]
    start = MicrofacetModel(Material(1.6), slope_rms=0.2, diffuse_albedo=0.1)
    result = fit(scans, start, free=("n", "diffuse_albedo"), separate={"n": "wavelength"})
    for label, value in {"n[0.4]": 1.7, "n[0.8]": 1.5}.items():
        assert abs(result.values[label] - value) < 4 * result.stderr[label]
    # The tabulated material as it is, where n is not free
    fixed = fit(scans, truth, free=("diffuse_albedo",))
    assert fixed.p_value > 1e-3


def test_goniometer_scale_and_background():
    measurement = scan(METAL, elements=("M00", "M10"))
    measurement["M00"] = 1.1 * measurement.M00 + 0.02
    measurement["M10"] = 1.1 * measurement.M10
    result = fit(measurement, METAL, free=("scale", "background"), noise="absolute")
    assert_allclose([result.values["scale"], result.values["background"]], [1.1, 0.02])
    assert result.solver == "casadi/daqp"


def test_scale_and_gains_together_are_one_too_many():
    result = fit(scan(VINYL, noise=0.02), VINYL, free=(*GAINS, "scale"))
    assert np.isinf(list(result.stderr.values())).all()
    assert any(
        w.startswith("only a combination of specular_gain, diffuse_albedo and scale")
        for w in result.warnings
    )


def test_strong_correlation_is_named_with_a_cure():
    result = fit(scan(METAL, noise=0.02), METAL, free=(*GAINS, "n", "kappa"))
    (text,) = (w for w in result.warnings if "correlated" in w)
    assert text.startswith("n and kappa are 9")
    assert "or add M2" in text
    # Taking the advice helps
    advised = text.split()[-1]
    better = fit(scan(METAL, noise=0.02, elements=("M00", "M10", advised)), METAL,
                 free=(*GAINS, "n", "kappa"))  # fmt: skip
    assert better.stderr["kappa"] < 0.5 * result.stderr["kappa"]


def test_polarised_intensities_are_combinations_of_elements():
    matrix = scan(METAL, elements=("M00", "M01", "M10", "M11"))
    m00, m01, m10, m11 = (matrix[name] for name in ("M00", "M01", "M10", "M11"))
    # Stokes (1, +-1, 0, 0) in, analyser row (1, +-1, 0, 0)/2 out
    data = {
        "f_ss": 0.5 * (m00 + m01 + m10 + m11),
        "f_sp": 0.5 * (m00 - m01 + m10 - m11),
        "f_ps": 0.5 * (m00 + m01 - m10 - m11),
        "f_pp": 0.5 * (m00 - m01 - m10 + m11),
        "I_s": 0.5 * (m00 + m10),
        "I_p": 0.5 * (m00 - m10),
    }
    start = MicrofacetModel(Material(1.6, 0.5), slope_rms=0.2)
    for names in (["I_s", "I_p"], ["f_ss", "f_pp"], ["f_sp", "f_ps", "f_ss"]):
        measurement = xr.Dataset({name: data[name] for name in names})
        result = fit(measurement, start, noise="absolute")
        assert_allclose(list(result.values.values()), [0.8, 0.13], rtol=1e-7)


def test_masks_leave_out_what_they_name():
    measurement = scan(VINYL, noise=0.01, seed=3)
    view = np.rad2deg(np.where(measurement.dphi > 1, 1, -1) * measurement.theta_s)
    shaded = np.abs(view + 30.0) < 4.0
    measurement["M00"] = measurement.M00.where(~shaded, 0.01)
    measurement["M10"] = measurement.M10.where(view < 70.0, 0.0)
    peak = float(measurement.M00.max())
    wrong = fit(measurement, VINYL)
    result = fit(measurement, VINYL, mask=[blocked_detector(np.deg2rad(4.5)), zeros()])
    assert result.p_value > 1e-3 > wrong.p_value
    n_shaded, n_zero = int(shaded.sum()), int((view >= 70.0).sum())
    assert len(result.residuals) == len(wrong.residuals) - 2 * n_shaded - n_zero
    cut = fit(measurement, VINYL, mask=saturated(peak))
    assert len(cut.residuals) == len(wrong.residuals) - 2


def test_robust_loss_resists_outliers():
    measurement = scan(VINYL, noise=0.02, seed=8)
    measurement["M00"][{"geometry": [5, 20, 41]}] *= 2.0
    plain, robust = (fit(measurement, VINYL, loss=loss) for loss in ("linear", "cauchy"))
    pulls = {
        key: abs(result.values["diffuse_albedo"] - 0.13) / result.stderr["diffuse_albedo"]
        for key, result in {"plain": plain, "robust": robust}.items()
    }
    assert pulls["robust"] < 3.0 < pulls["plain"]


def test_robust_standard_errors_have_the_efficiency_of_the_textbook():
    # Huber at 1.345 and Cauchy at 2.385 lose 5 % of the efficiency on Gaussian noise
    measurement = scan(VINYL, noise=0.02, seed=8, step=0.25)
    plain = fit(measurement, VINYL)
    for loss in ("huber", "cauchy"):
        robust = fit(measurement, VINYL, loss=loss)
        for name in GAINS:
            ratio = (robust.stderr[name] / plain.stderr[name]) ** 2
            assert_allclose(ratio, 1 / 0.95, rtol=0.05)


def test_aperture_average_equals_a_dense_average():
    # In plane, M00 only: no frame turns. Average over the detector cone by brute force
    half = np.deg2rad(4.0)
    narrow = MicrofacetModel(Material(1.5), slope_rms=0.05)
    measurement = scan(narrow, elements=("M00",), step=5.0)
    readings = observe({"0": measurement})
    layout = Layout.of(("specular_gain",), readings)
    cones = cones_of(readings.geometry, Aperture(detector=half))
    level = np.full(readings.geometry.size, 4)
    fine = cones.at(np.arange(level.size), level)
    through = predict(AnalyticModel(narrow), readings, layout, cones=fine)
    rng = np.random.default_rng(0)
    k = 21
    theta, dphi = readings.geometry.theta_s[k], readings.geometry.dphi[k]
    radius = np.tan(half) * np.sqrt(rng.random(200_000))
    around = 2 * np.pi * rng.random(200_000)
    axis = np.array(
        [np.sin(theta) * np.cos(dphi), np.sin(theta) * np.sin(dphi), np.cos(theta)]
    )
    first = np.cross([0.0, 0.0, 1.0], axis) / np.sin(theta)
    second = np.cross(axis, first)
    cone = axis + radius[:, None] * (
        np.cos(around)[:, None] * first + np.sin(around)[:, None] * second
    )
    cone /= np.linalg.norm(cone, axis=1, keepdims=True)
    value = narrow.brdf(
        readings.geometry.theta_i[k],
        np.arccos(cone[:, 2]),
        np.arctan2(cone[:, 1], cone[:, 0]),
    )[:, 0, 0]
    dense = (value * cone[:, 2]).sum() / cone[:, 2].sum()
    found = through.function([1.0]).full().ravel()[k]
    point = measurement.M00.values[k]
    assert abs(dense - point) > 0.01 * point
    assert_allclose(found, dense, rtol=2e-3)


def test_aperture_at_the_zenith_keeps_the_polarisation_of_its_axis():
    # Meridian frames spin by 2 pi across a cone about the zenith; the analyser does not.
    # The reading tends to that of a narrow cone just beside the zenith.
    sample = MicrofacetModel(Material(1.5), slope_rms=0.25)
    coords = {name: ("geometry", [value]) for name, value in
              (("theta_i", 0.7), ("theta_s", 0.0), ("dphi", np.pi))}  # fmt: skip
    measurement = xr.Dataset(
        {n: ("geometry", [0.1]) for n in ("M00", "M10")}, coords=coords
    )
    readings = observe({"0": measurement})
    layout = Layout.of(("specular_gain",), readings)
    axis = predict(AnalyticModel(sample), readings, layout)
    cone = predict(
        AnalyticModel(sample),
        readings,
        layout,
        cones=cones_of(readings.geometry, Aperture(detector=0.02, source=0.01)),
    )
    assert_allclose(cone.function([1.0]).full(), axis.function([1.0]).full(), rtol=5e-3)


@pytest.mark.slow
def test_global_search_leaves_a_wrong_start():
    truth = MicrofacetModel(Material(1.2, 4.0), slope_rms=0.2, specular_gain=0.7)
    measurement = wide(truth, noise=0.01, seed=2, step=5.0)
    start = MicrofacetModel(Material(5.0, 0.01), slope_rms=1.5, specular_gain=3.0)
    free = ("specular_gain", "n", "kappa", "slope_rms")
    result = fit(measurement, start, free=free, search="multistart", seed=1)
    assert result.p_value > 1e-3
    for name, value in {"n": 1.2, "kappa": 4.0, "slope_rms": 0.2}.items():
        assert abs(result.values[name] - value) < 4 * result.stderr[name]


def test_profile_of_a_linear_parameter_is_its_symmetric_interval():
    result = fit(scan(VINYL, noise=0.02, seed=1), VINYL)
    for name in GAINS:
        found = profile_likelihood(result, name)
        half = 1.959964 * result.stderr[name]
        value = result.values[name]
        assert_allclose([found.low, found.high], [value - half, value + half], rtol=1e-4)
        assert not found.low_open
        assert not found.high_open


def test_profile_leaves_open_what_the_data_leave_open():
    # Beside n, the in-plane scan of a dielectric cannot tell kappa from 0
    result = fit(scan(VINYL, noise=0.02, seed=1), VINYL, free=(*GAINS, "n", "kappa"))
    found = profile_likelihood(result, "kappa")
    assert found.low_open
    assert found.low == 0.0
    assert 0.0 < found.high < 1.0
    # Near the bound less rise is allowed than the square of the quantile
    end = np.argmin(np.abs(found.points - found.high))
    assert allowed_rise(0.0) < found.rise[end] <= 1.01 * allowed_rise(10.0)
    # and the result says so unasked
    estimate = result.estimates["kappa"]
    assert (estimate.low, estimate.high) == (0.0, found.high)
    assert "0 (open) .. 0." in result.summary()
    assert result.as_dict()["parameters"]["kappa"]["low_open"]
    assert not result.as_dict()["parameters"]["n"]["low_open"]


@pytest.mark.parametrize("truth", [0.05, 0.4, 1.1, 1.9, 4.0])
def test_the_rise_allowed_near_a_bound_covers_as_stated(truth):
    # A reading with unit error of a number that cannot be negative
    rng = np.random.default_rng(8)
    reading = truth + rng.standard_normal(400_000)
    best = np.maximum(reading, 0.0)
    rise = (reading - truth) ** 2 - (reading - best) ** 2
    covered = (rise <= allowed_rise(truth)).mean()
    # 400 000 readings know 95 % to 0.034 %
    assert abs(covered - 0.95) < 4 * np.sqrt(0.95 * 0.05 / 4e5)
    assert abs((rise <= allowed_rise(truth, 0.8)).mean() - 0.8) < 0.0026


def test_a_kappa_of_zero_has_a_standard_error():
    # Exact readings of a dielectric: kappa lies at 0, where no element has a slope in it
    elements = ("M00", "M10", "M22")
    measurement = wide(VINYL, step=5.0)
    options = {"use": elements, "noise": Noise(relative=0.02)}
    result = fit(measurement, VINYL, free=(*GAINS, "n", "kappa"), **options)
    assert result.values["kappa"] < 1e-3
    stderr = result.stderr["kappa"]
    assert 0.01 < stderr < 0.5
    # One standard error of its square costs one unit of chi2
    held = fit(measurement, VINYL, (*GAINS, "n"), fixed={"kappa": stderr}, **options)
    assert held.chi2 - result.chi2 == pytest.approx(1.0, rel=0.2)
    assert np.isfinite(result.covariance).all()


def test_comparison_prefers_the_true_model():
    measurement = scan(VINYL, noise=0.02, seed=6)
    fits = {
        "both": fit(measurement, VINYL),
        "specular only": fit(measurement, VINYL, free=("specular_gain",),
                             fixed={"diffuse_albedo": 0.0}),
        "with slope": fit(measurement, VINYL, free=(*GAINS, "slope_rms")),
    }  # fmt: skip
    rows = {row.name: row for row in compare(fits)}
    assert rows["specular only"].aic > 100.0
    assert rows["with slope"].aic < 3.0
    assert f_test(fits["specular only"], fits["both"]).p_value < 1e-12
    assert_allclose(sum(row.weight for row in rows.values()), 1.0)


@pytest.mark.slow
def test_f_test_rejects_a_true_model_as_often_as_it_says():
    p_values = []
    for seed in range(60):
        measurement = scan(VINYL, noise=0.02, seed=seed, step=5.0)
        smaller = fit(measurement, VINYL)
        larger = fit(measurement, VINYL, free=(*GAINS, "slope_rms"))
        p_values.append(f_test(smaller, larger).p_value)
    # Uniform: a Kolmogorov distance of 1.63 / sqrt(60) occurs once in 100
    distance = np.abs(np.sort(p_values) - (np.arange(60) + 0.5) / 60).max()
    assert distance < 0.21


def test_failure_is_a_result_with_a_reason():
    measurement = scan(VINYL, noise=0.02)

    class Broken(AnalyticModel):
        def mueller(self, values, geometry, elements):
            return np.nan * super().mueller(values, geometry, elements)

    broken = Broken(VINYL)
    for free in (("specular_gain",), ("specular_gain", "n")):
        result = fit(measurement, broken, free=free)
        assert not result.converged
        assert result.status == "stopped: the curve is not finite at the start"
        assert np.isnan(list(result.stderr.values())).all()
        assert "no minimum was found" in result.warnings[0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"free": ("specular_gian",)}, "free must name parameters, got 'specular_gian'"),
        ({"free": ()}, "free must name at least one parameter"),
        ({"free": ("n", "n")}, "free must name each parameter once"),
        ({"solver": "scipy"}, "solver must be one of casadi, nlopt, got 'scipy'"),
        ({"bounds": {"slope_rms": (0.2, 0.1)}, "free": ("slope_rms",)},
         "bounds of slope_rms must have low <= high"),
        ({"priors": {"slope_rms": (0.2, -1.0)}}, r"must be \(value, stderr > 0\)"),
        ({"separate": ("n",)}, "separate must name free parameters, got 'n'"),
        ({"use": ["M44"]}, "use must name observables, got 'M44'"),
        ({"noise": "gaussian"}, "noise must be a Noise, 'relative', 'absolute' or None"),
        ({"loss": "l1"}, "loss must be one of linear, huber, soft_l1, cauchy, got 'l1'"),
        ({"search": "random"}, "search must be one of multistart, crs, mlsl"),
        ({"mask": lambda scan: np.zeros(scan.sizes["geometry"], bool)},
         "measurement must hold numbers"),
    ],
)  # fmt: skip
def test_wrong_arguments_are_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        fit(scan(VINYL, noise=0.02), VINYL, **arguments)


def test_angles_in_degrees_are_refused():
    measurement = scan(VINYL, noise=0.02)
    measurement.coords["theta_s"] = np.rad2deg(measurement.theta_s)
    with pytest.raises(ValueError, match=r"Angles are radians; use np\.deg2rad"):
        fit(measurement, VINYL)


def test_a_scan_that_is_no_dataset_is_refused():
    with pytest.raises(TypeError, match=r"measurement must be an xarray\.Dataset"):
        fit(np.zeros(3), VINYL)


def test_noise_must_be_stated_sensibly():
    with pytest.raises(ValueError, match="noise must be >= 0 and not both 0"):
        Noise(relative=-0.1)
