"""From named cells to numbers that mean something: every column known, or none is read."""

import difflib
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from data_io.goniometer.declarations import Declared
from data_io.goniometer.scan import STDERR, ConventionWarning
from data_io.goniometer.tables.names import (
    ANGLES,
    IGNORE,
    TARGETS,
    Meaning,
    meaning_of,
    target_of,
)
from data_io.goniometer.tables.table import RawTable
from pbrdf.errors import DataFileError, shortened
from pbrdf.optics.published.columns import Column

__all__ = ["Columns", "read_columns"]

_COLUMNS_CURE = (
    "Known: theta_i_deg; theta_view_deg, or theta_s_deg with dphi_deg, or phi_s_deg with "
    "phi_i_deg; M00..M33, m01..m33 (divided by M00), DOLP, I_s, I_p, I0..I135, S0..S3; "
    "<name>_stderr; wavelength_um, wavelength_nm; sample_rotation_deg, "
    "source_half_angle_deg, detector_half_angle_deg."
)
# Where a slip of the pen is told from another quantity by the name alone: not an azimuth,
# and not a value, of which f_s is no f_ss
_SUGGESTED = tuple(t for t in TARGETS if t.startswith(("theta", "wavelength", "sample")))
_ERROR_WORDS = re.compile(
    r"^u\((.+)\)$|^(.*?)[\s_-]*(?:err|error|unc|uncertainty|sigma|std)$"
)
_FROM_ONE = re.compile(r"^m(?:4[1-4]|[1-3]4|[1-4]{2}/m11)$", re.IGNORECASE)


@dataclass(frozen=True)
class Columns:
    """Numbers by meaning, one row a geometry and wavelength.

    Attributes
    ----------
    angles : mapping of str to ndarray
        Those of `names.ANGLES` that the table has. [deg]
    values : mapping of str to ndarray
        Values and ``<name>_stderr`` by the project's names, as in the file.
    wavelength : ndarray or None
        [um]
    names : mapping of str to str
        What the file calls them.
    lines : list of int
        Line of each row.
    """

    angles: Mapping[str, np.ndarray]
    values: Mapping[str, np.ndarray]
    wavelength: np.ndarray | None
    names: Mapping[str, str]
    lines: list[int]


def read_columns(path: Path, table: RawTable, declared: Declared) -> Columns:
    """Return the numbers of a table by what they mean.

    Raises
    ------
    DataFileError
        Naming all columns that nobody knows, or those without a unit, at once.

    Warns
    -----
    ConventionWarning
        If a column of text is left out.
    """
    meanings = _meanings(path, table, declared)
    angles: dict[str, pd.Series] = {}
    values: dict[str, dict[float | None, pd.Series]] = {}
    names: dict[str, str] = {}
    waves = None
    for k, meaning in enumerate(meanings):
        if meaning.name == IGNORE:
            continue
        numbers = table.numbers(path, k)
        key = meaning.name + (STDERR if meaning.stderr else "")
        taken = key in angles or meaning.wavelength in values.get(key, {})
        if taken or (key == "wavelength" and waves is not None):
            problem = f"expected one column of {key}, found {names[key]} too"
            cure = f"Remove one, or leave it out: --columns {table.names[k]}=ignore."
            raise DataFileError(
                path, problem, cure, line=table.header, column=table.names[k]
            )
        names[key] = _without_unit_row(table.names[k])
        if key == "wavelength":
            waves = numbers / 1e3 if meaning.unit == "nm" else _to_um(numbers, meaning)
        elif key in ANGLES:
            angles[key] = numbers if meaning.unit == "deg" else np.degrees(numbers)
        else:
            scaled = numbers / 100.0 if meaning.unit == "%" else numbers
            values.setdefault(key, {})[meaning.wavelength] = scaled
    _require_full(path, table, angles, waves, names)
    return _long(path, table, angles, values, waves, names)


