"""Cells of a table under their names, whatever separates them and writes decimals."""

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from data_io.text.text import Line, is_comment, is_number, without_comments
from pbrdf.errors import DataFileError
from pbrdf.files import check_columns

__all__ = ["RawTable", "read_table"]

_SEPARATORS = (";", "\t", "|", ",")
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?")
# What programs write where nothing was measured
_GAP = {"", "nan", "NaN", "NAN"}


@dataclass(frozen=True)
class RawTable:
    """Text of a table.

    Attributes
    ----------
    names : list of str
        Names of the columns, with the units that stand in a row below them in brackets.
    cells : DataFrame of str
        One column a name, by position.
    lines : list of int
        Line of each row.
    header : int
        Line of the names.
    comments : list of str
        Comment lines, and lines above the names.
    """

    names: list[str]
    cells: pd.DataFrame
    lines: list[int]
    header: int
    comments: list[str]

    def numbers(self, path: Path, column: int) -> pd.Series:
        """Return a column as numbers, NaN for a gap.

        Raises
        ------
        DataFileError
            For the first cell that is no number.
        """
        text = self.cells.iloc[:, column]
        if text.str.fullmatch(_DECIMAL_COMMA).any():
            text = text.str.replace(",", ".", regex=False)
        values = pd.to_numeric(text.where(~text.isin(_GAP)), errors="coerce")
        wrong = values.isna() & ~text.isin(_GAP) | text.str.contains("_", regex=False)
        if wrong.any():
            row = int(wrong.to_numpy().argmax())
            problem = f"expected a number, got {self.cells.iloc[row, column]!r}"
            cure = "Leave gaps empty."
            raise DataFileError(
                path, problem, cure, line=self.lines[row], column=self.names[column]
            )
        return values.astype(float)

    def is_text(self, column: int) -> bool:
        """Tell whether no cell of a column is a number, and any says something."""
        text = self.cells.iloc[:, column]
        said = text[~text.isin(_GAP)]
        plain = said.str.replace(",", ".", regex=False)
        return len(said) > 0 and bool(pd.to_numeric(plain, errors="coerce").isna().all())


def read_table(path: Path, lines: Sequence[Line]) -> RawTable:
    """Find the names and the rows under them.

    The names stand in the last line before the first row of numbers; a row of units may
    stand between them. Semicolon, tab, bar, comma or spaces separate, as the names tell.

    Raises
    ------
    DataFileError
        If there are no names or no rows, or a row has cells too few or too many.
    """
    check_columns(path, (line.text for line in lines))
    # Spreadsheets leave rows of separators
    content = [line for line in without_comments(lines) if line.text.strip(",;\t ")]
    comments = [line.text.strip().lstrip("#% ") for line in lines if is_comment(line)]
    if not content:
        problem = "expected names of columns and rows of numbers, found none"
        raise DataFileError(path, problem, "The file is truncated.")
    top = next((k for k, line in enumerate(content) if _is_row(line)), len(content))
    if top == 0:
        first = _cells(content[0].text, _separator(content[0].text))[0]
        problem = f"expected a header line with column names, got {first!r}"
        cure = "Name the columns in the first line."
        raise DataFileError(path, problem, cure, line=content[0].number)
    head, rows = _header(content, top), content[top:]
    if not rows:
        problem = "expected rows below the header, found none"
        cure = "The file is truncated, or its rows do not begin with a number."
        raise DataFileError(path, problem, cure, line=head.number)
    separator = _separator(head.text)
    names = _cells(head.text, separator)
    units = content[content.index(head) + 1 : top]
    if units:
        below = _cells(units[0].text, separator)
        if len(below) == len(names):
            names = [
                f"{name} [{unit.strip('[]()')}]" if unit.strip("[]() -") else name
                for name, unit in zip(names, below, strict=True)
            ]
    split = [_cells(line.text, separator) for line in rows]
    # A separator at the end of every line is an empty last column
    if not names[-1] and all(len(row) <= len(names) and not row[-1] for row in split):
        names, split = names[:-1], [row[: len(names) - 1] for row in split]
    for line, row in zip(rows, split, strict=True):
        if len(row) != len(names):
            problem = f"expected {len(names)} cells as in the header, got {len(row)}"
            cure = "The row is truncated, has extra cells, or decimals have commas."
            raise DataFileError(path, problem, cure, line=line.number)
    above = [line.text.strip() for line in content[: content.index(head)]]
    return RawTable(
        names=names,
        cells=pd.DataFrame(split, dtype=str),
        lines=[line.number for line in rows],
        header=head.number,
        comments=[*comments, *above],
    )


def _header(content: Sequence[Line], top: int) -> Line:
    """Return the line of the names: above the rows, and above a line of units."""
    head = content[top - 1]
    if top > 1:
        separator = _separator(head.text)
        units = _cells(head.text, separator)
        above = _cells(content[top - 2].text, separator)
        if len(above) == len(units) > 1 and all(map(_is_unit, units)):
            return content[top - 2]
    return head


def _is_unit(cell: str) -> bool:
    plain = cell.strip().strip("[]()").lower()
    return plain in {"", "-", "1", "deg", "rad", "°", "nm", "um", "µm", "%", "degrees",
                     "1/sr", "sr-1", "sr^-1", "/sr", "radians"}  # fmt: skip


def _is_row(line: Line) -> bool:
    """Tell whether a line is one of numbers: its first cell that says anything is one."""
    cells = _cells(line.text, _separator(line.text))
    first = next((cell for cell in cells if cell), "")
    numbers = sum(is_number(cell.replace(",", ".")) for cell in cells if cell)
    return is_number(first.replace(",", ".")) or 2 * numbers > sum(map(bool, cells))


def _separator(text: str) -> str | None:
    """Return what separates the cells of a line; None is white space."""
    words = text.split()
    if len(words) > 1 and all(map(_DECIMAL_COMMA.fullmatch, words)):
        return "\t" if "\t" in text else None
    unquoted = re.sub(r'"[^"]*"', "", text)
    return next((mark for mark in _SEPARATORS if mark in unquoted), None)


def _cells(text: str, separator: str | None) -> list[str]:
    """Return the cells of a line, without the quotes that spreadsheets put round them."""
    if separator is None:
        return text.split()
    try:
        cells = next(
            csv.reader([text.strip(" ")], delimiter=separator, skipinitialspace=True)
        )
    except (csv.Error, StopIteration):
        cells = text.split(separator)
    return [cell.strip() for cell in cells]
