"""Outputs appear whole or not at all, whatever happens to the process or the disk."""

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from pbrdf import HeightMap, Scene, load_scene
from pbrdf.cli import main
from pbrdf.files import complete_file, complete_folder
from pbrdf.files.writing import ExistsError
from tests.faults.run import SCENE

RUN = [sys.executable, "-m", "pbrdf", "simulate", "scene.toml", "--n-theta", "9",
       "--n-dphi", "12", "--realizations", "8", "--n-rays", "2000"]  # fmt: skip


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path


def write_text(path: Path, text: str) -> str:
    """Write without replacing; say who won."""
    try:
        with complete_file(path, replace=False) as stage:
            stage.write_text(text)
            time.sleep(0.02)
    except ExistsError:
        return "late"
    return text


def test_the_longest_names_are_taken(tmp_path):
    for name in ("x" * 252 + ".nc", "\u00b5" * 120 + ".nc", "\U0001f600" * 62 + ".nc"):
        with complete_file(tmp_path / name) as stage:
            stage.write_text(name)
        assert (tmp_path / name).read_text() == name


def test_of_many_writers_exactly_one_wins(tmp_path):
    for attempt in range(5):
        path = tmp_path / f"out{attempt}.txt"
        with ThreadPoolExecutor(8) as pool:
            found = list(pool.map(lambda k, p=path: write_text(p, f"run {k}"), range(8)))
        winners = [text for text in found if text != "late"]
        assert len(winners) == 1
        assert path.read_text() == winners[0]
    assert len(names(tmp_path)) == 5


def test_of_two_folders_exactly_one_wins(tmp_path):
    def write(number: int) -> str:
        try:
            with complete_folder(tmp_path / "out") as stage:
                (stage / "a").write_text(str(number))
                time.sleep(0.05)
        except ExistsError:
            return "late"
        return str(number)

    with ThreadPoolExecutor(4) as pool:
        found = sorted(pool.map(write, range(4)))
    assert found[1:] == ["late"] * 3
    assert names(tmp_path) == ["out"]


def test_an_interrupted_folder_is_cleared_though_threads_still_write(tmp_path):
    """Zarr writes by threads of its own, which an interrupt does not stop."""
    ready, ends = threading.Event(), time.monotonic() + 0.2

    def write(stage: Path) -> None:
        for k in count():
            place = stage / f"d{k % 7}"
            with suppress(OSError):
                place.mkdir(parents=True, exist_ok=True)
                (place / f"f{k}").write_bytes(b"x")
            ready.set()
            if time.monotonic() > ends:
                return

    def interrupted() -> None:
        with complete_folder(tmp_path / "out") as stage:
            threads.append(threading.Thread(target=write, args=(stage,)))
            threads[0].start()
            ready.wait()
            raise KeyboardInterrupt

    threads: list[threading.Thread] = []
    with pytest.raises(KeyboardInterrupt):
        interrupted()
    threads[0].join()
    assert names(tmp_path) == []


def test_a_link_of_a_guessed_name_is_not_followed(tmp_path):
    victim = tmp_path / "victim"
    victim.write_text("kept")
    (tmp_path / "scene.toml.part").symlink_to(victim)
    Scene(HeightMap.flat(), "bk7").to_toml(tmp_path / "scene.toml")
    assert victim.read_text() == "kept"


def test_heights_of_a_scene_overwrite_no_other_file(tmp_path):
    (tmp_path / "scene.npy").write_bytes(b"somebody else's")
    rng = np.random.default_rng(5)
    first, second = (
        Scene(HeightMap(rng.standard_normal((80, 70)), 0.5), "bk7") for _ in range(2)
    )
    first.to_toml(tmp_path / "scene.toml")
    before = (tmp_path / "scene.toml").read_text()
    second.to_toml(tmp_path / "scene.toml")
    assert (tmp_path / "scene.npy").read_bytes() == b"somebody else's"
    np.testing.assert_array_equal(
        load_scene(tmp_path / "scene.toml").surface.heights, second.surface.heights
    )
    # The earlier text still finds its own heights
    (tmp_path / "earlier.toml").write_text(before)
    np.testing.assert_array_equal(
        load_scene(tmp_path / "earlier.toml").surface.heights, first.surface.heights
    )


def test_leftovers_of_dead_processes_are_cleared_away(tmp_path):
    code = (
        "import os, sys; from pathlib import Path; from pbrdf.files import complete_file\n"
        "with complete_file(Path(sys.argv[1]) / 'out.nc') as stage:\n"
        "    stage.write_text('half'); print('ready', flush=True); os.kill(os.getpid(), 9)"
    )
    killed = subprocess.run([sys.executable, "-c", code, tmp_path], check=False)
    assert killed.returncode == -9
    assert len(names(tmp_path)) == 1
    with complete_file(tmp_path / "other.nc") as stage:
        stage.write_text("whole")
    assert names(tmp_path) == ["other.nc"]


def test_what_a_running_process_writes_is_left_alone(tmp_path):
    with complete_file(tmp_path / "a.nc") as one:
        one.write_text("a")
        with complete_file(tmp_path / "b.nc") as two:
            two.write_text("b")
        assert one.exists()
    assert names(tmp_path) == ["a.nc", "b.nc"]


