"""What an HDF5 file may hold before it is believed: no links outwards, bombs or holes."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np

from pbrdf.errors import DataFileError

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
    OverflowError,
    RecursionError,
    EOFError,
    SystemError,
)
# A result may be so much larger than its file; noise compresses by less than two
MOST_EXPANSION = 2000
MOST_BYTES = 16 * 2**30
# Name and version of a global heap
_HEAP = b"GCOL\1\0\0\0"
HOSTILE = "A file holds its own data; do not read it from a stranger."
DAMAGED = "The file is damaged; copy it again or repeat the run."


def first_line(error: BaseException) -> str:
    """Return the first line of an error, not too long."""
    text = str(error).strip()
    return text.splitlines()[0][:150] if text else type(error).__name__


@contextmanager
def opened(path: str | Path, content: bytes) -> Iterator[h5py.File]:
    """Open a file in memory; refuse one whose data lie elsewhere, are missing, or are many.

    Raises
    ------
    DataFileError
        Naming the variable.
    """
    _check_heaps(path, content)
    try:
        file = h5py.File(h5py.h5f.open_file_image(content))
    except FAULTS as error:
        problem = f"expected a complete HDF5 file, got: {first_line(error)}"
        raise DataFileError(path, problem, "The file is truncated or damaged.") from error
    with file:
        try:
            _check_group(path, file, len(content))
        except DataFileError:
            raise
        except FAULTS as error:
            problem = f"expected a complete HDF5 file, got: {first_line(error)}"
            cure = "The file is truncated or damaged."
            raise DataFileError(path, problem, cure) from error
        yield file


def _check_heaps(path: str | Path, content: bytes) -> None:
    """Refuse tables of texts and references in which HDF5 would go round for ever.

    HDF5 file format 3.0, III.E: 16 bytes of head with the size of the collection, then
    objects with 16 bytes of head each; number 0 is what is free, its head counted in.
    """
    place = content.find(_HEAP)
    while place >= 0:
        end = place + int.from_bytes(content[place + 8 : place + 16], "little")
        at = place + 16
        while at + 16 <= min(end, len(content)):
            number = int.from_bytes(content[at : at + 2], "little")
            size = int.from_bytes(content[at + 8 : at + 16], "little")
            step = 16 + -(-size // 8) * 8 if number else size
            if not 16 <= step <= end - at:
                raise DataFileError(path, "its table of texts is damaged", DAMAGED)
            at += step
        place = content.find(_HEAP, place + 4)


def _check_group(path: str | Path, group: h5py.Group, size: int, depth: int = 0) -> None:
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            problem = f"{name[:80]} is a link to somewhere else"
            raise DataFileError(path, problem, HOSTILE)
        item = group[name]
        if isinstance(item, h5py.Group):
            # A group can hold itself
            if depth > 8:
                raise DataFileError(path, "its groups nest too deeply", HOSTILE)
            _check_group(path, item, size, depth + 1)
        elif isinstance(item, h5py.Dataset):
            _check_dataset(path, name, item, size)


def _check_dataset(path: str | Path, name: str, item: h5py.Dataset, size: int) -> None:
    place = f"variable {name[:80]}"
    if item.id.get_create_plist().get_external_count():
        problem = "its data lie in another file"
        raise DataFileError(path, problem, HOSTILE, column=place)
    if item.is_virtual:
        problem = "it is put together from other files"
        raise DataFileError(path, problem, HOSTILE, column=place)
    if item.nbytes > min(MOST_BYTES, MOST_EXPANSION * size):
        problem = f"it would take {item.nbytes / 2**20:.0f} MiB of a file of {size} bytes"
        raise DataFileError(path, problem, DAMAGED, column=place)
    if item.chunks is None or not item.size:
        return
    expected = 1
    for side, chunk in zip(item.shape, item.chunks, strict=True):
        expected *= -(-side // chunk)
    # A damaged index puts pieces outside, and what they should fill is read as missing
    places = set()
    # Its answer would end the search unless it is None
    item.id.chunk_iter(lambda chunk: places.add(chunk.chunk_offset))
    inside = sum(all(np.less(offset, item.shape)) for offset in places)
    if inside != expected:
        problem = f"it holds {inside} of {expected} pieces of its data"
        raise DataFileError(path, problem, DAMAGED, column=place)
