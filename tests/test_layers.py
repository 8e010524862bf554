"""The layer rule: who may import whom, and what an import may cost.

Imports inside functions count too: a lazy import is still a dependency.
"""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("pbrdf", "fitting", "data_io")

KERNEL_IMPORTS = {
    "__future__",
    "cmath",
    "collections",
    "hashlib",
    "math",
    "numba",
    "llvmlite",  # the code generator of numba
    "numpy",
    "os",
    "pathlib",
    "types",
    "tempfile",
    "typing",
    "warnings",
}


MODULES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]


def imported(source: Path) -> set[str]:
    """Absolute dotted names that a module imports anywhere in its text."""
    package = source.relative_to(ROOT).parent.parts
    names = set()
    for node in ast.walk(ast.parse(source.read_text())):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package[: len(package) - node.level + 1]) if node.level else ""
            stem = ".".join(part for part in (base, node.module or "") if part)
            names.update(f"{stem}.{alias.name}" for alias in node.names)
    return names


def under(name: str, *packages: str) -> bool:
    return any(name == package or name.startswith(f"{package}.") for package in packages)


def forbidden(source: Path) -> tuple[str, ...]:
    """Packages that this module must not know."""
    place = source.relative_to(ROOT)
    if place == Path("pbrdf/__main__.py"):
        return ()
    if place.is_relative_to("pbrdf/cli") or place.is_relative_to("fitting"):
        return ("pbrdf.cli",) if place.is_relative_to("fitting") else ()
    if place.is_relative_to("data_io"):
        return ("fitting", "pbrdf.cli")
    return ("fitting", "data_io", "pbrdf.cli")


@pytest.mark.parametrize("source", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_stay_in_their_layer(source: Path) -> None:
    crossing = {name for name in imported(source) if under(name, *forbidden(source))}
    assert not crossing, f"{source.relative_to(ROOT)} must not import {sorted(crossing)}"


@pytest.mark.parametrize(
    "source",
    sorted((ROOT / "pbrdf/kernels").rglob("*.py")),
    ids=lambda path: str(path.relative_to(ROOT / "pbrdf/kernels")),
)
def test_kernels_know_numbers_and_each_other_only(source: Path) -> None:
    strange = {
        name
        for name in imported(source)
        if not under(name, "pbrdf.kernels") and name.split(".")[0] not in KERNEL_IMPORTS
    }
    assert not strange


def test_the_rule_sees_a_crossing() -> None:
    source = ROOT / "pbrdf/surface/__init__.py"
    assert forbidden(source) == ("fitting", "data_io", "pbrdf.cli")
    assert under("fitting.fit.fit", *forbidden(source))
    assert not under("fittings", *forbidden(source))


@pytest.mark.parametrize(
    ("package", "heavy"),
    [
        ("pbrdf", ["casadi", "nlopt", "matplotlib", "skimage", "embreex", "typer"]),
        (
            "pbrdf.cli",
            ["casadi", "nlopt", "matplotlib", "skimage", "embreex", "numba", "xarray"],
        ),
        ("fitting", ["casadi", "nlopt", "matplotlib", "skimage", "embreex"]),
        ("data_io", ["casadi", "nlopt", "matplotlib", "skimage", "embreex"]),
    ],
)
def test_importing_does_no_heavy_work(package: str, heavy: list[str]) -> None:
    command = f"import sys, {package}; print(*(m for m in {heavy!r} if m in sys.modules))"
    run = subprocess.run(
        [sys.executable, "-c", command],
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=True,
    )
    assert run.stdout.split() == []
