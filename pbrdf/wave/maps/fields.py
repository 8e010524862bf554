"""What a map of heights does to the phase of a wave, as a whole and by orders.

A wave with normal part q takes the phase exp(-iqh). Its order n is the n-th power of the
heights less what they contract with themselves, :h^n:, with

    exp(-iqht + (qth)²/2) = sum_n (-iqt)^n :h^n: / n!,

the root mean square of the map standing for h in the second term. Divided by n, the orders
add up to an integral over t (the order-weighted kernel has one n-th of the way from tangent
plane to first order in order n).
"""

import numpy as np
import scipy.fft
from scipy import interpolate

from pbrdf.wave.statistics import panels

__all__ = ["Relief", "phase_orders"]

Array = np.ndarray

# Ends of the panels of t, in units of 1/(q h)² from 1, and nodes in one
ENDS, NODES = np.array([0.0, 0.5, 1.5, 3.5, 7.0, 15.0, 30.0, 60.0]), 16
# Heights between which the sum over orders is interpolated, to a radian of q h
PER_RADIAN, FEWEST = 24, 64


def phase_orders(heights: Array, q: float, height_rms: float) -> tuple[Array, Array]:
    """Phases exp(-iqh), and their orders from the first on, each over its number.

    Parameters
    ----------
    heights : ndarray
        Of the map, of mean zero. [um]
    q : float
        Normal part of the wave vector that the surface adds. [rad/um]
    height_rms : float
        Of the map. [um]
    """
    whole = np.exp(-1j * q * heights)
    g = (q * height_rms) ** 2
    ends = 1.0 - np.minimum(ENDS / max(g, 1e-300), 1.0)
    t, weight = panels(np.unique(ends), NODES)
    low, high = float(heights.min()), float(heights.max())
    count = max(int(np.ceil(q * (high - low) * PER_RADIAN)), FEWEST)
    steps = np.linspace(low, high, count) if high > low else np.array([low, low + 1e-9])
    rest = np.exp(-0.5 * g)
    at_t = np.exp(-1j * q * np.outer(steps, t) - 0.5 * g * (1.0 - t**2)) - rest
    curve = interpolate.CubicSpline(steps, at_t @ (weight / t))
    return whole, curve(heights)


class Relief:
    """Heights of a map without their mean, faded towards rims that do not close.

    Parameters
    ----------
    heights : ndarray, (nx, ny)
        [um]
    spacing : (dx, dy)
        [um]
    periodic : bool
        Whether opposite rims meet.
    """

    def __init__(self, heights: Array, spacing: Array, *, periodic: bool) -> None:
        self.heights = heights - heights.mean()
        self.spacing = spacing
        self.fade = _fade(heights.shape, periodic)
        self.height_rms = float(self.heights.std())

    def gradients(self, limit: float) -> Array:
        """Covariance of the slopes along x and y of waves up to `limit` [rad/um]. [1]"""
        count = self.heights.size
        axes = [
            2 * np.pi * scipy.fft.fftfreq(n, step)
            for n, step in zip(self.heights.shape, self.spacing, strict=True)
        ]
        east, north = axes[0][:, None], axes[1][None, :]
        power = np.abs(scipy.fft.fft2(self.heights * self.fade) / count) ** 2
        power = np.where(east**2 + north**2 <= limit**2, power, 0.0)
        xx, xy, yy = (
            float((power * part).sum()) for part in (east**2, east * north, north**2)
        )
        return np.array([[xx, xy], [xy, yy]])


def _fade(shape: tuple[int, ...], periodic: bool) -> Array:
    """Weights of the map: Hann's window unless it is periodic; mean square 1."""
    if periodic:
        return np.ones(shape)
    axes = [np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2 for n in shape]
    window = np.outer(*axes)
    return window / np.sqrt(np.mean(window**2))
