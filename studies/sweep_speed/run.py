"""What a sweep costs beyond its simulations, and what workers and shared traces gain.

Besides wall time it counts CPU time of all processes, which other jobs on the machine
lengthen less.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

from pbrdf import GaussianSurface, Material, Scene

SURFACE = GaussianSurface(shape=(32, 32), spacing=1.0, corr_length=5.0, slope_rms=0.1)
SAMPLED = """
"surface.slope_rms" = {{ from = 0.05, to = 0.3 }}

[design]
kind = "latin-hypercube"
points = {points}
"""
MATERIALS = """
"surface.slope_rms" = [0.05, 0.1, 0.2, 0.3]
n = [1.3, 1.4, 1.5, 1.6, 1.8, 2.0, 2.2, 2.4]
"""
SWEEP = """
scene = "scene.toml"

[vary]
{vary}

[simulate]
theta_i_deg = 30
phi_i_deg = 0
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
    from pbrdf.sweeps import layout, load_sweep, run_sweep

    vary = MATERIALS if kind in ("joint", "alone") else SAMPLED.format(points=points)
    if kind == "alone":
        layout._MOST_SECONDS = layout._JOINT_BYTES = 0.0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        Scene(SURFACE, Material(1.5)).to_toml(folder / "scene.toml")
        (folder / "sweep.toml").write_text(SWEEP.format(vary=vary, rays=rays))
        # Kernels compiled and loaded before the clock starts
        warm = SWEEP.format(vary=SAMPLED.format(points=2), rays=100)
        (folder / "warm.toml").write_text(warm)
        _warm(name)
        sweep, target = load_sweep(folder / "sweep.toml"), folder / "s.zarr"
        count_inside()
        (_, inside), cpu, started = _used(), time.process_time(), time.perf_counter()
        if not kind.isdigit():
            report = run_sweep(sweep, target, workers=1)
            wall = time.perf_counter() - started
            inside = _used()[1] - inside
        else:
            import distributed

            with (
                distributed.LocalCluster(
                    n_workers=int(kind), threads_per_worker=1, processes=True,
                    dashboard_address=None,
                ) as cluster,
                distributed.Client(cluster) as client,
            ):  # fmt: skip
                client.run(_warm, name)
                client.run(count_inside)
                cpu, started = time.process_time(), time.perf_counter()
                before = client.run(_used)
                report = run_sweep(sweep, target, client=client)
                wall = time.perf_counter() - started
                used = [
                    [b - a for a, b in zip(before[key], after, strict=True)]
                    for key, after in client.run(_used).items()
                ]
                inside = sum(row[1] for row in used)
                cpu -= sum(row[0] for row in used)
        cpu = time.process_time() - cpu
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(
        f"{kind:>6}: {points} tasks in {report.computed} groups, wall {wall:.1f} s, work "
        f"{report.seconds:.1f} s, CPU {cpu:.1f} s, of it in simulations {inside:.1f} s "
        f"({1e3 * inside / points:.1f} ms a task), CPU over that {cpu / inside:.3f}, wall "
        f"over work {wall / report.seconds:.2f}, peak memory of this process {peak:.0f} MB",
        flush=True,
    )


def count_inside() -> None:
    """Count the CPU time inside of simulations from now on."""
    from pbrdf.sweeps import tasks

    def counted(run: Any) -> Any:
        def counting(*args: Any, **given: Any) -> Any:
            started = time.process_time()
            try:
                return run(*args, **given)
            finally:
                tasks.inside += time.process_time() - started

        return counting

    # On the module: workers have this file only function by function
    tasks.inside = 0.0
    tasks.simulate = counted(tasks.simulate)
    tasks.simulate_together = counted(tasks.simulate_together)


def _used() -> tuple[float, float]:
    from pbrdf.sweeps import tasks

    return time.process_time(), tasks.inside


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
        ("alone", 32, MIDDLE),
        ("joint", 32, MIDDLE),
    ]
    for kind, points, rays in runs:
        words = ["--one", kind, str(points), str(rays)]
        subprocess.run([sys.executable, __file__, *words], check=True)


# Rays for about one second and about ten milliseconds on a core that is free
LONG, MIDDLE, SHORT = 1_300_000, 200_000, 300

if __name__ == "__main__":
    main()
