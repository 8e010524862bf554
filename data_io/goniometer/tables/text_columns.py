"""Columns of text beside the numbers: remarks, or what tells rows apart."""

import re
import warnings
from collections.abc import Sequence
from pathlib import Path

from data_io.goniometer.remarks.words import POLARISATIONS, UNPOLARISED
from data_io.goniometer.scan import ConventionWarning
from data_io.goniometer.tables.table import RawTable
from data_io.goniometer.tables.units import bare_name
from data_io.text.gaps import is_gap
from pbrdf.errors import DataFileError, shortened

__all__ = ["say_left_out"]

# What says of each reading whether it counts
_MARKS = re.compile(
    r"flag|qualit|valid|saturat|status|mask|reject|outlier|discard|overload", re.IGNORECASE
)
# Remarks are many or alike; a few words that come again tell rows apart
_SHOWN = 4


def say_left_out(path: Path, table: RawTable, names: Sequence[str]) -> None:
    """Warn that columns of text are left out, with what they say.

    Raises
    ------
    DataFileError
        If one holds the polarisation of each row, which no element is free of, or marks
        readings as good or bad.

    Warns
    -----
    ConventionWarning
        With the words of each column.
    """
    said = []
    for name in names:
        text = table.cells.iloc[:, table.names.index(name)]
        words = list(dict.fromkeys(cell for cell in text if cell))
        _refuse_polarisation(path, table, name, [w for w in words if not is_gap(w)])
        _refuse_marks(path, table, name, text.tolist())
        listed = ", ".join(repr(shortened(word, 20)) for word in words[:_SHOWN])
        more = f" and {len(words) - _SHOWN} more" if len(words) > _SHOWN else ""
        said.append(f"{name} ({listed}{more})")
    msg = f"{path.name}: columns of text are left out: {shortened(', '.join(said), 240)}."
    warnings.warn(msg, ConventionWarning, stacklevel=6)


def _refuse_marks(path: Path, table: RawTable, name: str, text: Sequence[str]) -> None:
    """Refuse a column that tells good readings from bad ones: nobody obeys it here."""
    words = list(dict.fromkeys(text))
    if len(words) < 2 or not _MARKS.search(name):
        return
    row = next(k for k, word in enumerate(text) if word != text[0])
    problem = f"expected readings that all count, got {words[0]!r} and {words[1]!r}"
    cure = (
        "Empty the cells of readings that do not count; or, if all do, --columns "
        f"{bare_name(name)}=ignore."
    )
    raise DataFileError(path, problem, cure, line=table.lines[row], column=name)


def _refuse_polarisation(
    path: Path, table: RawTable, name: str, words: Sequence[str]
) -> None:
    """Refuse rows of single polarisations, which are read from columns."""
    plain = [word.lower() for word in words]
    known = [word for word in plain if word in POLARISATIONS]
    named = "pol" in name.lower()
    all_known = all(word in POLARISATIONS or word in UNPOLARISED for word in plain)
    if not known or not (named or all_known):
        if not named or all(word in UNPOLARISED for word in plain):
            return
        known = plain
    bare = bare_name(name)
    problem = f"expected no polarisation by rows, got {', '.join(map(repr, words[:6]))}"
    cure = (
        "Give each polarisation a column of its own, I_s and I_p (or f_ss, f_sp, f_ps, "
        f"f_pp); --columns {bare}=ignore if the rows do not differ by it."
    )
    one = {POLARISATIONS.get(word, "") for word in known}
    if len(words) == 1 and one and len(letter := one.pop()) == 1:
        cure = (
            f"The readings are light of one polarisation: --columns NAME=I_{letter},"
            f"{bare}=ignore."
        )
    raise DataFileError(path, problem, cure, line=table.header, column=name)
