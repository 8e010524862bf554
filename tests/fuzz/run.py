"""Damage good files of every format and see that readers refuse them by name.

    python tests/fuzz/run.py --count 10000 [--seed 1] [--reader result]

Each reader gets `count` damaged copies of files made here: bytes flipped, cut, repeated,
moved, numbers made huge, cells emptied. A reader may return something or raise
DataFileError (ValueError and TypeError with the name of the file count too); anything else,
a warning of a library, more than 5 s of the processor or more than 1 GiB is a fault.
Prints a line a reader; exit code 1 if there are faults.
"""

import argparse
import io
import resource
import sys
import tempfile
import time
import traceback
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import data_io
import pbrdf
from pbrdf.errors import DataFileError

SECONDS = 5.0
MEMORY = 2**30
WORDS = [
    *(
        b"nan",
        b"inf",
        b"1e400",
        b"-0",
        b"9" * 400,
        b"",
        b"\0",
        b"\xff\xfe",
        b",",
        b";",
        b"\t",
    ),
    *(b"\n", b"[", b"{", b'"', b"#", b"<!ENTITY a 'b'>", b"= 1", b"true"),
]


def csv_scan() -> bytes:
    rows = [f"30,{view},{0.05 + 1e-4 * view:.5f},0.01,0.65" for view in range(-70, 75, 10)]
    return ("theta_i_deg,theta_view_deg,M00,M10,wavelength_um\n" + "\n".join(rows)).encode()


def fred_scan() -> bytes:
    rows = [f"{t} {p} {0.1 + t / 900:.4f}" for t in range(0, 80, 10) for p in (0, 90, 180)]
    return (
        "type bsdf_data\nformat angles=deg bsdf=value\n30 0\n" + "\n".join(rows)
    ).encode()


def profile_text() -> bytes:
    x = np.arange(200) * 0.5
    rows = [f"{a:.2f},{np.sin(a):.5f}" for a in x]
    return ("x_um,z_um\n" + "\n".join(rows)).encode()


def map_text() -> bytes:
    rows = np.random.default_rng(2).standard_normal((14, 16))
    text = "\n".join(",".join(f"{z:.4f}" for z in row) for row in rows)
    return ("# spacing_um = 0.5\n# unit = um\n" + text).encode()


def map_npy() -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.random.default_rng(2).standard_normal((14, 16)))
    return stream.getvalue()


def map_x3p() -> bytes:
    axes = "".join(
        f"<C{a}><AxisType>I</AxisType><DataType>D</DataType><Increment>1e-6</Increment></C{a}>"
        for a in "XY"
    )
    xml = (
        f"<ISO5436_2><Record1><FeatureType>SUR</FeatureType><Axes>{axes}<CZ><AxisType>A"
        "</AxisType><DataType>D</DataType><Increment>1</Increment></CZ></Axes></Record1>"
        "<Record3><MatrixDimension><SizeX>8</SizeX><SizeY>6</SizeY><SizeZ>1</SizeZ>"
        "</MatrixDimension><DataLink><PointDataLink>d.bin</PointDataLink></DataLink></Record3>"
        "</ISO5436_2>"
    )
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("main.xml", xml)
        archive.writestr("d.bin", (1e-6 * np.arange(48.0)).tobytes())
    return stream.getvalue()


def scene_toml() -> bytes:
    surface = pbrdf.GaussianSurface(
        shape=(64, 64), spacing=1.0, corr_length=16, slope_rms=0.2
    )
    return pbrdf.Scene(surface, "bk7", pbrdf.Film(thickness=4.0)).to_toml().encode()


