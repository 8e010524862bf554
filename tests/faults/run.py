"""Kill, crowd and starve real runs, and see that outputs are whole or not there.

    python tests/faults/run.py [--kills 50] [--twins 20] [--disks 10]

- kills: SIGKILL or SIGTERM at a random moment of simulate (file and store), sweep, dew and
  pipeline --quick: half of them at any moment, half when the folder has just changed for
  the k-th time, k at random. The output is whole or not there, SIGTERM leaves nothing
  behind, and after the next run nothing but inputs and output is there. Runs are forks of
  this process, which has loaded all that they need, so that kills meet the work and not the
  imports; every tenth run is a process of its own.
- twins: two runs into one output; exactly one wins, the other ends with code 2.
- disks: results written to full disks of several sizes; one line and code 1, Python lives.
  Disks are small file systems in memory where mounting is allowed, else a limit of the
  process on the size of files.

Prints a line a kind; exit code 1 if anything else happened.
"""

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import chdir, contextmanager, redirect_stdout, suppress
from pathlib import Path

from pbrdf.cli import main as main_of_commands

SCENE = """
[surface]
type = "gaussian"
shape = [64, 64]
spacing_um = 1.0
corr_length_um = 16.0
slope_rms = 0.2

[substrate]
n = 1.5
"""
BINS = ["--n-theta", "9", "--n-dphi", "12"]
RAYS = ["--realizations", "8", "--n-rays", "2000"]
SIMULATE = ["simulate", "scene.toml", "--theta-i-deg", "10,30,50", *BINS, *RAYS]
# Command, and the name of what it makes
COMMANDS = {
    "simulate": ([*SIMULATE, "-o", "out.nc"], "out.nc"),
    "simulate to a store": ([*SIMULATE, "-o", "out.zarr"], "out.zarr"),
    "sweep": (
        ["sweep", "scene.toml", "--vary", "slope_rms=0.1,0.2,0.3", *BINS, *RAYS,
         "-o", "out.nc"],
        "out.nc",
    ),
    "dew": (
        ["dew", "--scene", "scene.toml", "--contact-angles-deg", "90", "--n-rays", "1000",
         "--runs", "4", "-o", "out"],
        "out",
    ),
    "pipeline": (
        ["pipeline", "surface.csv", "scan.csv", "--n", "1.5", "--quick", "-o", "out"], "out"
    ),
}  # fmt: skip
SHORT = ("simulate", "simulate to a store")
# Kibibytes of the disks, the last of which the result does fit
SIZES = (4, 8, 16, 32, 64, 96, 128, 192, 256, 4096)


def command(words: list[str], folder: Path, **options) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-m", "pbrdf", "--quiet", *words], cwd=folder, text=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, **options,
    )  # fmt: skip


def prepare(folder: Path) -> set[str]:
    """Put the inputs into a folder, and return their names."""
    import numpy as np

    (folder / "scene.toml").write_text(SCENE)
    rng = np.random.default_rng(1)
    z = np.convolve(rng.standard_normal(1200), np.hanning(30), "valid")
    rows = "\n".join(f"{0.5 * k:.2f},{0.3 * v:.5f}" for k, v in enumerate(z))
    (folder / "surface.csv").write_text(f"x_um,z_um\n{rows}\n")
    rows = "\n".join(
        f"30,{v},{0.3 * np.exp(-(((v - 30) / 25) ** 2)) + 0.01:.5f}"
        for v in range(-70, 75, 5)
    )
    (folder / "scan.csv").write_text(f"theta_i_deg,theta_view_deg,M00\n{rows}\n")
    return {path.name for path in folder.iterdir()}


def whole(path: Path) -> bool:
    """Whether an output is there and complete."""
    import data_io

    if path.suffix in (".nc", ".zarr"):
        data_io.read_result(path)
        return True
    return (path / "model.toml").is_file()


