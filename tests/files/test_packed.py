"""Packed pieces of results: of how many, how large, and packed by what; all are bounded."""

import json
import os
import subprocess
import time
import zlib
from itertools import pairwise

import h5py
import numpy as np
import pytest

from data_io import read_result, write_result
from pbrdf.errors import DataFileError
from pbrdf.files.hdf5 import opened
from tests.fuzz.hostile import about, result


def refused(path, match):
    begin = time.process_time()
    with pytest.raises(DataFileError, match=match) as caught:
        read_result(path)
    assert time.process_time() - begin < 5.0
    assert len(str(caught.value)) <= 320


def inflating(file):
    """Eight kilobytes that inflate to a gigabyte; HDF5 goes on to the end of them."""
    variable = file.create_dataset("brdf", (1000,), "f8", chunks=(1000,), compression=9)
    packer = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    # A block on its own, which may stand there any number of times
    block = packer.compress(bytes(2**24)) + packer.flush(zlib.Z_FULL_FLUSH)
    # Adler's sum of zeros is 1, and their number modulo 65521
    adler = (2**30 % 65521) << 16 | 1
    zeros = b"\x78\xda" + 64 * block + b"\x03\x00" + adler.to_bytes(4, "big")
    variable.id.write_direct_chunk((0,), zeros)


def packed_twice(file):
    made = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    made.set_chunk((1000,))
    made.set_deflate(9)
    made.set_filter(h5py.h5z.FILTER_DEFLATE, 0, (9,))
    space = h5py.h5s.create_simple((1000,))
    variable = h5py.h5d.create(file.id, b"brdf", h5py.h5t.IEEE_F64LE, space, made)
    variable.write_direct_chunk((0,), zlib.compress(zlib.compress(bytes(8000))))


def many_ways(file):
    """Go through nine groups by twelve links each."""
    groups = [file.create_group(f"g{k}") for k in range(9)]
    for group, other in pairwise(groups):
        for k in range(12):
            group[f"x{k}"] = other


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (inflating, "variable brdf: a piece of it grows beyond 8000 bytes"),
        (packed_twice, "variable brdf: it is packed in a foreign way"),
        (many_ways, "more than 1000 groups and variables"),
    ],
)
def test_hdf5(tmp_path, make, words):
    path = tmp_path / "r.nc"
    with h5py.File(path, "w") as file:
        make(file)
    refused(path, words)


@pytest.mark.parametrize("kind", ["f4,i4", "S2", "c16"])
def test_a_result_holds_real_numbers(tmp_path, kind):
    path = tmp_path / "r.nc"
    with h5py.File(path, "w") as file:
        file.create_dataset("brdf", data=np.zeros((), np.dtype(kind)))
    refused(path, "variable brdf: expected numbers, got")


def test_pieces_of_whole_results_are_not_taken_for_bombs(tmp_path):
    """Noise is not packed at all; a single value a thousand times."""
    path = tmp_path / "r.nc"
    rng = np.random.default_rng(2)
    for values in (rng.standard_normal(300_000), np.zeros(300_000)):
        with h5py.File(path, "w") as file:
            made = file.create_dataset("x", data=values, chunks=(300_000,), compression=4)
            made.make_scale("x")
        np.testing.assert_array_equal(read_result(path).x, values)


def test_a_variable_that_was_never_written(tmp_path):
    # A length without values is written nowhere either, and says so
    with h5py.File(tmp_path / "length.nc", "w") as file:
        length = file.create_dataset("theta_i", (3,), "f4")
        length.attrs["NAME"] = b"This is a netCDF dimension but not a netCDF variable.   3"
        file.create_dataset("albedo", data=[0.1, 0.2, 0.3])
    with opened(tmp_path / "length.nc") as file:
        assert list(file) == ["albedo", "theta_i"]
    with h5py.File(tmp_path / "bare.nc", "w") as file:
        file.create_dataset("albedo", (3,), "f8")
    refused(tmp_path / "bare.nc", "variable albedo: none of its 3 values was written")


