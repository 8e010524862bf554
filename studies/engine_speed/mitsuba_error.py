"""Time to 1 % in all bins: this engine beside a loop over Mitsuba 3, on the same surfaces.

Needs Mitsuba and this project in one environment; see `pbrdf/bench/mitsuba_loop.py`. Both
use all cores, draw 512 x 512 cells a realisation and count everything but the start of
Python; the engine is counted once more as a whole command, from TOML file to netCDF file.
"""

import argparse
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
from run import SLOPE, surface

import pbrdf
from pbrdf.bench import mitsuba_loop as loop

THETA, PHI, N = 60.0, 0.3, 1.5
BINS = (18, 36)
SCENE = """
[surface]
type = "gaussian"
shape = [512, 512]
spacing_um = 1.0
corr_length_um = 16.0
slope_rms = {slope}

[substrate]
n = {n}
"""


def largest_error(m00):
    """Largest standard error over mean of bins above a tenth of the peak radiance.

    m00     light of unit flux by sample and bin, shape (samples, n_theta, n_dphi)
    """
    mean = m00.mean(axis=0)
    stderr = m00.std(axis=0, ddof=1) / np.sqrt(len(m00))
    edges = np.linspace(0.0, np.pi / 2, m00.shape[1] + 1)
    radiance = mean / np.diff(np.sin(edges) ** 2)[:, None]
    bright = radiance > 0.1 * radiance.max()
    return float((stderr[bright] / mean[bright]).max())


def by_mitsuba(side, realizations):
    """Error, seconds, albedo by bounces, and the share of time for meshes and trees."""
    drawn, samples, building = surface(SLOPE), [], 0.0
    start = time.perf_counter()
    for seed in range(realizations):
        heights = drawn.sample(seed).heights
        flux = loop.no_light(BINS)
        begun = time.perf_counter()
        scene = loop.build_scene(heights)
        building += time.perf_counter() - begun
        loop.trace(scene, heights, np.deg2rad(THETA), PHI, N, side, flux, BINS, seed)
        samples.append(np.array(flux).reshape(3, *BINS, 16)[..., 0])
    took = time.perf_counter() - start
    light = np.array(samples) / side**2
    albedo = light.sum(axis=(2, 3)).mean(axis=0)
    return largest_error(light.sum(axis=1)), took, albedo, building / took


def by_engine(n_rays, realizations, **how):
    """Error, seconds and albedo by bounces of the engine."""
    scene = pbrdf.Scene(surface(SLOPE), pbrdf.Material(N))
    start = time.perf_counter()
    result = pbrdf.simulate(
        scene, np.deg2rad(THETA), n_rays=n_rays, realizations=realizations,
        n_theta=BINS[0], n_dphi=BINS[1], **how,
    )  # fmt: skip
    took = time.perf_counter() - start
    return result.attrs["rel_error"], took, result.albedo.values.ravel()


def by_command(n_rays, target):
    """Seconds of the whole command for a target error."""
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.toml"
        scene.write_text(SCENE.format(slope=SLOPE, n=N))
        start = time.perf_counter()
        subprocess.run(
            [
                sys.executable, "-m", "pbrdf", "simulate", str(scene),
                "--theta-i-deg", str(THETA), "--phi-i-deg", "uniform", "--fold",
                "--n-rays", str(n_rays), "--target-rel-error", str(target),
                "--n-theta", str(BINS[0]), "--n-dphi", str(BINS[1]),
                "--output", str(Path(folder) / "out.nc"),
            ],
            check=True, capture_output=True,
        )  # fmt: skip
        return time.perf_counter() - start


def show(name, error, took, albedo):
    """Print a run, and carry it on to 1 % by the square root of its realisations."""
    to_one = took * (error / 0.01) ** 2
    parts = " ".join(f"{part:.5f}" for part in albedo)
    print(f"  {name:34s} {100 * error:5.2f} % in {took:6.2f} s; 1 % in {to_one:7.1f} s"
          f"   albedo {parts}")  # fmt: skip
    return to_one


def main():
    """Print every run, and the ratios of the best."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--realizations", type=int, default=32)
    options = parser.parse_args()
    warnings.simplefilter("ignore", pbrdf.AccuracyWarning)
    many = options.realizations
    by_mitsuba(128, 2)
    by_engine(1000, 2)
    one, all_azimuths, peer, traced = [], [], [], []
    for side in (128, 256, 512):
        n_rays = side**2
        *loops, built = by_mitsuba(side, many)
        peer.append(show(f"Mitsuba {n_rays} rays, built {built:.0%}", *loops))
        traced.append(peer[-1] * (1.0 - built))
        one.append(show(f"engine {n_rays} rays", *by_engine(n_rays, many, phi_i=PHI)))
        all_azimuths.append(
            show(
                f"engine {n_rays} rays, folded",
                *by_engine(n_rays, many, phi_i="uniform", fold=True),
            )
        )
    for name, engine in (("one azimuth", one), ("all azimuths", all_azimuths)):
        print(
            f"  engine, {name}: {min(peer) / min(engine):.1f} times faster (goal 5), "
            f"{min(traced) / min(engine):.1f} without Mitsuba's meshes and trees"
        )
    whole = by_command(256**2, 0.01)
    print(
        f"  whole command to 1 %: {whole:.1f} s, {min(peer) / whole:.1f} times faster "
        "than the loop alone"
    )


if __name__ == "__main__":
    main()
