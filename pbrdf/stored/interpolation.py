"""The points of a sweep's store, and what lies between them."""

import warnings
from collections import OrderedDict
from collections.abc import Iterable
from functools import cached_property
from typing import Any

import numpy as np

from pbrdf.errors import AccuracyWarning
from pbrdf.stored.contents import Contents, Parameter
from pbrdf.stored.left_out import (
    CLASSES,
    Measured,
    along,
    best,
    midway,
    missed,
    parameter_trial,
)
from pbrdf.stored.lobes import Lobes
from pbrdf.stored.point import Point, incidence_trial
from pbrdf.stored.schemes import SCHEMES, Scheme, combined

__all__ = ["Interpolation"]

# Points of the parameters that stay in memory
_KEPT = 8
# Beyond this miss of a value left out, in parts of M00, errors do not scale to gaps
COARSE = 0.5


class Interpolation:
    """Interpolation of a store along its parameters, chosen by leaving out nodes.

    Parameters
    ----------
    contents : Contents
        The opened store.
    """

    def __init__(self, contents: Contents) -> None:
        self._contents = contents
        self._theta_i = contents.dataset.theta_i.to_numpy()
        self._points: OrderedDict[tuple[Any, ...], Point] = OrderedDict()
        # What to say of axes, once, when something is interpolated along them
        self._doubts: dict[str, str] = {}

    def warn(self, names: Iterable[str]) -> None:
        """Say of axes that are interpolated along where the error of it is a guess."""
        for name in names:
            doubt = self._doubts.pop(name, None)
            if doubt is not None:
                warnings.warn(doubt, AccuracyWarning, stacklevel=4)

    def point(self, place: dict[str, Any]) -> Point:
        """Return the interpolated point, one of those in memory if it is there."""
        parameters = self._contents.parameters
        place = {name: parameters[name].check(value) for name, value in place.items()}
        key = tuple(place.values())
        if key not in self._points:
            lobes = self._lobes(*self._reduced(place), self._scheme("theta_i"))
            self._points[key] = Point(lobes, lambda: self._between_points(place))
            if len(self._points) > _KEPT:
                self._points.popitem(last=False)
        self._points.move_to_end(key)
        return self._points[key]

    def _lobes(self, value: np.ndarray, stderr: np.ndarray, scheme: Scheme) -> Lobes:
        data = self._contents.dataset
        return Lobes(
            theta_i=self._theta_i, theta_s=data.theta_s.to_numpy(),
            dphi=data.dphi.to_numpy(), value=value, stderr=stderr, scheme=scheme,
        )  # fmt: skip

    def _between_points(self, place: dict[str, Any]) -> np.ndarray:
        """Error of the interpolation along all parameters, by class."""
        total = np.zeros((len(CLASSES), 4, 4))
        for name, parameter in self._axes.items():
            if not parameter.number:
                continue
            if np.isclose(parameter.nodes, place[name], rtol=1e-9).any():
                continue
            # Others than those that are interpolated may have failed
            keep = self._finished_about(name, place)
            value, stderr = self._reduced(place, {name: keep})
            nodes, scheme = parameter.nodes[keep], self._scheme(name)
            if scheme.fits(nodes):
                found = missed(parameter_trial(scheme, nodes, value, stderr))
                error = along(scheme, nodes, place[name], found)
            elif np.isnan(self.measured[name].at_nodes).all():
                share = (place[name] - nodes[0]) / (nodes[1] - nodes[0])
                error = midway(value[0], value[1], share)
            else:
                # None to leave out here: what the axis errs by where more are finished, in
                # the middle of its worst gap
                error = self.measured[name].between
            total = np.hypot(total, error)
        return total

    def _finished_about(self, name: str, place: dict[str, Any]) -> np.ndarray:
        """Return the nodes of an axis that are finished at all points about a place."""
        stencil, _ = self._stencil(place, {name: np.arange(len(self._axes[name].nodes))})
        axes = list(self._axes)
        done = self._contents.finished(axes)[np.ix_(*(stencil[one] for one in axes))]
        others = tuple(k for k, one in enumerate(axes) if one != name)
        return np.flatnonzero(done.all(others))

    @property
    def _axes(self) -> dict[str, Parameter]:
        """Parameters that are dimensions of the store."""
        return self._contents.parameters

    def _middle(self) -> dict[str, np.ndarray]:
        """Return the middle of all axes, or the finished point nearest to it.

        Of those where most nodes along the axes are finished: most can be left out there.
        """
        middle = np.array([(len(p.nodes) - 1) // 2 for p in self._axes.values()], dtype=int)
        finished = self._contents.finished(self._axes)
        held = sum(finished.sum(k, keepdims=True) for k in range(finished.ndim))
        held = np.where(finished, held, 0)
        done = np.argwhere(finished & (held == held.max(initial=0)))
        if len(done):
            middle = done[np.argmin(np.abs(done - middle).sum(-1))]
        return {n: np.array([at]) for n, at in zip(self._axes, middle, strict=True)}

    def _finished_along(self, name: str, middle: dict[str, np.ndarray]) -> np.ndarray:
        """Return the numbers of the finished nodes of one axis through a point."""
        here = tuple(slice(None) if n == name else int(middle[n][0]) for n in self._axes)
        return np.flatnonzero(self._contents.finished(self._axes)[here])

    def _stencil(
        self, place: dict[str, Any], keep: dict[str, np.ndarray]
    ) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        """Return indices and weights of the points about a place, along each axis.

        Of axes in `keep` the nodes that are given there, without weights.
        """
        stencil: dict[str, np.ndarray] = {}
        weights: dict[str, np.ndarray] = {}
        for name, parameter in self._axes.items():
            if name in keep:
                stencil[name] = keep[name]
            elif parameter.number and len(parameter.nodes) > 1:
                index, weight = self._scheme(name).weights(parameter.nodes, place[name])
                # Points that count for nothing need not be finished
                stencil[name], weights[name] = index[weight != 0], weight[weight != 0]
            else:
                stencil[name] = np.flatnonzero(parameter.nodes == place[name])[:1]
                weights[name] = np.ones(1)
        return stencil, weights

    def _reduced(
        self, place: dict[str, Any], keep: dict[str, np.ndarray] | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Hemispheres of all incidences at a place; along one parameter at its nodes."""
        keep = keep or {}
        stencil, weights = self._stencil(place, keep)
        value, stderr = self._contents.read(stencil)
        for axis, name in reversed(list(enumerate(stencil))):
            if name in keep:
                continue
            # Stokes axes are last, the axis that goes before them
            value, stderr = combined(
                weights[name], np.moveaxis(value, axis, -3), np.moveaxis(stderr, axis, -3),
                log=len(weights[name]) > 1 and self._scheme(name).log,
            )  # fmt: skip
        return value, stderr

    def _scheme(self, name: str) -> Scheme:
        return self.measured[name].scheme if name in self.measured else SCHEMES["linear"]

    @cached_property
    def measured(self) -> dict[str, Measured]:
        """How each axis is interpolated, and its error, at the middle of all others."""
        middle = self._middle()
        found: dict[str, Measured] = {}
        for name, one in self._axes.items():
            if one.number and len(one.nodes) > 1:
                along = self._finished_along(name, middle)
                if len(along) < 2:
                    continue
                value, stderr = (
                    array.reshape(len(along), *array.shape[len(middle) :])
                    for array in self._contents.read(middle | {name: along})
                )
                found[name] = _measure(one.nodes[along], value, stderr)
        value, stderr = (
            array.reshape(array.shape[len(middle) :])
            for array in self._contents.read(middle)
        )
        nodes = self._theta_i
        if len(nodes) == 2:
            found["theta_i"] = _of_two(value)
        elif len(nodes) > 2:
            found["theta_i"] = best(
                nodes, lambda scheme: incidence_trial(self._lobes(value, stderr, scheme))
            )
        doubts = {name: _doubt(name, one) for name, one in found.items()}
        self._doubts = {name: doubt for name, doubt in doubts.items() if doubt}
        return found


def _measure(nodes: np.ndarray, value: np.ndarray, stderr: np.ndarray) -> Measured:
    if len(nodes) == 2:
        return _of_two(value)
    return best(nodes, lambda scheme: parameter_trial(scheme, nodes, value, stderr))


def _of_two(value: np.ndarray) -> Measured:
    """Return what is known between two nodes, none of which can be left out."""
    between = midway(value[0], value[1], 0.5)
    return Measured(SCHEMES["linear in ln M00"], np.full_like(between, np.nan), between)


def _doubt(name: str, measured: Measured) -> str:
    """Tell where values left out tell nothing of the gaps, empty where they do."""
    worst = float(measured.at_nodes[0, 0, 0])
    if np.isnan(measured.at_nodes).all():
        worst = 100 * measured.between[:2, 0, 0].max()
        return (
            f"the store has two values of {name}, none to leave out: half their "
            f"difference, up to {worst:.2g} % of M00 where it is bright, stands for the "
            "error between them. Compute a third by a sweep."
        )
    if not worst > COARSE:
        return ""
    return (
        f"the store's values of {name} must lie closer: one of them left out is missed "
        f"by {100 * worst:.2g} % of M00 where it is bright, which says little of the "
        "gaps. Errors between them are guesses. Compute more values by a sweep."
    )
