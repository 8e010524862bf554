"""What goes into the fit of one axis and what comes out, with its errors."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fitting.statistics.axis.autocorrelation import Correlation, Family
from fitting.statistics.axis.scatter import Extent
from fitting.statistics.axis.structure_function import Increments, Sampling

Array = np.ndarray


@dataclass(frozen=True)
class AxisData:
    """What is known of one axis before the fit.

    Parameters
    ----------
    sampling : Sampling
        Structure function of the residual heights.
    step : float
        Rounding step. [um]
    form_increments : callable
        Increments of the removed form at given lags, shape (n_samples, n_lags). [um]
    degree : int
        Of the removed form.
    n_terms : int
        Its number of coefficients.
    blur : float
        Standard deviation of the blur along the heights, 0 for none. [um]
    grain : ndarray, shape (m,)
        Autocorrelation of the noise at 0, 1, 2 ... steps; 1 alone for white noise.
    """

    sampling: Sampling
    step: float
    form_increments: Callable[[Array], Array]
    degree: int
    n_terms: int
    blur: float = 0.0
    grain: Array = field(default_factory=lambda: np.ones(1))

    def noise_increments(self, lags: Array) -> Array:
        """Mean square increments of noise of unit variance."""
        if self.grain.size == 1:
            return np.full(lags.shape, 2.0)
        steps = np.arange(self.grain.size + 1) * self.sampling.spacing
        return 2 * (1 - np.interp(lags, steps, np.append(self.grain, 0.0)))


@dataclass(frozen=True)
class AxisFit:
    """Fitted surface along one axis, able to propagate its errors to any quantity.

    Parameters
    ----------
    correlation : Correlation
        Fitted autocorrelation.
    variance, noise : float
        Of heights in the fitted model, and of white noise. [um²]
    parameters : ndarray, shape (p,)
        ln variance, the family's own, noise / mean square height.
    response : ndarray, shape (p, n + 1)
        d parameters / d (mean square height, increments).
    covariance : ndarray, shape (n + 1, n + 1)
        Of (mean square height, increments). [um⁴]
    increments : Increments
        What was fitted.
    modelled : ndarray, shape (n + 1,)
        Mean square height and increments of the fitted model. [um²]
    misfit : float
        Weighted sum of squares.
    extent : Extent
        Length and independent lines.
    mean_square : float
        Of the residual heights. [um²]
    loss : float
        Share of the height variance that form removal and blur take. [1]
    blur : float
        Of the heights that were fitted. [um]
    """

    family: Family
    correlation: Correlation
    variance: float
    noise: float
    parameters: Array
    response: Array
    covariance: Array
    increments: Increments
    modelled: Array
    misfit: float
    extent: Extent
    mean_square: float
    loss: float
    blur: float

    def log_variance(
        self, quantity: Callable[[Array], float], direct: float = 0.0
    ) -> float:
        """Variance of ln(quantity(parameters) · mean_square^direct), to first order."""
        gradient = _gradient(lambda t: np.log(quantity(t)), self.parameters) @ self.response
        gradient[0] += direct / self.mean_square
        # First order in large scatter may cancel; n heights know a variance to 2/n at best
        least = 2.0 / self.extent.n_points
        return max(float(gradient @ self.covariance @ gradient), least)

    def correlation_at(self, parameters: Array) -> Correlation:
        """Autocorrelation for another parameter vector."""
        return self.family.build(parameters[1:-1])

    @property
    def noise_stderr(self) -> float:
        """Standard error of the noise variance. [um²]"""
        row = self.response[-1]
        return float(np.sqrt(max(row @ self.covariance @ row, 0.0))) * self.mean_square


def jacobian(function: Callable[[Array], Array], at: Array) -> Array:
    """Central differences, columns by parameter."""
    steps = np.full(at.size, 1e-4)
    columns = []
    for i, step in enumerate(steps):
        shift = np.zeros(at.size)
        shift[i] = step
        columns.append((function(at + shift) - function(at - shift)) / (2 * step))
    return np.column_stack(columns)


def _gradient(function: Callable[[Array], float], at: Array) -> Array:
    return jacobian(lambda t: np.array([function(t)]), at)[0]
