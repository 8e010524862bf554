"""Brightness of a scan by incidence: M00 from whatever was read, and its error."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import comb
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Curve", "brightness", "curves_of", "scatter_of", "stderr_of", "together"]

# Spread of one angle [rad] and of one wavelength [um] as they are read back
ENCODER, READ_BACK = np.deg2rad(0.05), 2.5e-4

# sin(theta_s) |sin(dphi)| of a reading that counts as in plane
_PLANE = 2e-3
# The median of the size of a normal number, in standard deviations
_MEDIAN = 0.6745


@dataclass(frozen=True, eq=False)
class Curve:
    """Readings of one incidence, azimuth of the source and wavelength.

    Attributes
    ----------
    theta_i, wavelength : float
        [rad], [um]; wavelength NaN where unknown.
    theta_s, dphi, value, stderr : ndarray, shape (n,)
        [rad], [rad], [1/sr], [1/sr]; stderr NaN where unknown.
    """

    theta_i: float
    wavelength: float
    theta_s: np.ndarray
    dphi: np.ndarray
    value: np.ndarray
    stderr: np.ndarray

    @property
    def place(self) -> str:
        """The incidence and wavelength in words."""
        wave = "" if np.isnan(self.wavelength) else f", {self.wavelength:g} um"
        return f"incidence {np.degrees(self.theta_i):.4g} deg{wave}"

    def in_plane(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return rising signed view angles, values and errors of the plane of incidence."""
        inside = np.abs(np.sin(self.dphi)) * np.sin(self.theta_s) < _PLANE
        view = np.where(np.cos(self.dphi) > 0, -self.theta_s, self.theta_s)[inside]
        order = np.argsort(view, kind="stable")
        return view[order], self.value[inside][order], self.stderr[inside][order]

    @property
    def is_planar(self) -> bool:
        """True if nothing was read out of the plane of incidence."""
        return bool((np.abs(np.sin(self.dphi)) * np.sin(self.theta_s) < _PLANE).all())


def stderr_of(scan: "xr.Dataset", name: str) -> np.ndarray:
    """Return the stated errors of readings, NaN where there are none."""
    column = f"{name}_stderr"
    if column not in scan:
        return np.full(scan.sizes["geometry"], np.nan)
    return np.asarray(scan[column].values, float)


def brightness(scan: "xr.Dataset") -> tuple[np.ndarray, np.ndarray] | None:
    """Return M00 and its standard error, or None where the scan has none.

    The sum of light behind two crossed polarisers is M00, that of four half-polarised
    readings f_ab twice M00.
    """
    for parts, factor in (
        (("M00",), 1.0), (("I_s", "I_p"), 1.0), (("f_ss", "f_sp", "f_ps", "f_pp"), 0.5),
    ):  # fmt: skip
        if set(parts) <= set(scan.data_vars):
            value = factor * sum(np.asarray(scan[part].values, float) for part in parts)
            squares = sum(stderr_of(scan, part) ** 2 for part in parts)
            return np.asarray(value), factor * np.sqrt(squares)
    return None


def curves_of(scan: "xr.Dataset") -> Iterator[Curve]:
    """Yield the readings of each incidence, azimuth of the source and wavelength."""
    found = brightness(scan)
    if found is None:
        return
    size = scan.sizes["geometry"]

    def column(name: str, default: float) -> np.ndarray:
        if name not in scan.coords:
            return np.full(size, default)
        return np.broadcast_to(np.asarray(scan[name].values, float), (size,))

    theta_i, wavelength = column("theta_i", np.nan), column("wavelength", np.nan)
    keys = np.column_stack([
        together(theta_i, ENCODER), together(column("phi_i", 0.0), ENCODER),
        together(np.nan_to_num(wavelength, nan=-1.0), READ_BACK),
    ])  # fmt: skip
    value, stderr = found
    theta_s, dphi = column("theta_s", np.nan), column("dphi", np.nan)
    for key in np.unique(keys, axis=0):
        here = (keys == key).all(axis=1) & np.isfinite(value)
        if here.any():
            yield Curve(
                float(theta_i[here][0]), float(wavelength[here][0]),
                theta_s[here], dphi[here], value[here], stderr[here],
            )  # fmt: skip


def together(values: np.ndarray, within: float) -> np.ndarray:
    """Give one number to values within a spread, as a setting is read back.

    Only to look at a scan, and only where the groups stay apart: else equal ones alone.

    Examples
    --------
    >>> together(np.array([0.5001, 0.4999, 0.6]), 1e-3).tolist()
    [0, 0, 1]
    >>> together(np.array([0.5, 0.5009, 0.5018]), 1e-3).tolist()
    [0, 1, 2]
    """
    order = np.argsort(values)
    ordered = values[order]
    first = np.diff(ordered, prepend=ordered[:1]) > within
    first[:1] = True
    starts = np.flatnonzero(first)
    ends = np.append(starts[1:], values.size)[: starts.size] - 1
    if (ordered[ends] - ordered[starts] > within).any():
        return np.unique(np.rint(values / (1e-3 * within)), return_inverse=True)[1].ravel()
    label = np.empty(values.size, dtype=int)
    label[order] = np.cumsum(first) - 1
    return label


def scatter_of(values: np.ndarray, unit: np.ndarray) -> float:
    """Return the scatter of even readings about a smooth curve, in units of each reading.

    Differences of order 2 to 4, of the readings and of their logarithms, see the noise
    alike, and a smooth curve differently: the least of them holds least of it, and errs low
    by up to a half where few readings are bright. NaN of fewer than 12.

    Parameters
    ----------
    values, unit : ndarray, shape (n,)
        Readings at even steps, and what to count their scatter in: their standard errors,
        or their own size.

    Examples
    --------
    >>> lobe = np.exp(-np.linspace(-3.0, 3.0, 60) ** 2)
    >>> round(scatter_of(lobe, 0.01 * lobe), 2)
    0.0
    >>> noise = np.random.default_rng(0).standard_normal(60)
    >>> bool(0.5 < scatter_of(lobe * (1.0 + 0.01 * noise), 0.01 * lobe) < 1.5)
    True
    """
    # Readings this far below the brightest are no light
    lit = np.flatnonzero(np.abs(values) > 1e-12 * np.abs(values).max(initial=0.0))
    if lit.size:
        values, unit = (part[lit[0] : lit[-1] + 1] for part in (values, unit))
    if values.size < 12 or not (unit > 0.0).all():
        return float("nan")
    found = [_in_differences(values, unit, order) for order in (2, 3, 4)]
    if (values > 0.0).all():
        logs, parts = np.log(values), np.minimum(unit / values, 1e100)
        found += [_in_differences(logs, parts, order) for order in (2, 3, 4)]
    return min(found)


def _in_differences(values: np.ndarray, unit: np.ndarray, order: int) -> float:
    """Return the scatter that differences of one order see."""
    weights = np.array([comb(order, k) ** 2 for k in range(order + 1)], dtype=float)
    spread = np.sqrt(np.convolve(unit**2, weights, mode="valid"))
    # Readings so dark that their square is nothing tell nothing
    seen = spread > 0.0
    if not seen.any():
        return float("nan")
    size = np.abs(np.diff(values, n=order))[seen] / spread[seen]
    return float(np.median(size)) / _MEDIAN
