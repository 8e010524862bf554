"""Rate of the loop over Mitsuba 3 on one thread, beside that of the engine in `run.py`.

    python mitsuba_rate.py heights.npy

with a height map of unit spacing that repeats (`run.py --heights heights.npy` writes the
one of the benchmark).
"""

import argparse
import time

import drjit as dr
import numpy as np

from pbrdf.bench import mitsuba_loop as loop


def main():
    """Print the rate, and the albedo by bounces for comparison."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("heights")
    parser.add_argument("--side", type=int, default=1024)
    parser.add_argument("--repeats", type=int, default=6)
    options = parser.parse_args()
    dr.set_thread_count(1)
    heights = np.load(options.heights)
    scene = loop.build_scene(heights)
    best, bins = np.inf, (45, 90)
    for seed in range(options.repeats):
        flux = loop.no_light(bins)
        start = time.process_time()
        loop.trace(
            scene, heights, np.deg2rad(60.0), 0.3, 1.5, options.side, flux, bins, seed
        )
        best = min(best, time.process_time() - start)
    rays = options.side**2
    albedo = np.array(flux).reshape(3, -1, 16)[..., 0].sum(axis=1) / rays
    print(f"{rays / best / 1e6:.2f} M paths a core-second, albedo by bounces {albedo}")


if __name__ == "__main__":
    main()
