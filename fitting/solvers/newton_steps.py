"""The last steps to a minimum, and the proof that it is one, on the exact Hessian."""

import numpy as np

from fitting.objective.objective import Objective
from fitting.solvers.solution import Solution

__all__ = ["newton"]

_STEPS = 25
_HALVINGS = 12
# Least curvature of a minimum, in steps of equal effect
_FLAT = 1e-9
_BESIDE = 1e-5


def newton(objective: Objective, x: np.ndarray) -> Solution | None:
    """Return the minimum that exact Newton steps from x reach, None if they reach none.

    On a bound the gradient must press outwards; inside, the Hessian must be positive. Where
    it is not yet, the step goes down along its negative directions too.
    """
    squared = np.array([parameter.squared for parameter in objective.parameters])
    # The cost of readings that are met to their last digits
    exact = 1e-28 * float(np.square(objective.data / objective.stderr).sum())
    for count in range(1, _STEPS + 1):
        cost, gradient = objective.cost_gradient(x)
        # At 0 the curve is flat in what acts by its square: judge by the slope beside it
        beside = np.where(squared & (x < _BESIDE), _BESIDE, x)
        outward = gradient
        if not np.array_equal(beside, x):
            outward = objective.cost_gradient(beside)[1]
        pressed = ((x <= objective.low) & (outward > 0.0)) | (
            (x >= objective.high) & (outward < 0.0)
        )
        inside = np.flatnonzero(~pressed)
        bend = objective.hessian(x)[np.ix_(inside, inside)]
        unit = np.sqrt(np.abs(np.diag(bend)))
        if not np.isfinite(bend).all() or not unit.all():
            return None
        values, vectors = np.linalg.eigh(bend / np.outer(unit, unit))
        along = vectors.T @ (gradient[inside] / unit)
        curved = np.maximum(np.abs(values), _FLAT)
        step = np.zeros(len(x))
        step[inside] = -vectors @ (along / curved) / unit
        # What the step gains, by the parabola that the derivatives make
        gain = 0.5 * float((along**2 / curved).sum())
        there, reached = _lower(objective, x, cost, step)
        is_minimum = not len(values) or values[0] >= _FLAT
        lost = reached > cost
        if is_minimum and (gain <= 1e-15 * cost + exact or (gain <= 1e-12 * cost and lost)):
            return Solution(
                x=x if lost else there,
                cost=min(cost, reached),
                converged=True,
                status="converged",
                solver="casadi/newton",
                n_evaluations=count,
            )
        if lost:
            return None
        x = there
    return None


def _lower(
    objective: Objective, x: np.ndarray, cost: float, step: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return the end of the step, or of the part of it that leads down, and its cost."""
    for halving in range(_HALVINGS):
        there = np.clip(x + 0.5**halving * step, objective.low, objective.high)
        reached = objective.cost(there)
        if reached <= cost:
            break
    return there, reached
