"""Whose noise is left: variance of a realisation by bounces, with few and many rays."""

import argparse
import sys
import time
import warnings

import numpy as np

from pbrdf import simulate
from pbrdf.bench.errors_over_time import BRIGHT
from pbrdf.bench.scenes import CASES, N_DPHI, N_THETA
from pbrdf.errors import AccuracyWarning

RAYS = (4000, 15_000, 60_000)
KNOWN = {one.name: one for one in CASES if one.readings is None}


def measure(name: str, n_rays: int, realizations: int, *, reduced: bool) -> str:
    """Mean and median over bins of the relative variances of M00, times realisations."""
    case = KNOWN[name]
    start = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)
        found = simulate(
            case.scene(256), case.theta_i, n_rays=n_rays, realizations=realizations,
            n_theta=N_THETA, n_dphi=N_DPHI, workers=1, stokes="unpolarized",
            variance_reduction=reduced, **case.options,
        )  # fmt: skip
    each = (time.process_time() - start) / realizations
    place = {"theta_i": 0, "stokes_out": 0, "stokes_in": 0}
    total, error, by_bounces = (
        found[one].isel(place).values
        for one in ("brdf_total", "brdf_total_stderr", "brdf_stderr")
    )
    bright = total > BRIGHT * total.max()
    parts = [
        (one[..., bright] / total[bright]) ** 2 * realizations
        for one in (error, *by_bounces)
    ]
    told = "  ".join(f"{one.mean():.5f} / {np.median(one):.5f}" for one in parts)
    way = "reduced" if reduced else "plain"
    return f"{name}, {way}, {n_rays} rays: {1e3 * each:.1f} ms  {told}"


def main() -> int:
    """Print the parts of the cases asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", action="append", choices=list(KNOWN))
    parser.add_argument("--realizations", type=int, default=200)
    given = parser.parse_args()
    sys.stdout.write("variance, mean / median bin: of all light, of 1, 2 and 3+ bounces\n")
    for name in given.case or ["rough"]:
        for reduced in (False, True):
            measure(name, RAYS[0], 8, reduced=reduced)  # compiles
            for n_rays in RAYS:
                line = measure(name, n_rays, given.realizations, reduced=reduced)
                sys.stdout.write(line + "\n")
                sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
