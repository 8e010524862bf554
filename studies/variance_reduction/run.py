"""Bias and stated errors of runs with less noise, against those of the plain estimator.

Both estimators run with the same number of realisations from as many seeds. The mean of the
plain runs together is the reference: `--seeds` times as long as one of them.
"""

import argparse
import json
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.stats import norm

from pbrdf import Drops, GaussianSurface, Material, Scene, Spheres, simulate
from pbrdf.bench.__main__ import machine
from pbrdf.errors import AccuracyWarning
from pbrdf.observation import observe

OUTPUT = Path(__file__).parent / "output"
GLASS, WATER = Material(1.5), Material(1.333)
BINS = {"n_theta": 9, "n_dphi": 18}
WAVES = np.linspace(0.4, 0.7, 5)
COLOURED = Material.from_table(
    wavelength=WAVES, n=1.4 + 0.1 * np.arange(5), kappa=0.5 * np.arange(5)
)
# Detectors of the goniometer [degrees], and its cones [rad]
DETECTORS = np.array([60.0, 45.0, 70.0, 30.0]), np.array([180.0, 180.0, 180.0, 120.0])
CONES = {"source_half_angle": 0.05, "detector_half_angle": 0.05}
# Bins above this part of the peak count, and elements above this part of M00
BRIGHT, STRONG = 0.1, 0.01
FALSE_ALARM = 0.01


def surface(slope: float) -> GaussianSurface:
    """Return a small surface, quick to draw: 12 correlation lengths a side."""
    return GaussianSurface(shape=(96, 96), spacing=1.0, corr_length=8.0, slope_rms=slope)


# Scene, source [degrees], and further arguments
CASES: dict[str, tuple[Callable[[], Scene], float, dict[str, object]]] = {
    "rough": (lambda: Scene(surface(0.3), GLASS), 60.0, {}),
    "dew": (
        lambda: Scene(
            surface(0.05),
            GLASS,
            Drops(
                contact_angle=np.pi / 2, coverage=0.15, number_density=4e-4, material=WATER
            ),
        ),
        41.4,
        {},
    ),
    "spheres": (
        lambda: Scene(
            surface(0.1), GLASS, Spheres(radius=6.0, coverage=0.10, material=WATER)
        ),
        41.4,
        {"phi_i": 0.6},
    ),
    # Five wavelengths are summed by bin
    "spectral": (lambda: Scene(surface(0.3), COLOURED), 60.0, {"wavelength": WAVES}),
    # One map: realisations are so many times more rays
    "map": (lambda: Scene(surface(0.3).sample(7), GLASS), 60.0, {"phi_i": 0.6}),
    # Readings of a goniometer
    "readings": (lambda: Scene(surface(0.3), GLASS), 60.0, {"phi_i": 0.6}),
}


def run_once(case: str, **options: object) -> xr.Dataset:
    """Simulate a case, or observe it."""
    scene, theta_i, given = CASES[case]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)
        if case == "readings":
            theta_s, dphi = (np.deg2rad(angles) for angles in DETECTORS)
            return observe(
                scene(), np.full(len(dphi), np.deg2rad(theta_i)), theta_s, dphi,
                **CONES, **given, **options,
            )  # fmt: skip
        return simulate(scene(), np.deg2rad(theta_i), **BINS, **given, **options)


def runs(
    case: str, seeds: range, realizations: int, n_rays: int, *, reduced: bool
) -> dict[str, np.ndarray]:
    """BRDF of all bounces apart and together, and stated errors, by seed."""
    found: dict[str, list[np.ndarray]] = {"value": [], "error": []}
    for seed in seeds:
        result = run_once(
            case, n_rays=n_rays, realizations=realizations, seed=seed,
            variance_reduction=reduced,
        )  # fmt: skip
        for name, end in (("value", ""), ("error", "_stderr")):
            by_bounces = result[f"brdf{end}"]
            total = result[f"brdf_total{end}"]
            if "theta_i" in result.dims:
                by_bounces, total = by_bounces.isel(theta_i=0), total.isel(theta_i=0)
            by_bounces, total = by_bounces.values, total.values[None]
            found[name].append(np.concatenate([by_bounces, total]))
    return {name: np.array(values) for name, values in found.items()}


def measure(case: str, seeds: int, realizations: int, n_rays: int) -> dict[str, object]:
    """Compare both estimators over one case."""
    plain = runs(case, range(seeds), realizations, n_rays, reduced=False)
    reduced = runs(case, range(10_000, 10_000 + seeds), realizations, n_rays, reduced=True)
    truth = plain["value"].mean(axis=0)
    light = truth[-1, ..., :1, :1]
    counts = (light > BRIGHT * light.max()) & (np.abs(truth) > STRONG * truth[..., :1, :1])
    # Bounces that carry next to no light are no part of what is asked for
    counts &= truth[..., :1, :1] > STRONG * light
    spread = [one["value"].var(axis=0, ddof=1)[counts] for one in (plain, reduced)]
    apart = (reduced["value"].mean(axis=0) - truth)[counts]
    z = apart / np.sqrt((spread[0] + spread[1]) / seeds)
    limit = float(norm.isf(0.5 * (1.0 - (1.0 - FALSE_ALARM) ** (1.0 / z.size))))
    # Of each estimator about its own mean: the spread that its errors should state
    sd = []
    for one in (plain, reduced):
        away = one["value"] - one["value"].mean(axis=0)
        own = away[:, counts] / one["error"][:, counts] * np.sqrt(seeds / (seeds - 1.0))
        sd.append(float(np.sqrt(np.mean(own**2))))
    m00 = np.broadcast_to(counts[-1, ..., :1, :1], counts[-1].shape).copy()
    m00[..., 1:, :] = m00[..., :, 1:] = False
    gain = [
        one["value"][:, -1].var(axis=0, ddof=1)[m00] / truth[-1][m00] ** 2
        for one in (plain, reduced)
    ]
    return {
        "case": case, "seeds": seeds, "realizations": realizations, "n_rays": n_rays,
        "elements": int(z.size), "largest_z": float(np.abs(z).max()), "limit": limit,
        "mean_square_z": float(np.mean(z**2)), "sd_plain": sd[0], "sd_reduced": sd[1],
        "resolved": float(np.median(np.sqrt(spread[0] / seeds) / np.abs(truth[counts]))),
        "gain_mean_square": float(gain[0].mean() / gain[1].mean()),
    }  # fmt: skip


def main() -> int:
    """Measure the cases asked for, and say what was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", action="append", choices=list(CASES))
    parser.add_argument("--seeds", type=int, default=400)
    parser.add_argument("--realizations", type=int, default=64)
    parser.add_argument("--rays", type=int, default=1500)
    parser.add_argument("--output", type=Path, default=OUTPUT)
    given = parser.parse_args()
    given.output.mkdir(parents=True, exist_ok=True)
    for case in given.case or CASES:
        found = measure(case, given.seeds, given.realizations, given.rays)
        sys.stdout.write(
            f"{case}: {found['seeds']} runs of {found['realizations']} realisations, "
            f"{found['elements']} elements: largest |z| {found['largest_z']:.2f} of "
            f"{found['limit']:.2f}, mean z^2 {found['mean_square_z']:.2f}; bias resolved "
            f"to {100 * found['resolved']:.2f} %; spread / stated error plain "
            f"{found['sd_plain']:.3f}, reduced {found['sd_reduced']:.3f}; mean square "
            f"{found['gain_mean_square']:.1f} times less\n"
        )
        sys.stdout.flush()
        record = {"machine": machine(), "result": found}
        (given.output / f"{case}.json").write_text(json.dumps(record, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
