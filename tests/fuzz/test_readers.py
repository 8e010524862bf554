"""A short run of the fuzzer for every reader; `make fuzz` is the long one."""

import pytest

from tests.fuzz.kept import check
from tests.fuzz.run import READERS, run


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("count", [20, pytest.param(60, marks=pytest.mark.slow)])
def test_damaged_files_are_refused_by_name(name, count):
    tally, faults = run(name, count, seed=7)
    assert not faults, tally
    assert tally.get("refused", 0) > 5


@pytest.mark.filterwarnings("ignore::data_io.ConventionWarning")
@pytest.mark.parametrize("name", ["goniometer", "fred", "table-utf16", "astm", "wide"])
def test_values_in_another_place_are_noticed(name, tmp_path):
    make, suffix, read = READERS[name]
    path = tmp_path / f"file{suffix}"
    path.write_bytes(make())
    scan = read(path)
    assert check(scan, path) is None
    turned = scan.assign(M00=scan.M00.roll(geometry=1))
    assert "stands on no line" in check(turned, path)
    assert "stands on no line" in check(scan.assign(M00=scan.M00 * 10.0), path)
