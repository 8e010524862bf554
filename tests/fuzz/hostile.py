"""Files that a stranger might send, of every kind that a command takes; made here."""

import io
import json
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from struct import pack

import h5py
import numpy as np
import xarray as xr

import data_io

Write = Callable[[Path], object]

SCENE = '[surface]\ntype = "flat"\nsize_um = [10.0, 10.0]\n[substrate]\nn = 1.5\n'
ROUGH = (
    '[surface]\ntype = "gaussian"\nshape = {shape}\nspacing_um = 1.0\n'
    "corr_length_um = {length}\nslope_rms = {slope}\n[substrate]\nn = {n}\n"
)
MAP = (
    '[surface]\ntype = "height_map"\nfile = "{}"\nspacing_um = 1.0\n[substrate]\nn = 1.5\n'
)
SCAN = "theta_i_deg,theta_view_deg,M00\n{}\n"


def content(of: bytes | str | Callable[[], bytes]) -> Write:
    """Return how to write a content; one that takes time to make is made then."""

    def write(path: Path) -> None:
        held = of() if callable(of) else of
        path.write_bytes(held.encode() if isinstance(held, str) else held)

    return write


def result() -> xr.Dataset:
    """Return something with the dimensions of a result."""
    shape = (2, 3, 4, 4, 4)
    dims = ("theta_i", "theta_s", "dphi", "stokes_out", "stokes_in")
    coords = {
        "theta_i": [0.1, 0.5], "theta_s": [0.2, 0.7, 1.2], "dphi": np.arange(4) * np.pi / 2,
        "stokes_out": list("IQUV"), "stokes_in": list("IQUV"),
    }  # fmt: skip
    values = np.ones((3, *shape))
    variables = {name: (("bounces", *dims), values) for name in ("brdf", "brdf_stderr")} | {
        name: (dims, values[0]) for name in ("brdf_total", "brdf_total_stderr")
    }
    return xr.Dataset(variables, coords | {"bounces": ["1", "2", "3+"]}, {"seed": 1})


