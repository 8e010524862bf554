"""What the data cannot tell, in words that name the parameters and a cure."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fitting.objective.forward import MuellerModel
from fitting.objective.uncertainty import (
    Information,
    correlation_matrix,
    covariance_rows,
    information,
)
from fitting.problem.gauge import Gauge
from fitting.problem.problem import Problem, Solved
from fitting.readings.observations import Geometry, Observations
from fitting.result.fit_result import HARDLY_APART
from fitting.result.runs import running_together

__all__ = ["identifiability_warnings", "misfit_warnings"]

# What could be measured beside, in the order of the trouble it takes
_CANDIDATES = ("M00", "M10", "M11", "M22", "M23")


def identifiability_warnings(
    problem: Problem, solved: Solved, found: Information
) -> list[str]:
    """Name parameters that the data do not determine, alone or in combination."""
    labels = problem.layout.labels
    warnings = _at_bounds(problem, solved, found.stderr)
    # Of many wavelengths the first stands for all
    warnings += [_up_to_a_factor(problem, solved, one) for one in problem.gauges[:2]]
    if len(problem.gauges) > 2:
        warnings.append(f"the same holds for {len(problem.gauges) - 2} more such groups")
    warnings += _relative_to_what_is_held(problem)
    warnings += _unnamed_wavelengths(problem.observations)
    warnings += _turned_axes(problem, solved)
    warnings += _one_slope_for_all_azimuths(problem)
    for direction in found.blind:
        involved = [i for i, part in enumerate(direction) if abs(part) > 0.05]
        names = _listed([labels[i] for i in involved])
        cure = _cure(problem, solved, involved)
        if len(involved) == 1:
            warnings.append(f"{names} has no effect on these data; fix it{cure}")
        else:
            warnings.append(
                f"only a combination of {names} is determined by these data, not each; "
                f"fix one{cure}"
            )
    correlation = correlation_matrix(found.covariance)
    for i in range(len(labels)):
        for j in range(i):
            strength = abs(correlation[i, j])
            # nan, for undetermined ones, compares false: those are named above
            if strength > HARDLY_APART:
                cure = _cure(problem, solved, [i, j])
                warnings.append(
                    f"{labels[j]} and {labels[i]} are {_percent(strength)} % correlated; "
                    f"fix one{cure}"
                )
    for parameter, stderr in zip(problem.parameters, found.stderr, strict=True):
        width = parameter.high - parameter.low
        if np.isfinite(stderr) and 0.0 < width < np.inf and 4.0 * stderr > width:
            warnings.append(
                f"{parameter.name} is hardly determined: its 95 % interval is as wide as "
                f"its bounds [{parameter.low:g}, {parameter.high:g}]"
            )
    if not problem.observations.has_polarisation:
        warnings.append(_unpolarised(problem, solved, found))
    return warnings


def _relative_to_what_is_held(problem: Problem) -> list[str]:
    """Say that what a relative scan gives holds for a gain that was not measured."""
    observations, layout = problem.observations, problem.layout
    bright = np.unique(observations.scan[observations.at[~observations.is_ratio]])
    scaled = "scale" in layout.column and observations.relative[bright].all()
    if not scaled or problem.gauges or "specular_gain" in layout.column:
        return []
    present = problem.model.values(observations.geometry).get("specular_gain", np.nan)
    gain = float(np.median(problem.fixed.get("specular_gain", present)))
    names = [
        label
        for label, base in zip(layout.labels, layout.base, strict=True)
        if base in ("diffuse_albedo", "volume_albedo", "grazing_albedo")
    ]
    if not names or not gain > 0.0:
        return []
    return [
        f"the scan is relative: {_listed(names)} holds if specular_gain is the {gain:g} at "
        "which it is held; an absolute albedo needs a calibrated scan"
    ]


def _unnamed_wavelengths(observations: Observations) -> list[str]:
    """Say that readings without a wavelength were taken with those that have one."""
    unknown = np.isnan(observations.geometry.wavelength[observations.at])
    waves = observations.wavelengths
    if len(waves) != 1 or not unknown.any():
        return []
    return [
        f"{int(unknown.sum())} readings name no wavelength; they were taken as of the "
        f"{waves[0]:g} um of the others"
    ]


def _turned_axes(problem: Problem, solved: Solved) -> list[str]:
    """Say that the model's own axes lie elsewhere than the sample's."""
    if "orientation" not in problem.layout.base:
        return []
    turned = float(solved.solution.x[problem.layout.base.index("orientation")])
    return [
        f"the axes of the slopes are turned by {np.rad2deg(turned):.4g} degrees: give the "
        f"model phi_i - ({turned:.4g}) rad, it has no azimuth of its own"
    ]


def _one_slope_for_all_azimuths(problem: Problem) -> list[str]:
    """Say that scans at several azimuths of the source were taken as of one lobe."""
    geometry = problem.observations.geometry
    azimuths = np.unique(np.mod(geometry.phi_i[problem.observations.at], np.pi).round(6))
    if len(azimuths) < 2 or "slope_rms" not in problem.layout.column:
        return []
    return [
        f"the scans have {len(azimuths)} azimuths of the source and one slope_rms; if the "
        "surface is anisotropic fit slope_rms_x and slope_rms_y"
    ]


def _up_to_a_factor(problem: Problem, solved: Solved, gauge: Gauge) -> str:
    """Say that gains and albedos are known only relative to each other."""
    labels = problem.layout.labels
    names = _listed([labels[i] for i in gauge.members])
    at = problem.observations.at[~problem.observations.is_ratio]
    relative = problem.observations.relative[problem.observations.scan[at]].any()
    if relative:
        return (
            f"only a combination of {names} is determined by these data, not each; the "
            "scan is relative, and an absolute albedo or gain needs a calibrated one"
        )
    cure = _cure(problem, solved, gauge.members)
    return (
        f"only a combination of {names} is determined by these data, not each: ratios of "
        f"readings know gain and albedo up to a common factor; fix one{cure}"
    )


def misfit_warnings(problem: Problem, solved: Solved, p_value: float) -> list[str]:
    """Name a misfit that the noise does not explain."""
    x, objective = solved.solution.x, solved.objective
    residual = objective.residuals(x)
    dof = len(residual) - len(x) + len(problem.gauges)
    warnings = []
    ratio = float((residual**2).sum()) / max(dof, 1)
    if p_value < 1e-3:
        warnings.append(
            f"chi2/dof is {ratio:.3g}: the model misses the data by more than their stated "
            "errors, and the standard errors do not include that; times "
            f"{np.sqrt(ratio):.2g} they would"
        )
    elif 1.0 - p_value < 1e-3:
        warnings.append(
            f"chi2/dof is {ratio:.3g}: the stated errors are larger than the scatter"
        )
    geometry, at = problem.observations.geometry, problem.observations.at
    columns = {
        "observable": problem.observations.name,
        "scan": problem.observations.scan[at],
        "residual": residual,
        "theta_view": geometry.theta_view[at],
        "theta_i": geometry.theta_i[at],
        "wavelength": geometry.wavelength[at],
    }
    running = [f"{name} ({size:.2f})" for name, size in running_together(columns)]
    if running:
        warnings.append(
            f"the residuals of {_listed(running)} run together along the scan (correlation "
            "of neighbours): a misfit of the model, not noise, so the standard errors are "
            "too small"
        )
    return warnings


def _at_bounds(problem: Problem, solved: Solved, stderr: np.ndarray) -> list[str]:
    """Name parameters that ended on a bound, and gains beyond what a surface reflects."""
    warnings = []
    ends = zip(problem.parameters, solved.solution.x, stderr, strict=True)
    for parameter, value, error in ends:
        if parameter.low == parameter.high:
            continue
        for bound in (parameter.low, parameter.high):
            if np.isfinite(bound) and abs(value - bound) <= 1e-9 * max(1.0, abs(bound)):
                text = (
                    f"{parameter.name} stands at its bound {bound:g}; the data would take "
                    "it further, or it is absent"
                )
                if _is_gain(parameter.name) and bound == 0.0:
                    text += ", or forward lies at another azimuth: --azimuth-of-forward 0"
                warnings.append(text)
        if _is_gain(parameter.name) and value - 1.0 > max(0.2, 3.0 * error):
            warnings.append(
                f"{parameter.name} is {value:.3g}: no surface reflects more than it should "
                "by its index. Is the scan relative, or a reflectance factor?"
            )
    return warnings


def _is_gain(name: str) -> bool:
    """Whether a parameter is the specular gain, of all scans or of one."""
    return name.partition("[")[0] == "specular_gain"


def _cure(problem: Problem, solved: Solved, involved: Sequence[int]) -> str:
    """Return " or add ..." with the cheapest reading that would settle it, or nothing."""
    now = _worst(_stderr_with(problem, solved, None), involved)
    best, advice = now, ""
    for text, extra in _possible(problem.model, problem.observations):
        then = _worst(_stderr_with(problem, solved, extra), involved)
        # Another reading must pay clearly more than the one before it in the list
        if then < 0.5 * best:
            best, advice = then, f" or add {text}"
    return advice


def _worst(stderr: np.ndarray, involved: Sequence[int]) -> float:
    return float(max(stderr[i] for i in involved))


def _possible(
    model: MuellerModel, observations: Observations
) -> list[tuple[str, Observations]]:
    """List what else could be read: other elements, or all at another incidence."""
    geometry = observations.geometry
    everywhere = np.unique(observations.at)
    extras = [
        (
            name,
            _readings(observations, geometry, np.full(everywhere.size, name), everywhere),
        )
        for name in getattr(model, "candidates", _CANDIDATES)
        if name not in observations.names
    ]
    incidences = np.unique(geometry.theta_i.round(6))
    if len(incidences) == 1:
        other = np.deg2rad(60.0 if incidences[0] < np.deg2rad(45.0) else 20.0)
        moved = replace(geometry, theta_i=np.full(geometry.size, other))
        text = f"a scan at {np.rad2deg(other):.0f} degrees incidence"
        extras.append(
            (text, _readings(observations, moved, observations.name, observations.at))
        )
    return extras


def _readings(
    observations: Observations, geometry: Geometry, name: np.ndarray, at: np.ndarray
) -> Observations:
    nothing = np.full(len(name), np.nan)
    return replace(
        observations, geometry=geometry, name=name, at=at, value=nothing, stderr=nothing
    )


def _stderr_with(
    problem: Problem, solved: Solved, extra: Observations | None
) -> np.ndarray:
    """Return the standard errors if `extra` had been read too, as well as the rest."""
    x = solved.solution.x
    rows = covariance_rows(solved.objective, x)
    if extra is not None:
        more = problem.predict(extra).jacobian(x).full()
        more = more / _stderr_there(problem.observations, solved.objective.stderr, extra)
        rows = np.vstack([rows, more[np.isfinite(more).all(axis=1)]])
    return information(rows).stderr


def _stderr_there(
    observations: Observations, stderr: np.ndarray, extra: Observations
) -> np.ndarray:
    """Return the errors of other readings, as good as those at the same place, (k, 1)."""
    is_element = observations.name != "DOLP"
    if not is_element.any():
        is_element = ~is_element
    at, known = observations.at[is_element], stderr[is_element]
    size = observations.geometry.size
    count = np.bincount(at, minlength=size)
    total = np.bincount(at, known, minlength=size)
    typical = np.where(count > 0, total / np.maximum(count, 1), np.median(known))
    return np.asarray(typical[extra.at][:, None])


def _unpolarised(problem: Problem, solved: Solved, found: Information) -> str:
    """Say what a scan of M00 alone leaves open, with the numbers."""
    text = (
        "the scan is unpolarised (M00 only): the polarisation of the reflected light is "
        "not tested, and specular and diffuse light are told apart only by the shape of "
        "M00, as far as slope_rms, shadowing and index are right"
    )
    at = np.unique(problem.observations.at)
    name = np.full(at.size, "M10")
    extra = _readings(problem.observations, problem.observations.geometry, name, at)
    then = _stderr_with(problem, solved, extra)
    gains = []
    for label, now, better in zip(problem.layout.labels, found.stderr, then, strict=True):
        if np.isinf(now) and np.isfinite(better):
            gains.append(f"determine {label}")
        elif better < 0.8 * now:
            gains.append(f"cut the standard error of {label} to {better / now:.0%}")
    if gains:
        text += f". M10 measured as well would {_listed(gains)}"
    return text


def _listed(words: Sequence[str]) -> str:
    """Join words as in a sentence.

    >>> _listed(["n", "kappa", "slope_rms"])
    'n, kappa and slope_rms'
    """
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def _percent(strength: float) -> str:
    """Write a correlation below 1 so that it does not round to 100 %.

    >>> _percent(0.9996), _percent(0.97)
    ('99.96', '97')
    """
    digits = max(0, int(np.ceil(-np.log10(max(1.0 - strength, 1e-12)))) - 2)
    return f"{np.floor(strength * 100 * 10**digits) / 10**digits:.{digits}f}"
