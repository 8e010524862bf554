"""Smith's hiding by Gaussian slopes, each way with its own."""

import numpy as np
from scipy import special

__all__ = ["smith"]

Array = np.ndarray


def smith(
    theta_i: Array, theta_s: Array, dphi: Array, slope_i: Array | float,
    slope_s: Array | float,
) -> Array:  # fmt: skip
    """Share of the facets that see both source and detector, (N,).

    Hidings are fully dependent at one azimuth and independent at the opposite; between them
    stands the weight of van Ginneken et al., Appl. Opt. 37, 130 (1998).

    Parameters
    ----------
    theta_i, theta_s, dphi : ndarray, (N,)
        Directions to source and detector. [rad]
    slope_i, slope_s : ndarray or float
        Rms slope along the azimuth of either. [1]
    """
    one, other = _overhang(theta_i, slope_i), _overhang(theta_s, slope_s)
    apart = np.abs(np.arctan2(np.sin(dphi), np.cos(dphi)))
    weight = apart * (1.0 + 4.41 * np.pi) / (np.pi * (1.0 + 4.41 * apart))
    return 1.0 / (1.0 + np.maximum(one, other) + weight * np.minimum(one, other))


def _overhang(theta: Array, slope: Array | float) -> Array:
    """Smith's Lambda of Gaussian slopes."""
    nu = np.cos(theta) / (np.sqrt(2.0) * slope * np.sin(theta) + 1e-300)
    nu = np.clip(nu, 1e-12, 25.0)
    bare = np.exp(-(nu**2)) / (nu * np.sqrt(np.pi)) - special.erfc(nu)
    return np.maximum(0.5 * bare, 0.0)
