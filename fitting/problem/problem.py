"""A fit put together from its parts, so that it can be solved again with changes.

Profiles, comparisons and the study of what the data cannot tell all solve variants of one
problem; this is the problem they share.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fitting.objective.forward import Layout, MuellerModel, predict
from fitting.objective.objective import Objective, Prediction
from fitting.objective.parameters import Parameter
from fitting.objective.uncertainty import covariance_rows
from fitting.problem.gauge import Gauge, within_bounds
from fitting.readings.aperture import Cones
from fitting.readings.noise import Weights
from fitting.readings.observations import Observations
from fitting.solvers.casadi_solver import refine_casadi, solve_casadi
from fitting.solvers.global_search import starts
from fitting.solvers.nlopt_solver import refine_nlopt, solve_nlopt
from fitting.solvers.solution import Solution, better

__all__ = ["SOLVERS", "Problem", "Solved", "solve_likeliest"]

SOLVERS: dict[str, Callable[[Objective], Solution]] = {
    "casadi": solve_casadi,
    "nlopt": solve_nlopt,
}

# From a point that is nearly the minimum; a solver without one starts again
_REFINERS: dict[str, Callable[[Objective], Solution]] = {
    "casadi": refine_casadi,
    "nlopt": refine_nlopt,
}

# Rounds of estimating the noise and fitting again
_ROUNDS = 25
# Rounds before the changes are halved
_UNDAMPED = 4


# Far from a minimum numbers may be too large: the cost of such a step refuses it
_far_away = np.errstate(over="ignore", invalid="ignore", divide="ignore")


@dataclass(frozen=True, eq=False)
class Solved:
    """A solution with the standard errors of the readings it was found under.

    Parameters
    ----------
    solution : Solution
        The minimum.
    objective : Objective
        The objective of the last round.
    log_likelihood : float
        Gaussian, at the minimum.
    """

    solution: Solution
    objective: Objective
    log_likelihood: float


@dataclass(frozen=True, eq=False)
class Problem:
    """Model, data, layout and weights of one fit.

    Parameters
    ----------
    model : MuellerModel
        The model as the fit sees it.
    observations : Observations
        The readings.
    layout : Layout
        What is free.
    parameters : tuple of Parameter
        Starts, bounds and priors, in the order of the layout.
    fixed : mapping of str to float
        Values of other parameters in place of the model's.
    weights : Weights
        The standard errors of the readings.
    loss, solver, search : str
        Loss, solver and global search.
    cones : Cones, optional
        Cones of light, and how finely each is averaged.
    seed : int
        Seed of the global search.
    objective : Objective
        What the solver sees.
    replicas : tuple of Prediction
        What each independent part of a simulation predicts; none of an exact model.
    cones_stated : bool
        False if nobody said how wide the cones of light are.
    gauges : tuple of Gauge
        Parameters that are known only up to a common factor; their anchors are held.
    """

    model: MuellerModel
    observations: Observations
    layout: Layout
    parameters: tuple[Parameter, ...]
    fixed: Mapping[str, float]
    weights: Weights
    loss: str
    solver: str
    search: str | None
    cones: Cones | None
    seed: int
    objective: Objective
    replicas: tuple[Prediction, ...] = ()
    gauges: tuple[Gauge, ...] = ()
    cones_stated: bool = True

    def simulation_error(self, x: np.ndarray) -> np.ndarray:
        """Return what the simulation errs in the readings, shape (G, m).

        Row g is how far group g of the simulation lies from the mean, over sqrt(G (G - 1)),
        so that the squares of a column sum to the variance of a predicted reading.
        """
        count = len(self.replicas)
        if not count:
            return np.zeros((0, len(self.objective.data)))
        groups = np.stack([one.function(x).full().ravel() for one in self.replicas])
        return np.asarray((groups - groups.mean(axis=0)) / np.sqrt(count * (count - 1)))

    def predict(
        self, observations: Observations | None = None, layout: Layout | None = None
    ) -> Prediction:
        """Return the prediction of other readings, or with other parameters free."""
        return predict(
            self.model,
            self.observations if observations is None else observations,
            self.layout if layout is None else layout,
            fixed=self.fixed,
            cones=self.cones,
        )

    def m00(self) -> Prediction:
        """Return the prediction of M00 at the geometry of each reading."""
        readings = self.observations
        if (readings.name == "M00").all():
            return self.objective.prediction
        return self.predict(replace(readings, name=np.full(len(readings.name), "M00")))

    def holding(self, name: str, value: float) -> "Problem":
        """Return the problem with one parameter held at a value."""
        held = tuple(
            parameter.fixed_at(value) if parameter.name == name else parameter
            for parameter in self.parameters
        )
        objective = self.objective.with_parameters(held)
        return replace(self, parameters=held, objective=objective, search=None)

    @_far_away
    def solve(
        self, *, rounds: int = _ROUNDS, after: "Solved | None" = None, near: bool = False
    ) -> Solved:
        """Fit, and where the noise is part of the question, fit and estimate it in turn.

        Parameters
        ----------
        rounds : int
            Limit of the turns.
        after : Solved, optional
            Earlier turns of this problem, to go on from.
        near : bool
            True where the start is nearly the minimum and need not be proven to be one.
        """
        objective = self.objective
        if after is not None:
            objective = after.objective.started_at(after.solution.x)
        weights = self.weights
        estimates = weights.n_estimated > 0
        changes = weights.iterates or estimates or bool(self.replicas)
        m00 = self.m00().function if weights.iterates else None
        stderr = objective.stderr
        count = 0 if after is None else after.solution.n_evaluations
        for attempt in range(rounds if changes else 1):
            if attempt == 0 and after is None and not near:
                solution = self._minimise(objective)
            else:
                solution = self._refine(objective)
            count += solution.n_evaluations
            if not changes or not solution.converged:
                break
            previous, stderr = stderr, self._stderr(objective, solution, m00)
            if attempt >= _UNDAMPED:
                # A model far from the data can swing between two sets of weights
                stderr = np.sqrt(previous * stderr)
            objective = objective.with_data(objective.data, stderr)
            objective = objective.started_at(solution.x)
            exact = stderr.max() <= 2.0 * _floor(objective)
            if exact or np.allclose(stderr, previous, rtol=1e-5, atol=0.0):
                break
        solution = replace(solution, n_evaluations=count, cost=objective.cost(solution.x))
        return Solved(solution, objective, _log_likelihood(objective, solution.x))

    @_far_away
    def minimise(self, *, begin: np.ndarray) -> Solution:
        """Fit once from `begin`, with the standard errors of the readings as they are."""
        return self._refine(self.objective.started_at(begin))

    def _refine(self, objective: Objective) -> Solution:
        """Go on from a point that is nearly the minimum."""
        return _REFINERS.get(self.solver, SOLVERS[self.solver])(objective)

    def _minimise(self, objective: Objective) -> Solution:
        """Run the solver from each start and keep the lowest end."""
        solve = SOLVERS[self.solver]
        ends = [
            solve(objective.started_at(start))
            for start in starts(objective, self.search, seed=self.seed)
        ]
        best = ends[0]
        for end in ends[1:]:
            best = better(best, end)
        return replace(best, n_evaluations=sum(end.n_evaluations for end in ends))

    def _stderr(
        self, objective: Objective, solution: Solution, m00: Callable | None
    ) -> np.ndarray:
        """Return the readings' standard errors under the curve just fitted."""
        brightness = np.ones(len(objective.data))
        if m00 is not None:
            brightness = m00(solution.x).full().ravel()
            # Far outside any noise the curve is wrong, and must not set its own weights
            read = self.observations.m00
            lit = read > 0.0
            brightness[lit] = np.clip(brightness[lit], 0.5 * read[lit], 2.0 * read[lit])
        shape = self.weights.shape(brightness)
        # A reading where the model is dark still has some noise
        least = max(1e-6 * np.median(shape), 1e-15 * shape.max(), 1e-200)
        shape = np.maximum(shape, least)
        if self.replicas:
            # What is estimated from the misfit holds the error of the simulation already
            error = np.linalg.norm(self.simulation_error(solution.x), axis=0)
            shape = np.where(self.weights.group < 0, np.hypot(shape, error), shape)
        if self.weights.n_estimated == 0:
            return shape
        residual = objective.predict(solution.x) - objective.data
        leverage = _leverage(objective, solution.x)
        floor = _floor(objective)
        stderr = shape.copy()
        for number in sorted(set(self.weights.group[self.weights.group >= 0].tolist())):
            members = self.weights.group == number
            scaled = residual[members] / shape[members]
            freedom = max(float((1.0 - leverage[members]).sum()), 1e-9)
            factor = _spread(scaled, freedom, robust=objective.loss != "linear")
            stderr[members] = np.maximum(factor * shape[members], floor)
        return stderr


