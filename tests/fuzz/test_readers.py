"""A short run of the fuzzer for every reader; `make fuzz` is the long one."""

import pytest

from tests.fuzz.run import READERS, run


@pytest.mark.parametrize("name", READERS)
def test_damaged_files_are_refused_by_name(name):
    tally, faults = run(name, 60, seed=7)
    assert not faults, tally
    assert tally.get("refused", 0) > 5
