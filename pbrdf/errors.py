"""Errors that name the quantity, the rule, the value, the place and the cure."""

import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?")
# Signs of a message about a file, whatever the file holds
MOST_SIGNS = 320


def shortened(text: str, most: int) -> str:
    """Return a text of at most so many signs, its middle left out where it is longer.

    Examples
    --------
    >>> shortened("expected a number, got " + 1000 * "7", 40)
    'expected a number, got 7777 ... 77777777'
    """
    if len(text) <= most:
        return text
    tail = (most - 5) // 4
    return f"{text[: most - 5 - tail]} ... {text[-tail:]}"


def visible(text: str) -> str:
    r"""Return a text on one line, with signs that steer a terminal written out.

    Examples
    --------
    >>> visible("a\nb \x1b[31mred \u202ecsv µm")
    'a b \\x1b[31mred \\u202ecsv µm'
    """
    text = " ".join(text.split())
    if text.isprintable():
        return text
    return "".join(
        sign if sign.isprintable() else sign.encode("unicode_escape").decode()
        for sign in text
    )


def percent(share: float) -> str:
    """Return a share in per cent with two digits.

    Examples
    --------
    >>> percent(0.9987), percent(0.0449)
    ('100 %', '4.5 %')
    """
    value = 100.0 * share
    return f"{value:.0f} %" if value >= 10.0 else f"{value:.2g} %"


def told_once(notes: Iterable[str]) -> list[str]:
    """Return notes that differ in their numbers alone once, and how many more there were.

    Examples
    --------
    >>> told_once(["lost 2 rays", "lost 0.3 rays", "dark", "lost 2 rays"])
    ['lost 2 rays (and 1 more with other numbers)', 'dark']
    """
    return [
        f"{first} (and {len(others)} more with other numbers)" if others else first
        for first, *others in of_kind(notes)
    ]


def of_kind(notes: Iterable[str]) -> list[list[str]]:
    """Put notes that differ in their numbers alone together, each once."""
    found: dict[str, list[str]] = {}
    for note in dict.fromkeys(notes):
        found.setdefault(_NUMBER.sub("#", note), []).append(note)
    return list(found.values())


