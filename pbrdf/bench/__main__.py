"""Print, store and draw run time against true error."""

import argparse
import json
import os
import platform
import subprocess
import sys
from pathlib import Path
from typing import Any

import numba
import numpy as np

from pbrdf import __version__
from pbrdf.bench.errors_over_time import measure
from pbrdf.bench.scenes import CASES

# Nodes a side, rays and realisations of the shortest run, seeds, the rms error sought, and
# the core-seconds that a way or the reference of a case may take
FULL = {
    "side": 256, "n_rays": 15_000, "realizations": 16, "seeds": 8, "error": 0.003,
    "core_seconds": 120.0,
}  # fmt: skip
QUICK = FULL | {"side": 128, "n_rays": 4000, "seeds": 4, "error": 0.01, "core_seconds": 8.0}
# Of the figure [%]
LOWEST = 0.1
LOOKS = {
    "reduced": "C0o-", "plain": "C1s-", "NumPy + embreex": "C2^-",
    "Mitsuba 3": "C4v-",
}  # fmt: skip


def machine() -> dict[str, Any]:
    """Where and what was run."""
    folder = Path(__file__).parent
    try:
        commit = subprocess.run(
            ["git", "rev-parse", "HEAD"],
            cwd=folder,
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        commit = "unknown"
    return {
        "version": __version__, "commit": commit, "python": platform.python_version(),
        "numba": numba.__version__, "numpy": np.__version__, "system": platform.platform(),
        "processor": _processor(), "cores": os.cpu_count(),
    }  # fmt: skip


def _processor() -> str:
    information = Path("/proc/cpuinfo")
    if information.exists():
        for line in information.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor()


def draw(results: list[dict[str, Any]], path: Path) -> None:
    """Draw true error over processor time, a panel a case."""
    from matplotlib.figure import Figure

    columns = min(4, len(results))
    rows = -(-len(results) // columns)
    figure = Figure(figsize=(3.0 * columns, 2.6 * rows), layout="constrained")
    panels = np.atleast_1d(figure.subplots(rows, columns, sharex=True, sharey=True)).ravel()
    seen: dict[str, Any] = {}
    lengths = [
        one
        for result in results
        for found in result["ways"].values()
        for one in found["runs"]
    ]
    seconds = [one["core_seconds"] for one in lengths]
    span = np.geomspace(0.5 * min(seconds), 2.0 * max(seconds), 50)
    highest = 150.0 * max(one["rms"] for one in lengths)
    for panel, result in zip(panels, results, strict=False):
        for name, found in result["ways"].items():
            times, errors = np.array(
                [[one["core_seconds"], 100.0 * one["rms"]] for one in found["runs"]]
            ).T
            # Exact results lie on the lower edge
            (line,) = panel.loglog(
                times,
                np.maximum(errors, LOWEST),
                LOOKS[name],
                ms=4,
                clip_on=False,
                zorder=3,
            )
            seen.setdefault(name, line)
            # What the spread at all lengths foretells for others
            spread = 100.0 * np.sqrt(found["variance"]["rms"] / span)
            panel.loglog(span, spread, color=line.get_color(), lw=0.7, alpha=0.6)
        if result["model_rms"] is not None:
            seen["model"] = panel.axhline(100.0 * result["model_rms"], color="0.4", ls=":")
        panel.axhline(1.0, color="0.8", lw=0.8, zorder=0)
        panel.set_xlim(span[0], span[-1])
        panel.set_ylim(LOWEST, highest)
        panel.set_title(_title(result), fontsize="medium")
    for panel in panels[: len(results)][-columns:]:
        panel.set_xlabel("processor time [s]")
        panel.tick_params(labelbottom=True)
    for panel in panels[::columns]:
        panel.set_ylabel("true error, rms [%]")
    for panel in panels[len(results) :]:
        panel.set_visible(False)
    figure.legend(seen.values(), seen, loc="outside lower center", ncols=len(seen))
    figure.savefig(path, dpi=110)


def _title(result: dict[str, Any]) -> str:
    if result["gain"] is None:
        return str(result["case"])
    gained = result["gain"]["rms"]
    if gained is None:
        return f"{result['case']}: exact"
    return f"{result['case']}: {gained:.{0 if gained >= 10.0 else 1}f} times"


def table(result: dict[str, Any]) -> list[str]:
    """Lines for one case."""
    lines = [
        f"{result['case']}: {result['bins']} bins above a tenth of the peak, "
        f"reference to {100 * result['reference_rms']:.2f} %"
    ]
    for name, found in result["ways"].items():
        for one in found["runs"]:
            bias = np.sqrt(abs(one["bias_squared"]))
            sign = "" if one["bias_squared"] > 0 else "under "
            lines.append(
                f"  {name:15} {one['realizations']:6d} realisations"
                f" {one['core_seconds']:8.3f} s of processor, {one['seconds']:8.3f} s"
                f"   rms {100 * one['rms']:7.3f} %   bias {sign}{100 * bias:.2f} %"
            )
        to_one = found["variance"]["rms"] / 0.01**2
        slope = "-" if found["slope"] is None else f"{found['slope']:.2f}"
        lines.append(f"  {name:15} 1 % in {to_one:.3g} s of processor, slope {slope}")
    if result["model_rms"] is not None:
        lines.append(f"  model           bias {100 * result['model_rms']:.2f} %")
    if result["gain"] is not None:
        told = [
            f"{name} {'without end' if value is None else format(value, '.1f')}"
            for name, value in result["gain"].items()
        ]
        lines.append(f"  time to one error, plain / reduced: {', '.join(told)}")
    parts = result["stages"]
    lines.append(
        f"  stages: {1e3 * parts['call']:.1f} ms a call, "
        f"{1e3 * parts['realization']:.2f} ms a realisation, "
        f"{parts['million_rays']:.2f} s a million rays"
    )
    return lines


def main(arguments: list[str] | None = None) -> int:
    """Run the bench and say what it found."""
    parser = argparse.ArgumentParser(prog="python -m pbrdf.bench", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small surfaces and few seeds")
    parser.add_argument("--case", action="append", choices=[one.name for one in CASES])
    parser.add_argument("--workers", type=int, default=1, help="threads of the engine")
    parser.add_argument(
        "--core-seconds", type=float, help="of the longest runs of a way, and a reference"
    )
    parser.add_argument("--output", type=Path, default=Path("bench-output"))
    parser.add_argument(
        "--draw", type=Path, metavar="JSON", help="only draw what an earlier run stored"
    )
    given = parser.parse_args(arguments)
    given.output.mkdir(parents=True, exist_ok=True)
    figure = given.output / "error-over-time.png"
    if given.draw:
        draw(json.loads(given.draw.read_text())["results"], figure)
        return 0
    plan: dict[str, Any] = dict(QUICK if given.quick else FULL)
    if given.core_seconds is not None:
        plan["core_seconds"] = given.core_seconds
    results = []
    for case in CASES:
        if given.case and case.name not in given.case:
            continue
        results.append(measure(case, plan, given.workers))
        for line in table(results[-1]):
            sys.stdout.write(line + "\n")
        sys.stdout.flush()
        record = {"machine": machine(), "plan": plan, "results": results}
        (given.output / "bench.json").write_text(json.dumps(record, indent=1))
    draw(results, figure)
    return 0


if __name__ == "__main__":
    sys.exit(main())
