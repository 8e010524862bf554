"""Text files in, with a line number for everything that is wrong in them."""

import re
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pbrdf.errors import DataFileError


class MissingUnitWarning(UserWarning):
    """A file names no length unit and none was given: micrometres are assumed."""


COMMENT_MARKS = ("#", "%")
ZIP_MAGIC = b"PK\x03\x04"

# Sizes of the length units that headers and callers may name. [um]
LENGTH_UNITS = {
    "pm": 1e-6,
    "angstrom": 1e-4,
    "å": 1e-4,
    "nm": 1e-3,
    "um": 1.0,
    "micron": 1.0,
    "microns": 1.0,
    "mm": 1e3,
    "cm": 1e4,
    "m": 1e6,
}
KNOWN_UNITS = "nm, um, mm, m"

# A unit in a header stands after an underscore (x_um) or in brackets: z [nm], z (nm)
_UNIT_IN_HEADER = re.compile(r"_([A-Za-zµμÅå]+)\b|[\[(]\s*([A-Za-zµμÅå]+)\s*[\])]")


class Line(NamedTuple):
    """One line of a file: its number, counted from 1, and its text without line end."""

    number: int
    text: str

    def cells(self, delimiter: str | None) -> list[str]:
        """Return the stripped cells; delimiter None splits at any white space."""
        return [cell.strip() for cell in self.text.strip().split(delimiter)]


class Rows(NamedTuple):
    """Lines of data; apart from their numbers, because a profile has a million of them."""

    numbers: Sequence[int]
    texts: list[str]

    @property
    def first(self) -> Line:
        """The first line."""
        return Line(self.numbers[0], self.texts[0])

    @classmethod
    def of(cls, lines: Iterable[Line]) -> "Rows":
        """Return the given lines."""
        return cls(*(list(part) for part in zip(*lines, strict=True)))


def read_bytes(path: str | Path) -> bytes:
    """Return the content of a file that exists and is not empty."""
    try:
        content = Path(path).read_bytes()
    except FileNotFoundError as error:
        problem = "expected a file, found none of that name"
        raise DataFileError(path, problem, "Check the path.") from error
    except OSError as error:
        problem = f"expected a readable file, got: {error.strerror}"
        raise DataFileError(path, problem, "Check path and permissions.") from error
    if not content.strip():
        problem = "expected data, the file is empty"
        raise DataFileError(path, problem, "Export it again from its source.")
    return content


def read_lines(path: str | Path) -> list[Line]:
    """Return all lines of a text file; refuse an empty or a binary one."""
    return [Line(i, text) for i, text in enumerate(read_texts(path), start=1)]


def read_texts(path: str | Path) -> list[str]:
    """Return the text of all lines of a file; refuse an empty or a binary one."""
    content = read_bytes(path)
    problem = "expected a text file, found binary data"
    cure = "Give the text export of the instrument."
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        encoding = "utf-16"
    elif b"\x00" in content:
        raise DataFileError(path, problem, cure)
    else:
        encoding = "utf-8-sig"
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError as error:
        # Instruments write a Latin-1 "µm" into otherwise plain text; anything with
        # control characters is no text at all
        text = content.decode("latin-1")
        if re.search(r"[\x00-\x08\x0e-\x1f\x7f-\x9f]", text):
            raise DataFileError(path, problem, cure) from error
    if re.search(r"[\x00-\x08\x0e-\x1f]", text):
        raise DataFileError(path, problem, cure)
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def is_comment(line: Line) -> bool:
    """Tell whether a line is a comment."""
    return line.text.lstrip().startswith(COMMENT_MARKS)


def is_number(cell: str) -> bool:
    """Tell whether a cell holds one number; nan and inf count as numbers."""
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell


def find_delimiter(line: Line) -> str | None:
    """Return the separator of a line: comma, semicolon or tab, else None for spaces."""
    return next((mark for mark in (";", "\t", ",") if mark in line.text), None)


