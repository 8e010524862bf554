"""Scattering and mean field of one kind of roughness, for arrays of geometries."""

import os
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from pbrdf.errors import AccuracyWarning
from pbrdf.kernels.wave.orders import fill_moments
from pbrdf.kernels.wave.scatter import (
    CURVATURE,
    ORDER_WEIGHTED,
    Plan,
    fill_scattering,
)
from pbrdf.wave.accuracy import MOST, OF_FINE
from pbrdf.wave.directional import Directional, smith
from pbrdf.wave.methods import method_of
from pbrdf.wave.order_table import OrderTable
from pbrdf.wave.specular import Dressing, mean_jones
from pbrdf.wave.statistics import Statistics

__all__ = ["Scattering"]

Array = np.ndarray
Moments = Callable[[Array, Array, Array, Array], Array]

# Below this many matrices a thread costs more than it saves
CHUNK = 4096
# Steeper surfaces send part of the light to a second bounce, which no form here has
STEEPEST = 0.45
# Fineness that makes an error of 1 dB
FINEST = 0.1
SLOPED = ("auto", "order-weighted", "local-curvature")


class Scattering:
    """Heights, a form of the theory, and whether they vary along one axis or two.

    Parameters
    ----------
    heights : Statistics
        The heights.
    method : str
        A key of `METHODS`.
    dimensions : int
        1 for a profile seen in its plane, 2 for an isotropic surface.
    """

    def __init__(self, heights: Statistics, method: str, dimensions: int) -> None:
        self.heights, self.dimensions = heights, dimensions
        self.name, self.method = method, method_of(method)
        self._table: OrderTable | None = None
        self._dressing = Dressing(heights, dimensions)

    def matrices(
        self, columns: list[Array], *, dressed: bool = True, phi_i: Array | float = 0.0
    ) -> Array:
        """Mueller matrices as rows of 16.

        Parameters
        ----------
        columns : list of ndarray, each of N
            theta_i, theta_s, dphi [rad], wavelength [um], n, kappa.
        dressed : bool
            Whether s and p get phase and loss of the mean field, which takes most of the
            time and changes only elements of U and V.
        phi_i : ndarray of N, or float
            Azimuth of the source, where heights differ from direction to direction. [rad]

        Returns
        -------
        ndarray, shape (N, 16)
            1/sr; of a profile power per radian over incident power.
        """
        size = columns[0].size
        out = np.empty((size, 16))
        if not size:
            return out
        spreads = self._spreads(columns[3])
        self._check_facets(spreads, columns[3])
        self._warn_of_slopes(columns[3])
        self._warn_of_fine(columns[3])
        dressing = self._dressings(columns) if dressed else np.zeros((2, size), complex)
        moments = self._moments(2 * np.pi / columns[3].min())
        hidden = self.method.shadowed
        directional = isinstance(self.heights, Directional)
        plan = Plan(self._kernel, self.dimensions, hidden and not directional)
        height = self.heights.height_rms
        lateral = self._lateral(columns, phi_i)

        def fill_part(start: int) -> None:
            part = slice(start, start + CHUNK)
            pieces = [c[part] for c in columns]
            k = 2 * np.pi / pieces[3]
            rise, wave = normal_and_lateral(pieces)
            if lateral is not None:
                wave = lateral[part] / k
            given = np.stack([k * height, spreads[part] / k, spreads[part] * height])
            fill_scattering(
                np.stack(pieces[:3]), np.stack(pieces[4:]), given,
                moments(k, rise, wave, given), np.ascontiguousarray(dressing[:, part]),
                plan, out[part],
            )  # fmt: skip

        starts = range(0, size, CHUNK)
        if len(starts) == 1:
            fill_part(0)
        else:
            with ThreadPoolExecutor(available_cores()) as pool:
                list(pool.map(fill_part, starts))
        if hidden and isinstance(self.heights, Directional):
            self._hide(out, self.heights, columns, np.broadcast_to(phi_i, size))
        return out

    @property
    def _kernel(self) -> int:
        """Amplitude of an order, a code of `pbrdf.kernels.wave.scatter`."""
        kernel = self.method.kernel
        if kernel == CURVATURE and isinstance(self.heights, Directional):
            return ORDER_WEIGHTED
        return kernel

    def _hide(
        self, rows: Array, heights: Directional, columns: list[Array], phi_i: Array
    ) -> None:
        """Take from rows what surfaces of unequal directions hide."""
        for at in each_wavelength(columns[3]):
            limit = 4 * np.pi / float(columns[3][at[0]])
            theta_i, theta_s, dphi = (c[at] for c in columns[:3])
            slopes = (heights.slopes(limit, turn) for turn in (phi_i[at], phi_i[at] + dphi))
            rows[at] *= smith(theta_i, theta_s, dphi, *slopes)[:, None]

    def _lateral(self, columns: list[Array], phi_i: Array | float) -> Array | None:
        """Return what stands for K [rad/um], where heights know its direction."""
        if not isinstance(self.heights, Directional):
            return None
        theta_i, theta_s, dphi, wavelength = columns[:4]
        # Light travels away from the source and towards the detector
        out, into = np.sin(theta_s), np.sin(theta_i)
        k, phi_s = 2 * np.pi / wavelength, phi_i + dphi
        return self.heights.lateral(
            k * (out * np.cos(phi_s) + into * np.cos(phi_i)),
            k * (out * np.sin(phi_s) + into * np.sin(phi_i)),
        )

    def mean_jones(
        self, theta: Array, wavelength: Array, n: Array, kappa: Array, phi_i: Array
    ) -> Array:
        """Jones matrices of the mean field, shape (..., 2, 2)."""
        columns = theta, wavelength, n, kappa, phi_i
        return mean_jones(self.heights, self.dimensions, self.method.mean_field, columns)

    def slopes(self, wavelength: Array) -> Array:
        """Rms slope of the heights that a wave can resolve, of each wavelength. [1]"""
        return self._spreads(wavelength) * self.heights.height_rms

    def fineness(self, wavelength: Array) -> Array:
        """Wave number times variance times the mean wave vector of what is finer. [1]"""
        fineness = np.empty(wavelength.size)
        for rows in each_wavelength(wavelength):
            k = 2 * np.pi / float(wavelength[rows[0]])
            fineness[rows] = k * self.heights.fine(k, self.dimensions)
        return fineness * self.heights.height_rms**2

    def _spreads(self, wavelength: Array) -> Array:
        """Rms wave vector per axis of the heights that a wave can resolve. [rad/um]"""
        spreads = np.empty(wavelength.size)
        for rows in each_wavelength(wavelength):
            limit = 4 * np.pi / float(wavelength[rows[0]])
            spreads[rows] = self.heights.spread(limit, self.dimensions)
        return spreads

    def _check_facets(self, spreads: Array, wavelength: Array) -> None:
        """Refuse facets where no roughness is coarse enough to tilt one."""
        if self.method.orders == "slopes" and not spreads.min() > 0.0:
            msg = (
                f"method {self.name!r} must have roughness coarser than half the "
                f"wavelength, got none at {wavelength[spreads.argmin()]:g} um. Take 'auto'."
            )
            raise ValueError(msg)

    def steepest(self, wavelength: Array) -> float:
        """Rms slope along the steepest azimuth, by the shortest wave. [1]"""
        shortest = wavelength.min()
        if isinstance(self.heights, Directional):
            axes = np.array([0.0, 0.5 * np.pi])
            return float(self.heights.slopes(4 * np.pi / shortest, axes).max())
        return float(self.slopes(np.array([shortest]))[0])

    def _warn_of_fine(self, wavelength: Array) -> None:
        """Say that roughness finer than the wave is too high for the forms."""
        if self.name not in SLOPED or isinstance(self.heights, Directional):
            return
        shortest = wavelength.min()
        fine = float(self.fineness(np.array([shortest]))[0])
        if fine > FINEST:
            warnings.warn(
                f"Roughness finer than the wavelength of {shortest:g} um is high: the "
                f"error may be {min(OF_FINE * fine, MOST):.2g} dB or more (see "
                "error_estimate).",
                AccuracyWarning, stacklevel=4,
            )  # fmt: skip

    def _warn_of_slopes(self, wavelength: Array) -> None:
        """Say that second bounces are missing where the surface is steep."""
        if self.name not in SLOPED:
            return
        steepest = self.steepest(wavelength)
        if steepest > STEEPEST:
            warnings.warn(
                f"The rms slope {steepest:.3g} exceeds {STEEPEST}: the light of second and "
                "later bounces, 5 % of the power or more, is missing. simulate has it.",
                AccuracyWarning, stacklevel=4,
            )  # fmt: skip

    def _moments(self, largest_k: float) -> Moments:
        """Give the function of (k, q/k, K/k, statistics) that sums over the orders."""
        heights, dimensions = self.heights, self.dimensions
        if self.method.orders == "slopes":
            return lambda _k, rise, wave, given: slope_moments(
                rise, wave, given[2], dimensions
            )
        if self.method.orders == "first":
            return lambda k, rise, wave, _given: np.tile(
                rise**2 * heights.spectrum(wave * k, dimensions) * k ** (2 + dimensions),
                (5, 1),
            )
        if heights.law is not None:
            law, length = heights.law, heights.corr_length

            def in_closed_form(k: Array, rise: Array, wave: Array, given: Array) -> Array:
                out = np.empty((5, k.size))
                fill_moments(law, dimensions, given[0], k * length, wave, rise, out)
                return out

            return in_closed_form
        if self._table is None or self._table.largest_wave < 2 * largest_k:
            largest_rise = 2 * largest_k * heights.height_rms
            self._table = OrderTable(heights, dimensions, largest_rise, 2 * largest_k)
        table = self._table
        return lambda k, rise, wave, given: (
            table.moments(rise * given[0], wave * k) * k**dimensions
        )

    def _dressings(self, columns: list[Array]) -> Array:
        """Logarithms of what the ways in and out leave of E_s E_p*, (2, N)."""
        found = np.zeros((2, columns[0].size), dtype=np.complex128)
        if self.name != "auto" or isinstance(self.heights, Directional):
            return found
        for rows in each_wavelength(columns[3]):
            wave, n, kappa = (float(c[rows[0]]) for c in columns[3:])
            for side in (0, 1):
                found[side, rows] = self._dressing.at(columns[side][rows], wave, n, kappa)
        return found


