"""Bias, spread and coverage of surface statistics on surfaces whose truth is known.

Each row is one kind of measurement of the same ensemble: Gaussian autocorrelation,
height_rms 2.6 um, corr_length 14.5 um, hence slope_rms 0.2536. Run with

    python studies/surface_statistics/benchmark.py --realisations 400
"""

import argparse
import time
from dataclasses import dataclass

import numpy as np
from scipy import fft

from data_io import Profile
from fitting import surface_statistics

HEIGHT, LENGTH = 2.6, 14.5
TRUTH = np.array([HEIGHT, LENGTH, np.sqrt(2) * HEIGHT / LENGTH])


@dataclass(frozen=True)
class Case:
    """One instrument: spacing, noise and rounding step. [um]"""

    name: str
    spacing: float = 1.0
    noise: float = 0.0
    step: float = 0.0


CASES = (
    Case("clean"),
    Case("noise 0.05", noise=0.05),
    Case("noise 0.1", noise=0.1),
    Case("noise 0.26", noise=0.26),
    Case("noise 0.5", noise=0.5),
    Case("pixel 0.25", spacing=0.25, step=0.25),
    Case("pixel 0.5", spacing=0.5, step=0.5),
    Case("pixel 1", spacing=1.0, step=1.0),
    Case("pixel 2", spacing=2.0, step=2.0),
)


def draw_heights(n: int, spacing: float, rng: np.random.Generator) -> np.ndarray:
    """Cut n heights from a much longer periodic Gaussian process with random amplitudes."""
    size = fft.next_fast_len(2 * n + int(20 * LENGTH / spacing), real=True)
    f = fft.rfftfreq(size, spacing)
    spectrum = HEIGHT**2 * np.sqrt(np.pi) * LENGTH * np.exp(-((np.pi * LENGTH * f) ** 2))
    # White noise has the spectrum `spacing`: its transform takes the root of the ratio
    white = fft.rfft(rng.standard_normal(size))
    return fft.irfft(white * np.sqrt(spectrum / spacing), size)[:n]


def measure(
    case: Case, length: float, rng: np.random.Generator
) -> tuple[Profile, np.ndarray]:
    """Give the profile as the instrument reports it, and the true heights."""
    n = int(length * LENGTH / case.spacing)
    true = draw_heights(n, case.spacing, rng)
    z = true + case.noise * rng.standard_normal(n) + rng.uniform(-1, 1)
    if case.step > 0:
        z = case.step * np.round(z / case.step)
    return Profile(np.arange(n) * case.spacing, z), true


def plain(profile: Profile) -> np.ndarray:
    """Uncorrected height, 1/e length and rms of forward differences."""
    z = profile.z - profile.z.mean()
    spacing = profile.x[1] - profile.x[0]
    power = np.abs(fft.rfft(z, 2 * z.size)) ** 2
    rho = fft.irfft(power)[: z.size]
    rho = rho / rho[0]
    k = int(np.argmax(rho < np.exp(-1)))
    length = (k - (np.exp(-1) - rho[k]) / (rho[k - 1] - rho[k])) * spacing
    return np.array([z.std(), length, np.sqrt(np.mean((np.diff(z) / spacing) ** 2))])


def run_case(case: Case, length: float, n: int, seed: int) -> dict[str, np.ndarray]:
    """Collect estimates, intervals and plain values over n realisations."""
    rng = np.random.default_rng(seed)
    rows, raw, clean, forms = [], [], [], []
    for _ in range(n):
        profile, true = measure(case, length, rng)
        found = surface_statistics(profile)
        rows.append(
            [
                (e.value, e.low, e.high)
                for e in (found.height_rms, found.corr_length, found.slope_rms)
            ]
        )
        raw.append(plain(profile))
        clean.append(plain(Profile(profile.x, true)))
        forms.append(found.autocorrelation.is_gaussian)
    return {
        "found": np.array(rows),
        "plain": np.array(raw),
        "clean": np.array(clean),
        "gaussian": np.array(forms),
    }


def report(case: Case, length: float, data: dict[str, np.ndarray]) -> str:
    """One row: bias [%], spread over the plain one's on clean data, coverage [%]."""
    value, low, high = np.moveaxis(data["found"], 2, 0)
    bias = 100 * (np.sqrt(np.mean(value**2, axis=0)) / TRUTH - 1)
    spread = value.std(axis=0) / data["clean"].std(axis=0)
    cover = 100 * np.mean((low <= TRUTH) & (high >= TRUTH), axis=0)
    naive = 100 * (np.sqrt(np.mean(data["plain"] ** 2, axis=0)) / TRUTH - 1)
    cells = [f"{case.name:>11}", f"{length:4.0f}"]
    cells += ["  ".join(f"{b:+6.1f}" for b in bias)]
    cells += ["  ".join(f"{s:5.2f}" for s in spread)]
    cells += ["  ".join(f"{c:5.1f}" for c in cover)]
    cells += ["  ".join(f"{b:+7.1f}" for b in naive)]
    cells += [f"{100 * data['gaussian'].mean():5.1f}"]
    return " | ".join(cells)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--realisations", type=int, default=400)
    parser.add_argument("--lengths", type=float, nargs="+", default=[20, 50, 100])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cases", nargs="+", default=None, help="substrings of case names")
    options = parser.parse_args()
    print(
        f"{options.realisations} realisations, seed {options.seed}; columns of three: "
        "height_rms, corr_length, slope_rms"
    )
    print(
        f"{'case':>11} |  L/l | {'bias of the rms [%]':^22} | {'spread / plain':^19} | "
        f"{'coverage [%]':^19} | {'plain bias [%]':^25} | Gaussian [%]"
    )
    for length in options.lengths:
        for case in CASES:
            if options.cases and not any(part in case.name for part in options.cases):
                continue
            started = time.perf_counter()
            data = run_case(case, length, options.realisations, options.seed)
            took = 1e3 * (time.perf_counter() - started) / options.realisations
            print(report(case, length, data), f"| {took:.0f} ms", flush=True)


if __name__ == "__main__":
    main()
