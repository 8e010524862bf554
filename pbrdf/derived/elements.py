"""Elements of the Mueller BRDF, DOLP and AOLP of a result, each with its standard error."""

import re
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from pbrdf.errors import real_array
from pbrdf.files.toml import tables_of

__all__ = ["NAMES", "Element", "element", "folded", "light", "mueller", "stderr_of_light"]

NAMES = (*(f"M{o}{i}" for o in range(4) for i in range(4)), "DOLP", "AOLP")
_STOKES = "IQUV"
_LIGHT = (1.0, 0.0, 0.0, 0.0)


class Element(NamedTuple):
    """A quantity of a result and its standard error, None where the result has none."""

    value: xr.DataArray
    stderr: xr.DataArray | None


def mueller(result: xr.Dataset) -> tuple[xr.DataArray, xr.DataArray | None]:
    """Mueller BRDF of all bounces and its standard error [1/sr].

    Raises
    ------
    ValueError
        If the result holds no BRDF.
    """
    for name in ("brdf_total", "brdf"):
        if name in result:
            value = result[name]
            stderr = result.get(f"{name}_stderr")
            if "bounces" in value.dims:
                value, stderr = value.sum("bounces", skipna=False, keep_attrs=True), None
            return value, stderr
    held = ", ".join(map(str, result.data_vars)) or "nothing"
    msg = f"the result must hold brdf_total or brdf, got {held}."
    raise ValueError(msg)


def element(result: xr.Dataset, name: str, source: npt.ArrayLike = _LIGHT) -> Element:
    """One of `NAMES` over all other dimensions of a result.

    DOLP [1] and AOLP [rad] are those of the light that `source`, a Stokes vector,
    scatters; NaN where nothing is known: no light was found, or the data are missing.

    Raises
    ------
    ValueError
        If the name is none of those, or the result does not hold what it needs.

    Notes
    -----
    The errors of the Stokes elements are taken as independent. Each path adds to M00 as it
    adds to M10, so this overstates the error of a DOLP. That is 1 and that of an AOLP
    pi/2 at most, which is to know nothing; both are NaN where M00 is below two standard
    errors.
    """
    if name not in NAMES:
        meant = f" Did you mean {name.upper()}?" if name.upper() in NAMES else ""
        msg = f"elements must be one of {', '.join(NAMES)}, got {name!r}.{meant}"
        raise ValueError(msg)
    if name[0] == "M":
        out, into = (_STOKES[int(digit)] for digit in name[1:])
        value, stderr = mueller(result)
        _require(value, name, out, into)
        about = {"units": "sr-1", "long_name": f"{name} of the Mueller BRDF"}
        pick = {"stokes_out": out, "stokes_in": into}
        error = None if stderr is None else _told(stderr.sel(pick, drop=True), about, True)
        return Element(_told(value.sel(pick, drop=True), about), error)
    return _polarisation(result, name, source)


def _polarisation(result: xr.Dataset, name: str, source: npt.ArrayLike) -> Element:
    """DOLP or AOLP of the light that a source scatters."""
    stokes = light(result, source)
    _require(stokes, name, "U")
    errors = stderr_of_light(result, source)
    parts: list[Any] = [stokes.sel(stokes_out=s, drop=True) for s in "IQU"]
    i, q, u = parts
    lit: Any = i.where(i > 0.0)
    polarised: Any = np.hypot(q, u)
    value: Any
    error: Any
    if name == "DOLP":
        about = {"units": "1", "long_name": "degree of linear polarisation"}
        value = polarised / lit
    else:
        about = {
            "units": "rad",
            "long_name": "angle of linear polarisation, from e_s towards e_p",
        }
        value = (0.5 * np.arctan2(u, q)).where((lit > 0.0) & (polarised > 0.0))
    if errors is None:
        return Element(_told(value, about), None)
    di, dq, du = (errors.sel(stokes_out=s, drop=True) for s in "IQU")
    known = polarised.where(polarised > 0.0)
    if name == "DOLP":
        # Along the polarisation; without any, along the worse of both axes
        along: Any = np.hypot(q * dq, u * du) / known
        along = along.fillna(np.maximum(dq, du))
        error, most = np.hypot(along, value * di) / lit, 1.0
    else:
        error = (0.5 * np.hypot(u * dq, q * du) / known**2).where(value.notnull())
        most = np.pi / 2
    # Of light that is lost in its own error nothing is known; of other, no more than all
    error = np.minimum(error, most).where(i >= 2.0 * di)
    return Element(_told(value, about), _told(error, about, True))


