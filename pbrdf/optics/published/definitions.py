"""What makes columns of a table other constants than their names say."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from pbrdf.errors import DataFileError
from pbrdf.optics.published.columns import column_of, unit_of
from pbrdf.optics.published.text import Line

__all__ = [
    "is_unit_of_number",
    "refuse_attenuation_index",
    "refuse_units",
    "require_one_state",
    "with_unit",
]

_LENGTH = r"(?:[nuµμmc]?m|å|angstroms?)"
# 1/mm, um^-1, dB/cm, %, x1000, *10^3, 10⁻³, E-3
_UNIT = re.compile(
    rf"(?:1\s*)?/\s*{_LENGTH}|{_LENGTH}(?:\s*(?:\^|\*\*)?\s*[-\u2212]1|⁻¹)|{_LENGTH}|"
    rf"dB\s*/\s*{_LENGTH}|Np\s*/\s*{_LENGTH}|%|‰|ppm|per ?cent|percent|pct|"
    r"[x×*·/]?\s*(?:10\s*(?:\^|\*\*)\s*[-+\u2212]?\d+|10[⁻⁺]?[⁰¹²³⁴⁵⁶⁷⁸⁹]+|10+|"
    r"\d?(?:\.\d+)?e[-+]?\d+)|[x×*·/]\s*\d+",
    re.IGNORECASE,
)
_PER_LENGTH = re.compile(r"(?<!pp)m(?!\w)|å|angstrom", re.IGNORECASE)
_ATTENUATION = re.compile(
    r"\bn\s*[*·]?\s*\(\s*1\s*[-+±\u2212]\s*(?:[ij]\s*[*·]?\s*(?:k|kappa|κ|x)|"
    r"(?:k|kappa|κ|x)\s*[*·]?\s*[ij])\s*\)",
    re.IGNORECASE,
)
# How much further constants go up and down over all rows than in the rows of each state
_TURNS = 2.5


def is_unit_of_number(cell: str) -> bool:
    """Tell whether a cell below a name gives what stands there a unit or a factor.

    Examples
    --------
    >>> [is_unit_of_number(cell) for cell in ("1/mm", "x1000", "1e-3", "(%)", "dB/cm")]
    [True, True, True, True, True]
    >>> [is_unit_of_number(cell) for cell in ("-", "1", "", "1.5", "film A")]
    [False, False, False, False, False]
    """
    return bool(_UNIT.fullmatch(cell.strip().strip("[]()").strip()))


def refuse_units(
    path: Path, names: Sequence[str], units: Line, below: Sequence[str]
) -> None:
    """Refuse units below the names of constants, which are numbers.

    Raises
    ------
    DataFileError
        With the first of them.
    """
    for name, unit in zip(names, below, strict=False):
        known = column_of(name)
        if known is None or known.role == "wavelength":
            continue
        if unit_of(unit) or is_unit_of_number(unit):
            problem = f"expected a number without a unit, got {unit!r} below the name"
            cure = "Write the number itself, and empty the cell."
            if known.role == "kappa" and _PER_LENGTH.search(unit):
                cure = (
                    "Of an absorption coefficient a write k = a wavelength/(4 pi), and "
                    "empty the cell."
                )
                if "db" in unit.lower():
                    cure = f"1/e of the power is 4.343 dB: divide by 4.343. {cure}"
            raise DataFileError(path, problem, cure, line=units.number, column=name)


def with_unit(name: str, below: str) -> str:
    """Return a name with the unit below it, unless it names the same one itself."""
    unit, own = unit_of(below), column_of(name)
    if unit is None or (own is not None and own.unit == unit):
        return name
    return f"{name} [{below.strip('[]()')}]"


def refuse_attenuation_index(path: Path, comments: Sequence[Line]) -> None:
    """Refuse a k that a remark defines as a part of n: N = n (1 + i k).

    Raises
    ------
    DataFileError
        With the line of the remark.
    """
    for line in comments:
        found = _ATTENUATION.search(line.text)
        if found:
            problem = f"expected k of N = n + i k, a remark says {found[0]!r}"
            cure = "Write n times k into the column, and n + i k into the remark."
            raise DataFileError(path, problem, cure, line=line.number)


def require_one_state(
    path: Path,
    left_out: Mapping[str, Sequence[str]],
    lines: Sequence[int],
    constants: Mapping[str, np.ndarray],
) -> None:
    """Refuse rows of several states that interleave, told by a column that is left out.

    The constants then go up and down from row to row, and do not in the rows of each state.

    Parameters
    ----------
    path : Path
        For the error message.
    left_out : mapping of str to sequence of str
        Cells of each column that is left out, by rising wavelength.
    lines : sequence of int
        Line of each row.
    constants : mapping of str to ndarray
        By what they are.

    Raises
    ------
    DataFileError
        With the name of the column.
    """
    for name, cells in left_out.items():
        states = {
            state: np.array([c == state for c in cells]) for state in dict.fromkeys(cells)
        }
        if not 1 < len(states) <= len(cells) / 2:
            continue
        for role, values in constants.items():
            over_all = np.abs(np.diff(values)).sum()
            within = sum(np.abs(np.diff(values[rows])).sum() for rows in states.values())
            if over_all > _TURNS * within and over_all > 0.01:
                listed = ", ".join(list(states)[:4])
                problem = (
                    f"expected rows of one {name}, which is left out, got {listed}: {role} "
                    "changes with it from row to row"
                )
                cure = f"Keep the rows of one {name}, each in a file."
                raise DataFileError(path, problem, cure, line=lines[0], column=name)
