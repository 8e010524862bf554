"""The worked examples of docs/extending.md, applied to a copy of the sources and run."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs/extending.md").read_text()


def apply(diff: str, folder: Path) -> None:
    """Apply a diff whose hunks are found by their text, as a reader would apply it."""
    for part in re.split(r"^--- a/", diff, flags=re.MULTILINE)[1:]:
        name, _, rest = part.partition("\n")
        target = folder / name
        text = target.read_text()
        for hunk in rest.split("@@\n")[1:]:
            lines = hunk.splitlines(keepends=True)
            old = "".join(line[1:] for line in lines if line[0] in " -")
            new = "".join(line[1:] for line in lines if line[0] in " +")
            assert text.count(old) == 1, f"{name} no longer holds:\n{old}"
            text = text.replace(old, new)
        target.write_text(text)


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    for package in ("pbrdf", "fitting", "data_io"):
        shutil.copytree(
            ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__")
        )
    return tmp_path


def run(folder: Path, *arguments: str) -> str:
    environment = os.environ | {"PYTHONPATH": str(folder), "NUMBA_DISABLE_JIT": "1"}
    finished = subprocess.run(
        [sys.executable, *arguments], cwd=folder, env=environment, capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    assert finished.returncode == 0, finished.stderr
    return finished.stdout


USE = """
import math
from scipy import integrate
from pbrdf import Material, MicrofacetModel
model = MicrofacetModel(
    Material.mirror(), slope_rms=0.2, slope_distribution="quartic", shadowing="none")

def projected(theta):
    density = model.brdf(theta, theta, 0.0)[0, 0] * 4 * math.cos(theta) ** 6
    return density * 2 * math.pi * math.tan(theta) / math.cos(theta) ** 2

print(integrate.quad(projected, 0.0, 1.2)[0])
hidden = model.with_parameters(shadowing="smith-correlated")
print(hidden.brdf(1.4, 1.4, 3.0)[0, 0] / model.brdf(1.4, 1.4, 3.0)[0, 0])
"""


def test_a_slope_law_is_added_in_two_files(copied: Path) -> None:
    diff = re.findall(r"```diff\n(.*?)```", PAGE, flags=re.DOTALL)
    apply(diff[0], copied)
    assert len(re.findall(r"^--- a/", diff[0], flags=re.MULTILINE)) == 2
    area, shadowing = map(float, run(copied, "-c", USE).split())
    assert abs(area - 1.0) < 1e-6
    assert 0.2 < shadowing < 0.99


def test_a_command_is_added_by_one_module(copied: Path) -> None:
    text = next(
        code for code in re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
        if "def command" in code
    )  # fmt: skip
    (copied / "pbrdf/cli/showing/brewster.py").write_text(text)
    assert run(copied, "-m", "pbrdf", "brewster", "bk7").startswith("56.6")
    assert "p light is reflected least" in run(copied, "-m", "pbrdf", "--help")
