"""Instrument formats by way of SurfaceTopography: orientation, units, missing points.

The files are written here from the public descriptions of the formats, with maps that have
no symmetry, so that a transposed or flipped axis shows.
"""

import importlib.util
import struct
import sys
import warnings
import zipfile
import zlib

import numpy as np
import pytest
from numpy.testing import assert_allclose

from data_io import ChannelWarning, NotAMapError, read_height_map, read_profile
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


def sur_bytes(rows=ROWS, dy=DY, unit="\xb5m", encoding="latin-1"):
    """Digital Surf: a fixed header of 512 bytes, then integers; zmin - 2 is missing."""
    step = 0.25
    counts = np.rint(rows / step)
    low, high = int(np.nanmin(counts)), int(np.nanmax(counts))
    data = np.where(np.isnan(counts), low - 2, counts).astype("<i4")
    header = b"".join(
        [
            b"DIGITAL SURF", struct.pack("<4H", 0, 1, 0, 2), text("map", 30), text("", 30),
            struct.pack("<5H", 0, 0, 0, 1, 1), bytes(8), struct.pack("<H", 32),
            struct.pack("<5i", low, high, *rows.shape[::-1], rows.size),
            struct.pack("<3f", DX, dy, step),
            text("x", 16), text("y", 16), text("z", 16),
            *[unit.encode(encoding).ljust(16, b"\0")] * 6, struct.pack("<3f", 1, 1, 1),
            bytes(6), bytes(12), struct.pack("<7H", 1, 1, 1, 1, 1, 2020, 1),
            struct.pack("<f", 0), bytes(10), struct.pack("<2H", 0, 0), bytes(128),
            struct.pack("<3f", 0, 0, 0), bytes(34),
        ]
    )  # fmt: skip
    assert len(header) == 512
    return header + data.tobytes()


def compressed_sur_bytes():
    """Digital Surf, compressed: the lengths of two streams, then the streams."""
    plain = sur_bytes()
    parts = plain[512:530], plain[530:]
    packed = [zlib.compress(part) for part in parts]
    sizes = [len(x) for pair in zip(parts, packed, strict=True) for x in pair]
    head = b"DSCOMPRESSED" + plain[12:512]
    return head + struct.pack("<5I", 2, *sizes) + b"".join(packed)


def sdf_bytes():
    """ISO 25178-71, ASCII: heights in units of a scale; the lowest number is a gap."""
    head = {
        "ManufacID": "x", "CreateDate": "010120200000", "ModDate": "010120200000",
        "NumPoints": 4, "NumProfiles": 3, "Xscale": DX * 1e-6, "Yscale": DY * 1e-6,
        "Zscale": 1e-6, "Zresolution": -1, "Compression": 0, "DataType": 7, "CheckType": 0,
    }  # fmt: skip
    lines = ["aISO-1.0", *(f"{name} = {value}" for name, value in head.items()), "*"]
    cells = [f"{z:g}" for z in np.nan_to_num(ROWS.ravel(), nan=-1.797e308)]
    return "\r\n".join([*lines, " ".join(cells), "*", ""]).encode()


def gwy_bytes(extra=(), unit="m"):
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
    others = [
        part
        for i, name in enumerate(extra, start=1)
        for part in (
            component(f"/{i}/data", "o", field(heights + i, unit)),
            component(f"/{i}/data/title", "s", name.encode() + b"\0"),
        )
    ]
    return b"GWYP" + thing(
        "GwyContainer",
        *others,
        component("/0/data", "o", field(heights, unit)),
        component("/0/data/title", "s", b"Topography\0"),
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
@pytest.mark.parametrize("suffix", ["sur", "gwy", "al3d", "plux", "sdf"])
def test_orientation_units_and_missing_points_survive(tmp_path, suffix):
    path = tmp_path / f"map.{suffix}"
    if suffix == "plux":
        write_plux(path)
    else:
        content = {
            "sur": sur_bytes, "gwy": gwy_bytes, "al3d": al3d_bytes, "sdf": sdf_bytes,
        }[suffix]()  # fmt: skip
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
@pytest.mark.parametrize(
    "content",
    [compressed_sur_bytes(), sur_bytes(encoding="utf-8")],
    ids=["compressed", "units in UTF-8"],
)
def test_a_sur_file_of_another_make_is_the_same_map(tmp_path, content):
    path = tmp_path / "map.sur"
    path.write_bytes(content)
    surface = read_height_map(path)
    assert_allclose(surface.spacing, (DX, DY), rtol=1e-6)
    assert_allclose(surface.heights, ROWS.T, rtol=1e-6, atol=1e-9)


@needs_reader
@pytest.mark.parametrize("dy", [0.0, DX])
def test_a_sur_file_of_one_line_is_a_profile(tmp_path, dy):
    path = tmp_path / "line.pro"
    path.write_bytes(sur_bytes(rows=ROWS[2:], dy=dy))
    profile = read_profile(path)
    assert_allclose(profile.x, DX * np.arange(4), rtol=1e-6)
    assert_allclose(profile.z, ROWS[2], rtol=1e-6)
    with pytest.raises(NotAMapError, match=r"a profile of 4 points.*read_profile"):
        read_height_map(path)


@needs_reader
def test_the_height_channel_is_taken_and_named(tmp_path):
    path = tmp_path / "map.gwy"
    path.write_bytes(gwy_bytes(extra=["Lock-In Amplitude", "Height (retrace)"]))
    with pytest.warns(
        ChannelWarning, match=r"channel 1 \(Height \(retrace\)\) is taken"
    ) as w:
        taken = read_height_map(path)
    assert w[0].filename == __file__
    assert_allclose(taken.heights, np.nan_to_num(ROWS.T) + 2e6, rtol=1e-9)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for channel in (2, "topography"):
            surface = read_height_map(path, channel=channel)
            assert_allclose(surface.heights, ROWS.T, atol=1e-9)
    with pytest.raises(DataFileError, match=r"a channel .*, got 'Z'\. It has 0 \(Lock"):
        read_height_map(path, channel="Z")


@needs_reader
def test_a_file_without_lengths_is_refused(tmp_path):
    path = tmp_path / "map.gwy"
    path.write_bytes(gwy_bytes(unit="V"))
    with pytest.raises(DataFileError, match=r"a length unit, the file holds none"):
        read_height_map(path)


@needs_reader
def test_step_and_unit_are_given_where_the_file_names_none(tmp_path):
    path = tmp_path / "map.npz"
    np.savez(path, heights=ROWS.T)
    with pytest.raises(DataFileError, match=r"unit and steps, .* Give unit="):
        read_height_map(path)
    with pytest.raises(DataFileError, match=r"expected steps, the file names none"):
        read_height_map(path, unit="nm")
    surface = read_height_map(path, unit="nm", spacing=(DX, DY))
    assert_allclose(surface.spacing, (DX, DY), rtol=1e-12)
    assert surface.heights.size == ROWS.size


@needs_reader
def test_a_map_is_no_profile(tmp_path):
    path = tmp_path / "map.sur"
    path.write_bytes(sur_bytes())
    with pytest.raises(
        DataFileError, match=r"expected a profile, got a map.*read_height_map"
    ):
        read_profile(path)
    with pytest.raises(
        DataFileError, match=r"names its own: .* um\. Leave the argument out"
    ):
        read_height_map(path, spacing=1.0)


def test_without_the_extra_the_message_names_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "SurfaceTopography", None)
    path = tmp_path / "map.sur"
    path.write_bytes(sur_bytes())
    with pytest.raises(
        DataFileError, match=r"install the extra: pip install 'pbrdf\[formats\]'"
    ):
        read_height_map(path)
