"""Compiled kernels are never older than their sources, wherever the sources lie."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pbrdf.kernels import kernel_sources

ROOT = Path(__file__).parents[2]

CALLEE = """
from pbrdf.kernels import jit


@jit
def factor():
    return {value}
"""

CALLER = """
from pbrdf.kernels import jit
from pbrdf.kernels.drawer.callee import factor


@jit
def answer(x):
    return factor() * x
"""

ASK = "from pbrdf.kernels.caller import answer; print(answer(2.0))"


def test_the_hash_covers_every_kernel_source() -> None:
    found = {
        Path(folder, name)
        for folder, _, names in os.walk(ROOT / "pbrdf/kernels")
        for name in names
        if name.endswith(".py")
    }
    assert set(kernel_sources()) == found


@pytest.mark.parametrize("cache", ["kept", "refused"])
def test_an_edited_callee_in_a_sub_folder_gives_the_new_answer(
    tmp_path: Path, cache: str
) -> None:
    """With the old, flat hash and with Numba's own fall-back the second answer was 6.0."""
    kernels = tmp_path / "pbrdf/kernels"
    (kernels / "drawer").mkdir(parents=True)
    (tmp_path / "pbrdf/__init__.py").touch()
    (kernels / "drawer/__init__.py").touch()
    shutil.copy(ROOT / "pbrdf/kernels/__init__.py", kernels)
    (kernels / "caller.py").write_text(CALLER)
    blocked = tmp_path / "file"
    blocked.touch()
    folder = tmp_path / "cache" if cache == "kept" else blocked / "below-a-file"
    environment = os.environ | {"PBRDF_CACHE_DIR": str(folder), "PYTHONPATH": str(tmp_path)}
    answers = []
    for value in (3.0, 5.0):
        (kernels / "drawer/callee.py").write_text(CALLEE.format(value=value))
        run = subprocess.run(
            [sys.executable, "-c", ASK],
            capture_output=True,
            text=True,
            check=True,
            env=environment,
            cwd=tmp_path,
        )
        answers.append(float(run.stdout))
        assert ("PBRDF_CACHE_DIR" in run.stderr) == (cache == "refused")
    assert answers == [6.0, 10.0]


COUNTED = """
import sys
from pathlib import Path
from pbrdf.kernels import jit


@jit
def half(x):
    return x / 2


@jit
def cube(x):
    return half(x * x * x)


Path(sys.argv[1], "ready-" + sys.argv[2]).touch()
while len(list(Path(sys.argv[1]).glob("ready-*"))) < 4:
    pass
argument = {"0": 2, "1": 2.0, "2": 2, "3": 2 + 0j}[sys.argv[2]]
print(cube(argument), sum(cube.stats.cache_misses.values()), flush=True)
"""


def test_processes_that_start_at_once_compile_each_kernel_once(tmp_path: Path) -> None:
    """Without the lock two compile the same, and the index names one of three entries."""
    script = tmp_path / "counted.py"
    script.write_text(COUNTED)
    environment = os.environ | {
        "PBRDF_CACHE_DIR": str(tmp_path / "cache"),
        "PYTHONPATH": str(ROOT),
    }

    def answers(folder: Path) -> list[list[str]]:
        folder.mkdir()
        runs = [
            subprocess.Popen(
                [sys.executable, str(script), str(folder), str(k)],
                stdout=subprocess.PIPE,
                text=True,
                env=environment,
            )
            for k in range(4)
        ]
        return [run.communicate(timeout=300)[0].split() for run in runs]

    first, second = answers(tmp_path / "cold"), answers(tmp_path / "warm")
    for found in first, second:
        assert [complex(value) for value, _ in found] == [4] * 4
    # Four processes, three kinds of argument
    assert sum(int(misses) for _, misses in first) == 3
    assert sum(int(misses) for _, misses in second) == 0
