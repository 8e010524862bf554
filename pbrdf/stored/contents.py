"""What the store of a sweep holds: its axes in the words of Python, and its points."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from pbrdf.conventions import LOSSES
from pbrdf.files.stores import check_store
from pbrdf.stored.parameters import Cloud, Parameter

__all__ = ["Contents", "Parameter", "open_contents"]

_BOUND = "pbrdf_sweep"
_DONE = 1
_UNITS = {"_deg": ("rad", np.pi / 180), "_um": ("um", 1.0)}
_OWN = ("theta_i", "theta_s", "dphi", "stokes_out", "stokes_in")
# Points of a sample about a place whose losses count
NEAREST_LOST = 8
# Numbers between which nothing lies
_APART = ("seed", "n_rays", "realizations", "max_bounces", "phi_i")


@dataclass(frozen=True, kw_only=True)
class Contents:
    """An opened store.

    Attributes
    ----------
    path : Path
    dataset : xarray.Dataset
        Opened lazily, each axis rising.
    parameters : dict of str to Parameter
        By name.
    cloud : Cloud, optional
        Points of a list or a sample, for the parameters that it names.
    """

    path: Path
    dataset: xr.Dataset
    parameters: dict[str, Parameter]
    cloud: Cloud | None = None

    def named(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return values by name; names of the store with their unit are understood.

        Raises
        ------
        ValueError
            If the store has no such axis, or one of several values is not given.
        """
        values: dict[str, Any] = {}
        for name, value in given.items():
            known = self.parameters.get(name)
            factor = 1.0
            if known is None:
                known = next((p for p in self.parameters.values() if p.dim == name), None)
                factor = next(
                    (f for end, (_, f) in _UNITS.items() if name.endswith(end)), 1.0
                )
            alone = self.dataset.coords.get("wavelength")
            if known is None and name == "wavelength" and alone is not None:
                msg = (
                    f"wavelength must be {float(alone):.6g} um, the only one of the store, "
                    f"got {value}. Sweep others."
                )
                raise ValueError(msg)
            if known is None:
                held = ", ".join(self.parameters) or "none but the angles"
                msg = f"the store must have the axis {name!r}, it has {held}."
                raise ValueError(msg)
            values[known.name] = (
                value if factor == 1.0 else factor * np.asarray(value, float)
            )
        for name, known in self.parameters.items():
            if name not in values and len(known.nodes) > 1:
                ends = " to ".join(map(known.told, known.ends))
                msg = f"{name} must be given, the store has it from {ends}."
                raise ValueError(msg)
            values.setdefault(name, known.nodes[0])
        return values

    def between(self, theta_i: np.ndarray, values: Mapping[str, Any]) -> tuple[str, ...]:
        """Return the axes along which some value is none of those computed.

        Parameters
        ----------
        theta_i : ndarray
            Incidences. [rad]
        values : mapping
            As of `named`: each parameter, all of one shape or numbers.
        """
        nodes = {n: p.nodes for n, p in self.parameters.items() if p.number}
        nodes["theta_i"] = self.dataset.theta_i.to_numpy()
        apart: tuple[str, ...] = ()
        if self.cloud is not None:
            names = self.cloud.names
            nodes = {name: axis for name, axis in nodes.items() if name not in names}
            rows = np.stack(
                np.broadcast_arrays(*(np.asarray(values[n], float) for n in names)), -1
            ).reshape(-1, 1, len(names))
            near = np.isclose(rows, self.cloud.points, rtol=1e-9, atol=1e-12)
            apart = () if near.all(-1).any(-1).all() else names
        for name, axis in nodes.items():
            value = np.asarray(theta_i if name == "theta_i" else values[name], float)
            near = np.isclose(value.reshape(-1, 1), axis, rtol=1e-9, atol=1e-9)
            apart = apart if near.any(-1).all() else (*apart, name)
        return apart

    def read(
        self, place: Mapping[str, np.ndarray], incidences: list[int] | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Read the BRDF of all bounces and its error at indices along each parameter.

        `point` is that of a list or a sample; `incidences` picks some.

        Returns
        -------
        ndarray, ndarray, shape (one each parameter, theta_i, theta_s, dphi, 4, 4)

        Raises
        ------
        ValueError
            If one of these points is not finished.
        """
        dims = [self.parameters[n].dim if n in self.parameters else n for n in place]
        here = self.dataset.isel(dict(zip(dims, place.values(), strict=True)))
        here = here if incidences is None else here.isel(theta_i=incidences)
        self._check_done(here)
        order = (*dims, *_OWN)
        return (
            here.brdf_total.transpose(*order).to_numpy(),
            here.brdf_total_stderr.transpose(*order).to_numpy(),
        )

    def beam(self, theta_i: np.ndarray, values: Mapping[str, Any]) -> np.ndarray:
        """Mueller reflectance of the specular beam of waves at a computed point.

        Shape (incidences, 4, 4); zero without waves. [1]

        Raises
        ------
        ValueError
            If it lies between computed points, or at one that is not finished.
        """
        if "coherent" not in self.dataset:
            return np.zeros((len(theta_i), 4, 4))
        apart = self.between(theta_i, values)
        if apart:
            msg = (
                "the specular beam of waves must be asked for at computed points of the "
                f"store, it is not interpolated along {', '.join(apart)}. Take one of its "
                "values, or simulate this surface."
            )
            raise ValueError(msg)
        about: dict[str, Any] = {}
        names: tuple[str, ...] = ()
        if self.cloud is not None:
            names = self.cloud.names
            place = np.array([float(values[name]) for name in names])
            about["point"] = self.cloud.index[self.cloud.nearest(place, 1)[0]]
        for name, one in self.parameters.items():
            if name not in names:
                about[one.dim] = one.nearest(values[name])
        here = self.dataset.isel(about)
        self._check_done(here)
        held = self.dataset.theta_i.to_numpy()
        rows = np.abs(held - np.reshape(theta_i, (-1, 1))).argmin(1)
        order = ("theta_i", "stokes_out", "stokes_in")
        return here.coherent.isel(theta_i=rows).transpose(*order).to_numpy()

    def source_azimuth(self, values: Mapping[str, Any]) -> float | str:
        """Azimuth of the source [rad], or "uniform"."""
        if "phi_i" in values:
            return float(values["phi_i"])
        run = json.loads(self.dataset.attrs["sweep"])["simulate"]
        told = run.get("phi_i_deg", "uniform")
        return told if isinstance(told, str) else float(np.deg2rad(np.ravel(told)[0]))

    def most_lost(self, values: Mapping[str, Any]) -> float:
        """Largest share of light that was lost at the points about a place, as of `named`.

        Cut off, leaked or gone sideways; what is lost counts as emitted.
        """
        held = [name for name in LOSSES if name in self.dataset]
        about: dict[str, Any] = {}
        apart: tuple[str, ...] = ()
        if self.cloud is not None:
            apart = self.cloud.names
            place = np.array([float(values[name]) for name in apart])
            near = self.cloud.nearest(place, NEAREST_LOST)
            about["point"] = self.cloud.index[near]
        for name, one in self.parameters.items():
            if name not in apart:
                about[one.dim] = one.around(values[name])
        lost = [self.dataset[name].isel(about).to_numpy() for name in held]
        return float(np.sum(lost, axis=0).max())

    def finished(self, names: Iterable[str]) -> np.ndarray:
        """Whether points are finished, along these parameters; of a list any of them."""
        dims = [self.parameters[name].dim for name in names]
        done = self.dataset.state.load() == _DONE
        done = done.expand_dims([d for d in dims if d not in done.dims])
        whole = done.any([d for d in done.dims if d not in dims])
        sizes = tuple(self.dataset.sizes.get(d, 1) for d in dims)
        return np.broadcast_to(whole.transpose(*dims).to_numpy(), sizes)

    def _check_done(self, here: xr.Dataset) -> None:
        state = here.state.load()
        wrong = np.argwhere(state.to_numpy() != _DONE)
        if not wrong.size:
            return
        point = here.isel(dict(zip(state.dims, wrong[0], strict=True)))
        named = [f"{p.dim}={point[p.dim].item()}" for p in self.parameters.values()]
        what = "failed" if int(state[tuple(wrong[0])]) else "not computed yet"
        msg = (
            f"the store must be finished at {', '.join(named)}, which is {what}. Run the "
            "same sweep again."
        )
        raise ValueError(msg)


def open_contents(path: str | Path) -> Contents:
    """Open the store of a sweep; nothing but its coordinates is read.

    Raises
    ------
    ValueError
        If it is no store of a sweep with all Stokes elements, or its points are a list or
        a sample of anything but numbers.
    FileNotFoundError
        If there is none.
    """
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(2, "No such file or directory", str(path))
    dataset = _opened(path)
    if "theta_i" not in dataset.dims:
        dataset = dataset.expand_dims("theta_i")
    parameters: dict[str, Parameter] = {}
    cloud = None
    for dim in map(str, dataset.brdf_total.dims):
        if dim in _OWN:
            continue
        if dim == "point":
            scattered = [str(n) for n, v in dataset.variables.items() if "scale" in v.attrs]
            # A result of one wavelength each has no other name for them
            dataset = dataset.set_coords(scattered)
            held = [_parameter(dataset, name) for name in scattered]
            cloud = Cloud.of(dataset.state, held, [dataset[n].attrs for n in scattered])
            parameters |= {one.name: one for one in held}
            continue
        one = _parameter(dataset, dim)
        if one.number:
            dataset = dataset.sortby(dim)
            one = _parameter(dataset, dim)
        parameters[one.name] = one
    dataset = dataset.sortby("theta_i")
    return Contents(path=path, dataset=dataset, parameters=parameters, cloud=cloud)


def _parameter(dataset: xr.Dataset, dim: str) -> Parameter:
    name, unit, factor = _in_words_of_python(dim)
    nodes = dataset[dim].to_numpy()
    number = nodes.dtype.kind == "f"
    return Parameter(
        name=name, dim=dim, unit=unit, nodes=nodes * factor if number else nodes,
        number=number and name not in _APART,
    )  # fmt: skip


def _opened(path: Path) -> xr.Dataset:
    """Open a store that can be interpolated."""
    from pbrdf.sweeps.wanted import needed

    needed("zarr")
    if path.is_dir():
        check_store(path, sparse=True)
    try:
        dataset = xr.open_zarr(path, chunks=None)
        bound = _BOUND in dataset.attrs
    except (OSError, ValueError, KeyError):
        bound = False
    if not bound:
        msg = (
            f"path must be a store of pbrdf sweep, got {path}. Give its folder, NAME.zarr."
        )
        raise ValueError(msg)
    held = [dataset.sizes.get(name, 0) for name in ("stokes_out", "stokes_in")]
    if held != [4, 4]:
        msg = (
            f"the store must have 4 x 4 Stokes elements, got {held[0]} x {held[1]}. Sweep "
            'with stokes = "full".'
        )
        raise ValueError(msg)
    # One wavelength has no dimension, which makes it look like a result
    return dataset.set_coords([n for n in ("wavelength",) if n in dataset.data_vars])


def _in_words_of_python(dim: str) -> tuple[str, str, float]:
    """Return name, unit, and how large in it the unit of the store is."""
    for end, (unit, factor) in _UNITS.items():
        if dim.endswith(end):
            return dim.removesuffix(end), unit, factor
    return dim, {"wavelength": "um", "phi_i": "rad"}.get(dim, ""), 1.0
