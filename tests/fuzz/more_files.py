"""More good files: heights, meshes, pictures, scenes, sweeps, stores, tables of skies."""

import base64
import io
import json
import struct
import tempfile
import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import data_io
import pbrdf
from pbrdf.signatures.bands import read_response
from pbrdf.signatures.skies import read_sky
from pbrdf.sweeps import load_sweep
from tests.cli.scenes import SCENE
from tests.fuzz.good_files import written

Content = bytes | dict[str, bytes]


def text_list() -> bytes:
    rows = [f"{x} {y} {0.1 * x * y:.3f}" for x in range(8) for y in range(8)]
    return ("x[um] y[um] z[um]\n" + "\n".join(rows)).encode()


def map_sdf() -> bytes:
    rows = "\n".join(" ".join(str((3 * j * k) % 17) for j in range(9)) for k in range(6))
    head = (
        "aISO-1.0\nManufacID = made up\nNumPoints = 9\nNumProfiles = 6\nXscale = 1e-6\n"
        "Yscale = 1e-6\nZscale = 1e-8\nDataType = 7\n"
    )
    return f"{head}*\n{rows}\n*\n".encode()


def profile_prf() -> bytes:
    rows = "\n".join(str((7 * k) % 23) for k in range(60))
    head = "1 2\nmade up 60\nCX I 60 MM 1.0e-3 D\nCZ A 60 UM 1.0e-2 D\nEOR\n"
    return f"{head}{rows}\nEOR\n".encode()


def map_sur(packed: bool = True) -> bytes:
    side = 16
    values = np.random.default_rng(2).integers(-999, 999, side * side).astype("<i4")
    header = bytearray(512)
    header[:12] = b"DSCOMPRESSED" if packed else b"DIGITAL SURF"
    struct.pack_into("<hhh", header, 12, 0, 1, 0)
    header[16:46] = b"made up".ljust(30)
    struct.pack_into("<hh", header, 88, 1, 0)
    struct.pack_into("<h", header, 98, 32)
    struct.pack_into("<ii", header, 100, -999, 999)
    struct.pack_into("<iii", header, 108, side, side, side * side)
    struct.pack_into("<fff", header, 120, 1e-3, 1e-3, 1e-6)
    for start, word in zip(range(132, 276, 16), "XYZ" + 6 * "u", strict=True):
        header[start : start + 16] = (word if word != "u" else "mm").encode().ljust(16)
    struct.pack_into("<fff", header, 276, 1.0, 1.0, 1.0)
    if not packed:
        return bytes(header) + values.tobytes()
    stream = zlib.compress(values.tobytes())
    plain = len(values.tobytes())
    return bytes(header) + struct.pack("<III", 1, plain, len(stream)) + stream


def mesh(suffix: str) -> bytes:
    import trimesh

    n = 7
    x, y = np.meshgrid(np.arange(float(n)), np.arange(float(n)), indexing="ij")
    z = 0.3 * np.sin(x) * np.cos(y)
    first = np.arange(n * n).reshape(n, n)
    a, b, c, d = first[:-1, :-1], first[1:, :-1], first[1:, 1:], first[:-1, 1:]
    faces = np.concatenate(
        [np.stack(one, -1).reshape(-1, 3) for one in ((a, b, c), (a, c, d))]
    )
    vertices = np.stack([x, y, z], -1).reshape(-1, 3)
    if suffix == "npz":
        stream = io.BytesIO()
        np.savez_compressed(stream, vertices=vertices, faces=faces)
        return stream.getvalue()
    kind, options = (suffix, {})
    if suffix == "ply-text":
        kind, options = "ply", {"encoding": "ascii"}
    made = trimesh.Trimesh(vertices, faces, process=False).export(file_type=kind, **options)
    if isinstance(made, dict):
        described = json.loads(made["model.gltf"])
        for buffer in described["buffers"]:
            data = base64.b64encode(made[buffer["uri"]]).decode()
            buffer["uri"] = f"data:application/octet-stream;base64,{data}"
        return json.dumps(described).encode()
    return made.encode() if isinstance(made, str) else made


def picture(kind: str, **options: Any) -> bytes:
    """Draw an edge between dark and bright, with grain."""
    from PIL import Image

    rng = np.random.default_rng(5)
    rows, columns = np.mgrid[:48, :96]
    edge = 24 + 4 * np.sin(columns / 9) + 2 * np.cos(columns / 4)
    grey = np.where(rows > edge, 190, 60) + rng.normal(0, 3, rows.shape)
    stream = io.BytesIO()
    Image.fromarray(np.clip(grey, 0, 255).astype(np.uint8)).save(stream, kind, **options)
    return stream.getvalue()


def heights_picture(kind: str) -> bytes:
    from PIL import Image

    levels = np.random.default_rng(6).integers(0, 60_000, (24, 32)).astype(np.uint16)
    stream = io.BytesIO()
    Image.fromarray(levels).save(stream, kind)
    return stream.getvalue()


