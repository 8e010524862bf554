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
from pbrdf.bench.measure import model_errors, reference, run, true_errors
from pbrdf.bench.scenes import CASES, Case

ESTIMATORS = {"reduced": True, "plain": False}
# Realisations of a run, and those of its reference as a multiple of the most
FULL = {
    "side": 256,
    "n_rays": 15_000,
    "realizations": (16, 64, 256),
    "seeds": 8,
    "longer": 40,
}
QUICK = {"side": 128, "n_rays": 4000, "realizations": (16, 64), "seeds": 4, "longer": 20}


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


def measure(case: Case, plan: dict[str, Any], workers: int | None) -> dict[str, Any]:
    """Errors and times of one case for both estimators and every length of run."""
    most = max(plan["realizations"])
    truth = reference(case, plan["side"], plan["n_rays"], most * plan["longer"])
    runs: list[dict[str, Any]] = []
    for name, reduced in ESTIMATORS.items():
        options = {
            "variance_reduction": reduced, "n_rays": plan["n_rays"], "workers": workers,
            "stokes": "unpolarized",
        }  # fmt: skip
        # The first run of a kind compiles
        run(case, plan["side"], realizations=2, **options)
        for realizations in plan["realizations"]:
            found = true_errors(
                case, plan["side"], truth, range(plan["seeds"]),
                realizations=realizations, **options,
            )  # fmt: skip
            runs.append({"estimator": name, "realizations": realizations} | found)
    return {
        "case": case.name, "runs": runs, "model": model_errors(case, truth),
        "gain": gain(runs),
    }  # fmt: skip


def gain(runs: list[dict[str, Any]]) -> dict[str, float | None]:
    """Divide the times to one error, plain by reduced, at the longest runs."""
    most = max(one["realizations"] for one in runs)
    ends = {one["estimator"]: one for one in runs if one["realizations"] == most}
    gains: dict[str, float | None] = {}
    for name in ("rms", "median_bin", "worst_bin"):
        slow, fast = (
            ends[key][name] ** 2 * ends[key]["seconds"] for key in ("plain", "reduced")
        )
        gains[name] = slow / fast if fast > 0.0 else None
    return gains


def draw(results: list[dict[str, Any]], path: Path) -> None:
    """Draw true error over wall time, a panel a case."""
    from matplotlib.figure import Figure

    columns = min(4, len(results))
    rows = -(-len(results) // columns)
    figure = Figure(figsize=(3.2 * columns, 2.8 * rows), layout="constrained")
    panels = np.atleast_1d(figure.subplots(rows, columns, sharey=True)).ravel()
    for panel, result in zip(panels, results, strict=False):
        for name in ESTIMATORS:
            runs = [one for one in result["runs"] if one["estimator"] == name]
            panel.loglog(
                [one["seconds"] for one in runs],
                [max(100 * one["rms"], 1e-2) for one in runs], "o-", label=name,
            )  # fmt: skip
        if result["model"] is not None:
            panel.axhline(100 * result["model"]["rms"], color="0.5", ls=":", label="model")
        panel.set_title(result["case"], fontsize="medium")
        panel.set_xlabel("wall time [s]")
    panels[0].set_ylabel("true error, rms over bins [%]")
    panels[0].legend(fontsize="small")
    for panel in panels[len(results) :]:
        panel.set_visible(False)
    figure.savefig(path, dpi=150)


def main(arguments: list[str] | None = None) -> int:
    """Run the bench and say what it found."""
    parser = argparse.ArgumentParser(prog="python -m pbrdf.bench", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small surfaces and few seeds")
    parser.add_argument("--case", action="append", choices=[one.name for one in CASES])
    parser.add_argument("--workers", type=int, default=None)
    parser.add_argument("--output", type=Path, default=Path("bench-output"))
    given = parser.parse_args(arguments)
    plan = QUICK if given.quick else FULL
    given.output.mkdir(parents=True, exist_ok=True)
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
    draw(results, given.output / "error-over-time.png")
    return 0


def table(result: dict[str, Any]) -> list[str]:
    """Lines for one case."""
    lines = [f"{result['case']}"]
    for one in result["runs"]:
        lines.append(
            f"  {one['estimator']:8} {one['realizations']:5d} realisations"
            f" {one['seconds']:8.3f} s  rms {100 * one['rms']:7.3f} %"
            f"  median {100 * one['median_bin']:7.3f} %"
            f"  worst {100 * one['worst_bin']:7.3f} %"
            f"  (reference {100 * one['reference_rms']:.3f} %)"
        )
    if result["model"] is not None:
        lines.append(f"  model    bias {100 * result['model']['rms']:.2f} %")
    told = [
        f"{name} {'more than can be told' if value is None else format(value, '.1f')}"
        for name, value in result["gain"].items()
    ]
    lines.append(f"  time to one error, plain / reduced: {', '.join(told)}")
    return lines


if __name__ == "__main__":
    sys.exit(main())
