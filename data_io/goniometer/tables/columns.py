"""From named cells to numbers that mean something: every column known, or none is read."""

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
    Meaning,
    bare_name,
    meaning_of,
    target_of,
)
from data_io.goniometer.tables.table import RawTable
from data_io.goniometer.tables.text_columns import say_left_out
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
    """

    angles: Mapping[str, np.ndarray]
    values: Mapping[str, np.ndarray]
    wavelength: np.ndarray | None
    names: Mapping[str, str]
    lines: list[int]
    left_out: str = ""


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
    meanings, text = _meanings(path, table, declared)
    angles: dict[str, pd.Series] = {}
    values: dict[str, dict[float | None, pd.Series]] = {}
    names: dict[str, str] = {}
    first: dict[tuple[str, float | None], int] = {}
    waves = None
    read = [k for k, meaning in enumerate(meanings) if meaning.name != IGNORE]
    table.require_one_notation(path, read)
    for k, meaning in enumerate(meanings):
        if meaning.name == IGNORE:
            continue
        numbers = table.numbers(path, k)
        _say_gaps(path, table, k)
        key = meaning.name + (STDERR if meaning.stderr else "")
        if (key, meaning.wavelength) in first:
            _require_same(path, table, first[key, meaning.wavelength], k, key)
            continue
        first[key, meaning.wavelength] = k
        names[key] = bare_name(table.names[k])
        if key == "wavelength":
            waves = numbers / 1e3 if meaning.unit == "nm" else _to_um(numbers, meaning)
        elif key in ANGLES:
            angles[key] = numbers if meaning.unit == "deg" else np.degrees(numbers)
        else:
            scaled = numbers / 100.0 if meaning.unit == "%" else numbers
            values.setdefault(key, {})[meaning.wavelength] = scaled
    _require_full(path, table, angles, waves, names)
    long = _long(path, table, angles, values, waves, names)
    return replace(long, left_out=", ".join(text))


def _meanings(
    path: Path, table: RawTable, declared: Declared
) -> tuple[list[Meaning], list[str]]:
    """Return what each column holds, and those of text; refuse what nobody knows."""
    _check_mapping(path, table, declared)
    found: list[Meaning] = []
    unknown, without_unit, text = [], [], []
    for k, (raw, name) in enumerate(zip(table.bare_names, table.names, strict=True)):
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
        raise unknown_columns(path, table, unknown, without_unit)
    _require_one_unit(path, table, found)
    if text:
        say_left_out(path, table, text)
    return found, text


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
                f"column out (--columns {bare_name(name)}=ignore) and let the fit "
                "estimate the noise."
            )
            raise DataFileError(path, problem, cure, line=table.header, column=name)


def _check_mapping(path: Path, table: RawTable, declared: Declared) -> None:
    """Refuse a mapping of columns that are not there, or to what nobody knows."""
    absent = [name for name in declared.columns if name not in table.bare_names]
    if absent:
        problem = (
            f"expected the columns {', '.join(map(repr, absent))} to rename, found none"
        )
        cure = f"The file has {', '.join(table.bare_names)}."
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
