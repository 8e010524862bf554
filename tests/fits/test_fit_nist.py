"""The solver layer on the NIST StRD problems of higher difficulty: certified values."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fitting.objective.uncertainty import information
from fitting.solvers.casadi_solver import solve_casadi
from fitting.solvers.nlopt_solver import solve_nlopt
from tests.fits import nist


@pytest.mark.parametrize("solve", [solve_casadi, solve_nlopt])
@pytest.mark.parametrize("start", [0, 1])
@pytest.mark.parametrize("name", nist.MODELS)
def test_certified_values(name, start, solve):
    problem = nist.read(name)
    objective = problem.objective(start)
    solution = solve(objective)
    assert solution.converged, solution.status
    assert_allclose(solution.x, problem.values, rtol=1e-6)
    assert_allclose(2 * solution.cost, problem.residual_sum, rtol=1e-9)


@pytest.mark.parametrize("name", nist.MODELS)
def test_certified_standard_errors(name):
    problem = nist.read(name)
    objective = problem.objective(1)
    jacobian = objective.jacobian(problem.values)
    variance = problem.residual_sum / (len(problem.y) - len(problem.values))
    stderr = information(jacobian).stderr * np.sqrt(variance)
    assert_allclose(stderr, problem.stderr, rtol=1e-5)
