"""Groups of single points for the tests that ask for them."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.sweeps import scenes


@pytest.fixture
def by_points() -> Iterator[None]:
    with scenes.by_points():
        yield


@pytest.fixture(scope="package")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The store of the serial run, and what it was made from."""
    folder = tmp_path_factory.mktemp("whole")
    report = scenes.serial_run(folder)
    assert (report.computed, report.kept, report.errors) == (6, 0, {})
    return folder