def _listen():
    """Let interrupts through: shells start background jobs with them ignored."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.mark.slow
@pytest.mark.parametrize("kill", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
def test_a_killed_run_leaves_nothing_after_the_next(folder, kill):
    expected = {signal.SIGTERM: 143, signal.SIGINT: 130, signal.SIGKILL: -9}
    for wait in (1.0, 2.5, 4.0):
        run = subprocess.Popen(
            [*RUN, "--n-rays", "400000", "--realizations", "400"], cwd=folder,
            stderr=subprocess.PIPE, preexec_fn=_listen,
        )  # fmt: skip
        time.sleep(wait)
        run.send_signal(kill)
        run.communicate(timeout=300)
        # Before Python has set itself up a signal ends it the plain way
        assert run.returncode in (expected[kill], -kill)
        assert not (folder / "scene.nc").exists()
    assert subprocess.run(RUN, cwd=folder, check=False).returncode == 0
    assert names(folder) == ["scene.nc", "scene.toml"]


@pytest.mark.slow
def test_twin_runs_have_one_winner(folder):
    runs = [
        subprocess.Popen(RUN, cwd=folder, stderr=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    said = [run.communicate()[1] for run in runs]
    codes = sorted(run.returncode for run in runs)
    assert codes == [0, 2]
    assert sum("which exists" in text for text in said) == 1
    assert names(folder) == ["scene.nc", "scene.toml"]


LIMITED = """
import resource, sys
# Bytecode cut short by the limit would be kept and fail later
sys.dont_write_bytecode = True
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), int(sys.argv[1])))
from pbrdf.cli import main
code = main(["--quiet", "init", "scene.toml", "--force"])
sys.stderr.write("alive\\n")
sys.exit(code)
"""
STORED = """
import resource, sys
# Bytecode cut short by the limit would be kept and fail later
sys.dont_write_bytecode = True
import numpy as np
import xarray as xr
from data_io import write_result
values = np.random.default_rng(1).standard_normal((40, 500))
dataset = xr.Dataset({"a": (("x", "y"), values)})
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), int(sys.argv[1])))
try:
    write_result(dataset, "result.nc")
except OSError as error:
    print(error.filename, dataset.a.sum().item())
"""


@pytest.mark.parametrize("limit", [0, 1, 100, 300])
def test_a_full_disk_ends_a_command_in_one_line(tmp_path, limit):
    run = subprocess.run(
        [sys.executable, "-c", LIMITED, str(limit)], cwd=tmp_path, capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    assert run.returncode == 1
    lines = run.stderr.splitlines()
    assert len(lines) == 2
    assert lines[0].startswith("error: scene.toml: ")
    assert "Make room" in lines[0]
    assert lines[1] == "alive"
    assert names(tmp_path) == []


@pytest.mark.parametrize(
    "limit",
    [
        pytest.param(0, marks=pytest.mark.slow),
        1000,
        pytest.param(40_000, marks=pytest.mark.slow),
        pytest.param(100_000, marks=pytest.mark.slow),
    ],
)
def test_a_full_disk_leaves_results_in_memory(tmp_path, limit):
    """HDF5 itself took the interpreter with it here."""
    run = subprocess.run(
        [sys.executable, "-c", STORED, str(limit)], cwd=tmp_path, capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert run.stdout.startswith("result.nc ")
    assert names(tmp_path) == []


def test_files_have_the_rights_of_any_new_file(tmp_path):
    with complete_file(tmp_path / "a") as stage:
        stage.write_text("a")
    (tmp_path / "b").write_text("b")
    modes = {(tmp_path / name).stat().st_mode for name in "ab"}
    assert len(modes) == 1


@pytest.mark.parametrize(
    ("make", "complete"), [("mkstemp", complete_file), ("mkdtemp", complete_folder)]
)
def test_a_refusal_names_the_output_and_not_its_stage(
    tmp_path, monkeypatch, make, complete
):
    def refuse(**_):
        raise PermissionError(13, "Permission denied", "/x/.out.part-a-1-b")

    monkeypatch.setattr(f"tempfile.{make}", refuse)
    with pytest.raises(PermissionError) as caught, complete(tmp_path / "out.nc"):
        pass
    assert caught.value.filename == str(tmp_path / "out.nc")


@pytest.mark.slow
def test_names_that_are_no_text_are_refused_with_a_cure(tmp_path, capsys):
    """The record of a fit names its file."""
    path = tmp_path / os.fsdecode(b"scan\xfe.csv")
    rows = "".join(f"30,{v},{0.2 - abs(v - 30) / 900:.4f}\n" for v in range(-60, 65, 10))
    path.write_text(f"theta_i_deg,theta_view_deg,M00\n{rows}")
    given = ["--n", "1.5", "--slope-rms", "0.2", "-o", str(tmp_path / "out")]
    assert main(["--quiet", "fit", str(path), *given]) == 2
    assert "scan\\udcfe' cannot be written as UTF-8. Rename" in capsys.readouterr().err
    assert names(tmp_path) == [path.name]
