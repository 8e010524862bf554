"""True errors of runs against long runs of the plain estimator, and their times."""

import time
import warnings
from typing import Any

import numpy as np
import xarray as xr

from pbrdf import simulate
from pbrdf.bench.scenes import Case
from pbrdf.conventions import detector_bins
from pbrdf.errors import AccuracyWarning

N_THETA, N_DPHI = 18, 36
# Bins above this part of the peak count
BRIGHT = 0.1


def run(case: Case, side: int, **options: Any) -> tuple[xr.Dataset, float]:
    """Run a case: its result, and the wall time it took. [s]"""
    scene = case.scene(side)
    settings: dict[str, Any] = {"n_theta": N_THETA, "n_dphi": N_DPHI} | case.options
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)
        start = time.perf_counter()
        result = simulate(scene, case.theta_i, **settings | options)
        return result, time.perf_counter() - start


def light(result: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """M00 of all bounces and its standard error, by wavelength and bin."""
    unpolarised = {"theta_i": 0, "stokes_out": 0, "stokes_in": 0}
    value = result.brdf_total.isel(unpolarised).values
    error = result.brdf_total_stderr.isel(unpolarised).values
    return value.reshape(-1, N_THETA, N_DPHI), error.reshape(-1, N_THETA, N_DPHI)


def reference(
    case: Case, side: int, n_rays: int, realizations: int
) -> dict[str, np.ndarray]:
    """Long run of the plain estimator, its error, and the bins that count."""
    result, _ = run(
        case, side, n_rays=n_rays, realizations=realizations, seed=990_001,
        variance_reduction=False, stokes="unpolarized",
    )  # fmt: skip
    value, error = light(result)
    peak = value.max(axis=(1, 2), keepdims=True)
    return {"value": value, "error": error, "bright": value > BRIGHT * peak}


def true_errors(
    case: Case, side: int, truth: dict[str, np.ndarray], seeds: range, **options: Any
) -> dict[str, Any]:
    """Mean squares over seeds of the relative error, less the reference's own, and time."""
    squares, times = [], []
    bright = truth["bright"]
    for seed in seeds:
        result, seconds = run(case, side, seed=seed, **options)
        value, _ = light(result)
        squares.append((value[bright] / truth["value"][bright] - 1.0) ** 2)
        times.append(seconds)
    own = (truth["error"][bright] / truth["value"][bright]) ** 2
    by_bin = np.mean(squares, axis=0) - own
    mean, seconds = float(by_bin.mean()), float(np.median(times))
    return {
        "rms": float(np.sqrt(max(mean, 0.0))),
        "median_bin": float(np.sqrt(max(np.median(by_bin), 0.0))),
        "worst_bin": float(np.sqrt(max(by_bin.max(), 0.0))),
        "seconds": seconds,
        "efficiency": 1.0 / (mean * seconds) if mean > 0.0 else None,
        "reference_rms": float(np.sqrt(own.mean())),
    }


def model_errors(case: Case, truth: dict[str, np.ndarray]) -> dict[str, Any] | None:
    """Bias of the analytical model at bin centres, and its time."""
    if case.model is None:
        return None
    theta_s, dphi, _ = detector_bins(N_THETA, N_DPHI)
    start = time.perf_counter()
    value = case.model.brdf(case.theta_i, theta_s[:, None], dphi)[..., 0, 0]
    seconds = time.perf_counter() - start
    bright = truth["bright"]
    value = np.broadcast_to(value, bright.shape)
    square = (value[bright] / truth["value"][bright] - 1.0) ** 2
    own = (truth["error"][bright] / truth["value"][bright]) ** 2
    return {"rms": float(np.sqrt(max((square - own).mean(), 0.0))), "seconds": seconds}
