"""How far the engine goes: memory against rays and cells, and the energy of a mirror."""

import argparse
import resource
import subprocess
import sys
import time
import warnings

import numpy as np

import pbrdf

MIRROR_DEGREES = (10, 20, 30, 40, 50, 60, 70, 80, 85)


def peak(what, nodes, n_rays, **options):
    """Memory and time of one fixed surface: drawn, and traced with all 16 elements."""
    start = time.perf_counter()
    drawn = pbrdf.GaussianSurface(
        shape=(nodes, nodes), spacing=1.0, corr_length=16.0, slope_rms=0.30
    )
    scene = pbrdf.Scene(drawn.sample(1), pbrdf.Material(1.5))
    pbrdf.simulate(scene, np.deg2rad(60.0), n_rays=n_rays, **options)
    seconds = time.perf_counter() - start
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"  {what:28s} peak memory {memory:6.2f} GB, {seconds:7.1f} s", flush=True)


def peak_of_rays(n_rays):
    """Run many rays."""
    peak(f"{n_rays:.0e} rays", 512, n_rays)


def peak_of_cells(nodes):
    """Run a large surface, mesh-free."""
    peak(f"{nodes} x {nodes} cells", nodes, 1_000_000)


def peak_with_embree(nodes):
    """Run a surface with every skip off: mesh and tree included."""
    peak(f"{nodes} x {nodes} cells, Embree", nodes, 320_000, skips=False)


def mirror(n_rays):
    """Energy of a perfect mirror of slope 0.47: nothing may be lost."""
    surface = pbrdf.GaussianSurface(
        shape=(512, 512), spacing=1.0, corr_length=16.0, slope_rms=0.47
    )
    result = pbrdf.simulate(
        pbrdf.Scene(surface, pbrdf.Material.mirror()), np.deg2rad(MIRROR_DEGREES),
        n_rays=n_rays // 16, realizations=16, n_theta=9, n_dphi=12,
    )  # fmt: skip
    missing = result.albedo.sum("bounces") + result.truncated + result.leaked - 1
    for k, degrees in enumerate(MIRROR_DEGREES):
        print(
            f"  {degrees:2d} deg: |reflected + truncated + leaked - 1| "
            f"{abs(float(missing[k])):.1e}, leaked {result.attrs['rays_leaked'][k]}, "
            f"truncated {result.attrs['rays_truncated'][k]} of {n_rays} rays"
        )


def main():
    """Print every figure, each measurement of memory in a process of its own."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=["rays", "cells", "embree", "mirror"])
    parser.add_argument("--value", type=float)
    options = parser.parse_args()
    warnings.simplefilter("ignore", pbrdf.AccuracyWarning)
    works = {
        "rays": peak_of_rays, "cells": peak_of_cells, "embree": peak_with_embree,
        "mirror": mirror,
    }  # fmt: skip
    if options.only:
        works[options.only](int(options.value))
        return
    for name, value in (
        ("rays", 1e6), ("rays", 1e7), ("rays", 1e8), ("cells", 1024), ("cells", 4096),
        ("embree", 1024), ("mirror", 1e7),
    ):  # fmt: skip
        command = [sys.executable, __file__, "--only", name, "--value", str(value)]
        subprocess.run(command, check=True)


if __name__ == "__main__":
    main()
