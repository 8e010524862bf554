"""The store of a sweep as a BRDF of angles, wavelength and whatever the sweep varied."""

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from pbrdf.conventions import RESULT_VARIABLES, STOKES
from pbrdf.errors import AccuracyWarning, require
from pbrdf.stored.contents import Contents
from pbrdf.stored.interpolation import Interpolation
from pbrdf.stored.left_out import CLASSES, error_of_albedo
from pbrdf.stored.scattered import ScatteredInterpolation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["StoredBRDF"]

# Directions at once
_AT_ONCE = 20_000


class StoredBRDF:
    """A Mueller BRDF interpolated in the store of a sweep; `pbrdf.from_store` opens it.

    `brdf`, `stderr` and `error` take the angles, the wavelength where the store has
    several, and what the sweep varied by its name without unit: angles in radians, lengths
    in um.
    All are broadcast; those of which the store has one value may be left out. The specular
    beam of a sweep with waves is none of it: it is `coherent`, at computed points only.

    Examples
    --------
    >>> from pbrdf import from_store
    >>> store = from_store("coatings.zarr")  # doctest: +SKIP
    >>> store.brdf(0.5, 0.5, np.pi, slope_rms=0.12, n=1.53)  # doctest: +SKIP
    """

    def __init__(self, contents: Contents) -> None:
        self._contents = contents
        self._theta_i = contents.dataset.theta_i.to_numpy()
        kind = Interpolation if contents.cloud is None else ScatteredInterpolation
        self._between = kind(contents)

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
        measured = list(self._between.measured.values())
        self._between.warn(self._between.measured)
        about = {"units": "1"}
        return xr.Dataset(
            {
                "left_out": (dims, np.array([one.at_nodes for one in measured]), about),
                "between": (dims, np.array([one.between for one in measured]), about),
            },
            {
                "axis": list(self._between.measured),
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
            If it lies between the two values of an axis: the error there is a guess.
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

    def coherent(
        self,
        theta_i: npt.ArrayLike,
        wavelength: float | None = None,
        **parameters: Any,
    ) -> np.ndarray:
        """Mueller reflectance of the specular beam that waves leave, zero of rays. [1]

        Shape (..., 4, 4), with the shape of `theta_i`; one value of all else.

        Raises
        ------
        ValueError
            If incidence, wavelength or a parameter lies between computed ones: the beam is
            not interpolated.
        """
        given = parameters
        if wavelength is not None and not self._is_the_one(wavelength):
            given = parameters | {"wavelength": wavelength}
        angles = self._angles(theta_i, 0.0, 0.0)[0]
        # Incidences that are rounded are those of the store, as of `brdf`
        near = self._theta_i[np.abs(self._theta_i - angles[..., None]).argmin(-1)]
        angles = np.where(np.abs(near - angles) < 1e-6, near, angles)
        found = self._contents.beam(angles.ravel(), self._contents.named(given))
        return found.reshape(*angles.shape, 4, 4)

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
            simulation independent. The attribute `interpolated_along` names the axes whose
            values were not computed; `most_lost` is the largest share of light that was
            lost at the points about it, `phi_i` the azimuth of the source. Of waves
            `coherent` too, at computed points.

        Warns
        -----
        AccuracyWarning
            If the specular beam of waves is left out, between computed points.
        """
        for parameter, one in parameters.items():
            if np.ndim(one):
                msg = f"{parameter} must be one value, got {one!r}. Call at() for each."
                raise ValueError(msg)
        data = self._contents.dataset
        incidences = np.atleast_1d(self._theta_i if theta_i is None else theta_i)
        known = self._contents.parameters.get("wavelength")
        waves = None if known is None else known.nodes if wavelength is None else wavelength
        if known is None and wavelength is not None and not self._is_the_one(wavelength):
            self._contents.named(parameters | {"wavelength": wavelength})
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
        total = error_of_albedo(noise[..., 0, 0], between[..., 0, 0], weight.to_numpy())
        about = {"units": "1", "long_name": RESULT_VARIABLES["albedo_stderr"].long_name}
        of = ("theta_i", "wavelength") if waves is not None else ("theta_i",)
        out["albedo_stderr"] = (of, total if waves is not None else total[:, 0], about)
        told = ", ".join(
            f"{name}={value:.6g}" if isinstance(value, float) else f"{name}={value}"
            for name, value in parameters.items()
        )
        out.attrs = {"store": self._contents.path.name, "interpolated_at": told}
        place = parameters if waves is None else parameters | {"wavelength": each}
        named = self._contents.named(place)
        along = self._contents.between(incidences, named)
        out.attrs["interpolated_along"] = ", ".join(along)
        out.attrs["stderr_excludes_interpolation"] = not interpolated
        # What a signature asks of a result beside its bins
        out.attrs["phi_i"] = self._contents.source_azimuth(named)
        out.attrs["most_lost"] = self._contents.most_lost(named)
        out.attrs["without_beam"] = "coherent" in data and bool(along)
        if "coherent" in data:
            self._add_beam(out, incidences, each, parameters, along)
        return out

    def _add_beam(
        self,
        out: xr.Dataset,
        incidences: np.ndarray,
        waves: list[Any],
        parameters: dict[str, Any],
        along: tuple[str, ...],
    ) -> None:
        """Add the specular beam at computed points; tell that it is left out elsewhere."""
        if along:
            msg = (
                "the specular beam of waves is left out: it is not interpolated, and "
                f"{', '.join(along)} lie between computed values. Take one of them."
            )
            warnings.warn(msg, AccuracyWarning, stacklevel=4)
            return
        beams = [self.coherent(incidences, wave, **parameters) for wave in waves]
        of = ("theta_i", "wavelength") if "wavelength" in out.dims else ("theta_i",)
        beam = np.stack(beams, axis=1) if len(of) == 2 else beams[0]
        entry = RESULT_VARIABLES["coherent"]
        about = {"units": entry.units, "long_name": entry.long_name}
        out["coherent"] = ((*of, "stokes_out", "stokes_in"), beam, about)

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
            point = self._between.point(dict(zip(named, place, strict=True)))
            for start in range(0, len(members), _AT_ONCE):
                rows = np.array(members[start : start + _AT_ONCE])
                value[rows], stderr[rows] = point.lobes.brdf(
                    theta_i[rows], theta_s[rows], dphi[rows]
                )
                if error:
                    between[rows] = point.between(
                        theta_i[rows], theta_s[rows], dphi[rows], value[rows, 0, 0]
                    )
        self._between.warn(self._contents.between(theta_i, named))
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
            "theta_i", theta_i, lambda v: (v >= low - 1e-6) & (v <= high + 1e-6),
            f"lie in the store's [{low:.7g}, {high:.7g}] rad",
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
