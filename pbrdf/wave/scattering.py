"""Scattering and mean field of one kind of roughness, for arrays of geometries."""

import os
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache, partial

import numpy as np

from pbrdf.errors import AccuracyWarning
from pbrdf.kernels.wave import orders
from pbrdf.kernels.wave.orders import fill_moments
from pbrdf.kernels.wave.scatter import Plan, fill_scattering
from pbrdf.wave.coherent import MeanField, Medium, mean_field
from pbrdf.wave.directional import Directional
from pbrdf.wave.methods import method_of
from pbrdf.wave.order_table import OrderTable
from pbrdf.wave.statistics import Exponential, Gaussian, Statistics

__all__ = ["Scattering"]

Array = np.ndarray
Moments = Callable[[Array, Array, Array, Array], Array]

# Below this many matrices a thread costs more than it saves
CHUNK = 4096
# Steeper surfaces send part of the light to a second bounce, which no form here has
STEEPEST = 0.45
SLOPED = ("auto", "order-weighted", "local-curvature")
# Zeniths at which the phase of the mean field is found; it is smooth between them
PHASE_ZENITHS = np.r_[np.linspace(0.0, 0.5 * np.pi, 19)[:-1], np.deg2rad(89.5)]
# Heights that are told by height and length alone
LAWS = {orders.GAUSSIAN: Gaussian, orders.EXPONENTIAL: Exponential}
# The mean field of grazing incidence proper is that of a mirror
LARGEST_SINE = 1.0 - 1e-12


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
        self._phases: dict[tuple[float, float, float], Array] = {}

    def matrices(
        self, columns: list[Array], *, retarded: bool = True, phi_i: Array | float = 0.0
    ) -> Array:
        """Mueller matrices as rows of 16.

        Parameters
        ----------
        columns : list of ndarray, each of N
            theta_i, theta_s, dphi [rad], wavelength [um], n, kappa.
        retarded : bool
            Whether s and p get the phase of the mean field, which takes most of the time
            and changes only elements of U and V.
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
        self._warn_of_slopes(spreads)
        phases = self._retardance(columns) if retarded else np.zeros((2, size))
        moments = self._moments(2 * np.pi / columns[3].min())
        plan = Plan(self.method.kernel, self.dimensions, self.method.shadowed)
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
                moments(k, rise, wave, given), np.ascontiguousarray(phases[:, part]),
                plan, out[part],
            )  # fmt: skip

        starts = range(0, size, CHUNK)
        if len(starts) == 1:
            fill_part(0)
        else:
            with ThreadPoolExecutor(available_cores()) as pool:
                list(pool.map(fill_part, starts))
        return out

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

    def mean_amplitudes(
        self, theta: Array, wavelength: Array, n: Array, kappa: Array
    ) -> Array:
        """Reflection amplitudes (s, p) of the mean field, shape (..., 2)."""
        columns = np.broadcast_arrays(theta, wavelength, n, kappa)
        out = np.zeros((*columns[0].shape, 2), dtype=np.complex128)
        if self.method.mean_field == "none":
            return out
        for at in np.ndindex(columns[0].shape):
            angle, *given = (float(c[at]) for c in columns)
            if self.method.mean_field == "kirchhoff" or isinstance(
                self.heights, Directional
            ):
                out[at] = self._kirchhoff(angle, *given)
            else:
                out[at] = self._mean(angle, *given).amplitudes
        return out

    def _mean(self, theta: float, wavelength: float, n: float, kappa: float) -> MeanField:
        """Mean field of one incidence and wavelength, to second order."""
        k = 2 * np.pi / wavelength
        unit = k ** (2 + self.dimensions)
        return mean_field(
            min(float(np.sin(theta)), LARGEST_SINE),
            Medium.of(n, kappa),
            k * self.heights.height_rms,
            k * self.heights.corr_length,
            lambda wave: self.heights.spectrum(wave * k, self.dimensions) * unit,
            dimensions=self.dimensions,
            bounded=self.heights.bounded,
        )

    def _kirchhoff(self, theta: float, wavelength: float, n: float, kappa: float) -> Array:
        """Fresnel times exp(-2 (k h cos theta)^2)."""
        cosine = float(np.cos(theta))
        height = 2 * np.pi / wavelength * self.heights.height_rms
        fall = np.exp(-2.0 * (height * cosine) ** 2)
        if np.isinf(n):
            return fall * np.array([-1.0, 1.0])
        eps = complex(n, kappa) ** 2
        inside = np.sqrt(eps - 1.0 + cosine**2)
        r_s = (cosine - inside) / (cosine + inside)
        return fall * np.array([r_s, (eps * cosine - inside) / (eps * cosine + inside)])

    def slopes(self, wavelength: Array) -> Array:
        """Rms slope of the heights that a wave can resolve, of each wavelength. [1]"""
        return self._spreads(wavelength) * self.heights.height_rms

    def _spreads(self, wavelength: Array) -> Array:
        """Rms wave vector per axis of the heights that a wave can resolve. [rad/um]"""
        found, where = np.unique(wavelength, return_inverse=True)
        limits = 4 * np.pi / found
        spreads = np.array([self.heights.spread(v, self.dimensions) for v in limits])
        return spreads[where.ravel()]

    def _warn_of_slopes(self, spreads: Array) -> None:
        """Say that second bounces are missing where the surface is steep."""
        steepest = spreads.max() * self.heights.height_rms
        if steepest > STEEPEST and self.name in SLOPED:
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

    def _retardance(self, columns: list[Array]) -> Array:
        """Phase of s over p that the mean field takes on its ways in and out, (2, N)."""
        phases = np.zeros((2, columns[0].size))
        if self.name != "auto":
            return phases
        kinds, where = np.unique(np.stack(columns[3:], axis=1), axis=0, return_inverse=True)
        for j, kind in enumerate(kinds):
            key = (float(kind[0]), float(kind[1]), float(kind[2]))
            if key not in self._phases:
                self._phases[key] = self._retardances(*key)
            rows = where.ravel() == j
            for side in (0, 1):
                zeniths = columns[side][rows]
                phases[side, rows] = np.interp(zeniths, PHASE_ZENITHS, self._phases[key])
        return phases

    def _retardances(self, wavelength: float, n: float, kappa: float) -> Array:
        """Phases at `PHASE_ZENITHS`, which go with the square of the height."""
        k, heights = 2 * np.pi / wavelength, self.heights
        if heights.law in LAWS:
            length = k * heights.corr_length
            unit = unit_retardances(heights.law, length, self.dimensions, n, kappa)
            return (k * heights.height_rms) ** 2 * unit
        means = [
            self._mean(float(zenith), wavelength, n, kappa) for zenith in PHASE_ZENITHS
        ]
        return np.array([mean.retardance for mean in means])


@lru_cache(maxsize=4096)
def unit_retardances(
    law: int,
    length: float,
    dimensions: int,
    n: float,
    kappa: float,
) -> Array:
    """Phases at `PHASE_ZENITHS` over (k h)², of heights of length k l."""
    heights = LAWS[law](1.0, length)
    means = (
        mean_field(
            min(float(np.sin(zenith)), LARGEST_SINE), Medium.of(n, kappa), 1.0, length,
            partial(heights.spectrum, dimensions=dimensions), dimensions=dimensions,
            bounded=heights.bounded,
        )
        for zenith in PHASE_ZENITHS
    )  # fmt: skip
    return np.array([mean.retardance for mean in means])


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