def wave_model_toml() -> bytes:
    model = pbrdf.WaveModel(pbrdf.Material(1.5, 0.1), height_rms=0.02, corr_length=3.0)
    return written(data_io.write_wave_model, model, ".toml")


def scene_of_all() -> bytes:
    return b"""
[surface]
type = "height_map"
heights_um = [[0.0, 0.1, 0.2], [0.1, 0.3, 0.1], [0.0, 0.2, 0.4]]
spacing_um = [1.0, 2.0]
periodic = true

[substrate]
wavelength_um = [0.4, 0.6, 0.8]
n = [1.5, 1.4, 1.3]
kappa = [0.0, 0.1, 0.2]

[[contaminants]]
type = "spheres"
positions_um = [[1.0, 2.0]]
radius_um = 0.4
material = "water"
"""


def sweep_toml() -> bytes:
    return f"""{SCENE}
[vary]
slope_rms = [0.1, 0.2, 0.3]
"substrate.n" = [1.4, 1.5]

[simulate]
theta_i_deg = [10, 30]
n_rays = 1000
realizations = 8
""".encode()


def small_result() -> xr.Dataset:
    values = np.random.default_rng(3).standard_normal((3, 5, 7))
    return xr.Dataset(
        {"brdf": (("theta_i", "x", "y"), values), "total": ("x", np.arange(5.0))},
        {"theta_i": [0.1, 0.5, 0.9], "x": np.arange(5.0), "stokes": ("x", list("IQUVW"))},
        {"seed": 4, "notes": [1, "a"], "scene": "[surface]\nslope_rms = 0.2\n"},
    )


def result_store() -> dict[str, bytes]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "file.zarr"
        data_io.write_result(small_result(), path)
        return {
            str(file.relative_to(path)): file.read_bytes()
            for file in sorted(path.rglob("*"))
            if file.is_file()
        }


def sky_csv() -> bytes:
    rows = [
        f"{t},{p},{1.0 + t / 90:.3f},0.{k},0,0"
        for k, t in enumerate((0, 30, 60, 90))
        for p in (0, 120, 240)
    ]
    return ("theta_deg,phi_deg,I,Q,U,V\n" + "\n".join(rows)).encode()


def response_csv() -> bytes:
    rows = [f"{0.5 + k / 50:.3f},{max(0.0, 1 - abs(k - 10) / 10):.2f}" for k in range(21)]
    return ("wavelength_um,response\n" + "\n".join(rows)).encode()


def result_nc() -> bytes:
    return written(data_io.write_result, small_result(), ".nc")


def levels(path: Path) -> Any:
    return data_io.read_height_map(path, spacing=1.0, um_per_level=1e-4)


def edge(path: Path) -> Any:
    return data_io.read_profile_image(path, um_per_pixel=0.5)


MESHES = {
    "stl": "stl", "ply": "ply", "ply-text": "ply", "obj": "obj", "off": "off",
    "glb": "glb", "gltf": "gltf", "npz": "npz",
}  # fmt: skip
PICTURES = {"png": ".png", "tiff": ".tif", "jpeg": ".jpg", "bmp": ".bmp"}
# Whose checksums must show every changed value
CHECKED = ("result", "store")
READERS: dict[str, tuple[Callable[[], Content], str, Callable[[Path], Any]]] = {
    "profile-prf": (profile_prf, ".prf", data_io.read_profile),
    "map-list": (text_list, ".txt", data_io.read_height_map),
    "map-sdf": (map_sdf, ".sdf", data_io.read_height_map),
    "map-sur": (partial(map_sur, packed=False), ".sur", data_io.read_height_map),
    "map-sur-packed": (map_sur, ".sur", data_io.read_height_map),
    "map-stl": (partial(mesh, "stl"), ".stl", data_io.read_height_map),
    "map-png": (partial(heights_picture, "png"), ".png", levels),
    "map-tiff": (partial(heights_picture, "tiff"), ".tif", levels),
    **{
        f"mesh-{name}": (partial(mesh, name), f".{end}", pbrdf.MeshSurface)
        for name, end in MESHES.items()
    },
    **{
        f"picture-{kind}": (partial(picture, kind), end, edge)
        for kind, end in PICTURES.items()
    },
    "scene-of-all": (scene_of_all, ".toml", pbrdf.load_scene),
    "sweep": (sweep_toml, ".toml", load_sweep),
    "wave-model": (wave_model_toml, ".toml", data_io.read_wave_model),
    "sky": (sky_csv, ".csv", read_sky),
    "response": (response_csv, ".csv", read_response),
    "result": (result_nc, ".nc", data_io.read_result),
    "store": (result_store, ".zarr", data_io.read_result),
}
