"""Text files in, with a line number for everything that is wrong in them."""

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from data_io.text.files import read_texts
from data_io.text.notation import DECIMAL, plain_notation, unquoted
from data_io.text.units import LENGTH_UNITS, normalise_unit
from pbrdf.errors import DataFileError

COMMENT_MARKS = ("#", "%")

# What programs write for a point without height
_MISSING = re.compile(
    r"no[ _]?data|\*{2,}|-{2,}|-?1\.#\w+|-?nan\(\w+\)|\bbad\b", re.IGNORECASE
)


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


def read_lines(path: str | Path) -> list[Line]:
    """Return all lines of a text file; refuse an empty or a binary one."""
    return [Line(i, text) for i, text in enumerate(read_texts(path), start=1)]


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
    words = line.text.split()
    if len(words) > 1 and all(map(DECIMAL.fullmatch, words)):
        return "\t" if "\t" in line.text else None
    return next((mark for mark in (";", "\t", ",") if mark in line.text), None)


def column_names(header: list[Line], first: Line) -> list[str] | None:
    """Return the names over the columns, if the header has them.

    A line of units under a line of names belongs to the names.
    """
    delimiter = find_delimiter(first)
    width = len(first.cells(delimiter))
    rows = []
    for line in header[-2:]:
        text = line.text.strip().lstrip("".join(COMMENT_MARKS)).strip()
        rows.append(Line(line.number, text.rstrip(delimiter)).cells(delimiter))
    if not rows or len(rows[-1]) != width:
        return None
    if len(rows) == 2 and len(rows[0]) == width and all(map(_is_unit, rows[1])):
        return [f"{name} [{unit.strip('[]() ')}]" for name, unit in zip(*rows, strict=True)]
    return rows[-1]


def _is_unit(cell: str) -> bool:
    return normalise_unit(cell.strip("[]() ")) in LENGTH_UNITS


def split_header(path: str | Path) -> tuple[list[Line], Rows]:
    """Divide a numeric text file into its header and its data lines.

    Data begin at the first line that starts with a number; blank lines and comments among
    them are dropped.
    """
    texts = unquoted(read_texts(path))
    start = next((i for i, text in enumerate(texts) if _is_data(text)), len(texts))
    header = [
        Line(i, text) for i, text in enumerate(texts[:start], start=1) if text.strip()
    ]
    numbers = [
        i
        for i, text in enumerate(texts[start:], start=start + 1)
        if (stripped := text.lstrip()) and not stripped.startswith(COMMENT_MARKS)
    ]
    # Some formats begin with the number of points
    if len(numbers) > 2 and texts[numbers[0] - 1].strip() == str(len(numbers) - 1):
        header.append(Line(numbers[0], texts[numbers[0] - 1]))
        numbers = numbers[1:]
    if not numbers:
        raise DataFileError(
            path,
            "expected lines of numbers, found none",
            "Give columns of numbers separated by comma, semicolon, tab or space, "
            "without separators of thousands.",
        )
    rows = Rows(numbers, [texts[i - 1] for i in numbers])
    return header, rows._replace(
        texts=plain_notation(path, rows.texts, find_delimiter(rows.first))
    )


def _is_data(text: str) -> bool:
    """Tell whether a line begins with a number, or is a row that begins with a gap."""
    line = Line(0, text)
    if not text.strip() or is_comment(line):
        return False
    delimiter = find_delimiter(line)
    cells = line.cells(delimiter)
    if is_number(cells[0]) or DECIMAL.fullmatch(cells[0]):
        return True
    cells = Line(0, _MISSING.sub("nan", text)).cells(delimiter)
    return (
        len(cells) > 1 and all(is_number(cell) or not cell for cell in cells) and any(cells)
    )


def read_numbers(
    path: str | Path,
    data: Rows,
    names: Sequence[str] | None = None,
    *,
    gaps: bool = False,
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
    gaps : bool
        Read empty cells and marks such as "No Data" and "***" as NaN.

    Raises
    ------
    DataFileError
        Naming the first line and column that is not a number or is missing.
    """
    delimiter = find_delimiter(data.first)
    block = _block(data.texts, delimiter)
    if block is None and gaps:
        data = data._replace(texts=[_with_nan(text, delimiter) for text in data.texts])
        block = _block(data.texts, delimiter)
    if block is not None and not np.isinf(block).any():
        return block
    raise _first_fault(path, data, delimiter, names)


def _block(texts: list[str], delimiter: str | None) -> np.ndarray | None:
    """Return a rectangular block of numbers, or None."""
    try:
        return np.loadtxt(texts, delimiter=delimiter, comments=None, ndmin=2)
    except ValueError:
        return None


def _with_nan(text: str, delimiter: str | None) -> str:
    """Return a line with nan for what marks a missing point."""
    text = _MISSING.sub("nan", text)
    if delimiter is None:
        return text
    return delimiter.join(cell.strip() or "nan" for cell in text.split(delimiter))


def _first_fault(
    path: str | Path,
    data: Rows,
    delimiter: str | None,
    names: Sequence[str] | None,
) -> DataFileError:
    """Locate what made a block of numbers unreadable."""
    width = len(data.first.cells(delimiter))
    cure = (
        "Columns are separated by comma, semicolon, tab or space; one notation of decimals."
    )
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
