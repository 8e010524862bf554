"""Results in Zarr stores: the same values as in memory, whole or not at all, checked."""

import json
import os
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import pbrdf
import pbrdf.simulation.memory
import pbrdf.simulation.parts
from data_io import is_result_store, read_result, write_result
from data_io.reflectance.result_store import write_store
from pbrdf import memory
from pbrdf.cli import main
from pbrdf.errors import DataFileError

SCENE = """
[surface]
type = "gaussian"
shape = [64, 64]
spacing_um = 1.0
corr_length_um = 8.0
slope_rms = 0.2

[substrate]
n = 1.5
"""
FEW = ["--n-theta", "9", "--n-dphi", "12", "--realizations", "8", "--n-rays", "1000"]
ANGLES = ["--theta-i-deg", "0,20,40,60"]


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def small(angles: int = 4) -> xr.Dataset:
    rng = np.random.default_rng(3)
    return xr.Dataset(
        {
            "brdf": (("bounces", "theta_i", "dphi"), rng.standard_normal((3, angles, 7))),
            "weight": ("dphi", np.ones(7)),
        },
        coords={"bounces": ["1", "2", "3+"], "theta_i": np.linspace(0, 1, angles)},
        attrs={"seed": 4, "warnings": ["none"], "made": None, "path_segments": 10},
    )


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "scene.toml").write_text(SCENE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_dataset_comes_back(tmp_path):
    write_result(small(), tmp_path / "r.zarr")
    xr.testing.assert_identical(read_result(tmp_path / "r.zarr"), small())
    # A store of a result may be replaced, as a file may
    write_result(small(5), tmp_path / "r.zarr")
    assert read_result(tmp_path / "r.zarr").sizes["theta_i"] == 5
    # Any other program that knows Zarr reads it
    assert xr.open_zarr(tmp_path / "r.zarr", chunks=None).brdf.shape == (3, 5, 7)
    assert names(tmp_path) == ["r.zarr"]


def test_parts_are_put_together(tmp_path):
    parts = [small().isel(theta_i=[k]) for k in range(4)]
    write_store(parts, tmp_path / "r.zarr")
    together = read_result(tmp_path / "r.zarr")
    xr.testing.assert_identical(together.drop_attrs(), small().drop_attrs())
    assert together.attrs == small().attrs | {"path_segments": 40}


def test_groups_of_wavelengths_are_put_together(tmp_path):
    rng = np.random.default_rng(3)
    sides = {"bounces": 3, "theta_i": 4, "wavelength": 5, "dphi": 2}
    whole = xr.Dataset(
        {
            "brdf": (tuple(sides), rng.standard_normal(tuple(sides.values()))),
            "albedo": (("theta_i", "wavelength"), rng.standard_normal((4, 5))),
            "seen": ("theta_i", np.arange(4.0)),
            "weight": ("dphi", np.ones(2)),
        },
        coords={"theta_i": np.arange(4.0), "wavelength": np.linspace(0.4, 0.8, 5)},
        attrs={"path_segments": 10, "warnings": []},
    )
    parts = []
    for row, wave in [(0, 0), (0, 2), (0, 4), (3, 0), (3, 2), (3, 4)]:
        part = whole.isel(theta_i=slice(row, row + 3), wavelength=slice(wave, wave + 2))
        part.encoding["first"] = {"theta_i": row, "wavelength": wave}
        parts.append(part)
    write_store(parts, tmp_path / "r.zarr")
    together = read_result(tmp_path / "r.zarr")
    xr.testing.assert_identical(together.drop_attrs(), whole.drop_attrs())
    # Rays of a direction are counted once, not once a group
    assert together.attrs["path_segments"] == 20
    for name in ("brdf", "albedo", "seen", "wavelength"):
        chunk = max((tmp_path / "r.zarr" / name).glob("c*"))
        content = chunk.read_bytes()
        chunk.write_bytes(content[:-3])
        with pytest.raises(DataFileError, match=f"variable {name}:"):
            read_result(tmp_path / "r.zarr")
        chunk.write_bytes(content)


def test_a_failure_leaves_nothing(tmp_path):
    def parts():
        yield small()
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_store(parts(), tmp_path / "r.zarr")
    assert names(tmp_path) == []


def test_nothing_else_is_replaced(tmp_path):
    target = tmp_path / "r.zarr"
    target.mkdir()
    (target / "thesis.txt").write_text("kept")
    with pytest.raises(ValueError, match="neither"):
        write_result(small(), target)
    assert names(target) == ["thesis.txt"]
    other = tmp_path / "s.zarr"
    write_store([small()], other)
    with pytest.raises(ValueError, match="exists"):
        write_store([small()], other)


def test_damage_is_named_by_its_variable(tmp_path):
    target = tmp_path / "r.zarr"
    write_result(small(), target)
    chunks = sorted(target.glob("*/c*"))
    assert len(chunks) > 4
    rng = np.random.default_rng(5)
    for chunk in chunks:
        content = chunk.read_bytes()
        name = chunk.relative_to(target).parts[0]
        for damaged in (b"", content[:-3], rng.bytes(len(content)), None):
            if damaged is None:
                chunk.unlink()
            else:
                chunk.write_bytes(damaged)
            with pytest.raises(DataFileError, match=f"r.zarr, column variable {name}:"):
                read_result(target)
        chunk.write_bytes(content)
    xr.testing.assert_identical(read_result(target), small())


def test_a_swapped_direction_is_seen(tmp_path):
    target = tmp_path / "r.zarr"
    write_result(small(), target)
    one, two = (target / f"brdf/c.0.{k}.0" for k in "01")
    held = one.read_bytes()
    one.write_bytes(two.read_bytes())
    two.write_bytes(held)
    with pytest.raises(DataFileError, match=r"variable brdf: .*checksum differs"):
        read_result(target)


def changed(target, **entries):
    file = target / "brdf" / "zarr.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | entries))


HOSTILE = {
    "huge": lambda t: changed(t, shape=[10**6, 10**6, 7]),
    "negative": lambda t: changed(t, shape=[-1, 4, 7]),
    "no shape": lambda t: changed(t, shape="many"),
    "codec": lambda t: changed(t, codecs=[{"name": "numcodecs.pickle"}]),
    "codecs": lambda t: changed(t, codecs={"a": 1}),
    "link": lambda t: (t / "brdf" / "secret").symlink_to("/etc/hostname"),
    "pipe": lambda t: os.mkfifo(t / "brdf" / "pipe"),
    "text": lambda t: (t / "brdf" / "zarr.json").write_text("[" * 100_000),
    "list": lambda t: (t / "brdf" / "zarr.json").write_text("[1]"),
    "root": lambda t: (t / "zarr.json").write_text("{}"),
    "zero": lambda t: (
        (t / "zarr.json").unlink(),
        (t / "zarr.json").symlink_to("/dev/zero"),
    ),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_stores_are_refused(tmp_path, kind):
    target = tmp_path / "r.zarr"
    write_result(small(), target)
    HOSTILE[kind](target)
    start = time.process_time()
    with pytest.raises(DataFileError):
        read_result(target)
    assert time.process_time() - start < 5.0


def test_a_store_larger_than_memory_is_refused(tmp_path, monkeypatch):
    write_result(small(), tmp_path / "r.zarr")
    monkeypatch.setattr("data_io.reflectance.result_store.free_bytes", lambda: 100.0)
    monkeypatch.setattr("data_io.reflectance.result_store._SMALL", 0)
    with pytest.raises(DataFileError, match=r"xarray\.open_zarr"):
        read_result(tmp_path / "r.zarr")


def test_without_zarr_it_says_so(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "zarr", None)
    with pytest.raises(ValueError, match="package zarr, which is not here"):
        write_result(small(), tmp_path / "r.zarr")


@pytest.mark.filterwarnings("ignore::pbrdf.errors.AccuracyWarning")
def test_simulate_writes_a_store_as_it_writes_a_file(folder, monkeypatch, capsys):
    run = ["simulate", "scene.toml", *ANGLES, *FEW, "-o"]
    assert main([*run, "r.nc"]) == 0
    lines = capsys.readouterr().out.splitlines()
    monkeypatch.setattr(pbrdf.simulation.memory, "at_once", lambda *_, **__: (1, 1))
    assert main([*run, "r.zarr"]) == 0
    assert capsys.readouterr().out.splitlines()[:-1] == lines[:-1]
    file, store = read_result("r.nc"), read_result("r.zarr")
    xr.testing.assert_identical(file.drop_attrs(), store.drop_attrs())
    assert main([*run, "r.zarr"]) == 2
    assert "exists" in capsys.readouterr().err
    assert main([*run, "r.zarr", "--force"]) == 0
    assert is_result_store("r.zarr")
    assert names(folder) == ["r.nc", "r.zarr", "scene.toml"]


def test_a_store_takes_what_no_memory_holds(folder, monkeypatch, capsys):
    """As much as one direction fits; the file would not."""
    one = memory.Size(angles=1, azimuths=1, waves=1, bins=90 * 90, n_stokes=4)
    for module in (memory, pbrdf.simulation.memory):
        monkeypatch.setattr(module, "free_bytes", lambda: 15 * one.result)
    run = ["simulate", "scene.toml", "--n-theta", "90", "--n-dphi", "90", "--realizations",
           "8", "--n-rays", "1000", "--theta-i-deg", ",".join(map(str, range(0, 60, 5))),
           "--workers", "1"]  # fmt: skip
    assert main([*run, "-o", "r.nc"]) == 2
    assert "-o name.zarr" in capsys.readouterr().err
    assert main([*run, "-o", "r.zarr"]) == 0
    monkeypatch.undo()
    assert read_result(folder / "r.zarr").sizes["theta_i"] == 12


@pytest.mark.slow
def test_a_store_takes_wavelengths_that_no_memory_holds(folder, monkeypatch, capsys):
    """Not one direction fits with all of them."""
    size = memory.Size(angles=1, azimuths=1, waves=60, bins=30 * 30, n_stokes=4)
    of = pbrdf.simulation.memory
    effort = of.Effort.of({"n_rays": 1000, "realizations": 8, "workers": 1})
    need = of.at_work(pbrdf.load_scene("scene.toml"), size, effort)
    waves = np.linspace(0.4, 0.8, 60)
    run = ["simulate", "scene.toml", "--n-theta", "30", "--n-dphi", "30", "--realizations",
           "8", "--n-rays", "1000", "--theta-i-deg", "10,50", "--workers", "1",
           "--wavelength-um", ",".join(f"{wave:.4f}" for wave in waves)]  # fmt: skip
    assert main([*run, "-o", "r.nc"]) == 0
    parts = []
    traced = pbrdf.simulation.parts.traced

    def seen(ready):
        parts.append((len(ready.plans[0].theta_i), len(ready.plans[0].n)))
        return traced(ready)

    monkeypatch.setattr("pbrdf.simulation.parts.traced", seen)
    for module in (memory, pbrdf.simulation.memory):
        monkeypatch.setattr(module, "free_bytes", lambda: 0.99 * need / memory.SHARE)
    assert main([*run, "-o", "s.nc"]) == 2
    assert "-o name.zarr" in capsys.readouterr().err
    assert main([*run, "-o", "r.zarr"]) == 0
    monkeypatch.undo()
    assert {angles for angles, _ in parts} == {1}
    assert 2 < len(parts) < 60
    assert sum(count for _, count in parts) == 2 * 60
    xr.testing.assert_identical(
        read_result(folder / "r.nc").drop_attrs(),
        read_result(folder / "r.zarr").drop_attrs(),
    )


@pytest.mark.filterwarnings("ignore::pbrdf.errors.AccuracyWarning")
def test_what_shows_files_shows_stores(folder, capsys):
    run = ["simulate", "scene.toml", "--theta-i-deg", "30", *FEW, "-o"]
    assert main([*run, "r.zarr"]) == 0
    assert main(["plot", "r.zarr", "-o", "r.png"]) == 0
    assert main(["report", "r.zarr", "-o", "r.html"]) == 0
    assert main(["export", "r.zarr", "-o", "r.csv"]) == 0
    look = ["observe", "scene.toml", "--theta-view-deg", "0,30", "--n-rays", "1000"]
    assert main([*look, "--realizations", "8", "-o", "o.zarr"]) == 0
    assert read_result("o.zarr").sizes["geometry"] == 2
    scene = pbrdf.load_scene("scene.toml")
    assert scene.substrate.n == 1.5
