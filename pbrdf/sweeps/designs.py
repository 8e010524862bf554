"""Designs of a sweep: which values are computed together with which."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pbrdf.sweeps.places import Path

__all__ = ["KINDS", "Axis", "Design", "require_once"]

KINDS = ("grid", "list", "latin-hypercube", "sobol")


def require_once(name: str, values: Sequence[Any]) -> None:
    """Refuse a value that stands twice in a list; 2 and 2.0 are one.

    Raises
    ------
    ValueError
        Naming the first such value.
    """
    counts = Counter(_compared(value) for value in values)
    for value in values:
        if counts[_compared(value)] > 1:
            msg = f"{name} must have each value once, got {value!r} again."
            raise ValueError(msg)


def _compared(value: Any) -> str:
    plain = isinstance(value, int) and not isinstance(value, bool)
    return repr(float(value) if plain and abs(value) < 2**53 else value)


@dataclass(frozen=True, kw_only=True)
class Axis:
    """One varied value: where it stands, and what it takes.

    Attributes
    ----------
    name : str
        Its dimension or coordinate in the store.
    path : tuple
        Its place in the scene file.
    values : tuple
        What it takes; empty for a range.
    low, high : float
        Ends of a range, for designs that sample it.
    log : bool
        Whether the range is even in the logarithm.
    """

    name: str
    path: Path
    values: tuple[Any, ...] = ()
    low: float = math.nan
    high: float = math.nan
    log: bool = False

    def at(self, shares: np.ndarray) -> list[Any]:
        """Return the values at places in [0, 1) of the range, or of the list."""
        if self.values:
            return [self.values[int(share * len(self.values))] for share in shares]
        if self.log:
            return list(self.low * (self.high / self.low) ** shares)
        return list(self.low + (self.high - self.low) * shares)


@dataclass(frozen=True, kw_only=True)
class Design:
    """Axes and the points at which they are computed.

    Attributes
    ----------
    kind : str
        One of `KINDS`. A grid has every value with every other, a list the first with the
        first and so on; the others sample ranges.
    axes : tuple of Axis
    points : int
        Number of points of a sampled design.
    seed : int
        Of a sampled design.
    """

    kind: str
    axes: tuple[Axis, ...]
    points: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        sampled = self.kind in ("latin-hypercube", "sobol")
        if self.kind not in KINDS:
            msg = f"[design]: kind must be one of {', '.join(KINDS)}, got {self.kind!r}."
            raise ValueError(msg)
        for axis in self.axes:
            if not sampled and not axis.values:
                msg = (
                    f"{axis.name} must be a list of values in a {self.kind}, got a range. "
                    "Ranges are for latin-hypercube and sobol: set kind in [design]."
                )
                raise ValueError(msg)
            if self.kind == "grid":
                require_once(axis.name, axis.values)
        lengths = {axis.name: len(axis.values) for axis in self.axes}
        if self.kind == "list" and len(set(lengths.values())) != 1:
            told = ", ".join(f"{name} {length}" for name, length in lengths.items())
            msg = f"values of a list must be as many for each name, got {told}."
            raise ValueError(msg)
        if not sampled and self.points:
            msg = (
                f"[design]: points belongs to latin-hypercube and sobol, a {self.kind} has "
                f"as many as its values, got {self.points!r}. Leave it out."
            )
            raise ValueError(msg)
        for name, least in (("points", 1 if sampled else 0), ("seed", 0)):
            value = getattr(self, name)
            if type(value) is not int or value < least:
                msg = (
                    f"[design]: {name} must be a whole number from {least} on for "
                    f"{self.kind}, got {value!r}."
                )
                raise ValueError(msg)
        if self.kind == "sobol" and self.points & (self.points - 1):
            near = 2 ** round(math.log2(self.points))
            msg = (
                "[design]: points must be a power of 2 for sobol, whose points are even "
                f"only then, got {self.points}. Take {near}."
            )
            raise ValueError(msg)

    @property
    def shape(self) -> dict[str, int]:
        """Dimensions of the points and their sizes; one dimension `point` but for a grid.

        Axes of the surface come first and those of the substrate last: points next to each
        other differ in their material alone, and share a trace.
        """
        if self.kind == "grid":
            return {axis.name: len(axis.values) for axis in self.ordered}
        return {"point": len(self._columns[self.axes[0].name])}

    @cached_property
    def ordered(self) -> tuple[Axis, ...]:
        """Axes, those of the surface first, of the substrate last."""
        places = {"surface": 0, "substrate": 2}
        return tuple(sorted(self.axes, key=lambda axis: places.get(str(axis.path[0]), 1)))

    @cached_property
    def _columns(self) -> dict[str, list[Any]]:
        """Values of each axis at each point of a design that is no grid."""
        if self.kind == "list":
            return {axis.name: list(axis.values) for axis in self.axes}
        from scipy.stats import qmc

        engine = qmc.LatinHypercube if self.kind == "latin-hypercube" else qmc.Sobol
        shares = engine(len(self.axes), rng=self.seed).random(self.points)
        return {axis.name: axis.at(shares[:, k]) for k, axis in enumerate(self.axes)}

    def coordinate(self, axis: Axis) -> list[Any]:
        """Values along the dimension of the axis, or at each point."""
        return list(axis.values) if self.kind == "grid" else self._columns[axis.name]

    def values(self, place: Mapping[str, int]) -> dict[Path, Any]:
        """Return what each varied value is at a point of `shape`."""
        if self.kind == "grid":
            return {axis.path: axis.values[place[axis.name]] for axis in self.axes}
        return {axis.path: self._columns[axis.name][place["point"]] for axis in self.axes}
