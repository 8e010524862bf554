"""Cells of a table under their names, whatever separates them and writes decimals."""

import re
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from data_io.goniometer.scan import ConventionWarning
from data_io.goniometer.tables.cells import (
    cells_of,
    is_plain,
    numbers_of,
    plain_row,
    require_one_notation,
    separator_of,
    sign_behind,
    without_counter,
    without_empty_end,
)
from data_io.goniometer.tables.names import meaning_of
from data_io.goniometer.tables.units import unit_named, written_units
from data_io.text.gaps import is_gap
from data_io.text.text import Line, is_comment, without_comments
from pbrdf.errors import DataFileError, shortened
from pbrdf.files import check_columns
from pbrdf.optics.published.columns import unit_of

__all__ = ["RawTable", "read_table"]

# How other programs mark a comment; a semicolon only where it separates nothing
_COMMENT = ("//", "!", "'")


@dataclass(frozen=True)
class RawTable:
    """Text of a table.

    Attributes
    ----------
    names : list of str
        Names of the columns, with the units that stand in a row below them, or behind each
        number, in brackets.
    cells : DataFrame of str
        One column a name, by position.
    lines : list of int
        Line of each row.
    header : int
        Line of the names.
    comments : list of str
        Comment lines, and lines above the names.
    remarks : list of Line
        Those lines with their numbers, and lines of words among the rows.
    separator : str or None
        What separates the cells; None is white space.
    """

    names: list[str]
    cells: pd.DataFrame
    lines: list[int]
    header: int
    comments: list[str]
    remarks: list[Line]
    separator: str | None

    @property
    def above(self) -> list[str]:
        """Remarks on all rows: above the first or below the last."""
        first, last = self.lines[0], self.lines[-1]
        return [line.text for line in self.remarks if not first < line.number < last]

    @property
    def among(self) -> list[Line]:
        """Remarks among the rows, which may tell of rows below them."""
        first, last = self.lines[0], self.lines[-1]
        return [line for line in self.remarks if first < line.number < last]

    def numbers(self, path: Path, column: int) -> pd.Series:
        """Return a column as numbers, NaN for a gap.

        Raises
        ------
        DataFileError
            For the first cell that is no number.
        """
        text = self.cells.iloc[:, column]
        values, wrong = numbers_of(text)
        if wrong.any():
            row = int(wrong.argmax())
            cell = text.iloc[row]
            problem = f"expected a number, got {cell!r}"
            cure = "Leave gaps empty; write decimals with a point, without thousands marks."
            if cell[:1] in ("<", ">", "≤", "≥", "~"):
                cure = (
                    "A limit is no reading: write what was read, with its standard error; "
                    "or leave the cell empty."
                )
            raise DataFileError(
                path, problem, cure, line=self.lines[row], column=self.names[column]
            )
        return pd.Series(values, index=text.index)

    def marks(self, column: int) -> list[str]:
        """Return the words that stand for gaps in a column, one for each of its cells."""
        text = self.cells.iloc[:, column].to_numpy()
        # No mark is a number
        others = text[np.isnan(pd.to_numeric(text, errors="coerce"))].tolist()
        plain = {"", "nan"}
        return [cell for cell in others if cell.lower() not in plain and is_gap(cell)]

    def is_text(self, column: int) -> bool:
        """Tell whether no cell of a column is a number, and any says something."""
        said = False
        for cell in self.cells.iloc[:, column].to_numpy():
            if not is_gap(cell):
                said = True
                if is_plain(cell):
                    return False
        return said

    def require_one_notation(self, path: Path, columns: Iterable[int]) -> None:
        """Refuse commas in these columns that can be read in two ways."""
        named = ((self.names[k], self.cells.iloc[:, k]) for k in columns)
        require_one_notation(path, named, self.lines, self.separator)


def read_table(path: Path, lines: Sequence[Line]) -> RawTable:
    """Find the names and the rows under them.

    The names stand in the last line before the first row of numbers; a row of units may
    stand between them. Semicolon, tab, bar, comma or spaces separate, as the names tell.
    Comments among the rows are kept; names that are repeated, as where blocks were joined,
    count once.

    Raises
    ------
    DataFileError
        If there are no names or no rows, or a row has cells too few or too many.
    """
    check_columns(path, (line.text for line in lines))
    # Spreadsheets leave rows of separators
    content = [line for line in without_comments(lines) if line.text.strip(",;\t ")]
    remarks = [line for line in lines if is_comment(line)]
    comments = [line.text.strip().lstrip("#% ") for line in remarks]
    if not content:
        problem = "expected names of columns and rows of numbers, found none"
        raise DataFileError(path, problem, "The file is truncated.")
    top = next((k for k, line in enumerate(content) if _is_row(line)), len(content))
    if top == 0:
        first = cells_of(content[0].text, separator_of(content[0].text))[0]
        problem = f"expected a header line with column names, got {first!r}"
        cure = "Name the columns in the first line."
        raise DataFileError(path, problem, cure, line=content[0].number)
    head = _header(content, top)
    if not content[top:]:
        problem = "expected rows below the header, found none"
        cure = "The file is truncated, or its rows do not begin with a number."
        raise DataFileError(path, problem, cure, line=head.number)
    separator = separator_of(head.text)
    above = content[: content.index(head)]
    between = content[len(above) + 1 : top]
    names = cells_of(head.text, separator)
    heads = [names, *(cells_of(line.text, separator) for line in between)]
    rows, words = _rows(path, content[top:], heads, separator)
    while len(names) > 1 and not names[-1] and not any(row[-1] for _, row in rows):
        names = names[:-1]
        rows = [(line, row[:-1]) for line, row in rows]
    if between:
        names = _with_units(names, heads[1])
    cells = pd.DataFrame([row for _, row in rows], dtype=str)
    names, cells = without_counter(names, cells)
    return RawTable(
        names=_with_signs(names, cells),
        cells=cells,
        lines=[line.number for line, _ in rows],
        header=head.number,
        comments=[*comments, *(line.text.strip() for line in above)],
        remarks=sorted([*remarks, *above, *words]),
        separator=separator,
    )


