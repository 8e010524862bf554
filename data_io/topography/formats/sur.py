"""SUR files as other readers take them: inflated, with their units in one code page.

A header of 512 bytes, a comment and a private zone come first. Compressed files then give
the number of streams, the plain and the compressed length of each, and the streams.
"""

import io
import struct
import zlib
from pathlib import Path

from data_io.text.files import read_bytes

_PLAIN, _COMPRESSED = b"DIGITAL SURF", b"DSCOMPRESSED"
_HEADER = 512
_ZONE_SIZES = 334
_LINES = 112
_STEP_X, _STEP_Y = slice(120, 124), slice(124, 128)
# Units of the steps and of the axes, each of x, y and z
_UNITS = [slice(start, start + 16) for start in range(180, 276, 16)]
# Heights of instruments compress by less than twenty
MOST_BYTES = 2**30
MOST_EXPANSION = 400
_UTF8_MICRO, _MICRO = "µ".encode(), "µ".encode("latin-1")


def plain_sur(path: Path) -> io.BytesIO | None:
    """Return the content of a SUR file made plain, and None for any other file.

    Raises
    ------
    struct.error, zlib.error
        If the file is damaged.
    """
    content = read_bytes(path)
    if not content.startswith((_PLAIN, _COMPRESSED)) or len(content) < _HEADER:
        return None
    header = bytearray(content[:_HEADER])
    for field in _UNITS:
        unit = header[field].rstrip(b"\0 ").replace(_UTF8_MICRO, _MICRO)
        header[field] = unit.ljust(16, b"\0")
    if struct.unpack_from("<i", header, _LINES)[0] == 1:
        # A profile needs no step and no unit along y
        header[_STEP_Y] = header[_STEP_X]
        header[_UNITS[1]], header[_UNITS[4]] = header[_UNITS[0]], header[_UNITS[3]]
    header[: len(_PLAIN)] = _PLAIN
    rest = content[_HEADER:]
    if content.startswith(_COMPRESSED):
        rest = _inflated(rest, sum(struct.unpack_from("<2H", content, _ZONE_SIZES)))
    return io.BytesIO(bytes(header) + rest)


def _inflated(rest: bytes, start: int) -> bytes:
    """Return what follows the header, with its streams inflated."""
    (count,) = struct.unpack_from("<I", rest, start)
    lengths = struct.unpack_from(f"<{2 * count}I", rest, start + 4)
    begin = start + 4 + 8 * count
    streams = []
    most = min(MOST_BYTES, MOST_EXPANSION * len(rest) + 2**20)
    for length in lengths[1::2]:
        inflate = zlib.decompressobj()
        streams.append(inflate.decompress(rest[begin : begin + length], most))
        most -= len(streams[-1])
        if inflate.unconsumed_tail or most <= 0:
            msg = f"its {len(rest)} bytes would grow beyond reason"
            raise zlib.error(msg)
        begin += length
    return rest[:start] + b"".join(streams)
