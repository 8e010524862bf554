"""Turn a solved problem into a result with uncertainties and warnings."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import chain

import numpy as np
from scipy import stats

from fitting.objective.forward import INSTRUMENT, Layout
from fitting.objective.objective import Objective
from fitting.objective.uncertainty import (
    Information,
    correlation_matrix,
    covariance_rows,
    information,
    sandwich,
)
from fitting.problem.problem import Problem, Solved
from fitting.problem.refinement import cone_warnings
from fitting.result.fit_result import FitResult
from fitting.result.identifiability import identifiability_warnings, misfit_warnings

__all__ = ["result_of"]


# Of a fit without a minimum chi2 may be too large for a number
@np.errstate(over="ignore", invalid="ignore")
def result_of(
    problem: Problem, solved: Solved, uncertain: Mapping[str, float]
) -> FitResult:
    """Return the result of a solved problem.

    Parameters
    ----------
    problem : Problem
        What was asked.
    solved : Solved
        What was found.
    uncertain : mapping of str to float
        Standard errors of parameters that were held fixed.
    """
    solution, objective = solved.solution, solved.objective
    labels = problem.layout.labels
    n, m = len(labels), len(objective.data)
    residual = -objective.residuals(solution.x)
    chi2, dof = float((residual**2).sum()), m - n + len(problem.gauges)

    nothing = np.full((n, n), np.nan)
    covariance, warnings = nothing, []
    parts: dict[str, dict[str, float]] = {}
    anchored_stderr: dict[str, float] = {}
    if not solution.converged:
        warnings.append(f"no minimum was found ({solution.status}); do not use the values")
    elif dof <= 0 and problem.weights.n_estimated:
        warnings.append(
            f"{m} readings cannot give {n} parameters and the noise; state the noise"
        )
    else:
        anchors = {gauge.anchor for gauge in problem.gauges}
        varied = [i not in anchors for i in range(n)]
        found = information(covariance_rows(objective, solution.x), varied)
        if problem.loss != "linear":
            found = _robust(objective, solution.x, found)
        covariance, parts = _with_uncertain(problem, solved, found, uncertain)
        if problem.gauges:
            given_anchor = np.sqrt(np.diag(covariance)).tolist()
            anchored_stderr = dict(zip(labels, given_anchor, strict=True))
            covariance = _unanchored(problem, covariance)
            parts |= {labels[i]: {"noise": np.inf} for i in _lost(problem)}
            found = replace(found, covariance=_unanchored(problem, found.covariance))
        warnings += identifiability_warnings(problem, solved, found)
        warnings += misfit_warnings(problem, solved, _p_value(problem, chi2, dof))
        warnings += cone_warnings(problem, solved)

    values = dict(zip(labels, solution.x.tolist(), strict=True))
    stderr = dict(zip(labels, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    models = _models(problem, solution.x)
    remarks = (getattr(model, "remarks", ()) for model in models.values())
    warnings += dict.fromkeys(chain.from_iterable(remarks))
    return FitResult(
        values=values,
        stderr=stderr,
        covariance=covariance,
        correlation=correlation_matrix(covariance),
        residuals=residual,
        chi2=chi2,
        dof=dof,
        solver=solution.solver,
        status=solution.status,
        converged=solution.converged,
        n_evaluations=solution.n_evaluations,
        warnings=tuple(warnings),
        model=next(iter(models.values())),
        models=models,
        noise=problem.weights.text,
        log_likelihood=solved.log_likelihood,
        n_estimated=problem.weights.n_estimated,
        stderr_parts=parts,
        anchored_stderr=anchored_stderr,
        problem=replace(problem, objective=objective),
    )


def _p_value(problem: Problem, chi2: float, dof: int) -> float:
    """Return the chance of a chi2 as large, NaN where the noise is estimated from it."""
    if problem.weights.n_estimated > 0 or dof <= 0:
        return np.nan
    return float(stats.chi2.sf(chi2, dof))


def _lost(problem: Problem) -> list[int]:
    """Return the entries that are known only up to a common factor."""
    return [i for gauge in problem.gauges for i in gauge.members]


def _unanchored(problem: Problem, covariance: np.ndarray) -> np.ndarray:
    """Return the covariance with what is known up to a factor as undetermined."""
    lost = _lost(problem)
    wide = covariance.copy()
    wide[lost, :] = wide[:, lost] = np.nan
    wide[lost, lost] = np.inf
    return wide


def _robust(objective: Objective, x: np.ndarray, found: Information) -> Information:
    """Return the information with the covariance of the robust estimate."""
    slope, bend = objective.influence(x)
    covariance = sandwich(objective.jacobian(x), slope, bend, found)
    return replace(found, covariance=covariance)


def _with_uncertain(
    problem: Problem, solved: Solved, found: Information, uncertain: Mapping[str, float]
) -> tuple[np.ndarray, dict[str, dict[str, float]]]:
    """Add what is uncertain beside the noise to the covariance, and keep account of it.

    With free parameters x and a fixed one b the minimum moves by
    dx/db = -(J^T J)^-1 J^T (dr/db), so b's variance adds (dx/db) var(b) (dx/db)^T.
    """
    labels = problem.layout.labels
    x, objective = solved.solution.x, solved.objective
    noise, simulation = _without_simulation(problem, solved, found)
    covariance = noise + simulation
    parts = {name: {"noise": float(np.sqrt(noise[i, i]))} for i, name in enumerate(labels)}
    if problem.replicas:
        for i, label in enumerate(labels):
            parts[label]["simulation"] = float(np.sqrt(simulation[i, i]))
    if not uncertain:
        return covariance, parts
    n = len(labels)
    column = {
        name: np.full(problem.observations.geometry.size, n + i)
        for i, name in enumerate(uncertain)
    }
    wider = Layout(
        labels=(*labels, *uncertain),
        base=(*problem.layout.base, *uncertain),
        column={**problem.layout.column, **column},
    )
    everything = np.concatenate([x, [problem.fixed[name] for name in uncertain]])
    jacobian = problem.predict(layout=wider).jacobian(everything).full()
    jacobian = jacobian / objective.stderr[:, None]
    normal = np.nan_to_num(found.covariance, posinf=0.0)
    for i, (name, stderr) in enumerate(uncertain.items()):
        moved = -normal @ (jacobian[:, :n].T @ jacobian[:, n + i]) * stderr
        covariance += np.outer(moved, moved)
        for label, shift in zip(labels, moved, strict=True):
            parts[label][name] = float(abs(shift))
    return covariance, parts


def _without_simulation(
    problem: Problem, solved: Solved, found: Information
) -> tuple[np.ndarray, np.ndarray]:
    """Return the covariance that the noise of the readings causes, and the simulation's.

    The weights count the simulation's error as if each reading had its own. In truth
    neighbours err together, so that part is taken out again and replaced by the spread of
    the parameters over the independent groups of the simulation.
    """
    if not problem.replicas:
        return found.covariance, np.zeros_like(found.covariance)
    x, objective = solved.solution.x, solved.objective
    error = problem.simulation_error(x) / objective.stderr
    share = np.minimum((error**2).sum(axis=0), 1.0)
    to_parameters = np.nan_to_num(found.covariance, posinf=0.0) @ objective.jacobian(x).T
    moved = to_parameters @ error.T
    counted = (to_parameters * share) @ to_parameters.T
    return found.covariance - counted, moved @ moved.T


def _models(problem: Problem, x: np.ndarray) -> dict[str, object]:
    """Return the user's model with the fitted values, for each scan and wavelength."""
    observations = problem.observations
    waves = observations.geometry.wavelength.round(9)
    several = len(observations.wavelengths) > 1
    material = getattr(getattr(problem.model, "model", None), "material", None)
    table = bool(getattr(material, "dispersive", False))
    models = {}
    for index, label in enumerate(observations.labels):
        here = observations.at[observations.scan[observations.at] == index]
        if not here.size:
            here = np.flatnonzero(observations.scan == index)
        found, first = np.unique(waves[here], return_index=True)
        for wave, one in zip(found, here[first], strict=True):
            values = dict(problem.fixed)
            for name, column in problem.layout.column.items():
                values[name] = float(x[column[one]])
            brdf = {name: v for name, v in values.items() if name not in INSTRUMENT}
            if (several or table) and np.isfinite(wave):
                # The index of a table is that of this wavelength
                present = problem.model.values(observations.geometry)
                brdf = {k: float(present[k][one]) for k in ("n", "kappa")} | brdf
            name = label if len(found) == 1 else f"{label}, {wave:.9g}"
            models[name] = problem.model.updated(brdf)
    return models
