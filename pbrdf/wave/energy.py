"""Where the light goes: the mean field, the rest of the reflection, and what goes below."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

__all__ = ["Energy", "account", "hemisphere"]

Array = np.ndarray

# Nodes in each panel of zenith or azimuth
PANEL_NODES = 10


@dataclass(frozen=True, kw_only=True)
class Energy:
    """Shares of unpolarised incident power; arrays where incidence or wavelength is one.

    Parameters
    ----------
    coherent : ndarray
        In the specular beam of the mean field. [1]
    incoherent : ndarray
        Scattered over the hemisphere. [1]
    below : ndarray
        Absorbed or transmitted. [1]
    multiple : ndarray
        Part of the reflection that single scattering does not account for; nonzero only
        where nothing can go below, and else counted in `below`. Negative where single
        scattering has too much light. [1]
    """

    coherent: Array
    incoherent: Array
    below: Array
    multiple: Array


def account(coherent: Array, incoherent: Array, perfect: Array) -> Energy:
    """Put down what is left of the incident power."""
    rest = 1.0 - coherent - incoherent
    return Energy(
        coherent=coherent,
        incoherent=incoherent,
        below=np.where(perfect, 0.0, rest),
        multiple=np.where(perfect, rest, 0.0),
    )


def split_zenith(theta: float, width: float) -> Array:
    """Edges of panels that resolve a lobe of some width about an angle."""
    steps = width * np.array([0.0, 0.5, 1.0, 2.0, 3.0, 4.5, 6.5])
    edges = np.r_[theta - steps, theta + steps, 0.0, np.pi / 2]
    edges = np.r_[edges, np.linspace(0.0, np.pi / 2, 9)]
    return np.unique(np.clip(edges, 0.0, np.pi / 2))


def panel_nodes(edges: Array) -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights of all panels."""
    x, w = np.polynomial.legendre.leggauss(PANEL_NODES)
    half = 0.5 * np.diff(edges)[:, None]
    return (edges[:-1, None] + half * (x + 1.0)).ravel(), (half * w).ravel()


def hemisphere(
    theta_i: float, width: float, brdf: Callable[[Array, Array], Array]
) -> float:
    """Integral of f_r cos(theta_s) over the hemisphere about a lobe.

    `brdf(theta_s, dphi)` gives M00 [1/sr]; `width` is the least width of the lobe [rad].
    """
    zenith, weight = panel_nodes(split_zenith(theta_i, width))
    # Azimuths from the forward direction, as narrow as the lobe is seen from the zenith
    narrow = min(width / max(np.sin(theta_i), width), 1.0)
    edges = np.unique(np.r_[np.pi * narrow * np.array([0, 0.3, 1.0]), np.pi])
    edges = np.unique(np.r_[edges, np.linspace(0, np.pi, 5)])
    turn, step = panel_nodes(edges)
    values = brdf(zenith[:, None], np.pi - turn)
    projected = weight * np.cos(zenith) * np.sin(zenith)
    # Both sides of the plane of incidence
    return float(2.0 * (values @ step) @ projected)
