"""Recover a coating from its micrograph and its goniometer scan; compare with the truth.

Makes the embedded example, runs `pbrdf pipeline` on it as a user would, and prints how far
every recovered number is from the one that the example was made with.

Run it:  make demo
"""

import argparse
import subprocess
import sys
from pathlib import Path
from time import perf_counter

from recovery import make_example, recovered

# An ordinary draw; `make demo-seeds` runs ten others. Seed 1 draws an edge whose slope is
# 2.6 standard deviations low, which is what one sample in a hundred does.
SEED = 3


def main() -> None:
    """Make the example, run the pipeline, print recovered against true."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("demo-output"))
    parser.add_argument("--seed", type=int, default=SEED)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)

    begin = perf_counter()
    print("1. Making the example: the edge's picture, and a scan from the Monte Carlo ...")
    edge, scan = make_example(arguments.output, arguments.seed)
    print(f"   {edge} and {scan} in {perf_counter() - begin:.1f} s\n")

    model = arguments.output / "model"
    command = [
        "pbrdf", "pipeline", str(edge), str(scan), "--um-per-pixel", "0.5", "--n", "1.53",
        "--output", str(model), "--force",
    ]  # fmt: skip
    print(f"2. {' '.join(command)}\n", flush=True)
    begin = perf_counter()
    subprocess.run([Path(sys.executable).with_name("pbrdf"), *command[1:]], check=True)
    print(
        f"   The pipeline took {perf_counter() - begin:.1f} s, start of Python included.\n"
    )

    print("3. Recovered against true")
    for comparison in recovered(model):
        print(f"   {comparison}")


if __name__ == "__main__":
    main()
