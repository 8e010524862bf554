"""Cells of a table: what separates them, gaps, numbers in either notation."""

import csv
import re
from collections.abc import Iterable, Sequence
from itertools import takewhile
from pathlib import Path

import numpy as np
import pandas as pd

from data_io.text.gaps import is_gap
from data_io.text.notation import DECIMAL, THOUSANDS
from data_io.text.text import is_number
from pbrdf.errors import DataFileError

__all__ = [
    "cells_of", "is_plain", "numbers_of", "plain_row", "require_one_notation",
    "separator_of", "sign_behind", "without_counter", "without_empty_end",
]  # fmt: skip

_SEPARATORS = (";", "\t", "|", ",")
_COMMA = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")
_POINT = re.compile(r"[-+]?(?:\d+\.\d*|\.\d+)(?:[eE][-+]?\d+)?")
_PLAIN = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_PARTED = re.compile(r"[-+]?0\d+")
_ANY_PARTED = re.compile(rf"^{_PARTED.pattern}$", re.MULTILINE)
# With a point of thousands, or below a thousand
_DOTTED = re.compile(r"[-+]?[1-9]\d{0,2}\.\d{3}")
_WHOLE = re.compile(r"[-+]?[1-9]\d{2}")
_ANY_WHOLE = re.compile(rf"^{_WHOLE.pattern}$", re.MULTILINE)
# Signs that programs put behind numbers, and the unit that they mean
_SIGNS = {"%": "%", "°": "deg", "º": "deg"}


def separator_of(text: str) -> str | None:
    """Return what separates the cells of a line; None is white space.

    Examples
    --------
    >>> separator_of("30;0,5"), separator_of("30 0,5"), separator_of("30,0.5")
    (';', None, ',')
    """
    words = text.split()
    if len(words) > 1 and all(map(DECIMAL.fullmatch, words)):
        return "\t" if "\t" in text else None
    unquoted = re.sub(r'"[^"]*"', "", text)
    return next((mark for mark in _SEPARATORS if mark in unquoted), None)


def cells_of(text: str, separator: str | None) -> list[str]:
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


def plain_row(separator: str | None, width: int) -> re.Pattern[str]:
    """Return the pattern of a row of numbers with points, in which nothing is to be judged.

    Its cells are what stands between the separators, without spaces.
    """
    between = r"[ \t]+" if separator is None else f" *{re.escape(separator)} *"
    around = r"[ \t]*" if separator is None else " *"
    return re.compile(
        rf"{around}{_PLAIN}(?:{between}{_PLAIN}){{{width - 1}}}{around}", re.ASCII
    )


def is_plain(cell: str) -> bool:
    """Tell whether a cell is a number in either notation, with or without a sign behind."""
    bare = cell.rstrip("%°º ") if cell[-1:] in _SIGNS else cell
    return is_number(bare) or bool(_COMMA.fullmatch(bare))


def numbers_of(text: pd.Series) -> tuple[np.ndarray, np.ndarray]:
    """Return a column as numbers, NaN for a gap, and which cells are neither.

    Examples
    --------
    >>> numbers, wrong = numbers_of(pd.Series(["0,5", "n/a", "<0.1"]))
    >>> numbers.tolist(), wrong.tolist()
    ([0.5, nan, nan], [False, False, True])
    """
    numbers = pd.to_numeric(text, errors="coerce").to_numpy(float, copy=True)
    gone = np.isnan(numbers)
    other = text[gone]
    if other.str.contains(",", regex=False).any():
        pointed = other.str.replace(",", ".", regex=False)
        pointed = pointed.where(other.str.fullmatch(_COMMA), other)
        numbers[gone] = pd.to_numeric(pointed, errors="coerce").to_numpy(float)
    rest = np.isnan(numbers)
    if "_" in "\n".join(text.tolist()):
        rest |= text.str.contains("_", regex=False).to_numpy(bool)
    gaps = np.zeros(rest.size, dtype=bool)
    gaps[rest] = [is_gap(cell) for cell in text.to_numpy()[rest]]
    return np.where(gaps, np.nan, numbers), rest & ~gaps


