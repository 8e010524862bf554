"""Places of a result: those that were computed, and those between them."""

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from pbrdf.errors import AccuracyWarning

__all__ = ["choose", "interpolate"]

_ANGLES = ("theta_i", "phi_i", "theta_s", "dphi", "contact_angle")
# Of the peak: more than this changes between neighbours, and a line between them is wrong
_CHANGE = 0.1


def in_words(name: str, value: Any, digits: int = 6) -> str:
    """Write a coordinate as people read it: angles in degrees, wavelengths in um."""
    if isinstance(value, str | np.str_):
        return str(value)
    if name in _ANGLES:
        return f"{np.rad2deg(float(value)):.{digits}g} deg"
    return f"{float(value):.{digits}g}{' um' if name == 'wavelength' else ''}"


def choose(result: xr.Dataset, places: Mapping[str, Any]) -> xr.Dataset:
    """Cut a result at places that were computed.

    Parameters
    ----------
    result : Dataset
        Of a simulation.
    places : mapping of str to value
        Coordinate and value; angles in radians, wavelengths in um.

    Raises
    ------
    ValueError
        If a place is not in the result; the message lists what is.
    """
    for name, value in places.items():
        if name not in result.coords:
            held = ", ".join(map(str, result.dims))
            msg = f"{name} is no dimension of the result, which has {held}. Leave it out."
            raise ValueError(msg)
        known = np.atleast_1d(result[name].values)
        if known.dtype.kind in "US":
            here = np.flatnonzero(known == str(value))
        elif isinstance(value, str):
            here = np.empty(0, int)
        else:
            here = np.flatnonzero(np.isclose(known, value, rtol=1e-6, atol=1e-9))
        if not here.size:
            listed = ", ".join(in_words(name, one) for one in known)
            msg = (
                f"{name} must be one of {listed}, which were computed, got "
                f"{in_words(name, value)}."
            )
            raise ValueError(msg)
        if result[name].dims:
            # A coordinate along another dimension, as contact_angle along state, cuts that
            result = result.isel({result[name].dims[0]: int(here[0])})
    return result


def interpolate(result: xr.Dataset, places: Mapping[str, float]) -> xr.Dataset:
    """Interpolate a result linearly at places between those computed.

    The attribute `interpolation` says what was done. Standard errors are interpolated like
    values, which bounds them from above.

    Raises
    ------
    ValueError
        If a place lies outside of what was computed.

    Warns
    -----
    AccuracyWarning
        Where the BRDF changes by more than a tenth of its peak between both neighbours: a
        lobe that moves is not the mean of two lobes.
    """
    done = []
    for name, value in places.items():
        if name not in result.coords or result[name].dtype.kind in "USO":
            held = ", ".join(map(str, result.dims))
            msg = f"{name} is no numbered dimension of the result, which has {held}."
            raise ValueError(msg)
        known = np.atleast_1d(result[name].values).astype(float)
        near = np.flatnonzero(np.isclose(known, value, rtol=1e-9, atol=1e-12))
        if near.size:
            result = result.isel({name: int(near[0])}) if name in result.dims else result
            done.append(f"{name}: as computed at {in_words(name, value)}")
            continue
        low, high = known.min(), known.max()
        if name == "dphi" and name in result.dims:
            # The circle is closed
            first = result.isel(dphi=[0]).assign_coords(dphi=[known[0] + 2 * np.pi])
            result = xr.concat([result, first], "dphi", data_vars="minimal")
            value, high = value % (2 * np.pi), low + 2 * np.pi
            known = np.append(known, high)
        if not low < value < high:
            msg = (
                f"{name} must lie in what was computed, {in_words(name, low)} to "
                f"{in_words(name, high)}, got {in_words(name, value)}. Simulate it."
            )
            raise ValueError(msg)
        rank = np.argsort(known)
        upper = int(np.searchsorted(known[rank], value))
        ends = [int(rank[upper - 1]), int(rank[upper])]
        pair = result.isel({name: ends})
        if name not in ("theta_s", "dphi"):
            _warn_of_change(pair, name)
        share = (value - known[ends[0]]) / (known[ends[1]] - known[ends[0]])
        moving = [v for v in result.data_vars if name in result[v].dims]
        first, last = pair.isel({name: 0}), pair.isel({name: 1})
        mixed = {v: (1 - share) * first[v] + share * last[v] for v in moving}
        mixed = {v: mixed[v].assign_attrs(result[v].attrs) for v in moving}
        result = first.assign_coords({name: value}).assign(
            {v: mixed[v].assign_coords({name: value}) for v in moving}
        )
        done.append(
            f"{name}: linear between {in_words(name, known[ends[0]])} and "
            f"{in_words(name, known[ends[1]])}"
        )
    return result.assign_attrs(interpolation="; ".join(done) or "none")


def _warn_of_change(pair: xr.Dataset, name: str) -> None:
    for variable in ("brdf_total", "brdf"):
        if variable in pair and "stokes_out" in pair[variable].dims:
            m00 = pair[variable].isel(stokes_out=0, stokes_in=0)
            change = float(abs(m00.diff(name)).max() / abs(m00).max())
            if change > _CHANGE:
                ends = " and ".join(in_words(name, one) for one in pair[name].values)
                msg = (
                    f"M00 changes by {100 * change:.0f} % of its peak between {name} "
                    f"{ends}; what is interpolated there may be wrong by as much. Simulate "
                    "nearer values."
                )
                warnings.warn(msg, AccuracyWarning, stacklevel=4)
            return
