"""What any solver hands back: a point, its cost and why it stopped, never an exception."""

from dataclasses import dataclass

import numpy as np

from fitting.objective.objective import Objective

__all__ = ["Solution", "better", "early_end"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Solution:
    """End of one minimisation.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Best point reached, inside the bounds.
    cost : float
        Cost there.
    converged : bool
        True if the solver met its own test of a minimum.
    status : str
        The reason it stopped, in words.
    solver : str
        Library and algorithm.
    n_evaluations : int
        How often the cost was computed.
    """

    x: np.ndarray
    cost: float
    converged: bool
    status: str
    solver: str
    n_evaluations: int


def early_end(objective: Objective, solver: str) -> Solution | None:
    """Return the end of a search that cannot begin, or None if it can."""
    start = objective.start
    cost = objective.cost(start)
    if not np.isfinite(cost):
        status = "stopped: the curve is not finite at the start"
    elif np.array_equal(objective.low, objective.high):
        status = "converged: nothing is free"
    else:
        return None
    return Solution(
        x=start,
        cost=cost,
        converged=status.startswith("converged"),
        status=status,
        solver=solver,
        n_evaluations=1,
    )


def better(first: Solution, second: Solution) -> Solution:
    """Return the solution of lower cost; a converged one wins a tie within rounding."""
    if np.isclose(first.cost, second.cost, rtol=1e-12, atol=0.0):
        return second if second.converged and not first.converged else first
    return first if first.cost < second.cost else second
