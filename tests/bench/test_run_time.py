"""The bench measures right, plain programs find the same light, and no ratio has fallen."""

import json
from dataclasses import replace

import numpy as np
import pytest

from pbrdf.bench.__main__ import draw, table
from pbrdf.bench.errors_over_time import gain, measure, one_length, one_way
from pbrdf.bench.programs import (
    Found,
    Size,
    model_light,
    numpy_and_embreex,
    plain,
    programs_for,
    reduced,
)
from pbrdf.bench.scenes import CASES

CASE = {case.name: case for case in CASES}
SMALL = Size(side=64, n_rays=2000, realizations=16, seed=3)
# Bias of every bin, and standard deviation of one realisation by bin
BIAS, SPREAD = 0.02, np.array([0.1, 0.2, 0.4])
TRUTH = {
    "value": np.array([[1.0, 2.0, 4.0]]), "error": np.zeros((1, 3)),
    "bright": np.ones((1, 3), dtype=bool),
}  # fmt: skip


def invented(bias, spread, seconds=0.01):
    """A way whose errors and times are known."""

    def way(case, size):
        rng = np.random.default_rng((size.seed, size.realizations))
        noise = spread * rng.standard_normal(3) / np.sqrt(size.realizations)
        value = TRUTH["value"] * (1.0 + bias + noise)
        return Found(value, np.full((1, 3), np.nan), seconds, seconds * size.realizations)

    return way


def test_an_invented_error_is_found():
    size = replace(SMALL, realizations=100)
    found = one_length(None, invented(BIAS, SPREAD), size, TRUTH, seeds=2000)
    true = np.sqrt(BIAS**2 + np.mean(SPREAD**2) / 100)
    assert found["rms"] == pytest.approx(true, rel=0.05)
    assert found["bias_squared"] == pytest.approx(BIAS**2, rel=0.1)
    assert found["core_seconds"] == pytest.approx(1.0)


def test_the_error_of_the_reference_is_taken_off():
    own = {"value": TRUTH["value"] * 1.03, "error": 0.03 * TRUTH["value"] * 1.03}
    found = one_length(
        None, invented(0.0, SPREAD), replace(SMALL, realizations=10_000), TRUTH | own, 200
    )
    assert abs(found["bias_squared"]) < 0.1 * 0.03**2
    assert found["reference_rms"] == pytest.approx(0.03)


def test_variance_slope_and_gain_are_those_put_in():
    plan = {"realizations": 16, "seeds": 400, "error": 0.001, "core_seconds": 1e4}
    slow, fast = (
        one_way(None, invented(0.0, spread), SMALL, TRUTH, plan)
        for spread in (SPREAD, 0.5 * SPREAD)
    )
    assert fast["slope"] == pytest.approx(-0.5, abs=0.03)
    # Hundredth of a second a realisation
    assert slow["variance"]["rms"] == pytest.approx(0.01 * np.mean(SPREAD**2), rel=0.05)
    assert slow["variance"]["worst_bin"] == pytest.approx(0.01 * 0.4**2, rel=0.1)
    gained = gain({"plain": slow, "reduced": fast}, "plain", "reduced")
    assert gained["rms"] == pytest.approx(4.0, rel=0.1)


def test_a_slow_program_gets_short_runs():
    plan = {"realizations": 16, "seeds": 8, "error": 0.001, "core_seconds": 20.0}
    found = one_way(None, invented(0.0, SPREAD, seconds=1.0), SMALL, TRUTH, plan)
    assert [run["realizations"] for run in found["runs"]] == [4]


@pytest.mark.parametrize("name", ["rough", "metal", "map"])
def test_the_plain_program_finds_the_light_of_the_engine(name):
    # Two programs without common code but for the surface
    size = replace(SMALL, n_rays=4000)
    theirs, ours = (way(CASE[name], size) for way in (numpy_and_embreex, plain))
    error = np.hypot(theirs.error, ours.error)
    bright = ours.value > 0.2 * ours.value.max()
    z = ((theirs.value - ours.value) / error)[bright]
    assert bright.sum() > 10
    # Student's t of few realisations; bins share surfaces
    assert np.abs(z).max() < 5.5
    assert abs(np.mean(z)) < 2.5


def test_a_case_is_measured_drawn_and_told(tmp_path):
    plan = {
        "side": 64, "n_rays": 200, "realizations": 4, "seeds": 2, "error": 0.5,
        "core_seconds": 0.2,
    }  # fmt: skip
    results = [measure(CASE[name], plan, 1) for name in ("gentle", "goniometer")]
    draw(json.loads(json.dumps(results)), tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 10_000
    lines = "\n".join(line for result in results for line in table(result))
    for word in ("NumPy + embreex", "time to one error", "model", "stages", "goniometer"):
        assert word in lines


def test_the_model_is_averaged_over_the_bins_of_the_run():
    # A smooth surface hides nothing: its light is the model's, but for the diagonals of 16
    # cells a length, which tell +dphi from -dphi by 1/(2 16^2)
    case = CASE["smooth"]
    ours = reduced(case, replace(SMALL, side=128, n_rays=8000, realizations=64))
    bright = ours.value > 0.1 * ours.value.max()
    apart = np.abs(model_light(case)[bright] / ours.value[bright] - 1.0)
    assert apart.max() < 0.005


def test_every_class_of_scene_has_a_case():
    assert {
        "smooth", "rough", "multi-bounce", "metal", "20 wavelengths", "dew 15", "dew 90",
        "dew 179", "map", "goniometer",
    } <= set(CASE)  # fmt: skip
    assert set(programs_for(CASE["rough"])) >= {"reduced", "plain", "NumPy + embreex"}


@pytest.mark.slow
def test_the_engine_has_not_become_slow():
    """Ratios of processor times of one run, far beyond their noise."""
    size = Size(side=128, n_rays=4000, realizations=8, seed=1)
    case = CASE["rough"]

    def least(way, many):
        return min(way(case, size).core_seconds for _ in range(many))

    plain(case, size), reduced(case, size)
    ratio = least(numpy_and_embreex, 2) / least(plain, 7)
    print(f"\nNumPy and embreex over the engine: {ratio:.0f} times")
    assert ratio > 50


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "floor"), [("smooth", 30), ("gentle", 20), ("rough", 1.5)]
)
def test_less_noise_still_pays(name, floor):
    plan = {"realizations": 16, "seeds": 6, "error": 1.0, "core_seconds": 60.0}
    size = Size(side=128, n_rays=8000, realizations=16, seed=0)
    case = CASE[name]
    first = reduced(case, replace(size, realizations=64))
    truth = {
        "value": first.value, "error": first.error,
        "bright": first.value > 0.1 * first.value.max(),
    }  # fmt: skip
    found = {
        key: one_way(case, way, size, truth, plan)
        for key, way in (("plain", plain), ("reduced", reduced))
    }
    gained = gain(found, "plain", "reduced")["rms"]
    print(f"\n{name}: {gained} times")
    # None: no noise is left
    assert gained is None or gained > floor
