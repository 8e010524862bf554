"""Covariance of fitted parameters from the Jacobian, and the combinations it cannot see.

Near the minimum of sum r^2, with unit-variance residuals, the parameters' covariance is
the inverse of J^T J [1]_. A direction of parameter space that leaves every residual
unchanged has no finite variance; it is reported, not inverted.

References
----------
.. [1] G. A. F. Seber, C. J. Wild, Nonlinear Regression, 2003, section 2.1.2.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.objective.objective import Objective

__all__ = [
    "Information",
    "correlation_matrix",
    "covariance_rows",
    "information",
    "sandwich",
]


# Columns have unit length, so this is the sine between a column and the span of the others
_BLIND = 1e-8
# Where to look at the slope of what is flat at 0
_BESIDE = 1e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class Information:
    """What the data say about the parameters.

    Parameters
    ----------
    covariance : ndarray, shape (n, n)
        Rows and columns of undetermined parameters are inf on the diagonal, nan off it.
    blind : ndarray, shape (k, n)
        Directions that the data do not see, largest component 1, in units of each
        parameter's `length`.
    length : ndarray, shape (n,)
        Change of each parameter alone that changes the residuals by one unit.
    """

    covariance: np.ndarray
    blind: np.ndarray
    length: np.ndarray

    @property
    def stderr(self) -> np.ndarray:
        """Standard errors, shape (n,), inf where undetermined."""
        return np.sqrt(np.diag(self.covariance))


def information(jacobian: np.ndarray, varied: Sequence[bool] | None = None) -> Information:
    """Return covariance and blind directions of a Jacobian of unit-variance residuals.

    Parameters
    ----------
    jacobian : ndarray, shape (m, n)
        Derivatives of residuals / stderr, prior rows included.
    varied : sequence of bool, shape (n,), optional
        False for parameters held fixed: variance 0.

    Returns
    -------
    Information

    Examples
    --------
    Two parameters of which only the sum acts:

    >>> found = information(np.array([[1.0, 1.0], [2.0, 2.0]]))
    >>> found.stderr
    array([inf, inf])
    >>> found.blind.round(6)
    array([[ 1., -1.]])
    """
    n = jacobian.shape[1]
    free = np.ones(n, dtype=bool) if varied is None else np.asarray(varied, dtype=bool)
    size = np.linalg.norm(jacobian, axis=0)
    acting = free & (size > 0.0)
    safe = np.where(size > 0.0, size, 1.0)
    covariance = np.zeros((n, n))
    directions = [np.eye(n)[i] for i in np.flatnonzero(free & ~acting)]

    index = np.flatnonzero(acting)
    if index.size:
        unit = jacobian[:, index] / size[index]
        # More parameters than data: the missing rows are zeros
        unit = np.vstack([unit, np.zeros((max(0, index.size - len(unit)), index.size))])
        _, singular, basis = np.linalg.svd(unit, full_matrices=False)
        seen = singular > _BLIND * singular[0]
        half = basis[seen].T / singular[seen] / size[index][:, None]
        covariance[np.ix_(index, index)] = half @ half.T
        for row in basis[~seen]:
            direction = np.zeros(n)
            direction[index] = row / row[np.argmax(np.abs(row))]
            directions.append(np.where(np.abs(direction) < 1e-6, 0.0, direction))

    blind = np.array(directions).reshape(-1, n)
    lost = np.flatnonzero((blind != 0.0).any(axis=0))
    covariance[lost, :] = covariance[:, lost] = np.nan
    covariance[lost, lost] = np.inf
    return Information(covariance=covariance, blind=blind, length=1.0 / safe)


def covariance_rows(objective: Objective, x: np.ndarray) -> np.ndarray:
    """Return the Jacobian with the rows that the priors add, shape (m + n, n).

    A parameter that acts by its square s = x^2 has no slope at 0, though its square is
    known as well there as elsewhere. Its column is that of the square times 2 x, or times
    the root of the square's standard error where x is less than half of that.
    """
    prior = np.diag([1.0 / parameter.prior_stderr for parameter in objective.parameters])
    squared = np.array([parameter.squared for parameter in objective.parameters])
    if not squared.any():
        return np.vstack([objective.jacobian(x), prior])
    point = np.where(squared, np.maximum(x, _BESIDE), x)
    rows = np.vstack([objective.jacobian(point), prior])
    rows[:, squared] /= 2.0 * point[squared]
    error = information(rows).stderr[squared]
    known = np.where(np.isfinite(error), error, 0.0)
    rows[:, squared] *= np.maximum(2.0 * point[squared], np.sqrt(known))
    return rows


def sandwich(
    jacobian: np.ndarray, slope: np.ndarray, bend: np.ndarray, bread: Information
) -> np.ndarray:
    """Return the covariance of an M-estimate, shape (n, n).

    Parameters
    ----------
    jacobian : ndarray, shape (m, n)
        Derivatives of residuals / stderr.
    slope, bend : ndarray, shape (m,)
        psi = r rho'(r^2) and its derivative by r, at the minimum.
    bread : Information
        That of the plain Jacobian, for undetermined parameters.

    Notes
    -----
    Huber and Ronchetti (2009), eq. (7.81), with the factor m / (m - n) for few data.
    """
    m, n = jacobian.shape
    # Cauchy bends negatively in its tails; the average is positive unless most are outliers
    efficiency = max(float(np.mean(bend)), 1e-3)
    factor = float(np.mean(slope**2)) / efficiency**2 * m / max(m - n, 1)
    return bread.covariance * factor


def correlation_matrix(covariance: np.ndarray) -> np.ndarray:
    """Return the correlation matrix: 1 on the diagonal, nan for undetermined parameters.

    Examples
    --------
    >>> correlation_matrix(np.array([[4.0, 1.0], [1.0, 1.0]]))
    array([[1. , 0.5],
           [0.5, 1. ]])
    """
    stderr = np.sqrt(np.diag(covariance))
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = covariance / np.outer(stderr, stderr)
    np.fill_diagonal(correlation, 1.0)
    return correlation