def zstd(head):
    def write(path):
        file = next((path / "brdf").glob("c*"))
        file.write_bytes(bytes.fromhex("28b52ffd") + bytes.fromhex(head) + bytes(40))

    return write


def pieces(*sides):
    return lambda path: about(
        path, chunk_grid={"name": "regular", "configuration": {"chunk_shape": sides}}
    )


def deep(path):
    place = os.open(path, os.O_RDONLY)
    for _ in range(3000):
        os.mkdir("a", dir_fd=place)
        place, before = os.open("a", os.O_RDONLY, dir_fd=place), place
        os.close(before)
    os.close(place)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            zstd("e0" + "00" * 4 + "01" + "00" * 3),
            "variable brdf: a piece of it would take",
        ),
        (zstd("0048"), "variable brdf: a piece of it would take inf"),
        (pieces(0, 1, 3, 4, 4, 4), "variable brdf: its 1152 values are in pieces of 0"),
        (pieces(*6 * [1e-4]), "variable brdf: its 1152 values are in pieces of 1e-24"),
        (lambda path: about(path, shape=[10**400]), "variable brdf: its shape"),
        (lambda path: about(path, chunk_grid=[]), "variable brdf: its shape"),
        (
            lambda path: about(path, codecs=[{"name": "bytes"}, *9 * [{"name": "crc32c"}]]),
            "variable brdf: it is packed by bytes, crc32c",
        ),
        (
            lambda path: about(path, attributes={"_FillValue": "AAAA"}),
            "cannot be read: unpack",
        ),
    ],
)
def test_zarr(tmp_path, change, words):
    path = tmp_path / "r.zarr"
    write_result(result(), path)
    change(path)
    refused(path, words)


def test_a_store_of_too_many_pieces(tmp_path):
    path = tmp_path / "r.zarr"
    write_result(result(), path)
    described = json.loads((path / "brdf" / "zarr.json").read_text())
    shape = [300, 200, *described["shape"][2:]]
    grid = {"name": "regular", "configuration": {"chunk_shape": [1, 1, 1, 1, 1, 1]}}
    about(path, shape=shape, chunk_grid=grid)
    refused(path, r"its 1.152e\+07 values are in pieces of 1")


@pytest.mark.parametrize("sums", [{".": []}, {"./wavelength": []}, {"brdf": 3}, [1]])
def test_a_store_whose_checksums_are_none(tmp_path, sums):
    path = tmp_path / "r.zarr"
    write_result(result(), path)
    root = json.loads((path / "zarr.json").read_text())
    root["attributes"]["pbrdf_checksums"] = json.dumps(sums)
    (path / "zarr.json").write_text(json.dumps(root))
    refused(path, "r.zarr: cannot be read")


def test_a_file_of_thousands_of_attributes(tmp_path):
    path = tmp_path / "r.nc"
    write_result(result(), path)
    with h5py.File(path, "r+") as file:
        for number in range(1001):
            file["brdf"].attrs[f"a{number}"] = 1
    refused(path, "/brdf has more than 1000 attributes")


def test_names_that_steer_a_terminal_are_written_out(tmp_path):
    path = tmp_path / "a\n\x1b[31mb\u202e.nc"
    with h5py.File(path, "w") as file:
        file.create_dataset("c\n\x1b[2Jd", (9,), "f8", chunks=(3,))
    refused(
        path, r"^a \\x1b\[31mb\\u202e.nc, column variable c \\x1b\[2Jd: it holds 0 of 3"
    )


def test_a_store_of_endless_depth(tmp_path):
    path = tmp_path / "r.zarr"
    write_result(result(), path)
    deep(path)
    try:
        refused(path, "nest too deeply")
    finally:
        # More than Python removes
        subprocess.run(["rm", "-r", str(path)], check=True)
