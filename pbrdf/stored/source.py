"""The store of a sweep as a BRDF of angles, wavelength and whatever the sweep varied."""

import warnings
from collections import OrderedDict
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from pbrdf.conventions import RESULT_VARIABLES, STOKES
from pbrdf.errors import AccuracyWarning, require
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

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["StoredBRDF"]

# Points of the parameters that stay in memory, and directions at once
_KEPT, _AT_ONCE = 8, 20_000
# Beyond this miss of a value left out, in parts of M00, errors do not scale to gaps
COARSE = 0.5


class StoredBRDF:
    """A Mueller BRDF interpolated in the store of a sweep; `pbrdf.from_store` opens it.

    `brdf`, `stderr` and `error` take the angles, the wavelength where the store has
    several, and what the sweep varied by its name without unit: angles in radians, lengths
    in um.
    All are broadcast; those of which the store has one value may be left out.

    Examples
    --------
    >>> from pbrdf import from_store
    >>> store = from_store("coatings.zarr")  # doctest: +SKIP
    >>> store.brdf(0.5, 0.5, np.pi, slope_rms=0.12, n=1.53)  # doctest: +SKIP
    """

    def __init__(self, contents: Contents) -> None:
        self._contents = contents
        self._theta_i = contents.dataset.theta_i.to_numpy()
        self._points: OrderedDict[tuple[Any, ...], Point] = OrderedDict()

    @property
    def ranges(self) -> dict[str, tuple[Any, ...]]:
        """What theta_i and each parameter may be: (low, high), or the values computed."""
        found = {"theta_i": (float(self._theta_i[0]), float(self._theta_i[-1]))}
        return found | {
            name: one.ends if one.number else tuple(one.nodes.tolist())
            for name, one in self._contents.parameters.items()
        }

    @property
    def interpolation_error(self) -> xr.Dataset:
        """What the interpolation errs by along each axis, at the middle of all others.

        Returns
        -------
        Dataset
            Dimensions axis, brightness (of M00 in parts of its peak), stokes_out and
            stokes_in. `left_out`: what 90 % of the directions of a node are missed by if
            it is left out, of the worst node; `between`: the same in the middle of the
            worst gap. In parts of M00, of 1 % of the peak where it is darker. `scheme`
            (axis): what is interpolated, and how.
        """
        dims = ("axis", "brightness", "stokes_out", "stokes_in")
        measured = list(self._measured.values())
        about = {"units": "1"}
        return xr.Dataset(
            {
                "left_out": (dims, np.array([one.at_nodes for one in measured]), about),
                "between": (dims, np.array([one.between for one in measured]), about),
            },
            {
                "axis": list(self._measured),
                "scheme": ("axis", [one.scheme.name for one in measured]),
                "brightness": list(CLASSES), "stokes_out": list(STOKES),
                "stokes_in": list(STOKES),
            },
        )  # fmt: skip

    def brdf(
        self,
        theta_i: npt.ArrayLike,
        theta_s: npt.ArrayLike,
        dphi: npt.ArrayLike,
        wavelength: npt.ArrayLike | None = None,
        **parameters: Any,
    ) -> np.ndarray:
        """Mueller BRDF, shape (..., 4, 4). [1/sr]

        Raises
        ------
        ValueError
            If an argument lies outside of the store, or its point is not finished.

        Warns
        -----
        AccuracyWarning
            If an axis has two values only, so that the error between them is a guess.
        """
        at = (theta_i, theta_s, dphi)
        return self._evaluated(at, wavelength, parameters, error=False)[0]

    def stderr(
        self,
        theta_i: npt.ArrayLike,
        theta_s: npt.ArrayLike,
        dphi: npt.ArrayLike,
        wavelength: npt.ArrayLike | None = None,
        **parameters: Any,
    ) -> np.ndarray:
        """Monte Carlo standard error of `brdf`, shape (..., 4, 4). [1/sr]

        Points of a sweep share surfaces and err together, so that their errors add.
        """
        at = (theta_i, theta_s, dphi)
        return self._evaluated(at, wavelength, parameters, error=False)[1]

    def error(
        self,
        theta_i: npt.ArrayLike,
        theta_s: npt.ArrayLike,
        dphi: npt.ArrayLike,
        wavelength: npt.ArrayLike | None = None,
        **parameters: Any,
    ) -> np.ndarray:
        """Bound of the difference of `brdf` from the truth, in about 9 of 10 directions.

        Two standard errors of the simulation and, in square, the error of interpolation
        there: along every axis that of left-out nodes, scaled to the gap, for directions as
        bright; between bins, and of their means. Shape (..., 4, 4). [1/sr]
        """
        at = (theta_i, theta_s, dphi)
        _, stderr, between = self._evaluated(at, wavelength, parameters, error=True)
        return np.hypot(2.0 * stderr, between)

    def at(
        self,
        theta_i: npt.ArrayLike | None = None,
        wavelength: npt.ArrayLike | None = None,
        *,
        interpolated: bool = True,
        **parameters: Any,
    ) -> xr.Dataset:
        """Return one surface of the store as a result, also for `pbrdf.signature`.

        Parameters
        ----------
        theta_i : array_like, optional
            Incidences; those of the store without it. [rad]
        wavelength : array_like, optional
            Those of the store without it. [um]
        interpolated : bool
            Whether standard errors hold the error of interpolation, as it is measured by
            leaving out points, beside that of the simulation. Measuring it reads more of
            the store.
        **parameters : number or str
            As of `brdf`, one value each.

        Returns
        -------
        Dataset
            brdf_total, its standard error, and albedo_stderr: that of the sum over the
            hemisphere if errors of interpolation are alike everywhere and those of the
            simulation independent.
        """
        data = self._contents.dataset
        incidences = np.atleast_1d(self._theta_i if theta_i is None else theta_i)
        known = self._contents.parameters.get("wavelength")
        waves = None if known is None else known.nodes if wavelength is None else wavelength
        grid = np.meshgrid(incidences, data.theta_s, data.dphi, indexing="ij")
        each = [None] if waves is None else np.atleast_1d(waves).tolist()
        found = [
            self._evaluated(tuple(grid), one, parameters, error=interpolated)
            for one in each
        ]
        dims = list(RESULT_VARIABLES["brdf_total"].dims)
        dims = [
            d for d in dims if d != "phi_i" and (d != "wavelength" or waves is not None)
        ]
        value, noise, between = (np.stack(one, axis=1) for one in zip(*found, strict=True))
        pair = [value, np.hypot(noise, between)]
        pair = pair if waves is not None else [one[:, 0] for one in pair]
        names = ("brdf_total", "brdf_total_stderr")
        coords: dict[str, Any] = {"theta_i": incidences, "theta_s": data.theta_s.values}
        coords |= {"dphi": data.dphi.values, "stokes_out": list(STOKES)}
        coords |= {"stokes_in": list(STOKES)}
        if waves is not None:
            coords["wavelength"] = each
        elif "wavelength" in data.coords:
            coords["wavelength"] = float(data.wavelength)
        out = xr.Dataset(
            {name: (dims, one) for name, one in zip(names, pair, strict=True)}, coords
        )
        for name, variable in out.variables.items():
            entry = RESULT_VARIABLES[str(name)]
            variable.attrs = {"units": entry.units, "long_name": entry.long_name}
        weight = data.projected_solid_angle.load()
        out["projected_solid_angle"] = (weight.dims, weight.to_numpy(), dict(weight.attrs))
        total = _of_albedo(noise[..., 0, 0], between[..., 0, 0], weight.to_numpy())
        about = {"units": "1", "long_name": RESULT_VARIABLES["albedo_stderr"].long_name}
        of = ("theta_i", "wavelength") if waves is not None else ("theta_i",)
        out["albedo_stderr"] = (of, total if waves is not None else total[:, 0], about)
        told = ", ".join(f"{name}={value}" for name, value in parameters.items())
        out.attrs = {"store": self._contents.path.name, "interpolated_at": told}
        return out

    def plot(
        self,
        theta_i: float,
        wavelength: float | None = None,
        *,
        elements: tuple[str, ...] = ("M00", "M10", "DOLP"),
        **parameters: Any,
    ) -> "Figure":
        """Draw elements over the hemisphere at one incidence [rad] and point."""
        from pbrdf.plots import hemisphere

        here = self.at(theta_i, wavelength, interpolated=False, **parameters)
        places = {"theta_i": theta_i}
        places |= {} if wavelength is None else {"wavelength": wavelength}
        return hemisphere(here, elements, fold=False, places=places)

    def _evaluated(
        self,
        at: tuple[Any, ...],
        wavelength: Any,
        parameters: dict[str, Any],
        *,
        error: bool,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Value, standard error, and if asked for the error of interpolation."""
        given = parameters
        if wavelength is not None and not self._is_the_one(wavelength):
            given = parameters | {"wavelength": wavelength}
        named = self._contents.named(given)
        angles = self._angles(*at)
        shape = np.broadcast_shapes(
            *(one.shape for one in angles), *(np.shape(v) for v in named.values())
        )
        theta_i, theta_s, dphi = (np.broadcast_to(a, shape).ravel() for a in angles)
        columns = [np.broadcast_to(np.asarray(v), shape).ravel() for v in named.values()]
        groups: dict[tuple[Any, ...], list[int]] = {}
        for k in range(theta_i.size):
            groups.setdefault(tuple(column[k] for column in columns), []).append(k)
        value, stderr, between = (np.zeros((theta_i.size, 4, 4)) for _ in range(3))
        for place, members in groups.items():
            point = self._point(dict(zip(named, place, strict=True)))
            for start in range(0, len(members), _AT_ONCE):
                rows = np.array(members[start : start + _AT_ONCE])
                value[rows], stderr[rows] = point.lobes.brdf(
                    theta_i[rows], theta_s[rows], dphi[rows]
                )
                if error:
                    between[rows] = point.between(
                        theta_i[rows], theta_s[rows], dphi[rows], value[rows, 0, 0]
                    )
        whole = (*shape, 4, 4)
        return value.reshape(whole), stderr.reshape(whole), between.reshape(whole)

    def _is_the_one(self, wavelength: Any) -> bool:
        """Whether this is the only wavelength of the store."""
        held = self._contents.dataset.coords.get("wavelength")
        return (
            held is not None
            and not held.dims
            and bool(np.isclose(np.asarray(wavelength, float), float(held)).all())
        )

    def _angles(self, theta_i: Any, theta_s: Any, dphi: Any) -> list[np.ndarray]:
        low, high = self._theta_i[0], self._theta_i[-1]
        incidence = require(
            "theta_i", theta_i, lambda v: (v >= low - 1e-9) & (v <= high + 1e-9),
            f"lie in the store's [{low:.4g}, {high:.4g}] rad",
            "Angles are radians; compute others by a sweep that goes so far.",
        )  # fmt: skip
        cure = "Angles are radians; use np.deg2rad."
        return [
            np.clip(incidence, low, high),
            require(
                "theta_s", theta_s, lambda v: (v >= 0) & (v <= np.pi / 2),
                "lie in [0, 1.571] rad", cure,
            ),
            require(
                "dphi", dphi, lambda v: np.abs(v) <= 4 * np.pi,
                "lie in [-12.57, 12.57] rad", cure,
            ),
        ]  # fmt: skip

    def _point(self, place: dict[str, Any]) -> Point:
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
            nodes = parameter.nodes
            if not parameter.number or np.isclose(nodes, place[name], rtol=1e-9).any():
                continue
            value, stderr = self._reduced(place, keep=name)
            if len(nodes) == 2:
                share = (place[name] - nodes[0]) / (nodes[1] - nodes[0])
                total = np.hypot(total, midway(value[0], value[1], share))
            else:
                scheme = self._scheme(name)
                found = missed(parameter_trial(scheme, nodes, value, stderr))
                total = np.hypot(total, along(scheme, nodes, place[name], found))
        return total

    @property
    def _axes(self) -> dict[str, Parameter]:
        """Parameters that are dimensions of the store."""
        return self._contents.parameters

    def _middle(self) -> dict[str, np.ndarray]:
        """Return the middle of all axes."""
        return {n: np.array([(len(p.nodes) - 1) // 2]) for n, p in self._axes.items()}

    def _stencil(
        self, place: dict[str, Any], keep: str | None
    ) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        """Return indices and weights of the points about a place, along each axis."""
        stencil: dict[str, np.ndarray] = {}
        weights: dict[str, np.ndarray] = {}
        for name, parameter in self._axes.items():
            if name == keep:
                stencil[name] = np.arange(len(parameter.nodes))
            elif parameter.number and len(parameter.nodes) > 1:
                index, weight = self._scheme(name).weights(parameter.nodes, place[name])
                # Points that count for nothing need not be finished
                stencil[name], weights[name] = index[weight != 0], weight[weight != 0]
            else:
                stencil[name] = np.flatnonzero(parameter.nodes == place[name])[:1]
                weights[name] = np.ones(1)
        return stencil, weights

    def _reduced(
        self, place: dict[str, Any], keep: str | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Hemispheres of all incidences at a place; along one parameter all its nodes."""
        stencil, weights = self._stencil(place, keep)
        value, stderr = self._contents.read(stencil)
        for axis, name in reversed(list(enumerate(stencil))):
            if name == keep:
                continue
            # Stokes axes are last, the axis that goes before them
            value, stderr = combined(
                weights[name], np.moveaxis(value, axis, -3), np.moveaxis(stderr, axis, -3),
                log=len(weights[name]) > 1 and self._scheme(name).log,
            )  # fmt: skip
        return value, stderr

    def _scheme(self, name: str) -> Scheme:
        return self._measured[name].scheme if name in self._measured else SCHEMES["linear"]

    @cached_property
    def _measured(self) -> dict[str, Measured]:
        """Choose how to interpolate along each axis, at the middle of all others."""
        middle = self._middle()
        found: dict[str, Measured] = {}
        for name, one in self._axes.items():
            if one.number and len(one.nodes) > 1:
                line = middle | {name: np.arange(len(one.nodes))}
                value, stderr = (
                    array.reshape(len(one.nodes), *array.shape[len(middle) :])
                    for array in self._contents.read(line)
                )
                found[name] = _measure(name, one.nodes, value, stderr)
                _warn_if_coarse(name, found[name])
        value, stderr = (
            array.reshape(array.shape[len(middle) :])
            for array in self._contents.read(middle)
        )
        nodes = self._theta_i
        if len(nodes) == 2:
            found["theta_i"] = _of_two("theta_i", value)
        elif len(nodes) > 2:
            found["theta_i"] = best(
                nodes, lambda scheme: incidence_trial(self._lobes(value, stderr, scheme))
            )
            _warn_if_coarse("theta_i", found["theta_i"])
        return found


def _of_albedo(noise: np.ndarray, between: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Error of the sum over the hemisphere (..., theta_s, dphi) of errors of M00."""
    independent = np.sum((noise * weight) ** 2, axis=(-2, -1))
    alike = np.sum(between * weight, axis=(-2, -1))
    found: np.ndarray = np.sqrt(independent + alike**2)
    return found


def _measure(
    name: str, nodes: np.ndarray, value: np.ndarray, stderr: np.ndarray
) -> Measured:
    if len(nodes) == 2:
        return _of_two(name, value)
    return best(nodes, lambda scheme: parameter_trial(scheme, nodes, value, stderr))


def _warn_if_coarse(name: str, measured: Measured) -> None:
    """Say where values lie so far apart that left-out ones tell nothing of the gaps."""
    worst = float(measured.at_nodes[0, 0, 0])
    if worst > COARSE:
        msg = (
            f"the store's values of {name} must lie closer: one of them left out is missed "
            f"by {100 * worst:.2g} % of M00 where it is bright, which says little of the "
            "gaps. Errors between them are guesses. Compute more values by a sweep."
        )
        warnings.warn(msg, AccuracyWarning, stacklevel=2)


def _of_two(name: str, value: np.ndarray) -> Measured:
    """Return what is known between two nodes, and say that it is not much."""
    between = midway(value[0], value[1], 0.5)
    worst = 100 * between[:2, 0, 0].max()
    msg = (
        f"the store has two values of {name}, none to leave out: half their difference, up "
        f"to {worst:.2g} % of M00 where it is bright, stands for the error between them. "
        "Compute a third by a sweep."
    )
    warnings.warn(msg, AccuracyWarning, stacklevel=2)
    return Measured(SCHEMES["linear in ln M00"], np.full_like(between, np.nan), between)
