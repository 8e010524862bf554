"""Radiance of a black body, and spectra as users give them."""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from pbrdf.errors import AccuracyWarning, one_number, require

__all__ = ["Spectrum", "black_body", "checked_temperature", "spectral", "tell_cold"]

# A number below was meant in degrees Celsius, or on the moon by night, or in space [K]
COLD = 100.0
# One number, (wavelengths, values), or a function of the wavelength [um]
Spectrum = float | tuple[npt.ArrayLike, npt.ArrayLike] | Callable[[float], float]


def black_body(wavelength: npt.ArrayLike, temperature: float) -> np.ndarray:
    """Spectral radiance of a black body, by Planck's law. [W m-2 sr-1 um-1]

    Parameters
    ----------
    wavelength : array_like
        Vacuum wavelength. [um]
    temperature : float
        [K]

    Examples
    --------
    >>> float(black_body(10.0, 300.0).round(3))
    9.924
    """
    from scipy.constants import c, h, k

    temperature = checked_temperature("temperature", temperature)
    metres = 1e-6 * require(
        "wavelength", wavelength, lambda v: (v > 0) & np.isfinite(v), "be > 0 [um]",
        "Wavelengths are micrometres.",
    )  # fmt: skip
    # Per metre of wavelength, then per micrometre; exponents beyond 700 are no light
    exponent = np.minimum(h * c / (metres * k * temperature), 700.0)
    return 1e-6 * 2 * h * c**2 / metres**5 / np.expm1(exponent)


def checked_temperature(name: str, temperature: Any) -> float:
    """Return a temperature. [K]

    Raises
    ------
    ValueError
        If it is not above zero.
    """
    return one_number(
        name, temperature, lambda v: (v > 0) & (v < 1e6), "lie in (0, 1e6) K",
        "Temperatures are kelvins.",
    )  # fmt: skip


def tell_cold(temperature: float) -> None:
    """Warn of a temperature [K] that looks like one in degrees Celsius."""
    if temperature < COLD:
        msg = (
            f"temperature is {temperature:g} K. Temperatures are kelvins: add 273.15 to "
            "degrees Celsius."
        )
        warnings.warn(msg, AccuracyWarning, stacklevel=4)


def spectral(name: str, spectrum: Spectrum, wavelength: float | None) -> float:
    """Return the value of a spectrum at one wavelength; tables are linear between points.

    Raises
    ------
    ValueError
        If it needs a wavelength and there is none, or a table ends before, or it is < 0.
    """
    if callable(spectrum) or isinstance(spectrum, tuple):
        if wavelength is None:
            msg = f"wavelength must be given, {name} depends on it. Pass wavelength=0.55."
            raise ValueError(msg)
        if callable(spectrum):
            value: Any = spectrum(wavelength)
        else:
            value = _tabulated(name, spectrum, wavelength)
    else:
        value = spectrum
    return one_number(
        name, value, lambda v: (v >= 0) & np.isfinite(v), "be finite and >= 0",
        "It is a power, a depth or an albedo.",
    )  # fmt: skip


def _tabulated(name: str, table: tuple[Any, Any], wavelength: float) -> float:
    waves, values = (
        require(f"{name} table", one, np.isfinite, "be finite", "Leave gaps out.")
        for one in table
    )
    if waves.ndim != 1 or waves.shape != values.shape or (np.diff(waves) <= 0).any():
        msg = (
            f"{name} must be (wavelengths, values) of one length with rising wavelengths, "
            f"got shapes {waves.shape} and {values.shape}. Sort the table."
        )
        raise ValueError(msg)
    if not waves[0] <= wavelength <= waves[-1]:
        msg = (
            f"wavelength must lie within the table of {name}, {waves[0]:g} to "
            f"{waves[-1]:g} um, got {wavelength:g}. Extend the table."
        )
        raise ValueError(msg)
    return float(np.interp(wavelength, waves, values))
