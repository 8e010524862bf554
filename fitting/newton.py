"""The last steps to a minimum, and the proof that it is one, on the exact Hessian."""

import numpy as np

from fitting.objective import Objective
from fitting.solution import Solution

__all__ = ["newton"]

_STEPS = 8
# Least curvature of a minimum, in steps of equal effect
_FLAT = 1e-9
_BESIDE = 1e-5


def newton(objective: Objective, x: np.ndarray) -> Solution | None:
    """Return the minimum that exact Newton steps from x reach, None if there is none near.

    On a bound the gradient must press outwards; inside, the Hessian must be positive.
    """
    squared = np.array([parameter.squared for parameter in objective.parameters])
    hessian = objective.expressions.hessian
    # The cost of readings that are met to their last digits
    exact = 1e-28 * float(np.square(objective.data / objective.stderr).sum())
    for step in range(_STEPS):
        cost, gradient = objective.cost_gradient(x)
        # At 0 the curve is flat in what acts by its square: judge by the slope beside it
        beside = np.where(squared & (x < _BESIDE), _BESIDE, x)
        outward = np.where(beside == x, gradient, objective.cost_gradient(beside)[1])
        pressed = ((x <= objective.low) & (outward > 0.0)) | (
            (x >= objective.high) & (outward < 0.0)
        )
        inside = np.flatnonzero(~pressed)
        bend = hessian(x, objective.numbers).full()[np.ix_(inside, inside)]
        unit = np.sqrt(np.maximum(np.diag(bend), 0.0))
        if not np.isfinite(bend).all() or not unit.all():
            return None
        values, vectors = np.linalg.eigh(bend / np.outer(unit, unit))
        if len(values) and values[0] < _FLAT:
            return None
        along = vectors.T @ (gradient[inside] / unit)
        there = x.copy()
        there[inside] -= vectors @ (along / values) / unit
        there = np.clip(there, objective.low, objective.high)
        # What the step gains, by the parabola that the derivatives make
        gain = 0.5 * float((along**2 / values).sum())
        reached = objective.cost(there)
        if reached <= cost:
            x = there
        if gain <= 1e-15 * cost + exact or (gain <= 1e-12 * cost and reached > cost):
            return Solution(
                x=x,
                cost=min(cost, reached),
                converged=True,
                status="converged",
                solver="casadi/newton",
                n_evaluations=step + 1,
            )
        if reached > cost:
            return None
    return None
