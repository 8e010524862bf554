"""Skies beside the clear one: overcast, warm, and measured or computed elsewhere."""

import warnings
from dataclasses import dataclass
from math import pi
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from pbrdf.errors import AccuracyWarning, DataFileError, require
from pbrdf.signatures.planck import (
    Spectrum,
    black_body,
    checked_temperature,
    spectral,
    tell_cold,
)

__all__ = ["OvercastSky", "Sky", "SkyTable", "ThermalSky", "read_sky"]

_ELEMENTS = ("I", "Q", "U", "V")
# Degrees of a file
_RANGES = {"theta_deg": (0.0, 90.0), "phi_deg": (-360.0, 360.0)}
# Difference of the zenith from itself that is warned of, in parts of I
MOST_APART = 0.1


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
        tell_cold(checked_temperature("temperature", self.temperature))

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
        Rising, all around but without a repeated one; closed by the program. One azimuth
        means a sky that looks alike on all sides. [rad]
    values : array_like, shape (zeniths, azimuths, 4) or (wavelengths, zeniths, azimuths, 4)
        Stokes radiance in the meridian frame of the light coming down, at the zenith the
        limit at each azimuth. [W m-2 sr-1 um-1]
    wavelength : array_like, shape (wavelengths,), optional
        Rising. [um]

    Raises
    ------
    ValueError
        If directions or values leave their range, or azimuths leave a part of the circle
        out.

    Warns
    -----
    AccuracyWarning
        If the zenith, one point of the sky, looks different from different azimuths.
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
        _check_directions(theta, phi)
        _check_light(theta, phi, values)

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


def _check_directions(theta: np.ndarray, phi: np.ndarray) -> None:
    """Refuse directions that leave a part of the sky out."""
    if theta.size < 2 or theta[0] > 1e-9 or theta[-1] < np.deg2rad(80) - 1e-9:
        msg = (
            "theta must run from 0 to 80 degrees or more, got "
            f"{np.rad2deg(theta[0]):g} to {np.rad2deg(theta[-1]):g}. Extend the table."
        )
        raise ValueError(msg)
    if phi.size == 1:
        return
    if phi[-1] - phi[0] >= 2 * pi - 1e-9:
        msg = "phi must cover less than 360 degrees, got a repeated column. Drop it."
        raise ValueError(msg)
    left = 2 * pi - (phi[-1] - phi[0])
    if left > 2.0 * np.diff(phi).max() + 1e-9:
        msg = (
            f"phi must go all around, got {np.rad2deg(phi[0]):g} to "
            f"{np.rad2deg(phi[-1]):g} degrees, which leaves {np.rad2deg(left):g} out. Add "
            "them; of a mirror image I and Q stay, U and V change their signs."
        )
        raise ValueError(msg)


def _check_light(theta: np.ndarray, phi: np.ndarray, values: np.ndarray) -> None:
    """Refuse what is no light, and warn of a zenith that is not one point."""
    polarised = np.linalg.norm(values[..., 1:], axis=-1)
    faults = {
        "have I >= 0": (values[..., 0] < 0, "Leave noise below 0 out."),
        "have Q, U, V within I": (
            polarised > np.abs(values[..., 0]) * (1 + 1e-6) + 1e-300, "Are they ratios?"
        ),
    }  # fmt: skip
    for rule, (wrong, cure) in faults.items():
        if wrong.any():
            place = tuple(np.argwhere(wrong)[0])
            msg = (
                f"values must {rule}, got {values[place].tolist()} at theta "
                f"{np.rad2deg(theta[place[-2]]):g}, phi {np.rad2deg(phi[place[-1]]):g} "
                f"degrees. {cure}"
            )
            raise ValueError(msg)
    top = values[..., 0, :, :]
    # A field that stands still turns against the meridians: Q + iU goes as exp(2i phi)
    turns = np.exp(-2j * (phi if phi.size > 1 else np.array([0.0, pi / 2])))
    fixed = (top[..., 1] + 1j * top[..., 2]) * turns
    apart = np.maximum(np.abs(fixed - fixed.mean(-1, keepdims=True)).max(-1), 0.0)
    mean = top[..., 0].mean(-1)
    apart = np.maximum(apart, np.abs(top[..., 0] - mean[..., None]).max(-1))
    worst = float(np.max(apart / np.where(mean > 0, mean, 1.0)))
    if worst > MOST_APART:
        msg = (
            f"the zenith of the table differs by {100 * worst:.2g} % of I from azimuth to "
            "azimuth, though it is one point. Q and U there are in the meridian of each "
            "azimuth: Q + iU goes as exp(2i phi)."
        )
        warnings.warn(msg, AccuracyWarning, stacklevel=4)


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
    _check_table(path, table, keys)
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


def _check_table(path: str | Path, table: Any, keys: list[str]) -> None:
    """Refuse columns and angles that no sky has, by their names."""
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
    for name, (low, high) in _RANGES.items():
        wrong = table[name][(table[name] < low) | (table[name] > high)]
        if len(wrong):
            problem = f"expected {low:g} to {high:g} degrees, got {wrong.iloc[0]:g}"
            raise DataFileError(path, problem, "Mend the angle.", column=name)
    if table["theta_deg"].max() <= pi / 2:
        problem = f"expected zeniths to 80 degrees, got {table['theta_deg'].max():g}"
        raise DataFileError(path, problem, "Are they radians?", column="theta_deg")


def _unpolarised(radiance: np.ndarray) -> np.ndarray:
    out: Any = np.zeros((*radiance.shape, 4))
    out[..., 0] = radiance
    return np.asarray(out)
