"""How often do the 95 % intervals of the fits hold the truth, and are they too wide?

    python studies/fits/coverage.py --scans 2000

Prints one line a parameter: coverage and its binomial error, mean and scatter of the pulls
(estimate - truth) / stderr, and the stderr over the Cramér-Rao bound at the truth. A truth
on its bound, the kappa of a dielectric, has a coverage and a one-sided scatter: it counts
for the first and not for the pulls.
"""

import argparse
import time
import warnings
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from fitting import fit
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
    """One kind of fit: incidences in degrees, elements, parameters, errors given or not.

    `kind` is "brdf"; "relative", each scan times a factor of its own; "ratios", elements
    over M00; or "dark", a black surface read with a noise floor, half of it below zero.
    """

    name: str
    incidences: tuple[float, ...]
    elements: tuple[str, ...]
    free: tuple[str, ...]
    given: bool = True
    kind: str = "brdf"

    @property
    def known(self):
        """Return the names of what the data can know."""
        if self.kind not in ("relative", "ratios"):
            return self.free
        rest = [name for name in self.free if name not in GAINS]
        return ("diffuse_albedo / specular_gain", *rest)


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
    Case("relative, 30 deg", (30.0,), ("M00", "M10"), (*GAINS, "slope_rms"),
         kind="relative"),
    Case("relative, 20/60 deg, noise estimated", (20.0, 60.0), ("M00",),
         (*GAINS, "slope_rms"), given=False, kind="relative"),
    Case("ratios, 30/60 deg", (30.0, 60.0), ("M00", "M10", "M11", "M22"),
         (*GAINS, "slope_rms", "n"), kind="ratios"),
    Case("dark readings, 30 deg", (30.0,), ("M00",), GAINS, kind="dark"),
    Case("dark readings, slope, 20/60 deg, noise estimated", (20.0, 60.0), ("M00",),
         (*GAINS, "slope_rms"), given=False, kind="dark"),
)  # fmt: skip


def scan(model, theta_i, case, noise, rng):
    """Scan a model in plane with noise relative to M00; a dark one with a noise floor."""
    incidence = np.full(VIEW.size, np.deg2rad(theta_i))
    dphi = np.where(VIEW > 0.0, np.pi, 0.0)
    brdf = model.brdf(incidence, np.abs(VIEW), dphi)
    m00 = brdf[:, 0, 0]
    spread = noise * m00
    if case.kind == "dark":
        spread = np.full(VIEW.size, noise * np.quantile(m00, 0.7))
    data = {}
    for name in case.elements:
        exact, stderr = brdf[:, int(name[1]), int(name[2])], spread
        if case.kind == "ratios":
            if name == "M00":
                continue
            name, exact, stderr = f"m{name[1:]}", exact / m00, np.full(VIEW.size, noise)
        data[name] = ("geometry", exact + stderr * rng.standard_normal(VIEW.size))
        if case.given and noise:
            data[f"{name}_stderr"] = ("geometry", stderr)
    coords = {
        "theta_i": ("geometry", incidence),
        "theta_s": ("geometry", np.abs(VIEW)),
        "dphi": ("geometry", dphi),
    }
    found = xr.Dataset(data, coords)
    if case.kind != "relative":
        return found
    factor = np.exp(rng.normal(0.0, 3.0))
    return (found * factor).assign_attrs(quantity="relative")


def truth_of(model, name):
    """Return the true value of a parameter, or of a ratio of two."""
    if " / " in name:
        return model.diffuse_albedo / model.specular_gain
    return getattr(model.material if name in ("n", "kappa") else model, name)


def started(model, free):
    """Return the model with wrong starts for all that is free."""
    index = {name: 1.15 * truth_of(model, name) for name in ("n", "kappa") if name in free}
    material = Material(
        index.get("n", model.material.n), index.get("kappa", model.material.kappa)
    )
    changes = {name: 1.2 * getattr(model, name) for name in free if hasattr(model, name)}
    return model.with_parameters(material=material, **changes)


def estimates(result, case):
    """Return value, standard error and interval of all that the data can know."""
    found = {**result.estimates, **result.ratios}
    return [found[name] for name in case.known]


def bound(model, case, noise):
    """Return the Cramér-Rao bound: the standard errors of readings without noise.

    The fit then ends at the truth, and its weights are those of the noise.
    """
    rng = np.random.default_rng(0)
    exact = [scan(model, theta_i, case, 0.0, rng) for theta_i in case.incidences]
    real = [scan(model, theta_i, replace(case, given=True), noise, rng)
            for theta_i in case.incidences]  # fmt: skip
    for one, other in zip(exact, real, strict=True):
        for name in one.data_vars:
            # Each relative scan drew a factor of its own
            unit = float(one[name].std() / other[name].std()) ** (case.kind == "relative")
            one[f"{name}_stderr"] = other[f"{name}_stderr"] * unit
    result = fit(exact, model, free=case.free)
    return np.array([one.stderr for one in estimates(result, case)])


def materials_of(case):
    """Return the models to scan; dark ones have no diffuse light."""
    if case.kind != "dark":
        return MATERIALS.values()
    return [one.with_parameters(diffuse_albedo=0.0) for one in MATERIALS.values()]


def collect(case, indices, seed):
    """Fit the scans of these numbers; return pull, covered and ratio by parameter.

    A fit that fails is a row of nan.
    """
    conditions = [(model, noise) for model in materials_of(case) for noise in NOISES]
    bounds = [bound(model, case, noise) for model, noise in conditions]
    rows = np.full((len(indices), 3, len(case.known)), np.nan)
    for row, index in zip(rows, indices, strict=True):
        model, noise = conditions[index % len(conditions)]
        rng = np.random.default_rng([seed, index])
        scans = [scan(model, theta_i, case, noise, rng) for theta_i in case.incidences]
        result = fit(scans, started(model, case.free), free=case.free)
        if not result.converged:
            continue
        found = estimates(result, case)
        stderr = np.array([one.stderr for one in found])
        if not np.isfinite(stderr).all():
            continue
        truth = np.array([truth_of(model, name) for name in case.known])
        miss = np.array([one.value for one in found]) - truth
        ends = np.array([(one.low, one.high) for one in found])
        row[0] = np.where(truth == 0.0, np.nan, miss / stderr)
        row[1] = (ends[:, 0] <= truth) & (truth <= ends[:, 1])
        row[2] = np.where(truth == 0.0, np.nan, stderr / bounds[index % len(conditions)])
    return rows


def report(case, rows, seconds):
    """Print the coverage of one case over all materials and noises."""
    failures = int(np.isnan(rows[:, 1]).any(axis=1).sum())
    each = 1e3 * seconds / len(rows)
    print(f"\n{case.name}: {len(rows)} scans, {failures} failures, {each:.0f} ms a scan")
    with warnings.catch_warnings():
        # A truth on its bound has no pulls
        warnings.simplefilter("ignore", RuntimeWarning)
        mean, spread = np.nanmean(rows, axis=0), np.nanstd(rows, axis=0)
        ratio = np.nanmedian(rows[:, 2], axis=0)
    counted = max(len(rows) - failures, 1)
    for i, name in enumerate(case.known):
        print(
            f"  {name:30s} covered {mean[1, i]:6.2%} "
            f"+- {np.sqrt(mean[1, i] * (1.0 - mean[1, i]) / counted):.2%}   "
            f"pull {mean[0, i]:+.3f} +- {spread[0, i]:.3f}   "
            f"stderr / bound {ratio[i]:.3f}",
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
