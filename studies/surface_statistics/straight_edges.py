"""Print how often intervals of nearly straight profiles in noise hold the truth."""

import argparse
import warnings

import numpy as np

from data_io import Profile
from fitting import surface_statistics

SPACING = 0.1176
# Points, height_rms [um], corr_length [um], noise [um]
CASES = (
    (340, 0.06, 2.0, 0.15),
    (340, 0.06, 4.0, 0.15),
    (150, 0.06, 2.0, 0.10),
    (340, 0.03, 2.0, 0.15),
    (340, 0.02, 8.0, 0.05),
    (340, 0.10, 8.0, 0.02),
    (340, 0.30, 2.0, 0.05),
    (340, 0.10, 2.0, 0.0),
)


def straight_edge(
    rng: np.random.Generator, points: int, height: float, length: float, noise: float
) -> Profile:
    """Draw a profile of Gaussian autocorrelation, its height exact in the ensemble."""
    wave_number = 2 * np.pi * np.fft.rfftfreq(8 * points, SPACING)
    filtered = np.exp(-((wave_number * length) ** 2) / 8)
    scale = height / np.sqrt(np.fft.irfft(filtered**2)[0])
    z = np.fft.irfft(np.fft.rfft(rng.normal(size=8 * points)) * filtered) * scale
    return Profile(
        np.arange(points) * SPACING, z[:points] + noise * rng.normal(size=points)
    )


def main() -> None:
    """Print coverage of height, slope and correlation length, case by case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--profiles", type=int, default=40)
    parser.add_argument("--first-seed", type=int, default=0)
    arguments = parser.parse_args()
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.profiles)
    warnings.simplefilter("ignore")
    for points, height, length, noise in CASES:
        truth = height, np.sqrt(2) * height / length, length
        held = np.zeros(3)
        for seed in seeds:
            rng = np.random.default_rng(seed)
            profile = straight_edge(rng, points, height, length, noise)
            found = surface_statistics(profile)
            estimates = found.height_rms, found.slope_rms, found.corr_length
            held += [e.low <= t <= e.high for e, t in zip(estimates, truth, strict=True)]
        shares = "  ".join(f"{share:.2f}" for share in held / len(seeds))
        print(
            f"{points:4d} {height:5.2f} {length:4.1f} {noise:5.2f}   {shares}", flush=True
        )


if __name__ == "__main__":
    main()
