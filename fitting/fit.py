"""Fit a reflectance model to goniometer scans."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.analytic_model import AnalyticModel
from fitting.aperture import Aperture
from fitting.forward import INSTRUMENT, Layout, MuellerModel, predict
from fitting.noise import Noise, Weights, weights_for
from fitting.objective import Objective
from fitting.observations import Geometry, Mask, Observations, observe
from fitting.parameters import Parameter, bounded_parameter
from fitting.problem import SOLVERS, Problem, Solved
from fitting.report_fit import result_of
from fitting.result import FitResult

if TYPE_CHECKING:
    import xarray as xr

    from fitting.estimate import Estimate

__all__ = ["fit"]


def fit(  # noqa: PLR0913  (each is a choice that the person who fits has to make)
    measurement: "xr.Dataset | Sequence[xr.Dataset] | Mapping[str, xr.Dataset]",
    model: Any,
    free: Sequence[str] = ("specular_gain", "diffuse_albedo"),
    bounds: Mapping[str, tuple[float | None, float | None]] | None = None,
    solver: str = "casadi",
    *,
    fixed: Mapping[str, float] | None = None,
    priors: "Mapping[str, Estimate | tuple[float, float]] | None" = None,
    separate: Sequence[str] | Mapping[str, str] = (),
    use: Sequence[str] | None = None,
    mask: Mask | Iterable[Mask] = (),
    noise: Noise | str | None = None,
    loss: str = "linear",
    aperture: Aperture | None = None,
    search: str | None = None,
    seed: int = 0,
) -> FitResult:
    """Bring a model to one or several scans and say how well each parameter is known.

    Parameters
    ----------
    measurement : Dataset, or sequence or mapping of them
        Goniometer scans as `data_io.read_goniometer` returns them: dimension `geometry`;
        any of M00..M33, DOLP, and s/p intensities I_s, I_p, f_ss, f_sp, f_ps, f_pp;
        `<name>_stderr` weighs where present. DOLP is left out where M00 and M10 are there,
        from which it was computed.
    model : MicrofacetModel or MuellerModel
        Start values, and the values of all that is not free. A simulated surface goes in
        the same way: `fitting.SimulatedModel`.
    free : sequence of str
        Parameters to vary: names of `fitting.PARAMETERS`.
    bounds : mapping of str to (low, high), optional
        In place of those of `PARAMETERS`; None leaves an end as it is.
    solver : {"casadi", "nlopt"}
        IPOPT (DAQP where the problem is linear), or SLSQP and Subplex.
    fixed : mapping of str to float, optional
        Values of parameters that are not free, in place of the model's.
    priors : mapping of str to Estimate or (value, stderr), optional
        What is known from elsewhere. For a free parameter it is one more reading of it. For
        one that is not free, as a slope_rms measured on a height map, the parameter takes
        that value and its uncertainty goes into the standard errors of the free ones.
    separate : sequence of str, or mapping of str to {"scan", "wavelength", "theta_i"}
        Free parameters that have a value of their own in each scan, or each such group.
    use : sequence of str, optional
        Observables to use; default all.
    mask : callable or iterable of callables
        What to leave out: see `fitting.masks`.
    noise : Noise, "relative", "absolute", optional
        Noise of the readings; default the file's columns, and where it has none, estimated
        from the misfit, relative to M00 or absolute, whichever is more likely.
    loss : {"linear", "soft_l1", "huber", "cauchy"}
        Robust losses let outliers pull less.
    aperture : Aperture, optional
        Cones of light of source and detector, folded into the model.
    search : {None, "multistart", "crs", "mlsl"}
        Search the whole box of the bounds before the solver polishes.
    seed : int
        Seed of that search.

    Returns
    -------
    FitResult
        A solver that fails, and parameters that the data cannot determine, are results with
        a reason, not exceptions.

    Raises
    ------
    ValueError, TypeError
        If an argument does not say what to fit.

    Examples
    --------
    >>> import numpy as np, xarray as xr
    >>> from pbrdf import Material, MicrofacetModel
    >>> view = np.deg2rad(np.arange(-70.0, 71.0, 5.0))
    >>> dphi = np.where(view > 0, np.pi, 0.0)
    >>> truth = MicrofacetModel(Material(1.5), 0.25, specular_gain=0.9, diffuse_albedo=0.1)
    >>> brdf = truth.brdf(0.5, abs(view), dphi)
    >>> scan = xr.Dataset(
    ...     {"M00": ("geometry", brdf[:, 0, 0]), "M10": ("geometry", brdf[:, 1, 0])},
    ...     coords={
    ...         "theta_i": ("geometry", np.full(view.size, 0.5)),
    ...         "theta_s": ("geometry", abs(view)),
    ...         "dphi": ("geometry", dphi),
    ...     },
    ... )
    >>> result = fit(scan, MicrofacetModel(Material(1.5), slope_rms=0.25))
    >>> {name: round(value, 6) for name, value in result.values.items()}
    {'specular_gain': 0.9, 'diffuse_albedo': 0.1}
    """
    if solver not in SOLVERS:
        msg = f"solver must be one of {', '.join(SOLVERS)}, got {solver!r}."
        raise ValueError(msg)
    known = _known(priors)
    observations = _above_horizon(observe(_labelled(measurement), use=use, mask=mask))
    adapter = _adapter(model, free)
    held = {**(fixed or {}), **{n: v for n, (v, _) in known.items() if n not in free}}
    _check_names(adapter, observations.geometry, free, {**held, **known, **(bounds or {})})
    layout = Layout.of(tuple(free), observations, separate)
    _check_separate(adapter, separate)
    parameters = _parameters(adapter, observations, layout, bounds or {}, known)
    uncertain = {n: stderr for n, (_, stderr) in known.items() if n not in free}

    solved = []
    for weights in weights_for(observations, noise):
        problem = _problem(
            adapter, observations, layout, parameters, held, weights,
            loss=loss, solver=solver, search=search, aperture=aperture, seed=seed,
        )  # fmt: skip
        solved.append((problem, problem.solve()))
    best = max(solved, key=_rank)
    return result_of(*best, uncertain)


def _rank(pair: tuple[Problem, Solved]) -> tuple[bool, float]:
    """Order fits under different noise: converged first, then by likelihood."""
    solved = pair[1]
    likelihood = solved.log_likelihood
    return solved.solution.converged, likelihood if np.isfinite(likelihood) else -np.inf


def _labelled(measurement: Any) -> dict[str, "xr.Dataset"]:
    """Give every scan a name."""
    if isinstance(measurement, Mapping) and not hasattr(measurement, "data_vars"):
        scans = {str(label): scan for label, scan in measurement.items()}
    elif isinstance(measurement, Sequence):
        scans = {str(index): scan for index, scan in enumerate(measurement)}
    else:
        scans = {"0": measurement}
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
        split = any(name in ("slope_rms_x", "slope_rms_y") for name in free)
        return AnalyticModel(model, split_slope=split)
    msg = f"model must be a MicrofacetModel or a MuellerModel, got {type(model).__name__}."
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


def _check_separate(model: MuellerModel, separate: Iterable[str]) -> None:
    """Reject separate values of what is simulated once for all scans."""
    for name in separate:
        if name in model.first_order:
            msg = f"separate must not name {name!r}, which this simulated model shares."
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
        parameter = bounded_parameter(name, start, bounds.get(name), label=label)
        if name in known:
            value, stderr = known[name]
            parameter = replace(parameter, prior_value=value, prior_stderr=stderr)
        parameters.append(_off_bounds(parameter))
    return tuple(parameters)


def _off_bounds(parameter: Parameter) -> Parameter:
    """Start inside: at kappa = 0 every derivative by kappa is zero and nothing moves."""
    step = min(0.1 * parameter.scale, 0.25 * (parameter.high - parameter.low))
    return parameter.started_at(
        float(np.clip(parameter.value, parameter.low + step, parameter.high - step))
    )


def _problem(  # noqa: PLR0913  (the parts of a problem)
    model: MuellerModel,
    observations: Observations,
    layout: Layout,
    parameters: tuple[Parameter, ...],
    fixed: Mapping[str, float],
    weights: Weights,
    *,
    loss: str,
    solver: str,
    search: str | None,
    aperture: Aperture | None,
    seed: int,
) -> Problem:
    """Put the problem together; its first weights take the readings for the curve."""
    prediction = predict(model, observations, layout, fixed=fixed, aperture=aperture)
    start = np.array([parameter.value for parameter in parameters])
    stderr = _first_stderr(observations, weights, prediction.function(start).full().ravel())
    objective = Objective(
        prediction=prediction,
        data=observations.value,
        stderr=stderr,
        parameters=parameters,
        loss=loss,
    )
    return Problem(
        model=model,
        observations=observations,
        layout=layout,
        parameters=parameters,
        fixed=fixed,
        weights=weights,
        loss=loss,
        solver=solver,
        search=search,
        aperture=aperture,
        seed=seed,
        objective=objective,
    )


def _first_stderr(
    observations: Observations, weights: Weights, predicted: np.ndarray
) -> np.ndarray:
    """Return standard errors to begin with, from the measured M00 where there is one."""
    m00 = np.full(observations.geometry.size, np.nan)
    is_m00 = observations.name == "M00"
    m00[observations.at[is_m00]] = np.abs(observations.value[is_m00])
    typical = np.nanmedian(m00) if is_m00.any() else float(np.median(np.abs(predicted)))
    m00 = np.where(m00 > 0.0, m00, typical)
    return weights.shape(np.maximum(m00, 1e-3 * typical)[observations.at])
