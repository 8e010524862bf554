"""A folder of results gives way to another in one step, or is put back."""

import os
from pathlib import Path

import pytest

from pbrdf.files import complete_folder, writing
from pbrdf.files.writing import ExistsError


def write(target: Path, text: str, *, replace: bool = True) -> None:
    with complete_folder(target, replace=replace) as stage:
        (stage / "a").write_text(text)


def killed_at(target: Path, step: int) -> None:
    """Replace a folder in a process that ends at its so manieth rename or exchange."""
    pid = os.fork()
    if pid:
        assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 9
        return
    rename, count = os.rename, [0]

    def counted(*given, **others):
        count[0] += 1
        if count[0] == step:
            os._exit(9)
        return rename(*given, **others)

    try:
        os.rename = counted
        write(target, "new")
    finally:
        os._exit(1)


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="only Linux exchanges names")
def test_at_no_moment_is_the_folder_missing(tmp_path, monkeypatch):
    target, seen = tmp_path / "out", []
    write(target, "old")
    remove = writing._remove

    def seeing(entry):
        seen.append([(one / "a").read_text() for one in (target, entry)])
        remove(entry)

    monkeypatch.setattr(writing, "_remove", seeing)
    write(target, "new")
    assert seen == [["new", "old"]]
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("step", [2, 3])
def test_a_folder_moved_aside_by_a_killed_process_is_put_back(tmp_path, monkeypatch, step):
    """Where no names can be exchanged two renames do it, and a third is the attempt."""
    monkeypatch.setattr(writing, "_exchanged", lambda *_: False)
    target = tmp_path / "out"
    write(target, "old")
    killed_at(target, step)
    assert target.exists() == (step == 2)
    with pytest.raises(ExistsError):
        write(target, "newer", replace=False)
    assert (target / "a").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    write(target, "newest")
    assert (target / "a").read_text() == "newest"


def test_a_file_may_give_way_to_a_folder(tmp_path):
    target = tmp_path / "out"
    target.write_text("a file")
    write(target, "new")
    assert (target / "a").read_text() == "new"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
