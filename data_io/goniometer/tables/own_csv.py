"""Tables with names of columns: the project's own CSV, and those of others."""

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from data_io.goniometer.declarations import QUANTITY_NAMES, Declared
from data_io.goniometer.scan import STDERR, Scan
from data_io.goniometer.tables.angles import directions
from data_io.goniometer.tables.columns import read_columns
from data_io.goniometer.tables.counting import require_counted_from_zero
from data_io.goniometer.tables.names import meaning_of
from data_io.goniometer.tables.quantities import mueller_elements
from data_io.goniometer.tables.table import read_table
from data_io.goniometer.tables.writing import NOTES
from data_io.text.text import Line, without_comments
from pbrdf.errors import DataFileError

_QUANTITY = re.compile(r"quantity\s*[:=]\s*(\S+)")


NAME = "csv"
TAKES = ("columns", "azimuth_of_forward", "angles", "normalised")


def looks_like(lines: list[Line]) -> bool:
    """Tell whether a line names a column that is known, or has separators."""
    content = without_comments(lines)
    # Each word once: a line may hold a million cells that are alike
    words = {
        cell.strip().strip('"')
        for line in content[:30]
        for mark in (",", ";", "\t", "|", None)
        for cell in line.text.split(mark)
    }
    return any(meaning_of(word) for word in words if word) or any(
        mark in line.text for line in content[:2] for mark in ",;\t|"
    )


def read(path: Path, lines: list[Line], declared: Declared) -> Scan:
    """Read the rows of a table, in degrees and under the project's names."""
    table = read_table(path, lines)
    columns = read_columns(path, table, declared)
    theta_i, theta_s, dphi, phi_i, detector = directions(
        path, columns, declared, table.header
    )
    if not columns.values:
        problem = "expected this column, found none"
        cure = "Give any of M00..M33, m01..m33, DOLP, I_s, I_p, I0..I135, S0..S3."
        raise DataFileError(path, problem, cure, line=table.header, column="M00")
    values, quantity = mueller_elements(columns.values)
    head = table.header
    require_counted_from_zero(path, columns, values, declared, table.comments, head)
    _require_four(path, values, table.header)
    _drop_unity(path, values, columns.lines)
    said = _quantity(path, table.comments)
    # The notes that are written into every file need not pile up
    kept = [text for text in table.comments if text and not _noted(text)]
    return Scan(
        path=path,
        lines=columns.lines,
        theta_i=theta_i,
        theta_s=theta_s,
        dphi=dphi,
        values=values,
        wavelength=columns.wavelength,
        phi_i=phi_i,
        source_half_angle=columns.angles.get("source_half_angle"),
        detector_half_angle=columns.angles.get("detector_half_angle"),
        quantity=said or quantity or "brdf",
        declares_quantity=said is not None or quantity is not None,
        names={
            **columns.names,
            "theta_s": columns.names[detector],
        },
        attrs={
            "format": "csv",
            "title": kept[0] if kept else "",
            "comments": "\n".join(kept),
        },
    )


def _require_four(path: Path, values: Iterable[str], line: int) -> None:
    """Refuse polarisers at 45 degrees without all others."""
    left = [name for name in values if name.removesuffix(STDERR) in ("I45", "I135")]
    if left:
        problem = f"expected I0, I45, I90 and I135 together, got {', '.join(left)}"
        raise DataFileError(path, problem, "Give all four, or I_s and I_p.", line=line)


def _drop_unity(path: Path, values: dict[str, np.ndarray], lines: list[int]) -> None:
    """Take out m00, which is 1 wherever it is what it says."""
    unity = values.pop("m00", None)
    values.pop("m00" + STDERR, None)
    if unity is None:
        return
    wrong = np.abs(unity - 1.0) > 1e-6
    if wrong.any():
        row = int(np.argmax(wrong))
        problem = f"expected M00 divided by itself, 1, got {unity[row]:.6g}"
        cure = "In 1/sr its name is M00: --columns m00=M00."
        raise DataFileError(path, problem, cure, line=lines[row], column="m00")


def _noted(text: str) -> bool:
    """Tell whether a comment is one that is written, now or in earlier versions."""
    return (
        text in NOTES
        or text.startswith(("Angles in rad, dphi", "M in 1/sr without"))
        or _QUANTITY.fullmatch(text) is not None
    )


def _quantity(path: Path, comments: list[str]) -> str | None:
    """Return what a comment such as "quantity: relative" declares."""
    found = [match[1] for text in comments if (match := _QUANTITY.fullmatch(text))]
    if found and found[0] not in QUANTITY_NAMES:
        problem = f"expected quantity: {' or '.join(QUANTITY_NAMES)}, got {found[0]!r}"
        raise DataFileError(path, problem, "Mend the comment.")
    return found[0] if found else None
