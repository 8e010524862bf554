"""Skies beside the clear one: overcast, warm, and measured or computed elsewhere."""

from dataclasses import dataclass
from math import pi
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from pbrdf.errors import DataFileError, require
from pbrdf.signatures.planck import Spectrum, black_body, checked_temperature, spectral

__all__ = ["OvercastSky", "Sky", "SkyTable", "ThermalSky", "read_sky"]

_ELEMENTS = ("I", "Q", "U", "V")


class Sky(Protocol):
    """Whatever gives the light of the sky."""

    def stokes(
        self, theta: npt.ArrayLike, phi: npt.ArrayLike, wavelength: float | None
    ) -> np.ndarray:
        """Stokes radiance from (theta, phi), in the frame of the light coming down."""


@dataclass(frozen=True, kw_only=True)
class OvercastSky:
    """Unpolarised light from all sides.

    Parameters
    ----------
    radiance : float, (wavelengths, values) or callable
        Towards the zenith. [W m-2 sr-1 um-1]
    horizon : float
        Radiance at the horizon over that at the zenith, with
        (horizon + (1 - horizon) cos theta) between: 1 is uniform, 1/3 the overcast sky of
        Moon and Spencer. [1]
    """

    radiance: Spectrum
    horizon: float = 1.0

    def __post_init__(self) -> None:
        require(
            "horizon", self.horizon, lambda v: (v >= 0) & np.isfinite(v), "be >= 0 [1]",
            "1 is a uniform sky.",
        )  # fmt: skip

    def stokes(
        self, theta: npt.ArrayLike, phi: npt.ArrayLike, wavelength: float | None
    ) -> np.ndarray:
        """Stokes radiance from (theta, phi), shape (..., 4)."""
        theta, _ = np.broadcast_arrays(np.asarray(theta, dtype=float), phi)
        shape = self.horizon + (1.0 - self.horizon) * np.cos(theta)
        return _unpolarised(spectral("radiance", self.radiance, wavelength) * shape)


@dataclass(frozen=True, kw_only=True)
class ThermalSky:
    """Unpolarised infrared light of the sky.

    Parameters
    ----------
    temperature : float
        [K]
    optical_depth : float, (wavelengths, values) or callable, optional
        Of the emitting air along the vertical: its emissivity is
        1 - exp(-optical_depth / cos theta). Without it the sky is a black body. [1]
    """

    temperature: float
    optical_depth: Spectrum | None = None

    def __post_init__(self) -> None:
        checked_temperature("temperature", self.temperature)

    def stokes(
        self, theta: npt.ArrayLike, phi: npt.ArrayLike, wavelength: float | None
    ) -> np.ndarray:
        """Stokes radiance from (theta, phi), shape (..., 4)."""
        theta, _ = np.broadcast_arrays(np.asarray(theta, dtype=float), phi)
        radiance = spectral(
            "temperature", lambda w: float(black_body(w, self.temperature)), wavelength
        )
        if self.optical_depth is None:
            return _unpolarised(np.full(theta.shape, radiance))
        depth = spectral("optical_depth", self.optical_depth, wavelength)
        path = depth / np.maximum(np.cos(theta), 1e-12)
        return _unpolarised(-radiance * np.expm1(-path))


