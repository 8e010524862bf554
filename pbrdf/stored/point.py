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

# What nodes left out tell of a gap scatters by so much: with it, what is stated holds in
# nine of ten directions (`tests/stored/test_stated_error.py`)
MARGIN = 1.4


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

    def between(
        self,
        theta_i: np.ndarray,
        theta_s: np.ndarray,
        dphi: np.ndarray,
        m00: np.ndarray,
    ) -> np.ndarray:
        """Return the error of interpolation of directions, shape (n, 4, 4). [1/sr]

        Errors along the axes and within bins are independent of each other.
        """
        found: Any = np.empty((theta_i.size, 4, 4))
        for place in np.unique(theta_i):
            here = theta_i == place
            peak = self._peak(float(place))
            errors = np.hypot(self._points, self._between_incidences(float(place)))
            kind = of_part(m00[here] / peak)
            within = self._within_bins(float(place), theta_s[here], dphi[here], kind)
            scale = np.maximum(m00[here], DARK * peak)[:, None, None]
            found[here] = MARGIN * np.hypot(errors[kind], within) * scale
        return np.asarray(found)

    def _within_bins(
        self, theta_i: float, theta_s: np.ndarray, dphi: np.ndarray, kind: np.ndarray
    ) -> np.ndarray:
        """Error within bins of directions of these classes, in parts of `floor`."""
        nodes = self.lobes.theta_i
        on = np.isclose(nodes, theta_i, rtol=1e-9, atol=1e-12)
        upper = int(np.searchsorted(nodes, theta_i))
        about = self._bins[on] if on.any() else self._bins[max(upper - 1, 0) : upper + 1]
        errors = about.mean(0)[:, :, kind]
        if on.any():
            across, along_ = (
                4.0 * share * (1.0 - share)
                for share in (np.mod(p, 1.0) for p in self.lobes.place(theta_s, dphi))
            )
        else:
            # Where the same facets shine at other incidences may be anywhere in a bin
            across = along_ = np.full(theta_s.size, 2.0 / 3.0)
        a, b = across[:, None, None], along_[:, None, None]
        return np.asarray(
            (1 - a) * ((1 - b) * errors[0, 0] + b * errors[0, 1])
            + a * ((1 - b) * errors[1, 0] + b * errors[1, 1])
        )

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

    def trial(left: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        theta_i = np.full(theta_s.size, lobes.theta_i[left])
        found, spread = lobes.brdf(
            theta_i, theta_s.ravel(), dphi.ravel(), without=left, apart=True
        )
        whole = (*theta_s.shape, 4, 4)
        noise = np.hypot(spread.reshape(whole), lobes.stderr[left])
        return found.reshape(whole), lobes.value[left], noise

    return trial


def _between_bins(lobes: Lobes, incidence: int) -> np.ndarray:
    """Error between the centres of bins, and of the mean over a bin for its centre.

    A bin left out is missed over two steps, four times as much as half way within one. The
    mean over a bin of width h differs from its centre by h²/24 f'', and in theta by as much
    as the weight sin(theta) cos(theta) tips it, h²/12 f' 2 cot(2 theta).

    Returns
    -------
    ndarray, shape (2, 2, classes, 4, 4)
        At the centre of a bin and half way to the next, in theta_s and in dphi.
    """
    value, stderr = lobes.value[incidence], lobes.stderr[incidence]
    inner = slice(1, -1)
    apart, means = [], []
    for axis in (0, 1):
        before, after = np.roll(value, 1, axis), np.roll(value, -1, axis)
        found, _ = combined(
            np.array([0.5, 0.5]),
            np.stack([before, after], -3),
            np.stack([np.roll(stderr, 1, axis), np.roll(stderr, -1, axis)], -3),
            log=True,
        )
        apart.append((found - value)[inner] / 4)
        means.append((before - 2 * value + after)[inner] / 24)
        if axis == 0:
            tip = _tip(lobes.theta_s)[inner, None, None, None]
            means[0] = means[0] + tip * (after - before)[inner]
    total = np.empty((2, 2, len(CLASSES), 4, 4))
    for a, b in np.ndindex(2, 2):
        error = a * apart[0] + b * apart[1] + means[0] + means[1]
        # Each is a multiple of the mean of two bins less the one between them
        c, d = a / 4 + 1 / 12, b / 4 + 1 / 12
        noise = stderr[inner] * np.sqrt(1.5 * (c**2 + d**2) + 2 * c * d)
        total[a, b] = grouped(error, value[inner], noise)
    return total


def _tip(theta_s: np.ndarray) -> np.ndarray:
    """Return what the weight of directions makes of the difference beside a bin."""
    step = theta_s[1] - theta_s[0]
    return np.asarray(step / 12.0 / np.tan(2.0 * theta_s))
