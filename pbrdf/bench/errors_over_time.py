"""True errors of runs against a long run of the plain estimator, over their times."""

from dataclasses import replace
from typing import Any

import numpy as np

from pbrdf.bench.programs import Size, Way, model_light, plain, programs_for, reduced
from pbrdf.bench.scenes import Case

# Bins above this part of the peak count
BRIGHT = 0.1
# Streams of the reference, which no run uses
REFERENCE = 990_001
PILOT = 64


def reference(case: Case, size: Size, error: float, core_seconds: float) -> dict[str, Any]:
    """Run the plain estimator to an rms error, or for as long as there is time.

    Returns its value and error (wavelengths, bins) and the bins that count.
    """
    longer = replace(size, realizations=PILOT, seed=REFERENCE)
    for _ in range(2):
        found = plain(case, longer)
        peak = found.value.max(axis=1, keepdims=True)
        bright = found.value > BRIGHT * peak
        reached = float(np.sqrt(np.mean((found.error[bright] / found.value[bright]) ** 2)))
        wanted = min((reached / error) ** 2, core_seconds / found.core_seconds)
        if wanted <= 1.0:
            break
        longer = replace(longer, realizations=int(longer.realizations * wanted))
    return {"value": found.value, "error": found.error, "bright": bright, "rms": reached}


def one_length(
    case: Case, way: Way, size: Size, truth: dict[str, Any], seeds: int
) -> dict[str, Any]:
    """Run a way with several seeds.

    The mean square of its error is the variance between seeds, which needs no reference,
    and the square of the bias of their mean, of which the reference's own and the seeds'
    part is taken off.
    """
    bright = truth["bright"]
    runs = [way(case, replace(size, seed=1 + seed)) for seed in range(seeds)]
    relative = np.array([run.value[bright] / truth["value"][bright] - 1.0 for run in runs])
    spread = relative.var(axis=0, ddof=1)
    own = (truth["error"][bright] / truth["value"][bright]) ** 2
    bias = float((relative.mean(axis=0) ** 2 - spread / seeds - own).mean())
    seconds, core = (
        float(np.median([getattr(run, name) for run in runs]))
        for name in ("seconds", "core_seconds")
    )
    return {
        "realizations": size.realizations, "seconds": seconds, "core_seconds": core,
        "rms": float(np.sqrt(spread.mean() + max(bias, 0.0))),
        "spread": spread, "bias_squared": bias,
        "reference_rms": float(np.sqrt(own.mean())),
    }  # fmt: skip


def one_way(
    case: Case, way: Way, size: Size, truth: dict[str, Any], plan: dict[str, Any]
) -> dict[str, Any]:
    """Run a way four times longer each time, until it is accurate or takes too long.

    `variance` (wavelengths x bins that count) is that of one core-second, from the spread
    at every length; `slope` the exponent of the rms error over time.
    """
    runs: list[dict[str, Any]] = []
    # The first run of a kind compiles
    for seed in (0, 1):
        found = way(case, replace(size, realizations=2, seed=seed))
    # A slow program gets shorter runs and fewer of them
    realizations, seeds = plan["realizations"], plan["seeds"]
    affordable = 2.0 * plan["core_seconds"] / max(found.core_seconds, 1e-9)
    while realizations * seeds > affordable and (realizations, seeds) != (4, 4):
        realizations, seeds = max(realizations // 2, 4), max(seeds // 2, 4)
    while True:
        longer = replace(size, realizations=realizations)
        runs.append(one_length(case, way, longer, truth, seeds))
        last = runs[-1]
        enough = len(runs) > 1 and last["rms"] < plan["error"]
        if enough or 4.0 * last["core_seconds"] * seeds > plan["core_seconds"]:
            break
        realizations *= 4
    spreads = [run.pop("spread") for run in runs]
    # Of one core-second, as the longest run spends them: what a call costs is shared
    variance = np.mean(
        [spread * run["realizations"] for spread, run in zip(spreads, runs, strict=True)],
        axis=0,
    ) * (last["core_seconds"] / last["realizations"])
    mean = float(variance.mean())
    slope = None
    if len(runs) > 1 and all(run["rms"] > 0.0 for run in runs):
        times, errors = np.log([[run["core_seconds"], run["rms"]] for run in runs]).T
        slope = float(np.polyfit(times, errors, 1)[0])
    return {
        "runs": runs, "slope": slope,
        "efficiency": 1.0 / mean if mean > 0.0 else None,
        "variance": {
            "rms": mean, "median_bin": float(np.median(variance)),
            "worst_bin": float(variance.max()),
        },
    }  # fmt: skip


def measure(case: Case, plan: dict[str, Any], workers: int | None) -> dict[str, Any]:
    """Measure all ways of a case, and what one gains over another."""
    size = Size(
        side=plan["side"], n_rays=plan["n_rays"], realizations=plan["realizations"],
        seed=0, workers=workers,
    )  # fmt: skip
    truth = reference(case, size, plan["error"] / 2.0, plan["core_seconds"])
    found = {
        name: one_way(case, way, size, truth, plan)
        for name, way in programs_for(case).items()
    }
    return {
        "case": case.name, "bins": int(truth["bright"].sum()),
        "reference_rms": truth["rms"], "ways": found, "model_rms": _floor(case, truth),
        "gain": gain(found, "plain", "reduced"), "stages": stages(case, size),
    }  # fmt: skip


def _floor(case: Case, truth: dict[str, Any]) -> float | None:
    value = model_light(case)
    if value is None:
        return None
    bright = truth["bright"]
    square = (value[bright] / truth["value"][bright] - 1.0) ** 2
    own = (truth["error"][bright] / truth["value"][bright]) ** 2
    return float(np.sqrt(max((square - own).mean(), 0.0)))


def gain(found: dict[str, Any], slow: str, fast: str) -> dict[str, float | None] | None:
    """Divide the times to one error of two ways; None where a bin has no noise left."""
    if slow not in found or fast not in found:
        return None
    by_slow, by_fast = found[slow]["variance"], found[fast]["variance"]
    return {
        name: by_slow[name] / by_fast[name] if by_fast[name] > 0.0 else None
        for name in by_slow
    }


def stages(case: Case, size: Size) -> dict[str, float]:
    """Core-seconds of a call, a realisation (its surface and sums) and a million rays.

    Solved from three runs that differ in realisations and rays, each the least of three.
    """
    few, many, rays = 8, 32, 4 * size.n_rays

    def least(**changes: Any) -> float:
        longer = replace(size, **changes)
        return min(reduced(case, longer).core_seconds for _ in range(3))

    short = least(realizations=few)
    long = least(realizations=many)
    dense = least(realizations=few, n_rays=rays)
    ray = max(dense - short, 0.0) / (few * (rays - size.n_rays))
    sample = max((long - short) / (many - few) - ray * size.n_rays, 0.0)
    call = max(short - few * (sample + ray * size.n_rays), 0.0)
    return {"call": call, "realization": sample, "million_rays": 1e6 * ray}