def written(write: Callable[[Any, Path], None], thing: Any, suffix: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"file{suffix}"
        write(thing, path)
        return path.read_bytes()


def model_toml() -> bytes:
    model = pbrdf.MicrofacetModel(pbrdf.Material(1.5, 0.1), slope_rms=0.2)
    return written(data_io.write_model, model, ".toml")


def result_nc() -> bytes:
    values = np.random.default_rng(3).standard_normal((5, 7))
    dataset = xr.Dataset(
        {"brdf": (("x", "y"), values)},
        {"x": np.arange(5.0)},
        {"seed": 4, "notes": [1, "a"]},
    )
    return written(data_io.write_result, dataset, ".nc")


def constants_csv() -> bytes:
    rows = [f"{w},{1.3 + w / 5000:.4f},{w / 1e4:.4f}" for w in range(400, 800, 20)]
    return ("wavelength_nm,n,k\n" + "\n".join(rows)).encode()


def csv_of_others() -> bytes:
    rows = [
        f"30;{v};{0.05 + 1e-4 * v:.5f};0,1;a".replace(".", ",") for v in range(-70, 75, 10)
    ]
    head = (
        "Instrument: made up\ntheta_i;theta_view;BRDF;DOLP;note\n[deg];[deg];[1/sr];[-];\n"
    )
    return (head + "\n".join(rows)).encode("utf-16")


def astm_scan() -> bytes:
    rows = [f"30,0,{t},{p},{0.1 + t / 900:.4f}" for t in range(0, 80, 10) for p in (0, 180)]
    head = "TITLE made up\nNUM_POINTS 16\nVARS theta_i,phi_i,theta_s,phi_s,BRDF\n"
    return (head + "\n".join(rows)).encode()


def zemax_scan() -> bytes:
    head = (
        "Source Measured\nSymmetry PlaneSymmetrical\nSpectralContent Monochrome\n"
        "ScatterType BRDF\nSampleRotation 2\n0 90\nAngleOfIncidence 2\n10 30\n"
        "ScatterAzimuth 3\n0 90 180\nScatterRadial 4\n0 5 10 20\nMonochrome\nDataBegin\n"
    )
    block = "TIS 0.05\n" + 3 * "0.9 0.5 0.2 0.1\n"
    return (head + 4 * block + "DataEnd\n").encode()


def pbsdf_scan() -> bytes:
    def write(model: Any, path: Path) -> None:
        with warnings.catch_warnings():
            # So few nodes are for reading, not for rendering
            warnings.simplefilter("ignore", UserWarning)
            data_io.export_mitsuba(model, path, shape=(4, 5, 6))

    model = pbrdf.MicrofacetModel(pbrdf.Material(1.5), slope_rms=0.3)
    return written(write, model, ".pbsdf")


def constants_yml() -> bytes:
    rows = "\n".join(f"        {0.4 + k / 50:.3f} 1.5 0.0{k}" for k in range(10))
    return f"REFERENCES: x\nDATA:\n  - type: tabulated nk\n    data: |\n{rows}\n".encode()


def constants_nk() -> bytes:
    return ("; nm\n" + "\n".join(f"{w} 1.5 0.01" for w in range(400, 800, 20))).encode()


def constants_text() -> bytes:
    rows = "\n".join(f"{w}.0\t1.5\t0.01" for w in range(400, 800, 20))
    return f"made up\nnm\nNK\n{rows}\n".encode()


# name: (a good file, its suffix, reader)
READERS: dict[str, tuple[Callable[[], bytes], str, Callable[[Path], Any]]] = {
    "goniometer": (csv_scan, ".csv", data_io.read_goniometer),
    "fred": (fred_scan, ".txt", data_io.read_goniometer),
    "table-utf16": (csv_of_others, ".csv", data_io.read_goniometer),
    "astm": (astm_scan, ".txt", data_io.read_goniometer),
    "zemax": (zemax_scan, ".bsdf", data_io.read_goniometer),
    "pbsdf": (pbsdf_scan, ".pbsdf", data_io.read_goniometer),
    "profile": (profile_text, ".csv", data_io.read_profile),
    "map-text": (map_text, ".csv", data_io.read_height_map),
    "map-npy": (map_npy, ".npy", lambda path: data_io.read_height_map(path, spacing=1.0)),
    "map-x3p": (map_x3p, ".x3p", data_io.read_height_map),
    "scene": (scene_toml, ".toml", pbrdf.load_scene),
    "model": (model_toml, ".toml", data_io.read_model),
    "result": (result_nc, ".nc", data_io.read_result),
    "constants": (constants_csv, ".csv", pbrdf.materials.read),
    "constants-yml": (constants_yml, ".yml", pbrdf.materials.read),
    "constants-nk": (constants_nk, ".nk", pbrdf.materials.read),
    "constants-text": (constants_text, ".mat", pbrdf.materials.read),
}


def damaged(good: bytes, rng: np.random.Generator) -> bytes:
    """Return the file with one fault or a few."""
    content = bytearray(good)
    for _ in range(rng.geometric(0.6)):
        size = len(content)
        start, stop = sorted(rng.integers(0, size + 1, 2).tolist()) if size else (0, 0)
        stop = min(stop, start + 1 + int(rng.exponential(20)))
        kind = rng.integers(7)
        if kind == 0 and size:
            content[rng.integers(size)] ^= 1 << int(rng.integers(8))
        elif kind == 1:
            del content[start:stop]
        elif kind == 2:
            content[start:start] = content[start:stop] * int(rng.integers(1, 40))
        elif kind == 3:
            del content[start:]
        elif kind == 4:
            content[start:stop] = rng.bytes(stop - start)
        elif kind == 5:
            content[start:start] = WORDS[rng.integers(len(WORDS))]
        else:
            piece = bytes(content[start:stop])
            del content[start:stop]
            place = rng.integers(len(content) + 1)
            content[place:place] = piece
    return bytes(content)


def verdict(read: Callable[[Path], Any], path: Path) -> str:
    """Say "accepted", "refused", or what is wrong."""
    start = time.process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            # Those of the project are meant for users
            warnings.filterwarnings("ignore", category=UserWarning)
            read(path)
        said = "accepted"
    except DataFileError as error:
        said = (
            "refused" if len(str(error)) < 700 else f"a message of {len(str(error))} signs"
        )
    except Exception as error:  # what must not get out is the question
        place = traceback.extract_tb(error.__traceback__)[-1]
        said = (
            f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}: {error}"
        )
    if time.process_time() - start > SECONDS:
        said = f"took {time.process_time() - start:.1f} s"
    return " ".join(said.split())[:200]