def split_header(path: str | Path) -> tuple[list[Line], Rows]:
    """Divide a numeric text file into its header and its data lines.

    Data begin at the first line that starts with a number; blank lines and comments among
    them are dropped.
    """
    texts = read_texts(path)
    header: list[Line] = []
    start = len(texts)
    for i, text in enumerate(texts):
        line = Line(i + 1, text)
        if not text.strip():
            continue
        if not is_comment(line) and is_number(line.cells(find_delimiter(line))[0]):
            start = i
            break
        header.append(line)
    numbers = [
        i
        for i, text in enumerate(texts[start:], start=start + 1)
        if (stripped := text.lstrip()) and not stripped.startswith(COMMENT_MARKS)
    ]
    if not numbers:
        raise DataFileError(
            path,
            "expected lines of numbers, found none",
            "Give columns of numbers separated by commas, semicolons, tabs or spaces.",
        )
    return header, Rows(numbers, [texts[i - 1] for i in numbers])


def read_numbers(
    path: str | Path, data: Rows, names: Sequence[str] | None = None
) -> np.ndarray:
    """Return a rectangular block of numbers, shape (lines, columns); NaN passes.

    Parameters
    ----------
    path : str or Path
        For the error message.
    data : Rows
        Lines that hold numbers and nothing else.
    names : sequence of str, optional
        Column names for the error message; numbers from 1 by default.

    Raises
    ------
    DataFileError
        Naming the first line and column that is not a number or is missing.
    """
    delimiter = find_delimiter(data.first)
    try:
        block = np.loadtxt(data.texts, delimiter=delimiter, comments=None, ndmin=2)
    except ValueError:
        block = None
    if block is not None and not np.isinf(block).any():
        return block
    raise _first_fault(path, data, delimiter, names)


def _first_fault(
    path: str | Path,
    data: Rows,
    delimiter: str | None,
    names: Sequence[str] | None,
) -> DataFileError:
    """Locate what made a block of numbers unreadable."""
    width = len(data.first.cells(delimiter))
    cure = "Columns are separated by comma, semicolon, tab or space; decimals have a point."
    for line in map(Line, data.numbers, data.texts):
        cells = line.cells(delimiter)
        for i, cell in enumerate(cells):
            if not is_number(cell) or np.isinf(float(cell)):
                name = names[i] if names and i < len(names) else str(i + 1)
                problem = f"expected a finite number, got {cell!r}"
                return DataFileError(path, problem, cure, line=line.number, column=name)
        if len(cells) != width:
            problem = (
                f"expected {width} columns as in line {data.first.number}, got {len(cells)}"
            )
            return DataFileError(
                path, problem, "The row is truncated or has extra cells.", line=line.number
            )
    return DataFileError(path, "expected a table of numbers", cure)


def normalise_unit(name: str) -> str:
    """Return a length unit in lower case and with a plain u for micro."""
    return name.strip().replace("µ", "u").replace("μ", "u").lower()


def unit_factor(name: str) -> float:
    """Return the size of a length unit named by the caller. [um]"""
    key = normalise_unit(name)
    if key not in LENGTH_UNITS:
        msg = f"unit must be one of {KNOWN_UNITS}, got {name!r}. Name the unit in the file."
        raise ValueError(msg)
    return LENGTH_UNITS[key]


def warn_missing_unit(path: str | Path, *, stacklevel: int) -> None:
    """Say that a file without unit is taken as micrometres."""
    msg = (
        f"{Path(path).name}: no length unit is named, micrometres are assumed. "
        "Name units in the header (x_um,z_um), or give unit=."
    )
    warnings.warn(msg, MissingUnitWarning, stacklevel=stacklevel)


def header_units(text: str) -> list[str]:
    """Return the length units a header line names, in order of appearance.

    Examples
    --------
    >>> header_units("# x_um, z [nm] (dx assumed)")
    ['um', 'nm']
    """
    found = (normalise_unit(a or b) for a, b in _UNIT_IN_HEADER.findall(text))
    return [unit for unit in found if unit in LENGTH_UNITS]
