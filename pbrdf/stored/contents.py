"""What the store of a sweep holds: its axes in the words of Python, and its points."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

__all__ = ["Contents", "Parameter", "open_contents"]

_BOUND = "pbrdf_sweep"
_DONE = 1
_UNITS = {"_deg": ("rad", np.pi / 180), "_um": ("um", 1.0)}
_OWN = ("theta_i", "theta_s", "dphi", "stokes_out", "stokes_in")
# Numbers between which nothing lies
_APART = ("seed", "n_rays", "realizations", "max_bounces", "phi_i")


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
        low, high = float(self.nodes.min()), float(self.nodes.max())
        slack = 1e-9 * max(abs(low), abs(high))
        if not low - slack <= float(value) <= high + slack:
            msg = (
                f"{self.name} must lie in the store's {low:.6g} to {self.told(high)}, got "
                f"{float(value):.6g}. Compute it by a sweep that goes so far."
            )
            raise ValueError(msg)
        return min(max(float(value), low), high)

    def _same(self, one: Any, value: Any) -> bool:
        if self.nodes.dtype.kind != "f":
            return str(one) == str(value)
        return isinstance(value, int | float | np.number) and bool(
            np.isclose(one, float(value), rtol=1e-9, atol=1e-12)
        )


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
    """

    path: Path
    dataset: xr.Dataset
    parameters: dict[str, Parameter]

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
            if known is None:
                held = ", ".join(self.parameters) or "none but the angles"
                msg = f"the store must have the axis {name!r}, it has {held}."
                raise ValueError(msg)
            values[known.name] = (
                value if factor == 1.0 else factor * np.asarray(value, float)
            )
        for name, known in self.parameters.items():
            if name not in values and len(known.nodes) > 1:
                ends = f"{known.told(known.nodes[0])} to {known.told(known.nodes[-1])}"
                msg = f"{name} must be given, the store has it from {ends}."
                raise ValueError(msg)
            values.setdefault(name, known.nodes[0])
        return values

    def read(self, place: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Read the BRDF of all bounces and its error at indices along each parameter.

        Returns
        -------
        ndarray, ndarray, shape (one each parameter, theta_i, theta_s, dphi, 4, 4)

        Raises
        ------
        ValueError
            If one of these points is not finished.
        """
        here = self.dataset.isel({self.parameters[n].dim: k for n, k in place.items()})
        self._check_done(here)
        order = (*(self.parameters[name].dim for name in place), *_OWN)
        return (
            here.brdf_total.transpose(*order).to_numpy(),
            here.brdf_total_stderr.transpose(*order).to_numpy(),
        )

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
        If it is no store of a sweep over a grid with all Stokes elements.
    FileNotFoundError
        If there is none.
    """
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(2, "No such file or directory", str(path))
    dataset = _opened(path)
    if "theta_i" not in dataset.dims:
        dataset = dataset.expand_dims("theta_i")
    parameters = {}
    for dim in map(str, dataset.brdf_total.dims):
        if dim in _OWN:
            continue
        name, unit, factor = _in_words_of_python(dim)
        number = dataset[dim].dtype.kind == "f" and name not in _APART
        if number:
            dataset = dataset.sortby(dim)
        nodes = dataset[dim].to_numpy()
        nodes = nodes * factor if nodes.dtype.kind == "f" else nodes
        parameters[name] = Parameter(
            name=name, dim=dim, unit=unit, nodes=nodes, number=number
        )
    return Contents(path=path, dataset=dataset.sortby("theta_i"), parameters=parameters)


def _opened(path: Path) -> xr.Dataset:
    """Open a store that can be interpolated."""
    from pbrdf.sweeps.wanted import needed

    needed("zarr")
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
    if dataset.attrs["design"] != "grid":
        msg = (
            f"the store must be that of a grid, got kind = {dataset.attrs['design']!r}, "
            "whose points have nothing between them. Read those by xarray.open_zarr."
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
