"""The page of a sweep: made from its store, finished or not, of a grid or a list."""

import base64
import re
import shutil

import pytest

from fitting.report.explorer import page_of
from pbrdf.cli import main
from pbrdf.stored import read_sweep
from tests.sweeps.scenes import SWEEP, serial_run

zarr = pytest.importorskip("zarr", reason="the extra sweeps is not installed")


@pytest.fixture
def store(whole):
    return whole / "s.zarr"


def test_the_command_makes_the_page_of_a_store(store, tmp_path):
    assert main(["report", str(store), "-o", str(tmp_path / "s.html")]) == 0
    page = (tmp_path / "s.html").read_text(encoding="utf-8")
    assert "3 values (0.05 to 0.2) of slope_rms and 2 values (1.4 to 1.6) of n" in page
    assert '"name": "slope_rms"' in page
    (text,) = re.findall(r'download="points.csv" href="data:[^,]*,([^"]*)"', page)
    table = base64.b64decode(text).decode().splitlines()
    assert len(table) == 1 + 3 * 2 * 3 * 2
    assert table[0].startswith("slope_rms,n,bounces,theta_i_deg,albedo,albedo_stderr")


def test_what_is_missing_is_said_and_not_drawn(store, tmp_path):
    broken = tmp_path / "b.zarr"
    shutil.copytree(store, broken)
    for name, value in (("state", 0), ("brdf_total", float("nan"))):
        zarr.open_array(broken / name, mode="r+")[1, 0] = value
    result = read_sweep(broken)
    assert result.attrs["points"] == {"missing": 1, "done": 5, "failed": 0}
    page = page_of(result, "b.zarr")
    assert "5 of 6 points are computed, 1 missing: the page is grey there." in page


def test_a_large_store_is_thinned_evenly_and_says_so(store):
    whole = read_sweep(store)
    few = read_sweep(store, most_bytes=whole.nbytes * 0.7)
    assert list(few.slope_rms.values) == [0.05, 0.2]
    assert few.attrs["left_out"] == {"slope_rms": "2 of 3"}
    assert few.brdf_total.equals(whole.brdf_total.isel(slope_rms=[0, 2]))
    assert "The page holds 2 of 3 values of slope_rms" in page_of(few, "s.zarr")


def test_points_of_a_list_are_named_by_what_varies(tmp_path):
    text = SWEEP.replace("[0.05, 0.1, 0.2]", "{ from = 0.05, to = 0.2 }")
    text = text.replace("[1.4, 1.6]", "{ from = 1.4, to = 1.6 }")
    serial_run(tmp_path, text + '\n[design]\nkind = "latin-hypercube"\npoints = 2\n')
    result = read_sweep(tmp_path / "s.zarr")
    for point in map(str, result.point.values):
        assert re.fullmatch(r"n 1\.\d+, slope_rms 0\.\d+", point), point
    assert "A sweep over 2 points." in page_of(result, "s.zarr")


def test_other_stores_are_refused_by_name(tmp_path):
    with pytest.raises(ValueError, match="must be a store of pbrdf sweep"):
        read_sweep(tmp_path)
