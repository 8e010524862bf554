"""Files from strangers: refused by name, soon, within memory; never believed too far."""

import hashlib
import io
import json
import os
import time
import warnings
import zipfile
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

import data_io
import pbrdf
from pbrdf.errors import DataFileError
from pbrdf.sweeps import load_sweep

FAULTS = Path(__file__).parent / "faults"


def read_any(path: Path) -> object:
    """Read a file as what its name says."""
    readers = {
        ".nc": data_io.read_result,
        ".npy": lambda p: data_io.read_height_map(p, spacing=1.0),
        ".x3p": data_io.read_height_map,
        ".toml": pbrdf.load_scene,
        ".csv": data_io.read_goniometer,
        ".sur": data_io.read_height_map,
        ".png": lambda p: data_io.read_profile_image(p, um_per_pixel=1.0),
    }
    return readers[path.suffix](path)


def refused(path: Path, match: str | None = None) -> str:
    """Return the message of a refusal that is quick, short and names the file."""
    start = time.process_time()
    with pytest.raises(DataFileError, match=match) as caught:
        read_any(path)
    assert time.process_time() - start < 5.0
    message = str(caught.value)
    assert path.name in message
    assert len(message) <= 320
    assert "\n" not in message
    return message


@pytest.mark.parametrize("path", sorted(FAULTS.iterdir()), ids=lambda path: path.name)
def test_a_damaged_or_hostile_file_is_refused(path):
    refused(path)


def test_a_flipped_bit_is_named_by_its_variable():
    assert "variable brdf:" in refused(FAULTS / "flipped_brdf.nc")


def small_result() -> xr.Dataset:
    rng = np.random.default_rng(3)
    return xr.Dataset(
        {"brdf": (("x", "y"), rng.standard_normal((5, 7))), "albedo": ("x", np.ones(5))},
        coords={"x": np.arange(5.0), "stokes": ("x", list("IQUVW"))},
        attrs={"seed": 4, "warnings": ["none"]},
    )


@pytest.mark.slow
def test_any_flipped_bit_is_seen_or_harmless(tmp_path):
    """Half of all bytes are padding of HDF5; none may change a value without a word."""
    path = tmp_path / "result.nc"
    good = small_result()
    data_io.write_result(good, path)
    content = path.read_bytes()
    rng = np.random.default_rng(8)
    seen = 0
    for place in rng.choice(len(content), 300, replace=False):
        damaged = bytearray(content)
        damaged[place] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        try:
            read = data_io.read_result(path)
        except DataFileError:
            seen += 1
            continue
        xr.testing.assert_identical(read.drop_attrs(), good.drop_attrs())
    assert seen > 30


def test_a_table_of_texts_without_an_end_is_refused(tmp_path):
    """HDF5 goes round in it for ever: an object of no size."""
    path = tmp_path / "result.nc"
    data_io.write_result(small_result(), path)
    content = bytearray(path.read_bytes())
    start = content.index(b"GCOL") + 16
    content[start : start + 2] = bytes(2)
    content[start + 8 : start + 16] = bytes(8)
    path.write_bytes(content)
    assert "table of texts" in refused(path)


def test_a_changed_attribute_is_seen(tmp_path):
    path = tmp_path / "result.nc"
    data_io.write_result(small_result().assign_attrs(scene="slope_rms = 0.25"), path)
    content = path.read_bytes()
    assert content.count(b"slope_rms = 0.25") == 1
    path.write_bytes(content.replace(b"slope_rms = 0.25", b"slope_rms = 0.52"))
    assert "attributes" in refused(path)


def test_results_of_earlier_versions_are_read(tmp_path):
    """They have no checksums."""
    path = tmp_path / "old.nc"
    small_result().assign_attrs(warnings="json:[]").to_netcdf(path, engine="h5netcdf")
    assert data_io.read_result(path).attrs["warnings"] == []


def test_checksums_of_earlier_versions_are_compared(tmp_path):
    """They are SHA-256, of dimensions, shape, kind, attributes and values."""
    path, values = tmp_path / "old.nc", np.arange(12.0).reshape(3, 4)
    for factor in (1.0, 1.0 + 1e-15):
        head = b"('x', 'y') (3, 4) <f8 []\0"
        held = {"a": hashlib.sha256(head + values.tobytes()).hexdigest()}
        dataset = xr.Dataset({"a": (("x", "y"), factor * values)})
        dataset.attrs["pbrdf_checksums"] = json.dumps(held)
        dataset.to_netcdf(path, engine="h5netcdf")
        if factor == 1.0:
            np.testing.assert_array_equal(data_io.read_result(path).a, values)
    assert "variable a: the values are not those" in refused(path)


