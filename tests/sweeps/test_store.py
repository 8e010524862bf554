"""The store of a sweep: what is in it, how it goes on, and what it refuses."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal

import pbrdf
from pbrdf.sweeps import Sweep, load_sweep, run_sweep, tasks
from pbrdf.sweeps.expectation import forecast
from tests.sweeps.scenes import SWEEP, opened, written

pytestmark = pytest.mark.filterwarnings("ignore:.*:pbrdf.AccuracyWarning")


def copied(whole: Path, target: Path) -> tuple[Sweep, Path]:
    shutil.copytree(whole, target, dirs_exist_ok=True)
    return load_sweep(target / "sweep.toml"), target / "s.zarr"


def test_a_point_is_the_simulation_of_its_scene(whole: Path) -> None:
    stored = opened(whole / "s.zarr")
    assert stored.brdf_total.dims == (
        "slope_rms", "n", "theta_i", "theta_s", "dphi", "stokes_out", "stokes_in",
    )  # fmt: skip
    scene = pbrdf.Scene(
        pbrdf.GaussianSurface(shape=(24, 24), spacing=1.0, corr_length=5.0, slope_rms=0.2),
        pbrdf.Material(1.4),
    )
    alone = pbrdf.simulate(
        scene, np.deg2rad([20, 50]), phi_i="uniform", n_rays=200, realizations=8, n_theta=6,
        n_dphi=8, seed=3,
    )  # fmt: skip
    here = stored.sel(slope_rms=0.2, n=1.4)
    for name in alone.data_vars:
        assert_array_equal(here[name], alone[name], err_msg=str(name))
        assert stored[name].attrs == alone[name].attrs
    assert float(here.rel_error) == alone.attrs["rel_error"]
    assert float(here.realizations) == 8
    assert (stored.state == 1).all()


@pytest.mark.usefixtures("by_points")
def test_a_second_run_computes_nothing(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep, path = copied(whole, tmp_path)
    monkeypatch.setattr(tasks, "simulate", lambda *_, **__: pytest.fail("computed again"))
    report = run_sweep(sweep, path, workers=1)
    assert (report.computed, report.kept) == (0, 6)


@pytest.mark.usefixtures("by_points")
@pytest.mark.parametrize(
    "damage", ["flipped", "cut", "gone", "no mark", "half a mark", "zeros"]
)
def test_damage_is_found_and_mended(whole: Path, tmp_path: Path, damage: str) -> None:
    sweep, path = copied(whole, tmp_path)
    (chunk,) = (f for f in (path / "brdf_total/c/1/1").rglob("*") if f.is_file())
    mark = path / "marks/3.json"
    content = chunk.read_bytes()
    if damage == "flipped":
        middle = len(content) // 2
        flipped = bytes([content[middle] ^ 1])
        chunk.write_bytes(content[:middle] + flipped + content[middle + 1 :])
    elif damage == "cut":
        chunk.write_bytes(content[: len(content) // 2])
    elif damage == "zeros":
        chunk.write_bytes(bytes(len(content)))
    elif damage == "gone":
        chunk.unlink()
    elif damage == "no mark":
        mark.unlink()
    else:
        mark.write_text(mark.read_text()[:20])
    report = run_sweep(sweep, path, workers=1)
    assert (report.computed, report.kept) == (1, 5)
    xr.testing.assert_identical(opened(path), opened(whole / "s.zarr"))


def test_groups_of_several_points_hold_the_same(whole: Path, tmp_path: Path) -> None:
    sweep = load_sweep(written(tmp_path))
    report = run_sweep(sweep, tmp_path / "one.zarr", workers=1)
    assert report.computed == 1
    xr.testing.assert_identical(opened(tmp_path / "one.zarr"), opened(whole / "s.zarr"))


@pytest.mark.usefixtures("by_points")
def test_parts_make_the_whole(whole: Path, tmp_path: Path) -> None:
    sweep, path = load_sweep(written(tmp_path)), tmp_path / "parts.zarr"
    counts = [run_sweep(sweep, path, part=(i, 4)).computed for i in (3, 1, 4, 2)]
    assert counts == [1, 2, 1, 2]
    xr.testing.assert_identical(opened(path), opened(whole / "s.zarr"))
    with pytest.raises(ValueError, match=r"part must be i of n .* got 5/4"):
        run_sweep(sweep, path, part=(5, 4))
    # Each part would delete the others
    with pytest.raises(ValueError, match="replace must be False with part"):
        run_sweep(sweep, path, part=(1, 4), replace=True)
    assert run_sweep(sweep, path, part=(1, 4)).computed == 0
    # Nor may they replace the store of another sweep one after the other
    text = (tmp_path / "sweep.toml").read_text()
    (tmp_path / "other.toml").write_text(text.replace("n_rays = 200", "n_rays = 201"))
    other = load_sweep(tmp_path / "other.toml")
    with pytest.raises(ValueError, match="or delete it before the first part") as told:
        run_sweep(other, path, part=(1, 4))
    assert "--force" not in str(told.value)
    with pytest.raises(ValueError, match="or use --force to replace it"):
        run_sweep(other, path)


def test_another_sweep_and_other_folders_are_refused(whole: Path, tmp_path: Path) -> None:
    _, path = copied(whole, tmp_path)
    other = load_sweep(written(tmp_path, SWEEP.replace("seed = 3", "seed = 4")))
    before = opened(path)
    with pytest.raises(ValueError, match="bound to another one"):
        run_sweep(other, path, workers=1)
    xr.testing.assert_identical(opened(path), before)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/thesis.txt").write_text("all I have")
    for replace in (False, True):
        with pytest.raises(ValueError, match="no store of a sweep"):
            run_sweep(other, tmp_path / "mine", workers=1, replace=replace)
    assert (tmp_path / "mine/thesis.txt").read_text() == "all I have"
    assert run_sweep(other, path, workers=1, replace=True).kept == 0
    assert (opened(path).brdf_total != before.brdf_total).any()


@pytest.mark.usefixtures("by_points")
def test_a_point_that_fails_is_recorded_and_the_others_go_on(tmp_path: Path) -> None:
    lines = SWEEP.replace("n = [1.4, 1.6]", "spacing_um = [1.0, 0.9]\nn = [1.5]")
    lines = lines.replace(
        '"surface.slope_rms" = [0.05, 0.1, 0.2]', "corr_length_um = [5, 6]"
    )
    sweep, path = load_sweep(written(tmp_path, lines)), tmp_path / "s.zarr"
    for run in range(2):
        report = run_sweep(sweep, path, workers=1)
        ((point, error),) = report.errors.items()
        assert point == "corr_length_um=6, spacing_um=0.9, n=1.5"
        assert "at least 4 corr_length" in error
        # What is done is not done again; what failed is tried once more
        assert (report.computed, report.kept) == ((4, 0), (1, 3))[run]
    state = opened(path).state
    assert state.sel(spacing_um=0.9, corr_length_um=6).item() == 2
    assert (state == 1).sum() == 3
    assert np.isnan(opened(path).albedo.sel(spacing_um=0.9, corr_length_um=6)).all()


@pytest.mark.usefixtures("by_points")
def test_a_machine_that_fails_now_and_then_is_tried_again(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep, path = load_sweep(written(tmp_path)), tmp_path / "s.zarr"
    calls = []

    def moody(*args: Any, **given: Any) -> xr.Dataset:
        calls.append(1)
        # The second point at its third attempt only, the last never
        if len(calls) in (2, 3) or len(calls) >= 8:
            raise MemoryError
        return pbrdf.simulate(*args, **given)

    monkeypatch.setattr(tasks, "simulate", moody)
    report = run_sweep(sweep, path, workers=1)
    assert (report.errors, len(calls)) == ({"group 5": "MemoryError: "}, 10)
    assert opened(path).state.values.tolist() == [[1, 1], [1, 1], [1, 0]]
    monkeypatch.setattr(tasks, "simulate", pbrdf.simulate)
    assert run_sweep(sweep, path, workers=1).computed == 1
    xr.testing.assert_identical(opened(path), opened(whole / "s.zarr"))


@pytest.mark.usefixtures("by_points")
def test_the_store_can_be_opened_while_it_is_filled(tmp_path: Path) -> None:
    sweep, path = load_sweep(written(tmp_path)), tmp_path / "s.zarr"
    seen = []
    run_sweep(
        sweep, path, workers=1,
        progress=lambda *_: seen.append(int((opened(path).state == 1).sum())),
    )  # fmt: skip
    assert seen == [1, 2, 3, 4, 5, 6]
    attributes = json.loads((path / "zarr.json").read_text())["attributes"]
    assert attributes["design"] == "grid"
    assert opened(path).attrs["source"] == "scene.toml"


@pytest.mark.usefixtures("by_points")
def test_the_store_says_what_its_points_were_warned_of(tmp_path: Path) -> None:
    """Parts tell only of their own points, the store of all that are there."""
    text = SWEEP.replace("[0.05, 0.1, 0.2]", "[0.1, 0.3]").replace("= 200", "= 64")
    sweep, path = load_sweep(written(tmp_path, text)), tmp_path / "s.zarr"
    for part, runs in ((1, 1), (2, 2)):
        run_sweep(sweep, path, workers=1, part=(part, 2))
        (note,) = opened(path).attrs["warnings"]
        assert note.startswith("A period of 4.8 correlation lengths is too short")
        assert note.endswith(f" ({runs} run{'s' * (runs > 1)})")


def test_a_forecast_counts_what_is_written(tmp_path: Path) -> None:
    sweep, path = load_sweep(written(tmp_path)), tmp_path / "s.zarr"
    told = forecast(sweep, workers=3)
    assert not path.exists()
    report = run_sweep(sweep, path, workers=1)
    stored = opened(path)
    varied = [v for v in stored.data_vars.values() if "n" in v.dims]
    assert told.points == stored.state.size == 6
    assert told.groups == report.computed == 1
    assert told.store_bytes == told.task_bytes == sum(v.nbytes for v in varied)
    # Timings of a shared machine: the right order of magnitude
    assert report.seconds / 20 < told.seconds < 20 * report.seconds
    assert "6 simulations in 1 groups" in next(told.sentences())
