"""Kill, crowd and starve real runs, and see that outputs are whole or not there.

    python tests/faults/run.py [--kills 50] [--twins 20] [--disks 10]

- kills: SIGKILL or SIGTERM at a random moment of simulate (file and store), sweep, dew and
  pipeline --quick; the output is whole or not there, and the next run leaves no leftover.
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
from contextlib import contextmanager
from pathlib import Path

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
    "dew": (["dew", "--n-rays", "1000", "--runs", "4", "-o", "out"], "out"),
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


def kill(name: str, rng: random.Random, folder: Path, longest: float) -> str:
    """Kill a run at a random moment; say what is wrong, or "fine"."""
    words, output = COMMANDS[name]
    inputs = prepare(folder)
    how = rng.choice([signal.SIGKILL, signal.SIGTERM])
    run = command(words, folder)
    time.sleep(rng.uniform(0.0, longest))
    run.send_signal(how)
    run.communicate()
    target = folder / output
    if target.exists() and not whole(target):
        return "a partial output"
    if run.returncode not in (0, -how, 143):
        return f"code {run.returncode}"
    again = command([*words, "--force"], folder)
    said = again.communicate()[1]
    if again.returncode:
        return f"the next run failed: {said[-100:]}"
    left = {path.name for path in folder.iterdir()} - inputs - {output}
    return f"leftovers {sorted(left)[:2]}" if left or not whole(target) else "fine"


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
    rng, bad = random.Random(given.seed), 0
    chosen = given.command or list(COMMANDS)

    def tell(kind: str, found: Counter) -> int:
        print(
            f"{kind:<28}", ", ".join(f"{n} {said}" for said, n in found.items()), flush=True
        )
        good = ("fine", "written", "refused")
        return sum(n for said, n in found.items() if not said.startswith(good))

    for name in chosen:
        longest = 1.2 * seconds(name)
        kills = (
            trial(lambda f, n=name, s=longest: kill(n, rng, f, s))
            for _ in range(given.kills)
        )
        bad += tell(f"kills, {name}", Counter(kills))
    pairs = Counter(trial(twins, chosen[k % len(chosen)]) for k in range(given.twins))
    bad += tell("twins", pairs)
    for name in [name for name in chosen if name in SHORT]:
        sizes = SIZES[-given.disks :] if given.disks else ()
        bad += tell(f"disks, {name}", Counter(trial(full_disk, name, kib) for kib in sizes))
    return int(bad > 0)


def seconds(name: str) -> float:
    """Return how long a command takes here. [s]"""
    with tempfile.TemporaryDirectory() as folder:
        prepare(Path(folder))
        start = time.perf_counter()
        run = command(COMMANDS[name][0], Path(folder), env=os.environ)
        said = run.communicate()[1]
        if run.returncode:
            raise RuntimeError(said)
        return time.perf_counter() - start


if __name__ == "__main__":
    sys.exit(main())
