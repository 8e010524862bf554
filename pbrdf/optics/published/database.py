"""YAML files of the refractiveindex.info database."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.errors import DataFileError
from pbrdf.optics.dispersion import Dispersion, Table
from pbrdf.optics.published.formulas import Formula

__all__ = ["read_database_entry"]

_TABLES = {
    "tabulated nk": ("n", "kappa"),
    "tabulated n": ("n",),
    "tabulated k": ("kappa",),
}
# Far beyond any entry: characters, levels and parts
_LARGEST, _DEEPEST, _MOST_PARTS = 8_000_000, 20, 100_000
# Signs of a word; 1:1:1... is a number to base 60, read in a time that grows by the square
_LONGEST = 1000
_FORMULA = re.compile(r"formula\s+(\d+)")
_SPACE = re.compile(r"\s")
_TAG = re.compile(r"<[^<>]*>")


def read_database_entry(path: Path, text: str) -> tuple[dict[str, Dispersion], str | None]:
    """Return n, kappa by name, and the source of an entry. Wavelengths are micrometres.

    Raises
    ------
    DataFileError
        If it has a constant twice, or a table or formula is damaged.
    """
    entry = _parse(path, text)
    data = entry.get("DATA")
    if not isinstance(data, list) or not data:
        problem = "expected a list DATA of tables and formulas, got none"
        raise DataFileError(path, problem, "Pass a file of the database's folder data.")
    constants: dict[str, Dispersion] = {}
    for part in data:
        for name, constant in _constants(path, part).items():
            if name in constants:
                problem = f"expected {name} once, got it twice"
                raise DataFileError(path, problem, "Keep one of the tables or formulas.")
            constants[name] = constant
    references = entry.get("REFERENCES")
    source = None
    if isinstance(references, str):
        source = " ".join(_TAG.sub("", references).split())
    return constants, source


def _parse(path: Path, text: str) -> dict[str, Any]:
    # Only who reads such a file pays for the parser
    import yaml

    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    if len(text) > _LARGEST:
        problem = f"expected at most {_LARGEST // 10**6} MB, got more"
        raise DataFileError(path, problem, "Pass an entry of the database.")
    try:
        _check_events(path, yaml.parse(text, Loader=loader))
        entry = yaml.load(text, Loader=loader)
    except DataFileError:
        raise
    except (yaml.YAMLError, RecursionError, ValueError, AttributeError) as error:
        # Its tags fail so of texts that are no dates
        problem = f"is not valid YAML: {' '.join(str(error).split())[:120]}"
        raise DataFileError(path, problem, "Download the entry again.") from error
    if not isinstance(entry, dict):
        problem = "expected an entry of the refractiveindex.info database"
        raise DataFileError(path, problem, "It has the keys REFERENCES and DATA.")
    return entry


def _check_events(path: Path, events: Iterable[Any]) -> None:
    """Refuse what can take for ever to build: references, depth, tags, endless words."""
    import yaml

    depth = count = 0
    for event in events:
        count += 1
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if isinstance(event, yaml.AliasEvent):
            problem = "refers to another part of itself (an alias), as no entry does"
        elif depth > _DEEPEST or count > _MOST_PARTS:
            problem = "nests too deeply" if depth > _DEEPEST else "has too many parts"
        elif getattr(event, "tag", None):
            problem = f"has a tag, {event.tag[:60]}, as no entry does"
        elif len(getattr(event, "value", "")) > _LONGEST and not _SPACE.search(event.value):
            problem = f"has a word of {len(event.value)} signs"
        else:
            continue
        raise DataFileError(path, problem, "Download the entry again.")


def _constants(path: Path, part: Any) -> dict[str, Dispersion]:
    """Return n or kappa of one element of DATA."""
    kind = str(part.get("type", "")).strip() if isinstance(part, dict) else ""
    formula = _FORMULA.fullmatch(kind)
    if formula:
        limits = _numbers(
            path, part, "wavelength_range" if "wavelength_range" in part else "range"
        )
        coefficients = _numbers(path, part, "coefficients")
        if len(limits) != 2 or not coefficients:
            problem = f"expected two limits and coefficients of {kind}, got {len(limits)}"
            raise DataFileError(path, problem, "Download the entry again.")
        try:
            law = Formula(int(formula[1]), tuple(coefficients), (limits[0], limits[1]))
        except (ValueError, OverflowError) as error:
            raise DataFileError(path, str(error).rstrip("."), "Mend the file.") from error
        return {"n": law}
    if kind not in _TABLES:
        known = ", ".join([*_TABLES, "formula 1 to 9"])
        problem = f"expected a known type, got {kind!r}"
        raise DataFileError(path, problem, f"Known: {known}.", column="type")
    names = _TABLES[kind]
    rows = [line.split() for line in str(part.get("data", "")).splitlines() if line.strip()]
    try:
        table = np.array(rows, dtype=np.float64).reshape(len(rows), -1)
    except ValueError as error:
        problem = f"expected rows of {len(names) + 1} numbers under {kind}"
        raise DataFileError(path, problem, "Download the entry again.") from error
    if not len(rows) or table.shape[1] != len(names) + 1:
        problem = (
            f"expected rows of {len(names) + 1} numbers under {kind}, got {len(rows)} rows"
        )
        raise DataFileError(path, problem, "Download the entry again.")
    table = table[np.argsort(table[:, 0], kind="stable")]
    try:
        return {
            name: Table.of(name, table[:, 0], table[:, k])
            for k, name in enumerate(names, start=1)
        }
    except ValueError as error:
        raise DataFileError(path, str(error).rstrip("."), "Mend the table.") from error


def _numbers(path: Path, part: dict[str, Any], key: str) -> list[float]:
    """Return the numbers of a key, which YAML may have read as one."""
    value = part.get(key)
    words = value if isinstance(value, list) else str(value).split()
    try:
        return [float(word) for word in words]
    except (TypeError, ValueError):
        problem = f"expected numbers, got {str(value)[:40]!r}"
        raise DataFileError(
            path, problem, "Download the entry again.", column=key
        ) from None
