"""Instrument formats by way of SurfaceTopography: orientation, units, missing points.

The files are written here from the public descriptions of the formats, with maps that have
no symmetry, so that a transposed or flipped axis shows.
"""

import importlib.util
import struct
import sys
import zipfile

import numpy as np
import pytest
from numpy.testing import assert_allclose

from data_io import read_height_map, read_profile
from pbrdf.errors import DataFileError

# Rows of constant y: 3 rows, 4 columns, one missing [um]
ROWS = np.array([[0.0, 1.0, 2.0, 3.5], [0.5, np.nan, -1.0, 4.0], [7.0, 0.25, 6.0, -2.0]])
DX, DY = 0.5, 0.2

needs_reader = pytest.mark.skipif(
    importlib.util.find_spec("SurfaceTopography") is None,
    reason="the extra pbrdf[formats] is not installed",
)


def text(value, size):
    return value.encode("latin-1").ljust(size, b"\0")


def sur_bytes():
    """Digital Surf: a fixed header of 512 bytes, then integers; zmin - 2 is missing."""
    step = 0.25
    counts = np.rint(ROWS / step)
    low, high = int(np.nanmin(counts)), int(np.nanmax(counts))
    data = np.where(np.isnan(counts), low - 2, counts).astype("<i4")
    header = b"".join(
        [
            b"DIGITAL SURF", struct.pack("<4H", 0, 1, 0, 2), text("map", 30), text("", 30),
            struct.pack("<5H", 0, 0, 0, 1, 1), bytes(8), struct.pack("<H", 32),
            struct.pack("<5i", low, high, 4, 3, 12),
            struct.pack("<3f", DX, DY, step),
            text("x", 16), text("y", 16), text("z", 16),
            *[text("\xb5m", 16)] * 6, struct.pack("<3f", 1, 1, 1),
            bytes(6), bytes(12), struct.pack("<7H", 1, 1, 1, 1, 1, 2020, 1),
            struct.pack("<f", 0), bytes(10), struct.pack("<2H", 0, 0), bytes(128),
            struct.pack("<3f", 0, 0, 0), bytes(34),
        ]
    )  # fmt: skip
    assert len(header) == 512
    return header + data.tobytes()


def gwy_bytes():
    """Gwyddion: nested components of name, type and value; lengths in metres, a mask."""

    def component(name, kind, value):
        return name.encode() + b"\0" + kind.encode() + value

    def thing(name, *components):
        content = b"".join(components)
        return name.encode() + b"\0" + struct.pack("<I", len(content)) + content

    def field(values, unit):
        data = values.astype("<f8").ravel()
        metre = thing("GwySIUnit", component("unitstr", "s", unit.encode() + b"\0"))
        return thing(
            "GwyDataField",
            component("xres", "i", struct.pack("<i", 4)),
            component("yres", "i", struct.pack("<i", 3)),
            component("xreal", "d", struct.pack("<d", 4 * DX * 1e-6)),
            component("yreal", "d", struct.pack("<d", 3 * DY * 1e-6)),
            component(
                "si_unit_xy", "o", thing("GwySIUnit", component("unitstr", "s", b"m\0"))
            ),
            component("si_unit_z", "o", metre),
            component("data", "D", struct.pack("<I", 12) + data.tobytes()),
        )

    heights = np.nan_to_num(ROWS) * 1e-6
    return b"GWYP" + thing(
        "GwyContainer",
        component("/0/data", "o", field(heights, "m")),
        component("/0/mask", "o", field(np.isnan(ROWS).astype(float), "")),
    )


def al3d_bytes():
    """Alicona: tags of 52 bytes, rows padded to 8 bytes, a marker for missing points."""

    def tag(name, value):
        return text(name, 20) + text(str(value), 30) + b"\r\n"

    tags = {
        "Cols": 4, "Rows": 3, "PixelSizeXMeter": DX * 1e-6, "PixelSizeYMeter": DY * 1e-6,
        "InvalidPixelValue": 1e10, "DepthImageOffset": 1000,
    }  # fmt: skip
    head = b"AliconaImaging\x00\r\n" + tag("Version", 1) + tag("TagCount", len(tags))
    head += b"".join(tag(*item) for item in tags.items())
    rows = np.where(np.isnan(ROWS), 1e10, ROWS * 1e-6).astype("<f4")
    return head.ljust(1000, b"\0") + rows.tobytes()


def write_plux(path):
    """Sensofar: a zip archive of an XML index and 32-bit heights in micrometres."""
    index = (
        "<xml><GENERAL><DATE>2020-01-02T03:04:05</DATE><IMAGE_SIZE_X>4</IMAGE_SIZE_X>"
        f"<IMAGE_SIZE_Y>3</IMAGE_SIZE_Y><FOV_X>{DX}</FOV_X><FOV_Y>{DY}</FOV_Y></GENERAL>"
        "<INFO><SIZE>0</SIZE></INFO><LAYER_0><FILENAME_Z>layer_0.raw</FILENAME_Z></LAYER_0></xml>"
    )
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("index.xml", index)
        archive.writestr("layer_0.raw", ROWS.astype("<f4").tobytes())


@needs_reader
@pytest.mark.parametrize("suffix", ["sur", "gwy", "al3d", "plux"])
def test_orientation_units_and_missing_points_survive(tmp_path, suffix):
    path = tmp_path / f"map.{suffix}"
    if suffix == "plux":
        write_plux(path)
    else:
        content = {"sur": sur_bytes, "gwy": gwy_bytes, "al3d": al3d_bytes}[suffix]()
        path.write_bytes(content)
    surface = read_height_map(path)
    assert_allclose(surface.spacing, (DX, DY), rtol=1e-6)
    assert surface.shape == (4, 3)
    assert_allclose(surface.heights, ROWS.T, rtol=1e-6, atol=1e-9)


@needs_reader
@pytest.mark.parametrize("cut", [0.2, 0.6, 0.95])
@pytest.mark.parametrize("make", [sur_bytes, gwy_bytes, al3d_bytes])
def test_a_truncated_file_is_refused(tmp_path, make, cut):
    content = make()
    path = tmp_path / f"map.{make.__name__.removesuffix('_bytes')}"
    path.write_bytes(content[: int(cut * len(content))])
    with pytest.raises(DataFileError, match=r"map\.\w+: expected a height map") as caught:
        read_height_map(path)
    assert "\n" not in str(caught.value)


@needs_reader
def test_a_map_is_no_profile(tmp_path):
    path = tmp_path / "map.sur"
    path.write_bytes(sur_bytes())
    with pytest.raises(
        DataFileError, match=r"expected a profile, got a map.*read_height_map"
    ):
        read_profile(path)
    with pytest.raises(DataFileError, match="Leave the arguments out"):
        read_height_map(path, spacing=1.0)


def test_without_the_extra_the_message_names_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "SurfaceTopography", None)
    path = tmp_path / "map.sur"
    path.write_bytes(sur_bytes())
    with pytest.raises(
        DataFileError, match=r"install the extra: pip install 'pbrdf\[formats\]'"
    ):
        read_height_map(path)
