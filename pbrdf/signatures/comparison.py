"""Whether a sensor can tell two surfaces apart."""

import numpy as np
import xarray as xr

from pbrdf.errors import one_number

__all__ = ["contrast"]


def contrast(
    target: xr.Dataset, background: xr.Dataset, *, noise: float | None = None
) -> xr.Dataset:
    """Difference, ratio and detectability of two signatures of one geometry.

    Parameters
    ----------
    target, background : xarray.Dataset
        Of `signature`, with equal directions, wavelengths, frames and units.
    noise : float, optional
        Standard deviation of the noise of one channel of a camera with polarisers at 0, 45,
        90 and 135 degrees, in the units of the radiance. It makes sqrt(2) times as much in
        Q and in U, and once as much in I, which all four channels share.

    Returns
    -------
    xarray.Dataset
        difference (..., stokes); ratio, of I; dolp_difference; each with its `*_stderr`,
        the two signatures taken as independent. With noise also detectability
        (..., measure), the difference of I, Q, U and DOLP over the noise of that difference
        in one pixel.

    Raises
    ------
    ValueError
        If the two cannot be compared.
    """
    _check_pair(target, background)
    one, other = target.radiance, background.radiance
    one_err, other_err = target.radiance_stderr, background.radiance_stderr
    p, p_err = _dolp(one, one_err)
    p_other, p_other_err = _dolp(other, other_err)
    first, second = one.sel(stokes="I", drop=True), other.sel(stokes="I", drop=True)
    ratio = (first / second).where(second > 0)
    first_err, second_err = (
        err.sel(stokes="I", drop=True) for err in (one_err, other_err)
    )  # fmt: skip
    found = xr.Dataset(
        {
            "difference": one - other,
            "difference_stderr": np.hypot(one_err, other_err),
            "ratio": ratio,
            "ratio_stderr": np.hypot(first_err, ratio * second_err) / second,
            "dolp_difference": p - p_other,
            "dolp_difference_stderr": np.hypot(p_err, p_other_err),
        }
    )
    units = {"difference": one.attrs["units"], "ratio": "1", "dolp_difference": "1"}
    for name, unit in units.items():
        found[name].attrs["units"] = found[f"{name}_stderr"].attrs["units"] = unit
    found.attrs = {"frame": target.attrs["frame"]}
    if noise is None:
        return found
    noise = one_number(
        "noise", noise, lambda v: (v > 0) & np.isfinite(v), "be > 0", "Leave it out."
    )
    both = np.sqrt(2.0) * noise
    change = found.difference
    # Noise of sqrt(Q^2 + U^2)/I to first order, of each of the two pictures
    spread = np.hypot(
        noise * np.sqrt(2.0 + p**2) / first, noise * np.sqrt(2.0 + p_other**2) / second
    )
    measures = {
        "I": change.sel(stokes="I", drop=True) / both,
        "Q": change.sel(stokes="Q", drop=True) / (np.sqrt(2.0) * both),
        "U": change.sel(stokes="U", drop=True) / (np.sqrt(2.0) * both),
        "DOLP": found.dolp_difference / spread,
    }
    axis = xr.DataArray(list(measures), dims="measure", name="measure")
    together = xr.concat(list(measures.values()), dim=axis)
    found["detectability"] = np.abs(together.transpose(..., "measure"))
    found.detectability.attrs = {
        "units": "1", "long_name": "difference over its noise in one pixel",
    }  # fmt: skip
    found.attrs["noise"] = noise
    return found


def _dolp(light: xr.DataArray, stderr: xr.DataArray) -> tuple[xr.DataArray, xr.DataArray]:
    """Degree of linear polarisation and its error, of elements that err independently."""
    i, q, u = (light.sel(stokes=one, drop=True) for one in "IQU")
    i_err, q_err, u_err = (stderr.sel(stokes=one, drop=True) for one in "IQU")
    linear = xr.DataArray(np.hypot(q, u))
    dolp = (linear / i).where(i > 0)
    # Of unpolarised light the larger of the two errors
    along = xr.DataArray(np.hypot(q * q_err, u * u_err)) / linear.where(linear > 0)
    along = along.fillna(np.maximum(q_err, u_err))
    return dolp, xr.DataArray(np.hypot(along / i, dolp * i_err / i))


def _check_pair(target: xr.Dataset, background: xr.Dataset) -> None:
    for name, one in (("target", target), ("background", background)):
        for needed in ("radiance", "radiance_stderr"):
            if needed not in one:
                msg = f"{name} must be a signature, it lacks {needed}. Use pbrdf.signature."
                raise ValueError(msg)
    try:
        xr.align(target, background, join="exact")
    except ValueError as error:
        msg = f"target and background must have equal axes: {str(error).splitlines()[0]}."
        raise ValueError(msg) from error
    for name in ("theta_s", "phi_s", "wavelength"):
        held = [name in one.coords for one in (target, background)]
        if any(held) and not (all(held) and target[name].equals(background[name])):
            msg = f"target and background must have one {name}. Compute both alike."
            raise ValueError(msg)
    pairs = {
        "frame": (target.attrs.get("frame"), background.attrs.get("frame")),
        "units": (target.radiance.attrs["units"], background.radiance.attrs["units"]),
    }
    for name, (one_text, other_text) in pairs.items():
        if one_text != other_text:
            msg = (
                f"target and background must have equal {name}, got {one_text!r} and "
                f"{other_text!r}. Compute both alike."
            )
            raise ValueError(msg)
