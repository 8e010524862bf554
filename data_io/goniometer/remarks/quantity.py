"""The quantity that remarks state, beside the one that names and options state."""

import warnings
from dataclasses import replace
from pathlib import Path

from data_io.goniometer.declarations import QUANTITY_NAMES, Declared
from data_io.goniometer.remarks.words import Quantity, bare_quantity_of, quantity_of
from data_io.goniometer.scan import ELEMENTS, INTENSITIES, STDERR, ConventionWarning
from data_io.goniometer.tables.columns import Columns
from data_io.goniometer.tables.names import POLARISERS, STOKES
from data_io.goniometer.tables.table import RawTable
from data_io.goniometer.tables.units import bare_name
from pbrdf.errors import DataFileError, shortened

__all__ = ["stated_quantity"]

_BY_NAME = ("reflectance-factor", "brdf-cos")
_READINGS = {*ELEMENTS, *INTENSITIES, *STOKES, *POLARISERS, *_BY_NAME}
_NAMED_BRDF = {"brdf", "bsdf", "f_r", "fr"}


def stated_quantity(
    path: Path, table: RawTable, columns: Columns, declared: Declared
) -> tuple[Columns, str | None]:
    """Return the columns as fractions, and what a remark such as "quantity: brdf" says.

    Raises
    ------
    DataFileError
        If nobody knows the quantity, or remarks or a column's name say another.

    Warns
    -----
    ConventionWarning
        If ``--quantity`` overrules a remark.
    """
    said = [found for text in table.above if (found := quantity_of(text))]
    names = list(dict.fromkeys(quantity.name for quantity in said))
    wrong = [name for name in names if name not in QUANTITY_NAMES]
    option = declared.quantity
    if (wrong or len(names) > 1) and option is None:
        got = ", ".join(map(repr, wrong or names))
        problem = f"expected quantity: {' or '.join(QUANTITY_NAMES)}, got {got}"
        cure = "Mend the remark, or give --quantity."
        raise DataFileError(path, problem, cure)
    name = names[0] if len(names) == 1 and not wrong else None
    per_cent = any(quantity.per_cent for quantity in said)
    stated = None if name is None else Quantity(name, per_cent)
    _require_one_among(path, table, columns, stated, option)
    if option is None:
        _require_agreement(path, table, columns, name)
    elif name not in (None, option) and option != "relative":
        msg = f"{path.name}: --quantity {option} overrules the remark, which says {name}."
        warnings.warn(msg, ConventionWarning, stacklevel=4)
    if per_cent:
        columns = _fractions(columns)
    return columns, name


def _by_name(columns: Columns) -> str | None:
    """Return the quantity that the name of a column states."""
    return next((name for name in _BY_NAME if name in columns.values), None)


def _require_one_among(
    path: Path,
    table: RawTable,
    columns: Columns,
    stated: Quantity | None,
    option: str | None,
) -> None:
    """Refuse remarks among the rows that name another quantity than what all rows are."""
    of_all = stated
    if of_all is None and option is None:
        of_all = Quantity(_by_name(columns) or "brdf")
    for line in table.among:
        found = bare_quantity_of(line.text)
        of_all = of_all or found
        if found is None or of_all is None or found == of_all:
            continue
        text = shortened(line.text.strip(), 50)
        problem = (
            f"expected one quantity, {of_all.name}, a remark among the rows says {text!r}"
        )
        cure = (
            "Give each quantity a file; or, if all rows are one, remove the remarks among "
            f"them and write # quantity: {found.name} above the table."
        )
        raise DataFileError(path, problem, cure, line=line.number)


def _require_agreement(
    path: Path, table: RawTable, columns: Columns, name: str | None
) -> None:
    """Refuse a remark that the name or the unit of a column contradicts."""
    if name in (None, "relative"):
        return
    by_name = _by_name(columns)
    if by_name is None and name == "reflectance-factor" and "M00" in columns.values:
        of_m00 = [
            raw for raw in table.names if bare_name(raw) == columns.names.get("M00")
        ]  # fmt: skip
        in_sr = any("sr" in raw[len(bare_name(raw)) :] for raw in of_m00)
        by_name = "brdf" if in_sr or columns.names["M00"].lower() in _NAMED_BRDF else None
    if by_name not in (None, name):
        key = by_name if by_name in columns.values else "M00"
        problem = (
            f"expected one quantity, a remark says {name}, the column "
            f"{columns.names.get(key, key)} {by_name}"
        )
        cure = f"Mend the remark, or give --quantity {name} or --quantity {by_name}."
        raise DataFileError(path, problem, cure, line=table.header)


def _fractions(columns: Columns) -> Columns:
    """Divide readings by 100, unless their own names say per cent."""
    names = {
        key: columns.names.get(key, key)
        for key in columns.values
        if key.removesuffix(STDERR) in _READINGS and key not in columns.per_cent
    }
    scaled = {key: columns.values[key] / 100.0 for key in names}
    return replace(
        columns,
        values={**columns.values, **scaled},
        per_cent={**columns.per_cent, **names},
    )
