"""Numbers of a fit as tables: what was found, and what was held."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.estimate import Estimate
from fitting.objective.forward import INSTRUMENT
from fitting.objective.parameters import PARAMETERS
from fitting.problem.problem import Problem

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["held_values", "parameter_frame"]

_RULES = ("shadowing", "slope_distribution", "volume_form", "grazing_form")


def held_values(problem: Problem, model: Any) -> dict[str, Any]:
    """Return the values of all that was not free, and the rules of the model.

    What differs from wavelength to wavelength is a mapping by wavelength. [um]
    """
    geometry = problem.observations.geometry
    at = np.unique(problem.observations.at)
    present: dict[str, Any] = {**INSTRUMENT, **problem.model.values(geometry)}
    found: dict[str, Any] = {}
    for name, value in {**present, **problem.fixed}.items():
        if name in problem.layout.column:
            continue
        column = np.broadcast_to(np.asarray(value, dtype=float), (geometry.size,))[at]
        if np.ptp(column) == 0.0:
            found[name] = float(column[0])
            continue
        pairs = zip(geometry.wavelength[at].tolist(), column.tolist(), strict=True)
        found[name] = {f"{wave:.9g}": held for wave, held in pairs}
    # Of a simulated surface the rules of the analytical model that it corrects
    analytic = getattr(model, "model", model)
    for rule in _RULES:
        if isinstance(getattr(analytic, rule, None), str):
            found[rule] = getattr(analytic, rule)
    return found


def parameter_frame(problem: Problem, estimates: Mapping[str, Estimate]) -> "pd.DataFrame":
    """Return a row for each estimate of a parameter, or of a ratio of two.

    Columns: the parameter without its group, scan and wavelength [um] of the group (empty
    and nan where it is shared), value, stderr, low, high and unit.
    """
    import pandas as pd

    groups = _groups(problem)
    rows = {}
    for name, estimate in estimates.items():
        first, _, other = name.partition(" / ")
        parameter, scan, wavelength = groups[first]
        unit = PARAMETERS[parameter][3] if parameter in PARAMETERS else ""
        if other:
            parameter = f"{parameter} / {groups[other][0]}"
        rows[name] = {
            "parameter": parameter,
            "scan": scan,
            "wavelength": wavelength,
            **estimate.as_dict(),
            "unit": unit,
        }
    return pd.DataFrame.from_dict(rows, orient="index").rename_axis("name")


def _groups(problem: Problem) -> dict[str, tuple[str, str, float]]:
    """Return parameter, scan and wavelength of each entry."""
    observations, layout = problem.observations, problem.layout
    at = np.unique(observations.at)
    groups = {}
    for index, (label, base) in enumerate(zip(layout.labels, layout.base, strict=True)):
        here = at[layout.column[base][at] == index]
        waves = np.unique(observations.geometry.wavelength[here].round(9))
        scans = np.unique(observations.scan[here])
        spectral = len(waves) == 1 and len(observations.wavelengths) > 1
        alone = len(scans) == 1 and f"[{observations.labels[scans[0]]}" in label
        groups[label] = (
            base,
            observations.labels[scans[0]] if alone else "",
            float(waves[0]) if spectral else np.nan,
        )
    return groups
