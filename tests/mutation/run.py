"""Change one sign or factor of the physics at a time and see whether a test notices.

    python tests/mutation/run.py --named
    python tests/mutation/run.py --judged [NAME ...] [--every N]
    python tests/mutation/run.py MODULE.py TEST.py [TEST.py ...]

The first form makes the mutants that once survived. The second makes every mutant of the
modules in `JUDGED` (each + and -, * and /, sign, comparison and number of its arithmetic),
or every N-th, and runs the tests named there; the third does so for any module and tests.
Each runs in a copy of the sources with the compiler of kernels off, and stops at its first
failure; without a mutation the tests must pass there. Survivors are listed; exit code 1 if
there are any. Not part of the suite: a module takes minutes. What was found is in
README.md beside this file.
"""

import argparse
import ast
import copy
import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SWAPS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
TURNS = {ast.Lt: ast.Gt, ast.Gt: ast.Lt, ast.LtE: ast.GtE, ast.GtE: ast.LtE}
PINS = "tests/analytic/test_pinned_signs_and_factors.py"
SHADOWING = "pbrdf/kernels/microfacet/shadowing.py"
SLOPES = "pbrdf/kernels/microfacet/slopes.py"
SCATTER = "fitting/statistics/axis/scatter.py"
NIST = "data_io/goniometer/formats/nist.py"
LAWS = "tests/contaminants/test_contaminant_laws.py"
FACETS = "tests/analytic/test_slopes_and_shadowing.py"
# Modules of physics, and the tests that are to notice what is changed in them
JUDGED = {
    "fresnel": ("pbrdf/kernels/optics/fresnel.py", ["tests/analytic/test_fresnel.py"]),
    "light": (
        "pbrdf/kernels/optics/light.py",
        ["tests/analytic/test_light_at_a_facet.py"],
    ),
    "shadowing": (SHADOWING, [FACETS, PINS]),
    "slopes": (SLOPES, [FACETS, PINS]),
    "facet": (
        "pbrdf/kernels/microfacet/facet.py",
        ["tests/analytic/test_microfacet.py", FACETS, "tests/signs/test_signs_of_light.py"],
    ),
    "bodies": (
        "pbrdf/kernels/bodies/bodies.py",
        [
            "tests/contaminants/test_quadric_slabs.py",
            f"{LAWS}::test_a_sphere_in_slices_is_met_where_the_sphere_is",
        ],
    ),
    "interfaces": (
        "pbrdf/kernels/bodies/interfaces.py",
        ["tests/contaminants/test_beam_matrices.py"],
    ),
    "scatter": (SCATTER, [PINS, "tests/fits/test_statistics_parts.py"]),
    "uncertainty": (
        "fitting/objective/uncertainty.py",
        ["fitting/objective/uncertainty.py", PINS, "tests/fits/test_fit_solvers.py"],
    ),
}
# Read once, before mutants are split off
PRELOADED = ("numpy", "scipy.integrate", "scipy.special", "numba", "pandas", "xarray")
# module, text, what it becomes, name of the test that must fail
NAMED = (
    (SHADOWING, "4.41 * azimuth + 1.0", "4.41 * azimuth + 2.0", "hiding"),
    (SHADOWING, "return 4.41", "return 4.0", "hiding"),
    (SHADOWING, "sin_dphi = 2.0 *", "sin_dphi = 2.2 *", "slope_along"),
    (
        SHADOWING,
        "return 1.0 / (1.0 + lambda_i",
        "return 1.0 / (1.1 + lambda_i",
        "slope_along",
    ),
    (SLOPES, "0.2 + gap", "0.3 + gap", "cauchy"),
    (SLOPES, "series = 1.0 / 3.0 + gap", "series = 1.0 / 3.0 - gap", "cauchy"),
    (SCATTER, "= rise**2 @ weight", "= 0.5 * rise**2 @ weight", "isserlis"),
    (SCATTER, "drop + 2 * noise**2", "drop + noise**2", "isserlis"),
    ("fitting/objective/uncertainty.py", "* m / max(m - n, 1)", "", "robust"),
    ("fitting/result/likelihood.py", "widened = (", "widened = 1.0 + 0.0 * (", "student"),
    (NIST, "(np.cos(phi_i), np", "(np.cos(phi_i), -np", "nist"),
)