def test_data_that_lie_elsewhere_are_not_fetched(tmp_path):
    secret = tmp_path / "secret.bin"
    secret.write_bytes(np.arange(10.0).tobytes())
    path = tmp_path / "result.nc"
    with h5py.File(path, "w") as file:
        file.create_dataset("a", (10,), "f8", external=[(str(secret), 0, 80)])
    assert "variable a" in refused(path, "another file")
    with h5py.File(path, "w") as file:
        file["a"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "/x")
    refused(path, "link to somewhere else")
    with h5py.File(path, "w") as file:
        layout = h5py.VirtualLayout((10,), "f8")
        layout[:] = h5py.VirtualSource(str(tmp_path / "other.h5"), "x", (10,))
        file.create_virtual_dataset("a", layout)
    refused(path, "put together")


def test_a_scene_reads_files_of_its_own_folder_only(tmp_path):
    np.save(tmp_path / "heights.npy", np.zeros((4, 4)))
    inner = tmp_path / "inner"
    inner.mkdir()
    scene = '[surface]\ntype="height_map"\nfile="{}"\nspacing_um=1.0\n[substrate]\nn=1.5\n'
    for name in ("../heights.npy", str(tmp_path / "heights.npy")):
        (inner / "scene.toml").write_text(scene.format(name))
        refused(inner / "scene.toml", "outside the folder")
    (inner / "link.npy").symlink_to(tmp_path / "heights.npy")
    (inner / "scene.toml").write_text(scene.format("link.npy"))
    refused(inner / "scene.toml", "outside the folder")


def bomb_x3p(path: Path) -> None:
    xml = b"<a>" + b" " * (300 * 2**20) + b"</a>"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("main.xml", xml)


def bomb_png(path: Path) -> None:
    """Write 40000 x 40000 pixels of one grey in a few hundred kilobytes."""
    from struct import pack

    def chunk(kind: bytes, data: bytes) -> bytes:
        return pack(">I", len(data)) + kind + data + pack(">I", zlib.crc32(kind + data))

    squeeze = zlib.compressobj(9)
    rows = b"".join(squeeze.compress(b"\0" * 40_001) for _ in range(2000)) + squeeze.flush()
    head = pack(">IIBBBBB", 40_000, 40_000, 8, 0, 0, 0, 0)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", rows)
        + chunk(b"IEND", b"")
    )


@pytest.mark.parametrize("make", [bomb_x3p, bomb_png])
def test_bombs_are_not_set_off(tmp_path, make):
    path = tmp_path / f"bomb.{make.__name__[5:]}"
    make(path)
    refused(path, "hostile")


@pytest.mark.parametrize("suffix", [".csv", ".toml", ".nc", ".npy", ".x3p"])
def test_pipes_and_devices_are_no_files(tmp_path, suffix):
    pipe = tmp_path / f"pipe{suffix}"
    os.mkfifo(pipe)
    refused(pipe, "pipe or a device")
    device = tmp_path / f"zero{suffix}"
    device.symlink_to("/dev/zero")
    refused(device, "pipe or a device")
    folder = tmp_path / f"folder{suffix}"
    folder.mkdir()
    refused(folder, "a folder")


DEEP = {
    "lists": "[surface]\nsize_um=" + "[" * 50_000 + "]" * 50_000,
    "tables": "a=" + "{a=" * 50_000 + "1" + "}" * 50_000,
    "dots": "a" + ".a" * 100_000 + "=1",
    "keys": "".join(f"a.b{k}.c = 1\n" for k in range(100_000)),
}


@pytest.mark.parametrize("kind", DEEP)
def test_scenes_that_nest_too_deeply(tmp_path, kind):
    path = tmp_path / "scene.toml"
    path.write_text(DEEP[kind])
    refused(path)


@pytest.mark.parametrize(
    "line", ["1" * 1_000_000, "1," * 300_000, "a" * 1_000_000, ". " * 400_000]
)
def test_long_lines_are_judged_in_time(tmp_path, line):
    path = tmp_path / "scan.csv"
    path.write_text(f"theta_i_deg,theta_view_deg,M00\n{line}\n")
    refused(path)
    path.write_text(f"# {line}\n{line}\n30,10,0.1\n")
    with warnings.catch_warnings(action="ignore"):
        refused(path)


def test_an_entity_in_utf_16_is_seen(tmp_path):
    xml = '<?xml version="1.0" encoding="UTF-16"?><!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>'
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        archive.writestr("main.xml", xml.encode("utf-16"))
    path = tmp_path / "map.x3p"
    path.write_bytes(content.getvalue())
    refused(path, "entities")


def test_a_long_name_does_not_make_a_long_message(tmp_path):
    sweep = tmp_path / "sweep.toml"
    sweep.write_text(f'scene = "{4000 * "x"}"\n[vary]\n"substrate.n" = [1.5]\n')
    with pytest.raises(DataFileError) as caught:
        load_sweep(sweep)
    assert len(str(caught.value)) < 300
