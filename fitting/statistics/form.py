"""Form removal: the tilt, curvature or polynomial that is not roughness."""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

Array = np.ndarray

FORMS = {"none": -1, "mean": 0, "tilt": 1, "curvature": 2}
_HIGHEST_DEGREE = 12


def form_degree(form: str | int) -> int:
    """Degree of the polynomial that `form` names; -1 for "none".

    Raises
    ------
    ValueError
        If the name is unknown or the degree is outside 0 to 12.

    Examples
    --------
    >>> form_degree("curvature"), form_degree(4)
    (2, 4)
    """
    if isinstance(form, str) and form in FORMS:
        return FORMS[form]
    if isinstance(form, str) and form.strip().isdigit():
        form = int(form)
    if (
        isinstance(form, int | np.integer)
        and not isinstance(form, bool)
        and 0 <= form <= _HIGHEST_DEGREE
    ):
        return int(form)
    msg = (
        f"form must be one of {', '.join(FORMS)} or a degree 0 .. {_HIGHEST_DEGREE}, "
        f"got {form!r}. Take 'tilt' for a flat sample and 'curvature' for a bent one."
    )
    raise ValueError(msg)


@dataclass(frozen=True)
class Form:
    """Least-squares polynomial of total degree `degree` in one or two coordinates.

    Parameters
    ----------
    degree : int
        Highest total degree; -1 removes nothing.
    ranges : tuple of (low, high)
        Interval of each coordinate, mapped to [-1, 1]. [um]
    coefficients : ndarray, shape (degree + 1,) or (degree + 1, degree + 1)
        Of Legendre polynomials. [um]
    """

    degree: int
    ranges: tuple[tuple[float, float], ...]
    coefficients: Array

    @property
    def n_terms(self) -> int:
        """Number of fitted coefficients."""
        p = self.degree + 1
        return p if len(self.ranges) == 1 else p * (p + 1) // 2

    def along(self, axis: int, position: Array, across: Array | None = None) -> Array:
        """Heights of the form along one axis, at given places of the other. [um]"""
        if self.degree < 0:
            return np.zeros_like(position)
        u = _scaled(position, self.ranges[axis])
        if len(self.ranges) == 1 or across is None:
            return legendre.legval(u, self.coefficients)
        v = _scaled(across, self.ranges[1 - axis])
        coefficients = self.coefficients if axis == 0 else self.coefficients.T
        return legendre.legval2d(u, v, coefficients)


def remove_form_profile(x: Array, z: Array, degree: int) -> tuple[Array, Form]:
    """Residual heights of a profile and the polynomial taken off."""
    limits = ((float(x[0]), float(x[-1])),)
    if degree < 0:
        return z.copy(), Form(-1, limits, np.zeros(1))
    basis = legendre.legvander(_scaled(x, limits[0]), degree)
    # Normal equations suffice: Legendre polynomials are nearly orthogonal on the points
    coefficients = np.linalg.solve(basis.T @ basis, basis.T @ z)
    return z - basis @ coefficients, Form(degree, limits, coefficients)


def remove_form_map(
    heights: Array, spacing: tuple[float, float], degree: int
) -> tuple[Array, Form]:
    """Residual heights of a map (NaN stays NaN) and the polynomial taken off."""
    nx, ny = heights.shape
    limits = ((0.0, (nx - 1) * spacing[0]), (0.0, (ny - 1) * spacing[1]))
    if degree < 0:
        return heights.copy(), Form(-1, limits, np.zeros((1, 1)))
    known = np.isfinite(heights)
    weight = known.astype(np.float64)
    filled = np.where(known, heights, 0.0)
    basis_x = legendre.legvander(np.linspace(-1, 1, nx), degree)
    basis_y = legendre.legvander(np.linspace(-1, 1, ny), degree)
    terms = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    # Products of one-dimensional bases, so each sum over the map is two matrix products
    pairs_x = (basis_x[:, :, None] * basis_x[:, None, :]).reshape(nx, -1)
    pairs_y = (basis_y[:, :, None] * basis_y[:, None, :]).reshape(ny, -1)
    sums = (pairs_x.T @ weight @ pairs_y).reshape((degree + 1,) * 4)
    normal = np.array([[sums[i, k, j, m] for k, m in terms] for i, j in terms])
    moments = basis_x.T @ filled @ basis_y
    solution = np.linalg.lstsq(normal, [moments[i, j] for i, j in terms], rcond=1e-12)[0]
    coefficients = np.zeros((degree + 1, degree + 1))
    for (i, j), value in zip(terms, solution, strict=True):
        coefficients[i, j] = value
    return heights - basis_x @ coefficients @ basis_y.T, Form(degree, limits, coefficients)


def _scaled(position: Array, limits: tuple[float, float]) -> Array:
    low, high = limits
    return (2 * position - low - high) / (high - low)
