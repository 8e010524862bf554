"""Every command that takes a file, given those of strangers: one line, soon, code 2.

    python tests/fuzz/commands.py

Prints what is wrong with how a command refuses a file; exit code 1 if anything is. Not
part of the suite: it takes minutes.
"""

import os
import resource
import signal
import sys
import tempfile
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

import data_io
import pbrdf
from pbrdf.cli import main
from tests.files.test_hostile_kinds import KINDS as MESHES
from tests.fuzz.hostile import KINDS, SCENE, content

SECONDS, MEMORY, SIGNS = 5.0, 2**30, 400
RAYS = ["--n-rays", "1000", "--realizations", "4"]
# FILE is the stranger's, the others are good ones
COMMANDS = {
    "check": ["check", "FILE"],
    "check --columns": ["check", "scan.csv", "--columns", "FILE"],
    "fit": ["fit", "FILE", "--n", "1.5", "-o", "out"],
    "fit --material-file": ["fit", "scan.csv", "--material-file", "FILE", "-o", "out"],
    "statistics": ["statistics", "FILE"],
    "statistics --spacing-um": ["statistics", "FILE", "--spacing-um", "1.0"],
    "statistics --um-per-pixel": ["statistics", "FILE", "--um-per-pixel", "1.0"],
    "statistics --um-per-level": [
        "statistics", "FILE", "--um-per-level", "1.0", "--spacing-um", "1.0",
    ],
    "contact-angle": ["contact-angle", "FILE"],
    "plot": ["plot", "FILE", "-o", "out.png"],
    "report": ["report", "FILE", "-o", "out.html"],
    "export": ["export", "FILE", "-o", "out.csv"],
    "predict": [
        "predict", "FILE", "--n", "1.5", "--wavelength-um", "0.5", "--theta-i-deg", "30",
        "-o", "out.csv",
    ],
    "radiance": ["radiance", "FILE", "-o", "out.nc"],
    "radiance --sky-table": ["radiance", "model.toml", "--sky-table", "FILE", "-o", "o.nc"],
    "radiance --band": ["radiance", "model.toml", "--band", "FILE", "-o", "o.nc"],
    "simulate": ["simulate", "FILE", *RAYS, "-o", "out.nc"],
    "observe": ["observe", "FILE", *RAYS, "--theta-view-deg", "0,30", "-o", "out.nc"],
    "observe --scan": ["observe", "scene.toml", "--scan", "FILE", *RAYS, "-o", "out.nc"],
    "sweep": ["sweep", "FILE", "-o", "out.nc"],
    "sweep --vary": ["sweep", "FILE", "--vary", "seed=1,2", "-o", "out.zarr"],
    "dew --scene": ["dew", "--scene", "FILE", "--runs", "4", "-o", "out"],
    "pipeline": ["pipeline", "FILE", "scan.csv", "--n", "1.5", "--quick", "-o", "out"],
    "pipeline, scan": ["pipeline", "map.csv", "FILE", "--n", "1.5", "--quick", "-o", "out"],
}  # fmt: skip
FILES = KINDS | {
    f"{kind.replace(' ', '-')}{suffix}": content(held)
    for kind, (suffix, _, held) in MESHES.items()
}


def make_good_files(place: Path) -> None:
    """Write those that stand beside the stranger's."""
    rows = "\n".join(f"30,{v},{0.1 + 1e-3 * v}" for v in range(-60, 65, 5))
    (place / "scan.csv").write_text(f"theta_i_deg,theta_view_deg,M00\n{rows}\n")
    (place / "scene.toml").write_text(SCENE)
    model = pbrdf.MicrofacetModel(pbrdf.Material(1.5), slope_rms=0.2)
    data_io.write_model(model, place / "model.toml")
    heights = np.random.default_rng(1).standard_normal((40, 40))
    text = "\n".join(",".join(f"{z:.3f}" for z in row) for row in heights)
    (place / "map.csv").write_text(f"# spacing_um = 1.0\n# unit = um\n{text}\n")


@contextmanager
def hostile(folder: Path, name: str) -> Iterator[str]:
    """Make a stranger's file, or a pipe or a link of that name."""
    inner = folder / "inner"
    inner.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(dir=inner) as place:
        path = Path(place) / name
        FILES[name](path)
        yield str(path.relative_to(folder))


