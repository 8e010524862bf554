"""Moments over the orders for an autocorrelation of any form, tabulated once per surface.

    sum_n e^{-g} g^n/n! n^-j W_n(K) = Int e^{-iKx} e^{-g} E_j(g rho(x)) dx,

E_j(x) = sum x^n/(n! n^j). Order 1 is the spectrum itself and is added exactly; the rest is
transformed on a grid of q h and K and interpolated.
"""

import numpy as np
from scipy import interpolate, special

from pbrdf.wave.statistics import Statistics, panels

__all__ = ["OrderTable"]

Array = np.ndarray

POWERS = (-2, -1, 0, 1, 2)
# Above this argument the functions E_j have their asymptotic series, below it the sum
LARGE = 32.0
ASYMPTOTIC_TERMS = 24
SERIES_TERMS = 130
# Part of the largest term below which the rest of a sum is rounding
NO_MORE = 1e-18
# Smallest share of a peak that is kept: what lies below is rounding of the transform
FLOOR = 1e-13
RISES, WAVES = 64, 220
# Panels of lags in a table, which bounds memory to some 0.2 GB
MOST_PANELS = 8000
# Points of a spectrum that carry it on below the noise
PARABOLA = 4
# Least and largest q h over the rises of a table
LEAST_RISE = 1e-3


def scaled_sums(x: Array, g: float) -> list[Array]:
    """Exp(-g) (E_j(x) - x) for j = -2 to 2 and |x| <= g.

    Below -LARGE only powers of a logarithm remain, times exp(-g): nothing.
    """
    few = np.clip(x, -LARGE, LARGE)
    sums = [np.zeros_like(x) for _ in POWERS]
    term = few * np.exp(-g)
    largest = float(np.abs(few).max(initial=0.0))
    size, most = 1.0, 0.0
    for n in range(2, SERIES_TERMS):
        size *= largest / n
        most = max(most, size)
        if size < NO_MORE * most:
            break
        term = term * few / n
        for total, power in zip(sums, POWERS, strict=True):
            total += term / float(n) ** power
    many = x > LARGE
    if many.any():
        big, first = x[many], x[many] * np.exp(-g)
        scale = np.exp(big - g)
        falling, steep = np.zeros_like(big), np.zeros_like(big)
        a, b = 1.0, 0.0
        for k in range(1, ASYMPTOTIC_TERMS):
            # a_k = (k-1)!, b_(k+1) = a_k + k b_k
            falling += a / big**k
            steep += b / big**k
            a, b = a * k, a + k * b
        for total, value in zip(
            sums, (big**2 + big, big, 1.0, falling, steep), strict=True
        ):
            total[many] = scale * value - first
    sums = [np.where(x < -LARGE, 0.0, total) for total in sums]
    return sums


def above_noise(row: Array, steps: Array) -> Array:
    """Logarithm of a spectrum, carried on as a parabola where it sinks into rounding.

    No spectrum is negative: negative values tell how large the noise is.
    """
    floor = max(FLOOR, 30.0 * max(-row.min(), 0.0))
    sunk = np.flatnonzero(row < floor)
    logs = np.log(np.maximum(row, FLOOR))
    if not sunk.size or sunk[0] < PARABOLA:
        return logs
    end = sunk[0]
    last = slice(end - PARABOLA, end)
    curve = np.polyfit(steps[last] - steps[end - 1], logs[last], 2)
    curve[0] = min(curve[0], 0.0)
    beyond = np.polyval(curve, steps[end:] - steps[end - 1])
    logs[end:] = np.minimum(beyond, logs[end - 1])
    return logs


class OrderTable:
    """Moments of the orders above the first on a grid of q h and K.

    Parameters
    ----------
    statistics : Statistics
        The heights.
    dimensions : int
        1 for a profile, 2 for an isotropic surface.
    largest_rise : float
        Largest q h that will be asked. [1]
    largest_wave : float
        Largest K that will be asked. [rad/um]
    """

    def __init__(
        self,
        statistics: Statistics,
        dimensions: int,
        largest_rise: float,
        largest_wave: float,
    ) -> None:
        self.statistics, self.dimensions = statistics, dimensions
        self.largest_rise, self.largest_wave = largest_rise, largest_wave
        length = self.statistics.corr_length
        far = self.statistics.farthest_lag
        steps = max(int(np.ceil(far * self.largest_wave / (3 * np.pi))), 24)
        if steps > MOST_PANELS:
            msg = (
                "the autocorrelation must fall within "
                f"{far * MOST_PANELS / steps:.4g} um at waves of "
                f"{4 * np.pi / self.largest_wave:.3g} um, got {far:.4g} um: sums over "
                "orders would take minutes and gigabytes. Take method='first-order', or a "
                "statement of the heights over the lengths that matter."
            )
            raise ValueError(msg)
        edges = np.unique(
            np.r_[0.0, np.geomspace(1e-4 * length, far, 40), np.linspace(0, far, steps)]
        )
        lag, weight = panels(edges, 12)
        rho = self.statistics.correlation(lag)
        top = np.arcsinh(2.0 * self.largest_wave * length)
        wave_steps = np.linspace(0.0, top, WAVES)
        wave = np.sinh(wave_steps) / (2.0 * length)
        if self.dimensions == 1:
            transform = 2.0 * np.cos(np.outer(lag, wave)) * weight[:, None]
        else:
            transform = (
                special.j0(np.outer(lag, wave)) * (2 * np.pi * lag * weight)[:, None]
            )
        rises = np.geomspace(LEAST_RISE, max(self.largest_rise, 1.0) * 1.0001, RISES)
        tables = np.empty((len(POWERS), RISES, WAVES))
        scales = np.empty((len(POWERS), RISES))
        for i, rise in enumerate(rises):
            g = rise * rise
            rows = np.array(scaled_sums(g * rho, g)) @ transform
            scales[:, i] = rows.max(axis=1)
            tables[:, i] = [
                above_noise(row / scale, wave_steps)
                for row, scale in zip(rows, scales[:, i], strict=True)
            ]
        splines = [
            interpolate.RectBivariateSpline(np.log(rises), wave_steps, table)
            for table in tables
        ]
        heights = [
            interpolate.CubicSpline(np.log(rises), np.log(scale)) for scale in scales
        ]
        self._splines = splines
        self._scales = heights

    def moments(self, rise: Array, wave: Array) -> Array:
        """Moments of n^2, n, 1, 1/n, 1/n^2 at q h [1] and K [rad/um], in um^dimensions."""
        g = rise * rise
        height2 = self.statistics.height_rms**2
        first = g * np.exp(-g) * self.statistics.spectrum(wave, self.dimensions) / height2
        # Below the grid order 2 is all there is besides the first
        inside = np.maximum(rise, LEAST_RISE)
        u, v = np.log(inside), np.arcsinh(2.0 * wave * self.statistics.corr_length)
        fall = (rise / inside) ** 4
        out = np.empty((len(POWERS), rise.size))
        for row, spline, scale in zip(out, self._splines, self._scales, strict=True):
            share = np.exp(spline.ev(u, v))
            row[:] = first + fall * np.exp(scale(u)) * np.where(
                share > 2 * FLOOR, share, 0.0
            )
        return out