def changed(node: ast.AST) -> Iterator[ast.AST]:
    """Yield what one node may become."""
    new = copy.deepcopy(node)
    if isinstance(node, ast.BinOp) and type(node.op) in SWAPS:
        new.op = SWAPS[type(node.op)]()
        yield new
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield new.operand
    elif isinstance(node, ast.Compare) and type(node.ops[0]) in TURNS:
        new.ops[0] = TURNS[type(node.ops[0])]()
        yield new
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
        new.value = node.value * 1.1 if isinstance(node.value, float) else node.value + 1
        if node.value == 0:
            new.value = type(node.value)(1)
        yield new


def mutants(source: str) -> Iterator[tuple[int, str, str]]:
    """Yield line, description and text of each mutant of a module's functions."""
    lines = source.splitlines(keepends=True)
    inside = [f for f in ast.parse(source).body if isinstance(f, ast.FunctionDef)]
    for node in (child for f in inside for part in f.body for child in ast.walk(part)):
        if not isinstance(node, ast.expr) or node.lineno != node.end_lineno:
            continue
        for new in changed(node):
            line = lines[node.lineno - 1]
            # Columns of the parser count bytes
            raw = line.encode()
            old = raw[node.col_offset : node.end_col_offset].decode()
            text = f"({ast.unparse(new)})"
            edited = raw[: node.col_offset] + text.encode() + raw[node.end_col_offset :]
            whole = [*lines[: node.lineno - 1], edited.decode(), *lines[node.lineno :]]
            yield node.lineno, f"{old} -> {text[1:-1]}", "".join(whole)


def passes(folder: Path, tests: list[str], seconds: float) -> bool:
    """Whether the tests pass on the sources in a folder, in a process of their own."""
    child = os.fork()
    if child == 0:
        signal.alarm(int(seconds))
        sys.path.insert(0, str(folder))
        os.chdir(folder)
        with Path(os.devnull).open("w") as nowhere:
            os.dup2(nowhere.fileno(), 1)
            os.dup2(nowhere.fileno(), 2)
        os._exit(int(pytest.main(["-q", "-x", "-p", "no:cacheprovider", *tests])))
    # An endless loop is ended by the alarm, and is noticed
    return os.waitpid(child, 0)[1] == 0


def survives(
    folder: Path, module: str, text: str, tests: list[str], seconds: float
) -> bool:
    """Whether the tests pass with this text for the module."""
    target = folder / module
    original = target.read_text()
    target.write_text(text)
    try:
        return passes(folder, tests, seconds)
    finally:
        target.write_text(original)


def main() -> int:
    """Run the mutants that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("module", nargs="?")
    parser.add_argument("tests", nargs="*")
    parser.add_argument("--named", action="store_true")
    parser.add_argument("--judged", nargs="*", choices=JUDGED, metavar="NAME")
    parser.add_argument("--every", type=int, default=1, help="only every N-th mutant")
    parser.add_argument("--seconds", type=float, default=300.0, help="limit of one run")
    given = parser.parse_args()
    os.environ |= {"NUMBA_DISABLE_JIT": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    for package in PRELOADED:
        import_module(package)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for part in ("pbrdf", "fitting", "data_io", "tests"):
            shutil.copytree(ROOT / part, folder / part)
        shutil.copy(ROOT / "pyproject.toml", folder)
        if given.named:
            todo = [
                (
                    module,
                    f"{old} -> {new}",
                    (ROOT / module).read_text().replace(old, new),
                    [PINS, "-k", test],
                )
                for module, old, new, test in NAMED
            ]
        else:
            chosen = [(given.module, given.tests)]
            if given.judged is not None:
                chosen = [JUDGED[name] for name in given.judged or JUDGED]
            todo = [
                (module, f"line {line}: {what}", text, tests)
                for module, tests in chosen
                for line, what, text in list(mutants((ROOT / module).read_text()))[
                    :: given.every
                ]
            ]
        for tests in {tuple(tests) for *_, tests in todo}:
            if not passes(folder, list(tests), given.seconds):
                sys.exit(f"{' '.join(tests)} fails before anything is changed")
        kept = 0
        for module, what, text, tests in todo:
            if text == (ROOT / module).read_text():
                print(f"NOT FOUND {module} {what}", flush=True)
                kept += 1
            elif survives(folder, module, text, tests, given.seconds):
                print(f"SURVIVED {module} {what}", flush=True)
                kept += 1
        print(f"{kept} of {len(todo)} mutants survived")
    return int(kept > 0)


if __name__ == "__main__":
    sys.exit(main())