def run(name: str, count: int, seed: int) -> tuple[dict[str, int], dict[str, bytes]]:
    """Return how often each verdict came, and an example of each fault."""
    make, suffix, read = READERS[name]
    good, rng = make(), np.random.default_rng([seed, len(name)])
    tally: dict[str, int] = {}
    faults: dict[str, bytes] = {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"file{suffix}"
        path.write_bytes(good)
        if verdict(read, path) != "accepted":
            msg = f"the good file of {name} must be accepted, got {verdict(read, path)}"
            raise AssertionError(msg)
        for _ in range(count):
            content = damaged(good, rng)
            path.write_bytes(content)
            said = verdict(read, path)
            tally[said] = tally.get(said, 0) + 1
            if said not in ("accepted", "refused"):
                faults.setdefault(said, content)
    return tally, faults


def limit_memory() -> None:
    """Give the process what it has now and 1 GiB more."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    size = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (size, size))


def main() -> int:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--reader", choices=READERS)
    parser.add_argument("--keep", type=Path, help="folder for an example of each fault")
    given = parser.parse_args()
    worst = 0
    for number, name in enumerate([given.reader] if given.reader else READERS):
        if number == 1 and sys.platform == "linux":
            limit_memory()
        tally, faults = run(name, given.count, given.seed)
        good = {key: tally.get(key, 0) for key in ("accepted", "refused")}
        bad = given.count - sum(good.values())
        print(
            f"{name:<12} {good['accepted']:>6} accepted {good['refused']:>6} refused "
            f"{bad:>4} faults"
        )
        for said, content in faults.items():
            print(f"    {tally[said]} x {said}")
            if given.keep:
                given.keep.mkdir(parents=True, exist_ok=True)
                (given.keep / f"{name}-{abs(hash(said)) % 10**8}").write_bytes(content)
        worst += bad
    return int(worst > 0)


if __name__ == "__main__":
    sys.exit(main())
