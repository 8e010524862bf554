"""Run the embedded example for other seeds and count the misses of each quantity.

One sample in twenty lies outside a 95 % interval by chance; a quantity that misses more
than twice in ten is wrong with the method. Run it:  make demo-seeds
"""

import argparse
import tempfile
from collections import defaultdict
from pathlib import Path

from recovery import make_example, recovered

from data_io import read_goniometer, read_profile_image
from fitting.pipeline import run_pipeline
from fitting.report.write import write_report
from pbrdf import Material

FIRST_SEED = 101


def main() -> None:
    """Print every comparison, then the misses a quantity."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    arguments = parser.parse_args()
    found = defaultdict(list)
    for seed in range(arguments.first, arguments.first + arguments.count):
        print(f"seed {seed}")
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            edge, table = make_example(folder, seed)
            surface = read_profile_image(edge, um_per_pixel=0.5)
            result = run_pipeline(
                surface, read_goniometer(table), material=Material(1.53), seed=seed + 1
            )
            write_report(result, folder)
            for comparison in recovered(folder):
                print(f"  {comparison}", flush=True)
                found[comparison.curve, comparison.name].append(comparison)

    print(f"\nMisses in {arguments.count} seeds, and deviations in standard errors")
    for (curve, name), comparisons in found.items():
        misses = sum(not comparison.holds for comparison in comparisons)
        sigmas = " ".join(f"{comparison.sigma:+.1f}" for comparison in comparisons)
        print(f"  {name:<15} {curve:<12} {misses}   {sigmas}")


if __name__ == "__main__":
    main()
