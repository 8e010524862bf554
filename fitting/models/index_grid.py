"""A smooth curve over the complex index from its values at a few indices.

Light that bounced off a surface several times depends on the index through products of
Fresnel coefficients. These are smooth in z = (N - 1)/(N + 1), the amplitude reflected at
normal incidence: over a region of indices a polynomial in the two parts of z of low degree
goes through them. Its nodes are approximate Fekete points [1]_, at which interpolation
amplifies errors least.

References
----------
.. [1] A. Sommariva, M. Vianello, Comput. Math. Appl. 57, 1324-1336 (2009).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg

__all__ = ["IndexGrid", "Range", "chebyshev"]

Range = tuple[float, float]

DEGREE = 6
# Candidates for the nodes along each side of the region
_CANDIDATES = 61


@dataclass(frozen=True)
class IndexGrid:
    """Polynomials over a rectangle of n and kappa.

    Parameters
    ----------
    n, kappa : (float, float)
        The rectangle; where both have length zero the curve is constant. [1]

    Raises
    ------
    ValueError
        If the rectangle is none, or holds no index of an opaque medium.

    Examples
    --------
    >>> grid = IndexGrid((1.2, 2.2), (0.0, 1.0))
    >>> values = [abs((m - 1) / (m + 1)) ** 4 for m in grid.nodes]
    >>> polynomial = grid.coefficients @ values
    >>> index = 1.5 + 0.3j
    >>> error = grid.basis(1.5, 0.3) @ polynomial - abs((index - 1) / (index + 1)) ** 4
    >>> bool(abs(error) < 1e-12)
    True
    """

    n: Range
    kappa: Range

    def __post_init__(self) -> None:
        for name, (low, high), least in (("n", self.n, 0.01), ("kappa", self.kappa, 0.0)):
            if not (least <= low <= high and np.isfinite(high)):
                msg = (
                    f"index_range must give {name} as (low, high) from {least:g} [1], got "
                    f"({low:g}, {high:g})."
                )
                raise ValueError(msg)
        if (self.n[0] == self.n[1]) != (self.kappa[0] == self.kappa[1]):
            msg = (
                "index_range must give both n and kappa room, or neither, got "
                f"{self.n} and {self.kappa}. Widen the shorter one."
            )
            raise ValueError(msg)

    @property
    def is_point(self) -> bool:
        """True if there is only one index."""
        return self.n[0] == self.n[1]

    @cached_property
    def nodes(self) -> np.ndarray:
        """The complex indices to know the curve at, shape (K,)."""
        if self.is_point:
            return np.array([complex(self.n[0], self.kappa[0])])
        n, kappa = np.meshgrid(
            _crowded(*self.n), _crowded(*self.kappa), indexing="ij"
        )  # fmt: skip
        rows = self.basis(n.ravel(), kappa.ravel())
        chosen = scipy.linalg.qr(rows.T, pivoting=True, mode="economic")[2]
        chosen = np.sort(chosen[: rows.shape[1]])
        return n.ravel()[chosen] + 1j * kappa.ravel()[chosen]

    @cached_property
    def coefficients(self) -> np.ndarray:
        """Matrix from values at the nodes to coefficients of the basis, shape (K, K)."""
        return np.linalg.inv(self.basis(self.nodes.real, self.nodes.imag))

    def basis(self, n: Any, kappa: Any) -> np.ndarray:
        """Return the basis at indices of any shape, on a last axis of length K."""
        terms = self.terms(np.asarray(n, dtype=float), np.asarray(kappa, dtype=float))
        return np.stack(np.broadcast_arrays(*terms), axis=-1).astype(float)

    def terms(self, n: Any, kappa: Any) -> list[Any]:
        """Return the basis functions of numbers, arrays or symbols, one after the other."""
        if self.is_point:
            return [1.0 + 0.0 * n]
        (x_low, x_high), (y_low, y_high) = self._box
        x, y = _reflected(n, kappa)
        along_x = chebyshev((2.0 * x - x_low - x_high) / (x_high - x_low))
        along_y = chebyshev((2.0 * y - y_low - y_high) / (y_high - y_low))
        return [
            along_x[i] * along_y[j]
            for i in range(DEGREE + 1)
            for j in range(DEGREE + 1 - i)
        ]  # fmt: skip

    @cached_property
    def _box(self) -> tuple[Range, Range]:
        """The rectangle of z that holds the region."""
        n, kappa = np.meshgrid(_crowded(*self.n), _crowded(*self.kappa))
        parts = _reflected(n, kappa)
        x, y = ((float(part.min()), float(part.max())) for part in parts)
        return x, y


def _reflected(n: Any, kappa: Any) -> tuple[Any, Any]:
    """Return real and imaginary part of (N - 1)/(N + 1)."""
    norm = (n + 1.0) * (n + 1.0) + kappa * kappa
    return (n * n + kappa * kappa - 1.0) / norm, 2.0 * kappa / norm


def _crowded(low: float, high: float) -> np.ndarray:
    """Return points that crowd at both ends, as good nodes do."""
    turn = np.cos(np.linspace(np.pi, 0.0, _CANDIDATES))
    return low + (high - low) * (0.5 + 0.5 * turn)


def chebyshev(x: Any, degree: int = DEGREE) -> list[Any]:
    """Return the Chebyshev polynomials T_0 to T_degree of numbers, arrays or symbols."""
    values = [1.0 + 0.0 * x, x]
    while len(values) <= degree:
        values.append(2.0 * x * values[-1] - values[-2])
    return values[: degree + 1]
