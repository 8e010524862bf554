"""Stokes vectors in the axes of a picture."""

import numpy as np
import numpy.typing as npt
import xarray as xr

from pbrdf.conventions import direction, meridian_frame
from pbrdf.errors import require

__all__ = ["image_axes"]


def image_axes(seen: xr.Dataset, up: npt.ArrayLike = (0.0, 0.0, 1.0)) -> xr.Dataset:
    """Return a signature with Q and U in the axes of a camera.

    Parameters
    ----------
    seen : xarray.Dataset
        Of `signature`, in meridian frames.
    up : array_like, shape (3,)
        The direction in space that is up in the picture, projected onto it; x east or
        wherever azimuths start, z the normal of the surface. For a sensor straight above it
        must not be (0, 0, 1).

    Returns
    -------
    xarray.Dataset
        Q > 0 along the rows of the picture, U > 0 half way from right to up.

    Raises
    ------
    ValueError
        If `up` points along a line of sight, or the dataset was turned already.
    """
    axis = require("up", up, np.isfinite, "be finite", "Give three numbers.")
    if axis.shape != (3,) or not axis.any():
        msg = f"up must be three numbers, not all 0, got {axis}. Give a direction."
        raise ValueError(msg)
    if not str(seen.attrs.get("frame", "")).startswith("meridian"):
        msg = "seen must be a signature in meridian frames, got another. Turn it once."
        raise ValueError(msg)
    theta, phi = xr.broadcast(seen.theta_s, seen.phi_s)
    sight = direction(theta.to_numpy(), phi.to_numpy())
    e_s, e_p = meridian_frame(sight, phi.to_numpy())
    # The sensor looks along -k; right is (-k) x up = up x k
    right = np.cross(axis / np.linalg.norm(axis), sight)
    length = np.linalg.norm(right, axis=-1, keepdims=True)
    if (length < 1e-6).any():
        msg = f"up must not point along a line of sight, got {axis}. Give another."
        raise ValueError(msg)
    right = right / length
    cos = xr.DataArray((right * e_s).sum(-1), dims=theta.dims)
    sin = xr.DataArray((right * e_p).sum(-1), dims=theta.dims)
    cos2, sin2 = cos**2 - sin**2, 2 * sin * cos
    turned = seen.copy()
    for name, variable in seen.data_vars.items():
        i, q, u, v = (variable.sel(stokes=one, drop=True) for one in "IQUV")
        if str(name).endswith("_stderr"):
            both = [np.hypot(cos2 * q, sin2 * u), np.hypot(sin2 * q, cos2 * u)]
        else:
            both = [cos2 * q + sin2 * u, cos2 * u - sin2 * q]
        elements = [i, xr.DataArray(both[0]), xr.DataArray(both[1]), v]
        parts = xr.concat(elements, dim=seen.stokes)
        turned[name] = parts.transpose(*variable.dims).assign_attrs(variable.attrs)
    turned.attrs["frame"] = f"image: Q > 0 along the rows, up towards {axis.tolist()}"
    return turned
