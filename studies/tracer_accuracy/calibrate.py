"""Limits of the whole-set statistics of the rough-surface reference, and honest error bars.

Run `python -m studies.tracer_accuracy.calibrate --seeds 100` in the checkout. Writes
tests/statistical/rough_limits.json, which tests/statistical/test_tracer_reference.py reads,
and error_bars.csv beside this file. The README says what is expected and what came out.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np
import pandas as pd

from tests.rough_reference import compare, run, statistics

HERE = Path(__file__).parent
LIMITS = HERE.parents[1] / "tests" / "statistical" / "rough_limits.json"
# The run that the test makes
SETTING = {"side": 512, "n_rays": 20_000, "realizations": 64}
# Share of correct programs that a limit may reject
FALSE_ALARM = 0.002


def collect(seeds, workers):
    """Values and standard errors (seeds, rows) of all compared numbers, and their rows."""
    values, errors = [], []
    for seed in range(seeds):
        start = time.perf_counter()
        rows = compare(run(seed=1000 + seed, workers=workers, **SETTING))
        values.append(rows.value.to_numpy())
        errors.append(rows.stderr.to_numpy())
        print(f"seed {seed}: {time.perf_counter() - start:.1f} s", flush=True)
    return np.array(values), np.array(errors), rows


def self_test(values, errors, rows):
    """Statistics of every seed against the mean of the others, with the reference's noise.

    The reference itself does not enter, so that the limits cannot hide a deviation from it.
    """
    rng = np.random.default_rng(7)
    found = []
    for k in range(len(values)):
        others = np.delete(np.arange(len(values)), k)
        truth = values[others].mean(axis=0)
        truth_se = values[others].std(axis=0, ddof=1) / np.sqrt(len(others))
        noisy = truth + rows.reference_se * rng.standard_normal(len(rows))
        combined = np.sqrt(errors[k] ** 2 + rows.reference_se**2 + truth_se**2)
        frame = rows.assign(z=(values[k] - noisy) / combined)
        found.append(statistics(frame))
    return pd.DataFrame(found)


def upper_limit(sample):
    """Limit exceeded with probability FALSE_ALARM, from a log-normal through the sample."""
    logs = np.log(sample)
    normal_quantile = 2.878  # of 1 - FALSE_ALARM
    return float(np.exp(logs.mean() + normal_quantile * logs.std(ddof=1)))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="raw numbers: read, or written if new")
    arguments = parser.parse_args()
    if arguments.keep and arguments.keep.exists():
        kept = np.load(arguments.keep, allow_pickle=True)
        values, errors = kept["values"], kept["errors"]
        rows = pd.DataFrame(kept["rows"]).drop(columns="index")
    else:
        values, errors, rows = collect(arguments.seeds, arguments.workers)
        if arguments.keep:
            np.savez(arguments.keep, values=values, errors=errors, rows=rows.to_records())

    found = self_test(values, errors, rows)
    print(found.describe())
    document = {
        "setting": SETTING | {"seeds": len(values)},
        "false_alarm": FALSE_ALARM,
        "limits": {name: upper_limit(found[name]) for name in found},
        "median": {name: float(found[name].median()) for name in found},
        "largest": {name: float(found[name].max()) for name in found},
    }
    LIMITS.write_text(json.dumps(document, indent=1) + "\n")

    deviation = (values - rows.reference.to_numpy()) / np.hypot(errors, rows.reference_se)
    worst = np.abs(deviation).max(axis=1)
    print(f"seeds with a number beyond 5: {(worst > 5).mean()}, largest {worst.max():.1f}")
    mean_error = values.std(axis=0, ddof=1) / np.sqrt(len(values))
    of_mean = (values.mean(axis=0) - rows.reference) / np.hypot(
        mean_error, rows.reference_se
    )
    print(f"mean of all seeds: largest {of_mean.abs().max():.2f}, rms {of_mean.std():.2f}")

    # Stated error against the spread over the seeds
    rows = rows.drop(columns=["z", "value", "stderr"]).assign(
        spread=values.std(axis=0, ddof=1),
        stated_rms=np.sqrt((errors**2).mean(axis=0)),
        stated_mean=errors.mean(axis=0),
        mean=values.mean(axis=0),
    )
    rows["spread_over_stated"] = rows.spread / rows.stated_mean
    rows.to_csv(HERE / "error_bars.csv", index=False, float_format="%.5g")
    print(rows.groupby("quantity").spread_over_stated.describe())


if __name__ == "__main__":
    main()
