"""Cones of light averaged as finely as the lobe and the noise ask for."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fitting.objective.forward import MuellerModel, predict
from fitting.objective.objective import Prediction
from fitting.problem.problem import Problem, Solved, solve_likeliest
from fitting.readings.aperture import FINEST, Cones, spacing

__all__ = ["cone_warnings", "solve_through_cones"]

# Error of an average in standard errors of its reading, and of an unknown noise in parts
# of the reading
_NOISE = 0.1
_PART = 1e-3
# Readings this far below the brightest carry no light
_DARK = 1e-12
# Steps of a rule this many standard deviations of the lobe cannot miss it
_STEP = 2.5
# Change of the slope that is worth a word, and half-angles that are usual [rad]
_CHANGE = 0.01
_USUAL = np.deg2rad(1.0)
# Rounds of solving and refining
_ROUNDS = 6
# Standard deviations from its middle to where a lobe ends
_END = 8.0


def solve_through_cones(problems: Sequence[Problem]) -> tuple[Problem, Solved]:
    """Solve the likeliest of problems with averages that are exact where they end.

    The lobe found decides how fine a rule it takes, and the rule may move the lobe.
    """
    if problems[0].cones is None:
        return solve_likeliest(problems)
    first = problems[0].objective
    begin, stderr = first.start, first.stderr
    # The way there under one noise and in few turns; what follows goes to the end
    for attempt in range(_ROUNDS):
        cones = refined(problems[0], begin, stderr)
        if cones is None:
            break
        problems = _with_cones(problems, cones, begin)
        solved = problems[0].solve(rounds=2, near=attempt > 0)
        if not solved.solution.converged:
            break
        begin, stderr = solved.solution.x, solved.objective.stderr
        problems = [
            replace(one, objective=one.objective.started_at(begin), search=None)
            for one in problems
        ]
    for _ in range(_ROUNDS):
        problem, solved = solve_likeliest(problems)
        if not solved.solution.converged:
            break
        begin = solved.solution.x
        cones = refined(problem, begin, solved.objective.stderr)
        if cones is None:
            break
        problems = _with_cones(problems, cones, begin)
    return problem, solved


def _with_cones(
    problems: Sequence[Problem], cones: Cones, begin: np.ndarray
) -> list[Problem]:
    """Return the problems with other rules, to be solved from `begin`."""
    one = problems[0]

    def through(model: MuellerModel) -> Prediction:
        return predict(model, one.observations, one.layout, fixed=one.fixed, cones=cones)

    prediction = through(one.model)
    replicas = tuple(through(model) for model in one.model.replicas)
    return [
        replace(
            problem,
            cones=cones,
            replicas=replicas,
            objective=replace(problem.objective, prediction=prediction).started_at(begin),
        )
        for problem in problems
    ]


def refined(problem: Problem, x: np.ndarray, stderr: np.ndarray) -> Cones | None:
    """Return the cones with rules that suffice at x, None if the present ones do.

    Parameters
    ----------
    problem : Problem
        The problem with its present rules.
    x : ndarray
        Parameters.
    stderr : ndarray, shape (m,)
        Standard errors of the readings.
    """
    cones = problem.cones
    if cones is None:
        return None
    least = _least(problem, x)
    level = np.maximum(cones.level, least)
    size = problem.observations.geometry.size
    read = np.isin(np.arange(size), problem.observations.at)
    pending = np.flatnonzero(read & (cones.source + cones.detector > 0.0))
    coarse = _at(problem, x, pending, cones.at(pending, level[pending]))
    tolerance = _tolerance(problem, stderr)
    while pending.size:
        open_ = pending[level[pending] < FINEST]
        if not open_.size:
            break
        fine = _at(problem, x, open_, cones.at(open_, level[open_] + 1))
        worst = np.zeros(size)
        excess = np.abs(fine - coarse) / tolerance
        mine = np.isin(problem.observations.at, open_)
        np.maximum.at(worst, problem.observations.at[mine], excess[mine])
        pending = open_[worst[open_] > 1.0]
        level[pending] += 1
        coarse = np.where(np.isin(problem.observations.at, pending), fine, coarse)
    if (level == cones.level).all():
        return None
    return Cones(cones.source, cones.detector, level)


def cone_warnings(problem: Problem, solved: Solved) -> list[str]:
    """Name what the cones of light do to the numbers where the fit cannot tell."""
    x = solved.solution.x
    slope = _slope(problem, x)
    if problem.cones is None and not problem.cones_stated and slope is not None:
        smallest = float(np.min(slope))
        # A disc of half-angle r adds (r / 4)^2 to the square of the slope
        half_angle = 4.0 * smallest * np.sqrt((1.0 + _CHANGE) ** 2 - 1.0)
        if half_angle < _USUAL:
            return [
                f"the lobe of slope_rms {smallest:.2g} is as narrow as the cones of light "
                f"of goniometers: a half-angle of {np.rad2deg(half_angle):.2g} degrees "
                f"changes slope_rms by {_CHANGE:.0%}, and none was given; say how wide "
                "they are (source and detector half-angle, 0 for a point)"
            ]
    if problem.cones is None or (problem.cones.level < FINEST).all():
        return []
    last = np.flatnonzero(problem.cones.level == FINEST)
    fine = _at(problem, x, last, problem.cones.at(last))
    # The rule before the last one errs by far more than the last
    coarse = _at(problem, x, last, problem.cones.at(last, np.full(last.size, FINEST - 1)))
    error, stderr = np.abs(fine - coarse), solved.objective.stderr
    here = np.isin(problem.observations.at, last)
    if not (error > _tolerance(problem, stderr))[here].any():
        return []
    return [
        "the lobe is too narrow for the averages over the cones of light: they err by up "
        f"to {(error / stderr)[here].max():.2g} standard errors of a reading"
    ]


def _at(problem: Problem, x: np.ndarray, index: np.ndarray, cones: Cones) -> np.ndarray:
    """Return the predicted readings at some geometries, nan elsewhere, shape (m,)."""
    readings = problem.observations
    values = np.full(len(readings.value), np.nan)
    here = np.isin(readings.at, index)
    if not here.any():
        return values
    number = np.full(readings.geometry.size, -1)
    number[index] = np.arange(len(index))
    part = replace(
        readings,
        geometry=readings.geometry.at(index),
        scan=readings.scan[index],
        name=readings.name[here],
        at=number[readings.at[here]],
        value=readings.value[here],
        stderr=readings.stderr[here],
    )
    layout = replace(
        problem.layout,
        column={name: column[index] for name, column in problem.layout.column.items()},
    )
    prediction = predict(problem.model, part, layout, fixed=problem.fixed, cones=cones)
    values[here] = prediction.function(x).full().ravel()
    return values


def _tolerance(problem: Problem, stderr: np.ndarray) -> np.ndarray:
    """Return what each average may err, shape (m,)."""
    value = np.abs(problem.observations.value)
    allowed = _NOISE * stderr
    if problem.weights.n_estimated:
        # A misfit must not excuse the rule that may have caused it
        allowed = np.minimum(allowed, _PART * value)
    finest = np.where(problem.observations.is_ratio, _PART, 1e-5 * value)
    bright = value[~problem.observations.is_ratio]
    dark = _DARK * bright.max() if bright.size else 0.0
    return np.maximum(np.maximum(allowed, finest), max(dark, 1e-300))


def _least(problem: Problem, x: np.ndarray) -> np.ndarray:
    """Return the coarsest rule that cannot step over the lobe, at each geometry."""
    geometry, cones = problem.observations.geometry, problem.cones
    slope = _slope(problem, x)
    level = np.zeros(geometry.size, dtype=int)
    if cones is None or slope is None:
        return level
    across = np.sin(geometry.theta_i) * np.sin(geometry.theta_s) * np.cos(geometry.dphi)
    cosine = np.cos(geometry.theta_i) * np.cos(geometry.theta_s) + across
    cos_beta = np.sqrt(np.maximum(0.5 * (1.0 + cosine), 1e-6))
    upright = (np.cos(geometry.theta_i) + np.cos(geometry.theta_s)) / (2.0 * cos_beta)
    tilt = np.arccos(np.clip(upright, -1.0, 1.0))
    # A sum of displacements w tilts the facet by w / 2, across by w / (2 cos beta)
    width = 2.0 * slope * cos_beta
    reach = cones.source + cones.detector
    lit = tilt <= _END * slope + 0.5 * reach / cos_beta
    for _ in range(FINEST):
        step = spacing(replace(cones, level=level))
        level = np.where(lit & (step > _STEP * width) & (level < FINEST), level + 1, level)
    return level


def _slope(problem: Problem, x: np.ndarray) -> np.ndarray | None:
    """Return the smaller slope rms at each geometry, None if the model has none."""
    present: Mapping[str, object] = {
        **problem.model.values(problem.observations.geometry),
        **problem.fixed,
    }
    found = []
    for name in ("slope_rms", "slope_rms_x", "slope_rms_y"):
        if name in problem.layout.column:
            found.append(x[problem.layout.column[name]])
        elif name in present:
            found.append(np.asarray(present[name], dtype=float))
    if not found:
        return None
    shape = problem.observations.geometry.theta_i.shape
    return np.min([np.broadcast_to(one, shape) for one in found], axis=0)
