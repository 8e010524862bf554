"""Local curvature correction of profiles, averaged over Gaussian heights.

The amplitude Int dx exp(-iKx - iqh) [b_KA - i q h_d], with h_d the heights filtered by the
change d of the kernel, has the second moment

    Int dx cos(Kx) { e^{-q^2 (h^2 - C)} [F_i F_j* + q^2 DD_ij] - e^{-q^2 h^2} F0_i F0_j* }

(T. Elfouhaily, C.-A. Guerin, Waves in Random Media 14, R1 (2004); the moment is a Gaussian
identity). Its part of first order in the heights is taken out and added exactly.
"""

import numpy as np

from pbrdf.kernels.wave.profile import fill_changes, fill_profile
from pbrdf.wave.statistics import Statistics, panels

__all__ = ["profile_curvature"]

Array = np.ndarray

# Geometries at a time, which bounds the memory
CHUNK = 64
# Pairs of polarisations: ss, pp, sp
PAIRS = ((0, 0), (1, 1), (0, 1))


def profile_curvature(columns: list[Array], heights: Statistics) -> Array:
    """Power per radian of s and p, Re and Im of their interference, (N, 4). [1/rad]

    Parameters
    ----------
    columns : list of ndarray
        theta_i, theta_s, dphi (0 or pi), wavelength [um], n, kappa.
    heights : Statistics
        Of the profile.
    """
    out = np.empty((columns[0].size, 4))
    waves = columns[3]
    for wavelength in np.unique(waves):
        rows = np.flatnonzero(waves == wavelength)
        k = 2 * np.pi / wavelength
        grids = _grids(heights, k)
        slope = heights.height_rms * heights.spread(2 * k, 1)
        for start in range(0, rows.size, CHUNK):
            part = rows[start : start + CHUNK]
            pieces = [c[part] for c in columns]
            out[part] = _scattered(pieces, heights, k, slope, grids)
    return out


def _grids(heights: Statistics, k: float) -> tuple[Array, ...]:
    """Shifts xi with the weights W dxi/2pi, lags x with weights, and cos(xi x); k = 1."""
    length, far = heights.corr_length, heights.farthest_lag
    top = 13.0 / length if heights.bounded else 30.0 / length + 8.0 * k
    edges = np.r_[0.0, np.geomspace(0.3 / length, top, 9)]
    if not heights.bounded:
        edges = np.unique(np.r_[edges, np.geomspace(1 / far, top, 24)])
    shift, weight = panels(edges, 16)
    density = heights.spectrum(shift, 1) * weight / np.pi
    oscillations = max(int(np.ceil(far * max(2 * k, 8.0 / length) / (2 * np.pi))), 12)
    lags = np.r_[
        0.0, np.geomspace(1e-3 * length, far, 24), np.linspace(0, far, oscillations)
    ]
    lag, step = panels(np.unique(lags), 10)
    return (
        shift / k, density * k**2, lag * k, step * k, np.cos(np.outer(lag, shift)),
        heights.correlation(lag) * (k * heights.height_rms) ** 2,
    )  # fmt: skip


def _scattered(
    pieces: list[Array], heights: Statistics, k: float, slope: float,
    grids: tuple[Array, ...],
) -> Array:  # fmt: skip
    """Rows of one wavelength; lengths in units of 1/k."""
    theta_i, theta_s, dphi, _, n, kappa = pieces
    shift, density, lag, step, waves, covariance = grids
    into = np.sin(theta_i)
    away = np.where(np.cos(dphi) < 0, 1.0, -1.0) * np.sin(theta_s)
    indices = np.stack([n, kappa])
    kernels = np.empty((into.size, 4), dtype=np.complex128)
    shadow = np.empty(into.size)
    fill_profile(into, away, indices, np.full(into.size, slope), kernels, shadow)
    changes = np.empty((into.size, shift.size, 2), dtype=np.complex128)
    shifts = np.broadcast_to(shift, changes.shape[:2]).copy()
    fill_changes(into, away, indices, shifts, changes)

    rise, across = np.cos(theta_i) + np.cos(theta_s), away - into
    q2, variance = rise**2, (k * heights.height_rms) ** 2
    plane, change = kernels[:, 2:], kernels[:, :2] - kernels[:, 2:]
    weighted = changes * density[:, None]
    # D(0), D(x) of both polarisations
    still = weighted.sum(axis=1)
    filtered = np.einsum("xs,nsi->xni", waves, weighted, optimize=True)
    calm = np.exp(-q2 * variance)
    rough = np.exp(-q2 * (variance - covariance[:, None]))
    base = plane - q2[:, None] * still
    moving = base + q2[:, None] * filtered
    oscillation = 2.0 * step[:, None] * np.cos(np.outer(lag, across))
    first = calm * q2 * heights.spectrum(np.abs(across) * k, 1) * k**3
    factor = 2.0 / np.pi * np.cos(theta_s) ** 2 * np.cos(theta_i) / q2 * shadow

    out = np.empty((into.size, 4))
    for column, (i, j) in enumerate(PAIRS):
        pair = weighted[..., i] * changes[..., j].conj()
        both = (waves @ pair.T) * q2
        cross = base[:, i] * filtered[..., j].conj() + filtered[..., i] * base[:, j].conj()
        still_pair = base[:, i] * base[:, j].conj()
        linear = calm * (q2 * covariance[:, None] * still_pair + q2 * cross + both)
        rest = rough * (moving[..., i] * moving[..., j].conj() + both)
        rest -= calm * still_pair + linear
        whole = first * (base + change)[:, i] * (base + change)[:, j].conj()
        total = factor * ((oscillation * rest).sum(axis=0) + whole)
        out[:, column] = total.real
        if i != j:
            out[:, 3] = total.imag
    return _realisable(out)


def _realisable(four: Array) -> Array:
    """Cut what the quadrature leaves below zero or above full coherence."""
    four[:, :2] = np.maximum(four[:, :2], 0.0)
    most = np.sqrt(four[:, 0] * four[:, 1])
    found = np.hypot(four[:, 2], four[:, 3])
    four[:, 2:] *= np.minimum(1.0, most / np.maximum(found, 1e-300))[:, None]
    return four
