"""Optical constants as functions of the vacuum wavelength, none of which extrapolates."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from pbrdf.errors import real_array, require

__all__ = ["Dispersion", "Polynomial", "Sellmeier", "Table"]


class Dispersion(Protocol):
    """One optical constant over a range of wavelengths."""

    @property
    def valid_range(self) -> tuple[float, float]:
        """Shortest and longest wavelength of the source. [um]"""

    def __call__(self, wavelength: npt.ArrayLike) -> np.ndarray:
        """Value at the vacuum wavelength [um]; ValueError outside `valid_range`."""


def require_in_range(
    wavelength: npt.ArrayLike,
    valid_range: tuple[float, float],
    owner: str = "its source",
) -> np.ndarray:
    """Return the wavelengths, or raise an error that names the range and whose it is."""
    low, high = valid_range
    return require(
        "wavelength",
        wavelength,
        lambda v: (v >= low) & (v <= high),
        f"lie in [{low:g}, {high:g}] um, the range of {owner}",
        "Optical constants are not extrapolated; wavelengths are in micrometres.",
    )


def _measured_rows(
    name: str, wavelength: npt.ArrayLike, values: npt.ArrayLike
) -> tuple[npt.ArrayLike, npt.ArrayLike]:
    """Leave out the rows that a mask hides in either column."""
    columns = [real_array("wavelength", wavelength), real_array(name, values)]
    masks = [np.ma.getmaskarray(np.ma.asanyarray(one)) for one in (wavelength, values)]
    if columns[0].shape != columns[1].shape or not any(mask.any() for mask in masks):
        return wavelength, values
    kept = ~(masks[0] | masks[1])
    return columns[0][kept], columns[1][kept]


@dataclass(frozen=True)
class Table:
    """Piecewise linear interpolation between tabulated values.

    Parameters
    ----------
    wavelength, values : tuple of float
        Rising vacuum wavelengths [um] and the constant at each of them [1].

    Examples
    --------
    >>> Table((0.4, 0.6), (1.50, 1.48))(0.5).round(3)
    np.float64(1.49)
    """

    wavelength: tuple[float, ...]
    values: tuple[float, ...]

    @classmethod
    def of(cls, name: str, wavelength: npt.ArrayLike, values: npt.ArrayLike) -> "Table":
        """Check and freeze arrays; a wavelength given twice or falling is an error.

        Rows with a masked wavelength or value are missing: the table is without them.
        """
        wavelength, values = _measured_rows(name, wavelength, values)
        grid = require(
            "wavelength", wavelength, lambda v: (v > 0) & np.isfinite(v),
            "be finite and > 0 [um]", "Vacuum wavelengths are in micrometres.",
        )  # fmt: skip
        # As of a material without a table
        above = name == "n"
        column = require(
            name, values, lambda v: ((v > 0) if above else (v >= 0)) & np.isfinite(v),
            f"be finite and {'>' if above else '>='} 0 [1]",
            "The index is n + i kappa with kappa >= 0 absorbing.",
        )  # fmt: skip
        if grid.ndim != 1 or grid.shape != column.shape or len(grid) < 2:
            msg = (
                f"{name} must have one value per wavelength, at least 2, "
                f"got shapes {column.shape} and {grid.shape}. Pass two columns of a table."
            )
            raise ValueError(msg)
        falls = np.flatnonzero(np.diff(grid) <= 0)
        if len(falls):
            k = int(falls[0]) + 1
            msg = (
                f"wavelength must rise [um], got {grid[k]:g} after {grid[k - 1]:g} "
                f"at index {k}. Sort the table and drop repeated rows."
            )
            raise ValueError(msg)
        return cls(tuple(grid.tolist()), tuple(column.tolist()))

    @property
    def valid_range(self) -> tuple[float, float]:
        """First and last tabulated wavelength. [um]"""
        return self.wavelength[0], self.wavelength[-1]

    def __call__(self, wavelength: npt.ArrayLike) -> np.ndarray:
        """Interpolated value. [1]"""
        checked = require_in_range(wavelength, self.valid_range)
        return np.interp(checked, self.wavelength, self.values)


@dataclass(frozen=True)
class Sellmeier:
    """n^2 = constant + sum_j strength_j w^2 / (w^2 - resonance_j), w the wavelength.

    Parameters
    ----------
    strength, resonance : tuple of float
        Dimensionless strengths and squared resonance wavelengths. [1], [um^2]
    valid_range : (float, float)
        Wavelengths of the source. [um]
    constant : float
        High-frequency limit of n^2; 1 in the ordinary form. [1]

    Examples
    --------
    >>> bk7 = Sellmeier((1.03961212, 0.231792344, 1.01046945),
    ...                 (0.00600069867, 0.0200179144, 103.560653), (0.3, 2.5))
    >>> bk7(0.5876).round(4)
    np.float64(1.5168)
    """

    strength: tuple[float, ...]
    resonance: tuple[float, ...]
    valid_range: tuple[float, float]
    constant: float = 1.0

    def __call__(self, wavelength: npt.ArrayLike) -> np.ndarray:
        """Index n. [1]"""
        square = require_in_range(wavelength, self.valid_range) ** 2
        total = self.constant + sum(
            strength * square / (square - resonance)
            for strength, resonance in zip(self.strength, self.resonance, strict=True)
        )
        return np.sqrt(total)


@dataclass(frozen=True)
class Polynomial:
    """n^2 = sum_j coefficient_j w^power_j (Schott and Cauchy-like fits).

    Parameters
    ----------
    coefficient, power : tuple of float
        Coefficients [um^-power] and the powers of the wavelength.
    valid_range : (float, float)
        Wavelengths of the source. [um]
    """

    coefficient: Sequence[float]
    power: Sequence[float]
    valid_range: tuple[float, float]

    def __call__(self, wavelength: npt.ArrayLike) -> np.ndarray:
        """Index n. [1]"""
        checked = require_in_range(wavelength, self.valid_range)
        terms = zip(self.coefficient, self.power, strict=True)
        return np.sqrt(sum(factor * checked**power for factor, power in terms))