def fate(words: list[str]) -> tuple[int, str, float, float]:
    """Run a command in a fork; return code, what it said, its seconds and its memory."""
    with tempfile.TemporaryFile("w+") as said:
        before = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        pid = os.fork()
        if not pid:
            code = 70
            try:
                os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
                os.dup2(said.fileno(), 2)
                sys.stderr = said
                # What never comes back is ended
                signal.setitimer(signal.ITIMER_PROF, 4 * SECONDS)
                signal.signal(signal.SIGPROF, signal.SIG_DFL)
                signal.alarm(120)
                code = main(words)
            except BaseException:
                traceback.print_exc(file=said)
            finally:
                said.flush()
                os._exit(code)
        _, status, used = os.wait4(pid, 0)
        said.seek(0)
        seconds = used.ru_utime + used.ru_stime
        memory = 1024 * used.ru_maxrss - before
        return os.waitstatus_to_exitcode(status), said.read(), seconds, memory


def complaint(words: list[str]) -> str:
    """Return what is wrong with how a command refused, or nothing."""
    code, said, seconds, memory = fate(words)
    lines = [line for line in said.splitlines() if not line.startswith("warning: ")]
    found = []
    if code != 2:
        found.append(f"code {code}")
    if len(lines) != 1 or not lines[0].startswith("error: "):
        found.append(f"{len(lines)} lines: {' | '.join(lines)[-300:]}")
    elif len(lines[0]) > SIGNS:
        found.append(f"{len(lines[0])} signs: {lines[0]}")
    if seconds > SECONDS:
        found.append(f"{seconds:.1f} s")
    if memory > MEMORY:
        found.append(f"{memory / 2**20:.0f} MiB")
    return ", ".join(found)


TABLES, RESULTS = {".csv", ".xlsx"}, {".nc", ".zarr"}
PICTURES, SCENES = {".png", ".tif"}, {".toml"}
SURFACES = TABLES | {
    ".npy", ".x3p", ".sdf", ".prf", ".sur", ".h5", ".mat", ".npz", ".stl", ".ply", ".obj",
    ".off", ".glb", ".gltf",
}  # fmt: skip
SHOWN = RESULTS | SCENES
# What a command is told of by name; a few of the other kinds come besides
TAKEN = {
    "fit --material-file": {".yml"}, "statistics": SURFACES, "predict": {".npy", ".x3p"},
    "statistics --spacing-um": {".npy", ".h5", ".mat"},
    "statistics --um-per-pixel": PICTURES, "statistics --um-per-level": PICTURES,
    "contact-angle": PICTURES, "plot": SHOWN, "report": RESULTS, "export": SHOWN,
    "radiance": SHOWN, "simulate": SCENES, "observe": SCENES, "sweep": SCENES,
    "sweep --vary": SCENES, "dew --scene": SCENES, "pipeline": {".h5", ".png", ".nc"},
    "check --columns": SCENES,
}  # fmt: skip
OTHERS = ("external.nc", "text.nc", "link.zarr", "deep.toml", "cells.csv", "text.png")


def kinds(command: str) -> list[str]:
    taken = TAKEN.get(command, TABLES)
    return [kind for kind in FILES if Path(kind).suffix in taken or kind in OTHERS]


def refused(folder: Path, command: str) -> dict[str, str]:
    """Return what is wrong with how a command refuses hostile files, by kind."""
    found = {}
    # What a command imports on its way is loaded once, and not counted
    with hostile(folder, "zero.csv") as name:
        main(["--quiet", *(name if w == "FILE" else w for w in COMMANDS[command])])
    for kind in kinds(command):
        with hostile(folder, kind) as name:
            words = [name if word == "FILE" else word for word in COMMANDS[command]]
            wrong = complaint(words)
        if wrong:
            found[kind] = wrong
    for number, kind in enumerate(["pipe.csv", "zero.toml", "pipe.nc", "zero.zarr"]):
        path = folder / "inner" / kind
        path.symlink_to("/dev/zero") if number % 2 else os.mkfifo(path)
        words = [str(path) if word == "FILE" else word for word in COMMANDS[command]]
        wrong = complaint(words)
        if wrong:
            found[kind] = wrong
        path.unlink()
    return found


def run() -> int:
    """Try all commands; return how many files were refused badly."""
    bad = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.chdir(folder)
        make_good_files(folder)
        for command in COMMANDS:
            found = refused(folder, command)
            bad += len(found)
            print(
                f"{command}: {len(kinds(command)) + 4} files, {len(found)} bad", flush=True
            )
            for kind, wrong in found.items():
                print(f"  {kind}: {wrong}", flush=True)
    return bad


if __name__ == "__main__":
    sys.exit(run() > 0)
