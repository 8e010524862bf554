"""Is a fit to light of all bounces unbiased with the Monte Carlo in its loop, and only so?

    python studies/fits/monte_carlo.py

Simulates scans of one rough absorber from independent surfaces, with every bounce, and fits
index and gains to each: with the analytical model at the true slope, and with a
`SimulatedModel` traced once from surfaces of its own. Prints bias and scatter of both.
"""

import argparse
import time

import numpy as np
import xarray as xr

from fitting import SimulatedModel, fit
from pbrdf import GaussianSurface, Material, MicrofacetModel, Scene, simulate

SURFACE = GaussianSurface(shape=(256, 256), spacing=1.0, corr_length=12.0, slope_rms=0.30)
TRUTH = {"n": 1.55, "kappa": 0.30, "specular_gain": 0.8, "diffuse_albedo": 0.08}
START = Material(1.45, 0.2)
INCIDENCES = np.deg2rad([30.0, 60.0])
ELEMENTS = ("M00", "M10", "M22")
NOISE = 0.01


def simulated_scan(seed, *, n_rays=20_000, realizations=64, workers=None):
    """Scan a simulated surface in plane to 75 degrees, with noise and its stated error."""
    scene = Scene(SURFACE, Material(TRUTH["n"], TRUTH["kappa"]))
    run = simulate(
        scene, INCIDENCES, phi_i="uniform", n_rays=n_rays, realizations=realizations,
        seed=10_000 + seed, n_theta=45, n_dphi=72, stokes="linear", workers=workers,
    ).sel(dphi=[0.0, np.pi], method="nearest")  # fmt: skip
    run = run.isel(theta_s=run.theta_s.values < np.deg2rad(75.0))
    plane = run[["brdf_total", "brdf_total_stderr"]].stack(
        geometry=("theta_i", "theta_s", "dphi")
    )
    plane = plane.transpose("geometry", "stokes_out", "stokes_in").reset_index("geometry")
    rng = np.random.default_rng([2, seed])
    brdf = TRUTH["specular_gain"] * plane.brdf_total.values
    brdf[:, 0, 0] += TRUTH["diffuse_albedo"] / np.pi
    error = TRUTH["specular_gain"] * plane.brdf_total_stderr.values
    spread = NOISE * brdf[:, 0, 0]
    data = {}
    for name in ELEMENTS:
        out, into = int(name[1]), int(name[2])
        value = brdf[:, out, into] + spread * rng.standard_normal(spread.size)
        data[name] = ("geometry", value)
        # The scan too comes from finitely many surfaces
        data[f"{name}_stderr"] = ("geometry", np.hypot(spread, error[:, out, into]))
    coords = {
        name: ("geometry", plane[name].values) for name in ("theta_i", "theta_s", "dphi")
    }
    return xr.Dataset(data, coords)


def models(*, n_rays=10_000, realizations=320, workers=None):
    """Return both models, started off the truth."""
    simulated = SimulatedModel(
        Scene(SURFACE, START), n_rays=n_rays, realizations=realizations, seed=77,
        stokes="linear", workers=workers,
    )  # fmt: skip
    simulated.simulation(INCIDENCES)
    return {
        "analytical": MicrofacetModel(START, slope_rms=SURFACE.slope_rms),
        "Monte Carlo": simulated,
    }


def pulls(results):
    """Return mean, its error, simulation's error, bias in errors, scatter, stated error."""
    table = {}
    for name, truth in TRUTH.items():
        values = np.array([result.values[name] for result in results])
        error = values.std(ddof=1) / np.sqrt(len(values))
        # One simulation served all scans: its error does not average out
        part = np.mean(
            [result.stderr_parts[name].get("simulation", 0.0) for result in results]
        )
        bias = (values.mean() - truth) / np.hypot(error, part)
        stated = np.mean([result.stderr[name] for result in results])
        table[name] = (values.mean(), error, part, bias, values.std(ddof=1), stated)
    return table


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scans", type=int, default=32)
    parser.add_argument("--workers", type=int, default=None)
    arguments = parser.parse_args()
    start = time.perf_counter()
    both = models(workers=arguments.workers)
    print(f"traced once in {time.perf_counter() - start:.0f} s")
    scans = [simulated_scan(k, workers=arguments.workers) for k in range(arguments.scans)]
    for title, model in both.items():
        start = time.perf_counter()
        results = [fit(scan, model, free=tuple(TRUTH)) for scan in scans]
        each = (time.perf_counter() - start) / len(scans)
        ratio = np.mean([result.chi2 / result.dof for result in results])
        print(f"\n{title}: {len(scans)} scans, {each:.2f} s a fit, chi2/dof {ratio:.2f}")
        print(
            "  parameter        truth   mean ± its error  simulation  bias/error  scatter"
        )
        for name, row in pulls(results).items():
            mean, error, part, bias, scatter, _ = row
            print(
                f"  {name:15s} {TRUTH[name]:6.3f}  {mean:.4f} ± {error:.4f}   {part:.4f}   "
                f"{bias:+9.1f}    {scatter:.4f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
