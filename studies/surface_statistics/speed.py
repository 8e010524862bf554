"""Print how long the statistics of a large profile and map take; see README.md."""

import time

import numpy as np
from scipy.ndimage import gaussian_filter1d

from data_io import Profile
from fitting import surface_statistics
from pbrdf import HeightMap

HEIGHT_RMS, CORR_LENGTH = 2.6, 14.5


def large_map(n: int, rng: np.random.Generator) -> HeightMap:
    """Draw a periodic map of n x n heights with Gaussian autocorrelation."""
    frequency = np.hypot(np.fft.fftfreq(n)[:, None], np.fft.rfftfreq(n)[None])
    amplitude = np.exp(-((np.pi * CORR_LENGTH * frequency) ** 2) / 2)
    heights = np.fft.irfft2(np.fft.rfft2(rng.standard_normal((n, n))) * amplitude)
    return HeightMap(heights * HEIGHT_RMS / heights.std(), 1.0)


def large_profile(n: int, rng: np.random.Generator) -> Profile:
    """Draw a periodic profile of n heights with Gaussian autocorrelation."""
    heights = gaussian_filter1d(rng.standard_normal(n), CORR_LENGTH / 2, mode="wrap")
    return Profile(np.arange(n) * 1.0, heights * HEIGHT_RMS / heights.std())


def main() -> None:
    """Print CPU and wall time of each."""
    rng = np.random.default_rng(1)
    for name, surface in (
        ("profile of 1e6 points", large_profile(1_000_000, rng)),
        ("map of 4096 x 4096", large_map(4096, rng)),
    ):
        wall, cpu = time.perf_counter(), time.process_time()
        slope = surface_statistics(surface).slope_rms
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        print(f"{name}: {cpu:.2f} s of CPU time, {wall:.2f} s; slope rms {slope}")


if __name__ == "__main__":
    main()
