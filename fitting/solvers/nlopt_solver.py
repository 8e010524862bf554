"""Minimise an objective with nlopt: local with exact gradients, without any, or global."""

from dataclasses import replace
from typing import Any

import numpy as np

from fitting.objective.objective import Objective
from fitting.solvers.solution import Solution, better, early_end

__all__ = ["refine_nlopt", "search_nlopt", "solve_nlopt"]

_REASONS = {
    1: "converged",
    2: "converged: cost reached the wanted value",
    3: "converged",
    4: "converged",
    5: "stopped at the limit of evaluations",
    6: "stopped at the time limit",
}


def solve_nlopt(objective: Objective, *, max_evaluations: int = 2000) -> Solution:
    """Return the lowest minimum that nlopt [1]_ reaches from the start, inside the bounds.

    Two searches run from the start and the better one counts: SLSQP with the exact
    gradient, and Subplex without derivatives, then SLSQP; what traps one rarely traps both.
    SLSQP is repeated in variables in which the Gauss-Newton Hessian is the unit matrix, so
    narrow valleys cost no digits.

    Parameters
    ----------
    objective : Objective
        The problem.
    max_evaluations : int
        Limit of each stage.

    Returns
    -------
    Solution
        With `converged` False and the reason in `status` where there is no minimum.

    References
    ----------
    .. [1] S. G. Johnson, The NLopt nonlinear-optimization package.
    """
    ended = early_end(objective, "nlopt")
    if ended is not None:
        return ended
    start = objective.start
    counts = [0]
    best = _polish(objective, start, max_evaluations, counts)
    if not objective.prediction.is_linear:
        detour = _simplex(objective, start, max_evaluations, counts)
        best = better(best, _polish(objective, detour, max_evaluations, counts))
    return replace(best, n_evaluations=counts[0])


class _Stage:
    """One run of one algorithm in variables u, x = origin + transform @ u.

    nlopt reports some ends as exceptions and loses the point; the best one is kept here.
    """

    def __init__(
        self, objective: Objective, origin: np.ndarray, transform: np.ndarray
    ) -> None:
        self.objective, self.origin, self.transform = objective, origin, transform
        self.best_cost = objective.cost(origin)
        self.best_x = origin
        self.norm = self.best_cost if self.best_cost > 0.0 else 1.0
        self.count = 0

    def x(self, u: np.ndarray) -> np.ndarray:
        inside = self.origin + self.transform @ u
        return np.clip(inside, self.objective.low, self.objective.high)

    def __call__(self, u: np.ndarray, gradient: np.ndarray) -> float:
        self.count += 1
        # SLSQP proposes NaN after a step without curvature
        if not np.isfinite(u).all():
            gradient[:] = 0.0
            return 1e10
        x = self.x(u)
        cost, slope = self.objective.cost_gradient(x)
        if gradient.size:
            slope = np.nan_to_num(slope, posinf=0.0, neginf=0.0)
            gradient[:] = self.transform.T @ slope / self.norm
        if cost < self.best_cost:
            self.best_cost, self.best_x = cost, x
        # A large finite number: infinities break the line searches
        return min(cost / self.norm, 1e10)

    def run(self, optimizer: Any) -> tuple[bool, str]:
        """Optimise from u = 0; return whether it converged and the reason it stopped."""
        import nlopt

        # Versions differ in the base class of what they raise
        refusal = getattr(nlopt.nlopt, "exception", RuntimeError)
        optimizer.set_min_objective(self)
        try:
            optimizer.optimize(np.zeros(len(self.origin)))
        except nlopt.RoundoffLimited:
            return True, "converged to rounding error"
        except (refusal, RuntimeError, ValueError) as error:
            reason = str(error) or "nlopt found no step that reduces the cost"
            return False, f"stopped: {reason}"
        code = optimizer.last_optimize_result()
        return 0 < code < 5, _REASONS.get(code, f"stopped: nlopt code {code}")


def _bounded(
    algorithm: int, objective: Objective, origin: np.ndarray, sizes: np.ndarray, limit: int
) -> Any:
    """Return an optimiser in variables (x - origin) / sizes with the box in them."""
    import nlopt

    optimizer = nlopt.opt(algorithm, len(origin))
    optimizer.set_lower_bounds((objective.low - origin) / sizes)
    optimizer.set_upper_bounds((objective.high - origin) / sizes)
    optimizer.set_maxeval(limit)
    return optimizer


