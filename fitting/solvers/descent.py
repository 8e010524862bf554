"""A quick way down: Levenberg-Marquardt steps on the exact Jacobian, inside the bounds.

A Jacobian costs a tenth of a Hessian, and far from the minimum it serves as well. The end
is where the solvers of record begin; they prove that it is a minimum.

References
----------
.. [1] J. J. Moré, The Levenberg-Marquardt algorithm, Lecture Notes in Mathematics 630,
   105-116 (1978): the scaling, and the damping by what the last step achieved.
"""

import numpy as np

from fitting.objective.objective import Objective

__all__ = ["descend"]

# Damping beyond which no step leads down
_STUCK = 1e8
# Part of its size by which a parameter may change in one step
_REACH = 0.5
# Part of the fall that is enough, below which no step is tried
_VAIN = 0.01
# Part of the cost that rounding hides: the gradient alone judges such steps
_ROUNDING = 1e-12
# A parameter of which the square is varied must not stand still at 0
_LEAST = 1e-5


def descend(
    objective: Objective,
    *,
    steps: int = 40,
    enough: float = 1e-10,
    damping: float = 1e-3,
) -> tuple[np.ndarray, int]:
    """Return a point of low cost below the start, and how often the cost was computed.

    Parameters
    ----------
    objective : Objective
        The problem.
    steps : int
        Limit of the steps.
    enough : float
        Fall of the cost, as a part of it, that is not worth another step.
    damping : float
        Of the first step; small where the start is nearly the minimum.
    """
    squared = np.array([parameter.squared for parameter in objective.parameters])
    x = objective.start
    cost, count, unseen = objective.cost(x), 1, 0.0
    for _ in range(steps):
        gradient, curvature, unit = _quadratic(objective, x, squared)
        pressed = ((x <= objective.low) & (gradient > 0.0)) | (
            (x >= objective.high) & (gradient < 0.0)
        )
        free = ~pressed & (unit > 0.0)
        finite = np.isfinite(curvature).all() and np.isfinite(gradient).all()
        if not free.any() or not finite:
            break
        while damping < _STUCK:
            damped = curvature[np.ix_(free, free)] + damping * np.eye(free.sum())
            move = np.zeros(len(x))
            move[free] = np.linalg.solve(damped, -gradient[free])
            there = _moved(objective, x, move / np.where(unit > 0.0, unit, 1.0), squared)
            there = x + _shortened(objective, x, there - x)
            fall = _foretold(gradient, curvature, move)
            if fall <= _VAIN * enough * cost or (unseen and fall > 0.1 * unseen):
                return x, count
            # A step that the damping has crushed foretells nothing
            unseen = fall if fall <= _ROUNDING * cost and damping < 1.0 else 0.0
            if unseen:
                reached = cost
                break
            reached, count = objective.cost(there), count + 1
            if reached < cost:
                break
            damping *= 10.0
        else:
            break
        fall, x, cost = cost - reached, there, reached
        damping = max(0.1 * damping, 1e-12)
        if not unseen and fall <= enough * cost:
            break
    return x, count


def _foretold(gradient: np.ndarray, curvature: np.ndarray, move: np.ndarray) -> float:
    """Return the fall of the cost that the parabola promises."""
    return -float(gradient @ move + 0.5 * move @ curvature @ move)


def _quadratic(
    objective: Objective, x: np.ndarray, squared: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return gradient and Gauss-Newton Hessian in steps of equal effect, and their unit."""
    point = np.where(squared, np.maximum(np.abs(x), _LEAST), x)
    jacobian = objective.jacobian(point)
    residual = objective.residuals(x)
    pull, share = residual, np.ones(len(residual))
    if objective.loss != "linear":
        pull = objective.influence(x)[0]
        share = np.where(residual != 0.0, pull / np.where(residual, residual, 1.0), 1.0)
    # d/d(x^2) = d/dx / 2x
    jacobian = np.where(squared, jacobian / np.where(squared, 2.0 * point, 1.0), jacobian)
    known = np.array([1.0 / parameter.prior_stderr for parameter in objective.parameters])
    prior = np.array([parameter.prior_value for parameter in objective.parameters])
    gradient = jacobian.T @ pull + known**2 * (x - prior)
    curvature = (jacobian * share[:, None]).T @ jacobian + np.diag(known**2)
    unit = np.sqrt(np.maximum(np.diag(curvature), 0.0))
    safe = np.where(unit > 0.0, unit, 1.0)
    return gradient / safe, curvature / np.outer(safe, safe), unit


def _shortened(objective: Objective, x: np.ndarray, move: np.ndarray) -> np.ndarray:
    """Return the step, shorter where it would take a parameter far from its own size."""
    natural = np.array([parameter.scale for parameter in objective.parameters])
    reach = _REACH * np.maximum(np.abs(x), natural)
    return move * min(1.0, float((reach / np.maximum(np.abs(move), 1e-300)).min()))


def _moved(
    objective: Objective, x: np.ndarray, move: np.ndarray, squared: np.ndarray
) -> np.ndarray:
    """Return the point after a step, in the square of those parameters that ask for it."""
    straight = x + move
    bent = np.sqrt(np.maximum(x * np.abs(x) + move, 0.0))
    return np.clip(np.where(squared, bent, straight), objective.low, objective.high)
