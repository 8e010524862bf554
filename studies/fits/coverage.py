"""How often do the 95 % intervals of the fits hold the truth, and are they too wide?

    python studies/fits/coverage.py --scans 2000

Prints one line a parameter: coverage, mean and standard deviation of the pulls
(estimate - truth) / stderr, and the stderr over the Cramér-Rao bound at the truth. A truth
on its bound, the kappa of a dielectric, has a coverage and a one-sided scatter: it counts
for the first and not for the pulls.
"""

import argparse
import time
import warnings
from dataclasses import dataclass

import numpy as np
import xarray as xr

from fitting import Noise, fit
from fitting.objective.uncertainty import information
from pbrdf import Material, MicrofacetModel

GAINS = ("specular_gain", "diffuse_albedo")
VIEW = np.deg2rad(np.arange(-75.0, 75.1, 2.5))

MATERIALS = {
    "vinyl": MicrofacetModel(
        Material(1.53), slope_rms=0.252, specular_gain=0.8, diffuse_albedo=0.13
    ),
    "paint": MicrofacetModel(
        Material(1.48, 0.3), slope_rms=0.12, specular_gain=0.95, diffuse_albedo=0.04
    ),
    "aluminium": MicrofacetModel(
        Material(1.37, 7.62), slope_rms=0.30, specular_gain=0.9, diffuse_albedo=0.02
    ),
}
NOISES = (0.01, 0.02, 0.05)


@dataclass(frozen=True)
class Case:
    """One kind of fit: incidences in degrees, elements, parameters, errors given or not."""

    name: str
    incidences: tuple[float, ...]
    elements: tuple[str, ...]
    free: tuple[str, ...]
    given: bool = True


CASES = (
    Case("gains, 30 deg", (30.0,), ("M00", "M10"), GAINS),
    Case("gains, 30 deg, noise estimated", (30.0,), ("M00", "M10"), GAINS, given=False),
    Case("gains, 30 deg, M00 alone", (30.0,), ("M00",), GAINS),
    Case("gains, 20/40/60 deg", (20.0, 40.0, 60.0), ("M00", "M10"), GAINS),
    Case("gains and slope, 30 deg", (30.0,), ("M00", "M10"), (*GAINS, "slope_rms")),
    Case("gains, slope, n, 30 deg", (30.0,), ("M00", "M10"), (*GAINS, "slope_rms", "n")),
    Case(
        "gains, slope, n, 20/40/60 deg, noise estimated",
        (20.0, 40.0, 60.0), ("M00", "M10"), (*GAINS, "slope_rms", "n"), given=False,
    ),
    Case(
        "gains, slope, n, kappa, 30 deg, with M22 and M23",
        (30.0,), ("M00", "M10", "M22", "M23"), (*GAINS, "slope_rms", "n", "kappa"),
    ),
    Case(
        "gains, slope, n, kappa, 20/40/60 deg, no circular light",
        (20.0, 40.0, 60.0), ("M00", "M10", "M22"), (*GAINS, "slope_rms", "n", "kappa"),
    ),
    Case(
        "gains, slope, n, kappa, 20/40/60 deg, with M22 and M23",
        (20.0, 40.0, 60.0), ("M00", "M10", "M22", "M23"),
        (*GAINS, "slope_rms", "n", "kappa"),
    ),
)  # fmt: skip


def scan(model, theta_i, elements, noise, rng, *, given):
    """Scan a model in plane with noise relative to M00."""
    incidence = np.full(VIEW.size, np.deg2rad(theta_i))
    dphi = np.where(VIEW > 0.0, np.pi, 0.0)
    brdf = model.brdf(incidence, np.abs(VIEW), dphi)
    spread = noise * brdf[:, 0, 0]
    data = {}
    for name in elements:
        exact = brdf[:, int(name[1]), int(name[2])]
        data[name] = ("geometry", exact + spread * rng.standard_normal(VIEW.size))
        if given:
            data[f"{name}_stderr"] = ("geometry", spread)
    coords = {
        "theta_i": ("geometry", incidence),
        "theta_s": ("geometry", np.abs(VIEW)),
        "dphi": ("geometry", dphi),
    }
    return xr.Dataset(data, coords)


def truth_of(model, name):
    """Return the true value of a parameter."""
    return getattr(model.material if name in ("n", "kappa") else model, name)


def started(model, free):
    """Return the model with wrong starts for all that is free."""
    index = {name: 1.15 * truth_of(model, name) for name in ("n", "kappa") if name in free}
    material = Material(
        index.get("n", model.material.n), index.get("kappa", model.material.kappa)
    )
    changes = {name: 1.2 * getattr(model, name) for name in free if hasattr(model, name)}
    return model.with_parameters(material=material, **changes)


def bound(model, case, noise):
    """Return the Cramér-Rao bound: standard errors from the information at the truth."""
    rng = np.random.default_rng(0)
    exact = [scan(model, t, case.elements, 0.0, rng, given=False) for t in case.incidences]
    result = fit(exact, model, free=case.free, noise=Noise(relative=noise))
    truth = np.array([truth_of(model, name) for name in case.free])
    return information(result.problem.objective.jacobian(truth)).stderr


def collect(case, indices, seed):
    """Fit the scans of these numbers; return pull, covered and ratio by parameter.

    A fit that fails is a row of nan.
    """
    conditions = [(model, noise) for model in MATERIALS.values() for noise in NOISES]
    bounds = [bound(model, case, noise) for model, noise in conditions]
    rows = np.full((len(indices), 3, len(case.free)), np.nan)
    for row, index in zip(rows, indices, strict=True):
        model, noise = conditions[index % len(conditions)]
        rng = np.random.default_rng([seed, index])
        scans = [
            scan(model, t, case.elements, noise, rng, given=case.given)
            for t in case.incidences
        ]
        result = fit(scans, started(model, case.free), free=case.free)
        stderr = np.array(list(result.stderr.values()))
        if not result.converged or not np.isfinite(stderr).all():
            continue
        truth = np.array([truth_of(model, name) for name in case.free])
        miss = np.array(list(result.values.values())) - truth
        on_bound = (np.array(case.free) == "kappa") & (truth == 0.0)
        ends = np.array([(e.low, e.high) for e in result.estimates.values()])
        row[0] = np.where(on_bound, np.nan, miss / stderr)
        row[1] = (ends[:, 0] <= truth) & (truth <= ends[:, 1])
        ratio = stderr / bounds[index % len(conditions)]
        row[2] = np.where(on_bound, np.nan, ratio)
    return rows


def report(case, rows, seconds):
    """Print the coverage of one case over all materials and noises."""
    failures = int(np.isnan(rows[:, 1]).any(axis=1).sum())
    each = 1e3 * seconds / len(rows)
    print(f"\n{case.name}: {len(rows)} scans, {failures} failures, {each:.0f} ms a scan")
    mean, spread = np.nanmean(rows, axis=0), np.nanstd(rows, axis=0)
    for i, name in enumerate(case.free):
        print(
            f"  {name:15s} covered {mean[1, i]:6.1%}   "
            f"pull {mean[0, i]:+.3f} +- {spread[0, i]:.3f}   "
            f"stderr / bound {np.nanmedian(rows[:, 2, i]):.3f}",
            flush=True,
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scans", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="part of the name of a case")
    arguments = parser.parse_args()
    warnings.simplefilter("error")
    for case in CASES:
        if arguments.only in case.name:
            start = time.perf_counter()
            rows = collect(case, range(arguments.scans), arguments.seed)
            report(case, rows, time.perf_counter() - start)


if __name__ == "__main__":
    main()
