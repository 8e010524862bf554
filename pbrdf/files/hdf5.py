"""What an HDF5 file may hold before it is believed: no links outwards, bombs or holes."""

import math
import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from operator import lt
from pathlib import Path
from typing import Any, BinaryIO

import h5py

from pbrdf.errors import DataFileError
from pbrdf.files.reading import file_size

__all__ = ["DAMAGED", "FAULTS", "first_line", "opened"]

# What the libraries below raise of damaged files
FAULTS = (
    OSError,
    ValueError,
    LookupError,
    RuntimeError,
    TypeError,
    AttributeError,
    AssertionError,
    MemoryError,
    ArithmeticError,
    RecursionError,
    EOFError,
    SystemError,
    struct.error,
)
# A result may be so much larger than its file; noise compresses by less than two
MOST_EXPANSION = 2000
MOST_BYTES = 16 * 2**30
MOST_ENTRIES = 1000
# Bytes of a packed piece, of which zlib makes at most a thousand times as many
_MOST_PACKED = 2**19
_FILTERS = {
    h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32,
    h5py.h5z.FILTER_SZIP, h5py.h5z.FILTER_NBIT, h5py.h5z.FILTER_SCALEOFFSET,
    h5py.h5z.FILTER_LZF,
}  # fmt: skip
# Name and version of a global heap
_HEAP = b"GCOL\1\0\0\0"
_BLOCK = 2**20
HOSTILE = "A file holds its own data; do not read it from a stranger."
DAMAGED = "The file is damaged; copy it again or repeat the run."


def first_line(error: BaseException) -> str:
    """Return the first line of an error, not too long."""
    text = str(error).strip()
    return text.splitlines()[0][:150] if text else type(error).__name__


@contextmanager
def opened(path: str | Path) -> Iterator[h5py.File]:
    """Open a file; refuse one whose data lie elsewhere, are missing, or are many.

    Raises
    ------
    DataFileError
        Naming the variable.
    """
    size = file_size(path)
    try:
        with Path(path).open("rb") as stream:
            _check_heaps(path, stream, size)
        file = _open(path)
    except DataFileError:
        raise
    except FAULTS as error:
        problem = f"expected a complete HDF5 file, got: {first_line(error)}"
        raise DataFileError(path, problem, "The file is truncated or damaged.") from error
    with file:
        try:
            _check_group(path, file, size)
        except DataFileError:
            raise
        except FAULTS as error:
            problem = f"expected a complete HDF5 file, got: {first_line(error)}"
            cure = "The file is truncated or damaged."
            raise DataFileError(path, problem, cure) from error
        yield file


def _open(path: str | Path) -> h5py.File:
    """Open a file without a lock, or as another reader of this process has it open."""
    try:
        return h5py.File(path, "r", locking=False)
    except OSError as error:
        if "locking flag" not in str(error):
            raise
        return h5py.File(path, "r")


