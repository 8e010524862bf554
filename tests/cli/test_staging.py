"""Output appears whole or not at all, and never takes the place of a stranger's files."""

from pathlib import Path

import pytest

from pbrdf.cli import main
from pbrdf.cli.staging import MARK, staged_file, staged_folder


class BrokenError(Exception):
    pass


def listing(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def test_a_folder_appears_when_the_block_succeeds(tmp_path: Path) -> None:
    with staged_folder(tmp_path / "out") as stage:
        (stage / MARK).write_text("new")
        assert not (tmp_path / "out").exists()
    assert listing(tmp_path) == ["out", f"out/{MARK}"]


def fail_half_way(target: Path, **options: bool) -> None:
    """Write part of a folder's result, then fail."""
    with staged_folder(target, **options) as stage:
        (stage / MARK).write_text("half")
        raise BrokenError


def fail_half_a_file(target: Path) -> None:
    with staged_file(target) as stage:
        stage.write_text("half")
        raise BrokenError


def test_a_failure_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(BrokenError):
        fail_half_way(tmp_path / "out")
    with pytest.raises(BrokenError):
        fail_half_a_file(tmp_path / "out.nc")
    assert listing(tmp_path) == []


def test_a_failure_keeps_the_earlier_result(tmp_path: Path) -> None:
    earlier = tmp_path / "out" / MARK
    earlier.parent.mkdir()
    earlier.write_text("old")
    with pytest.raises(BrokenError):
        fail_half_way(tmp_path / "out", force=True)
    assert earlier.read_text() == "old"
    assert listing(tmp_path) == ["out", f"out/{MARK}"]


def test_force_replaces_an_earlier_result_whole(tmp_path: Path) -> None:
    with staged_folder(tmp_path / "out") as stage:
        (stage / MARK).write_text("old")
        (stage / "old.png").write_text("old")
    with staged_folder(tmp_path / "out", force=True) as stage:
        (stage / MARK).write_text("new")
    assert listing(tmp_path) == ["out", f"out/{MARK}"]
    assert (tmp_path / "out" / MARK).read_text() == "new"


@pytest.mark.parametrize("force", [False, True])
def test_a_strangers_folder_is_never_replaced(tmp_path: Path, force: bool) -> None:
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter1.tex").write_text("years of work")
    with (
        pytest.raises(ValueError, match=r"output must be a new folder .* Name another\."),
        staged_folder(tmp_path / "thesis", force=force),
    ):
        pass
    assert listing(tmp_path) == ["thesis", "thesis/chapter1.tex"]


def test_without_force_nothing_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "out.nc").write_text("old")
    with pytest.raises(ValueError, match="exists"), staged_file(tmp_path / "out.nc"):
        pass
    with staged_file(tmp_path / "out.nc", force=True) as stage:
        assert stage.suffix == ".nc"
        stage.write_text("new")
    assert (tmp_path / "out.nc").read_text() == "new"


def test_the_parent_must_exist(tmp_path: Path) -> None:
    with (
        pytest.raises(ValueError, match="folder that exists"),
        staged_folder(tmp_path / "a/b"),
    ):
        pass


def test_an_input_is_never_replaced(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").mkdir()
    measured = "x_um,z_um\n" + "\n".join(f"{k},{(k * k) % 7}" for k in range(200))
    for name in ("map.csv", "scan.csv", "out/map.csv", f"out/{MARK}"):
        (tmp_path / name).write_text(measured)
    (tmp_path / "link.csv").symlink_to("map.csv")
    (tmp_path / "r.zarr").mkdir()
    (tmp_path / "r.zarr/zarr.json").write_text("{}")
    before = listing(tmp_path)
    numbers = ["--n", "1.5", "--wavelength-um", "0.5", "--theta-i-deg", "30"]
    for words, said in (
        (["predict", "map.csv", *numbers, "-o", "./map.csv"], "what is read, map.csv"),
        (["predict", "link.csv", *numbers, "-o", "map.csv"], "what is read, link.csv"),
        (
            ["pipeline", "out/map.csv", "scan.csv", "--n", "1.5", "-o", "out"],
            "what is read",
        ),
        (["predict", "map.csv", *numbers, "-o", "r.zarr/a.csv"], "within a store"),
    ):
        assert main([*words, "--force"]) == 2
        assert said in capsys.readouterr().err
    assert listing(tmp_path) == before
    assert (tmp_path / "map.csv").read_text() == measured


def test_two_outputs_have_two_names(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rows = "\n".join(f"{k},{(k * k) % 7}" for k in range(200))
    (tmp_path / "profile.csv").write_text(f"x_um,z_um\n{rows}\n")
    words = ["statistics", "profile.csv", "--figure", "a.png", "--slopes", "./a.png"]
    assert main([*words, "--force"]) == 2
    assert "a name of its own" in capsys.readouterr().err
