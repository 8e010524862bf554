"""TOML files, parsed within bounds of size, depth and time."""

import tomllib
from pathlib import Path
from typing import Any

from pbrdf.errors import DataFileError
from pbrdf.files.reading import read_bounded

__all__ = ["read_toml", "tables_of"]

# A scene with its heights written out, and more
MOST_BYTES = MOST_TEXT = 64 * 2**20
# The parser takes a time that grows with the square of their number
MOST_DOTS = 500
# Some 4 us each
MOST_VALUES = 1_000_000


def tables_of(text: str) -> dict[str, Any]:
    """Parse a text that another file holds; return no tables if it is no TOML."""
    try:
        few = _dots(text) <= MOST_DOTS and _values(text) <= MOST_VALUES
        return tomllib.loads(text[:MOST_TEXT]) if few else {}
    except (ValueError, OverflowError, RecursionError):
        return {}


def _dots(text: str) -> int:
    """Count the dots in the keys of a text."""
    return sum(
        line.partition("=")[0].count(".") for line in text.splitlines() if "=" in line
    )


def _values(text: str) -> int:
    """Count what a text may hold at most: keys, members of lists, escaped signs."""
    return sum(map(text.count, "=,[\\"))


def read_toml(source: str | Path) -> dict[str, Any]:
    """Parse a TOML file, or raise a DataFileError that says what is wrong with it."""
    try:
        text = read_bounded(source, MOST_BYTES).decode("utf-8-sig")
        dots = _dots(text)
        if dots > MOST_DOTS:
            problem = f"has {dots} dots in its keys, more than any file of this program"
            raise DataFileError(source, problem, "Write [tables] instead of dotted keys.")
        values = _values(text)
        if values > MOST_VALUES:
            problem = f"may hold {values} values, more than {MOST_VALUES}"
            raise DataFileError(source, problem, "Keep heights in a .npy file.")
        return tomllib.loads(text)
    except DataFileError:
        raise
    except UnicodeDecodeError:
        problem, cure = "is not a text file", "Give a TOML file in UTF-8."
    except tomllib.TOMLDecodeError as error:
        problem, cure = f"is not valid TOML: {str(error)[:200]}", "Mend the line named."
    except RecursionError:
        problem, cure = "nests tables or lists too deeply", "A few levels are enough."
    except (ValueError, OverflowError) as error:
        problem, cure = f"holds a value that is no number: {str(error)[:150]}", "Mend it."
    raise DataFileError(source, problem, cure)
