"""Text of a file of optical constants: characters, lines, cells and numbers."""

import csv
import re
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import NamedTuple

from pbrdf.errors import DataFileError

__all__ = ["Line", "cells_of", "number", "read_text", "separator_of"]

# Far beyond any table of optical constants
_LARGEST = 50_000_000
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?")
_DECIMAL = re.compile(r"[-+]?\d+(?:,\d+)?(?:[eE][-+]?\d+)?")
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f]")


class Line(NamedTuple):
    """One line of a file: its number, counted from 1, and its text."""

    number: int
    text: str


def read_text(file: Path | Traversable, shown: Path) -> str:
    """Return the text of a file, in UTF-8, UTF-16 or the code page of Windows."""
    try:
        if isinstance(file, Path) and file.exists() and not file.is_file():
            problem = "expected a file, found a folder or a device"
            raise DataFileError(shown, problem, "Pass a table of optical constants.")
        with file.open("rb") as stream:
            content = stream.read(_LARGEST + 1)
    except OSError as error:
        problem = f"cannot be read ({error.strerror})"
        raise DataFileError(shown, problem, "Check the path.") from error
    if len(content) > _LARGEST:
        problem = f"expected at most {_LARGEST // 10**6} MB, got more"
        raise DataFileError(shown, problem, "Pass a table of optical constants.")
    for encoding in _encodings(content):
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        if not _CONTROL.search(text):
            return text.replace("\r\n", "\n").replace("\r", "\n")
    problem = "cannot be read as text"
    raise DataFileError(shown, problem, "Pass a table in text form, such as CSV.")


def _encodings(content: bytes) -> tuple[str, ...]:
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return ("utf-16",)
    if b"\x00" in content:
        # Plain text in UTF-16 has a zero for nearly every other byte
        return ("utf-16-le",) if content[1::2].count(0) > content[::2].count(0) else (
            "utf-16-be",
        )  # fmt: skip
    return "utf-8-sig", "cp1252"


def separator_of(text: str) -> str | None:
    """Return what separates the cells of a line; None is white space."""
    found = next((mark for mark in (";", "\t") if mark in text), None)
    if found or "," not in text:
        return found
    # "400 1,5 0,01": the commas are decimal ones
    words = text.split()
    return None if len(words) > 1 and all(map(_DECIMAL.fullmatch, words)) else ","


def cells_of(text: str, separator: str | None) -> list[str]:
    """Return the cells of a line without quotes and spaces."""
    if separator is None:
        return [cell.strip('"') for cell in text.split()]
    try:
        cells = next(csv.reader([text], delimiter=separator, skipinitialspace=True))
    except csv.Error:
        cells = text.split(separator)
    return [cell.strip() for cell in cells]


def number(cell: str) -> float | None:
    """Return a cell as a number, with a decimal point or comma; None if it is none."""
    text = cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell
    if "_" in text:
        return None
    try:
        return float(text.replace("\u2212", "-"))
    except ValueError:
        return None