def sign_behind(text: pd.Series) -> tuple[pd.Series, str]:
    """Return a column without the sign that stands behind all its numbers, and its unit.

    Examples
    --------
    >>> bare, unit = sign_behind(pd.Series(["30°", "n/a"]))
    >>> bare.tolist(), unit
    (['30', 'n/a'], 'deg')
    """
    held = text.to_numpy()
    first = next((cell for cell in held if not is_gap(cell)), "")
    if first[-1:] not in _SIGNS:
        return text, ""
    ends = {cell[-1:] for cell in held if not is_gap(cell)}
    if len(ends) != 1 or (sign := ends.pop()) not in _SIGNS:
        return text, ""
    bare = text.str.removesuffix(sign).str.rstrip()
    return bare, _SIGNS[sign]


def require_one_notation(
    path: Path,
    columns: Iterable[tuple[str, pd.Series]],
    lines: Sequence[int],
    separator: str | None,
) -> None:
    """Refuse commas that may be decimal ones or those of thousands.

    Commas are decimal ones where one stands behind a zero, or not before three digits, and
    where no number has a decimal point. Commas between columns leave 05 where they parted
    a number.

    Parameters
    ----------
    path : Path
        For the error message.
    columns : iterable of (str, Series)
        Name and cells of each column that is read.
    lines : sequence of int
        Line of each row.
    separator : str or None
        What separates the cells.

    Raises
    ------
    DataFileError
        Naming the first comma that can be read in two ways.
    """
    comma, decimal, point, parted = None, False, None, None
    for name, column in columns:
        cells = column.tolist()
        # Most columns show at once that none of their cells is in doubt
        together = "\n".join(cells)
        if separator == "," and parted is None and _ANY_PARTED.search(together):
            row = next(k for k, cell in enumerate(cells) if _PARTED.fullmatch(cell))
            parted = (name, lines[row], cells[row])
        for row, cell in enumerate(cells if "," in together else ()):
            if _COMMA.fullmatch(cell):
                comma = comma or (name, lines[row], cell)
                decimal = decimal or not THOUSANDS.fullmatch(cell)
        if _ANY_WHOLE.search(together):
            _refuse_points_of_thousands(path, name, cells, lines)
        if point is None and "." in together:
            point = next(filter(_POINT.fullmatch, cells), None)
    if parted is not None and point is None:
        name, line, cell = parted
        problem = f"expected commas between columns, {cell!r} stands behind a decimal one"
        cure = "Separate columns by semicolons, or write decimals with a point."
        raise DataFileError(path, problem, cure, line=line, column=name)
    if comma is None or (decimal and point is None):
        return
    name, line, cell = comma
    beside = f" beside {point!r}" if point else ""
    problem = f"expected decimal commas or thousands, got {cell!r}{beside} for either"
    cure = "Write decimals with a point, and nothing between thousands."
    raise DataFileError(path, problem, cure, line=line, column=name)


def _refuse_points_of_thousands(
    path: Path, name: str, cells: Sequence[str], lines: Sequence[int]
) -> None:
    """Refuse 1.234 beside 950: no number has another count of decimals, none is below 1."""
    whole = [cell for cell in cells if _WHOLE.fullmatch(cell)]
    if len(whole) < 2:
        return
    dotted = [row for row, cell in enumerate(cells) if _DOTTED.fullmatch(cell)]
    said = sum(map(bool, cells))
    if len(dotted) < 2 or not len(dotted) + len(whole) > 0.9 * said:
        return
    row = dotted[0]
    problem = f"expected decimals or thousands, got {cells[row]!r} beside {whole[0]!r}"
    cure = "Write nothing between thousands, and decimals in every number or in none."
    raise DataFileError(path, problem, cure, line=lines[row], column=name)


def without_empty_end(row: list[str], width: int) -> list[str]:
    """Return a row without the empty cells beyond the last column.

    Examples
    --------
    >>> without_empty_end(["1", "", ""], 2)
    ['1', '']
    """
    empty = len(list(takewhile(lambda cell: not cell, reversed(row[width:]))))
    return row[: len(row) - empty]


def without_counter(
    names: Sequence[str], cells: pd.DataFrame
) -> tuple[list[str], pd.DataFrame]:
    """Take out a first column without a name that counts the rows; number other ones.

    Tables of pandas have such a column.
    """
    first = pd.to_numeric(cells.iloc[:, 0], errors="coerce").to_numpy(float)
    nameless = not names[0] or re.fullmatch(r"Unnamed: \d+", names[0])
    if (
        nameless
        and len(names) > 1
        and (first[:1] % 1 == 0).all()
        and ((first - first[:1] == range(len(first))).all())
    ):
        names, cells = names[1:], cells.iloc[:, 1:]
    return [name or f"column {k}" for k, name in enumerate(names, 1)], cells
