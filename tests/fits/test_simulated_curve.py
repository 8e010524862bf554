"""The simulated curve: reading of the bins, and what fits to it recover."""

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

from fitting.fit import fit
from fitting.pipeline import with_simulation_error
from fitting.simulated_curve import SimulatedCurve, interpolate_bins
from pbrdf import Material, MicrofacetModel

THETA_I = 0.55
MODEL = MicrofacetModel(Material(1.45, 0.3), slope_rms=0.3)


def bins(n_theta: int = 60) -> tuple[np.ndarray, np.ndarray]:
    theta = (np.arange(n_theta) + 0.5) * (0.5 * np.pi / n_theta)
    return theta, np.arange(2 * n_theta) * (np.pi / n_theta)


def simulated(model: MicrofacetModel = MODEL, n_theta: int = 60) -> xr.Dataset:
    """What a simulation without noise could hold: the model, brighter near grazing."""
    theta, dphi = bins(n_theta)
    brdf = model.brdf(THETA_I, theta[:, None], dphi[None, :])
    brdf = brdf * (1.0 + 0.2 * np.sin(theta)[:, None, None, None])
    dims = ("theta_i", "theta_s", "dphi", "stokes_out", "stokes_in")
    return xr.Dataset(
        {"brdf_total": (dims, brdf[None]), "brdf_total_stderr": (dims, 0.01 * brdf[None])},
        coords={"theta_i": [THETA_I], "theta_s": theta, "dphi": dphi,
                "stokes_out": list("IQUV"), "stokes_in": list("IQUV")},
    )  # fmt: skip


def scan(curve: SimulatedCurve, noise: float) -> xr.Dataset:
    view = np.deg2rad(np.arange(-70.0, 71.0, 3.0))
    theta_s, dphi = np.abs(view), np.where(view > 0.0, np.pi, 0.0)
    brdf = curve.brdf(np.full(view.size, THETA_I), theta_s, dphi)
    rng = np.random.default_rng(5)
    data = {}
    for name, (out, into) in {"M00": (0, 0), "M10": (1, 0), "M22": (2, 2)}.items():
        sigma = noise * brdf[:, 0, 0]
        data[name] = (
            "geometry",
            brdf[:, out, into] + sigma * rng.standard_normal(view.size),
        )
        data[f"{name}_stderr"] = ("geometry", sigma)
    coords = {"theta_i": np.full(view.size, THETA_I), "theta_s": theta_s, "dphi": dphi}
    return xr.Dataset(data, coords={k: ("geometry", v) for k, v in coords.items()})


def test_bins_are_read_between_their_centres_and_through_the_pole() -> None:
    theta, dphi = bins(90)
    table = MODEL.brdf(THETA_I, theta[:, None], dphi[None, :])
    rng = np.random.default_rng(2)
    # The first three lie between the pole and the first bin's centre
    theta_s = np.concatenate([[0.0, 0.004, 0.009], rng.uniform(0.0, 1.4, 40)])
    azimuth = np.concatenate([[2.1, 0.7, 5.9], rng.uniform(0.0, 2 * np.pi, 40)])
    read = interpolate_bins(theta, table, theta_s, azimuth, degree=3)
    expected = MODEL.brdf(THETA_I, theta_s, azimuth)
    assert_allclose(read, expected, atol=2e-3 * expected[:, 0, 0].max())


def test_the_curve_is_the_simulation_where_it_was_simulated() -> None:
    dataset = simulated()
    curve = SimulatedCurve(dataset, MODEL)
    theta_s, dphi = dataset.theta_s.values[5::7], dataset.dphi.values[3::20][:8]
    theta_s, dphi = (array.ravel() for array in np.meshgrid(theta_s, dphi))
    there = dataset.brdf_total.isel(theta_i=0).sel(
        theta_s=xr.DataArray(theta_s, dims="at"), dphi=xr.DataArray(dphi, dims="at")
    )
    value = curve.brdf(np.full(theta_s.size, THETA_I), theta_s, dphi)
    assert_allclose(value, there.transpose("at", ...).values, rtol=1e-9, atol=1e-12)


def test_a_fit_recovers_the_gains_of_a_simulated_scan() -> None:
    curve = SimulatedCurve(simulated(), MODEL)
    truth = curve.updated({"specular_gain": 0.7, "diffuse_albedo": 0.2})
    result = fit(scan(truth, 0.01), curve)
    for name, true in (("specular_gain", 0.7), ("diffuse_albedo", 0.2)):
        assert abs(result.values[name] - true) < 3.0 * result.stderr[name]
    assert result.chi2 / result.dof == pytest.approx(1.0, abs=0.35)
    # The plain analytical model lacks the extra light and must show it
    analytic = fit(scan(truth, 0.01), MODEL)
    assert analytic.values["specular_gain"] > result.values["specular_gain"] * 1.04


def test_the_measured_slopes_error_reaches_the_gain() -> None:
    curve = SimulatedCurve(simulated(), MODEL)
    data = scan(curve.updated({"specular_gain": 0.7, "diffuse_albedo": 0.2}), 0.01)
    stderr = 0.012
    held = fit(data, curve, priors={"slope_rms": (0.3, stderr)})
    ends = [
        fit(data, curve, fixed={"slope_rms": 0.3 + sign * stderr}).values["specular_gain"]
        for sign in (-1.0, 1.0)
    ]
    half = 0.5 * abs(ends[1] - ends[0])
    assert held.stderr_parts["specular_gain"]["slope_rms"] == pytest.approx(half, rel=0.1)
    assert held.stderr["specular_gain"] > half


def test_the_simulations_error_joins_that_of_the_scan() -> None:
    curve = SimulatedCurve(simulated(), MODEL.with_parameters(specular_gain=0.5))
    data = scan(curve, 0.02)
    weighed = with_simulation_error(data, curve)
    m00 = curve.brdf(*(data[name].values for name in ("theta_i", "theta_s", "dphi")))[
        :, 0, 0
    ]
    # 2 % of the scan and 1 % of the simulated curve, and no diffuse light here
    assert_allclose(weighed.M00_stderr, np.hypot(0.02, 0.01) * m00, rtol=2e-2)
    assert "M00_stderr" not in with_simulation_error(data[["M00"]], curve)


def test_an_incidence_that_was_not_simulated_is_refused() -> None:
    curve = SimulatedCurve(simulated(), MODEL)
    with pytest.raises(ValueError, match=r"theta_i must be one of 0\.55 \[rad\], got 0\.6"):
        curve.brdf(np.array([0.6]), np.array([0.2]), np.array([np.pi]))
