"""Tables, surfaces and stores of a size that nothing has: refused at once, and why."""

import time

import numpy as np
import pytest

import pbrdf
from data_io import (
    read_goniometer,
    read_height_map,
    read_profile,
    read_result,
    write_result,
)
from data_io.topography.column_names import _split_outside
from pbrdf.errors import DataFileError
from pbrdf.signatures.bands import read_response
from pbrdf.signatures.skies import read_sky
from tests.fuzz.hostile import result


@pytest.mark.parametrize("read", [read_goniometer, read_sky, read_response])
def test_half_a_million_columns_are_no_table(tmp_path, read):
    path = tmp_path / "head.csv"
    path.write_text(500_000 * "a," + "\n" + 500_000 * "1,")
    begin = time.process_time()
    with pytest.raises(DataFileError, match="line 1: expected at most 10000 columns"):
        read(path)
    assert time.process_time() - begin < 3.0


def test_names_over_a_wide_map_are_read_in_linear_time(tmp_path):
    path = tmp_path / "map.csv"
    path.write_text(200_000 * "a," + "\n" + 200_000 * "1,")
    begin = time.process_time()
    with pytest.raises(DataFileError, match="expected a grid spacing"):
        read_height_map(path)
    assert time.process_time() - begin < 5.0


def test_tables_of_texts_within_one_another_are_refused_in_linear_time(tmp_path):
    """Each of them is said to go on to the end of the file."""
    path = tmp_path / "a.nc"
    sizes = (2**40).to_bytes(8, "little"), (16).to_bytes(8, "little")
    one = b"GCOL\1\0\0\0" + sizes[0] + b"\1" + bytes(7) + sizes[1]
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + 60_000 * one)
    begin = time.process_time()
    with pytest.raises(DataFileError, match="table of texts"):
        read_result(path)
    assert time.process_time() - begin < 2.0


@pytest.mark.parametrize("suffix", [".sur", ".spm", ".dat"])
@pytest.mark.parametrize("held", [bytes(8), b"abc def\n", b"abc def ", b"1 2 x 4\n"])
def test_large_files_of_nothing_are_no_maps(tmp_path, held, suffix):
    """They went to readers of tables, which read them some hundred times."""
    pytest.importorskip("SurfaceTopography")
    path = tmp_path / f"map{suffix}"
    path.write_bytes(held * 500_000)
    begin = time.process_time()
    with pytest.raises(DataFileError, match="map"):
        read_height_map(path)
    assert time.process_time() - begin < 5.0


@pytest.mark.parametrize(
    ("text", "cells"),
    [
        ("x [mm, rounded],z", ["x [mm, rounded]", "z"]),
        ("a,b (c,d),e]f,g", ["a", "b (c,d),e]f", "g"]),
        ("a,b],c", ["a,b]", "c"]),
        ("[a,b", ["[a", "b"]),
    ],
)
def test_separators_inside_brackets_separate_nothing(text, cells):
    assert _split_outside(",", text) == cells


def test_blank_lines_before_a_map_are_no_empty_file(tmp_path):
    path = tmp_path / "map.csv"
    path.write_text(3000 * "\n" + "1,2,3\n4,5,6\n7,8,9\n")
    assert read_height_map(path, spacing=1.0, unit="um").heights[0, 1] == 4.0
    for size in (0, 3, 4000):
        path.write_text(size * " ")
        with pytest.raises(DataFileError, match="the file is empty"):
            read_height_map(path, spacing=1.0)


def test_readings_brighter_than_any_surface_are_refused(tmp_path):
    path = tmp_path / "scan.csv"
    path.write_text("theta_i_deg,theta_s_deg,dphi_deg,M00\n10,10,180,1e12\n10,20,180,2\n")
    with pytest.raises(DataFileError, match=r"line 2, column M00: expected at most 1e\+09"):
        read_goniometer(path)
    assert read_goniometer(path, quantity="relative").M00[0] == 1e12


@pytest.mark.parametrize("read", [read_goniometer, read_profile, read_height_map])
@pytest.mark.parametrize(
    "text",
    ["1" + 200_000 * " " + "x\n", 50_000 * "a[" + ",1\n2,3\n", 600_000 * "#\n"],
    ids=["spaces", "brackets", "remarks"],
)
def test_names_and_headers_without_an_end_are_refused_soon(tmp_path, read, text):
    path = tmp_path / "a.csv"
    path.write_text(text)
    begin = time.process_time()
    with pytest.raises(DataFileError, match=r"a\.csv"):
        read(path)
    assert time.process_time() - begin < 5.0


@pytest.mark.parametrize("scale", ["0", "-1.0", "nan", "1e999"])
def test_scales_of_a_profile_are_numbers_above_zero(tmp_path, scale):
    path = tmp_path / "a.prf"
    heights = "".join(f"{k % 7}\n" for k in range(40))
    path.write_text(f"1 2\nCX I 40 MM 1e-3 D\nCZ A 40 UM {scale} D\nEOR\n{heights}EOR\n")
    with pytest.raises(DataFileError, match="column CZ: expected a scale above 0, got"):
        read_profile(path)


def test_results_that_no_run_gives_are_refused(tmp_path):
    dataset = result()
    dataset.brdf_total[0, 0, 0, 0, 0] = np.inf
    for name in ("r.nc", "r.zarr"):
        write_result(dataset, tmp_path / name)
        with pytest.raises(DataFileError, match="variable brdf_total: it holds inf"):
            read_result(tmp_path / name)


@pytest.mark.parametrize("run", [pbrdf.simulate, pbrdf.observe])
def test_a_surface_beyond_the_memory_is_named(run):
    surface = pbrdf.GaussianSurface(
        shape=(10**6, 10**6), spacing=1.0, corr_length=8.0, slope_rms=0.2
    )
    scene = pbrdf.Scene(surface, pbrdf.Material(1.5))
    angles = [[0.3]] if run is pbrdf.simulate else [[0.3], [0.3], [3.0]]
    with pytest.raises(ValueError, match="1000000 x 1000000 nodes of the surface"):
        run(scene, *angles, n_rays=1000, realizations=4)
