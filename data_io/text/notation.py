"""How numbers are written: decimal commas, quotation marks, separators at line ends."""

import re
from pathlib import Path

from pbrdf.errors import DataFileError

# A number that may have a decimal comma
DECIMAL = re.compile(r"[-+]?\d+(?:,\d+)?(?:[eE][-+]?\d+)?")
THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")
_COMMA_CELL = re.compile(r"[^\s;]*,[^\s;]*")
# 05 is no integer but what stands behind a decimal comma
_SPLIT_DECIMAL = re.compile(r"(?:^|,)[ ]*([-+]?0\d+)[ ]*(?=,|$)", re.MULTILINE)
_QUOTED_ROW = re.compile(r'\s*"[^"]*"(?:\s*,\s*"[^"]*")+\s*,?\s*')


def unquoted(texts: list[str]) -> list[str]:
    """Return lines without the quotation marks round their cells.

    Where commas separate quoted cells, semicolons take their place: a comma inside may be a
    decimal one.
    """
    if not any('"' in text for text in texts):
        return texts
    return [
        ";".join(re.findall(r'"([^"]*)"', text))
        if _QUOTED_ROW.fullmatch(text)
        else text.replace('"', "")
        for text in texts
    ]


def plain_notation(path: str | Path, texts: list[str], delimiter: str | None) -> list[str]:
    """Return lines of data with decimal points and without a separator at their end.

    Raises
    ------
    DataFileError
        If a comma can be read in two ways.
    """
    mark = delimiter or " "
    if all(text.rstrip(" ").endswith(mark) for text in texts):
        texts = [text.rstrip(" ").removesuffix(mark) for text in texts]
    content = "\n".join(texts)
    if "," not in content:
        return texts
    if delimiter == ",":
        _refuse_split_decimals(path, content)
        return texts
    cells = _COMMA_CELL.findall(content)
    if not all(map(DECIMAL.fullmatch, cells)):
        return texts
    if "." in content or all(map(THOUSANDS.fullmatch, cells)):
        problem = f"expected decimal commas or thousands, got {cells[0]!r} for either"
        raise DataFileError(path, problem, "Write decimals with a point.")
    return content.replace(",", ".").split("\n")


def _refuse_split_decimals(path: str | Path, content: str) -> None:
    """Refuse commas that separate both columns and decimals."""
    found = None if "." in content else _SPLIT_DECIMAL.search(content)
    if found:
        problem = (
            f"expected commas between columns, {found[1]!r} stands behind a decimal one"
        )
        cure = "Separate columns by semicolons, or write decimals with a point."
        raise DataFileError(path, problem, cure)
