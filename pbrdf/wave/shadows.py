"""Smith's hiding where slopes differ from direction to direction."""

import numpy as np
from scipy import special

from pbrdf.wave.directional import Directional

__all__ = ["smith"]

Array = np.ndarray


def smith(
    heights: Directional, theta_i: Array, theta_s: Array, dphi: Array, phi_i: Array,
    limit: float,
) -> Array:  # fmt: skip
    """Share of the facets that see both source and detector, (N,).

    Hidings are fully dependent at one azimuth and independent at the opposite; between them
    stands the weight of van Ginneken et al., Appl. Opt. 37, 130 (1998). Each way has the
    slope along its own azimuth.

    Parameters
    ----------
    heights : Directional
        The heights.
    theta_i, theta_s, dphi, phi_i : ndarray, (N,)
        Directions to source and detector. [rad]
    limit : float
        Largest lateral wave vector of the components that hide. [rad/um]
    """
    one = _overhang(theta_i, heights.slopes(limit, phi_i))
    other = _overhang(theta_s, heights.slopes(limit, phi_i + dphi))
    apart = np.abs(np.arctan2(np.sin(dphi), np.cos(dphi)))
    weight = apart * (1.0 + 4.41 * np.pi) / (np.pi * (1.0 + 4.41 * apart))
    return 1.0 / (1.0 + np.maximum(one, other) + weight * np.minimum(one, other))


def _overhang(theta: Array, slope: Array) -> Array:
    """Smith's Lambda of Gaussian slopes."""
    nu = np.cos(theta) / (np.sqrt(2.0) * slope * np.sin(theta) + 1e-300)
    nu = np.clip(nu, 1e-12, 25.0)
    bare = np.exp(-(nu**2)) / (nu * np.sqrt(np.pi)) - special.erfc(nu)
    return np.maximum(0.5 * bare, 0.0)
