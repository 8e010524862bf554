"""Scans of one wavelength, and several apart."""

import numpy as np
import xarray as xr

__all__ = ["by_wavelength", "one_wavelength"]


def by_wavelength(measurement: xr.Dataset) -> dict[float | None, xr.Dataset]:
    """Return the readings of each wavelength [um]; under None all, where there is but one.

    Raises
    ------
    ValueError
        If some readings of several wavelengths name none.
    """
    if "wavelength" not in measurement.coords:
        return {None: measurement}
    waves = np.broadcast_to(measurement.wavelength.values, measurement.sizes["geometry"])
    keys = waves.round(9)
    found = np.unique(keys)
    if found.size < 2:
        return {None: measurement}
    if not np.isfinite(found).all():
        msg = (
            f"measurement must name the wavelength [um] of every reading, got none for "
            f"{np.isnan(keys).sum()} of {keys.size}. Leave them out."
        )
        raise ValueError(msg)
    return {
        float(wave): measurement.isel(geometry=np.flatnonzero(keys == wave))
        for wave in found
    }


def one_wavelength(measurement: xr.Dataset) -> float | None:
    """Return the one wavelength of the scan, None if it names none. [um]"""
    if "wavelength" not in measurement.coords:
        return None
    found = np.unique(measurement.wavelength.values)
    found = found[np.isfinite(found)]
    if found.size > 1:
        listed = ", ".join(f"{value:g}" for value in found)
        msg = (
            f"measurement must hold one wavelength [um], got {listed}. "
            "Run each part of by_wavelength(measurement)."
        )
        raise ValueError(msg)
    return float(found[0]) if found.size else None