def light(result: xr.Dataset, source: npt.ArrayLike = _LIGHT) -> xr.DataArray:
    """Stokes vector that a source scatters, per unit of its irradiance [1/sr].

    Parameters
    ----------
    result : Dataset
        Of a simulation.
    source : array_like, shape (4,)
        Stokes vector of the source (I, Q, U, V), in its own meridian frame.

    Raises
    ------
    ValueError
        If the source is no possible light, or needs elements that were not computed.
    """
    value, _ = mueller(result)
    vector = _source(source, value)
    stokes = xr.dot(value, vector, dim="stokes_in")
    about = {"units": "sr-1", "long_name": "scattered Stokes vector per irradiance"}
    return _told(stokes, about)


def stderr_of_light(
    result: xr.Dataset, source: npt.ArrayLike = _LIGHT
) -> xr.DataArray | None:
    """Return the standard error of `light`; elements of a row are taken to err together."""
    value, stderr = mueller(result)
    if stderr is None:
        return None
    return xr.dot(stderr, np.abs(_source(source, value)), dim="stokes_in")


def folded(result: xr.Dataset) -> tuple[xr.Dataset, bool]:
    """Average a result with its mirror image where the scene is isotropic.

    Returns
    -------
    Dataset, bool
        `brdf_total` and its error, folded, with all else but the BRDF by bounces; and
        whether it was. A result that was folded when it was made, or whose scene has a
        direction of its own, stays as it is.
    """
    value, stderr = mueller(result)
    if result.attrs.get("folded") or not _isotropic(result):
        return result, False
    n = value.sizes["dphi"]
    mirror = (-np.arange(n)) % n
    names = [str(s) for s in value.stokes_out.values]
    odd = np.array([name in "UV" for name in names])
    signs = xr.DataArray(
        np.where(odd[:, None] != odd, -1.0, 1.0), dims=("stokes_out", "stokes_in")
    )

    def image(array: xr.DataArray) -> xr.DataArray:
        return array.isel(dphi=mirror).assign_coords(dphi=array.dphi)

    mean = 0.5 * (value + signs * image(value))
    out = {"brdf_total": mean.transpose(*value.dims)}
    if stderr is not None:
        own = xr.DataArray(np.arange(n) == mirror, dims="dphi")
        # A bin of the plane of incidence is its own image
        error = xr.where(own, stderr, 0.5 * np.hypot(stderr, image(stderr)))
        out["brdf_total_stderr"] = error.transpose(*stderr.dims)
    rest = result.drop_vars([v for v in result.data_vars if str(v).startswith("brdf")])
    return rest.assign(out), True


def _isotropic(result: xr.Dataset) -> bool:
    """Whether the scene as the result records it looks the same from both sides."""
    if "isotropic" in result.attrs:
        return bool(result.attrs["isotropic"])
    scene = tables_of(str(result.attrs.get("scene", "")))
    surface = scene.get("surface", {})
    if surface.get("type") != "gaussian":
        return False
    lengths = np.atleast_1d(surface.get("corr_length_um", [0.0, 1.0]))
    steps = np.atleast_1d(surface.get("spacing_um", [0.0, 1.0]))
    # One surface, or bodies that lie at the same places in all, have no mirror symmetry
    pinned = re.search(r"(?m)^\s*(positions\w*|seed)\s*=", str(result.attrs["scene"]))
    one = result.attrs.get("stderr_excludes_surface", False)
    return bool(np.ptp(lengths) == np.ptp(steps) == 0.0 and not pinned and not one)


def _source(source: npt.ArrayLike, value: xr.DataArray) -> xr.DataArray:
    vector = real_array("source", source)
    if vector.shape != (4,) or vector[0] <= 0 or np.hypot.reduce(vector[1:]) > vector[0]:
        msg = (
            "source must be a Stokes vector (I, Q, U, V) with I > 0 and a polarised part "
            f"of at most I, got {np.asarray(source).tolist()}."
        )
        raise ValueError(msg)
    held = [str(s) for s in value.stokes_in.values]
    lacking = [s for s, v in zip(_STOKES, vector, strict=True) if v and s not in held]
    if lacking:
        msg = (
            f"source must have no {', '.join(lacking)}, which was not computed; the result "
            f"holds {', '.join(held)}. Simulate with stokes='full'."
        )
        raise ValueError(msg)
    numbers = [vector[_STOKES.index(s)] for s in held]
    return xr.DataArray(numbers, {"stokes_in": value.stokes_in}, "stokes_in")


def _require(value: xr.DataArray, name: str, out: str, into: str = "I") -> None:
    held = [str(s) for s in value.stokes_out.values]
    if out not in held or into not in held:
        msg = (
            f"{name} was not computed; the result holds the Stokes elements "
            f"{', '.join(held)}. Simulate with stokes='full' or 'linear'."
        )
        raise ValueError(msg)


def _told(array: xr.DataArray, about: dict[str, str], stderr: bool = False) -> xr.DataArray:
    name = f"standard error of {about['long_name']}" if stderr else about["long_name"]
    out = array.copy(deep=False)
    out.attrs = {"units": about["units"], "long_name": name}
    return out
