"""Elements of the Mueller matrix counted from 1, where others begin at M11."""

import re
from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np

from data_io.goniometer.declarations import Declared
from data_io.goniometer.scan import STDERR
from data_io.goniometer.tables.columns import Columns
from data_io.goniometer.tables.writing import NOTES
from pbrdf.errors import DataFileError

__all__ = ["require_counted_from_zero"]

_ELEMENT = re.compile(r"^([Mm])([0-4])([0-4])")
# What tells the reflectance
_LIGHT = {"M00", "S0", "I_s", "I_p", "I0", "I90", "reflectance-factor", "brdf-cos"}
# In plane these vanish by symmetry, but for a surface with a direction of its own [M00]
_BLOCKS = {f"{i}{j}" for i in "01" for j in "23"} | {f"{i}{j}" for i in "23" for j in "01"}
_MUCH = 0.1


def require_counted_from_zero(
    path: Path,
    columns: Columns,
    in_plane: np.ndarray,
    declared: Declared,
    comments: Collection[str],
    line: int,
) -> None:
    """Refuse elements whose first index may be 1.

    From 0, M11 alone tells little; from 1 it is the reflectance, the first that anybody
    measures. Beside a reflectance the numbers tell the two apart where m12 is the m01 of
    light in plane, which polarises, as no m12 does there. Files of this package count from
    0, and a column that `--columns` names means what it is named.

    Raises
    ------
    DataFileError
        If M11 is there, or elements divided by M00 alone, no element has an index 0 and
        nothing else holds the reflectance; if elements that vanish in plane are large there
        and none has an index 0 but M00; or if `--columns` gives some elements another
        number and not others.
    """
    if any(text in NOTES for text in comments):
        return
    left = {
        key: columns.names[key]
        for key in columns.values
        if _ELEMENT.match(key)
        and _ELEMENT.match(columns.names[key])
        and columns.names[key] not in declared.columns
    }
    moved = [
        f"{name}={to}"
        for name, to in declared.columns.items()
        if (old := _ELEMENT.match(name))
        and (new := _ELEMENT.match(to))
        and old.groups()[1:] != new.groups()[1:]
    ]
    whole = [name for key, name in left.items() if key[1:3] != "00"]
    if moved and whole:
        problem = (
            f"expected all elements to be counted alike, got {', '.join(moved)} by "
            f"--columns, but nothing of {', '.join(whole)}"
        )
        raise DataFileError(path, problem, _cure(left), line=line)
    # M11/M00 says itself that there is an M00
    counted = [key for key, name in left.items() if "0" in key[1:3] or "00" in name]
    ratios = bool(left) and all(key.startswith("m") for key in left)
    large = _large_in_plane(columns, left, in_plane)
    if large and not [key for key in counted if key[:3].lower() != "m00"]:
        name, size = large
        problem = (
            f"expected elements that vanish in plane, got {name} of {size:.2g} M00 (rms): "
            "counted from 1, it is another"
        )
        raise DataFileError(path, problem, _cure(left), line=line, column=name)
    if counted or _LIGHT & columns.values.keys() or not ("M11" in left or ratios):
        return
    example = (
        "m12 is M01/M00" if ratios and "m11" not in left else "M11 is the reflectance M00"
    )
    problem = (
        f"expected M00 or another element with an index 0, got {', '.join(left.values())}: "
        f"counted from 1, {example}"
    )
    raise DataFileError(path, problem, _cure(left), line=line)


def _large_in_plane(
    columns: Columns, left: Mapping[str, str], in_plane: np.ndarray
) -> tuple[str, float] | None:
    """Return the column that is furthest from 0 where symmetry makes it vanish, or None."""
    found = []
    light = columns.values.get("M00", columns.values.get("S0"))
    for key, name in left.items():
        if key[1:3] not in _BLOCKS or key.endswith(STDERR) or in_plane.sum() < 3:
            continue
        value = np.abs(columns.values[key])[in_plane]
        if key[0] == "M" and light is not None:
            value = value / np.where(light[in_plane] > 0.0, light[in_plane], np.nan)
        if np.isfinite(value).any():
            found.append((name, float(np.sqrt(np.nanmean(value**2)))))
    size = max(found, key=lambda one: one[1], default=("", 0.0))
    return size if size[1] > _MUCH else None


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