def _check_heaps(path: str | Path, stream: BinaryIO, size: int) -> None:
    """Refuse tables of texts and references in which HDF5 would go round for ever.

    HDF5 file format 3.0, III.E: 16 bytes of head with the size of the collection, then
    objects with 16 bytes of head each; number 0 is what is free, its head counted in.
    """
    walked = 0
    for place in _heaps(stream, size):
        stream.seek(place + 8)
        end = int.from_bytes(stream.read(8), "little") - 16
        held = stream.read(max(min(end, size), 0))
        at = 0
        walked += len(held)
        # They do not overlap
        if walked > size:
            raise DataFileError(path, "its table of texts is damaged", DAMAGED)
        while at + 16 <= len(held):
            number = int.from_bytes(held[at : at + 2], "little")
            length = int.from_bytes(held[at + 8 : at + 16], "little")
            step = 16 + -(-length // 8) * 8 if number else length
            if not 16 <= step <= end - at:
                raise DataFileError(path, "its table of texts is damaged", DAMAGED)
            at += step


def _heaps(stream: BinaryIO, size: int) -> Iterator[int]:
    """Yield where tables of texts begin; a search from the end takes half the time."""
    for start in range(0, size, _BLOCK):
        stream.seek(start)
        block = stream.read(_BLOCK + len(_HEAP) - 1)
        place = block.rfind(_HEAP)
        while place >= 0:
            yield start + place
            place = block.rfind(_HEAP, 0, place)


def _check_group(
    path: str | Path, group: h5py.Group, size: int, depth: int = 0, count: int = 0
) -> int:
    """Check what a group holds; return how many entries have been met so far."""
    _check_attributes(path, group)
    for name in group:
        count += 1
        # Groups may hold others by many ways
        if count > MOST_ENTRIES:
            problem = f"it holds more than {MOST_ENTRIES} groups and variables"
            raise DataFileError(path, problem, HOSTILE)
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            problem = f"{name[:80]} is a link to somewhere else"
            raise DataFileError(path, problem, HOSTILE)
        item = group[name]
        if isinstance(item, h5py.Group):
            # A group can hold itself
            if depth > 8:
                raise DataFileError(path, "its groups nest too deeply", HOSTILE)
            count = _check_group(path, item, size, depth + 1, count)
        elif isinstance(item, h5py.Dataset):
            _check_dataset(path, name, item, size)
    return count


def _check_attributes(path: str | Path, item: h5py.Group | h5py.Dataset) -> None:
    if len(item.attrs) > MOST_ENTRIES:
        problem = f"{item.name[:80]} has more than {MOST_ENTRIES} attributes"
        raise DataFileError(path, problem, HOSTILE)


def _check_dataset(path: str | Path, name: str, item: h5py.Dataset, size: int) -> None:
    place = f"variable {name[:80]}"
    _check_attributes(path, item)
    if item.id.get_create_plist().get_external_count():
        problem = "its data lie in another file"
        raise DataFileError(path, problem, HOSTILE, column=place)
    if item.is_virtual:
        problem = "it is put together from other files"
        raise DataFileError(path, problem, HOSTILE, column=place)
    if item.nbytes > min(MOST_BYTES, MOST_EXPANSION * size):
        problem = f"it would take {item.nbytes / 2**20:.0f} MiB of a file of {size} bytes"
        raise DataFileError(path, problem, DAMAGED, column=place)
    if not item.size:
        return
    if item.chunks is None:
        if not item.id.get_storage_size() and not _is_dimension(item):
            problem = f"none of its {item.size} values was written"
            raise DataFileError(path, problem, DAMAGED, column=place)
        return
    expected = 1
    for side, chunk in zip(item.shape, item.chunks, strict=True):
        expected *= -(-side // chunk)
    # A damaged index puts pieces outside, and what they should fill is read as missing
    places = {}

    def note(chunk: Any) -> None:
        # An answer would end the search unless it is None
        places[chunk.chunk_offset] = chunk.size

    item.id.chunk_iter(note)
    inside = sum(all(map(lt, offset, item.shape)) for offset in places)
    if inside != expected:
        problem = f"it holds {inside} of {expected} pieces of its data"
        raise DataFileError(path, problem, DAMAGED, column=place)
    _check_packing(path, place, item, places)


def _is_dimension(item: h5py.Dataset) -> bool:
    """Whether it is a length of netCDF 4 without values, which says so."""
    said = item.attrs.get("NAME", b"")
    text = said.decode("latin-1") if isinstance(said, bytes) else str(said)
    return text.startswith("This is a netCDF dimension but not a netCDF variable")


def _check_packing(
    path: str | Path, place: str, item: h5py.Dataset, sizes: dict[tuple[int, ...], int]
) -> None:
    """Refuse pieces that would grow beyond their size: HDF5 inflates to the end."""
    made = item.id.get_create_plist()
    filters = [made.get_filter(k)[0] for k in range(made.get_nfilters())]
    if len(set(filters)) < len(filters) or not _FILTERS.issuperset(filters):
        raise DataFileError(path, "it is packed in a foreign way", HOSTILE, column=place)
    if h5py.h5z.FILTER_DEFLATE not in filters:
        return
    expected = math.prod(item.chunks) * item.dtype.itemsize
    for offset, size in sizes.items():
        # Zlib packs at most so well; smaller pieces cannot fill the memory
        if size > _MOST_PACKED:
            unpack = zlib.decompressobj()
            unpack.decompress(item.id.read_direct_chunk(offset)[1], expected + 1024)
            if unpack.unconsumed_tail:
                problem = f"a piece of it grows beyond {expected} bytes"
                raise DataFileError(path, problem, HOSTILE, column=place)
