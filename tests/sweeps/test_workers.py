"""Workers of Dask and kills: the store is that of the serial run, bit for bit."""

import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import distributed
import pytest
import xarray as xr
from distributed import CancelledError

from pbrdf.sweeps import load_sweep, run_sweep, tasks
from tests.sweeps.scenes import SWEEP, opened, serial_run, written

pytestmark = [
    pytest.mark.filterwarnings("ignore:.*:pbrdf.AccuracyWarning"),
    pytest.mark.usefixtures("by_points"),
]
# 16 points, each a group of its own
MANY = SWEEP.replace(
    "[0.05, 0.1, 0.2]", "[0.05, 0.07, 0.1, 0.14, 0.17, 0.2, 0.22, 0.25]"
).replace("n_rays = 200", "n_rays = 20000")
# Long runs have a group each; here short ones shall
ALONE = (
    "from pbrdf.sweeps import layout; layout._MOST_SECONDS = layout._JOINT_BYTES = 0.0; "
)


@pytest.fixture(scope="module")
def serial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("serial")
    serial_run(folder, MANY)
    return folder / "s.zarr"


def test_threads_of_this_process_give_the_serial_store(tmp_path: Path) -> None:
    sweep = load_sweep(written(tmp_path))
    seen: list[tuple[int, int]] = []
    report = run_sweep(
        sweep, tmp_path / "dask.zarr", workers=2, progress=lambda *n: seen.append(n)
    )
    assert (report.computed, report.kept, report.errors) == (6, 0, {})
    assert sorted(seen) == [(k, 6) for k in range(1, 7)]
    run_sweep(sweep, tmp_path / "serial.zarr", workers=1)
    xr.testing.assert_identical(
        opened(tmp_path / "dask.zarr"), opened(tmp_path / "serial.zarr")
    )


def test_a_full_disk_ends_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device", "s.zarr")

    monkeypatch.setattr(tasks, "simulate", full)
    sweep = load_sweep(written(tmp_path))
    for workers in (1, 2):
        with pytest.raises(OSError, match="No space left"):
            run_sweep(sweep, tmp_path / "s.zarr", workers=workers)
    monkeypatch.undo()
    assert run_sweep(sweep, tmp_path / "s.zarr", workers=1).computed == 6


@pytest.fixture
def cluster() -> Iterator[distributed.LocalCluster]:
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as made:
        yield made


@pytest.mark.slow
def test_killed_workers_cost_only_what_was_in_flight(
    serial: Path, tmp_path: Path, cluster: distributed.LocalCluster
) -> None:
    sweep, path = load_sweep(written(tmp_path, MANY)), tmp_path / "s.zarr"
    chance = random.Random(5)
    killed = []

    def kill(done: int, _: int) -> None:
        # Between tasks and in them: the others are at work when one is done
        if done in (1, 4, 8):
            pids = [one.pid for one in cluster.workers.values() if one.pid]
            if pids:
                victim = chance.choice(pids)
                os.kill(victim, signal.SIGKILL)
                killed.append(victim)

    with distributed.Client(cluster) as client:
        report = run_sweep(sweep, path, client=client, progress=kill)
    assert len(killed) >= 2
    assert (report.computed, report.errors) == (16, {})
    xr.testing.assert_identical(opened(path), opened(serial))


@pytest.mark.slow
def test_a_killed_client_goes_on_where_it_was(serial: Path, tmp_path: Path) -> None:
    path = tmp_path / "s.zarr"
    written(tmp_path, MANY)
    command = f"{ALONE}from pbrdf.cli import main; import sys; sys.exit(main())"
    for least in (1, 5, 9):
        run = subprocess.Popen(
            [sys.executable, "-c", command, "-q", "sweep", str(tmp_path / "sweep.toml"),
             "-o", str(path), "--workers", "2"],
        )  # fmt: skip
        deadline = time.monotonic() + 300
        while len(list((path / "marks").glob("[0-9]*.json"))) < least:
            assert run.poll() is None, "ended by itself"
            assert time.monotonic() < deadline
            time.sleep(0.01)
        run.send_signal(signal.SIGKILL)
        run.wait()
    marks = {mark: mark.stat().st_mtime_ns for mark in (path / "marks").glob("[0-9]*.json")}
    report = run_sweep(load_sweep(tmp_path / "sweep.toml"), path, workers=1)
    assert report.kept == len(marks) >= 9
    assert report.computed == 16 - len(marks)
    assert all(mark.stat().st_mtime_ns == was for mark, was in marks.items())
    xr.testing.assert_identical(opened(path), opened(serial))


