"""The nine dispersion formulas of the refractiveindex.info database."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pbrdf.optics.dispersion import require_in_range

__all__ = ["FORMULAS", "Formula"]

Coefficients = Sequence[float]


def _pairs(c: Coefficients, start: int) -> Iterator[tuple[float, float]]:
    """Coefficients two by two, from an index counted from 0."""
    return zip(c[start::2], c[start + 1 :: 2], strict=True)


def _sellmeier(w: np.ndarray, c: Coefficients) -> np.ndarray:
    square = 1 + c[0] + sum(a * w**2 / (w**2 - b**2) for a, b in _pairs(c, 1))
    return np.sqrt(square)


def _sellmeier_squared(w: np.ndarray, c: Coefficients) -> np.ndarray:
    return np.sqrt(1 + c[0] + sum(a * w**2 / (w**2 - b) for a, b in _pairs(c, 1)))


def _polynomial(w: np.ndarray, c: Coefficients) -> np.ndarray:
    return np.sqrt(c[0] + sum(a * w**b for a, b in _pairs(c, 1)))


def _mixed(w: np.ndarray, c: Coefficients) -> np.ndarray:
    # Two resonances of four coefficients each, then powers
    square = c[0] + sum(a * w**b for a, b in _pairs(c, 9))
    for k in (1, 5):
        if len(c) > k and c[k]:
            square = square + c[k] * w ** c[k + 1] / (w**2 - c[k + 2] ** c[k + 3])
    return np.sqrt(square)


def _cauchy(w: np.ndarray, c: Coefficients) -> np.ndarray:
    return np.asarray(c[0] + sum(a * w**b for a, b in _pairs(c, 1)))


def _gases(w: np.ndarray, c: Coefficients) -> np.ndarray:
    return np.asarray(1 + c[0] + sum(a / (b - w**-2.0) for a, b in _pairs(c, 1)))


def _herzberger(w: np.ndarray, c: Coefficients) -> np.ndarray:
    pole = 1 / (w**2 - 0.028)
    powers = sum(a * w ** (2.0 * (k + 1)) for k, a in enumerate(c[3:]))
    return c[0] + c[1] * pole + c[2] * pole**2 + powers


def _retro(w: np.ndarray, c: Coefficients) -> np.ndarray:
    # Clausius-Mossotti: (n^2 - 1)/(n^2 + 2)
    ratio = c[0] + c[1] * w**2 / (w**2 - c[2]) + c[3] * w**2
    return np.sqrt((1 + 2 * ratio) / (1 - ratio))


def _exotic(w: np.ndarray, c: Coefficients) -> np.ndarray:
    wing = c[3] * (w - c[4]) / ((w - c[4]) ** 2 + c[5])
    return np.sqrt(c[0] + c[1] / (w**2 - c[2]) + wing)


@dataclass(frozen=True)
class _Law:
    """A formula: n of wavelength [um] and coefficients; how many of them it may have."""

    index: Callable[[np.ndarray, Coefficients], np.ndarray]
    counts: Callable[[int], bool]
    rule: str


def _odd(count: int) -> bool:
    return count % 2 == 1


FORMULAS = {
    1: _Law(_sellmeier, _odd, "an odd number"),
    2: _Law(_sellmeier_squared, _odd, "an odd number"),
    3: _Law(_polynomial, _odd, "an odd number"),
    4: _Law(_mixed, lambda n: n in (1, 5) or (n >= 9 and _odd(n)), "1, 5, 9, 11, ..."),
    5: _Law(_cauchy, _odd, "an odd number"),
    6: _Law(_gases, _odd, "an odd number"),
    7: _Law(_herzberger, lambda n: 3 <= n <= 6, "3 to 6"),
    8: _Law(_retro, lambda n: n == 4, "4"),
    9: _Law(_exotic, lambda n: n == 6, "6"),
}


@dataclass(frozen=True)
class Formula:
    """Index by formula `number` of the refractiveindex.info database.

    1 Sellmeier, 2 Sellmeier with squared resonances, 3 polynomial, 4 the database's own,
    5 Cauchy, 6 gases, 7 Herzberger, 8 retro, 9 exotic.

    Parameters
    ----------
    number : int
        1 to 9.
    coefficients : tuple of float
        As published, for wavelengths in micrometres.
    valid_range : (float, float)
        Wavelengths of the source. [um]

    References
    ----------
    .. [1] M. N. Polyanskiy, Refractiveindex.info database of optical constants,
       Sci. Data 11, 94 (2024), and its document "Dispersion formulas".

    Examples
    --------
    Fused silica at the sodium line:

    >>> silica = Formula(1, (0, 0.6961663, 0.0684043, 0.4079426, 0.1162414, 0.8974794,
    ...                      9.896161), (0.21, 6.7))
    >>> silica(0.5893).round(4)
    np.float64(1.4584)
    """

    number: int
    coefficients: tuple[float, ...]
    valid_range: tuple[float, float]

    def __post_init__(self) -> None:
        law = FORMULAS.get(self.number)
        if law is None:
            msg = (
                f"formula must be one of 1 to 9, got {self.number}. Use a table of values."
            )
            raise ValueError(msg)
        if not law.counts(len(self.coefficients)):
            msg = (
                f"formula {self.number} must have {law.rule} coefficients, "
                f"got {len(self.coefficients)}. Copy all of them, zeros too."
            )
            raise ValueError(msg)
        low, high = self.valid_range
        if not 0 < low < high < np.inf:
            msg = (
                f"wavelength_range must rise from above 0 [um], got {low:g} to {high:g}. "
                "Wavelengths are in micrometres."
            )
            raise ValueError(msg)
        with np.errstate(all="ignore"):
            n = law.index(np.geomspace(low, high, 500), self.coefficients)
        wrong = ~(np.isfinite(n) & (n > 0))
        if wrong.any():
            where = np.geomspace(low, high, 500)[np.argmax(wrong)]
            msg = (
                f"formula {self.number} must give n > 0 over its range, got "
                f"{n[np.argmax(wrong)]:g} at {where:.4g} um. Check the coefficients."
            )
            raise ValueError(msg)

    def __call__(self, wavelength: npt.ArrayLike) -> np.ndarray:
        """Index n. [1]"""
        checked = require_in_range(wavelength, self.valid_range)
        index = FORMULAS[self.number].index(checked, self.coefficients)
        # A formula without terms is one number
        return np.array(np.broadcast_to(index, np.shape(checked)))
