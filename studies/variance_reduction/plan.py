"""Is the plan that `simulate` makes by itself near the best choice of grid and rays?

    python studies/variance_reduction/plan.py [--target 0.01] [--case rough]

For each case and each grid of choices (cells a correlation length, lengths a period, rays a
realisation): processor time to the target, from the error and time of short runs. Beside it
the time of `simulate(scene, angle, target_rel_error=...)` alone, its pilot included, on a
surface without shape and spacing. One thread; all times of one case in one process.
"""

import argparse
import itertools
import time
import warnings

import numpy as np

import pbrdf

LENGTH = 16.0
CASES = {
    "gentle": (0.15, 41.4), "rough": (0.30, 60.0), "multi-bounce": (0.47, 75.0),
}  # fmt: skip
# Choices of more nodes than 512 x 512 are left out
CELLS, PERIODS, RAYS = (8, 16), (16, 32, 64), (4000, 16_000, 64_000)
BINS = {"n_theta": 18, "n_dphi": 36, "stokes": "unpolarized", "workers": 1}


def surface(slope, cells=None, period=None):
    """Make a surface on a grid, or on the one that it takes by itself."""
    grid = {}
    if cells is not None:
        grid = {"spacing": LENGTH / cells, "shape": (cells * period,) * 2}
    return pbrdf.GaussianSurface(corr_length=LENGTH, slope_rms=slope, **grid)


def timed(scene, theta, **how):
    """Largest relative error over bright bins, and processor time of a run. [s]"""
    start = time.process_time()
    result = pbrdf.simulate(scene, theta, **BINS, **how)
    return result, time.process_time() - start


def to_target(slope, theta, choice, target, realizations=24):
    """Processor time to the target by a choice of grid and rays. [s]"""
    cells, period, n_rays = choice
    scene = pbrdf.Scene(surface(slope, cells, period), pbrdf.Material(1.5))
    timed(scene, theta, n_rays=n_rays, realizations=2)
    # The largest error over bins is a noisy number: the mean square of three runs
    runs = [
        timed(scene, theta, n_rays=n_rays, realizations=realizations, seed=seed)
        for seed in range(3)
    ]
    square = np.mean([result.attrs["rel_error"] ** 2 for result, _ in runs])
    return np.mean([took for _, took in runs]) * square / target**2


def main():
    """Print the time of every choice that is near the best, and that of the plan."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--target", type=float, default=0.01)
    parser.add_argument("--case", action="append", choices=CASES)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    for name in options.case or CASES:
        slope, degrees = CASES[name]
        theta = np.deg2rad(degrees)
        times = {
            choice: to_target(slope, theta, choice, options.target)
            for choice in itertools.product(CELLS, PERIODS, RAYS)
            if choice[0] * choice[1] <= 512
        }
        best = sorted(times, key=times.get)
        print(f"{name}: slope {slope}, {degrees} degrees, to {100 * options.target:g} %")
        for choice in best[:4]:
            cells, period, rays = choice
            print(
                f"  {cells:2d} cells, {period:2d} lengths, {rays:6d} rays: "
                f"{times[choice]:6.2f} s"
            )
        print(f"  the worst of {len(best)}: {times[best[-1]]:.1f} s")
        scene = pbrdf.Scene(surface(slope), pbrdf.Material(1.5))
        took = []
        for seed in range(3):
            result, seconds = timed(
                scene, theta, target_rel_error=options.target, seed=seed
            )
            took.append(seconds)
        print(
            f"  the plan: {result.attrs['n_rays']} rays, {result.attrs['realizations']} "
            f"realisations, {np.median(took):.2f} s with its pilot, "
            f"{np.median(took) / times[best[0]]:.2f} times the best"
        )


if __name__ == "__main__":
    main()
