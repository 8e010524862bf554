"""Intervals that may be lopsided or open: how the misfit rises as one parameter is pulled.

The parameter is held at a value and all others are fitted again. Where the misfit rises by
the square of the normal (or Student's) quantile, the interval ends [1]_. If it never rises
that far before a bound, the data leave that side open, and no standard error can say so.

Near a bound, as kappa's at 0, a fit cannot fall on the other side of the truth, and the
same rise would be exceeded less often than stated. The rise allowed there is the one that
orders outcomes by their likelihood ratio [2]_, so that the interval neither is empty nor
covers more than it says.

References
----------
.. [1] D. M. Bates, D. G. Watts, Nonlinear Regression Analysis, 1988, section 6.1.
.. [2] G. J. Feldman, R. D. Cousins, Phys. Rev. D 57, 3873 (1998), section IV B.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Protocol

import numpy as np
from scipy import optimize, special

from fitting.objective.parameters import Parameter
from fitting.problem.problem import Problem

__all__ = ["LikelihoodProfile", "allowed_rise", "profile_likelihood"]

# Doublings of the step outwards before a side is called open
_REACH = 12


class Fitted(Protocol):
    """What a profile needs of a `FitResult`."""

    @property
    def values(self) -> Mapping[str, float]:
        """Best values by parameter name."""

    @property
    def stderr(self) -> Mapping[str, float]:
        """Standard errors by parameter name."""

    @property
    def anchored_stderr(self) -> Mapping[str, float]:
        """Those of what is known only up to a factor, if the factor were known."""

    @property
    def problem(self) -> Problem:
        """What was solved."""

    @property
    def status(self) -> str:
        """Why the solver stopped."""

    @property
    def converged(self) -> bool:
        """Whether there is a minimum."""

    def quantile(self, level: float) -> float:
        """Half width of an interval in standard errors."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LikelihoodProfile:
    """Rise of the misfit along one parameter.

    Parameters
    ----------
    name : str
        The parameter.
    value : float
        Its best value.
    low, high : float
        Ends of the interval; the bound (or inf) where a side is open.
    low_open, high_open : bool
        True where the data set no limit on that side.
    level : float
        Confidence of the interval.
    points, rise : ndarray, shape (k,)
        Values tried, rising, and the increase of chi2 there.
    """

    name: str
    value: float
    low: float
    high: float
    low_open: bool
    high_open: bool
    level: float
    points: np.ndarray
    rise: np.ndarray

    @property
    def interval(self) -> str:
        """The interval in words."""
        low = f"{self.low:.4g} (open)" if self.low_open else f"{self.low:.4g}"
        high = f"{self.high:.4g} (open)" if self.high_open else f"{self.high:.4g}"
        return f"{100 * self.level:g} %: {low} .. {high}"

    def __str__(self) -> str:
        return f"{self.name} = {self.value:.4g}, {self.interval}"


def profile_likelihood(
    result: Fitted, name: str, *, level: float = 0.95
) -> LikelihoodProfile:
    """Return the likelihood interval of one fitted parameter.

    Parameters
    ----------
    result : FitResult
        A fit with a minimum.
    name : str
        One of its parameters.
    level : float
        Confidence of the interval.

    Raises
    ------
    ValueError
        If the parameter was not free, or the fit found no minimum.
    """
    if name not in result.values:
        msg = f"name must be one of {list(result.values)}, got {name!r}."
        raise ValueError(msg)
    if not result.converged:
        msg = f"result must have a minimum to profile, got {result.status!r}. Fit again."
        raise ValueError(msg)
    problem = result.problem
    # Dozens of fits: with exact Hessians each takes a few steps
    problem = replace(problem, solver="casadi")
    parameter = next(p for p in problem.parameters if p.name == name)
    best = np.array(list(result.values.values()))
    floor = problem.objective.cost(best)
    tried: dict[float, float] = {result.values[name]: 0.0}
    begin = [best]

    def rise(value: float) -> float:
        """Return the increase of chi2 with the parameter held, from the last fit's end."""
        if value not in tried:
            held = problem.holding(name, value)
            solution = held.minimise(begin=begin[0])
            begin[0] = solution.x
            tried[value] = 2.0 * (solution.cost - floor)
        return tried[value]

    step = result.anchored_stderr.get(name, result.stderr[name])
    if not np.isfinite(step) or step <= 0.0:
        step = 0.1 * max(abs(result.values[name]), parameter.scale)
    # Student's quantile for the normal one, where the noise was estimated
    widened = (result.quantile(level) / special.ndtri(0.5 + 0.5 * level)) ** 2

    def excess(value: float) -> float:
        """Return by how much the root of the rise is more than allowed."""
        distance = _from_bound(parameter, value, result.values[name], step)
        limit = widened * allowed_rise(distance, level)
        return float(np.sqrt(max(rise(value), 0.0)) - np.sqrt(limit))

    ends = []
    for sense, bound in ((-1.0, parameter.low), (1.0, parameter.high)):
        begin[0] = best
        ends.append(_end(excess, result.values[name], sense * step, bound))
    order = sorted(tried)
    return LikelihoodProfile(
        name=name,
        value=result.values[name],
        low=ends[0][0],
        high=ends[1][0],
        low_open=ends[0][1],
        high_open=ends[1][1],
        level=level,
        points=np.array(order),
        rise=np.array([tried[value] for value in order]),
    )


@lru_cache(maxsize=4096)
def _rise_at(distance: float, level: float) -> float:
    def coverage(limit: float) -> float:
        half = np.sqrt(limit)
        lowest = -half
        if half > distance:
            # Beyond the bound the fit stands on it, and the rise is d^2 - 2 d x
            lowest = (distance**2 - limit) / (2.0 * distance) - distance
        return float(special.ndtr(half) - special.ndtr(lowest) - level)

    most = float(special.ndtri(0.5 + 0.5 * level) ** 2)
    return float(optimize.brentq(coverage, 1e-6, most)) if coverage(most) > 0.0 else most


def allowed_rise(distance: float, level: float = 0.95) -> float:
    """Return the rise of chi2 inside an interval of this confidence.

    Parameters
    ----------
    distance : float
        Of the value from the parameter's bound, in standard errors.
    level : float
        Confidence.

    Examples
    --------
    >>> round(allowed_rise(5.0), 3), round(allowed_rise(0.0), 3)
    (3.841, 2.706)
    """
    # Towards 0 the equation degenerates; its root does not
    return _rise_at(round(max(distance, 1e-4), 4), level)


def _from_bound(parameter: Parameter, value: float, best: float, stderr: float) -> float:
    """Return how many standard errors a value is from the nearer bound."""
    if parameter.squared:
        # The square has the normal error
        unit = stderr * max(2.0 * best, stderr)
        return (value**2 - parameter.low**2) / unit
    return min(value - parameter.low, parameter.high - value) / stderr


def _end(
    excess: Callable[[float], float], value: float, step: float, bound: float
) -> tuple[float, bool]:
    """Return where the rise reaches what is allowed and False, or the bound and True."""
    inside, outside = value, value
    for _ in range(_REACH):
        outside = value + 2.0 * step
        beyond = outside <= bound if step < 0.0 else outside >= bound
        outside = bound if beyond else outside
        if excess(outside) >= 0.0:
            # The root of the rise is nearly straight, so few fits are needed
            xtol = 1e-3 * abs(step)
            return float(optimize.brentq(excess, inside, outside, xtol=xtol)), False
        if beyond:
            return bound, True
        inside, step = outside, 2.0 * step
    return (-np.inf if step < 0.0 else np.inf), True
