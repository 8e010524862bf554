"""Where each point of a sweep has its place: variables, dimensions and chunks."""

import json
import warnings
from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from pbrdf.errors import AccuracyWarning
from pbrdf.simulation.run import simulate
from pbrdf.sweeps.description import Sweep

__all__ = ["DONE", "FAILED", "STATE", "Layout", "Variable", "read_point"]

# What a point of the variable `state` may hold
STATE = "state"
MISSING, DONE, FAILED = 0, 1, 2
# Numbers that `simulate` writes into attributes: name, units, words
_NUMBERS = {
    "rel_error": "largest stderr / M00 over the bins above a tenth of the peak",
    "rays_per_direction": "rays an incident direction, over all realisations",
    "realizations": "surfaces drawn",
    "ray_batches": "batches of rays over a fixed surface",
}
# A group of points is written at once: at most so many bytes, and work of so many seconds
_MOST_BYTES = 64e6
_MOST_SECONDS = 4.0
# What one trace serves is computed together up to this
_JOINT_BYTES = 200e6
# Rough times of a ray, of a node of a surface, and of a run whatever its size [s]
_RAY, _NODE, _RUN = 1e-6, 2e-7, 5e-3


@dataclass(frozen=True, kw_only=True)
class Variable:
    """A variable of the store: its own dimensions, without those of the sweep."""

    dims: tuple[str, ...]
    shape: tuple[int, ...]
    dtype: str
    attrs: dict[str, Any]

    @property
    def empty(self) -> Any:
        """What stands where nothing was computed."""
        return np.nan if np.dtype(self.dtype).kind == "f" else 0


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Variables and coordinates of the result, and groups of points.

    Attributes
    ----------
    sizes : dict of str to int
        Dimensions of the sweep.
    chunk : tuple of int
        Points of a group along each of them.
    variables : dict of str to Variable
    coords : dict of str to (dims, values, attrs)
        All that does not depend on the point.
    """

    sizes: dict[str, int]
    chunk: tuple[int, ...]
    variables: dict[str, Variable]
    coords: dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, Any]]]

    @classmethod
    def of(cls, sweep: Sweep) -> "Layout":
        """Lay a sweep out; a run with hardly any rays tells the shapes."""
        first = dict.fromkeys(sweep.design.shape, 0)
        scene, given = sweep.at(first)
        few: dict[str, Any] = {
            "n_rays": 32,
            "realizations": 1,
            "target_rel_error": None,
            "workers": 1,
        }
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AccuracyWarning)
            trial = simulate(scene, **given | few)
        trial = _own(trial, sweep)
        shared = {"projected_solid_angle"}
        variables = {
            str(name): Variable(
                dims=tuple(map(str, v.dims)), shape=v.shape, dtype=v.dtype.str,
                attrs=dict(v.attrs),
            )
            for name, v in trial.data_vars.items()
            if name not in shared
        }  # fmt: skip
        for name, words in _NUMBERS.items():
            about = {"units": "1", "long_name": words}
            variables[name] = Variable(dims=(), shape=(), dtype="<f8", attrs=about)
        meaning = {"flag_values": [0, 1, 2], "flag_meanings": "missing done failed"}
        variables[STATE] = Variable(dims=(), shape=(), dtype="|i1", attrs=meaning)
        coords = {
            str(name): (tuple(map(str, c.dims)), np.asarray(c.values), dict(c.attrs))
            for name, c in trial[[*trial.coords, *shared]].variables.items()
        }
        coords |= _axes(sweep)
        chunk = _chunk(sweep, _bytes(variables), seconds(scene, given))
        sizes = sweep.design.shape
        return cls(sizes=sizes, chunk=chunk, variables=variables, coords=coords)

    @cached_property
    def counts(self) -> tuple[int, ...]:
        """Groups along each dimension."""
        return tuple(
            -(-size // step)
            for size, step in zip(self.sizes.values(), self.chunk, strict=True)
        )

    @property
    def n_groups(self) -> int:
        """Number of groups."""
        return int(np.prod(self.counts))

    @property
    def n_points(self) -> int:
        """Number of points."""
        return int(np.prod(list(self.sizes.values())))

    @property
    def point_bytes(self) -> int:
        """Size of the results of a point."""
        return _bytes(self.variables)

    @property
    def group_bytes(self) -> int:
        """Memory that the results of a group take."""
        return self.point_bytes * int(np.prod(self.chunk))

    def region(self, group: int) -> tuple[slice, ...]:
        """Return the points of a group along each dimension."""
        place = np.unravel_index(group, self.counts)
        return tuple(
            slice(int(at) * step, min((int(at) + 1) * step, size))
            for at, step, size in zip(place, self.chunk, self.sizes.values(), strict=True)
        )

    def points(self, group: int) -> Iterator[tuple[tuple[int, ...], dict[str, int]]]:
        """Yield each point of a group: its place in the group, and in the sweep."""
        region = self.region(group)
        for at in product(*(range(s.stop - s.start) for s in region)):
            whole = [s.start + a for s, a in zip(region, at, strict=True)]
            yield at, dict(zip(self.sizes, whole, strict=True))

    def block(self, group: int) -> dict[str, np.ndarray]:
        """Return empty arrays for the results of a group."""
        return self.empty(tuple(s.stop - s.start for s in self.region(group)))

    def empty(self, lead: tuple[int, ...]) -> dict[str, np.ndarray]:
        """Return empty arrays for the results of so many points."""
        return {
            name: np.full(lead + v.shape, v.empty, v.dtype)
            for name, v in self.variables.items()
        }


def read_point(result: xr.Dataset, sweep: Sweep, layout: Layout) -> dict[str, np.ndarray]:
    """Return the numbers of a result that the store keeps, by variable.

    Raises
    ------
    ValueError
        If the result has other variables or shapes than the first point of the sweep.
    """
    own = _own(result, sweep)
    numbers: dict[str, Any] = {name: own.attrs[name] for name in _NUMBERS}
    numbers |= {str(name): v for name, v in own.data_vars.items()}
    numbers.pop("projected_solid_angle")
    out = {}
    for name, wanted in layout.variables.items():
        if name == STATE:
            continue
        value = np.asarray(numbers.pop(name, np.nan))
        if value.shape != wanted.shape:
            msg = (
                f"{name} must have the shape {wanted.shape} of the first point, got "
                f"{value.shape}. Make another sweep of scenes that are so unlike."
            )
            raise ValueError(msg)
        out[name] = value
    if numbers:
        msg = (
            f"results must have the variables of the first point, got {sorted(numbers)} "
            "besides. Make another sweep of scenes that are so unlike."
        )
        raise ValueError(msg)
    return out


def seconds(scene: Any, given: Mapping[str, Any]) -> float:
    """Guess roughly how long a run takes; the same on every machine. [s]"""
    nodes = int(np.prod(getattr(scene.surface, "shape", (1, 1))))
    lights = np.size(given["theta_i"]) * np.size(given.get("phi_i", 0.0))
    rays = given.get("n_rays", 1e6)
    return float(
        _RUN + given.get("realizations", 16) * (_NODE * nodes + _RAY * rays * lights)
    )


def _own(result: xr.Dataset, sweep: Sweep) -> xr.Dataset:
    """Return a result without the dimensions that vary from point to point."""
    varied = {axis.path for axis in sweep.design.axes}
    if ("simulate", "theta_i_deg") in varied:
        result = result.isel(theta_i=0, drop=True)
    scalars = [c for c, v in result.coords.items() if not v.dims]
    dropped = [c for c in scalars if ("simulate", f"{c}_um") in varied]
    return result.drop_vars(dropped)


def _axes(
    sweep: Sweep,
) -> dict[str, tuple[tuple[str, ...], np.ndarray, dict[Hashable, Any]]]:
    """Coordinates of what varies; what is neither number nor text is written as text."""
    found: Any = {}
    for axis in sweep.design.axes:
        values = sweep.design.coordinate(axis)
        numbers = all(
            isinstance(v, int | float) and not isinstance(v, bool) for v in values
        )
        held = (
            np.asarray(values, dtype=np.float64)
            if numbers
            else np.asarray([v if isinstance(v, str) else json.dumps(v) for v in values])
        )
        dim = axis.name if sweep.design.kind == "grid" else "point"
        path = ".".join(map(str, axis.path))
        about = {"long_name": path, "scale": "log" if axis.log else "linear"}
        found[axis.name] = ((dim,), held, about)
    return found


def _bytes(variables: Mapping[str, Variable]) -> int:
    return sum(
        np.dtype(v.dtype).itemsize * int(np.prod(v.shape)) for v in variables.values()
    )


def _chunk(sweep: Sweep, size: int, trace: float) -> tuple[int, ...]:
    """Points of a group along each dimension: the last ones whole, as far as they go.

    A point takes `size` bytes, and with all that share its trace so many seconds.
    """
    sizes = sweep.design.shape
    traces, points = _MOST_SECONDS / trace, 1
    if sweep.design.kind != "grid":
        (count,) = sizes.values()
        # As many points to a trace as in the mean
        traces *= count / len(sweep.alike({"point": k} for k in range(count)))
    joint = [axis.name for axis in sweep.joint]
    chunk = []
    for name, length in reversed(sizes.items()):
        room = (_JOINT_BYTES if name in joint else _MOST_BYTES) / size / points
        most = room if name in joint else min(room, traces)
        chunk.append(max(1, min(length, int(most))))
        points *= chunk[-1]
        if name not in joint:
            traces /= chunk[-1]
    return tuple(reversed(chunk))
