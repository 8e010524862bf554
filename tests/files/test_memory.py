"""Memory is foretold: runs that do not fit are refused before they begin."""

import json
import subprocess
import sys
import time

import numpy as np
import pytest

import pbrdf
from fitting.models.simulated import SimulatedModel
from pbrdf import memory
from pbrdf.dew import compare_dew
from pbrdf.sweeps import run_sweep, sweep_of
from pbrdf.sweeps.in_memory import computed

ROUGH = pbrdf.GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=8.0, slope_rms=0.2)
SCENE = pbrdf.Scene(ROUGH, pbrdf.Material(1.5))
TABLES = {
    "surface": {
        "type": "gaussian", "shape": [64, 64], "spacing_um": 1.0, "corr_length_um": 8.0,
        "slope_rms": 0.2,
    },
    "substrate": {"n": 1.5},
}  # fmt: skip


def free(monkeypatch, room):
    for module in (memory, pbrdf.simulation.memory):
        monkeypatch.setattr(module, "free_bytes", lambda: room)


@pytest.mark.parametrize("more", [{}, {"target_rel_error": 0.1}])
def test_a_result_of_sixty_gigabytes_is_refused_at_once(monkeypatch, more):
    free(monkeypatch, 64e9)
    start = time.process_time()
    with pytest.raises(ValueError, match=r"200 directions x 100 wavelengths.*n_theta="):
        pbrdf.simulate(
            SCENE, np.linspace(0, 1.4, 200), wavelength=np.linspace(0.4, 1.4, 100), **more
        )
    assert time.process_time() - start < 1.0


def refused_here(monkeypatch, run, match):
    """Check that a run is refused where nothing is free, and before a ray is traced."""
    free(monkeypatch, 1e6)
    for place in ("simulation.samples", "observation.samples"):
        monkeypatch.setattr(f"pbrdf.{place}.gather", None)
    with pytest.raises(ValueError, match=match):
        run()


def test_every_kind_of_run_is_foretold(monkeypatch):
    runs = {
        "1 directions": lambda: pbrdf.simulate(SCENE, 0.5),
        "1 directions x 16": lambda: pbrdf.observe(SCENE, 0.5, 0.5, 3.0),
        "2 states x 8 runs": lambda: compare_dew(
            ROUGH, "bk7", [1.0], 0.5, amount={"volume_per_area": 2, "number_density": 1e-3}
        ),
        "runs x 1 directions": lambda: SimulatedModel(SCENE, realizations=8).simulation(
            np.array([0.5])
        ),
    }
    for match, run in runs.items():
        refused_here(monkeypatch, run, match)


def test_a_sweep_is_foretold_as_a_whole(monkeypatch, tmp_path):
    sweep = sweep_of(
        TABLES, tmp_path / "s.toml", {"slope_rms": np.linspace(0.05, 0.3, 50).tolist()},
        {"theta_i_deg": [30.0], "n_rays": 1000, "realizations": 2},
    )  # fmt: skip
    # A point alone would fit
    free(monkeypatch, 90e6)
    with pytest.raises(ValueError, match=r"50 points held.*-o name\.zarr"):
        computed(sweep, workers=1)
    free(monkeypatch, 80e6)
    with pytest.raises(ValueError, match=r"groups at once.*workers="):
        run_sweep(sweep, tmp_path / "s.zarr", workers=2)


GROUPS_2 = "0::/job/step\n"
GROUPS_1 = "9:cpu:/x\n4:memory,hugetlb:/job\n"


def group(folder, names, limit, used, cached):
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in zip(names, (limit, used), strict=True):
        (folder / name).write_text(f"{text}\n")
    (folder / "memory.stat").write_text(
        f"anon 5\ninactive_file {cached}\ntotal_inactive_file {cached}\n"
    )


def test_control_groups_bind(tmp_path):
    names = ("memory.max", "memory.current")
    group(tmp_path / "job/step", names, "max", 50, 0)
    assert memory.group_room(GROUPS_2, tmp_path) == np.inf
    group(tmp_path / "job", names, 1000, 700, 100)
    assert memory.group_room(GROUPS_2, tmp_path) == 400
    names = ("memory.limit_in_bytes", "memory.usage_in_bytes")
    group(tmp_path / "memory/job", names, 900, 700, 50)
    assert memory.group_room(GROUPS_1, tmp_path) == 250
    assert memory.group_room("", tmp_path) == np.inf