def solve_likeliest(problems: Sequence[Problem]) -> tuple[Problem, Solved]:
    """Solve problems that differ in the shape of their noise; return the likeliest.

    A few turns show which shape it is; only that one is followed to the end. A problem
    without a minimum comes last.
    """
    problem, solved = _likeliest(problems)
    if not problem.gauges:
        return problem, solved
    x = within_bounds(solved.solution.x, problem.gauges, problem.layout.base)
    anchors = {gauge.anchor for gauge in problem.gauges}
    parameters = tuple(
        parameter.fixed_at(float(x[i])) if i in anchors else parameter
        for i, parameter in enumerate(problem.parameters)
    )
    objective = solved.objective.with_parameters(parameters)
    solved = replace(solved, solution=replace(solved.solution, x=x), objective=objective)
    return replace(problem, parameters=parameters), solved


def _likeliest(problems: Sequence[Problem]) -> tuple[Problem, Solved]:
    """Solve the problems as far as it takes to choose one, and that one to the end."""
    if len(problems) == 1:
        return problems[0], problems[0].solve()

    def rank(pair: tuple[Problem, Solved]) -> tuple[bool, float]:
        likelihood = pair[1].log_likelihood
        finite = likelihood if np.isfinite(likelihood) else -np.inf
        return pair[1].solution.converged, finite

    tried = [(problem, problem.solve(rounds=3)) for problem in problems]
    problem, solved = max(tried, key=rank)
    return problem, problem.solve(after=solved)


