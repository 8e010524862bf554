"""Kill workers, the scheduler and the client of a sweep at random, again and again.

    python -m tests.sweeps.kill --kills 20

Every kill is SIGKILL (of the client sometimes SIGTERM) at a random moment. After the last
one the sweep runs to its end and its store is compared with that of a serial run, bit by
bit; marks that stood before a kill are written again only where a worker, of two threads,
had them in flight for a client or scheduler that was killed.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import xarray as xr

from tests.sweeps.scenes import SWEEP, opened, serial_run, written

MANY = SWEEP.replace(
    "[0.05, 0.1, 0.2]", "[0.05, 0.06, 0.07, 0.1, 0.12, 0.14, 0.17, 0.2, 0.22, 0.25]"
).replace("n_rays = 200", "n_rays = 10000")
# Points of long runs have a group each; here short ones shall, in every process
ALONE = (
    "from pbrdf.sweeps import layout; layout._MOST_SECONDS = layout._JOINT_BYTES = 0.0; "
)
CLIENT = f"{ALONE}from pbrdf.cli import main; import sys; sys.exit(main())"
VICTIMS = ("worker", "scheduler", "client")


class Cluster:
    """A scheduler, a worker that a nanny restarts, and a client that runs the sweep."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.running: dict[str, subprocess.Popen[bytes]] = {}

    def up(self) -> None:
        """Start whatever does not run."""
        address = self.folder / "scheduler.json"
        if self._down("scheduler"):
            self._end("worker")
            address.unlink(missing_ok=True)
            self._start("scheduler", "dask_scheduler", "--port", "0", "--no-dashboard",
                        "--scheduler-file", str(address))  # fmt: skip
            while not address.exists():
                time.sleep(0.05)
        if self._down("worker"):
            self._start("worker", "dask_worker", "--nthreads", "2", "--no-nanny",
                        "--no-dashboard", "--scheduler-file", str(address))  # fmt: skip
        if self._down("client"):
            tcp = json.loads(address.read_text())["address"]
            self.running["client"] = subprocess.Popen(
                [sys.executable, "-c", CLIENT, "-q", "sweep",
                 str(self.folder / "sweep.toml"), "-o", str(self.folder / "s.zarr"),
                 "--scheduler", tcp],
                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            )  # fmt: skip

    def kill(self, name: str, how: int) -> None:
        process = self.running[name]
        if process.poll() is None:
            os.kill(process.pid, how)
            process.wait(timeout=60)

    def down(self) -> None:
        for name in VICTIMS:
            self._end(name)

    def _start(self, name: str, module: str, *words: str) -> None:
        self.running[name] = subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.{module}", *words],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    def _down(self, name: str) -> bool:
        return name not in self.running or self.running[name].poll() is not None

    def _end(self, name: str) -> None:
        if not self._down(name):
            self.running[name].kill()
            self.running[name].wait()


def marks(folder: Path) -> dict[str, int]:
    """When each mark of the store was written. [ns]"""
    found = (folder / "s.zarr" / "marks").glob("[0-9]*.json")
    return {mark.name: mark.stat().st_mtime_ns for mark in found}


def run(kills: int, seed: int, longest: float = 4.0) -> dict[str, int]:
    """Kill so often, then finish; return what was killed and what was done twice.

    A store that was finished before the last kill is begun anew, so that every kill finds
    a sweep at work.
    """
    chance = random.Random(seed)
    told = {**dict.fromkeys(VICTIMS, 0), "finished": 0, "written again": 0, "different": 0}
    with tempfile.TemporaryDirectory() as serial, tempfile.TemporaryDirectory() as name:
        serial_run(Path(serial), MANY)
        wanted = opened(Path(serial) / "s.zarr")
        folder = Path(name)
        written(folder, MANY)
        cluster = Cluster(folder)
        seen: dict[str, int] = {}
        try:
            done = 0
            while done < kills:
                cluster.up()
                if chance.random() < 0.7:
                    # At work, not while it starts
                    _await_mark(cluster, folder)
                    time.sleep(chance.uniform(0.0, 0.5 * longest))
                else:
                    time.sleep(chance.uniform(0.0, longest))
                told["written again"] += _changed(seen, marks(folder))
                seen |= marks(folder)
                if cluster.running["client"].poll() == 0:
                    told["finished"] += 1
                    told["different"] += not opened(folder / "s.zarr").identical(wanted)
                    _clear(folder)
                    seen = {}
                    continue
                victim = VICTIMS[done % 3] if done < 3 else chance.choice(VICTIMS)
                soft = victim == "client" and chance.random() < 0.5
                cluster.kill(victim, signal.SIGTERM if soft else signal.SIGKILL)
                told[victim] += 1
                done += 1
            cluster.up()
            for _ in range(3):
                if cluster.running["client"].wait(timeout=600) == 0:
                    break
                cluster.up()
            else:
                msg = f"the sweep does not end: {_errors(folder)}"
                raise RuntimeError(msg)
        finally:
            cluster.down()
        told["written again"] += _changed(seen, marks(folder))
        xr.testing.assert_identical(opened(folder / "s.zarr"), wanted)
    return told


def _errors(folder: Path) -> list[str]:
    """What the marks of the store say of points that failed."""
    texts = [m.read_text() for m in (folder / "s.zarr" / "marks").glob("[0-9]*.json")]
    return [text for text in texts if json.loads(text)["errors"]]


def _await_mark(cluster: Cluster, folder: Path) -> None:
    """Wait for a point that is new, or for the client's end."""
    before, deadline = len(marks(folder)), time.monotonic() + 120
    while len(marks(folder)) <= before and cluster.running["client"].poll() is None:
        if time.monotonic() > deadline:
            msg = "no point was finished in 120 s"
            raise TimeoutError(msg)
        time.sleep(0.02)


def _changed(before: dict[str, int], after: dict[str, int]) -> int:
    return sum(after.get(name) != when for name, when in before.items())


def _clear(folder: Path) -> None:
    import shutil

    shutil.rmtree(folder / "s.zarr")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=None)
    given = parser.parse_args()
    seed = random.SystemRandom().randrange(2**31) if given.seed is None else given.seed
    started = time.perf_counter()
    told = run(given.kills, seed)
    print(f"seed {seed}: {told}, {time.perf_counter() - started:.0f} s")
    if told["different"] or told["written again"] > 2 * (
        told["client"] + told["scheduler"]
    ):
        sys.exit(1)


if __name__ == "__main__":
    main()