def _meanings(path: Path, table: RawTable, declared: Declared) -> list[Meaning]:
    """Return what each column holds; refuse what nobody knows, all names at once."""
    _check_mapping(path, table, declared)
    found: list[Meaning] = []
    unknown, without_unit, text = [], [], []
    for k, (raw, name) in enumerate(zip(_raw_names(table), table.names, strict=True)):
        if raw in declared.columns:
            meaning = target_of(declared.columns[raw])
        else:
            meaning = meaning_of(name)
            if meaning is None and table.is_text(k):
                text.append(name)
                meaning = Meaning(IGNORE)
        if meaning is None:
            unknown.append(name)
        elif meaning.name in ANGLES and (declared.angles or meaning.unit is None):
            if declared.angles is None:
                without_unit.append(name)
            meaning = replace(meaning, unit=declared.angles)
        found.append(meaning or Meaning(IGNORE))
    if unknown or without_unit:
        raise _unknown(path, table, unknown, without_unit)
    _require_one_unit(path, table, found)
    if text:
        msg = (
            f"{path.name}: columns of text are left out: {shortened(', '.join(text), 200)}."
        )
        warnings.warn(msg, ConventionWarning, stacklevel=5)
    return found


def _require_one_unit(path: Path, table: RawTable, meanings: list[Meaning]) -> None:
    """Refuse a standard error in per cent of what is not, or the other way round."""
    units = {(m.name, m.wavelength): m.unit for m in meanings if not m.stderr}
    for name, meaning in zip(table.names, meanings, strict=True):
        key = meaning.name, meaning.wavelength
        if not meaning.stderr or "%" not in (meaning.unit, units.get(key)):
            continue
        if key in units and units[key] != meaning.unit:
            problem = f"expected a standard error in the unit of {meaning.name}"
            cure = (
                "A part of each reading is no unit: write the error itself, or leave the "
                f"column out (--columns {_without_unit_row(name)}=ignore) and let the fit "
                "estimate the noise."
            )
            raise DataFileError(path, problem, cure, line=table.header, column=name)


def _check_mapping(path: Path, table: RawTable, declared: Declared) -> None:
    """Refuse a mapping of columns that are not there, or to what nobody knows."""
    absent = [name for name in declared.columns if name not in _raw_names(table)]
    if absent:
        problem = (
            f"expected the columns {', '.join(map(repr, absent))} to rename, found none"
        )
        cure = f"The file has {', '.join(_raw_names(table))}."
        raise DataFileError(path, problem, cure, line=table.header)
    wrong = [to for to in declared.columns.values() if target_of(to) is None]
    if wrong:
        problem = f"expected a known meaning, got {', '.join(map(repr, wrong))}"
        raise DataFileError(path, problem, f"{_COLUMNS_CURE} Or: ignore.")


def _raw_names(table: RawTable) -> list[str]:
    return [_without_unit_row(name) for name in table.names]


def _without_unit_row(name: str) -> str:
    return re.sub(r"\s*[\[(][^\[\]()]*[\])]$", "", name) or name


def _unknown(
    path: Path, table: RawTable, unknown: list[str], without_unit: list[str]
) -> DataFileError:
    """Return the error that names every column without a meaning or a unit."""
    if "n" in map(str.lower, unknown) and not without_unit:
        problem = f"expected a scan, got columns {', '.join(map(repr, unknown))}"
        cure = "Optical constants are given by --material-file, material_file= or file =."
        raise DataFileError(path, problem, cure, line=table.header)
    said = []
    if unknown:
        said.append(f"expected known columns, got {', '.join(map(repr, unknown))}")
    if without_unit:
        listed = ", ".join(map(repr, without_unit))
        said.append(f"expected the unit of the angles {listed}, found none")
    pairs, cures = [], []
    for name in (*unknown, *without_unit):
        meaning = meaning_of(name)
        if meaning is not None:
            pairs.append(f"{name}={meaning.name}_deg")
        else:
            pairs += [f"{name}={target}" for target in _close_to(name)]
    if any(map(_FROM_ONE.match, unknown)):
        cures.append("Elements are counted from 0 here: --columns M11=M00,M12=M01,...")
    if pairs:
        hints = ", ".join(pair.partition("=")[2] for pair in pairs)
        cures.append(f"Did you mean {hints}? Then give --columns {','.join(pairs)}.")
    elif not cures:
        cures.append("Say what they hold by --columns NAME=theta_i_deg, or NAME=ignore.")
    if without_unit:
        cures.append("Or give --angles deg or rad for all.")
    return DataFileError(
        path, "; ".join(said), " ".join([*cures, _COLUMNS_CURE]), line=table.header
    )


