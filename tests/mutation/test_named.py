"""The mutants that once survived are still there to be made, and their tests to fail."""

import re

import pytest

from tests.mutation.run import NAMED, PINS, ROOT


@pytest.mark.parametrize(("module", "old", "new", "test"), NAMED)
def test_named_mutants_can_be_made(module, old, new, test):
    assert (ROOT / module).read_text().count(old) == 1
    assert old != new
    assert re.search(rf"(?m)^def test_\w*{test}", (ROOT / PINS).read_text())
