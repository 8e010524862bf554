"""From named cells to numbers that mean something: every column known, or none is read."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd

from data_io.goniometer.declarations import Declared
from data_io.goniometer.scan import STDERR, ConventionWarning
from data_io.goniometer.tables.names import (
    ANGLES,
    IGNORE,
    Meaning,
    meaning_of,
    target_of,
)
from data_io.goniometer.tables.table import RawTable
from data_io.goniometer.tables.text_columns import say_left_out
from data_io.goniometer.tables.unit_words import (
    declared_name,
    honoured,
    require_agreement,
    require_stderr_unit,
)
from data_io.goniometer.tables.units import bare_name
from data_io.goniometer.tables.unknown import COLUMNS_CURE, unknown_columns
from pbrdf.errors import DataFileError
from pbrdf.optics.published.columns import Column

__all__ = ["Columns", "read_columns"]


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
    left_out : str
        Names of columns of text.
    per_cent : mapping of str to str
        Values that the file writes in per cent, and what it calls them.
    """

    angles: Mapping[str, np.ndarray]
    values: Mapping[str, np.ndarray]
    wavelength: np.ndarray | None
    names: Mapping[str, str]
    lines: list[int]
    left_out: str = ""
    per_cent: Mapping[str, str] = field(default_factory=dict)


def read_columns(path: Path, table: RawTable, declared: Declared) -> Columns:
    """Return the numbers of a table by what they mean.

    Raises
    ------
    DataFileError
        Naming all columns that nobody knows, or those without a unit, at once.

    Warns
    -----
    ConventionWarning
        If a column of text is left out, a word marks a gap, or a column stands twice.
    """
    meanings, keys, text = _meanings(path, table, declared)
    angles: dict[str, pd.Series] = {}
    values: dict[str, dict[float | None, pd.Series]] = {}
    names: dict[str, str] = {}
    per_cent: dict[str, str] = {}
    first: dict[tuple[str, float | None], int] = {}
    waves = None
    read = [k for k, meaning in enumerate(meanings) if meaning.name != IGNORE]
    table.require_one_notation(path, read)
    for k, meaning in enumerate(meanings):
        if meaning.name == IGNORE:
            continue
        numbers = table.numbers(path, k)
        if numbers.hasnans:
            _say_gaps(path, table, k)
        key = meaning.name + (STDERR if meaning.stderr else "")
        if (key, meaning.wavelength) in first:
            _require_same(path, table, first[key, meaning.wavelength], k, key)
            continue
        first[key, meaning.wavelength] = k
        names[key] = keys[k]
        if key == "wavelength":
            waves = numbers / 1e3 if meaning.unit == "nm" else _to_um(numbers, meaning)
        elif key in ANGLES:
            angles[key] = numbers if meaning.unit == "deg" else np.degrees(numbers)
        else:
            scaled = numbers / 100.0 if meaning.unit == "%" else numbers
            if meaning.unit == "%":
                per_cent[key] = keys[k]
            values.setdefault(key, {})[meaning.wavelength] = scaled
    _require_full(path, table, angles, waves, names)
    long = _long(path, table, angles, values, waves, names)
    return replace(long, left_out=", ".join(text), per_cent=per_cent)


def _meanings(
    path: Path, table: RawTable, declared: Declared
) -> tuple[list[Meaning], list[str], list[str]]:
    """Return what each column holds, what to call it, and those of text.

    Refuse what nobody knows.
    """
    _check_mapping(path, table, declared)
    found: list[Meaning] = []
    keys: list[str] = []
    unknown, without_unit, text = [], [], []
    for k, name in enumerate(table.names):
        key = declared_name(name, declared.columns)
        keys.append(bare_name(name) if key is None else key)
        meaning = _meaning(path, table, k, key, declared)
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
        raise unknown_columns(path, table, unknown, without_unit)
    require_stderr_unit(path, table, found, keys)
    if text:
        say_left_out(path, table, text)
    return found, keys, text


def _meaning(
    path: Path, table: RawTable, column: int, key: str | None, declared: Declared
) -> Meaning | None:
    """Return what a column holds, by its mapping or its name, in one unit."""
    name = table.names[column]
    if key is not None:
        return honoured(path, table, name, key, declared)
    meaning = meaning_of(name)
    if meaning is not None or not table.is_text(column):
        known = meaning or meaning_of(bare_name(name))
        require_agreement(path, table, name, known, declared.angles)
    return meaning


def _say_gaps(path: Path, table: RawTable, column: int) -> None:
    """Say how many cells hold a word that means that nothing was measured."""
    marks = table.marks(column)
    if marks:
        words = ", ".join(map(repr, sorted(set(marks))[:5]))
        msg = (
            f"{path.name}: cells of {table.names[column]} with {words} count as not "
            f"measured: {len(marks)} of {len(table.lines)}."
        )
        warnings.warn(msg, ConventionWarning, stacklevel=6)


def _require_same(path: Path, table: RawTable, one: int, other: int, key: str) -> None:
    """Refuse two columns of one thing, but for one that stands twice."""
    first, second = (table.names[k] for k in (one, other))
    if table.numbers(path, one).equals(table.numbers(path, other)):
        msg = f"{path.name}: {first} and {second} hold the same numbers; one counts."
        warnings.warn(msg, ConventionWarning, stacklevel=6)
        return
    problem = f"expected one column of {key}, found {first} too"
    cure = f"Remove one, or leave it out: --columns {bare_name(second)}=ignore."
    if bare_name(first) == bare_name(second):
        cure = "Remove one, or give it a name of its own."
    raise DataFileError(path, problem, cure, line=table.header, column=second)


def _check_mapping(path: Path, table: RawTable, declared: Declared) -> None:
    """Refuse a mapping of columns that are not there, or to what nobody knows."""
    known = {declared_name(name, declared.columns) for name in table.names}
    absent = [name for name in declared.columns if name not in known]
    if absent:
        problem = (
            f"expected the columns {', '.join(map(repr, absent))} to rename, found none"
        )
        cure = f"The file has {', '.join(map(bare_name, table.names))}."
        raise DataFileError(path, problem, cure, line=table.header)
    wrong = [to for to in declared.columns.values() if target_of(to) is None]
    if wrong:
        problem = f"expected a known meaning, got {', '.join(map(repr, wrong))}"
        raise DataFileError(path, problem, f"{COLUMNS_CURE} Or: ignore.")


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
            got = "a gap" if np.isnan(numbers.iloc[row]) else "inf"
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
