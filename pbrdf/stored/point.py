"""All incidences at one value of every parameter, and what the interpolation errs by."""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from pbrdf.stored.left_out import (
    CLASSES,
    DARK,
    Trial,
    along,
    grouped,
    midway,
    missed,
    of_part,
)
from pbrdf.stored.lobes import Lobes
from pbrdf.stored.schemes import combined

__all__ = ["Point", "incidence_trial"]


class Point:
    """A point of the parameters.

    Parameters
    ----------
    lobes : Lobes
    parameters : callable
        Returns the error of interpolation between points of the sweep, by class.
    """

    def __init__(self, lobes: Lobes, parameters: Callable[[], np.ndarray]) -> None:
        self.lobes = lobes
        self._parameters = parameters

    @cached_property
    def _points(self) -> np.ndarray:
        """Error between points of the sweep."""
        return self._parameters()

    @cached_property
    def _bins(self) -> np.ndarray:
        """Error between bins of each incidence."""
        return np.stack(
            [_between_bins(self.lobes, k) for k in range(len(self.lobes.theta_i))]
        )

    @cached_property
    def _incidence(self) -> Callable[[int], np.ndarray]:
        return missed(incidence_trial(self.lobes))

    def between(self, theta_i: np.ndarray, m00: np.ndarray) -> np.ndarray:
        """Return the error of interpolation of directions, shape (n, 4, 4). [1/sr]"""
        found: Any = np.empty((theta_i.size, 4, 4))
        for place in np.unique(theta_i):
            here = theta_i == place
            peak = self._peak(float(place))
            upper = int(np.searchsorted(self.lobes.theta_i, place))
            about = self._bins[max(upper - 1, 0) : upper + 1].max(0)
            errors = self._points + about + self._between_incidences(float(place))
            scale = np.maximum(m00[here], DARK * peak)
            found[here] = errors[of_part(m00[here] / peak)] * scale[:, None, None]
        return np.asarray(found)

    def _peak(self, theta_i: float) -> float:
        """Brightest M00 of the bins, between incidences."""
        peaks = self.lobes.value[..., 0, 0].max((1, 2))
        return float(np.interp(theta_i, self.lobes.theta_i, peaks))

    def _between_incidences(self, theta_i: float) -> np.ndarray:
        lobes, nodes = self.lobes, self.lobes.theta_i
        if len(nodes) == 1:
            return np.zeros((len(CLASSES), 4, 4))
        if len(nodes) == 2:
            share = (theta_i - nodes[0]) / np.ptp(nodes)
            return midway(lobes.value[0], lobes.value[1], share)
        return along(lobes.scheme, nodes, theta_i, self._incidence)


def incidence_trial(lobes: Lobes) -> Trial:
    """Return the trial of incidences left out, at the centres of their bins."""
    theta_s, dphi = np.meshgrid(lobes.theta_s, lobes.dphi, indexing="ij")

    def trial(left: int) -> tuple[np.ndarray, np.ndarray]:
        theta_i = np.full(theta_s.size, lobes.theta_i[left])
        found, _ = lobes.brdf(theta_i, theta_s.ravel(), dphi.ravel(), without=left)
        return found.reshape((*theta_s.shape, 4, 4)), lobes.value[left]

    return trial


def _between_bins(lobes: Lobes, incidence: int) -> np.ndarray:
    """Error between the centres of bins, and of the mean over a bin for its centre.

    A bin left out is missed over two steps, four times as much as within one.
    """
    value, stderr = lobes.value[incidence], lobes.stderr[incidence]
    total = np.zeros((len(CLASSES), 4, 4))
    for axis in (0, 1):
        before, after = np.roll(value, 1, axis), np.roll(value, -1, axis)
        found, _ = combined(
            np.array([0.5, 0.5]),
            np.stack([before, after], -3),
            np.stack([np.roll(stderr, 1, axis), np.roll(stderr, -1, axis)], -3),
            log=True,
        )
        inner = slice(1, -1) if axis == 0 else slice(None)
        between = grouped((found - value)[inner], value[inner]) / 4
        mean = grouped((before - 2 * value + after)[inner], value[inner]) / 24
        total = total + between + mean
    return total
