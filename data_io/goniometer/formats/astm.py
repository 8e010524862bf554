"""Text files after ASTM E1392 and E2387: keywords, a line VARS of names, rows of numbers.

theta_i, phi_i and theta_s, phi_s are the directions of source and detector, in degrees, so
that dphi = phi_s - phi_i. NUM_POINTS announces the rows. Other keywords are remarks, of
which those on wavelength, quantity and polarisation count.
"""

import re
from dataclasses import replace
from pathlib import Path

from data_io.goniometer.declarations import Declared
from data_io.goniometer.scan import Scan
from data_io.goniometer.tables import own_csv
from data_io.goniometer.tables.names import ANGLES, meaning_of
from data_io.text.text import Line, is_number
from pbrdf.errors import DataFileError

# Names of what was read that do not say in which unit
_UNDECLARED = {"intensity", "power", "signal", "counts"}


NAME, TAKES = "astm", own_csv.TAKES


def looks_like(lines: list[Line]) -> bool:
    """Tell whether a line VARS names the columns."""
    return any(line.text.split()[:1] in (["VARS"], ["VARS="]) for line in lines[:200])


def read(path: Path, lines: list[Line], declared: Declared) -> Scan:
    """Read the rows under the line VARS."""
    content = [line for line in lines if line.text.strip()]
    at = next((k for k, line in enumerate(content) if looks_like([line])), None)
    if at is None:
        problem = "expected a line VARS with the names of the columns, found none"
        raise DataFileError(path, problem, "Leave format out, or restore the line.")
    words = re.split(r"[\s,;=]+", content[at].text.strip())[1:]
    names = [_name(path, content[at], word, declared) for word in words if word]
    rows = content[at + 1 :]
    strange = next((line for line in rows if not _is_row(line)), None)
    if strange is not None:
        problem = f"expected rows of numbers below VARS, got {strange.text.strip()[:40]!r}"
        raise DataFileError(path, problem, "The file is damaged.", line=strange.number)
    announced = _announced(path, content[:at])
    if announced is not None and announced != len(rows):
        problem = f"expected NUM_POINTS = {announced} rows, got {len(rows)}"
        raise DataFileError(path, problem, "The file is truncated or has extra rows.")
    header = Line(content[at].number, ",".join(names))
    table = [Line(r.number, ",".join(re.split(r"[\s,;]+", r.text.strip()))) for r in rows]
    said = [Line(line.number, f"# {line.text.strip()}") for line in content[:at]]
    scan = own_csv.read(path, [*said, header, *table], declared)
    title = next((c.text.strip()[6:] for c in content if c.text.startswith("TITLE ")), "")
    keywords = "\n".join(line.text.strip() for line in content[:at])
    own = {"format": "astm", "title": title.strip(), "comments": keywords}
    return replace(scan, attrs={**scan.attrs, **own})


def _name(path: Path, line: Line, word: str, declared: Declared) -> str:
    """Return the name of a variable with its unit."""
    if word.lower() in _UNDECLARED and word not in declared.columns:
        if declared.quantity is None:
            problem = f"expected a quantity with a unit, got {word!r}"
            cure = (
                "Give --quantity brdf, reflectance-factor, brdf-cos or relative: the file "
                "does not say which."
            )
            raise DataFileError(path, problem, cure, line=line.number, column=word)
        return "M00"
    meaning = meaning_of(word)
    if meaning is not None and meaning.name in ANGLES and meaning.unit is None:
        return f"{meaning.name}_deg"
    return word


def _is_row(line: Line) -> bool:
    cells = re.split(r"[\s,;]+", line.text.strip())
    return is_number(cells[0])


def _announced(path: Path, header: list[Line]) -> int | None:
    for line in header:
        found = re.match(r"NUM_POINTS\s*=?\s*(\S+)", line.text.strip())
        if found:
            if not found[1].isdigit():
                problem = f"expected a number of rows, got {found[1]!r}"
                cure = "The header is damaged."
                raise DataFileError(
                    path, problem, cure, line=line.number, column="NUM_POINTS"
                )
            return int(found[1])
    return None
