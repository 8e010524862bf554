"""Minimise an objective with CasADi: IPOPT on exact derivatives, DAQP if linear."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np

from fitting.objective.objective import Objective, Prediction
from fitting.solvers.descent import descend
from fitting.solvers.newton_steps import newton
from fitting.solvers.solution import Solution, better, early_end

if TYPE_CHECKING:
    import casadi

__all__ = ["refine_casadi", "solve_casadi"]

_SOLVERS: "WeakKeyDictionary[Prediction, dict[str, casadi.Function]]" = WeakKeyDictionary()

_IPOPT_OPTIONS = {
    "print_time": False,
    "show_eval_warnings": False,
    "error_on_fail": False,
    # The sensitivity to the data, which no one asks for and whose failure is printed
    "calc_lam_p": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-11,
    # Rounding can keep the gradient above the tolerance: rest counts as an end too
    "ipopt.acceptable_tol": 1e-9,
    "ipopt.acceptable_iter": 10,
    "ipopt.bound_relax_factor": 0.0,
}

_RIDGE = 1e-11

_STATUS = {
    "Solve_Succeeded": "converged",
    "Solved_To_Acceptable_Level": "converged to rounding error",
    "Search_Direction_Becomes_Too_Small": "converged to rounding error",
    "Maximum_Iterations_Exceeded": "stopped at the iteration limit",
    "Diverging_Iterates": "stopped: the parameters ran away without a minimum",
    "Restoration_Failed": "stopped: no step reduced the cost",
    "Invalid_Number_Detected": "stopped: the curve or a derivative is not finite",
}


def solve_casadi(
    objective: Objective, *, max_iterations: int = 500, passes: int = 8
) -> Solution:
    """Return the minimum nearest to the start, inside the bounds.

    A curve that is linear in its parameters is solved exactly as a bounded quadratic
    programme. Any other is led down on the exact Jacobian; where the exact Hessian then
    shows a minimum a few Newton steps away, those end the search. Else IPOPT [1]_ goes on
    with exact gradient and Hessian, restarted with rescaled parameters until the cost no
    longer falls: its stopping test is relative to the scaling, so one pass can stop a long
    way up a narrow valley.

    Parameters
    ----------
    objective : Objective
        The problem.
    max_iterations : int
        IPOPT iterations in each pass.
    passes : int
        Limit of the restarts.

    Returns
    -------
    Solution
        With `converged` False and the reason in `status` where there is no minimum.

    References
    ----------
    .. [1] A. Wächter, L. T. Biegler, Math. Program. 106, 25-57 (2006).
    """
    ended = early_end(objective, "casadi")
    if ended is not None:
        return ended
    if objective.prediction.is_linear and objective.loss == "linear":
        return _solve_linear(objective)
    start, count = descend(objective)
    found = newton(objective, start)
    if found is None:
        found = _solve_ipopt(objective.started_at(start), max_iterations, passes)
    return replace(found, n_evaluations=found.n_evaluations + count)


def refine_casadi(objective: Objective) -> Solution:
    """Return the minimum next to a start that is nearly one, with little patience.

    A proven minimum under slightly other weights: steps on the Jacobian go on to the end.
    """
    linear = objective.prediction.is_linear and objective.loss == "linear"
    if linear or early_end(objective, "casadi") is not None:
        return solve_casadi(objective)
    x, count = descend(objective, enough=1e-15, damping=1e-6)
    if not objective.is_at_rest(x):
        return solve_casadi(objective.started_at(x), passes=3)
    return Solution(
        x=x,
        cost=objective.cost(x),
        converged=True,
        status="converged",
        solver="casadi/levenberg-marquardt",
        n_evaluations=count,
    )


def _solve_ipopt(objective: Objective, max_iterations: int, passes: int) -> Solution:
    """Run IPOPT in units of the parameters' size, then of the steps that matter.

    Where the exact Hessian leads nowhere better, the Gauss-Newton one, which never bends
    the wrong way, gets a try before the search ends.
    """
    start = objective.start
    best = Solution(
        x=start,
        cost=objective.cost(start),
        converged=False,
        status="stopped: no step reduced the cost",
        solver="casadi/ipopt",
        n_evaluations=0,
    )
    scale, count, gauss_newton = objective.sizes(start), 0, False
    for attempt in range(passes):
        solver = _ipopt(objective, max_iterations, gauss_newton=gauss_newton)
        found, evaluations = _pass(objective, solver, best, scale)
        count += evaluations
        previous, best = best, better(found, best)
        if objective.is_at_rest(best.x):
            break
        if attempt > 0 and best.cost >= previous.cost * (1.0 - 1e-10):
            if gauss_newton:
                break
            gauss_newton = True
        scale = objective.step_sizes(best.x)
    if not best.converged and objective.is_at_rest(best.x):
        best = replace(best, converged=True, status="converged to rounding error")
    return replace(best, n_evaluations=count)


def _pass(
    objective: Objective, solver: "casadi.Function", begin: Solution, scale: np.ndarray
) -> tuple[Solution, int]:
    """Run IPOPT once from `begin` and return where it ended, and how often it looked."""
    norm = begin.cost if begin.cost > 0.0 else 1.0
    squared = _squared(objective)
    # A step of the same length for a parameter of which the square is varied
    units = np.where(squared, scale * (2.0 * np.abs(begin.x) + scale), scale)

    def inwards(x: np.ndarray) -> np.ndarray:
        return np.asarray(np.where(squared, x * np.abs(x), x) / units)

    answer = solver(
        x0=inwards(begin.x),
        p=np.concatenate([objective.numbers, units, [norm]]),
        lbx=inwards(objective.low),
        ubx=inwards(objective.high),
    )
    stats = solver.stats()
    count = stats.get("n_call_nlp_f", 0)
    u = answer["x"].full().ravel() * units
    u = np.where(squared, np.sqrt(np.abs(u)), u)
    x = np.clip(u, objective.low, objective.high)
    if not np.isfinite(x).all():
        return begin, count
    x = _snapped(objective, x)
    word = stats["return_status"]
    status = _STATUS.get(word, f"stopped: {word}")
    converged = status.startswith("converged")
    cost = objective.cost(x)
    return replace(begin, x=x, cost=cost, converged=converged, status=status), count


def _squared(objective: Objective) -> np.ndarray:
    """Tell which parameters the solver varies by their square, shape (n,)."""
    return np.array([parameter.squared for parameter in objective.parameters])


def _snapped(objective: Objective, x: np.ndarray) -> np.ndarray:
    """Put parameters on the bounds they are next to, if the cost does not notice.

    IPOPT stops a hair inside a bound it is pressed against, and further inside where the
    cost is flat, as it is in kappa near 0.
    """
    near = 1e-4 * np.array([parameter.scale for parameter in objective.parameters])
    cost = objective.cost(x)
    for i in range(len(x)):
        for bound in (objective.low[i], objective.high[i]):
            if 0.0 < abs(x[i] - bound) < near[i]:
                there = x.copy()
                there[i] = bound
                if objective.cost(there) <= cost * (1.0 + 1e-12):
                    x = there
    return x


def _ipopt(
    objective: Objective, max_iterations: int, *, gauss_newton: bool
) -> "casadi.Function":
    """Return the IPOPT solver of this curve and loss, built at the first use."""
    import casadi

    cache = _SOLVERS.setdefault(objective.prediction, {})
    squared = _squared(objective)
    key = f"{objective.loss} {max_iterations} {gauss_newton} {squared.tolist()}"
    if key not in cache:
        expressions = objective.expressions
        n = expressions.x.numel()
        u, scale, norm = casadi.MX.sym("u", n), casadi.MX.sym("s", n), casadi.MX.sym("c")
        entries = casadi.vertsplit(u * scale)
        x = casadi.vertcat(
            *(casadi.sqrt(v) if s else v for v, s in zip(entries, squared, strict=True))
        )
        cost = casadi.substitute(expressions.cost, expressions.x, x)
        p = casadi.vertcat(expressions.p, scale, norm)
        options: dict[str, Any] = {**_IPOPT_OPTIONS, "ipopt.max_iter": max_iterations}
        if gauss_newton:
            weight, none = casadi.MX.sym("w"), casadi.MX.sym("g", 0)
            curvature = casadi.substitute(expressions.gauss_newton, expressions.x, x)
            slope = casadi.jacobian(x, u)
            hessian = weight / norm * slope.T @ curvature @ slope
            options["hess_lag"] = casadi.Function(
                "nlp_hess_l",
                [u, p, weight, none],
                [casadi.triu(hessian)],
                ["x", "p", "lam_f", "lam_g"],
                ["triu_hess_gamma_x_x"],
            )
        problem = {"x": u, "p": p, "f": cost / norm}
        cache[key] = casadi.nlpsol("fit", "ipopt", problem, options)
    return cache[key]


def _solve_linear(objective: Objective) -> Solution:
    """Solve min |A x - b| in the bounds: DAQP for the active set, QR for the digits."""
    import casadi

    start = objective.start
    prior_weight = 1.0 / np.array([p.prior_stderr for p in objective.parameters])
    prior_value = np.array([p.prior_value for p in objective.parameters])
    known = prior_weight > 0.0
    matrix = np.vstack([objective.jacobian(start), np.diag(prior_weight)[known]])
    target = matrix[: len(objective.data)] @ start - objective.residuals(start)
    target = np.concatenate([target, (prior_weight * prior_value)[known]])
    # Columns of unit length, or the normal equations lose half the digits twice
    length = np.linalg.norm(matrix, axis=0)
    length = np.where(length > 0.0, length, 1.0)
    unit = matrix / length
    low, high, begin = (v * length for v in (objective.low, objective.high, start))
    # The ridge leaves what the data do not see at the start; QR below takes it off the rest
    hessian = casadi.DM(unit.T @ unit + _RIDGE * np.eye(len(start)))
    gradient = -(unit.T @ target) - _RIDGE * begin
    # qpOASES would do as well, but prints its licence at every call
    options: dict[str, Any] = {"error_on_fail": False}
    solver = casadi.conic("gains", "daqp", {"h": hessian.sparsity()}, options)
    answer = solver(h=hessian, g=gradient, lbx=low, ubx=high)
    if not solver.stats()["success"]:
        return Solution(
            x=start,
            cost=objective.cost(start),
            converged=False,
            status=f"stopped: {solver.stats()['return_status']}",
            solver="casadi/daqp",
            n_evaluations=1,
        )
    y = np.clip(answer["x"].full().ravel(), low, high)
    margin = 1e-9 * (1.0 + np.linalg.norm(target))
    inside = (y - low > margin) & (high - y > margin)
    y = np.where(inside, y, np.where(y - low <= high - y, low, high))
    rest = target - unit @ y
    y[inside] += np.linalg.lstsq(unit[:, inside], rest, rcond=1e-9)[0]
    x = np.clip(y / length, objective.low, objective.high)
    return Solution(
        x=x,
        cost=objective.cost(x),
        converged=True,
        status="converged",
        solver="casadi/daqp",
        n_evaluations=1,
    )
