"""Units that a table writes against those that names and mappings give: none is lost."""

import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from data_io.goniometer.declarations import Declared
from data_io.goniometer.scan import RATIOS, STDERR, ConventionWarning
from data_io.goniometer.tables.names import ANGLES, IGNORE, Meaning, target_of
from data_io.goniometer.tables.table import RawTable
from data_io.goniometer.tables.units import (
    bare_name,
    is_logarithm,
    spectral_unit_behind,
    split_bracket,
    written_units,
)
from pbrdf.errors import DataFileError

__all__ = [
    "declared_name", "honoured", "require_agreement", "require_stderr_unit",
    "require_whole_of_per_cent",
]  # fmt: skip

_PER_CENT_CURE = (
    "Per cent of a reflectance factor, pi times the BRDF, is --quantity "
    "reflectance-factor; of a standard without a scale, --quantity relative"
)


# The coverage factor of an expanded uncertainty, but for k = 1
_EXPANDED = re.compile(r"(?<![A-Za-z])k ?= ?(?!1(?:\.0*)?(?![.\d]))\d[\d.]*")


def declared_name(name: str, columns: Mapping[str, str]) -> str | None:
    """Return the name under which a mapping knows a column, as it stands or without units.

    Examples
    --------
    >>> declared_name("u(BRDF) [1/sr]", {"u(BRDF)": "M00_stderr"})
    'u(BRDF)'
    """
    bare = bare_name(name)
    short = (split_bracket(bare) or (bare,))[0]
    return next((key for key in (name, bare, short) if key in columns), None)


def honoured(path: Path, table: RawTable, name: str, key: str, said: Declared) -> Meaning:
    """Return what a mapping makes of a column, in the unit that the file writes.

    Raises
    ------
    DataFileError
        If the file writes a unit, and the mapping names another or has none such.
    """
    target = said.columns[key]
    meaning = target_of(target) or Meaning(IGNORE)
    written = written_units(name)
    units = [unit for unit in written.units if unit != "1"]
    if meaning.name == "wavelength" and (behind := spectral_unit_behind(written.name)):
        units.append(behind)
    expanded = meaning.stderr and _EXPANDED.search(name)
    if expanded:
        problem = f"expected a standard error, got an expanded one, {expanded[0]}"
        cure = "Divide it by its coverage factor, and name the column without it."
        raise DataFileError(path, problem, cure, line=table.header, column=name)
    if meaning.name == IGNORE or not units:
        return meaning
    problem = f"expected {target}, as it is declared, the file writes {_listed(units)}"
    if meaning.name == "wavelength" or meaning.name in ANGLES:
        declares = said.angles is not None and meaning.name in ANGLES
        if declares or meaning.unit in units:
            return meaning
        cure = _unit_cure(key, meaning, units)
        raise DataFileError(path, problem, cure, line=table.header, column=name)
    require_agreement(path, table, name, meaning)
    if units == ["1/sr"]:
        return meaning
    log = is_logarithm(units[0])
    free = said.quantity == "relative" and meaning.name not in RATIOS and not log
    if units == ["%"] or free:
        return replace(meaning, unit=units[0])
    cure = (
        "Convert it to 1/sr, per cent or parts of 1 (what is no unit, take out of the "
        "header); readings without an absolute scale "
        f"are --columns {key}={target} with --quantity relative."
    )
    if meaning.name in RATIOS or log:
        cure = "Of logarithms write the numbers themselves." if log else (
            "Convert it to parts of 1 or per cent."
        )  # fmt: skip
    raise DataFileError(path, problem, cure, line=table.header, column=name)


def _unit_cure(key: str, meaning: Meaning, units: Sequence[str]) -> str:
    """Return the target with the unit that the file writes, where there is one."""
    name = meaning.name
    targets = [t for t in (f"{name}_{unit}" for unit in units) if target_of(t)]
    if not targets:
        return "That is no unit known here: convert the column."
    also = "; or --angles deg or rad for all" if name in ANGLES else ""
    return f"Give --columns {key}={targets[0]}, or mend the file{also}."


