"""Wheel and sdist hold what they should, and the wheel works where the checkout is not."""

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from tests.site.test_commands import make_files

ROOT = Path(__file__).parents[2]
UV = Path(sys.executable).with_name("uv")


@pytest.fixture(scope="module")
def built(tmp_path_factory) -> Path:
    """Folder with both packages, made from what git tracks."""
    folder = tmp_path_factory.mktemp("build")
    source = folder / "source"
    tracked = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True
    ).stdout
    for name in filter(None, tracked.decode().split("\0")):
        target = source / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes((ROOT / name).read_bytes())
    subprocess.run(
        [UV, "build", "--quiet", "--no-build-isolation", "--out-dir", folder, source],
        check=True, env=os.environ | {"VIRTUAL_ENV": str(UV.parents[1])},
    )  # fmt: skip
    return folder


@pytest.mark.slow
def test_the_sdist_is_whole(built):
    with tarfile.open(next(built.glob("*.tar.gz"))) as archive:
        held = {"/".join(name.split("/")[1:]) for name in archive.getnames()}
    for name in (
        "docs/quick_start.md", "examples/demo.py", "examples/notebooks/fit_a_scan.ipynb",
        "tests/test_layers.py", "Makefile",
        "locks/run.lock", "CITATION.cff", "CHANGELOG.md", "pbrdf/optics/tables",
        "fitting/report/viewer.js",
    ):  # fmt: skip
        assert any(one == name or one.startswith(f"{name}/") for one in held), name


@pytest.mark.slow
def test_the_wheel_works_without_the_checkout(built, tmp_path, monkeypatch):
    wheel = next(built.glob("*.whl"))
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "site")
        names = archive.namelist()
    assert not [name for name in names if name.startswith(("tests", "docs", "studies"))]
    make_files(tmp_path, monkeypatch)
    command = [sys.executable, "-P", "-m", "pbrdf", "pipeline", "edge.png", "scan.csv",
               "--um-per-pixel", "0.5", "--n", "1.5", "--quick", "-o", "out"]  # fmt: skip
    environment = os.environ | {"PYTHONPATH": str(tmp_path / "site")}
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "report.html").stat().st_size > 100_000
