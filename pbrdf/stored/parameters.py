"""What a store may be asked for: one parameter, and a cloud of points over several."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

__all__ = ["Cloud", "Parameter"]

_DONE = 1
# Points about a place that count
NEAREST = 40


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """An axis of the store beside the angles.

    Attributes
    ----------
    name : str
        As an argument of Python: without the unit of the file.
    dim : str
        As a dimension of the store.
    unit : str
    nodes : ndarray
        In that unit, as they stand in the store.
    number : bool
        Whether there is anything between its values.
    """

    name: str
    dim: str
    unit: str
    nodes: np.ndarray
    number: bool

    @property
    def ends(self) -> tuple[Any, Any]:
        """The least and the largest value, or the first and the last text."""
        if self.nodes.dtype.kind == "f":
            return float(self.nodes.min()), float(self.nodes.max())
        return self.nodes[0], self.nodes[-1]

    def told(self, value: Any) -> str:
        """Write a value with its unit."""
        text = f"{value:.6g}" if self.nodes.dtype.kind == "f" else str(value)
        return f"{text} {self.unit}" if self.unit else text

    def check(self, value: Any) -> Any:
        """Return a value that the store can answer for.

        Raises
        ------
        ValueError
            If it is outside of the range, or none of those computed where none lie between.
        """
        if not self.number:
            same = [one for one in self.nodes if self._same(one, value)]
            if same:
                return same[0]
            msg = (
                f"{self.name} must be one of {', '.join(map(self.told, self.nodes))}, "
                f"which were computed, got {value!r}."
            )
            raise ValueError(msg)
        if not isinstance(value, int | float | np.number):
            msg = f"{self.name} must be a number, got {str(value)!r}."
            raise ValueError(msg)
        low, high = self.ends
        slack = 1e-9 * max(abs(low), abs(high))
        if not low - slack <= float(value) <= high + slack:
            msg = (
                f"{self.name} must lie in the store's {low:.6g} to {self.told(high)}, got "
                f"{float(value):.6g}. Compute it by a sweep that goes so far."
            )
            raise ValueError(msg)
        return min(max(float(value), low), high)

    def around(self, values: Any) -> list[int]:
        """Return the numbers of the nodes about values that `check` lets pass."""
        if not self.number:
            each = np.ravel(values)
            return [
                k
                for k, one in enumerate(self.nodes)
                if any(self._same(one, v) for v in each)
            ]
        each = np.array([self.check(value) for value in np.ravel(values)])
        first = max(int(np.searchsorted(self.nodes, each.min(), "right")) - 1, 0)
        last = int(np.searchsorted(self.nodes, each.max(), "left"))
        return list(range(first, last + 1))

    def nearest(self, value: Any) -> int:
        """Return the number of the node at a value that `check` lets pass."""
        if not self.number:
            return self.around(value)[0]
        return int(np.abs(self.nodes - float(self.check(value))).argmin())

    def _same(self, one: Any, value: Any) -> bool:
        if self.nodes.dtype.kind != "f":
            return str(one) == str(value)
        return isinstance(value, int | float | np.number) and bool(
            np.isclose(one, float(value), rtol=1e-9, atol=1e-12)
        )


@dataclass(frozen=True, kw_only=True)
class Cloud:
    """Points of a list or a sample, for radial basis functions.

    Attributes
    ----------
    names : tuple of str
        Parameters that vary from point to point.
    points : ndarray, shape (points, names)
        Those that are finished, in the units of Python.
    index : ndarray of int, shape (points,)
        Where they stand in the store.
    logarithm : ndarray of bool, shape (names,)
        Which parameters count by their logarithm.
    kernel : str
        Of `scipy.interpolate.RBFInterpolator`: one that needs no width.
    """

    names: tuple[str, ...]
    points: np.ndarray
    index: np.ndarray
    logarithm: np.ndarray
    kernel: str = "thin_plate_spline"

    @classmethod
    def of(
        cls,
        state: xr.DataArray,
        parameters: Sequence[Parameter],
        about: Sequence[Mapping[Hashable, Any]],
    ) -> "Cloud":
        """Take the finished points of a store.

        Raises
        ------
        ValueError
            If what varies is no number, stands alone, or points are too few.
        """
        for one in parameters:
            if one.name == "theta_i" or not one.number:
                cure = (
                    "Give a list of incidences in [simulate] instead."
                    if one.name == "theta_i"
                    else "Read such a store by xarray.open_zarr, or sweep a grid."
                )
                msg = (
                    "the points of a list or a sample must vary numbers with something "
                    f"between them, got {one.dim}. {cure}"
                )
                raise ValueError(msg)
        dims = [d for d in state.dims if d != "point"]
        done = (state == _DONE).all(dims) if dims else state == _DONE
        index = np.flatnonzero(done.to_numpy())
        # Constant terms, slopes, and some to leave out
        least = 2 * (len(parameters) + 1)
        if len(index) < least:
            msg = (
                f"the store must have {least} finished points or more to be interpolated "
                f"over {len(parameters)} parameters, got {len(index)}. Run the sweep to "
                "its end, or with more points."
            )
            raise ValueError(msg)
        points = np.stack([one.nodes[index] for one in parameters], axis=-1)
        told = np.array([a["scale"] == "log" for a in about])
        cloud = cls(
            names=tuple(one.name for one in parameters), points=points, index=index,
            logarithm=told & (points > 0.0).all(0),
        )  # fmt: skip
        cloud.check()
        return cloud

    def check(self) -> None:
        """Refuse points that lie in a plane.

        Raises
        ------
        ValueError
            With the parameters that vary together.
        """
        unit = self._unit(self.points)
        spread = np.linalg.svd(unit - unit.mean(0), compute_uv=False)
        if len(spread) < len(self.names) or spread[-1] < 1e-6 * max(spread[0], 1e-300):
            msg = (
                "the points of the store must not lie in a plane, as those over "
                f"{', '.join(self.names)} do: nothing tells how each of them acts alone. "
                "Sweep a sample or a grid."
            )
            raise ValueError(msg)

    def choices(self) -> "list[Cloud]":
        """Return this cloud by every kernel, with logarithms of all that may have one."""
        positive = np.asarray((self.points > 0.0).all(0))
        scales = {tuple(one.tolist()) for one in (self.logarithm, positive)}
        return [
            replace(self, logarithm=np.array(scale), kernel=kernel)
            for scale in sorted(scales)
            for kernel in ("thin_plate_spline", "cubic")
        ]

    def nearest(self, place: np.ndarray, count: int) -> np.ndarray:
        """Return the numbers of the points that are nearest to a place, nearest first."""
        apart = self._unit(self.points) - self._unit(place)
        return np.argsort((apart**2).sum(-1), kind="stable")[:count]

    def weights(
        self, place: np.ndarray, without: int | None = None
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """Return the numbers of the points that count at a place, their weights, and reach.

        `reach` is the power function of the kernel (Wendland, Scattered Data Approximation,
        2005, chapter 11): errors go with it, 0 at points and growing away from them.
        `without` leaves a point out.
        """
        from scipy.interpolate import RBFInterpolator

        near = self.nearest(place, NEAREST + 1)
        near = near[near != without][:NEAREST]
        here, unit = self._unit(place), self._unit(self.points[near])
        # What it makes of ones at single points are the weights
        weight = RBFInterpolator(
            unit, np.eye(len(near)), kernel=self.kernel, degree=1
        )(here[None])[0]  # fmt: skip
        to = self._radial(np.linalg.norm(unit - here, axis=-1))
        among = self._radial(np.linalg.norm(unit[:, None] - unit, axis=-1))
        square = weight @ among @ weight - 2.0 * weight @ to
        return near, weight, float(np.sqrt(max(abs(square), 0.0)))

    def _radial(self, r: np.ndarray) -> np.ndarray:
        if self.kernel == "cubic":
            return np.asarray(r**3)
        return np.asarray(r**2 * np.log(np.where(r > 0.0, r, 1.0)))

    def _unit(self, points: np.ndarray) -> np.ndarray:
        """Return points in parts of the range of each parameter."""
        held, here = (
            np.where(self.logarithm, np.log(np.where(one > 0.0, one, 1.0)), one)
            for one in (self.points, points)
        )
        low, high = held.min(0), held.max(0)
        return np.asarray((here - low) / np.where(high > low, high - low, 1.0))