def _close_to(name: str) -> list[str]:
    """Return the target that a name most likely means, or nothing."""
    spelled = {_letters(target): target for target in TARGETS}
    if _letters(name) in spelled:
        return [spelled[_letters(name)]]
    error = _ERROR_WORDS.match(name.lower())
    if error:
        value = meaning_of(error[1] or error[2] or "M00")
        return (
            [f"{value.name}{STDERR}"]
            if value and f"{value.name}{STDERR}" in TARGETS
            else []
        )
    return difflib.get_close_matches(name, _SUGGESTED, n=1, cutoff=0.8)


def _letters(name: str) -> str:
    # M10 and m10 differ by their case alone
    return re.sub(r"[^A-Za-z0-9]", "", name)


def _to_um(numbers: pd.Series, meaning: Meaning) -> pd.Series:
    unit = Column("wavelength", "wavelength", meaning.unit)
    return pd.Series(unit.to_um(numbers.tolist()), index=numbers.index)


def _require_full(
    path: Path,
    table: RawTable,
    angles: Mapping[str, pd.Series],
    waves: pd.Series | None,
    names: Mapping[str, str],
) -> None:
    """Refuse gaps where every row needs a number."""
    full = dict(angles) | ({} if waves is None else {"wavelength": waves})
    for key, numbers in full.items():
        gaps = ~np.isfinite(numbers.to_numpy())
        if gaps.any():
            row = int(gaps.argmax())
            got = "an empty cell or nan" if np.isnan(numbers.iloc[row]) else "inf"
            problem = f"expected a number in every row, got {got}"
            cure = "Only measured values may be left empty."
            raise DataFileError(
                path, problem, cure, line=table.lines[row], column=names[key]
            )


def _long(
    path: Path,
    table: RawTable,
    angles: Mapping[str, pd.Series],
    values: Mapping[str, Mapping[float | None, pd.Series]],
    waves: pd.Series | None,
    names: Mapping[str, str],
) -> Columns:
    """Stack the columns of single wavelengths below one another."""
    single = {wave for by_wave in values.values() for wave in by_wave if wave is not None}
    if not single:
        plain = {key: by_wave[None]
                 for key, by_wave in values.items()}  # fmt: skip
        return Columns(
            {key: numbers.to_numpy() for key, numbers in angles.items()},
            {key: numbers.to_numpy() for key, numbers in plain.items()},
            None if waves is None else waves.to_numpy(),
            names,
            table.lines,
        )
    mixed = [key for key, by_wave in values.items() if set(by_wave) - single]
    if waves is not None or mixed:
        what = names["wavelength"] if waves is not None else names[mixed[0]]
        problem = f"expected the wavelength in every column's name or in none, got {what}"
        cure = "Give one column a wavelength (M00_450nm), or a column wavelength_nm."
        raise DataFileError(path, problem, cure, line=table.header)
    frame = pd.DataFrame({**angles, "line": table.lines})
    parts = [
        frame.assign(
            wavelength=wave,
            **{key: by.get(wave, np.nan) for key, by in values.items()},
        )
        for wave in sorted(single)
    ]
    long = pd.concat(parts).sort_values(["line", "wavelength"], kind="stable")
    return Columns(
        {key: long[key].to_numpy() for key in angles},
        {key: long[key].to_numpy() for key in values},
        long["wavelength"].to_numpy(),
        names,
        long["line"].tolist(),
    )
