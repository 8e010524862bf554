"""Compiled kernels are never older than their sources, wherever the sources lie."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pbrdf.kernels import from_python, kernel_sources
from pbrdf.kernels.optics.vectors import Vec, dot

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

ASK = """
from pbrdf.kernels.caller import answer
print(answer(2.0), sum(answer.stats.cache_misses.values()))
"""


def make_tree(root: Path, value: float) -> None:
    """Write a package of two kernels and what keeps them."""
    kernels = root / "pbrdf/kernels"
    (kernels / "drawer").mkdir(parents=True, exist_ok=True)
    (root / "pbrdf/__init__.py").touch()
    (kernels / "drawer/__init__.py").touch()
    for name in ("__init__.py", "caching.py", "parts.py"):
        shutil.copyfile(ROOT / "pbrdf/kernels" / name, kernels / name)
    (kernels / "caller.py").write_text(CALLER)
    (kernels / "drawer/callee.py").write_text(CALLEE.format(value=value))


def asked(root: Path, cache: Path) -> tuple[float, int, str]:
    """Return answer, kernels compiled for it, and what was said."""
    # Python tells an edited source by its size and the second in which it was written
    environment = os.environ | {
        "PBRDF_CACHE_DIR": str(cache), "PYTHONPATH": str(root),
        "PYTHONDONTWRITEBYTECODE": "1",
    }  # fmt: skip
    run = subprocess.run(
        [sys.executable, "-c", ASK],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
        cwd=root,
    )
    value, compiled = run.stdout.split()
    return float(value), int(compiled), run.stderr


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
    """With a flat hash or Numba's own fall-back the second answer was 6.0."""
    blocked = tmp_path / "file"
    blocked.touch()
    folder = tmp_path / "cache" if cache == "kept" else blocked / "below-a-file"
    answers = []
    for value in (3.0, 5.0):
        make_tree(tmp_path, value)
        answer, _, said = asked(tmp_path, folder)
        answers.append(answer)
        assert ("PBRDF_CACHE_DIR" in said) == (cache == "refused")
    assert answers == [6.0, 10.0]


def test_checkouts_of_the_same_sources_share_what_one_compiled(tmp_path: Path) -> None:
    found = []
    for name, value in (("one", 3.0), ("two", 3.0), ("edited", 5.0), ("one", 3.0)):
        # Written anew, so that times of files differ
        make_tree(tmp_path / name, value)
        found.append(asked(tmp_path / name, tmp_path / "cache")[:2])
    assert found == [(6.0, 1), (6.0, 0), (10.0, 1), (6.0, 0)]


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


@pytest.mark.slow
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


def test_a_part_of_other_kernels_refuses_python_and_gets_an_entry():
    """Without an entry Numba would jump to address 0."""
    place = Vec(0.2, -0.3, 0.9)
    with pytest.raises(TypeError, match="dot is compiled into other kernels only"):
        dot(place, place)
    # Also once it has been compiled into one that Python may call
    assert from_python(dot)(place, place) == pytest.approx(0.94)
    with pytest.raises(TypeError, match="from_python"):
        dot(place, place)


FORKED = """
import os
from pbrdf.kernels.microfacet.slopes import GAUSSIAN, slope_norm
child = os.fork()
if not child:
    os._exit(0 if slope_norm(GAUSSIAN, 0.3, 0.2) == 1.0 else 1)
print(os.waitpid(child, 0)[1])
"""


def test_a_fork_compiles_what_its_parent_did_not(tmp_path):
    """The locks of its parent are not its own."""
    run = subprocess.run(
        [sys.executable, "-c", FORKED], capture_output=True, text=True, check=False,
        env=os.environ | {"PBRDF_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert run.stdout.strip() == "0", run.stderr