@pytest.mark.slow
def test_a_lost_scheduler_leaves_a_store_that_goes_on(serial: Path, tmp_path: Path) -> None:
    sweep, path = load_sweep(written(tmp_path, MANY)), tmp_path / "s.zarr"
    scheduler = subprocess.Popen(
        [sys.executable, "-m", "distributed.cli.dask_scheduler", "--port", "0",
         "--no-dashboard", "--scheduler-file", str(tmp_path / "scheduler.json")],
        stderr=subprocess.DEVNULL,
    )  # fmt: skip
    worker = subprocess.Popen(
        [sys.executable, "-m", "distributed.cli.dask_worker", "--nthreads", "2",
         "--no-dashboard", "--no-nanny", "--death-timeout", "60",
         "--scheduler-file", str(tmp_path / "scheduler.json")],
        stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        deadline = time.monotonic() + 120
        while not (tmp_path / "scheduler.json").exists():
            assert time.monotonic() < deadline
            time.sleep(0.1)
        client = distributed.Client(scheduler_file=str(tmp_path / "scheduler.json"))

        def kill(done: int, _: int) -> None:
            if done == 3:
                threading.Thread(target=scheduler.kill).start()

        with pytest.raises(OSError, match="scheduler is gone"):
            run_sweep(sweep, path, client=client, progress=kill)
        client.close(timeout=1)
    finally:
        for process in (scheduler, worker):
            process.kill()
            process.wait()
    report = run_sweep(sweep, path, workers=1)
    assert report.kept >= 3
    xr.testing.assert_identical(opened(path), opened(serial))


@pytest.mark.slow
@pytest.mark.parametrize("fault", [ConnectionResetError(104, "reset"), CancelledError()])
def test_an_answer_lost_on_the_way_is_a_lost_scheduler(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: Exception
) -> None:
    def lost(future: distributed.Future) -> None:
        raise fault

    monkeypatch.setattr(distributed.Future, "result", lost)
    sweep = load_sweep(written(tmp_path, MANY))
    with (
        distributed.Client(
            processes=False, n_workers=1, threads_per_worker=1, dashboard_address=None
        ) as client,
        pytest.raises(OSError, match="scheduler is gone"),
    ):
        run_sweep(sweep, tmp_path / "s.zarr", client=client)


@pytest.mark.slow
def test_random_kills_of_everybody_leave_the_serial_store() -> None:
    """The short version of `python -m tests.sweeps.kill --kills 20`."""
    from tests.sweeps.kill import run

    told = run(kills=3, seed=random.SystemRandom().randrange(2**31))
    assert told["different"] == 0
    # A worker of two threads ends what it has in flight for a client that is dead
    assert told["written again"] <= 2 * (told["client"] + told["scheduler"])
    assert min(told["worker"], told["scheduler"], told["client"]) >= 1


@pytest.mark.slow
def test_a_terminated_sweep_says_what_it_keeps(tmp_path: Path) -> None:
    written(tmp_path, MANY)
    command = f"{ALONE}from pbrdf.cli import main; import sys; sys.exit(main())"
    path = tmp_path / "s.zarr"
    run = subprocess.Popen(
        [sys.executable, "-W", "ignore", "-c", command, "-q", "sweep",
         str(tmp_path / "sweep.toml"), "-o", str(path), "--workers", "1"],
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    deadline = time.monotonic() + 300
    while not list((path / "marks").glob("[0-9]*.json")):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    run.send_signal(signal.SIGTERM)
    _, told = run.communicate(timeout=60)
    assert run.returncode == 143
    assert told == f"Terminated; {path} keeps what is finished, the same command goes on.\n"
