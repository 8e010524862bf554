"""What a sweep costs beyond its simulations, and what a second worker gains."""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

from pbrdf import GaussianSurface, Material, Scene

SURFACE = GaussianSurface(shape=(32, 32), spacing=1.0, corr_length=5.0, slope_rms=0.1)
SWEEP = """
scene = "scene.toml"

[vary]
"surface.slope_rms" = {{ from = 0.05, to = 0.3 }}

[design]
kind = "latin-hypercube"
points = {points}

[simulate]
theta_i_deg = 30
n_rays = {rays}
realizations = 8
n_theta = 12
n_dphi = 24
max_bounces = 3
variance_reduction = false
"""


def one(kind: str, points: int, rays: int) -> None:
    """Run a sweep in this process and print what it took."""
    warnings.simplefilter("ignore")
    from pbrdf.sweeps import load_sweep, run_sweep

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        Scene(SURFACE, Material(1.5)).to_toml(folder / "scene.toml")
        (folder / "sweep.toml").write_text(SWEEP.format(points=points, rays=rays))
        sweep = load_sweep(folder / "sweep.toml")
        # Kernels compiled and loaded before the clock starts
        (folder / "warm.toml").write_text(SWEEP.format(points=2, rays=100))
        run_sweep(load_sweep(folder / "warm.toml"), folder / "warm.zarr", workers=1)
        started, cpu = time.perf_counter(), time.process_time()
        if kind == "serial":
            report = run_sweep(sweep, folder / "s.zarr", workers=1)
        else:
            import distributed

            workers = int(kind)
            with (
                distributed.LocalCluster(
                    n_workers=workers, threads_per_worker=1, processes=True,
                    dashboard_address=None,
                ) as cluster,
                distributed.Client(cluster) as client,
            ):  # fmt: skip
                client.run(_warm, str(folder))
                started = time.perf_counter()
                report = run_sweep(sweep, folder / "s.zarr", client=client)
                wall = time.perf_counter() - started
        wall = time.perf_counter() - started if kind == "serial" else wall
        cpu = time.process_time() - cpu
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(
        f"{kind:>6}: {points} tasks in {report.computed} groups, wall {wall:.1f} s, work "
        f"{report.seconds:.1f} s ({1e3 * report.seconds / points:.1f} ms a task), own CPU "
        f"{cpu:.1f} s, peak memory {peak:.0f} MB",
        flush=True,
    )


def _warm(folder: str) -> None:
    from pbrdf.sweeps import load_sweep, run_sweep

    place = Path(folder)
    target = place / f"warm-{os.getpid()}.zarr"
    run_sweep(load_sweep(place / "warm.toml"), target, workers=1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--one", nargs=3, metavar=("KIND", "POINTS", "RAYS"))
    parser.add_argument("--short-tasks", type=int, default=10_000)
    given = parser.parse_args()
    if given.one:
        one(given.one[0], int(given.one[1]), int(given.one[2]))
        return
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} before the run")
    runs = [("serial", 16, LONG), ("1", 16, LONG), ("2", 16, LONG)]
    runs += [
        ("serial", given.short_tasks // 10, SHORT),
        ("serial", given.short_tasks, SHORT),
    ]
    for kind, points, rays in runs:
        words = ["--one", kind, str(points), str(rays)]
        subprocess.run([sys.executable, __file__, *words], check=True)


# Rays for about one second and about ten milliseconds on a core that is free
LONG, SHORT = 300_000, 300

if __name__ == "__main__":
    main()
