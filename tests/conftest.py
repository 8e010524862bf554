"""What every test may use: measured data where present, no window, patient hypothesis."""

import gc
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pytest
from hypothesis import settings

mpl.use("Agg")

# Modules and 5000 tests stay: to look through them for garbage again and again was a
# quarter of the time of collection
gc.set_threshold(50_000, 20, 20)


def pytest_collection_finish() -> None:
    gc.freeze()


# The first example of a property compiles the kernels under it
settings.register_profile("pbrdf", deadline=None, derandomize=True, max_examples=50)
settings.load_profile("pbrdf")


@pytest.fixture(scope="session", autouse=True)
def disks_are_not_waited_for() -> Iterator[None]:
    """Take what a disk is asked for as done: no test cuts the power, and each took 6 ms."""
    with pytest.MonkeyPatch.context() as patch:
        # A handle that is none is still an error
        patch.setattr(os, "fsync", os.fstat)
        yield


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder with the measured files and reference tables that are not in the project."""
    folder = os.environ.get("PBRDF_SHARED")
    if folder is None:
        pytest.skip("PBRDF_SHARED does not name the folder of measured data")
    return Path(folder)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--stability",
        action="store_true",
        help="print the table of numerical hazards with what was measured of each",
    )


@pytest.fixture
def measured(record_property: Callable[[str, Any], None]) -> Callable[..., None]:
    """Hold a measured value of a numerical hazard against its bound, and note both.

    The hazards are those of docs/numerical_stability.md.
    """

    def within(hazard: str, what: str, value: float, bound: float) -> None:
        record_property("hazard", [hazard, what, float(value), float(bound)])
        assert value <= bound, f"{hazard}, {what}: {value:g}, bound {bound:g}"

    return within


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    if not config.getoption("--stability"):
        return
    worst: dict[tuple[str, str], tuple[float, float, str]] = {}
    for outcome in ("passed", "failed"):
        for report in terminalreporter.getreports(outcome):
            for name, found in report.user_properties:
                if name != "hazard":
                    continue
                hazard, what, value, bound = found
                place = report.nodeid.split("[")[0].replace("tests/", "", 1)
                kept = worst.get((hazard, what), (-1.0, 0.0, ""))
                worst[hazard, what] = max(kept, (value, bound, place))
    print("\n\n| hazard | quantity | bound | measured | test |\n|---|---|---|---|---|")
    for (hazard, what), (value, bound, place) in sorted(
        worst.items(), key=lambda item: int(item[0][0][1:])
    ):
        print(f"| {hazard} | {what} | {bound:.2g} | {value:.2g} | `{place}` |")