def held(folder: Path) -> list[tuple[str, int]]:
    """Names and sizes of all that stands in a folder at the moment."""
    found = []
    for place, _, names in os.walk(folder):
        found.append((place, 0))
        for name in names:
            with suppress(OSError):
                path = os.path.join(place, name)  # noqa: PTH118  (quick)
                found.append((path, os.stat(path).st_size))  # noqa: PTH116
    return sorted(found)


def wait_for_change(run: "subprocess.Popen | Fork", folder: Path, number: int) -> int:
    """Wait until the folder has changed so often, or the run ends; return the count."""
    earlier, count = held(folder), 0
    while count < number and run.poll() is None:
        now = held(folder)
        count += now != earlier
        earlier = now
        time.sleep(0.0005)
    return count


class Fork:
    """A command in a fork of this process: no import to wait for."""

    def __init__(self, words: list[str], folder: Path) -> None:
        self.returncode: int | None = None
        self.said = tempfile.TemporaryFile("w+")  # noqa: SIM115  (lives as long as this)
        self.pid = os.fork()
        if self.pid:
            return
        code = 70
        try:
            os.chdir(folder)
            quiet = os.open(os.devnull, os.O_WRONLY)
            os.dup2(quiet, 1)
            os.dup2(self.said.fileno(), 2)
            code = main_of_commands(["--quiet", *words])
        finally:
            os._exit(code)

    def poll(self) -> int | None:
        """Return the exit code, or minus the signal, once it has ended."""
        if self.returncode is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            self.returncode = os.waitstatus_to_exitcode(status) if pid else None
        return self.returncode

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            os.kill(self.pid, number)

    def communicate(self) -> tuple[None, str]:
        while self.poll() is None:
            time.sleep(0.002)
        self.said.seek(0)
        return None, self.said.read()


