"""A good file of every format, made here, and what reads it."""

import io
import tempfile
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import data_io
import pbrdf


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


def wide_scan() -> bytes:
    rows = [
        f"30\t{v}\t{0.05 + 1e-4 * v:.5f}\t{0.09 + 1e-4 * v:.5f}" for v in range(-70, 75, 10)
    ]
    return ("theta_i [deg]\ttheta_view [deg]\t450 nm\t650 nm\n" + "\n".join(rows)).encode()


def stokes_scan() -> bytes:
    rest = "0.011 -0.002 0.0001"
    rows = [f"0.65 0.5236 {abs(v) / 60:.4f} {180 * (v > 0)} {0.05 + 1e-4 * v:.5f} {rest}"
            for v in range(-70, 75, 10)]  # fmt: skip
    head = "wavelength_um theta_i_rad theta_s_rad dphi_deg S0 S1 S2 S3\n"
    return (head + "\n".join(rows)).encode()


def ratio_scan() -> bytes:
    rows = [f"30,0,{v},0.5,0.25,{0.1 + 1e-3 * v:.4f},0.01,{0.9 - 1e-3 * v:.4f}"
            for v in range(-70, 75, 10)]  # fmt: skip
    head = (
        "# quantity: relative\ntheta_i_deg,phi_i_deg,theta_view_deg,source_half_angle_deg,"
        "detector_half_angle_deg,m10,m10_stderr,m22\n"
    )
    return (head + "\n".join(rows)).encode()


def absolute_scan() -> bytes:
    rows = [f"30,40,{abs(v)},{40 if v > 0 else 220},{0.05 + 1e-4 * v:.5f}"
            for v in range(-70, 75, 10)]  # fmt: skip
    return ("AOI,SAZ,VZA,VAZ,R\n" + "\n".join(rows)).encode()


_MAPPING = """azimuth_of_forward_deg = 0
angles = "deg"
quantity = "reflectance-factor"
detector_half_angle_deg = 0.5
[columns]
AOI = "theta_i_deg"
SAZ = "phi_i_deg"
VZA = "theta_s_deg"
VAZ = "phi_s_deg"
R = "M00"
"""


def mapped(path: Path) -> Any:
    """Read a table of other names through a mapping that stays whole."""
    mapping = path.with_name("instrument.toml")
    mapping.write_text(_MAPPING)
    return data_io.read_goniometer(path, columns=mapping)


def through(path: Path) -> Any:
    """Read a whole table through the mapping at `path`."""
    table = path.with_name("table.csv")
    table.write_bytes(absolute_scan())
    return data_io.read_goniometer(table, columns=path)


def nist_scan() -> bytes:
    elements = [f"f_r{i}{j}" for i in range(1, 5) for j in range(1, 5)]
    names = [elements[0], *(f"{name}/f_r11" for name in elements[1:])]
    rest = ",".join("0.01" for _ in names[1:])
    rows = [f"0.532,-{i},0,{v},{p},{0.3 - v / 1e3:.4f},{rest}"
            for i in (15, 45) for v in (10, 40, 70) for p in (0, 90, 180)]  # fmt: skip
    head = ",".join(["lambda", "thetai", "phi", "thetar", "phir", *names])
    return (head + "\n" + "\n".join(rows)).encode()


def spacecraft_scan() -> bytes:
    rows = [f"5 0 {v} 0 {10 ** (-abs(v) / 30):.5f}" for v in range(-80, 85, 10)]
    head = "# made up, 532 nm\n# phi_i theta_i phi_o theta_o brdf\n"
    return (head + "\n".join(rows)).encode()


def constants_formula() -> bytes:
    numbers = "0 1.03961212 0.00600069867 0.231792344 0.0200179144 1.01046945 103.560653"
    text = (
        "REFERENCES: x\nDATA:\n  - type: formula 2\n    wavelength_range: 0.3 2.5\n"
        f"    coefficients: {numbers}\n"
    )
    return text.encode()


def constants_blocks() -> bytes:
    first = "\n".join(f"{0.4 + k / 50:.3f},{1.5 - k / 1e3:.4f}" for k in range(10))
    second = "\n".join(f"{0.4 + k / 50:.3f},{k / 1e3:.4f}" for k in range(10))
    return f"wl,n\n{first}\n\nwl,k\n{second}\n".encode()


def constants_energy() -> bytes:
    rows = "\n".join(f"{1 + k / 8:.3f};{4 + k / 10:.2f};{k / 20:.3f}" for k in range(16))
    return ("energy_ev;eps1;eps2\n" + rows.replace(".", ",")).encode()


# name: (a good file, its suffix, reader)
READERS: dict[str, tuple[Callable[[], bytes], str, Callable[[Path], Any]]] = {
    "goniometer": (csv_scan, ".csv", data_io.read_goniometer),
    "fred": (fred_scan, ".txt", data_io.read_goniometer),
    "table-utf16": (csv_of_others, ".csv", data_io.read_goniometer),
    "astm": (astm_scan, ".txt", data_io.read_goniometer),
    "zemax": (zemax_scan, ".bsdf", data_io.read_goniometer),
    "pbsdf": (pbsdf_scan, ".pbsdf", data_io.read_goniometer),
    "wide": (wide_scan, ".txt", data_io.read_goniometer),
    "stokes": (stokes_scan, ".dat", data_io.read_goniometer),
    "ratios": (ratio_scan, ".csv", data_io.read_goniometer),
    "mapped": (absolute_scan, ".csv", mapped),
    "mapping": (_MAPPING.encode, ".toml", through),
    "nist": (nist_scan, ".csv", data_io.read_goniometer),
    "spacecraft": (spacecraft_scan, ".csv", data_io.read_goniometer),
    "profile": (profile_text, ".csv", data_io.read_profile),
    "map-text": (map_text, ".csv", data_io.read_height_map),
    "map-npy": (map_npy, ".npy", lambda path: data_io.read_height_map(path, spacing=1.0)),
    "map-x3p": (map_x3p, ".x3p", data_io.read_height_map),
    "scene": (scene_toml, ".toml", pbrdf.load_scene),
    "model": (model_toml, ".toml", data_io.read_model),
    "result": (result_nc, ".nc", data_io.read_result),
    "constants": (constants_csv, ".csv", pbrdf.materials.read),
    "constants-yml": (constants_yml, ".yml", pbrdf.materials.read),
    "constants-formula": (constants_formula, ".yml", pbrdf.materials.read),
    "constants-blocks": (constants_blocks, ".csv", pbrdf.materials.read),
    "constants-energy": (constants_energy, ".csv", pbrdf.materials.read),
    "constants-nk": (constants_nk, ".nk", pbrdf.materials.read),
    "constants-text": (constants_text, ".mat", pbrdf.materials.read),
}