def external(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.create_dataset("heights", (10, 10), "f8", external=[("/etc/passwd", 0, 800)])


def outward(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["brdf"] = h5py.ExternalLink("/etc/passwd", "/x")


def virtual(path: Path) -> None:
    with h5py.File(path, "w") as file:
        layout = h5py.VirtualLayout((10, 10), "f8")
        layout[:] = h5py.VirtualSource("/etc/passwd", "x", (10, 10))
        file.create_virtual_dataset("brdf", layout)


def round_about(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.create_group("a")["b"] = file["/"]


def deep_groups(path: Path) -> None:
    with h5py.File(path, "w") as file:
        group = file
        for _ in range(2000):
            group = group.create_group("a")


def hollow(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.create_dataset("brdf", (10**6, 10**6), "f8", chunks=(1000, 1000))


def endless_heap(path: Path) -> None:
    """Write a table of references in which HDF5 1.14 goes round for ever."""
    data_io.write_result(result(), path)
    held = bytearray(path.read_bytes())
    place = held.index(b"GCOL") + 16
    held[place : place + 2] = held[place + 8 : place + 16] = b""
    held[place:place] = bytes(10)
    path.write_bytes(held)


def deep_attribute(path: Path) -> None:
    dataset = result()
    dataset.attrs["made_by"] = "json:" + 60_000 * "["
    encoded = dataset.copy()
    encoded.to_netcdf(path, engine="h5netcdf")


def deep_scene(path: Path) -> None:
    dataset = result()
    dataset.attrs["scene"] = "a" + 100_000 * ".a" + " = 1"
    data_io.write_result(dataset, path)


def nonsense(path: Path) -> None:
    dataset = result()
    dataset.brdf_total[0] = np.inf
    dataset.brdf_total[1] = 1e12
    data_io.write_result(dataset, path)


def store(change: Callable[[Path], object]) -> Write:
    def write(path: Path) -> None:
        data_io.write_result(result(), path)
        change(path)

    return write


def about(path: Path, **changes: object) -> None:
    file = path / "brdf" / "zarr.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | changes))


def sweep_store(path: Path) -> None:
    """Write what looks like the store of a sweep, of 1e12 points."""
    import zarr

    root = zarr.open_group(path, mode="w")
    root.attrs.update({"pbrdf_sweep": "x", "design": "grid", "sweep": "{}"})
    names = ["n", "slope_rms"]
    root.create_array("state", shape=(10**6, 10**6), dtype="i1", dimension_names=names)


def zipped(**members: bytes) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, held in members.items():
            archive.writestr(name, held)
    return stream.getvalue()


def npy(shape: tuple[int, ...], held: bytes = b"", kind: str = "<f8") -> bytes:
    stream = io.BytesIO()
    head = {"descr": kind, "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(stream, head)
    return stream.getvalue() + held


def png(columns: int, rows: int) -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return pack(">I", len(data)) + kind + data + pack(">I", zlib.crc32(kind + data))

    head = pack(">IIBBBBB", columns, rows, 8, 0, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head)
        + chunk(b"IDAT", zlib.compress(bytes(10**7))) + chunk(b"IEND", b"")
    )  # fmt: skip


_ENTITY = '<?xml version="1.0" encoding="UTF-16"?><!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>'
_WIDE = np.full((64, 64), 1e12) + np.arange(64.0)

KINDS: dict[str, Write] = {
    "external.nc": external, "outward.nc": outward, "virtual.nc": virtual,
    "round.nc": round_about, "deep.nc": deep_groups, "hollow.nc": hollow,
    "heap.nc": endless_heap, "attribute.nc": deep_attribute, "nonsense.nc": nonsense,
    "external.h5": external, "outward.h5": outward, "virtual.h5": virtual,
    "hollow.h5": hollow, "external.mat": external,
    "text.nc": content(b"\x89HDF\r\n\x1a\n" + 10_000 * b"a"),
    "shape.zarr": store(lambda p: about(p, shape=[10**6, 10**6, 3, 4, 4, 4])),
    "codec.zarr": store(lambda p: about(p, codecs=[{"name": "numcodecs.pickle"}])),
    "link.zarr": store(lambda p: (p / "brdf" / "x").symlink_to("/etc/passwd")),
    "deep.zarr": store(lambda p: (p / "brdf" / "zarr.json").write_text(100_000 * "[")),
    "sweep.zarr": sweep_store,
    "bomb.x3p": content(lambda: zipped(**{"main.xml": b"<a>" + bytes(2**28)})),
    "entity.x3p": content(lambda: zipped(**{"main.xml": _ENTITY.encode("utf-16")})),
    "deep.x3p": content(lambda: zipped(**{"main.xml": 200_000 * b"<a>"})),
    "many.x3p": content(lambda: zipped(**{f"a{k}": b"" for k in range(70_000)})),
    "huge.npy": content(npy((2**40, 2**20))),
    "negative.npy": content(npy((-4, -4), bytes(128))),
    "object.npy": content(npy((4, 4), b"cos\nsystem\n(S'id'\ntR.", "|O")),
    "far.npy": lambda p: np.save(p, _WIDE),
    "nan.npy": lambda p: np.save(p, np.full((64, 64), np.nan)),
    "inf.npy": lambda p: np.save(p, np.full((64, 64), np.inf)),
    "header.npz": content(
        lambda: zipped(**{"vertices.npy": npy((2**40, 3)), "faces.npy": b""})
    ),
    "bomb.npz": content(lambda: zipped(**{"vertices.npy": npy((2**24, 3), bytes(2**28))})),
    "bomb.xlsx": content(lambda: zipped(**{"xl/workbook.xml": bytes(2**28)})),
    "dots.toml": content("a" + 100_000 * ".a" + " = 1"),
    "keys.toml": content("".join(f"a.b{k}.c = 1\n" for k in range(100_000))),
    "deep.toml": content("a = " + 50_000 * "["),
    "lists.toml": content(lambda: "a = [" + 2_000_000 * "[]," + "]"),
    "line.toml": content('a = "' + 1_000_000 * "x" + '"'),
    "integer.toml": content("[surface]\nspacing_um = " + 5000 * "9"),
    "nan.toml": content(ROUGH.format(shape=[64, 64], length="nan", slope=0.2, n=1.5)),
    "inf.toml": content(ROUGH.format(shape=[64, 64], length=8.0, slope="inf", n=1.5)),
    "wide.toml": content(ROUGH.format(shape=[10**6] * 2, length=8.0, slope=0.2, n=1.5)),
    "index.toml": content(ROUGH.format(shape=[64, 64], length=8.0, slope=0.2, n=[1.5])),
    "passwd.toml": content(MAP.format("/etc/passwd")),
    "zero.toml": content(MAP.format("/dev/zero")),
    "above.toml": content(MAP.format("../../heights.npy")),
    "itself.toml": content(MAP.format("itself.toml")),
    "sweep.toml": content('scene = "../../../etc/passwd"\n[vary]\nn = [1.4, 1.5]\n'),
    "line.csv": content(SCAN.format(1_000_000 * "1")),
    "cells.csv": content(SCAN.format(500_000 * "1,")),
    "head.csv": content(500_000 * "a," + "\n" + 500_000 * "1,"),
    "quote.csv": content('"' + 1_000_000 * "a,"),
    "spaces.csv": content(SCAN.format(1_000_000 * " ")),
    "dashes.csv": content(SCAN.format(1_000_000 * "-")),
    "nan.csv": content(SCAN.format("nan,nan,nan")),
    "far.csv": content(SCAN.format("10,10,1e12\n10,20,1e12")),
    "zero.csv": content(bytes(1_000_000)),
    "entity.csv": content(_ENTITY.encode("utf-16")),
    "points.sdf": content(
        "aISO-1.0\nNumPoints = 1000000000000\nNumProfiles = 6\nXscale = 1e-6\n"
        "Yscale = 1e-6\nZscale = 1e-6\n*\n1 2\n*\n"
    ),
    "axis.prf": content("1 2\nCX I 1e300 MM 1.0 D\nCZ A 1e300 UM 1.0 D\nEOR\n1\nEOR\n"),
    "bomb.sur": content(
        lambda: b"DSCOMPRESSED" + bytes(500) + pack("<III", 1, 2**28, 2**18)
        + zlib.compress(bytes(2**28))
    ),
    "bomb.png": content(lambda: png(100_000, 100_000)),
    "wide.png": content(lambda: png(2_000_000_000, 1)),
    "text.png": content("no picture"),
}  # fmt: skip