def _floor(objective: Objective) -> float:
    """Return the least standard error: that of readings which the model meets exactly."""
    return 1e-9 * max(float(np.abs(objective.data).max()), 1e-300)


def _leverage(objective: Objective, x: np.ndarray) -> np.ndarray:
    """Return how many parameters each reading pays for, shape (m,)."""
    rows = covariance_rows(objective, x)
    length = np.linalg.norm(rows, axis=0)
    unit = rows / np.where(length > 0.0, length, 1.0)
    left, singular, _ = np.linalg.svd(unit, full_matrices=False)
    seen = singular > 1e-8 * max(singular[0], 1e-300)
    return np.asarray((left[: len(objective.data), seen] ** 2).sum(axis=1))


def _spread(scaled: np.ndarray, freedom: float, *, robust: bool) -> float:
    """Return the noise factor of readings with `freedom` degrees of freedom."""
    if robust:
        # Median absolute deviation of a Gaussian is 0.6745 standard deviations
        return float(np.median(np.abs(scaled)) / 0.6745 * np.sqrt(len(scaled) / freedom))
    return float(np.sqrt((scaled**2).sum() / freedom))


def _log_likelihood(objective: Objective, x: np.ndarray) -> float:
    """Return the Gaussian log likelihood of the readings."""
    residual = objective.residuals(x)
    constant = np.log(objective.stderr * np.sqrt(2.0 * np.pi)).sum()
    return float(-0.5 * (residual**2).sum() - constant)
