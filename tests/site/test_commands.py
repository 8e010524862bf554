"""What the site tells a new user to paste works when pasted."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import data_io
from pbrdf.cli import main
from tests.fits.test_pipeline import FEW, write_scan
from tests.pictures.results import hand_made

ROOT = Path(__file__).parents[2]


def blocks(page: str, language: str) -> list[str]:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, re.S)


def make_files(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The two files of one's own that the pages begin with."""
    monkeypatch.syspath_prepend(ROOT / "examples")
    import micrograph

    micrograph.make_micrograph(folder / "edge.png", 3)
    write_scan(folder / "scan.csv", ("M00", "M10"))


@pytest.mark.slow
def test_commands_of_the_site_work_as_pasted(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    make_files(tmp_path, monkeypatch)
    done = set()
    for page in ("quick_start.md", "tasks.md"):
        for line in "".join(blocks(page, "sh")).splitlines():
            words = shlex.split(line)[1:]
            if line in done or tuple(words[:1]) == ():
                continue
            done.add(line)
            if words[0] == "pipeline" and "--quick" not in words:
                words += FEW
            assert main(words) == 0, (line, capsys.readouterr().err)
    assert len(done) > 15


@pytest.mark.slow
def test_code_of_the_quick_start_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code = blocks("quick_start.md", "python")[0]
    exec(compile(code, "quick_start.md", "exec"), {})
    assert "pbrdf" in sys.modules


def test_a_stored_result_opens_in_a_new_notebook_as_told(tmp_path):
    data_io.write_result(hand_made(), tmp_path / "paint.nc")
    _, code = blocks("quick_start.md", "python")
    told = (ROOT / "docs/quick_start.md").read_text(encoding="utf-8")
    (line,) = re.findall(r"`(import pbrdf\.\w+)`", told)
    other = f"{line}, xarray as xr; xr.open_dataset('paint.nc').pbrdf.dolp()"
    for text in (code, other, "import pbrdf, sys; assert 'xarray' not in sys.modules"):
        subprocess.run([sys.executable, "-c", text], cwd=tmp_path, check=True, timeout=60)