def require_agreement(
    path: Path,
    table: RawTable,
    name: str,
    meaning: Meaning | None,
    angles: str | None = None,
) -> None:
    """Refuse a column that has one unit in its name and another beside it.

    Raises
    ------
    DataFileError
        Naming both, and for angles and wavelengths how to choose.
    """
    if meaning is None or (meaning.name in ANGLES and angles is not None):
        return
    written = written_units(name)
    units = [unit for unit in written.units if unit != "1" or "%" in written.units]
    if len(units) < 2:
        return
    problem = f"expected one unit, the file writes {_listed(units)}"
    cure = "Mend the one that is wrong."
    targets = [
        target
        for unit in units
        if target_of(target := f"{meaning.name}_{unit}") is not None
    ]
    if targets and (meaning.name == "wavelength" or meaning.name in ANGLES):
        said = " or ".join(f"--columns {bare_name(name)}={target}" for target in targets)
        cure = f"Mend the one that is wrong, or give {said}."
    raise DataFileError(path, problem, cure, line=table.header, column=name)


def require_stderr_unit(
    path: Path, table: RawTable, meanings: Sequence[Meaning], keys: Sequence[str]
) -> None:
    """Refuse a standard error in another unit than its value, as per cent of it.

    Raises
    ------
    DataFileError
        Naming the column of the errors, and how to leave it out.
    """
    units = {(m.name, m.wavelength): m.unit for m in meanings if not m.stderr}
    for name, key, meaning in zip(table.names, keys, meanings, strict=True):
        value = meaning.name, meaning.wavelength
        if meaning.stderr and value in units and units[value] != meaning.unit:
            problem = f"expected a standard error in the unit of {meaning.name}"
            cure = (
                "A part of each reading is no unit: write the error itself, or leave the "
                f"column out (--columns {key}=ignore) and let the fit estimate the noise."
            )
            raise DataFileError(path, problem, cure, line=table.header, column=name)


def require_whole_of_per_cent(
    path: Path,
    values: Mapping[str, np.ndarray],
    per_cent: Mapping[str, str],
    quantity: str,
    line: int,
) -> None:
    """Refuse per cent of a BRDF, which has a unit; warn of errors in per cent.

    Parameters
    ----------
    path : Path
        The file.
    values : mapping of str to ndarray
        By the project's names.
    per_cent : mapping of str to str
        Those in per cent, and what the file calls them.
    quantity : str
        What elements and intensities are, one of `QUANTITY_NAMES`.
    line : int
        Of the names of the columns.
    """
    whole = [key for key in per_cent if key.removesuffix(STDERR) not in (*RATIOS, "m00")]
    if whole and quantity in ("brdf", "brdf-cos"):
        name = per_cent[whole[0]]
        problem = "expected a BRDF in 1/sr, the file writes %"
        cure = f"{_PER_CENT_CURE}."
        if whole[0][0] == "M" and whole[0][:3] != "M00":
            cure = f"{_PER_CENT_CURE}; of M00, --columns {name}={whole[0].lower()}."
        raise DataFileError(path, problem, cure, line=line, column=name)
    for key in whole:
        value = values.get(key.removesuffix(STDERR))
        if key.endswith(STDERR) and value is not None:
            with np.errstate(divide="ignore", invalid="ignore"):
                part = float(np.nanmedian(np.abs(values[key] / value)))
            msg = (
                f"{path.name}: {per_cent[key]} is taken in the per cent of "
                f"{per_cent[key.removesuffix(STDERR)]} itself, {100 * part:.3g} % of the "
                "middle reading. Where it is per cent of each reading, write the error "
                f"itself, or give --columns {per_cent[key]}=ignore."
            )
            warnings.warn(msg, ConventionWarning, stacklevel=5)


def _listed(units: Sequence[str]) -> str:
    return " and ".join(f"[{unit}]" for unit in units)
