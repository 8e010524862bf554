"""Text files in, with a line number for everything that is wrong in them."""

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import count, pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from data_io.text.files import read_texts
from data_io.text.gaps import with_nan
from data_io.text.notation import DECIMAL, plain_notation, unquoted
from pbrdf.errors import DataFileError

COMMENT_MARKS = ("#", "%")
# Lines of words before the numbers, of which there may be a million
MOST_HEADER = 100_000
# A number as Fortran writes it in double precision
_FORTRAN = re.compile(r"(?<![\w.])[-+]?\d*\.\d*[dD][-+]?\d{1,3}(?!\w)")
# Signs of the name of a column
LONGEST_NAME = 500


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
    return list(map(Line, count(1), read_texts(path)))


def is_comment(line: Line) -> bool:
    """Tell whether a line is a comment."""
    return line.text.lstrip().startswith(COMMENT_MARKS)


def without_comments(lines: Iterable[Line]) -> list[Line]:
    """Return the lines that say something and are no comments."""
    return list(content_of(lines))


def content_of(lines: Iterable[Line]) -> Iterator[Line]:
    """Yield the lines that say something and are no comments."""
    for line in lines:
        first = line.text.lstrip()[:1]
        if first and first not in COMMENT_MARKS:
            yield line


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


def split_header(path: str | Path, block: int | None = None) -> tuple[list[Line], Rows]:
    """Divide a numeric text file into its header and its data lines.

    Data begin at a line that starts with a number; blank lines and comments among them are
    dropped, and lines of words after them end a block of data. Blocks of a few numbers
    beside a long one belong to the header.

    Parameters
    ----------
    path : str or Path
        The file.
    block : int, optional
        Which of several blocks of data, from 1.

    Raises
    ------
    DataFileError
        If there are no numbers, or several blocks of data and none is chosen.
    """
    texts = unquoted(read_texts(path))
    blocks = _blocks(texts)
    if not blocks:
        cure = (
            "Give columns of numbers separated by comma, semicolon, tab or space, "
            "without separators of thousands."
        )
        fortran = next((text for text in texts if _FORTRAN.search(text)), None)
        if fortran is not None:
            cure = "Write exponents with E instead of Fortran's D: 1.0E+00, not 1.0D+00."
        raise DataFileError(path, "expected lines of numbers, found none", cure)
    numbers = _chosen_block(path, texts, blocks, block)
    header = [
        Line(i, text)
        for i, text in enumerate(texts[: numbers[0] - 1], start=1)
        if text.strip()
    ]
    # Some formats begin with the number of points
    if len(numbers) > 2 and texts[numbers[0] - 1].strip() == str(len(numbers) - 1):
        header.append(Line(numbers[0], texts[numbers[0] - 1]))
        numbers = numbers[1:]
    rows = Rows(numbers, [texts[i - 1] for i in numbers])
    return header, rows._replace(
        texts=plain_notation(path, rows.texts, find_delimiter(rows.first))
    )


def _blocks(texts: list[str]) -> list[list[int]]:
    """Return the line numbers of each run of data lines."""
    blocks: list[list[int]] = []
    inside = False
    for i, text in enumerate(texts, start=1):
        if i > MOST_HEADER and not blocks:
            break
        stripped = text.lstrip()
        if not stripped or stripped.startswith(COMMENT_MARKS):
            continue
        if not inside:
            if not _is_data(text):
                continue
            blocks.append([])
            inside = True
            first = Line(i, text)
        # Most lines are told apart by their first sign; a file may have a million
        elif not stripped.lstrip("+-.")[:1].isdigit() and _is_words(text, first):
            inside = False
            continue
        blocks[-1].append(i)
    return blocks


def _is_words(text: str, first: Line) -> bool:
    """Tell whether a line among data is of words, and not a row with a fault in it."""
    line = Line(0, with_nan(text))
    cells = line.cells(find_delimiter(line))
    numbers = [is_number(cell) or bool(DECIMAL.fullmatch(cell)) for cell in cells]
    if numbers[0] or not any(cells):
        return False
    delimiter = find_delimiter(first)
    return not any(numbers) or len(line.cells(delimiter)) != len(first.cells(delimiter))


