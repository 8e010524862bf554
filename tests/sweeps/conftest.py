"""Groups of single points for the tests that ask for them."""

from collections.abc import Iterator

import pytest

from tests.sweeps import scenes


@pytest.fixture
def by_points() -> Iterator[None]:
    with scenes.by_points():
        yield
