"""Which surfaces of Gaussian autocorrelation the data admit, where noise hides much of it.

Errors to first order rest on the covariance at the best fit. Of a nearly straight edge in
noise that fit may take a stretch of the noise for short waves; the covariance is then that
of many independent pieces, and the interval leaves the truth out. The profile of the
deviance over the correlation length weighs each length by its own covariance.
"""

import numpy as np
from scipy import optimize

from fitting.statistics.axis.autocorrelation import GAUSSIAN
from fitting.statistics.axis.fit import AxisData, AxisFit
from fitting.statistics.axis.problem import AxisProblem, Start

# Relative error of the slope from which first order is not trusted
POOR = 0.25
# 95 % quantile of chi-squared with one degree of freedom
_DROP = 3.84
_LENGTHS, _ROUNDS = 20, 3


def admitted_ends(
    fit: AxisFit, data: AxisData
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the ends of correlation lengths [um] and of slopes that the data admit.

    Parameters
    ----------
    fit : AxisFit
        Best fit of a profile.
    data : AxisData
        What was fitted, without rounding.
    """
    problem = AxisProblem(data, 1.0, None)
    spacing = data.sampling.spacing
    # The same lags for all, or their deviances could not be compared
    lags_to = max(10 * fit.correlation.corr_length, 50 * spacing)
    longest = problem.extent.length / 3
    lengths = np.geomspace(min(max(2 * spacing, data.blur), longest / 2), longest, _LENGTHS)
    deviances, slopes = np.empty(_LENGTHS), np.empty(_LENGTHS)
    for i, length in enumerate(lengths):
        problem.reach = lags_to / length
        variance, deviances[i] = _best_at(problem, fit, float(length))
        slopes[i] = np.sqrt(2 * variance) / length
    near = deviances < deviances.min() + _DROP
    return (
        (float(lengths[near].min()), float(lengths[near].max())),
        (float(slopes[near].min()), float(slopes[near].max())),
    )


def _best_at(problem: AxisProblem, fit: AxisFit, length: float) -> tuple[float, float]:
    """Height variance [um²] and deviance of the best fit of one correlation length."""
    correlation = GAUSSIAN.build(np.array([np.log(length)]))
    kept, seen = correlation.blurred(problem.data.blur)
    at = Start(GAUSSIAN, correlation, fit.variance, fit.noise)
    misfit = 0.0
    for _ in range(_ROUNDS):
        problem.set_weights(at)
        lags = problem.found.lags
        observed = np.concatenate([[problem.mean_square], problem.found.mean_square])
        roughness = np.append(
            1 - problem.loss(correlation), 2 * kept * (1 - seen.rho(lags))
        )
        left = 1 - problem.data.n_terms / problem.extent.n_points
        noise = np.append(left, problem.data.noise_increments(lags))
        system = problem.factor @ np.column_stack([roughness, noise])
        (variance, grain), misfit = optimize.nnls(system, problem.factor @ observed)
        at = Start(GAUSSIAN, correlation, max(variance, 1e-12), max(grain, 1e-12))
    spread = np.linalg.svd(problem.factor, compute_uv=False)
    return float(variance), float(misfit**2 - 2 * np.log(spread).sum())
