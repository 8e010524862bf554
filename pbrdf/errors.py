"""Errors that name the quantity, the rule, the value, the place and the cure."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt


class DataFileError(ValueError):
    """A file that cannot be used, with the place of the fault and how to mend it.

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
        place = Path(path).name
        if line is not None:
            place += f" line {line}"
        if column is not None:
            place += f", column {column}"
        super().__init__(f"{place}: {problem}. {cure}")
        self.path = Path(path)
        self.line = line
        self.column = column


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
        What the user passed; NaN never passes.
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
    if np.iscomplexobj(values):
        msg = f"{name} must be real, got complex values. {cure}"
        raise TypeError(msg)
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        msg = f"{name} must be real numbers, got {values!r}. {cure}"
        raise TypeError(msg) from error
    wrong = ~(valid(array) & ~np.isnan(array))
    if wrong.any():
        if array.ndim == 0:
            place, value = "", array[()]
        else:
            index = tuple(int(i) for i in np.argwhere(wrong)[0])
            value = array[index]
            place = f" at index {index[0] if len(index) == 1 else index}"
        msg = f"{name} must {rule}, got {value:.17g}{place}. {cure}"
        raise ValueError(msg)
    return array


class AccuracyWarning(UserWarning):
    """A result that stands on weaker ground than its user may think."""
