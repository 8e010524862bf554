"""The solver layer on problems whose answer is known without it."""

import casadi
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import optimize

from fitting.objective.losses import LOSSES
from fitting.objective.objective import Objective, Prediction
from fitting.objective.parameters import Parameter, bounded_parameter
from fitting.objective.uncertainty import covariance_rows, information
from fitting.problem.problem import SOLVERS
from fitting.solvers.casadi_solver import solve_casadi
from fitting.solvers.global_search import SEARCHES, starts


def linear_objective(matrix, data, parameters, stderr=None):
    x = casadi.MX.sym("x", matrix.shape[1])
    curve = casadi.Function("curve", [x], [casadi.DM(matrix) @ x])
    return Objective(
        prediction=Prediction(curve),
        data=data,
        stderr=np.ones_like(data) if stderr is None else stderr,
        parameters=parameters,
    )


@pytest.mark.parametrize("solve", SOLVERS.values(), ids=SOLVERS)
@pytest.mark.parametrize("seed", range(6))
def test_bounded_linear_problem_equals_bvls(solve, seed):
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(30, 4)) * [1.0, 1e3, 1e-3, 30.0]
    data = rng.normal(size=30) * 3.0
    low, high = np.array([0.0, -1e-3, 0.0, 0.01]), np.array([0.5, 1e-3, np.inf, 0.02])
    parameters = [
        Parameter(name=f"p{i}", value=low[i], low=low[i], high=high[i]) for i in range(4)
    ]
    expected = optimize.lsq_linear(matrix, data, (low, high), method="bvls", tol=1e-14)
    solution = solve(linear_objective(matrix, data, parameters))
    assert solution.converged, solution.status
    assert_allclose(2 * solution.cost, 2 * expected.cost, rtol=1e-10)
    assert_allclose(solution.x, expected.x, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("solve", SOLVERS.values(), ids=SOLVERS)
def test_prior_is_a_measurement_of_the_parameter(solve):
    # Mean of 3 +- 0.2 (twice) and a prior of 5 +- 0.1, weights 1/variance
    parameter = Parameter(name="mean", value=0.0, prior_value=5.0, prior_stderr=0.1)
    data = np.array([3.0, 3.0])
    objective = linear_objective(np.ones((2, 1)), data, [parameter], np.full(2, 0.2))
    assert_allclose(solve(objective).x, [(2 * 3 / 0.04 + 5 / 0.01) / (2 / 0.04 + 1 / 0.01)])


@pytest.mark.parametrize("loss", LOSSES)
def test_losses_equal_their_textbook_functions(loss):
    data = np.array([0.3, -2.0, 11.0])
    parameters = [Parameter(name="x", value=0.4)]
    base = linear_objective(np.ones((3, 1)), data, parameters)
    objective = Objective(
        prediction=base.prediction,
        data=data,
        stderr=base.stderr,
        parameters=parameters,
        loss=loss,
    )
    z = (0.4 - data) ** 2
    k, c = 1.345, 2.385
    expected = {
        "linear": z,
        "soft_l1": 2 * (np.sqrt(1 + z) - 1),
        "huber": np.where(z <= k**2, z, 2 * k * np.sqrt(z) - k**2),
        "cauchy": c**2 * np.log1p(z / c**2),
    }[loss]
    assert_allclose(objective.cost(np.array([0.4])), 0.5 * expected.sum(), rtol=1e-14)
    step = 1e-6
    slope = objective.cost(np.array([0.4 + step])) - objective.cost(np.array([0.4 - step]))
    gradient = objective.cost_gradient(np.array([0.4]))[1]
    assert_allclose(gradient, slope / (2 * step), rtol=1e-6)


@pytest.mark.parametrize("solve", SOLVERS.values(), ids=SOLVERS)
def test_robust_loss_ignores_an_outlier(solve):
    rng = np.random.default_rng(5)
    t = np.linspace(0.0, 1.0, 40)
    data = 2.0 - 3.0 * t + 0.01 * rng.normal(size=40)
    data[7] = 40.0
    parameters = [Parameter(name="a", value=0.0), Parameter(name="b", value=0.0)]
    plain = linear_objective(np.stack([np.ones(40), t], axis=1), data, parameters)
    robust = Objective(
        prediction=plain.prediction,
        data=data,
        stderr=np.full(40, 0.01),
        parameters=parameters,
        loss="cauchy",
    )
    assert_allclose(solve(robust).x, [2.0, -3.0], atol=0.02)
    assert abs(solve(plain).x[0] - 2.0) > 0.5


@pytest.mark.parametrize("solve", SOLVERS.values(), ids=SOLVERS)
def test_a_curve_that_is_not_finite_is_a_result_with_a_reason(solve):
    x = casadi.MX.sym("x")
    curve = Prediction(casadi.Function("curve", [x], [casadi.sqrt(x - 1.0)]))
    parameters = [Parameter(name="x", value=0.0)]
    objective = Objective(
        prediction=curve, data=np.zeros(1), stderr=np.ones(1), parameters=parameters
    )
    solution = solve(objective)
    assert not solution.converged
    assert solution.status == "stopped: the curve is not finite at the start"


@pytest.mark.parametrize("solve", SOLVERS.values(), ids=SOLVERS)
def test_a_minimum_at_infinity_is_not_called_converged(solve):
    # exp(-x) falls for ever: there is no minimum to find
    x = casadi.MX.sym("x")
    curve = Prediction(casadi.Function("curve", [x], [casadi.exp(-x)]))
    objective = Objective(
        prediction=curve,
        data=np.array([-1.0]),
        stderr=np.ones(1),
        parameters=[Parameter(name="x", value=0.5)],
    )
    solution = solve(objective)
    assert np.isfinite(solution.x).all()
    # Some solvers stop where the slope is below rounding: then nothing is known about x
    if solution.converged:
        assert information(objective.jacobian(solution.x)).stderr[0] > 1e4


@pytest.mark.parametrize("search", SEARCHES)
def test_global_search_leaves_a_local_minimum(search):
    t = np.linspace(0.0, 10.0, 60)
    x = casadi.MX.sym("x", 2)
    curve = casadi.Function("curve", [x], [x[1] * casadi.sin(x[0] * casadi.DM(t))])
    objective = Objective(
        prediction=Prediction(curve),
        data=1.5 * np.sin(2.3 * t),
        stderr=np.ones_like(t),
        parameters=[
            Parameter(name="rate", value=6.0, low=0.1, high=7.0),
            Parameter(name="size", value=0.1, low=0.1),
        ],
    )
    # A local search stays in the valley of the start
    assert solve_casadi(objective).cost > 1.0
    points = starts(objective, search, seed=3)
    ends = [solve_casadi(objective.started_at(point)) for point in points]
    assert_allclose(min(ends, key=lambda end: end.cost).x, [2.3, 1.5], rtol=1e-6)


def test_an_unknown_search_is_named():
    gain = Parameter(name="g", value=1.0)
    objective = linear_objective(np.ones((2, 1)), np.ones(2), [gain])
    with pytest.raises(ValueError, match="search must be one of multistart, crs, mlsl"):
        starts(objective, "annealing")


@pytest.mark.parametrize("solve", SOLVERS.values(), ids=SOLVERS)
def test_fixed_parameters_stay(solve):
    rng = np.random.default_rng(2)
    matrix, data = rng.normal(size=(9, 2)), rng.normal(size=9)
    free = Parameter(name="a", value=0.3)
    held = Parameter(name="b", value=0.7).fixed_at(0.7)
    solution = solve(linear_objective(matrix, data, [free, held]))
    expected = matrix[:, 0] @ (data - 0.7 * matrix[:, 1]) / (matrix[:, 0] @ matrix[:, 0])
    assert_allclose(solution.x, [expected, 0.7], rtol=1e-9)


def test_parameter_rejects_a_start_outside_its_bounds():
    with pytest.raises(ValueError, match=r"kappa must start inside its bounds \[0, 20\]"):
        bounded_parameter("kappa", -0.1)


def test_information_names_blind_directions():
    # Columns 0 and 2 act only together, column 1 alone, column 3 not at all
    matrix = np.array([[1.0, 0.0, 2.0, 0.0], [2.0, 1.0, 4.0, 0.0], [1.0, 3.0, 2.0, 0.0]])
    found = information(matrix)
    assert np.isinf(found.stderr[[0, 2, 3]]).all()
    assert np.isfinite(found.stderr[1])
    assert len(found.blind) == 2
    assert_allclose(matrix @ (found.blind * found.length).T, 0.0, atol=1e-12)


def test_covariance_equals_the_normal_equations():
    matrix = np.random.default_rng(8).normal(size=(20, 3)) * [1.0, 50.0, 0.02]
    expected = np.linalg.inv(matrix.T @ matrix)
    assert_allclose(information(matrix).covariance, expected, rtol=1e-10)


def test_directions_that_nothing_acts_on_have_no_covariance():
    """Two columns in one direction, one of their own, one of zeros, one held."""
    v, w = np.array([0.3, 0.0, 0.4, 0.0, 0.0]), np.array([0.0, 0.15, 0.0, 0.2, 0.0])
    matrix = np.column_stack([1e3 * v, 0.5 * v, w, 0 * v, 7.0 * w + v])
    found = information(matrix, [True, True, True, True, False])
    assert_allclose(found.blind, [[0, 0, 0, 1, 0], [1, -1, 0, 0, 0]], atol=1e-12)
    assert_allclose(found.stderr, [np.inf, np.inf, 1 / 0.25, np.inf, 0.0], rtol=1e-12)
    assert np.isnan(found.covariance[0, 2])
    assert found.covariance[2, 4] == 0.0
    assert_allclose(found.length[:4], [1 / 500, 1 / 0.25, 1 / 0.25, 1.0], rtol=1e-12)


def test_a_parameter_that_acts_by_its_square_has_the_error_of_the_square():
    matrix = np.random.default_rng(4).normal(size=(12, 2))
    x = casadi.MX.sym("x", 2)
    curve = casadi.Function(
        "curve", [x], [casadi.DM(matrix) @ casadi.vertcat(x[0], x[1] ** 2)]
    )
    parameters = [
        Parameter(name="gain", value=1.0, prior_stderr=0.5),
        Parameter(name="kappa", value=0.0, low=0.0, squared=True),
    ]
    stderr = np.full(12, 0.1)
    objective = Objective(
        prediction=Prediction(curve),
        data=np.zeros(12),
        stderr=stderr,
        parameters=parameters,
    )
    # Of gain and square: normal equations with the prior's row
    weighted = np.vstack([matrix / 0.1, [2.0, 0.0]])
    square = np.sqrt(np.linalg.inv(weighted.T @ weighted)[1, 1])
    for kappa in (0.0, 0.2 * np.sqrt(square), 3.0):
        rows = covariance_rows(objective, np.array([1.0, kappa]))
        assert rows.shape == (14, 2)
        assert_allclose(rows[:, 0], [*matrix[:, 0] / 0.1, 2.0, 0.0], rtol=1e-12, atol=1e-12)
        slope = max(2 * kappa, np.sqrt(square))
        assert_allclose(rows[:12, 1], matrix[:, 1] / 0.1 * slope, rtol=1e-6)
