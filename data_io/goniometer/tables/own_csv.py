"""Tables with names of columns: the project's own CSV, and those of others."""

from collections.abc import Iterable, Mapping
from itertools import islice
from pathlib import Path

import numpy as np

from data_io.goniometer.declarations import Declared
from data_io.goniometer.remarks.quantity import stated_quantity
from data_io.goniometer.remarks.settings import with_settings
from data_io.goniometer.remarks.words import quantity_of
from data_io.goniometer.scan import ELEMENTS, INTENSITIES, STDERR, Scan
from data_io.goniometer.tables.angles import directions
from data_io.goniometer.tables.columns import Columns, read_columns
from data_io.goniometer.tables.counting import require_counted_from_zero
from data_io.goniometer.tables.names import POLARISERS, STOKES, meaning_of
from data_io.goniometer.tables.quantities import mueller_elements
from data_io.goniometer.tables.table import read_table
from data_io.goniometer.tables.unit_words import require_whole_of_per_cent
from data_io.goniometer.tables.writing import NOTES
from data_io.text.text import Line, content_of
from pbrdf.errors import DataFileError

# sin(theta_s) |sin(dphi)| of a reading that counts as in plane
_PLANE = 2e-3
# What four polarisers give
_BY_POLARISERS = ("M00", "M10", "M20")
# What gives an element, beside the column of its own name
_ALSO = {
    "M00": ("S0", "reflectance-factor", "brdf-cos"),
    **{f"M{k}0": (name,) for k, name in enumerate(STOKES) if k},
}


NAME = "csv"
TAKES = ("columns", "azimuth_of_forward", "angles", "normalised")


def looks_like(lines: list[Line]) -> bool:
    """Tell whether a line names a column that is known, or has separators."""
    content = list(islice(content_of(lines), 30))
    # Each word once: a line may hold a million cells that are alike
    words = {
        cell.strip().strip('"')
        for line in content
        for mark in (",", ";", "\t", "|", None)
        for cell in line.text.split(mark)
    }
    return any(meaning_of(word) for word in words if word) or any(
        mark in line.text for line in content[:2] for mark in ",;\t|"
    )


def read(path: Path, lines: list[Line], declared: Declared) -> Scan:
    """Read the rows of a table, in degrees and under the project's names."""
    table = read_table(path, lines)
    columns = with_settings(path, table, read_columns(path, table, declared), declared)
    theta_i, theta_s, dphi, phi_i, detector = directions(
        path, columns, declared, table.header
    )
    if not columns.values:
        problem = "expected this column, found none"
        cure = "Give any of M00..M33, m01..m33, DOLP, I_s, I_p, I0..I135, S0..S3."
        raise DataFileError(path, problem, cure, line=table.header, column="M00")
    head = table.header
    _require_one_source(path, columns, head)
    columns, said = stated_quantity(path, table, columns, declared)
    _require_all_errors(path, columns.values, head)
    values, quantity = mueller_elements(columns.values)
    if quantity is not None and said is None and declared.quantity is None:
        _require_one_quantity(path, columns, quantity, head)
    require_whole_of_per_cent(
        path,
        columns.values,
        columns.per_cent,
        declared.quantity or said or quantity or "brdf",
        head,
    )
    in_plane = np.sin(np.radians(theta_s)) * np.abs(np.sin(np.radians(dphi))) < _PLANE
    require_counted_from_zero(path, columns, in_plane, declared, table.comments, head)
    _require_four(path, values, table.header)
    _drop_unity(path, values, columns.lines)
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
        angles_declared=declared.angles is not None,
        names={
            **columns.names,
            "theta_s": columns.names[detector],
        },
        attrs={
            "format": "csv",
            "title": kept[0] if kept else "",
            "comments": "\n".join(kept),
            **_between_polarisers(columns),
            **_exchange(columns),
            **({"left_out": columns.left_out} if columns.left_out else {}),
        },
    )


def _require_one_source(path: Path, columns: Columns, line: int) -> None:
    """Refuse two columns that both give an element: one would replace the other."""
    for element, others in _ALSO.items():
        found = [name for name in (element, *others) if name in columns.values]
        if element in _BY_POLARISERS and set(POLARISERS) <= columns.values.keys():
            found.append("I0")
        if len(found) > 1:
            listed = ", ".join(columns.names.get(name, name) for name in found)
            problem = f"expected one source of {element}, got {listed}"
            cure = "Leave one out: --columns NAME=ignore."
            raise DataFileError(path, problem, cure, line=line)


def _require_one_quantity(path: Path, columns: Columns, quantity: str, line: int) -> None:
    """Refuse elements in 1/sr beside a column whose name says another quantity."""
    others = [name for name in columns.values if name in (*ELEMENTS, *INTENSITIES)]
    if others:
        name = columns.names.get(quantity, quantity)
        problem = (
            f"expected elements of one quantity, got {name} beside {', '.join(others)}"
        )
        cure = f"Where all are one, give --quantity {quantity}; ratios are m10, m20, ..."
        raise DataFileError(path, problem, cure, line=line)


def _between_polarisers(columns: Columns) -> dict[str, float]:
    """Compare I0 + I90 with I45 + I135, both all light: the middle relative difference."""
    if not set(POLARISERS) <= columns.values.keys():
        return {}
    light = columns.values
    one, other = light["I0"] + light["I90"], light["I45"] + light["I135"]
    with np.errstate(invalid="ignore", divide="ignore"):
        return {"polarisers_apart": float(np.nanmedian(2 * (other - one) / (one + other)))}


def _exchange(columns: Columns) -> dict[str, str]:
    """Return the mapping that exchanges light along s and p, errors with it."""
    if len(set(columns.lines)) < len(columns.lines):
        # Columns of single wavelengths
        return {}
    for one, other in (("I_s", "I_p"), ("I0", "I90")):
        if not {one, other} <= columns.values.keys():
            continue
        pairs = [
            f"{columns.names[name + end]}={to}{end}"
            for end in ("", STDERR)
            for name, to in ((one, other), (other, one))
            if name + end in columns.values
        ]
        return {"exchange_s_and_p": ",".join(pairs)}
    return {}


def _require_all_errors(path: Path, values: Mapping[str, np.ndarray], line: int) -> None:
    """Refuse standard errors of some of the four polarisers: no element has one then."""
    if not set(POLARISERS) <= values.keys():
        return
    stated = [name for name in POLARISERS if name + STDERR in values]
    lacking = [name + STDERR for name in POLARISERS if name not in stated]
    if stated and lacking:
        problem = (
            f"expected standard errors of all polarisers, found no {', '.join(lacking)}"
        )
        ignored = ",".join(f"{name}{STDERR}=ignore" for name in stated)
        cure = f"Give all four; or let the fit estimate the noise, --columns {ignored}."
        raise DataFileError(path, problem, cure, line=line)


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
        or quantity_of(text) is not None
    )
