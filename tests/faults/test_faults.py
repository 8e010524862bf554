"""A short run of the faults; `make faults` is the long one."""

import random

import pytest

from tests.faults.run import full_disk, kill, twins


@pytest.mark.slow
@pytest.mark.parametrize("name", ["simulate", "simulate to a store"])
def test_a_killed_run_leaves_whole_outputs_or_none(tmp_path, name):
    assert kill(name, random.Random(4), 4.0, 3, True, tmp_path).startswith("fine")


@pytest.mark.slow
def test_of_twin_stores_one_wins(tmp_path):
    assert twins("simulate to a store", tmp_path) == "fine"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["simulate", "simulate to a store"])
def test_a_full_disk_is_one_line(tmp_path, name):
    assert full_disk(name, 8, tmp_path).startswith("refused")
