"""Intervals that may be lopsided or open: how the misfit rises as one parameter is pulled.

The parameter is held at a value and all others are fitted again. Where the misfit rises by
the square of the normal (or Student's) quantile, the interval ends [1]_. If it never rises
that far before a bound, the data leave that side open, and no standard error can say so.

References
----------
.. [1] D. M. Bates, D. G. Watts, Nonlinear Regression Analysis, 1988, section 6.1.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize

from fitting.result import FitResult

__all__ = ["LikelihoodProfile", "profile_likelihood"]

# Doublings of the step outwards before a side is called open
_REACH = 12


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

    def __str__(self) -> str:
        low = f"{self.low:.4g} (open)" if self.low_open else f"{self.low:.4g}"
        high = f"{self.high:.4g} (open)" if self.high_open else f"{self.high:.4g}"
        return f"{self.name} = {self.value:.4g}, {self.level:.0%}: {low} .. {high}"


def profile_likelihood(
    result: FitResult, name: str, *, level: float = 0.95
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

    limit = result.quantile(level) ** 2
    step = result.stderr[name]
    if not np.isfinite(step) or step <= 0.0:
        step = 0.1 * max(abs(result.values[name]), parameter.scale)
    ends = []
    for sense, bound in ((-1.0, parameter.low), (1.0, parameter.high)):
        begin[0] = best
        ends.append(_end(rise, result.values[name], sense * step, bound, limit))
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


def _end(
    rise: Callable[[float], float], value: float, step: float, bound: float, limit: float
) -> tuple[float, bool]:
    """Return where the rise reaches the limit and False, or the bound and True."""
    inside, outside = value, value
    for _ in range(_REACH):
        outside = value + 2.0 * step
        beyond = outside <= bound if step < 0.0 else outside >= bound
        outside = bound if beyond else outside
        if rise(outside) >= limit:
            # The root of the rise is nearly straight, so few fits are needed
            root = optimize.brentq(
                lambda v: np.sqrt(max(rise(v), 0.0)) - np.sqrt(limit),
                inside,
                outside,
                xtol=1e-3 * abs(step),
            )
            return float(root), False
        if beyond:
            return bound, True
        inside, step = outside, 2.0 * step
    return (-np.inf if step < 0.0 else np.inf), True
