"""The fit along one axis: height variance, form of the autocorrelation, and noise.

Sample structure function and mean square height are compared with what a model surface
would give after the same noise, rounding and form removal. The weights come from the
theoretical covariance of the samples, softened so that the fit rests on the bulk of the
structure function: the exact optimum would put its trust in the last digits of smooth data.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize

from fitting.statistics.axis.autocorrelation import (
    FAMILIES,
    GAUSSIAN,
    Correlation,
    Family,
    multi_scale_family,
)
from fitting.statistics.axis.fit import AxisData, AxisFit, jacobian
from fitting.statistics.axis.rounding import Rounding
from fitting.statistics.axis.scatter import (
    Extent,
    form_losses,
    form_scatter,
    increment_covariance,
)

Array = np.ndarray

# Lags reach this many correlation lengths: beyond, the structure function is a plateau
REACH = 1.5
N_LAGS = 14
# A sum of scales needs lags over all of them
_WIDE_REACH = 2.0
_WIDE_LAGS = 24
# Misfit above which no simple form describes the curve
_HOPELESS = 60.0
# What a sum of scales need not describe better, as a share of each increment
_TOLERANCE = 0.01
# Shortest length that spacing can tell from noise, in steps
_SHORTEST = 0.7
# Share of each standard deviation added to the diagonal of the covariance
_SOFTENING = 0.3
# Drop of the misfit, in chi-squared units, that a form with more parameters must bring
_DROP_PER_PARAMETER = 7.0
_MAX_ROUNDS = 8


def fit_axis(
    data: AxisData,
    *,
    across: float = 1.0,
    families: Sequence[Family] = FAMILIES,
    losses_across: Array | None = None,
) -> AxisFit:
    """Fit each family and keep the simplest that the data do not reject.

    Parameters
    ----------
    data : AxisData
        Structure function, rounding and removed form.
    across : float
        Inverse number of independent lines (1 for a profile).
    families : sequence of Family
        Candidates; the first is preferred unless another fits clearly better.
    losses_across : ndarray, optional
        Shares that the form's terms take across the axis, for a map.
    """
    problem = AxisProblem(data, across, losses_across)
    if data.step**2 > data.sampling.variance:
        # Lost in the rounding, the form cannot be told
        families = families[:1]
    best = problem.solve(families[0], problem.pilot())
    for family in families[1:]:
        # No form can drop the misfit by more than all of it
        if best.misfit < _DROP_PER_PARAMETER:
            break
        other = problem.compare(family, best)
        extra = len(family.starts(1.0)[0]) - len(best.family.starts(1.0)[0])
        if best.misfit - other.misfit > _DROP_PER_PARAMETER * max(extra, 0.2):
            best = other
    if best.family is not families[0]:
        best = problem.solve(best.family, best)
    if best.misfit > _HOPELESS and len(families) > 1:
        best = problem.sum_of_scales(best)
    return best


@dataclass
class Start:
    """Where a fit starts: parameters of a family, on the scale of the data."""

    family: Family
    correlation: Correlation
    variance: float
    noise: float


class AxisProblem:
    """One axis: model of the data, its weights, and the solver."""

    def __init__(self, data: AxisData, across: float, losses_across: Array | None) -> None:
        self.data = data
        self.reach, self.n_lags, self.tolerance = REACH, N_LAGS, 0.0
        sampling = data.sampling
        self.mean_square = sampling.variance
        self.extent = Extent(sampling.length, sampling.n_points, across)
        self.losses_across = losses_across

    def pilot(self) -> Start:
        """Guess from the plain autocorrelation; the rounds below mend it."""
        length = min(self.data.sampling.first_fall(), self.extent.length / 4)
        noise = 1e-3 * self.mean_square
        return Start(
            GAUSSIAN, GAUSSIAN.build(np.array([np.log(length)])), self.mean_square, noise
        )

    def solve(self, family: Family, start: "Start | AxisFit") -> AxisFit:
        """Fit, renewing lags and weights until the correlation length settles."""
        starts: list[list[float]] | None = None
        if isinstance(start, AxisFit):
            starts = [list(start.parameters[1:-1])]
        for _ in range(_MAX_ROUNDS):
            self.set_weights(start)
            fit = self._minimise(family, start, starts)
            change = abs(
                np.log(fit.correlation.corr_length / start.correlation.corr_length)
            )
            starts, start = [fit.parameters[1:-1].tolist()], fit
            if change < 2e-3:
                break
        self.set_weights(fit)
        return self._with_errors(fit)

    def compare(self, family: Family, reference: AxisFit) -> AxisFit:
        """Fit another family to the same lags with the same weights."""
        self.set_weights(reference)
        fit = self._minimise(family, reference, None)
        return fit

    def sum_of_scales(self, reference: AxisFit) -> AxisFit:
        """Describe the curve by as many Gaussian scales as it takes."""
        self.reach, self.n_lags, self.tolerance = _WIDE_REACH, _WIDE_LAGS, _TOLERANCE
        length = min(self.data.sampling.first_fall(), self.extent.length / 4)
        at = Start(
            reference.family, reference.correlation, reference.variance, reference.noise
        )
        scale = length / at.correlation.corr_length
        stretched = at.correlation.stretched(scale)
        at = Start(reference.family, stretched, at.variance, at.noise)
        self.set_weights(at)
        lags = self.found.lags
        blur = self.data.blur
        least = max(2 * self.data.sampling.spacing, blur)
        lengths = np.geomspace(least, 4 * length, 24)
        # A Gaussian scale of length l, blurred, is one of sqrt(l² + 4 blur²)
        wide = np.hypot(lengths, 2 * blur)
        curves = 2 * (1 - np.exp(-((lags[:, None] / wide) ** 2)))
        columns = np.vstack([np.ones(lengths.size), curves]) * (lengths / wide)
        noise = np.concatenate([[1.0], self.data.noise_increments(lags)])
        observed = np.concatenate([[self.mean_square], self.found.mean_square])
        # Rounding is small beside such data; Sheppard's correction makes the problem linear
        observed = observed - self.rounding.variance * noise
        system = self.factor @ np.column_stack([columns, noise])
        weights = optimize.nnls(system, self.factor @ observed)[0]
        used = weights[:-1] > 1e-4 * weights[:-1].sum()
        if used.sum() < 2:
            return reference
        lengths, shares = lengths[used], weights[:-1][used]
        family = multi_scale_family(lengths, shares / shares.sum())
        start = Start(
            family, family.build(np.array(family.starts(1.0)[0])), shares.sum(), weights[-1]
        )
        return self._with_errors(self._minimise(family, start, None))

    def set_weights(self, at: "Start | AxisFit") -> None:
        """Choose lags, and weigh them as they would scatter about this surface."""
        data, correlation = self.data, at.correlation
        length = float(np.clip(correlation.corr_length, 0, self.extent.length / 3))
        self.found = data.sampling.increments(self.reach * length, self.n_lags)
        lags = self.found.lags
        kept, seen = correlation.blurred(data.blur)
        variance = kept * at.variance
        true = 2 * variance * (1 - seen.rho(lags)) + at.noise * data.noise_increments(lags)
        form_increments = data.form_increments(lags) if data.step > 0 else np.zeros((1, 0))
        # A quarter leaves room for what the fit may still find
        self.rounding = Rounding.of_form(data.step, form_increments, true.min() / 4)
        covariance = increment_covariance(
            lags,
            seen,
            (variance, at.noise + self.rounding.variance),
            self.extent,
        )
        gain = np.concatenate([[1.0], self.rounding.gain(true)])
        # Taking the rounding noise along allows for its own correlation along a step
        self.covariance = covariance * np.outer(gain, gain) if data.step > 0 else covariance
        observed = np.concatenate([[self.mean_square], self.found.mean_square])
        # An error of the form is common to neighbouring lags, as a stretch of the curve is
        apart = np.log(np.concatenate([[self.reach * length], lags]))
        alike = np.exp(-2 * (apart[:, None] - apart) ** 2)
        self.covariance = self.covariance + alike * self.tolerance**2 * np.outer(
            observed, observed
        )
        # Increments span many decades, and those along a groove are none at all
        scale = np.sqrt(np.diag(self.covariance) + (1e-12 * self.mean_square) ** 2)
        spread, axes = np.linalg.eigh(self.covariance / np.outer(scale, scale))
        soft = np.sqrt(np.maximum(spread, 0.0) + _SOFTENING**2)
        self.factor = (axes / soft).T / scale

    def model(self, family: Family, parameters: Array) -> Array:
        """Return the expected mean square height and increments. [um²]"""
        variance = np.exp(parameters[0])
        noise = parameters[-1] * self.mean_square
        correlation = family.build(parameters[1:-1])
        kept, seen = correlation.blurred(self.data.blur)
        drop = kept * (1 - seen.rho(self.found.lags))
        true = 2 * variance * drop + noise * self.data.noise_increments(self.found.lags)
        share = 1 - self.loss(correlation)
        left = 1 - self.data.n_terms / self.extent.n_points
        mean_square = variance * share + noise * left + self.rounding.variance
        return np.concatenate([[mean_square], self.rounding.increments(true)])

    def loss(self, correlation: Correlation) -> float:
        """Share of the height variance that form and blur take, in expectation."""
        along = form_losses(correlation, self.extent.length, self.data.degree)
        if self.losses_across is None:
            blurred = 1 - correlation.blurred(self.data.blur)[0]
            return float(min(along.sum() + blurred, 0.9))
        across = self.losses_across
        total = sum(along[i] * across[: along.size - i].sum() for i in range(along.size))
        return float(min(total, 0.9))

    def _minimise(
        self, family: Family, start: "Start | AxisFit", starts: list[list[float]] | None
    ) -> AxisFit:
        length = start.correlation.corr_length
        # Shorter than the spacing, roughness is noise; shorter than the blur, it is gone
        shortest = max(_SHORTEST * self.data.sampling.spacing, self.data.blur)
        length = max(length, shortest)
        low, high = family.limits(length, shortest)
        observed = np.concatenate([[self.mean_square], self.found.mean_square])
        noise = np.clip(start.noise / self.mean_square, 1e-6, 0.9)
        lower = np.array([np.log(self.mean_square * 1e-6), *low, 0.0])
        upper = np.array([np.log(self.mean_square * 1e3), *high, 1.0])
        solutions = []
        for own in starts or family.starts(length):
            guess = np.clip(
                [np.log(start.variance), *own, noise], lower + 1e-9, upper - 1e-9
            )
            solutions.append(
                optimize.least_squares(
                    lambda t: self.factor @ (observed - self.model(family, t)),
                    guess,
                    bounds=(lower, upper),
                    x_scale=[*[0.1] * (guess.size - 1), 0.01],
                    max_nfev=60,
                )
            )
        best = min(solutions, key=lambda solution: solution.cost)
        found = best.x
        return AxisFit(
            family=family,
            correlation=family.build(found[1:-1]),
            variance=float(np.exp(found[0])),
            noise=float(found[-1] * self.mean_square),
            parameters=found,
            response=np.zeros((found.size, observed.size)),
            covariance=self.covariance,
            increments=self.found,
            modelled=self.model(family, found),
            misfit=float(2 * best.cost),
            extent=self.extent,
            mean_square=self.mean_square,
            loss=self.loss(family.build(found[1:-1])),
            blur=self.data.blur,
        )

    def _with_errors(self, fit: AxisFit) -> AxisFit:
        """Refit once on the final weights and derive the response to the data."""
        fit = self._minimise(fit.family, fit, [list(fit.parameters[1:-1])])
        slopes = jacobian(lambda t: self.model(fit.family, t), fit.parameters)
        response = np.linalg.pinv(self.factor @ slopes, rcond=1e-9) @ self.factor
        return replace(fit, response=response, covariance=self._projected(fit))

    def _projected(self, fit: AxisFit) -> Array:
        """Covariance of the data without what the removed form took of the mean square."""
        covariance = self.covariance.copy()
        if self.losses_across is None:
            share = form_scatter(
                fit.correlation,
                self.extent.length,
                self.data.degree,
            )
            covariance[0, 0] *= 1 - share
        return covariance
