"""How many cells a correlation length, and how many lengths a period, a surface needs.

python studies/surface_resolution/run.py [--surfaces 256] writes results.csv beside itself.
"""

import argparse
import csv
import warnings
from pathlib import Path

import numpy as np

from pbrdf import AccuracyWarning, GaussianSurface, Material, Scene, simulate

CELLS = (0.5, 1, 2, 3, 4, 6, 8, 12, 16)
LENGTHS = (4, 6, 8, 12, 24)
# One is varied, the other kept [cells], [correlation lengths]
ENOUGH_CELLS, ENOUGH_LENGTHS = 8, 16
SLOPE, THETA_I, RAYS = 0.3, np.deg2rad(60.0), 4000


def light(cells: float, lengths: float, surfaces: int) -> dict[str, float]:
    """Light of one, two and three or more bounces off a mirror, and its errors."""
    surface = GaussianSurface(
        shape=(round(cells * lengths), round(cells * lengths)), spacing=1.0,
        corr_length=cells, slope_rms=SLOPE,
    )  # fmt: skip
    run = simulate(
        Scene(surface, Material.mirror()), THETA_I, phi_i="uniform", fold=True,
        n_rays=RAYS, realizations=surfaces, seed=round(100 * cells + lengths),
        stokes="unpolarized",
    )  # fmt: skip
    row = {"cells": cells, "lengths": lengths}
    for name, value, error in zip(
        ("one", "two", "more"), run.albedo.values[:, 0], run.albedo_stderr.values[:, 0],
        strict=True,
    ):  # fmt: skip
        row |= {name: float(value), f"{name}_stderr": float(error)}
    return row


def main() -> None:
    """Trace both series and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--surfaces", type=int, default=256)
    surfaces = parser.parse_args().surfaces
    warnings.simplefilter("ignore", AccuracyWarning)
    cases = [(cells, ENOUGH_LENGTHS) for cells in CELLS]
    cases += [(ENOUGH_CELLS, lengths) for lengths in LENGTHS]
    # Small surfaces differ more from each other
    rows = [
        light(*case, round(surfaces * max(1.0, (ENOUGH_LENGTHS / case[1]) ** 2)))
        for case in cases
    ]
    target = Path(__file__).with_name("results.csv")
    with target.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    for row in rows:
        shown = "  ".join(
            f"{name} {row[name]:.5f} ± {row[f'{name}_stderr']:.5f}"
            for name in ("one", "two", "more")
        )
        print(f"{row['cells']:5g} cells  {row['lengths']:3g} lengths  {shown}")


if __name__ == "__main__":
    main()