class DataFileError(ValueError):
    """A file that cannot be used, with the place of the fault and how to mend it.

    The message has one line and at most 320 signs: what a file says of itself is shortened.

    Parameters
    ----------
    path : str or Path
        The file.
    problem : str
        What was expected and what was found, without a final full stop.
    cure : str
        How to mend it; one sentence.
    line : int, optional
        Line number, counted from 1.
    column : str, optional
        Column or key.

    Examples
    --------
    >>> print(DataFileError("run.csv", "expected a number, got 'n/a'", "Leave gaps empty.",
    ...                     line=12, column="theta_s_deg"))
    run.csv line 12, column theta_s_deg: expected a number, got 'n/a'. Leave gaps empty.
    """

    def __init__(
        self,
        path: str | Path,
        problem: str,
        cure: str,
        *,
        line: int | None = None,
        column: str | None = None,
    ) -> None:
        place = shortened(visible(Path(path).name), 80)
        if line is not None:
            place += f" line {line}"
        if column is not None:
            place += f", column {shortened(visible(column), 60)}"
        room = MOST_SIGNS - len(place) - len(": . ")
        problem = shortened(visible(problem), max(room - len(cure), room // 2))
        cure = shortened(visible(cure), room - len(problem))
        super().__init__(f"{place}: {problem}. {cure}")
        self.path = Path(path)
        self.line = line
        self.column = column


def _joined(values: npt.ArrayLike) -> npt.ArrayLike:
    """Masked arrays in a list as one, since NumPy would drop their masks."""
    if not isinstance(values, list | tuple):
        return values
    if not any(isinstance(one, np.ma.MaskedArray) for one in values):
        return values
    joined: np.ma.MaskedArray = np.ma.stack([np.ma.asanyarray(one) for one in values])
    return joined


def real_array(name: str, values: npt.ArrayLike, cure: str = "") -> np.ndarray:
    """Return `values` as a float64 array, with NaN where a masked array hides a value.

    Without a mask an array of float64 is returned as it is.

    Raises
    ------
    TypeError
        If the values are complex, truth values or no numbers at all.

    Examples
    --------
    >>> real_array("heights", np.ma.array([1.0, 500.0], mask=[False, True]))
    array([ 1., nan])
    """
    values = _joined(values)
    hidden = None
    if isinstance(values, np.ma.MaskedArray):
        hidden, values = np.ma.getmaskarray(values), values.data
    plain = np.asanyarray(values) if not isinstance(values, np.ndarray) else values
    if plain.dtype.kind in "cb":
        wanted = "real, got complex" if plain.dtype.kind == "c" else "numbers, got truth"
        msg = f"{name} must be {wanted} values. {cure}"
        raise TypeError(msg.strip())
    try:
        array = np.asarray(plain, dtype=np.float64)
    except (TypeError, ValueError) as error:
        got = shortened(repr(values), 80)
        msg = f"{name} must be real numbers, got {got}. {cure}"
        raise TypeError(msg.strip()) from error
    if hidden is not None and hidden.any():
        array = np.where(hidden, np.nan, array)
    return array


def require(
    name: str,
    values: npt.ArrayLike,
    valid: Callable[[np.ndarray], np.ndarray],
    rule: str,
    cure: str,
) -> np.ndarray:
    """Return `values` as a float64 array, or raise naming the first one that breaks `rule`.

    Parameters
    ----------
    name : str
        Argument name as the user wrote it.
    values : array_like
        What the user passed; NaN and masked values never pass.
    valid : callable
        Element-wise test, True where the value is allowed.
    rule : str
        The test in words, with the unit: "lie in [0, 1.571] rad".
    cure : str
        How to mend it.

    Raises
    ------
    TypeError
        If the values are not real numbers.
    ValueError
        If any value fails the test or is NaN.

    Examples
    --------
    >>> require("kappa", [0.0, -1.0], lambda v: v >= 0, "be >= 0 [1]", "Use n + i kappa.")
    Traceback (most recent call last):
    ...
    ValueError: kappa must be >= 0 [1], got -1 at index 1. Use n + i kappa.
    """
    array = real_array(name, values, cure)
    wrong = ~(valid(array) & ~np.isnan(array))
    if wrong.any():
        if array.ndim == 0:
            place, value = "", array[()]
        else:
            index = tuple(int(i) for i in np.argwhere(wrong)[0])
            value = array[index]
            place = f" at index {index[0] if len(index) == 1 else index}"
        hidden = isinstance(_joined(values), np.ma.MaskedArray) and np.isnan(value)
        got = "a masked value" if hidden else repr(float(value)).removesuffix(".0")
        msg = f"{name} must {rule}, got {got}{place}. {cure}"
        raise ValueError(msg)
    return array


def one_number(
    name: str,
    value: Any,
    valid: Callable[[np.ndarray], np.ndarray],
    rule: str,
    cure: str,
) -> float:
    """Return one number that keeps a rule, checked as by `require`.

    Examples
    --------
    >>> one_number("height", [1.0, 2.0], np.isfinite, "be finite [um]", "Give the height.")
    Traceback (most recent call last):
    ...
    ValueError: height must be one number, got shape (2,). Give the height.
    """
    number = require(name, value, valid, rule, cure)
    if number.ndim:
        msg = f"{name} must be one number, got shape {number.shape}. {cure}"
        raise ValueError(msg)
    return float(number)


def check_seed(value: Any) -> None:
    """Refuse what is no seed: a whole number >= 0, or None to draw one.

    Examples
    --------
    >>> check_seed(-1)
    Traceback (most recent call last):
    ...
    ValueError: seed must be a whole number >= 0, got -1. Or leave it out.
    """
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if value is not None and not (whole and value >= 0):
        msg = f"seed must be a whole number >= 0, got {value!r}. Or leave it out."
        raise ValueError(msg)


class AccuracyWarning(UserWarning):
    """A result that stands on weaker ground than its user may think."""
