"""Print how well contact angles are read from drawn drops; see README.md."""

import argparse
import itertools

import numpy as np

from examples.drop_picture import DropPicture, draw
from fitting import contact_angle

ANGLES = (15, 40, 75, 105, 140, 170)
# Width of the drop [pixels], blur [pixels], grain over contrast
CAMERAS = ((400, 1.0, 0.02), (160, 2.0, 0.05), (400, 3.0, 0.10))


def main() -> None:
    """Print a table of conditions."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", type=int, default=4, help="pictures a condition")
    parser.add_argument("--first-seed", type=int, default=0)
    arguments = parser.parse_args()
    print("bond  angle | width blur grain |  bias    rms  stderr  rms(error/stderr) inside")
    everywhere = []
    for bond, degrees, camera in itertools.product((0.0, 1.5), ANGLES, CAMERAS):
        width, blur, grain = camera
        errors, stderrs, inside = [], [], []
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.pictures):
            drop = DropPicture(
                angle=np.deg2rad(degrees),
                bond_number=bond,
                base_width=width,
                blur=blur,
                grain=grain,
                lean=np.deg2rad(seed % 4 - 1.5),
            )
            result = contact_angle(draw(drop, np.random.default_rng(seed)))
            for side in (result.left, result.right):
                errors.append(side.value - degrees)
                stderrs.append(side.stderr)
                inside.append(side.low <= degrees <= side.high)
        everywhere += inside
        error, stderr = np.array(errors), np.array(stderrs)
        print(
            f"{bond:4.1f} {degrees:6d} | {width:5.0f} {blur:4.1f} {100 * grain:4.0f}% | "
            f"{error.mean():+5.2f} {np.sqrt(np.mean(error**2)):6.2f} {stderr.mean():7.2f} "
            f"{np.sqrt(np.mean((error / stderr) ** 2)):11.2f} "
            f"{np.mean(inside):13.0%}",
            flush=True,
        )
    held, sides = np.mean(everywhere), len(everywhere)
    print(f"95 % intervals hold the truth in {held:.1%} of {sides} sides")


if __name__ == "__main__":
    main()
