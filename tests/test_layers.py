"""The layer rule: who may import whom, and what an import may cost.

Imports inside functions count too: a lazy import is still a dependency.
"""

import ast
import importlib
import subprocess
import sys
from collections import Counter
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("pbrdf", "fitting", "data_io")

KERNEL_IMPORTS = {
    "__future__",
    "cmath",
    "collections",
    "filelock",  # one process compiles a kernel
    "functools",  # a file is hashed once
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


@cache
def tree(source: Path) -> ast.Module:
    return ast.parse(source.read_text())


@cache
def imported(source: Path) -> set[str]:
    """Absolute dotted names that a module imports anywhere in its text."""
    package = source.relative_to(ROOT).parent.parts
    names = set()
    for node in ast.walk(tree(source)):
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
    assert under("fitting.run.fit", *forbidden(source))
    assert not under("fittings", *forbidden(source))


@pytest.mark.parametrize(
    ("package", "heavy"),
    [
        (
            "pbrdf",
            [
                "casadi",
                "nlopt",
                "matplotlib",
                "skimage",
                "embreex",
                "typer",
                "distributed",
                "zarr",
            ],
        ),
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


@pytest.mark.parametrize("package", PACKAGES)
def test_dir_shows_the_public_names_and_each_is_there(package: str) -> None:
    door = importlib.import_module(package)
    assert dir(door) == sorted(door.__all__)
    assert all(getattr(door, name) is not None for name in dir(door))


def test_rooms_stay_small() -> None:
    rooms = Counter(source.parent for source in MODULES)
    crowded = {str(room.relative_to(ROOT)): n for room, n in rooms.items() if n > 15}
    assert not crowded


def edges() -> dict[str, set[str]]:
    """Who imports whom, module by module, imports inside functions included."""
    names = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(
            ".__init__"
        ): path
        for path in MODULES
    }
    found = {}
    for name, path in names.items():
        ends = set()
        for target in imported(path):
            while target and target not in names:
                target = target.rpartition(".")[0]
            ends.add(target)
        found[name] = ends - {name, ""}
    return found


def test_imports_run_in_no_circle() -> None:
    """A face names what its room holds without being part of any way round."""
    arrows = {
        name: {end for end in ends if not (ROOT / end.replace(".", "/")).is_dir()}
        for name, ends in edges().items()
        if not (ROOT / name.replace(".", "/")).is_dir()
    }
    try:
        tuple(TopologicalSorter(arrows).static_order())
    except CycleError as error:
        pytest.fail(f"circle: {' -> '.join(error.args[1])}")


def test_no_module_is_named_like_a_function_in_it() -> None:
    """`import fitting.fit` would give the function or the module, by who came first."""
    hidden = [
        str(path.relative_to(ROOT))
        for path in MODULES
        for node in tree(path).body
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == path.stem
    ]
    assert not hidden


# Lines of a function from behind its docstring on: signature and docstring may be long
MOST_LINES, MOST_KERNEL_LINES, MOST_KERNEL_ARGUMENTS = 60, 90, 14


def functions() -> list[tuple[str, bool, ast.FunctionDef]]:
    """Every function by place, and whether it is a kernel."""
    return [
        (f"{path.relative_to(ROOT)}:{node.name}", "kernels" in path.parts, node)
        for path in MODULES
        for node in ast.walk(tree(path))
        if isinstance(node, ast.FunctionDef)
    ]


def lines_of_body(function: ast.FunctionDef) -> int:
    told = ast.get_docstring(function, clean=False) is not None
    body = function.body[1:] if told else function.body
    return (function.end_lineno or 0) - body[0].lineno + 1 if body else 0


def test_functions_stay_short() -> None:
    """A longer kernel says in its docstring why it is one function on purpose."""
    long = {}
    for place, is_kernel, function in functions():
        most = MOST_KERNEL_LINES if is_kernel else MOST_LINES
        excused = is_kernel and "one function on purpose" in " ".join(
            (ast.get_docstring(function) or "").split()
        )
        if lines_of_body(function) > most and not excused:
            long[place] = lines_of_body(function)
    assert not long


def test_kernels_take_few_arguments() -> None:
    crowded = {
        place: len(function.args.args)
        for place, is_kernel, function in functions()
        if is_kernel and len(function.args.args) > MOST_KERNEL_ARGUMENTS
    }
    assert not crowded
