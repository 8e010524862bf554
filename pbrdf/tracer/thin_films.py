"""Films that absorb and are thin: the waves of a flat one, which the tracer leaves out."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pbrdf.kernels.optics.absorbing import interface_elements
from pbrdf.optics.materials import Material
from pbrdf.validity.contaminants import ABSORBS, DEEP_ENOUGH

__all__ = ["coherent_reflectance", "incoherent_reflectance", "thin_absorber_warnings"]

Index = tuple[float, float]


def incoherent_reflectance(
    theta: float, film: Index, base: Index, thickness: float, wavelength: float
) -> float:
    """Reflectance for unpolarised light of a flat film as it is traced: sum of powers.

    `film` and `base` are (n, kappa); lengths in um.
    """
    outer = interface_elements(np.cos(theta), 1.0, 1.0, 0.0, *film)
    normal = _normal(theta, film)
    index = np.hypot(np.sin(theta), normal.real)
    inner = interface_elements(normal.real / index, index, *film, *base)
    both = np.exp(-8 * np.pi / wavelength * normal.imag * thickness)
    total = 0.0
    for sign in (1, -1):
        once, below = outer[0] + sign * outer[1], inner[0] + sign * inner[1]
        inside = (1.0 - once) ** 2 * below * both / (1.0 - once * below * both)
        total += 0.5 * (once + inside)
    return float(total)


def coherent_reflectance(
    theta: float, film: Index, base: Index, thickness: float, wavelength: float
) -> float:
    """Reflectance for unpolarised light of a flat film by its waves, after Airy."""
    above, inside = _normal(theta, (1.0, 0.0)), _normal(theta, film)
    phase = np.exp(4j * np.pi / wavelength * inside * thickness)
    below = inside if np.isinf(base[0]) else _normal(theta, base)
    total = 0.0
    # Admittances q of s and N²/q of p; a perfect mirror shorts both
    for power in (0, 1):
        one, film_side, base_side = (
            q if power == 0 else complex(*index) ** 2 / q
            for q, index in ((above, (1.0, 0.0)), (inside, film), (below, base))
        )
        outer = (one - film_side) / (one + film_side)
        inner = -1.0 + 0.0j
        if not np.isinf(base[0]):
            inner = (film_side - base_side) / (film_side + base_side)
        total += 0.5 * abs((outer + inner * phase) / (1.0 + outer * inner * phase)) ** 2
    return float(total)


def thin_absorber_warnings(
    reports: Sequence[Mapping[str, Any]],
    coverings: Sequence[Material],
    substrate: Sequence[Material],
    theta_i: np.ndarray,
    waves: np.ndarray | None,
) -> list[str]:
    """Say where a film absorbs so much and is so thin that its waves overlap.

    Parameters
    ----------
    reports : sequence of mappings
        What each contaminant became.
    coverings : sequence of Material
        Their materials.
    substrate : sequence of Material
        Materials of the ground.
    theta_i : ndarray
        Zenith angles of the source. [rad]
    waves : ndarray or None
        Wavelengths. [um]

    Returns
    -------
    list of str
        One sentence for each film and wavelength, with both reflectances.
    """
    found: list[str] = []
    for report, material in zip(reports, coverings, strict=True):
        thickness = report.get("thickness")
        if thickness is None or waves is None or material.has_base:
            continue
        for wave in np.atleast_1d(waves).tolist():
            film = material.index(wave)
            depth = 4.0 * np.pi * film[1] * thickness / wave
            if not (film[1] > ABSORBS and depth < DEEP_ENOUGH):
                continue
            pairs = [
                (
                    incoherent_reflectance(theta, film, base, thickness, wave),
                    coherent_reflectance(theta, film, base, thickness, wave),
                    theta,
                )
                for base in (ground.index(wave) for ground in substrate)
                for theta in theta_i.tolist()
            ]
            traced, waved, theta = max(pairs, key=lambda pair: abs(pair[0] - pair[1]))
            found.append(
                f"A film of {thickness:.3g} um with kappa {film[1]:.3g} at {wave:g} um has "
                f"an optical depth of {depth:.2g}: its waves overlap. Flat, at theta_i "
                f"{np.rad2deg(theta):.4g} deg, it reflects {traced:.4g} as traced and "
                f"{waved:.4g} by its waves; trust neither beyond their difference."
            )
    return found


def _normal(theta: float, index: Index) -> complex:
    """Find the normal part of the wave vector in a medium, in units of that in vacuum."""
    root = np.sqrt(complex(*index) ** 2 - np.sin(theta) ** 2 + 0j)
    return complex(-root if root.imag < 0.0 else root)