def _rows(
    path: Path, content: Sequence[Line], heads: Sequence[list[str]], separator: str | None
) -> tuple[list[tuple[Line, list[str]]], list[Line]]:
    """Return the cells of each row, and the lines of words among them."""
    width = len(heads[0])
    plain = plain_row(separator, width)
    rows: list[tuple[Line, list[str]]] = []
    words: list[Line] = []
    for line in content:
        if plain.fullmatch(line.text):
            row = line.text.split(separator)
            rows.append(
                (line, [cell.strip(" ") for cell in row] if " " in line.text else row)
            )
            continue
        if line.text.lstrip().startswith(_COMMENT) or (
            separator != ";" and line.text.lstrip().startswith(";")
        ):
            words.append(line)
            continue
        row = without_empty_end(cells_of(line.text, separator), width)
        if row in heads:
            continue
        said = [cell for cell in row if cell]
        if len(said) == 1 and not re.search(r"\d", said[0]):
            text = shortened(said[0], 40)
            msg = f"{path.name}: line {line.number}, {text!r}, is left out as a remark."
            warnings.warn(msg, ConventionWarning, stacklevel=6)
            words.append(line)
            continue
        if len(said) == 1 < width and sum(map(is_plain, _apart(said[0]))) > 1:
            mark = "spaces" if separator is None else repr(separator)
            problem = (
                f"expected cells that {mark} separates, as it does the names, got "
                f"{shortened(line.text.strip(), 40)!r}"
            )
            cure = "Separate names and rows alike."
            raise DataFileError(path, problem, cure, line=line.number)
        if not any(map(is_plain, said)) and not all(map(is_gap, said)):
            problem = f"expected a row of numbers, got {shortened(line.text.strip(), 60)!r}"
            cure = (
                "Begin remarks with #; what a line says of the rows below it belongs into "
                "a column, another table into a file of its own."
            )
            raise DataFileError(path, problem, cure, line=line.number)
        if len(row) != width:
            problem = f"expected {width} cells as in the header, got {len(row)}"
            cure = "The row is truncated, has extra cells, or decimals have commas."
            raise DataFileError(path, problem, cure, line=line.number)
        rows.append((line, row))
    return rows, words


def _apart(text: str) -> list[str]:
    """Return the cells of a line by its own separator."""
    return cells_of(text, separator_of(text))


def _with_units(names: Sequence[str], below: Sequence[str]) -> list[str]:
    """Return names with the units of the row below them in brackets."""
    if len(below) < len(names):
        return list(names)
    # A unit that stands in the name too says nothing new
    return [
        f"{name} [{unit.strip('[]()')}]"
        if unit.strip("[]() -") and unit_named(unit) not in written_units(name).units
        else name
        for name, unit in zip(names, below, strict=False)
    ]


def _with_signs(names: Sequence[str], cells: pd.DataFrame) -> list[str]:
    """Take signs of units from the cells into the names, in place; return the names."""
    found = list(names)
    for k, name in enumerate(names):
        bare, unit = sign_behind(cells.iloc[:, k])
        meaning = meaning_of(name)
        said = meaning.unit if meaning else None
        # A unit of the name's own that says something else leaves the sign to be refused
        if unit and said in (None, unit):
            cells.isetitem(k, bare.to_numpy())
            found[k] = name if said else f"{name} [{unit}]"
    return found


def _header(content: Sequence[Line], top: int) -> Line:
    """Return the line of the names: above the rows, and above a line of units."""
    head = content[top - 1]
    if top > 1:
        separator = separator_of(head.text)
        units = cells_of(head.text, separator)
        above = cells_of(content[top - 2].text, separator)
        named = any(map(_is_known, above)) and not any(map(_is_known, units))
        if len(above) == len(units) > 1 and (named or all(map(_is_unit, units))):
            return content[top - 2]
    return head


def _is_known(cell: str) -> bool:
    """Tell whether a cell names something, and not a unit alone."""
    return unit_of(cell) is None and meaning_of(cell) is not None


def _is_unit(cell: str) -> bool:
    return unit_named(cell) is not None


def _is_row(line: Line) -> bool:
    """Tell whether a line is one of numbers: its first cell that says anything is one."""
    cells = [cell for cell in cells_of(line.text, separator_of(line.text)) if cell]
    numbers = sum(map(is_plain, cells))
    if not numbers:
        return False
    # Wavelengths may head columns beside a name
    return is_plain(cells[0]) or (
        2 * numbers > len(cells) and not any(map(_is_known, cells))
    )
