"""Turn what a user asks into problems that the solvers understand."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.models.analytic import AnalyticModel
from fitting.models.waves import WaveSurface
from fitting.objective.forward import INSTRUMENT, Layout, MuellerModel, predict
from fitting.objective.objective import Objective, Prediction
from fitting.objective.parameters import Parameter, bounded_parameter
from fitting.problem.gauge import anchored, gauges_of
from fitting.problem.problem import SOLVERS, Problem
from fitting.readings.aperture import Aperture, cones_of
from fitting.readings.noise import Noise, Weights, weights_for
from fitting.readings.observations import Geometry, Mask, Observations, observe

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Question", "assemble"]


@dataclass(frozen=True, kw_only=True)
class Question:
    """What is to be found, and how: the arguments of `fitting.fit` that are not data."""

    free: tuple[str, ...]
    bounds: Mapping[str, tuple[float | None, float | None]]
    fixed: Mapping[str, float]
    priors: Mapping[str, Any]
    separate: Sequence[str] | Mapping[str, str]
    solver: str
    loss: str
    search: str | None
    aperture: Aperture | None
    seed: int


def assemble(
    measurement: Any,
    model: Any,
    question: Question,
    *,
    use: Sequence[str] | None,
    mask: Mask | Iterable[Mask],
    noise: Noise | str | None,
) -> tuple[list[Problem], dict[str, float]]:
    """Return the problems to solve and the standard errors of uncertain fixed parameters.

    There are two problems where the shape of the noise is open; the likelihood decides.

    Raises
    ------
    ValueError, TypeError
        If an argument does not say what to fit.
    """
    if question.solver not in SOLVERS:
        msg = f"solver must be one of {', '.join(SOLVERS)}, got {question.solver!r}."
        raise ValueError(msg)
    known = _known(question.priors)
    observations = _above_horizon(observe(labelled(measurement), use=use, mask=mask))
    adapter = _adapter(model, question.free)
    free = _with_scale(question, observations)
    outside = {name: value for name, (value, _) in known.items() if name not in free}
    held = {**question.fixed, **outside}
    others = {**held, **known, **question.bounds}
    _check_names(adapter, observations.geometry, free, others)
    layout = Layout.of(
        free, observations, question.separate, all_scans="scale" in question.free
    )
    parameters = _parameters(adapter, observations, layout, question.bounds, known)
    parameters = _with_squares(parameters, layout, observations)
    cones = cones_of(observations.geometry, question.aperture)
    prediction = predict(adapter, observations, layout, fixed=held, cones=cones)
    parameters = _with_scales(parameters, layout, observations, prediction)
    present = {**INSTRUMENT, **adapter.values(observations.geometry), **held}
    gauges = gauges_of(layout, observations, parameters, present, tuple(question.bounds))
    parameters = anchored(parameters, gauges)
    replicas = tuple(
        predict(one, observations, layout, fixed=held, cones=cones)
        for one in adapter.replicas
    )
    start = np.array([parameter.value for parameter in parameters])
    predicted = prediction.function(start).full().ravel()

    problems = []
    for weights in weights_for(observations, noise):
        objective = Objective(
            prediction=prediction,
            data=observations.value,
            stderr=_first_stderr(observations, weights, predicted),
            parameters=parameters,
            loss=question.loss,
        )
        problems.append(
            Problem(
                model=adapter,
                observations=observations,
                layout=layout,
                parameters=parameters,
                fixed=held,
                weights=weights,
                loss=question.loss,
                solver=question.solver,
                search=question.search,
                cones=cones,
                seed=question.seed,
                objective=objective,
                replicas=replicas,
                gauges=gauges,
                cones_stated=question.aperture is not None or _cones_named(observations),
            )
        )
    return problems, {name: known[name][1] for name in outside}


def _cones_named(observations: Observations) -> bool:
    """Tell whether the scans say how wide their cones of light are."""
    geometry = observations.geometry
    columns = geometry.source_half_angle, geometry.detector_half_angle
    return any(one is not None and bool(np.isfinite(one).any()) for one in columns)


def _with_scale(question: Question, observations: Observations) -> tuple[str, ...]:
    """Return what is free, with the scale that relative intensities bring along."""
    given = {*question.free, *question.fixed, *question.priors}
    bright = observations.scan[observations.at[~observations.is_ratio]]
    if "scale" in given or not observations.relative[bright].any():
        return question.free
    return (*question.free, "scale")


def _with_scales(
    parameters: tuple[Parameter, ...],
    layout: Layout,
    observations: Observations,
    prediction: Prediction,
) -> tuple[Parameter, ...]:
    """Start the scales of relative data where readings and curve are equally bright."""
    if "scale" not in layout.column or not observations.relative.any():
        return parameters
    x = np.array([parameter.value for parameter in parameters])
    x[[base == "scale" for base in layout.base]] = 1.0
    predicted = prediction.function(x).full().ravel()
    bright = ~observations.is_ratio & (observations.value > 0.0) & (predicted > 0.0)
    entry = layout.column["scale"][observations.at]
    started = list(parameters)
    for index in np.unique(entry[bright & (entry >= 0)]):
        here = bright & (entry == index)
        ratio = float(observations.value[here].sum() / predicted[here].sum())
        if np.isinf(parameters[index].prior_stderr):
            started[index] = parameters[index].started_at(ratio)
    return tuple(started)


def labelled(measurement: Any) -> dict[str, "xr.Dataset"]:
    """Give every scan a name."""
    if isinstance(measurement, Mapping) and not hasattr(measurement, "data_vars"):
        scans = {str(label): scan for label, scan in measurement.items()}
    elif isinstance(measurement, Sequence):
        scans = {str(index): scan for index, scan in enumerate(measurement)}
    else:
        # The file that a reader notes
        scans = {str(getattr(measurement, "attrs", {}).get("source") or "0"): measurement}
    if not scans:
        msg = "measurement must hold at least one scan, got none."
        raise ValueError(msg)
    return scans


def _above_horizon(observations: Observations) -> Observations:
    """Leave out readings at the horizon, where the BRDF of a rough surface diverges."""
    geometry = observations.geometry
    lowest = np.maximum(geometry.theta_i, geometry.theta_s)[observations.at]
    wrong = (lowest > np.pi / 2 + 1e-9) | ~np.isfinite(lowest)
    if wrong.any():
        msg = (
            f"theta_i and theta_s must lie in [0, 1.571] rad, got {lowest[wrong][0]:g}. "
            "Angles are radians; use np.deg2rad."
        )
        raise ValueError(msg)
    keep = lowest < np.pi / 2 - 1e-6
    columns = ("name", "at", "value", "stderr")
    kept = {column: getattr(observations, column)[keep] for column in columns}
    return replace(observations, **kept)


def _adapter(model: Any, free: Sequence[str]) -> MuellerModel:
    """Return the model as the fit sees it."""
    if hasattr(model, "mueller") and hasattr(model, "values"):
        return model
    if hasattr(model, "brdf") and hasattr(model, "slope_rms"):
        axes = ("slope_rms_x", "slope_rms_y", "orientation")
        split = any(name in axes for name in free)
        return AnalyticModel(model, split_slope=split)
    if hasattr(model, "brdf") and hasattr(model, "corr_length"):
        return WaveSurface(model)
    msg = (
        "model must be a MicrofacetModel, a WaveModel or a MuellerModel, got "
        f"{type(model).__name__}."
    )
    raise TypeError(msg)


def _known(priors: Mapping[str, Any] | None) -> dict[str, tuple[float, float]]:
    """Return priors as (value, standard error)."""
    known = {}
    for name, prior in (priors or {}).items():
        pair = (prior.value, prior.stderr) if hasattr(prior, "stderr") else tuple(prior)
        if len(pair) != 2 or not np.isfinite(pair[0]) or not pair[1] > 0.0:
            msg = f"priors[{name!r}] must be (value, stderr > 0), got {prior!r}."
            raise ValueError(msg)
        known[name] = (float(pair[0]), float(pair[1]))
    return known


def _check_names(
    model: MuellerModel, geometry: Geometry, free: Sequence[str], others: Mapping[str, Any]
) -> None:
    """Reject parameters that the model does not have."""
    available = [*model.values(geometry), *INSTRUMENT]
    if not free:
        msg = "free must name at least one parameter, got none."
        raise ValueError(msg)
    if len(set(free)) < len(free):
        msg = f"free must name each parameter once, got {list(free)}."
        raise ValueError(msg)
    for role, names in (("free", free), ("fixed, priors or bounds", others)):
        for name in names:
            if name not in available:
                msg = f"{role} must name parameters, got {name!r}. Known: {available}."
                raise ValueError(msg)


def _parameters(
    model: MuellerModel,
    observations: Observations,
    layout: Layout,
    bounds: Mapping[str, tuple[float | None, float | None]],
    known: Mapping[str, tuple[float, float]],
) -> tuple[Parameter, ...]:
    """Return starts, bounds and priors of the free parameters."""
    present = {**INSTRUMENT, **model.values(observations.geometry)}
    parameters = []
    for index, (label, name) in enumerate(zip(layout.labels, layout.base, strict=True)):
        where = np.flatnonzero(layout.column[name] == index)
        values = np.broadcast_to(
            np.asarray(present[name], dtype=float), layout.column[name].shape
        )[where]
        # One n for several wavelengths starts from their middle
        start = float(np.median(values))
        if name in known:
            start = known[name][0]
        limits = _within(name, bounds.get(name), model.bounds.get(name))
        parameter = bounded_parameter(name, start, limits, label=label)
        if name in known:
            value, stderr = known[name]
            parameter = replace(parameter, prior_value=value, prior_stderr=stderr)
        parameters.append(_off_bounds(parameter))
    if "orientation" in layout.column:
        return _unequal(tuple(parameters))
    return tuple(parameters)


def _unequal(parameters: tuple[Parameter, ...]) -> tuple[Parameter, ...]:
    """Start slopes apart: where both are equal no azimuth is any better than another."""
    start = {one.name: one.value for one in parameters}
    if start.get("slope_rms_x") != start.get("slope_rms_y"):
        return parameters
    factors = {"slope_rms_x": 1.25, "slope_rms_y": 0.8}
    return tuple(
        one.started_at(one.value * factors.get(one.name, 1.0)) for one in parameters
    )


def _within(
    name: str,
    wanted: tuple[float | None, float | None] | None,
    valid: tuple[float, float] | None,
) -> tuple[float | None, float | None] | None:
    """Return the bounds asked for, if the model holds there; by default where it does."""
    if valid is None or wanted is None:
        return wanted or valid
    low, high = (v if w is None else w for w, v in zip(wanted, valid, strict=True))
    if low < valid[0] or high > valid[1]:
        msg = (
            f"bounds of {name} must lie in [{valid[0]:g}, {valid[1]:g}], for which the "
            f"model was made, got ({low:g}, {high:g}). Give SimulatedModel or WaveSurface "
            "a wider index_range, WaveSurface a larger reach."
        )
        raise ValueError(msg)
    return low, high


def _with_squares(
    parameters: tuple[Parameter, ...], layout: Layout, observations: Observations
) -> tuple[Parameter, ...]:
    """Mark kappa where the readings depend on its square alone.

    An index and its conjugate reflect alike but for the sign of the retardance.
    """
    if any(name[1:].count("3") == 1 for name in observations.names):
        return parameters
    return tuple(
        replace(parameter, squared=base == "kappa" and np.isinf(parameter.prior_stderr))
        for parameter, base in zip(parameters, layout.base, strict=True)
    )


def _off_bounds(parameter: Parameter) -> Parameter:
    """Start inside: at kappa = 0 every derivative by kappa is zero and nothing moves."""
    step = min(0.1 * parameter.scale, 0.25 * (parameter.high - parameter.low))
    return parameter.started_at(
        float(np.clip(parameter.value, parameter.low + step, parameter.high - step))
    )


def _first_stderr(
    observations: Observations, weights: Weights, predicted: np.ndarray
) -> np.ndarray:
    """Return standard errors to begin with, from the measured M00 where there is one."""
    m00 = np.abs(observations.m00)
    read = np.isfinite(m00).any()
    typical = np.nanmedian(m00) if read else float(np.median(np.abs(predicted)))
    # Of a lobe on black most readings are 0
    typical = max(typical, 1e-6 * float(np.nanmax(m00)) if read else 0.0, 1e-200)
    m00 = np.where(m00 > 0.0, m00, typical)
    return weights.shape(np.maximum(m00, 1e-3 * typical))
