"""Search the whole box of the bounds before a solver polishes what it finds."""

from dataclasses import replace

import numpy as np
from scipy.stats import qmc

from fitting.objective.objective import Objective
from fitting.objective.parameters import Parameter
from fitting.solvers.nlopt_solver import search_nlopt

__all__ = ["SEARCHES", "boxed", "starts"]

SEARCHES = ("multistart", "crs", "mlsl")

# Points looked at, of which the best are followed
_SCREENED = 256


def starts(
    objective: Objective, search: str | None, *, seed: int = 0, count: int = 5
) -> list[np.ndarray]:
    """Return the points from which a local solver should run.

    Parameters
    ----------
    objective : Objective
        Problem; its own start comes first.
    search : {None, "multistart", "crs", "mlsl"}
        None for the own start alone; "multistart" adds the best points of a Halton sequence
        over the box; the others add the best point of nlopt's controlled random search or
        multi-level single linkage. Open bounds are closed at ten times the natural size.
    seed : int
        Makes the search reproducible.
    count : int
        Number of starts of "multistart".
    """
    own = objective.start
    if search is None:
        return [own]
    if search not in SEARCHES:
        msg = f"search must be one of {', '.join(SEARCHES)}, got {search!r}. None is local."
        raise ValueError(msg)
    box = [boxed(parameter) for parameter in objective.parameters]
    if search != "multistart":
        found = search_nlopt(objective.with_parameters(box), search, seed=seed)
        return [own, found]
    points = qmc.Halton(len(own), rng=np.random.default_rng(seed)).random(_SCREENED)
    low = np.array([parameter.low for parameter in box])
    high = np.array([parameter.high for parameter in box])
    inside = low + points * (high - low)
    order = np.argsort([objective.cost(point) for point in inside])
    return [own, *inside[order[:count]]]


def boxed(parameter: Parameter) -> Parameter:
    """Return the parameter with both bounds finite."""
    reach = 10.0 * max(abs(parameter.value), parameter.scale)
    low = parameter.low if np.isfinite(parameter.low) else parameter.value - reach
    high = parameter.high if np.isfinite(parameter.high) else parameter.value + reach
    return replace(parameter, low=low, high=high)
