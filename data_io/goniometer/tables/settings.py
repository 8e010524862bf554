"""Settings that remarks among the rows name, where no column does."""

import re
from collections.abc import Callable
from pathlib import Path

from data_io.goniometer.tables.columns import Columns
from data_io.goniometer.tables.table import RawTable
from data_io.text.text import Line
from pbrdf.errors import DataFileError, shortened

__all__ = ["require_one_setting"]

_WAVELENGTH = re.compile(r"(?<![\w.])(\d+(?:[.,]\d+)?)\s*(nm|um|µm)\b", re.IGNORECASE)
_POLARISED = re.compile(r"\b([sp])[\s-]*pol", re.IGNORECASE)
_AZIMUTH = re.compile(
    r"\b(?:phi_?i|sample[ _]?(?:azimuth|rotation)|rotation)\w*\s*[:=]?\s*"
    r"([-+]?\d+(?:[.,]\d+)?)", re.IGNORECASE,
)  # fmt: skip


def require_one_setting(path: Path, table: RawTable, columns: Columns) -> None:
    """Refuse remarks among the rows that give them several wavelengths, say.

    Raises
    ------
    DataFileError
        With the line of the second setting, and the column that would hold it.
    """
    turned = {"phi_i", "sample_rotation"} & columns.angles.keys()
    for what, column, pattern, known in (
        ("wavelength", "wavelength_nm", _WAVELENGTH, columns.wavelength is not None),
        ("polarisation", "I_s and one I_p", _POLARISED, False),
        ("azimuth of the sample", "sample_rotation_deg", _AZIMUTH, bool(turned)),
    ):
        if not known:
            _require_one(path, table, what, column, _first(pattern))


def _first(pattern: re.Pattern[str]) -> Callable[[str], str | None]:
    """Return what finds the first setting in a remark, in one spelling."""

    def found(text: str) -> str | None:
        match = pattern.search(text)
        return " ".join(match.groups()).lower() if match else None

    return found


def _require_one(
    path: Path,
    table: RawTable,
    what: str,
    column: str,
    setting: Callable[[str], str | None],
) -> None:
    """Refuse a second setting below the names."""
    said: dict[str, Line] = {}
    for line in sorted(table.among):
        value = setting(line.text)
        if value is not None:
            said.setdefault(value, line)
    if not said:
        return
    for text in table.comments:
        value = setting(text)
        if value is not None:
            said.setdefault(value, Line(table.header, text))
    if len(said) < 2:
        return
    below = [line for line in said.values() if line.number > table.header]
    text = shortened(below[-1].text.strip(), 50)
    problem = (
        f"expected one {what}, remarks among the rows name {', '.join(sorted(said))} "
        f"({text!r})"
    )
    cure = f"Give the rows a column {column}, or each setting a file."
    raise DataFileError(path, problem, cure, line=below[-1].number)