@pytest.mark.skipif(sys.platform != "linux", reason="limits of addresses")
def test_the_limit_of_a_process_binds():
    code = (
        "import resource; from pbrdf import memory\n"
        "resource.setrlimit(resource.RLIMIT_AS, (8 * 10**9, 8 * 10**9))\n"
        "print(memory.free_bytes())"
    )
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert float(run.stdout) < 8e9


# Each run takes some hundred megabytes more than a small one like it. One process makes
# ready for all; each measures itself in a fork, whose peak is its own
PEAK = """
import json, os, sys, warnings
import numpy as np
import pbrdf
from pbrdf import memory

warnings.simplefilter("ignore")
need = []
check = memory.check_room

def remember(size, *words):
    need.append(size)

from pbrdf.simulation import memory as simulated
from pbrdf.observation import samples
from pbrdf import dew
for module in (memory, simulated, samples, dew):
    module.check_room = remember

def status(key):
    for line in open("/proc/self/status"):
        if line.startswith(key):
            return 1024 * int(line.split()[1])

def run(kind, angles=1, waves=0, shape=64, **given):
    zeniths = np.linspace(0.1, 1.2, angles)
    if waves:
        given["wavelength"] = np.linspace(0.4, 0.8, waves)
    surface = pbrdf.GaussianSurface(
        shape=(shape, shape), spacing=1.0, corr_length=8.0, slope_rms=0.2
    )
    if kind == "dew":
        return dew.compare_dew(
            surface, pbrdf.Material(1.5), [1.0], zeniths, water=pbrdf.Material(1.33),
            amount={"volume_per_area": 1.0, "number_density": 2e-3}, **given)
    if kind == "map":
        surface = surface.sample(1)
    scene = pbrdf.Scene(surface, pbrdf.Material(1.5))
    if kind == "observe":
        return pbrdf.observe(scene, zeniths, zeniths, np.full(angles, 3.0), **given)
    return pbrdf.simulate(scene, zeniths, **given)

def measure(kind, given):
    small = {"n_theta": 4, "n_dphi": 8} if "n_theta" in given else {}
    run(kind, **(given | small | {"angles": 2, "shape": 64}))
    before = status("VmRSS")
    need.clear()
    result = run(kind, **given)
    # The largest is that of the whole run
    return [max(need), status("VmHWM") - before]

for name, (kind, given) in json.loads(sys.argv[1]).items():
    child = os.fork()
    if child == 0:
        print(json.dumps([name, *measure(kind, given)]), flush=True)
        os._exit(0)
    if os.waitpid(child, 0)[1]:
        sys.exit(f"{name} has failed")
"""
FINE = {"n_theta": 90, "n_dphi": 180, "n_rays": 200, "realizations": 8, "workers": 2}
WIDE = {"n_theta": 45, "n_dphi": 90, "n_rays": 3200, "workers": 1}
RUNS = {
    "looks": ("rough", FINE | {"angles": 8}),
    "rays": ("rough", FINE | {"angles": 20, "variance_reduction": False}),
    "many workers": (
        "rough", FINE | {"angles": 20, "variance_reduction": False, "workers": 6},
    ),
    "few wavelengths": ("map", WIDE | {"angles": 15, "waves": 3}),
    "spectrum": (
        "rough",
        FINE | {"n_theta": 30, "n_dphi": 30, "angles": 8, "waves": 40},
    ),
    "unpolarized": ("rough", FINE | {"angles": 20, "stokes": "unpolarized"}),
    "azimuths": ("map", WIDE | {"angles": 8, "phi_i": [0.0, 1.0, 2.0, 3.0, 4.0]}),
    # Of one worker: whether two draw their surfaces at the same moment is chance
    "large surface": (
        "rough",
        {
            "n_theta": 9, "n_dphi": 12, "n_rays": 100, "realizations": 3, "workers": 1,
            "variance_reduction": False, "shape": 3200,
        },
    ),
    "observe": ("observe", {"angles": 250, "waves": 100, "n_rays": 32, "workers": 1}),
    "dew": ("dew", FINE | {"angles": 2, "realizations": 1, "runs": 6}),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="peaks are read from /proc")
def test_forecasts_are_within_a_factor_of_the_peak():
    run = subprocess.run(
        [sys.executable, "-c", PEAK, json.dumps(RUNS)], capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    found = [json.loads(line) for line in run.stdout.splitlines()]
    for name, foretold, peak in found:
        print(f"{name}: foretold {foretold / 1e6:.0f} MB, peak {peak / 1e6:.0f} MB")
    assert [name for name, *_ in found] == list(RUNS)
    assert [name for name, _, peak in found if peak < 1.5e8] == []
    assert [name for name, told, peak in found if not 1 / 1.5 < told / peak < 1.5] == []
