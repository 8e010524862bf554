"""One way to open a file: a regular one, of a size that is known before it is read."""

import math
import stat
import tokenize
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np

from pbrdf.errors import DataFileError

__all__ = [
    "MOST_BYTES",
    "check_columns",
    "companion",
    "file_size",
    "read_array",
    "read_bounded",
]

# A header is read as Python source, and can fail in every way that source can
_FAULTS_OF_HEADERS = (
    ValueError,
    TypeError,
    SyntaxError,
    tokenize.TokenError,
    MemoryError,
    OverflowError,
    RecursionError,
    EOFError,
    LookupError,
    OSError,
)
# Columns of a table
MOST_CELLS = 10_000
# Larger than any text or map that the readers can hold in the memory of a workstation
MOST_BYTES = 4 * 2**30


def file_size(path: str | Path, most: int = MOST_BYTES) -> int:
    """Return the size of a regular file. [bytes]

    Raises
    ------
    DataFileError
        If there is none of that name, if it is a folder, a pipe or a device, or larger
        than `most`.
    """
    try:
        found = Path(path).stat()
    except FileNotFoundError as error:
        problem, cure = "expected a file, found none of that name", "Check the path."
        if str(path) == "-":
            problem = "expected a file, standard input is not read"
            cure = "Save it to a file and name that."
        raise DataFileError(path, problem, cure) from error
    except (OSError, ValueError) as error:
        text = getattr(error, "strerror", None) or str(error)
        problem = f"expected a readable file, got: {text}"
        raise DataFileError(path, problem, "Check path and permissions.") from error
    if not stat.S_ISREG(found.st_mode):
        kind = "a folder" if stat.S_ISDIR(found.st_mode) else "a pipe or a device"
        problem = f"expected a regular file, got {kind}"
        raise DataFileError(path, problem, "Give the name of a file.")
    if found.st_size > most:
        problem = (
            f"expected at most {most / 2**20:.0f} MiB, got {found.st_size / 2**20:.0f}"
        )
        raise DataFileError(path, problem, "Split it, or export it in a binary format.")
    return found.st_size


def read_bounded(
    path: str | Path, most: int = MOST_BYTES, *, first: int | None = None
) -> bytes:
    """Return the content of a regular file of at most `most` bytes, or its first bytes.

    Raises
    ------
    DataFileError
        As `file_size`, or if the file cannot be read.
    """
    size = file_size(path, most)
    with _readable(path) as stream:
        # A file that grows while it is read is read as it was
        return stream.read(size if first is None else min(size, first))


@contextmanager
def _readable(path: str | Path) -> Iterator[BinaryIO]:
    try:
        with Path(path).open("rb") as stream:
            yield stream
    except OSError as error:
        problem = f"expected a readable file, got: {error.strerror}"
        raise DataFileError(path, problem, "Check path and permissions.") from error


def companion(source: Path, name: str, place: str) -> Path:
    """Return the file that another names, which lies in its folder or below it.

    Raises
    ------
    DataFileError
        If the name leads out of the folder: a file from a stranger must not make this
        program read others.
    """
    folder = source.parent.resolve()
    target = (folder / name).resolve()
    if not target.is_relative_to(folder):
        problem = f"{place}: file {name[:100]!r} lies outside the folder of this file"
        raise DataFileError(source, problem, "Put it beside this file, without links.")
    return target


def read_array(path: Path, most: int = MOST_BYTES) -> np.ndarray:
    """Return the array of a .npy file, whose header is believed only as far as its size.

    Raises
    ------
    DataFileError
        If it is no such file, or holds less than its header says, or objects.
    """
    size = file_size(path, most)
    cure = "Give an array of numbers as numpy.save writes it."
    try:
        with _readable(path) as stream:
            version = np.lib.format.read_magic(stream)
            if version == (1, 0):
                shape, _, dtype = np.lib.format.read_array_header_1_0(stream)
            else:
                shape, _, dtype = np.lib.format.read_array_header_2_0(stream)
            if dtype.hasobject or dtype.kind not in "biufc":
                raise DataFileError(path, f"expected numbers, got {dtype}"[:200], cure)
            expected = math.prod(shape) * dtype.itemsize
            held = size - stream.tell()
            if expected > held or any(side < 0 for side in shape):
                problem = f"its header promises {expected} bytes of data, it holds {held}"
                raise DataFileError(path, problem, "The file is truncated or damaged.")
            stream.seek(0)
            return np.asarray(np.load(stream, allow_pickle=False))
    except DataFileError:
        raise
    except _FAULTS_OF_HEADERS as error:
        text = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise DataFileError(path, f"expected a .npy file, got: {text}", cure) from error


def check_columns(path: str | Path, lines: Iterable[str]) -> None:
    """Refuse a table with so many cells in a line that it would take minutes to read.

    Raises
    ------
    DataFileError
        If a line has more than 10 000.
    """
    for number, line in enumerate(lines, 1):
        if len(line) <= MOST_CELLS:
            continue
        cells = 1 + max(map(line.count, ",;\t"))
        if cells > MOST_CELLS:
            problem = f"expected at most {MOST_CELLS} columns, got {cells}"
            raise DataFileError(path, problem, "Is it a table?", line=number)
