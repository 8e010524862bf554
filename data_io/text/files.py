"""Bytes and text of files, whatever program and country they come from."""

import re
from pathlib import Path

from pbrdf.errors import DataFileError
from pbrdf.files import read_bounded

TEXT_SUFFIXES = {".csv", ".txt", ".asc", ".dat", ".tsv", ".xyz"}

_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f]")
# The micro sign of other code pages: DOS, Shift-JIS, GB 2312, UTF-8 decoded twice
_MICRO = re.compile(
    "(?:\u00e6|\u0192\u00ca|\u00a6\u00cc|\u00c2\u00b5|\u00ce\u00bc)(?=m\\b)"
)
# Minus signs and spaces of typesetting
_TYPESET = {
    "-": "\u2010\u2011\u2012\u2013\u2014\u2212\ufe63\uff0d",
    " ": "\u00a0\u2007\u2009\u202f",
}


class NotAMapError(DataFileError):
    """A file that was read as a map holds a profile."""

    def __init__(self, path: str | Path, points: int) -> None:
        problem = f"expected a map, got a profile of {points} points"
        super().__init__(path, problem, "Read it with read_profile.")


def read_bytes(path: str | Path, first: int | None = None) -> bytes:
    """Return the content of a file that exists and is not empty, or its first bytes."""
    content = read_bounded(path, first=first)
    if not content.strip() and (first is None or len(content) < first):
        problem = "expected data, the file is empty"
        raise DataFileError(path, problem, "Export it again from its source.")
    return content


def read_texts(path: str | Path) -> list[str]:
    """Return the text of all lines of a file; refuse an empty or a binary one.

    UTF-8, UTF-16 with or without a byte order mark, and code pages are told apart.
    """
    text = _decode(read_bytes(path))
    if text is None or _CONTROL.search(text):
        problem = "expected a text file, found binary data"
        raise DataFileError(path, problem, "Give the text export of the instrument.")
    if not text.isascii():
        # Programs that join files leave a mark of each
        text = _MICRO.sub("\u00b5", text.replace("\ufeff", ""))
        for plain, signs in _TYPESET.items():
            for sign in signs:
                text = text.replace(sign, plain)
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def is_text(path: str | Path) -> bool:
    """Tell whether a file holds text."""
    text = _decode(read_bytes(path))
    return text is not None and not _CONTROL.search(text)


def _decode(content: bytes) -> str | None:
    """Return the characters of a file, or None for binary data."""
    # What is no UTF-8 is the code page of Windows, or another of one byte a sign
    encodings = ["utf-8-sig", "cp1252", "latin-1"]
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        encodings = ["utf-16"]
    elif b"\x00" in content:
        # Plain text in UTF-16 has a zero for nearly every other byte
        high, low = (content[i::2].count(0) > 0.4 * len(content) for i in (0, 1))
        if high == low:
            return None
        encodings = ["utf-16-be" if high else "utf-16-le"]
    for encoding in encodings:
        try:
            return content.decode(encoding)
        except UnicodeDecodeError:
            continue
    return None