def each_wavelength(wavelength: Array) -> list[Array]:
    """Rows of each wavelength; mostly it is one, which is seen without sorting."""
    if (wavelength == wavelength[0]).all():
        return [np.arange(wavelength.size)]
    order = np.argsort(wavelength, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(wavelength[order])) + 1)


def normal_and_lateral(columns: list[Array]) -> tuple[Array, Array]:
    """Return the normal part q/k and the lateral part K/k that the surface adds."""
    theta_i, theta_s, dphi = columns[:3]
    sin_i, sin_s = np.sin(theta_i), np.sin(theta_s)
    # |k_s - k_i| as a sum of squares, which costs no digits near the specular beam
    half = np.cos(0.5 * dphi)
    wave = np.sqrt((sin_s - sin_i) ** 2 + 4.0 * sin_i * sin_s * half**2)
    return np.cos(theta_i) + np.cos(theta_s), wave


def slope_moments(rise: Array, wave: Array, slope: Array, dimensions: int) -> Array:
    """Moments whose order zero is the density of mirroring slopes."""
    density = np.exp(-0.5 * (wave / (rise * slope)) ** 2)
    if dimensions == 1:
        total = np.sqrt(2 * np.pi) * density / (slope * rise)
    else:
        total = 2 * np.pi * density / (slope * rise) ** 2
    moments = np.zeros((5, total.size))
    moments[2] = total
    return moments


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
