"""Measure what safety costs: reading and writing good files against the plain libraries.

    python tests/files/speed.py [--rounds 7]

Prints, for each kind, the size, the processor seconds of the plain way and of the project's
(the least of all rounds, which take turns), and their ratio.
"""

import argparse
import json
import tempfile
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import data_io
from data_io.reflectance.attributes import encode
from pbrdf.files import read_array, read_toml


def dataset() -> xr.Dataset:
    """Return something like a result: noise, some of it zero, 46 MB."""
    rng = np.random.default_rng(1)
    dims = ("bounces", "theta_i", "theta_s", "dphi", "stokes_out", "stokes_in")
    values = rng.gamma(0.3, size=(3, 15, 45, 90, 4, 4)) * (
        rng.random((3, 15, 45, 90, 1, 1)) > 0.3
    )
    held = {"brdf": (dims, values), "brdf_stderr": (dims, 0.1 * values)}
    return xr.Dataset(held, {"theta_i": np.linspace(0, 1.4, 15)}, {"seed": 1, "notes": [1]})


def plain_write(held: xr.Dataset, path: Path) -> None:
    encoding: Any = {
        name: {"zlib": True, "complevel": 4, "shuffle": True} for name in held.data_vars
    }
    held.assign_attrs(encode(held.attrs)).to_netcdf(
        path, engine="h5netcdf", encoding=encoding
    )


def plain_read(path: Path) -> None:
    with xr.open_dataset(path, engine="h5netcdf") as stored:
        stored.load()


def plain_store(held: xr.Dataset, path: Path) -> None:
    held.assign_attrs(encode(held.attrs)).to_zarr(
        path, mode="w", zarr_format=3, consolidated=False
    )


def plain_toml(path: Path) -> dict[str, Any]:
    with path.open("rb") as stream:
        return tomllib.load(stream)


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--rounds", type=int, default=7)
    rounds = parser.parse_args().rounds
    held = dataset()
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        nc, zarr, npy, toml = (place / f"a.{end}" for end in ("nc", "zarr", "npy", "toml"))
        data_io.write_result(held, nc)
        data_io.write_result(held, zarr)
        np.save(npy, np.random.default_rng(2).standard_normal((2000, 2000)))
        heights = np.random.default_rng(3).standard_normal((300, 300)).round(6).tolist()
        toml.write_text(f"[surface]\nheights_um = {json.dumps(heights)}\n")
        kinds: dict[str, tuple[Callable[[], Any], Callable[[], Any]]] = {
            "write a result, netCDF": (
                lambda: plain_write(held, place / "b.nc"),
                lambda: data_io.write_result(held, place / "c.nc"),
            ),
            "read a result, netCDF": (
                lambda: plain_read(place / "b.nc"),
                lambda: data_io.read_result(nc),
            ),
            "the same netCDF file": (
                lambda: plain_read(nc),
                lambda: data_io.read_result(nc),
            ),
            "write a result, Zarr": (
                lambda: plain_store(held, place / "b.zarr"),
                lambda: data_io.write_result(held, place / "c.zarr"),
            ),
            "read a result, Zarr": (
                lambda: xr.open_zarr(place / "b.zarr", chunks=None).load(),
                lambda: data_io.read_result(zarr),
            ),
            "the same store": (
                lambda: xr.open_zarr(zarr, chunks=None).load(),
                lambda: data_io.read_result(zarr),
            ),
            "read an array, npy": (lambda: np.load(npy), lambda: read_array(npy)),
            "read a scene, TOML": (lambda: plain_toml(toml), lambda: read_toml(toml)),
        }
        for name, ways in kinds.items():
            least = [np.inf, np.inf]
            for _ in range(rounds):
                for k, way in enumerate(ways):
                    start = time.process_time()
                    way()
                    least[k] = min(least[k], time.process_time() - start)
            print(
                f"{name:<24} plain {1e3 * least[0]:7.1f} ms, "
                f"here {1e3 * least[1]:7.1f} ms: {least[1] / least[0]:.2f}"
            )


if __name__ == "__main__":
    main()
