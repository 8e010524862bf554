"""Interpolation along one axis, and how its error scales from nodes left out to gaps."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

__all__ = ["SCHEMES", "Scheme", "combined"]

# An M00 below so many of its standard errors has no logarithm worth the name
KNOWN = 3.0
# M00 between nodes goes beyond theirs by this factor at most
BEYOND = 1.25

Function = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, kw_only=True)
class Scheme:
    """A way to interpolate between nodes.

    Attributes
    ----------
    name : str
    log : bool
        Whether the logarithm of M00 and the elements over M00 are interpolated, as suits a
        lobe, or the elements themselves, as suits a mixture.
    basis : tuple of callables
        Functions of the axis that are interpolated exactly by as many nodes about a place.
    next : callable
        The first function that is not; its error tells how the error scales.
    positive : bool
        Whether the axis must be.
    """

    name: str
    log: bool
    basis: tuple[Function, ...]
    next: Function
    positive: bool = False

    def fits(self, nodes: np.ndarray) -> bool:
        """Whether its error can be measured: each inner node by those that are left."""
        enough = len(nodes) > max(len(self.basis), 2)
        return enough and not (self.positive and nodes[0] <= 0)

    def weights(
        self, nodes: np.ndarray, place: np.ndarray | float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the indices of the nodes about places, and their weights.

        Shapes (..., nodes of the basis), with the shape of `place` before. On a node that
        node alone counts.
        """
        place = np.asarray(place, dtype=np.float64)
        index = self._about(nodes, place)
        here = nodes[index]
        scale = self._scale(here)[..., None]
        matrix = np.stack([function(here / scale) for function in self.basis], axis=-2)
        at = place / scale[..., 0]
        wanted = np.stack([function(at) for function in self.basis], axis=-1)
        weight = np.linalg.solve(matrix, wanted[..., None])[..., 0]
        on = np.isclose(here, place[..., None], rtol=1e-9, atol=1e-12)
        return index, np.where(on.any(-1, keepdims=True), on.astype(float), weight)

    def defect(self, nodes: np.ndarray, place: float) -> float:
        """Error at a place of the first function that is not interpolated exactly."""
        index, weight = self.weights(nodes, place)
        scale = self._scale(nodes)
        missed = self.next(np.asarray(place / scale)) - weight @ self.next(
            nodes[index] / scale
        )
        return float(abs(missed))

    def _about(self, nodes: np.ndarray, place: np.ndarray) -> np.ndarray:
        """Consecutive nodes that enclose places, as evenly as the ends allow."""
        size = len(self.basis)
        upper = np.clip(np.searchsorted(nodes, place), 1, len(nodes) - 1)
        start = upper - size // 2
        if size % 2:
            # One more on the nearer side
            start = start - (place - nodes[upper - 1] < nodes[upper] - place)
        start = np.clip(start, 0, len(nodes) - size)
        return start[..., None] + np.arange(size)

    def _scale(self, nodes: np.ndarray) -> np.ndarray:
        """Size of the numbers, which keeps the powers tame."""
        return np.asarray(nodes.mean(-1) if self.positive else np.abs(nodes).max(-1))


def _one(x: np.ndarray) -> np.ndarray:
    return np.ones_like(x)


def _power(order: int) -> Function:
    return lambda x: x**order


def _logarithm(order: int) -> Function:
    return lambda x: np.log(x) ** order


_LINEAR = (_one, _power(1))
_QUADRATIC = (*_LINEAR, _power(2))
_CUBIC = (_one, _power(1), _power(2), _power(3))
_LOG_CUBIC = (_one, *(_logarithm(k) for k in (1, 2, 3)))
# ln of exp(-tan^2/(2 s^2)) / s^2 as a function of s
_GAUSSIAN = (_one, _logarithm(1), _power(-2))

SCHEMES = {
    one.name: one
    for one in (
        Scheme(name="linear", log=False, basis=_LINEAR, next=_power(2)),
        Scheme(name="linear in ln M00", log=True, basis=_LINEAR, next=_power(2)),
        Scheme(name="quadratic", log=False, basis=_QUADRATIC, next=_power(3)),
        Scheme(name="quadratic in ln M00", log=True, basis=_QUADRATIC, next=_power(3)),
        Scheme(name="cubic", log=False, basis=_CUBIC, next=_power(4)),
        Scheme(name="cubic in ln M00", log=True, basis=_CUBIC, next=_power(4)),
        Scheme(
            name="cubic in ln x of ln M00", log=True, basis=_LOG_CUBIC,
            next=_logarithm(4), positive=True,
        ),
        Scheme(
            name="1, ln x, x^-2 of ln M00", log=True, basis=_GAUSSIAN,
            next=_logarithm(2), positive=True,
        ),
    )
}  # fmt: skip


def combined(
    weight: np.ndarray,
    value: np.ndarray,
    stderr: np.ndarray,
    *,
    log: bool,
    apart: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Put the Mueller matrices of several nodes together.

    Parameters
    ----------
    weight : ndarray, shape (..., nodes)
        Of each node, with the sum 1.
    value, stderr : ndarray, shape (..., nodes, 4, 4)
        Matrices and their standard errors. [1/sr]
    log : bool
        As of `Scheme`; where a node is too dark or too noisy for that, the positive weights
        mix the matrices themselves.
    apart : bool
        Whether neighbours err each by itself, so that squares of errors add. They may err
        together, so that errors add without it.

    Returns
    -------
    ndarray, ndarray, shape (..., 4, 4)
    """
    mixing = np.maximum(weight, 0.0) if log else weight
    mixing = mixing / mixing.sum(-1, keepdims=True)
    plain = np.einsum("...k,...kij->...ij", mixing, value)
    spread = _spread(mixing, stderr, apart)
    if not log:
        return plain, spread
    m00 = value[..., 0, 0]
    known = ((m00 > KNOWN * stderr[..., 0, 0]) | (weight == 0.0)).all(-1)
    safe = np.where(m00 > 0.0, m00, 1.0)
    # Cubics swing between nodes that are decades apart
    used = np.where(weight == 0.0, np.nan, safe)
    level = np.clip(
        np.exp(np.einsum("...k,...k->...", weight, np.log(safe))),
        np.nanmin(used, -1) / BEYOND,
        np.nanmax(used, -1) * BEYOND,
    )[..., None, None]
    shape = np.einsum("...k,...kij->...ij", weight, value / safe[..., None, None])
    errs = _spread(weight, stderr / safe[..., None, None], apart)
    here = known[..., None, None]
    return np.where(here, level * shape, plain), np.where(here, level * errs, spread)


def _spread(weight: np.ndarray, stderr: np.ndarray, apart: bool) -> np.ndarray:
    """Return the error of a sum over nodes that err each by itself, or all together."""
    if apart:
        return np.asarray(np.sqrt(np.einsum("...k,...kij->...ij", weight**2, stderr**2)))
    return np.asarray(np.einsum("...k,...kij->...ij", np.abs(weight), stderr))
