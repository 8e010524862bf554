"""Brightness that the readings know only up to a common factor.

Ratios, and scans that are declared relative, stay as they are when every gain and albedo
is multiplied by one number (and the scale of the scan divided by it). One gain of each such
family is held while the others are fitted; what is reported then is their ratio to it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import sparse

from fitting.objective.forward import Layout
from fitting.objective.parameters import PARAMETERS, Parameter
from fitting.readings.observations import Observations

__all__ = ["Gauge", "anchored", "gauges_of", "within_bounds"]

# Terms that add up to the brightness, each in proportion to its number
_TERMS = ("specular_gain", "diffuse_albedo", "grazing_albedo")


@dataclass(frozen=True, kw_only=True)
class Gauge:
    """Parameters that one factor can move together without a trace.

    Parameters
    ----------
    anchor : int
        Entry of the gain that is held.
    terms : tuple of int
        Entries of the other gains and albedos.
    scales : tuple of int
        Entries of the scales of the scans, which move the other way.
    """

    anchor: int
    terms: tuple[int, ...]
    scales: tuple[int, ...]

    @property
    def members(self) -> tuple[int, ...]:
        """All entries that no reading determines by itself, in order."""
        return tuple(sorted((self.anchor, *self.terms, *self.scales)))


def gauges_of(
    layout: Layout,
    observations: Observations,
    parameters: Sequence[Parameter],
    held: Mapping[str, Any],
    bounded: Sequence[str],
) -> tuple[Gauge, ...]:
    """Return the families of parameters known up to a factor.

    Parameters
    ----------
    layout : Layout
        The free parameters.
    observations : Observations
        The readings.
    parameters : sequence of Parameter
        Starts and priors, in the order of the layout.
    held : mapping of str to ndarray, shape (N,)
        Value of every parameter of model and instrument where it is not free.
    bounded : sequence of str
        Parameters for which the user set bounds; these are left as they are.
    """
    columns = {
        name: layout.column[name] for name in (*_TERMS, "scale") if name in layout.column
    }
    if "specular_gain" not in columns or set(columns) & set(bounded):
        return ()
    at = np.unique(observations.at)
    bright = np.zeros(observations.geometry.size, dtype=bool)
    bright[observations.at[~observations.is_ratio]] = True
    # Whatever is bright by a number that is held sets the scale of all it stands with
    fixed = bright & (columns["scale"] < 0 if "scale" in columns else bright)
    for name in (*_TERMS, "volume_albedo", "background"):
        present = np.broadcast_to(np.asarray(held.get(name, 0.0)) != 0.0, fixed.shape)
        if name not in columns:
            fixed = fixed | present | (name in layout.column)
    count = len(layout.labels)
    entries = np.stack([column[at] for column in columns.values()])
    family = _families(entries, count)
    found = []
    for number in np.unique(family[columns["specular_gain"][at]]):
        member = family == number
        here = at[(member[np.maximum(entries, 0)] & (entries >= 0)).any(axis=0)]
        inside = [int(i) for i in np.flatnonzero(member)]
        known = any(np.isfinite(parameters[i].prior_stderr) for i in inside)
        if fixed[here].any() or known:
            continue
        anchor = next(i for i in inside if layout.base[i] == "specular_gain")
        scales = tuple(i for i in inside if layout.base[i] == "scale")
        terms = tuple(i for i in inside if i not in (anchor, *scales))
        if terms or scales:
            found.append(Gauge(anchor=anchor, terms=terms, scales=scales))
    return tuple(found)


def _families(entries: np.ndarray, count: int) -> np.ndarray:
    """Return a number for each set of entries that meet at some reading, shape (count,)."""
    one, other = (
        np.concatenate(part)
        for part in zip(*((entries[0], row) for row in entries), strict=True)
    )
    meet = (one >= 0) & (other >= 0)
    graph = sparse.coo_array(
        (np.ones(meet.sum()), (one[meet], other[meet])), shape=(count, count)
    )
    return np.asarray(sparse.csgraph.connected_components(graph, directed=False)[1])


def anchored(
    parameters: Sequence[Parameter], gauges: Sequence[Gauge]
) -> tuple[Parameter, ...]:
    """Hold the anchors, and let what is relative to them exceed 1."""
    changed = list(parameters)
    for gauge in gauges:
        changed[gauge.anchor] = parameters[gauge.anchor].fixed_at(
            parameters[gauge.anchor].value
        )
        for index in gauge.terms:
            changed[index] = replace(parameters[index], high=np.inf)
    return tuple(changed)


def within_bounds(
    x: np.ndarray, gauges: Sequence[Gauge], base: Sequence[str]
) -> np.ndarray:
    """Return an equal point at which no albedo exceeds 1."""
    moved = x.copy()
    for gauge in gauges:
        excess = max((x[i] / PARAMETERS[base[i]][1] for i in gauge.terms), default=0.0)
        if excess > 1.0:
            factor = 0.5 / excess
            moved[[gauge.anchor, *gauge.terms]] *= factor
            moved[list(gauge.scales)] /= factor
    return moved
