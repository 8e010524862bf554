"""What a channel of a sensor sees: signatures weighted by the response of its band."""

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from pbrdf.errors import DataFileError, require

__all__ = ["in_band", "read_response"]

Response = tuple[npt.ArrayLike, npt.ArrayLike]


def in_band(seen: xr.Dataset, response: Response) -> xr.Dataset:
    """Return a signature as the mean over a band, weighted by its response.

    Radiance and response are each linear between their own wavelengths, and their product
    is integrated exactly: ∫ R L dλ / ∫ R dλ.

    Parameters
    ----------
    seen : xarray.Dataset
        Of `signature` at several wavelengths that cover the band.
    response : (wavelengths, values)
        Relative response, >= 0, zero beyond its ends. [um], [1]

    Returns
    -------
    xarray.Dataset
        Without the dimension wavelength; `wavelength` is the mean weighted by the response.
        Errors of wavelengths, which share rays, are added.

    Raises
    ------
    ValueError
        If the response goes beyond the wavelengths, or is no response.

    Examples
    --------
    >>> from pbrdf import Material, MicrofacetModel
    >>> from pbrdf.signatures import Sun, signature
    >>> white = MicrofacetModel(Material(1.5), 0.2, specular_gain=0.0, diffuse_albedo=1.0)
    >>> sun = Sun(theta=0.0, irradiance=([0.4, 0.8], [1.0, 3.0]))
    >>> seen = signature(white, 0.5, wavelength=[0.4, 0.8], sun=sun)
    >>> band = in_band(seen, ([0.4, 0.8], [1.0, 1.0]))
    >>> round(float(band.radiance.sel(stokes="I")) * np.pi, 3)
    2.0
    """
    waves, values = _checked(response)
    if "wavelength" not in seen.dims or seen.sizes["wavelength"] < 2:
        msg = "seen must have several wavelengths to be weighted. Pass those of the band."
        raise ValueError(msg)
    nodes = seen.wavelength.to_numpy()
    if (np.diff(nodes) <= 0).any():
        msg = f"wavelengths of seen must rise, got {nodes}. Sort them."
        raise ValueError(msg)
    low, high = _support(waves, values)
    if low < nodes[0] * (1 - 1e-9) or high > nodes[-1] * (1 + 1e-9):
        msg = (
            f"response must lie within the wavelengths of the signature, {nodes[0]:g} to "
            f"{nodes[-1]:g} um, got one from {low:g} to {high:g} um. Compute further ones."
        )
        raise ValueError(msg)
    weight = xr.DataArray(_weights(nodes, waves, values), dims="wavelength")
    weight = weight / weight.sum()
    out = (seen.drop_vars("wavelength") * weight).sum("wavelength", skipna=False)
    for name, variable in seen.data_vars.items():
        out[name].attrs = dict(variable.attrs)
    for name, coordinate in seen.coords.items():
        if name in out.coords:
            out[name].attrs = dict(coordinate.attrs)
    centre = float((weight.to_numpy() * nodes).sum())
    out = out.assign_coords(wavelength=centre)
    out.wavelength.attrs = {"units": "um", "long_name": "mean wavelength of the band"}
    out.attrs = dict(seen.attrs) | {"band": [float(low), float(high)]}
    return out


def read_response(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """Read the response of a band: CSV with columns wavelength_um and response.

    Raises
    ------
    DataFileError
        If a column is missing, a value is no number, or it is no response.
    """
    import io

    import pandas as pd

    from pbrdf.files import check_columns, read_bounded

    content = read_bounded(path).decode("utf-8", errors="replace")
    check_columns(path, content.splitlines())
    try:
        table = pd.read_csv(io.StringIO(content), comment="#", skipinitialspace=True)
    except ValueError as error:
        problem = f"expected a table with a header, got: {str(error).splitlines()[0]}"
        raise DataFileError(path, problem, "Separate the columns by commas.") from error
    for name in ("wavelength_um", "response"):
        if name not in table:
            cure = "A response needs wavelength_um and response."
            raise DataFileError(path, "missing column", cure, column=name)
        if table[name].dtype.kind not in "fiu" or table[name].isna().any():
            problem = "expected numbers in all rows"
            raise DataFileError(path, problem, "Fill the gaps.", column=name)
    table = table.sort_values("wavelength_um")
    try:
        return _checked((table["wavelength_um"], table["response"]))
    except ValueError as error:
        problem, _, cure = str(error).partition(". ")
        raise DataFileError(path, problem, cure or "Mend the table.") from error


def _checked(response: Any) -> tuple[np.ndarray, np.ndarray]:
    waves = require(
        "response wavelengths", response[0], lambda v: (v > 0) & np.isfinite(v),
        "be positive [um]", "Wavelengths are micrometres.",
    )  # fmt: skip
    values = require(
        "response", response[1], lambda v: (v >= 0) & np.isfinite(v), "be finite and >= 0",
        "It is a share of the light.",
    )  # fmt: skip
    twice = waves[1:][np.diff(waves) == 0] if waves.ndim == 1 else waves[:0]
    if twice.size:
        msg = f"response must have each wavelength once, got {twice[0]:g} um twice."
        raise ValueError(msg)
    if waves.ndim != 1 or waves.shape != values.shape or (np.diff(waves) <= 0).any():
        msg = (
            "response must be (wavelengths, values) of one length with rising wavelengths, "
            f"got shapes {waves.shape} and {values.shape}. Sort the table."
        )
        raise ValueError(msg)
    if waves.size < 2 or not values.any():
        msg = f"response must have two points or more and not be 0, got {values}. Mend it."
        raise ValueError(msg)
    return waves, values


def _support(waves: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """Return the ends of the part of the band that is not zero."""
    lit = np.flatnonzero(values)
    first, last = max(lit[0] - 1, 0), min(lit[-1] + 1, waves.size - 1)
    return float(waves[first]), float(waves[last])


def _weights(nodes: np.ndarray, waves: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Integral of the response times the hat function of each node."""
    edges = np.unique(np.concatenate([nodes, waves]))
    edges = edges[(edges >= waves[0]) & (edges <= waves[-1])]
    edges = edges[(edges >= nodes[0]) & (edges <= nodes[-1])]
    left, right = edges[:-1], edges[1:]
    total = np.zeros(nodes.size)
    # Simpson's rule is exact: between edges both factors are straight
    for at, share in ((left, 1 / 6), (0.5 * (left + right), 4 / 6), (right, 1 / 6)):
        hats = np.stack([np.interp(at, nodes, one) for one in np.eye(nodes.size)])
        total += share * (hats * (np.interp(at, waves, values) * (right - left))).sum(-1)
    return total
