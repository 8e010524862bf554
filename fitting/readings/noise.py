"""How well each reading is known: from the file, from a stated model, or from the misfit.

A goniometer's noise is a fixed part of the light it receives, a fixed floor, or both:

    stderr(M_ij) = sqrt(absolute^2 + (relative M00)^2),

with the true M00, for which the fitted curve stands: weights taken from the noisy readings
themselves pull every fit low, because a reading that is low by chance is trusted more.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fitting.readings.observations import Observations
from pbrdf.errors import one_number

__all__ = ["Noise", "Weights", "weights_for"]

# Fewer readings of an observable than this share one noise with the others
_ENOUGH = 6


@dataclass(frozen=True, kw_only=True)
class Noise:
    """A stated noise of the goniometer.

    Parameters
    ----------
    relative : float
        Part of M00. [1]
    absolute : float
        Floor, for every Mueller element. [1/sr]

    Examples
    --------
    >>> float(Noise(relative=0.03, absolute=0.004).of(np.array([0.1]))[0])
    0.005
    """

    relative: float = 0.0
    absolute: float = 0.0

    def __post_init__(self) -> None:
        for name in ("relative", "absolute"):
            value = getattr(self, name)
            one_number(name, value, np.isfinite, "be a number", "A share, or 1/sr.")
        total = self.relative + self.absolute
        if self.relative < 0.0 or self.absolute < 0.0 or total <= 0.0:
            msg = (
                f"noise must be >= 0 and not both 0, got relative {self.relative:g}, "
                f"absolute {self.absolute:g}. Use noise=None to have it estimated."
            )
            raise ValueError(msg)

    def of(self, m00: np.ndarray) -> np.ndarray:
        """Return the standard error of an element where M00 is `m00`. [1/sr]"""
        return np.hypot(self.absolute, self.relative * np.abs(m00))


@dataclass(frozen=True, eq=False)
class Weights:
    """A rule for the standard errors of a fit.

    Parameters
    ----------
    text : str
        The rule in words.
    shape : callable
        Fitted M00 at each reading (m,) -> standard errors (m,), up to one factor a group
        where they are estimated.
    group : ndarray of int, shape (m,)
        Readings that share an estimated factor; -1 where the standard error is known.
    iterates : bool
        True if the standard errors depend on the fitted curve.
    """

    text: str
    shape: Callable[[np.ndarray], np.ndarray]
    group: np.ndarray
    iterates: bool

    @property
    def n_estimated(self) -> int:
        """How many factors are estimated."""
        return len(set(self.group[self.group >= 0].tolist()))


def weights_for(observations: Observations, noise: Noise | str | None) -> list[Weights]:
    """Return the rules to try; the likelihood decides where there are two.

    Parameters
    ----------
    observations : Observations
        The readings, with the standard errors of the file where it has them.
    noise : Noise, "relative", "absolute" or None
        A stated noise; the shape of an unknown one; or None: the file's columns, and where
        it has none, the shape of higher likelihood.

    Raises
    ------
    ValueError
        If `noise` is another word.
    """
    if isinstance(noise, Noise):
        text = f"stated: relative {noise.relative:g}, absolute {noise.absolute:g} 1/sr"
        nobody = np.full(len(observations.value), -1)
        shape = _instrument(observations, noise)
        return [Weights(text, shape, nobody, noise.relative > 0.0)]
    if noise not in (None, "relative", "absolute"):
        msg = f"noise must be a Noise, 'relative', 'absolute' or None, got {noise!r}."
        raise ValueError(msg)
    known = np.isfinite(observations.stderr)
    if noise is None and known.all():
        return [_of_file(observations)]
    group = _groups(observations, known if noise is None else np.zeros_like(known))
    both = {"relative": Noise(relative=1.0), "absolute": Noise(absolute=1.0)}
    rules = both if noise is None else {noise: both[noise]}
    found = []
    for word, unit in rules.items():
        text = f"estimated from the misfit, {word}"
        shape = _mixed(observations, _instrument(observations, unit), group >= 0)
        found.append(Weights(text, shape, group, word == "relative"))
    return found


def _instrument(
    observations: Observations, noise: Noise
) -> Callable[[np.ndarray], np.ndarray]:
    """Return the standard errors under an instrument noise; a ratio has it relative."""
    is_ratio = observations.is_ratio

    def shape(m00: np.ndarray) -> np.ndarray:
        stderr = noise.of(m00)
        return np.where(is_ratio, stderr / np.maximum(np.abs(m00), 1e-300), stderr)

    return shape


def _mixed(
    observations: Observations,
    unit: Callable[[np.ndarray], np.ndarray],
    estimated: np.ndarray,
) -> Callable[[np.ndarray], np.ndarray]:
    """Take the file's standard errors where they are, the unit noise elsewhere."""
    return lambda m00: np.where(estimated, unit(m00), observations.stderr)


def _groups(observations: Observations, known: np.ndarray) -> np.ndarray:
    """Return a number for each observable without standard errors; rare ones share one."""
    group = np.full(len(observations.value), -1)
    number = 0
    for name in observations.names:
        members = (observations.name == name) & ~known
        if members.sum() >= _ENOUGH:
            group[members] = number
            number += 1
        elif members.any():
            group[members] = 0
            number = max(number, 1)
    return group


def _of_file(observations: Observations) -> Weights:
    """Take the standard errors of the file, or the percentage of M00 that they are."""
    nobody = np.full(len(observations.value), -1)
    with np.errstate(divide="ignore"):
        ratio = observations.stderr / np.abs(observations.m00)
    part = np.full(len(ratio), np.nan)
    for name in observations.names:
        members = observations.name == name
        seen = ratio[members]
        # One number to the digits of a file: a percentage of the reading
        if (
            len(seen) >= _ENOUGH
            and np.isfinite(seen).all()
            and np.ptp(seen) < 2e-3 * seen[0]
        ):
            part[members] = seen.mean()
    relative = np.isfinite(part) & ~observations.is_ratio
    if not relative.any():
        return Weights("given", lambda _: observations.stderr, nobody, False)

    def shape(m00: np.ndarray) -> np.ndarray:
        return np.where(relative, part * np.abs(m00), observations.stderr)

    percent = 100.0 * float(np.nanmean(part[relative]))
    text = (
        f"given, {percent:.3g} % of M00: taken of the fitted M00, not of its noisy readings"
    )
    return Weights(text, shape, nobody, True)