def _chosen_block(
    path: str | Path, texts: list[str], blocks: list[list[int]], wanted: int | None
) -> list[int]:
    """Return the lines of the block of data, of those long enough to be one."""
    longest = max(blocks, key=len)
    long = [b for b in blocks if len(b) >= 3 and len(b) > len(longest) / 20]
    if wanted is not None:
        if not 1 <= wanted <= len(long):
            problem = f"expected a block of data from 1 to {len(long)}, got {wanted}"
            raise DataFileError(path, problem, "Choose another by block=.")
        return long[wanted - 1]
    pages = [b for b in blocks if texts[b[0] - 2] == texts[longest[0] - 2]]
    joined = _one_table(texts, pages) if len(pages) > 1 else None
    if joined is not None:
        return joined
    if len(long) < 2:
        return longest
    places = ", ".join(f"lines {b[0]} to {b[-1]}" for b in long[:6])
    more = f" and {len(long) - 6} more" if len(long) > 6 else ""
    problem = f"expected one block of data, found {len(long)}: {places}{more}"
    raise DataFileError(path, problem, "Choose one by block=1.")


def _one_table(texts: list[str], blocks: list[list[int]]) -> list[int] | None:
    """Return the lines of a table whose header is repeated, as on the pages of a print."""
    ends = [Line(i, texts[i - 1]) for b in blocks for i in sorted({b[0], b[-1]})]
    cells = [line.cells(find_delimiter(line))[0].replace(",", ".") for line in ends]
    if not all(map(is_number, cells)):
        return None
    rising = all(a < b for a, b in pairwise(map(float, cells)))
    return [i for b in blocks for i in b] if rising else None


def _is_data(text: str) -> bool:
    """Tell whether a line begins with a number, or is a row that begins with a gap."""
    line = Line(0, text)
    if not text.strip() or is_comment(line):
        return False
    delimiter = find_delimiter(line)
    cells = line.cells(delimiter)
    if is_number(cells[0]) or DECIMAL.fullmatch(cells[0]):
        return True
    cells = Line(0, with_nan(text)).cells(delimiter)
    return (
        len(cells) > 1 and all(is_number(cell) or not cell for cell in cells) and any(cells)
    )


def read_numbers(
    path: str | Path,
    data: Rows,
    names: Sequence[str] | None = None,
    *,
    gaps: bool = False,
    columns: Sequence[int] | None = None,
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
        Read empty cells, infinities and marks such as "No Data" and "***" as NaN.
    columns : sequence of int, optional
        Places of the columns wanted, from 0; others may hold anything. All by default.

    Raises
    ------
    DataFileError
        Naming the first line and column that is not a number or is missing.
    """
    delimiter = find_delimiter(data.first)
    block = _block(data.texts, delimiter, columns)
    if block is None and gaps:
        data = data._replace(texts=[with_nan(text, delimiter) for text in data.texts])
        block = _block(data.texts, delimiter, columns)
    if block is not None and gaps:
        # Some programs write infinity for what was not measured
        return np.where(np.isinf(block), np.nan, block)
    if block is not None and not np.isinf(block).any():
        return block
    raise _first_fault(path, data, delimiter, names, columns)


def _block(
    texts: list[str], delimiter: str | None, columns: Sequence[int] | None
) -> np.ndarray | None:
    """Return a rectangular block of numbers, or None."""
    try:
        return np.loadtxt(
            texts, delimiter=delimiter, comments=None, ndmin=2, usecols=columns
        )
    except ValueError:
        return None


def _first_fault(
    path: str | Path,
    data: Rows,
    delimiter: str | None,
    names: Sequence[str] | None,
    columns: Sequence[int] | None,
) -> DataFileError:
    """Locate what made a block of numbers unreadable."""
    width = len(data.first.cells(delimiter))
    cure = (
        "Columns are separated by comma, semicolon, tab or space; one notation of decimals."
    )
    for line in map(Line, data.numbers, data.texts):
        cells = line.cells(delimiter)
        for i, cell in enumerate(cells):
            if columns is not None and i not in columns:
                continue
            if not is_number(cell) or np.isinf(float(cell)):
                name = names[i] if names and i < len(names) else str(i + 1)
                problem = f"expected a finite number, got {cell!r}"
                if i == 0 and line.number > data.first.number and not is_number(cell):
                    cure = "Delete the line if it belongs to no point, as a footer."
                return DataFileError(path, problem, cure, line=line.number, column=name)
        if len(cells) != width:
            problem = (
                f"expected {width} columns as in line {data.first.number}, got {len(cells)}"
            )
            return DataFileError(
                path, problem, "The row is truncated or has extra cells.", line=line.number
            )
    return DataFileError(path, "expected a table of numbers", cure)
