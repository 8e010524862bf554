"""The error of interpolation, measured at nodes that are left out."""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from pbrdf.stored.schemes import SCHEMES, Scheme, combined

__all__ = [
    "CLASSES",
    "DARK",
    "Measured",
    "along",
    "best",
    "brightness",
    "grouped",
    "midway",
    "missed",
    "parameter_trial",
]

# Classes of M00 in parts of the peak of its hemisphere: from which part on
CLASSES = {"above 10 %": 0.1, "1 % to 10 %": 0.01, "below 1 %": 0.0}
# Of the directions of a class: this part of them errs less than what is told
SHARE = 0.9
DARK, TINY = 0.01, 1e-300

# A normal error exceeds so many standard deviations in the other directions
OF_SHARE = 1.645

# Return (value predicted, value computed, standard error of their difference) with the
# node left out
Trial = Callable[[int], tuple[np.ndarray, np.ndarray, np.ndarray]]


def brightness(m00: np.ndarray) -> np.ndarray:
    """Return the class of each direction; the last two axes are a hemisphere."""
    return of_part(m00 / np.maximum(m00.max((-2, -1), keepdims=True), TINY))


def of_part(part: np.ndarray) -> np.ndarray:
    """Return the class of M00 in parts of the peak."""
    return np.digitize(-part, [-limit for limit in list(CLASSES.values())[:-1]])


def floor(m00: np.ndarray) -> np.ndarray:
    """Return what errors are parts of: M00, or 1 % of its peak where it is darker.

    The last two axes are a hemisphere.
    """
    return np.maximum(m00, DARK * m00.max((-2, -1), keepdims=True))


def grouped(
    error: np.ndarray, value: np.ndarray, noise: np.ndarray | None = None
) -> np.ndarray:
    """Return what 90 % of the directions of each class err less than, in parts of `floor`.

    Parameters
    ----------
    error, value : ndarray, shape (..., theta_s, dphi, 4, 4)
    noise : ndarray, of the same shape, optional
        Standard error of the error, which is taken out in square: it is counted elsewhere.

    Returns
    -------
    ndarray, shape (classes, 4, 4)
        0 for a class without directions.
    """
    m00 = value[..., 0, 0]
    kind = brightness(m00)
    scale = np.maximum(floor(m00), TINY)[..., None, None]
    part = np.abs(error) / scale
    found = np.zeros((len(CLASSES), 4, 4))
    for number in range(len(CLASSES)):
        here = kind == number
        if here.any():
            found[number] = np.quantile(part[here], SHARE, axis=0)
            if noise is not None:
                mean = ((noise / scale)[here] ** 2).mean(axis=0)
                rest = found[number] ** 2 - OF_SHARE**2 * mean
                found[number] = np.sqrt(np.maximum(rest, 0.0))
    return found


def missed(trial: Trial, *, noisy: bool = False) -> Callable[[int], np.ndarray]:
    """Return what nodes are missed by when left out, by class; each is tried once.

    Without the noise of the simulation, or with it (`noisy`).
    """

    @cache
    def found(left: int) -> np.ndarray:
        predicted, computed, noise = trial(left)
        return grouped(predicted - computed, computed, None if noisy else noise)

    return found


def along(
    scheme: Scheme, nodes: np.ndarray, place: float, found: Callable[[int], np.ndarray]
) -> np.ndarray:
    """Return the error at a place between nodes, as of `grouped`.

    What the nodes next to the place are missed by when left out goes with the defect of
    the scheme, smaller in a gap than over two of them; of two nodes the worse one counts.
    """
    here = scheme.defect(nodes, place)
    if here == 0.0:
        return np.zeros((len(CLASSES), 4, 4))
    upper = int(np.searchsorted(nodes, place))
    inner = [k for k in (upper - 1, upper) if 0 < k < len(nodes) - 1]
    shares = [here / scheme.defect(np.delete(nodes, k), float(nodes[k])) for k in inner]
    return np.max([s * found(k) for s, k in zip(shares, inner, strict=True)], axis=0)


def midway(first: np.ndarray, last: np.ndarray, share: float) -> np.ndarray:
    """Return the error between two nodes alone: half their difference in the middle."""
    middle = 0.5 * (first + last)
    return 2.0 * share * (1.0 - share) * grouped(last - first, middle)


class Measured(NamedTuple):
    """How to interpolate along an axis, and what that errs by in the store.

    Attributes
    ----------
    scheme : Scheme
    at_nodes : ndarray, shape (classes, 4, 4)
        The most that a node was missed by, NaN if none could be left out.
    between : ndarray, shape (classes, 4, 4)
        The most in the middle of a gap.
    """

    scheme: Scheme
    at_nodes: np.ndarray
    between: np.ndarray


def best(nodes: np.ndarray, trial: Callable[[Scheme], Trial]) -> Measured:
    """Return the scheme that errs least in bright M00 between three nodes or more."""
    tried = []
    for scheme in SCHEMES.values():
        if scheme.fits(nodes):
            # Chosen with the noise, which some schemes make larger
            each = _measured(scheme, nodes, missed(trial(scheme), noisy=True))
            tried.append(each)
    chosen = min(tried, key=lambda one: one.between[:2, 0, 0].max()).scheme
    return _measured(chosen, nodes, missed(trial(chosen)))


def _measured(
    scheme: Scheme, nodes: np.ndarray, found: Callable[[int], np.ndarray]
) -> Measured:
    at_nodes = np.max([found(k) for k in range(1, len(nodes) - 1)], axis=0)
    gaps = 0.5 * (nodes[1:] + nodes[:-1])
    between = np.max([along(scheme, nodes, gap, found) for gap in gaps], axis=0)
    return Measured(scheme, at_nodes, between)


def parameter_trial(
    scheme: Scheme, nodes: np.ndarray, value: np.ndarray, stderr: np.ndarray
) -> Trial:
    """Return the trial of nodes that lie along the first axis of the values."""

    def trial(left: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        held = np.delete(np.arange(len(nodes)), left)
        index, weight = scheme.weights(nodes[held], float(nodes[left]))
        at = held[index]
        found, spread = combined(
            weight, np.moveaxis(value[at], 0, -3), np.moveaxis(stderr[at], 0, -3),
            log=scheme.log, apart=True,
        )  # fmt: skip
        return found, value[left], np.hypot(spread, stderr[left])

    return trial


def error_of_albedo(
    noise: np.ndarray, between: np.ndarray, weight: np.ndarray
) -> np.ndarray:
    """Error of the sum over the hemisphere (..., theta_s, dphi) of errors of M00."""
    independent = np.sum((noise * weight) ** 2, axis=(-2, -1))
    alike = np.sum(between * weight, axis=(-2, -1))
    found: np.ndarray = np.sqrt(independent + alike**2)
    return found