@dataclass(frozen=True, kw_only=True, eq=False)
class SkyTable:
    """Light of the sky on a grid of directions, interpolated linearly.

    Parameters
    ----------
    theta : array_like, shape (zeniths,)
        Rising, from 0 to at least 80 degrees; beyond the last one the last holds. [rad]
    phi : array_like, shape (azimuths,)
        Rising, over less than a full circle; closed by the program. One azimuth means a sky
        that looks alike on all sides. [rad]
    values : array_like, shape (zeniths, azimuths, 4) or (wavelengths, zeniths, azimuths, 4)
        Stokes radiance in the meridian frame of the light coming down, at the zenith the
        limit at each azimuth. [W m-2 sr-1 um-1]
    wavelength : array_like, shape (wavelengths,), optional
        Rising. [um]
    """

    theta: npt.ArrayLike
    phi: npt.ArrayLike
    values: npt.ArrayLike
    wavelength: npt.ArrayLike | None = None

    def __post_init__(self) -> None:
        theta = require(
            "theta", self.theta, lambda v: (v >= 0) & (v <= pi / 2 + 1e-12),
            "lie in [0, 1.571] rad", "Angles are radians; use np.deg2rad.",
        )  # fmt: skip
        phi = require(
            "phi", self.phi, lambda v: np.abs(v) <= 2 * pi, "lie in [-6.283, 6.283] rad",
            "Angles are radians; use np.deg2rad.",
        )  # fmt: skip
        values = require(
            "values", self.values, np.isfinite, "be finite", "Fill the gaps of the table."
        )
        waves = None
        if self.wavelength is not None:
            waves = require(
                "wavelength", self.wavelength, lambda v: (v > 0) & np.isfinite(v),
                "be positive [um]", "Wavelengths are micrometres.",
            )  # fmt: skip
        wanted: tuple[int, ...] = (theta.size, phi.size, 4)
        wanted = wanted if waves is None else (waves.size, *wanted)
        if values.shape != wanted:
            msg = f"values must have shape {wanted} [directions, IQUV], got {values.shape}."
            raise ValueError(msg)
        for name, axis in (("theta", theta), ("phi", phi), ("wavelength", waves)):
            if axis is not None and (axis.ndim != 1 or (np.diff(axis) <= 0).any()):
                msg = f"{name} must rise along one axis, got {axis}. Sort the table."
                raise ValueError(msg)
        if theta.size < 2 or theta[0] > 1e-9 or theta[-1] < np.deg2rad(80) - 1e-9:
            msg = (
                "theta must run from 0 to 80 degrees or more, got "
                f"{np.rad2deg(theta[0]):g} to {np.rad2deg(theta[-1]):g}. Extend the table."
            )
            raise ValueError(msg)
        if phi[-1] - phi[0] >= 2 * pi - 1e-9:
            msg = "phi must cover less than 360 degrees, got a repeated column. Drop it."
            raise ValueError(msg)
        polarised = np.linalg.norm(values[..., 1:], axis=-1)
        if (polarised > values[..., 0] * (1 + 1e-6) + 1e-300).any():
            place = tuple(
                int(one) for one in np.argwhere(polarised > values[..., 0] * (1 + 1e-6))[0]
            )
            msg = (
                f"values must have Q, U, V within I, got more polarised light than light "
                f"at index {place}. Are they ratios?"
            )
            raise ValueError(msg)

    def stokes(
        self, theta: npt.ArrayLike, phi: npt.ArrayLike, wavelength: float | None
    ) -> np.ndarray:
        """Stokes radiance from (theta, phi), shape (..., 4)."""
        from scipy.interpolate import RegularGridInterpolator

        zeniths, azimuths = np.asarray(self.theta, float), np.asarray(self.phi, float)
        grid = self._at(wavelength)
        azimuths = np.append(azimuths, azimuths[0] + 2 * pi)
        grid = np.concatenate([grid, grid[:, :1]], axis=1)
        table = RegularGridInterpolator((zeniths, azimuths), grid)
        theta, phi = np.broadcast_arrays(np.asarray(theta, float), np.asarray(phi, float))
        turned = np.mod(phi - azimuths[0], 2 * pi) + azimuths[0]
        at = np.stack([np.minimum(theta, zeniths[-1]), turned], axis=-1)
        found: np.ndarray = table(at)
        return found

    def _at(self, wavelength: float | None) -> np.ndarray:
        values = np.asarray(self.values, float)
        if self.wavelength is None:
            return values
        waves = np.asarray(self.wavelength, float)
        place = spectral("sky", (waves, np.arange(waves.size, dtype=float)), wavelength)
        low = min(int(place), max(waves.size - 2, 0))
        high = min(low + 1, waves.size - 1)
        return values[low] + (place - low) * (values[high] - values[low])


def read_sky(path: str | Path) -> SkyTable:
    """Read a sky from a CSV table.

    Columns theta_deg, phi_deg, I and, where the sky is polarised, Q, U, V, and
    wavelength_um for several wavelengths; one row a direction of a full grid, lines that
    start with # are comments. Frames as in `SkyTable`.

    Raises
    ------
    DataFileError
        If a column is missing or unknown, a value is no number, or the grid has gaps.
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
    keys = ["wavelength_um"] if "wavelength_um" in table else []
    keys += ["theta_deg", "phi_deg"]
    for name in [*keys, "I"]:
        if name not in table:
            cure = "A sky needs theta_deg, phi_deg and I."
            raise DataFileError(path, "missing column", cure, column=name)
    for name in map(str, table):
        if name not in (*keys, *_ELEMENTS):
            cure = "Known: wavelength_um, theta_deg, phi_deg, I, Q, U, V."
            raise DataFileError(path, "unknown column", cure, column=name)
        if table[name].dtype.kind not in "fiu" or table[name].isna().any():
            problem = "expected numbers in all rows"
            raise DataFileError(path, problem, "Fill the gaps.", column=name)
    table = table.reindex(columns=[*keys, *_ELEMENTS], fill_value=0.0).sort_values(keys)
    axes = [np.unique(table[name]) for name in keys]
    shape = tuple(axis.size for axis in axes)
    if table.duplicated(keys).any() or len(table) != np.prod(shape):
        problem = f"expected a full grid of {' x '.join(map(str, shape))} directions"
        raise DataFileError(path, f"{problem}, got {len(table)} rows", "Fill the gaps.")
    values = table[list(_ELEMENTS)].to_numpy(float).reshape(*shape, 4)
    try:
        return SkyTable(
            theta=np.deg2rad(axes[-2]),
            phi=np.deg2rad(axes[-1]),
            values=values,
            wavelength=axes[0] if len(axes) == 3 else None,
        )
    except ValueError as error:
        problem, _, cure = str(error).partition(". ")
        raise DataFileError(path, problem, cure or "Mend the table.") from error


def _unpolarised(radiance: np.ndarray) -> np.ndarray:
    out: Any = np.zeros((*radiance.shape, 4))
    out[..., 0] = radiance
    return np.asarray(out)