def _polish(objective: Objective, x: np.ndarray, limit: int, counts: list[int]) -> Solution:
    """Run SLSQP in the parameters' own sizes, then in whitened variables until it rests."""
    import nlopt

    sizes = objective.sizes(x)
    stage = _Stage(objective, x, np.diag(sizes))
    optimizer = _bounded(nlopt.LD_SLSQP, objective, x, sizes, limit)
    _exact(optimizer)
    converged, status = stage.run(optimizer)
    counts[0] += stage.count
    for _ in range(8):
        # Nothing is left to reduce, and nothing to scale by
        if stage.best_cost == 0.0:
            converged, status = True, "converged"
            break
        before = stage.best_cost
        stage = _Stage(objective, stage.best_x, objective.whitening(stage.best_x))
        optimizer = nlopt.opt(nlopt.LD_SLSQP, len(x))
        optimizer.set_maxeval(max(limit // 4, 1))
        _exact(optimizer)
        _add_box(optimizer, objective, stage)
        again, status_again = stage.run(optimizer)
        counts[0] += stage.count
        if again:
            converged, status = again, status_again
        if stage.best_cost >= before * (1.0 - 1e-13):
            break
    # SLSQP also fails when it starts in the minimum and finds no step down
    if not converged and objective.is_at_rest(stage.best_x):
        converged, status = True, "converged"
    return Solution(
        x=stage.best_x,
        cost=stage.best_cost,
        converged=converged,
        status=status,
        solver="nlopt/slsqp",
        n_evaluations=counts[0],
    )


def _exact(optimizer: Any) -> None:
    """Let the gradient decide the end, not a tolerance."""
    optimizer.set_xtol_rel(1e-13)
    optimizer.set_ftol_rel(1e-16)


def _add_box(optimizer: Any, objective: Objective, stage: _Stage) -> None:
    """State the bounds as linear constraints of the whitened variables."""
    lower, upper = np.isfinite(objective.low), np.isfinite(objective.high)
    rows = np.vstack([-stage.transform[lower], stage.transform[upper]])
    room = np.concatenate(
        [(stage.origin - objective.low)[lower], (objective.high - stage.origin)[upper]]
    )
    if not len(rows):
        return
    size = np.linalg.norm(rows, axis=1)
    rows, room = rows / size[:, None], room / size

    def outside(result: np.ndarray, u: np.ndarray, gradient: np.ndarray) -> None:
        result[:] = rows @ u - room
        if gradient.size:
            gradient[:] = rows

    optimizer.add_inequality_mconstraint(outside, np.full(len(rows), 1e-14))


def _simplex(
    objective: Objective, x: np.ndarray, limit: int, counts: list[int]
) -> np.ndarray:
    """Run Subplex, a derivative-free simplex search on subspaces, and return its point."""
    import nlopt

    sizes = objective.sizes(x)
    stage = _Stage(objective, x, np.diag(sizes))
    optimizer = _bounded(nlopt.LN_SBPLX, objective, x, sizes, limit)
    optimizer.set_initial_step(0.3)
    # SLSQP finds the digits
    optimizer.set_xtol_rel(1e-3)
    stage.run(optimizer)
    counts[0] += stage.count
    return stage.best_x


def refine_nlopt(objective: Objective, *, max_evaluations: int = 2000) -> Solution:
    """Return the minimum next to a start that is nearly one: SLSQP alone."""
    counts = [0]
    ended = early_end(objective, "nlopt")
    return ended or _polish(objective, objective.start, max_evaluations, counts)


def search_nlopt(
    objective: Objective, search: str, *, max_evaluations: int = 5000, seed: int = 0
) -> np.ndarray:
    """Search the whole box of the bounds and return the best point, not yet polished.

    Parameters
    ----------
    objective : Objective
        The problem, all bounds finite.
    search : {"crs", "mlsl"}
        Controlled random search, or multi-level single linkage with a low-discrepancy
        sequence and SLSQP.
    max_evaluations : int
        Limit of the search.
    seed : int
        Seed of its random numbers.
    """
    import nlopt

    algorithm = {"crs": nlopt.GN_CRS2_LM, "mlsl": nlopt.G_MLSL_LDS}[search]
    nlopt.srand(seed + 1)
    x = objective.start
    width = objective.high - objective.low
    sizes = np.where(width > 0.0, width, 1.0)
    stage = _Stage(objective, x, np.diag(sizes))
    optimizer = _bounded(algorithm, objective, x, sizes, max_evaluations)
    if search == "mlsl":
        local = nlopt.opt(nlopt.LD_SLSQP, len(x))
        local.set_xtol_rel(1e-6)
        optimizer.set_local_optimizer(local)
    optimizer.set_xtol_rel(1e-6)
    stage.run(optimizer)
    return stage.best_x