def kill(
    name: str, rng: random.Random, longest: float, changes: int, cold: bool, folder: Path
) -> str:
    """Kill a run at a random moment; say what is wrong, or "fine"."""
    words, output = COMMANDS[name]
    inputs = prepare(folder)
    how = rng.choice([signal.SIGKILL, signal.SIGTERM])
    begin = command if cold else Fork
    run = begin(words, folder)
    if rng.random() < 0.5:
        time.sleep(rng.uniform(0.0, longest))
    else:
        wait_for_change(run, folder, rng.randint(1, max(4 * changes // 5, 1)))
    run.send_signal(how)
    run.communicate()
    target = folder / output
    if target.exists() and not whole(target):
        return "a partial output"
    if run.returncode not in (0, -how, 143):
        return f"code {run.returncode}"
    left = {path.name for path in folder.iterdir()} - inputs - {output}
    if left and how == signal.SIGTERM:
        return f"SIGTERM leaves {sorted(left)[:2]}"
    ended = "too late" if run.returncode == 0 else how.name
    again = begin([*words, "--force"], folder)
    said = again.communicate()[1]
    if again.returncode:
        return f"the next run failed: {said[-100:]}"
    left = {path.name for path in folder.iterdir()} - inputs - {output}
    if left or not whole(target):
        return f"leftovers {sorted(left)[:2]}"
    return f"fine ({ended})"


def twins(name: str, folder: Path) -> str:
    """Run a command twice at once; say what is wrong, or "fine"."""
    words, output = COMMANDS[name]
    inputs = prepare(folder)
    runs = [command(words, folder) for _ in range(2)]
    said = [run.communicate()[1] for run in runs]
    codes = sorted(run.returncode for run in runs)
    if codes != [0, 2] or sum("which exists" in text for text in said) != 1:
        return f"codes {codes}"
    left = {path.name for path in folder.iterdir()} - inputs
    return "fine" if left == {output} and whole(folder / output) else f"left {left}"


LIMITED = """
import resource, sys
sys.dont_write_bytecode = True
from pbrdf.cli import main
import data_io, h5netcdf, zarr
if int(sys.argv[1]):
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]),) * 2)
code = main(sys.argv[2:])
sys.stderr.write("alive\\n")
sys.exit(code)
"""


@contextmanager
def disk(folder: Path, kib: int) -> Iterator[bool]:
    """Make a folder a file system of so many KiB; say whether that was allowed."""
    mounted = not subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={kib}k", "tmpfs", str(folder)],
        capture_output=True, check=False,
    ).returncode  # fmt: skip
    try:
        yield mounted
    finally:
        if mounted:
            subprocess.run(["umount", str(folder)], check=True)


def full_disk(name: str, kib: int, folder: Path) -> str:
    """Write a result to a small disk; say what is wrong, or how it ended."""
    words, output = COMMANDS[name]
    place = folder / "disk"
    place.mkdir()
    with disk(place, kib) as mounted:
        prepare(folder)
        words = [str(place / output) if word == output else word for word in words]
        limit = "0" if mounted else str(1024 * kib)
        run = subprocess.run(
            [sys.executable, "-c", LIMITED, limit, "--quiet", *words], cwd=folder,
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        lines = run.stderr.splitlines()
        how = "" if mounted else " (limit of file size)"
        if run.returncode == 0:
            return f"written{how}" if whole(place / output) else "a partial output"
        if run.returncode != 1 or len(lines) != 2 or lines[-1] != "alive":
            return f"code {run.returncode}: {run.stderr[-150:]}"
        if list(place.iterdir()):
            return "leftovers on a full disk"
        return f"refused{how}" if "Make room" in lines[0] else lines[0]


def trial(what, *given) -> str:
    with tempfile.TemporaryDirectory() as folder:
        try:
            return what(*given, Path(folder))
        except ValueError as error:
            return f"{type(error).__name__}: {error}"[:150]


def main() -> int:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--kills", type=int, default=50, help="of each command")
    parser.add_argument("--twins", type=int, default=20, help="pairs in all")
    parser.add_argument("--disks", type=int, default=len(SIZES), help="sizes")
    parser.add_argument("--command", choices=COMMANDS, action="append")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    bad = 0
    chosen = given.command or list(COMMANDS)

    def tell(kind: str, found: Counter) -> int:
        print(
            f"{kind:<28}", ", ".join(f"{n} {said}" for said, n in found.items()), flush=True
        )
        good = ("fine", "written", "refused")
        return sum(n for said, n in found.items() if not said.startswith(good))

    for name in chosen if given.kills else ():
        with tempfile.TemporaryDirectory() as folder:
            longest, changes = measured(name, Path(folder))
        start = time.perf_counter()
        kills = (
            trial(
                kill, name, random.Random(f"{given.seed} {k}"), 1.1 * longest, changes,
                k % 10 == 9,
            )
            for k in range(given.kills)
        )  # fmt: skip
        bad += tell(f"kills, {name}", Counter(kills))
        print(
            f"    {longest:.1f} s and {changes} changes of the folder a run; "
            f"{time.perf_counter() - start:.0f} s in all",
            flush=True,
        )
    pairs = Counter(trial(twins, chosen[k % len(chosen)]) for k in range(given.twins))
    bad += tell("twins", pairs) if given.twins else 0
    for name in [name for name in chosen if name in SHORT and given.disks]:
        sizes = SIZES[-given.disks :]
        bad += tell(f"disks, {name}", Counter(trial(full_disk, name, kib) for kib in sizes))
    return int(bad > 0)


def measured(name: str, folder: Path) -> tuple[float, int]:
    """Return how long a command takes here [s], and how often the folder changes.

    It is run in this process first, which then has loaded all that forks of it need.
    """
    prepare(folder)
    words = COMMANDS[name][0]
    with chdir(folder), redirect_stdout(None):
        if main_of_commands(["--quiet", *words]):
            msg = f"{name} fails"
            raise RuntimeError(msg)
    start = time.perf_counter()
    run = Fork([*words, "--force"], folder)
    changes = wait_for_change(run, folder, sys.maxsize)
    if run.returncode:
        raise RuntimeError(run.communicate()[1])
    return time.perf_counter() - start, changes


if __name__ == "__main__":
    sys.exit(main())
