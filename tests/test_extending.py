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


DIFFS = re.findall(r"```diff\n(.*?)```", PAGE, flags=re.DOTALL)


def example(word: str, language: str = "python") -> str:
    """Return the one block of code of the page in which a word stands."""
    blocks = re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)
    (found,) = (code for code in blocks if word in code)
    return found


def test_a_slope_law_is_added_in_two_files(copied: Path) -> None:
    apply(DIFFS[0], copied)
    assert len(re.findall(r"^--- a/", DIFFS[0], flags=re.MULTILINE)) == 2
    area, shadowing = map(float, run(copied, "-c", USE).split())
    assert abs(area - 1.0) < 1e-6
    assert 0.2 < shadowing < 0.99


USE_ALL = """
import numpy as np
from pathlib import Path
from pbrdf import Material, MicrofacetModel, load_scene, materials, simulate
from pbrdf.cli import main
from data_io import read_goniometer
from fitting import fit

print(float(materials.get("evaporated").index(0.35)[0]))
main(["brewster", "bk7"])
main(["--help"])
Path("scan.txt").write_text("SPHERE 1\\n30 -40 0.2\\n30 20 0.1\\n")
scan = read_goniometer("scan.txt")
print(scan.attrs["format"], *np.degrees(scan.dphi.values))
Path("scene.toml").write_text(SCENE)
scene = load_scene("scene.toml")
run = simulate(scene, [0.5], n_rays=40, realizations=2, n_theta=3, n_dphi=4)
parts = (run.albedo, run.absorbed, run.truncated, run.leaked)
print(type(scene.contaminants[0]).__name__, sum(float(part.sum()) for part in parts))
scene.to_toml("again.toml")
print(load_scene("again.toml").contaminants == scene.contaminants)
view = np.linspace(-1.2, 1.2, 13)
model = MicrofacetModel(Material(1.5), slope_rms=0.3, diffuse_albedo=0.1)
truth = model.brdf(0.5, np.abs(view), np.where(view > 0, np.pi, 0.0))
pairs = zip(np.degrees(view), truth[:, 0, 0])
rows = "\\n".join(f"{np.degrees(0.5)},{v},{m}" for v, m in pairs)
Path("scan.csv").write_text("theta_i_deg,theta_view_deg,M00\\n" + rows)
begin = model.with_parameters(diffuse_albedo=0.2)
found = fit(read_goniometer("scan.csv"), begin, solver="simplex")
print(float(found.estimates["diffuse_albedo"].value))
"""
SCENE = """
[surface]
type = "flat"
size_um = 20.0

[substrate]
n = 1.5

[[contaminants]]
type = "bead"
radius_um = 3.0
material = { n = 1.333 }
"""


def test_everything_else_is_added_in_one_place(copied: Path) -> None:
    for diff in DIFFS[1:]:
        apply(diff, copied)
    for place, word in (
        ("pbrdf/cli/showing/brewster.py", "def command"),
        ("data_io/goniometer/formats/sphere.py", "def looks_like"),
        ("pbrdf/contaminants/beads.py", "class Bead"),
        ("fitting/solvers/simplex.py", "def solve_simplex"),
    ):
        (copied / place).write_text(example(word))
    table = example("evaporated gold", "csv")
    (copied / "pbrdf/optics/tables/evaporated.csv").write_text(table)
    said = run(copied, "-c", f"SCENE = {SCENE!r}\n{USE_ALL}")
    index, angle, *help_, scan, bead, same, albedo = said.splitlines()
    assert abs(float(index) - 0.5 * (1.596 + 1.470)) < 1e-12
    assert angle.startswith("56.6")
    assert "p light is reflected least" in "".join(help_)
    assert scan.split() == ["sphere", "180.0", "0.0"]
    assert bead.startswith("Bead ")
    assert abs(float(bead.split()[1]) - 1.0) < 1e-3
    assert same == "True"
    assert abs(float(albedo) - 0.1) < 1e-4
