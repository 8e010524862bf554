"""Elements of the Mueller matrix counted from 1, where others begin at M11."""

import re
from collections.abc import Collection, Mapping
from pathlib import Path

from data_io.goniometer.declarations import Declared
from data_io.goniometer.tables.columns import Columns
from data_io.goniometer.tables.writing import NOTES
from pbrdf.errors import DataFileError

__all__ = ["require_counted_from_zero"]

_ELEMENT = re.compile(r"^([Mm])([0-4])([0-4])")
_INTENSITY = {"M00", "I_s", "I_p"}


def require_counted_from_zero(
    path: Path,
    columns: Columns,
    values: Collection[str],
    declared: Declared,
    comments: Collection[str],
    line: int,
) -> None:
    """Refuse elements whose first index may be 1.

    From 0, M11 alone tells little; from 1 it is the reflectance, the first that anybody
    measures. Nothing in the numbers tells the two apart. Files of this package count from
    0, and a column that `--columns` names means what it is named.

    Raises
    ------
    DataFileError
        If M11 is there, or elements divided by M00 alone, no element has an index 0 and
        nothing else holds the reflectance; or if `--columns` gives some elements another
        number and not others.
    """
    if any(text in NOTES for text in comments):
        return
    left = {
        key: columns.names[key]
        for key in columns.values
        if _ELEMENT.match(key) and columns.names[key] not in declared.columns
    }
    moved = [
        f"{name}={to}"
        for name, to in declared.columns.items()
        if (old := _ELEMENT.match(name))
        and (new := _ELEMENT.match(to))
        and old.groups()[1:] != new.groups()[1:]
    ]
    if moved and left:
        problem = (
            f"expected all elements to be counted alike, got {', '.join(moved)} by "
            f"--columns, but nothing of {', '.join(left.values())}"
        )
        raise DataFileError(path, problem, _cure(left), line=line)
    # M11/M00 says itself that there is an M00
    counted = [key for key, name in left.items() if "0" in key[1:3] or "00" in name]
    ratios = bool(left) and all(key.startswith("m") for key in left)
    if counted or _INTENSITY & set(values) or not ("M11" in left or ratios):
        return
    example = (
        "m12 is M01/M00" if ratios and "m11" not in left else "M11 is the reflectance M00"
    )
    problem = (
        f"expected M00 or another element with an index 0, got {', '.join(left.values())}: "
        f"counted from 1, {example}"
    )
    raise DataFileError(path, problem, _cure(left), line=line)


def _cure(left: Mapping[str, str]) -> str:
    """Return how to say that elements are counted from 1, or from 0."""
    from_one = [
        f"{name}={key[0]}{int(key[1]) - 1}{int(key[2]) - 1}{key[3:]}"
        for key, name in left.items()
        if "0" not in key[1:3]
    ]
    from_zero = [f"{name}={key}" for key, name in left.items()]
    first = f"Counted from 1: --columns {','.join(from_one)}. " if from_one else ""
    return f"{first}Counted from 0: --columns {','.join(from_zero)}."
