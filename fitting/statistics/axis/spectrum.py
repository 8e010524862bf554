"""Power spectrum of profiles and maps, and slope against cut-off wavelength."""

from dataclasses import dataclass

import numpy as np
from scipy import fft

from fitting.estimate import Estimate

Array = np.ndarray


@dataclass(frozen=True)
class PowerSpectrum:
    """One-dimensional power spectrum along an axis.

    Parameters
    ----------
    frequency : ndarray, shape (n,)
        Cycles per length, above zero. [1/um]
    psd_1d : ndarray, shape (n,)
        One-sided: its sum times the frequency step is the height variance; no 2 pi. [um³]
    model : ndarray, shape (n,)
        The fitted autocorrelation's spectrum plus the noise floor. [um³]
    noise : float
        One-sided noise floor. [um³]
    """

    frequency: Array
    psd_1d: Array
    model: Array
    noise: float


@dataclass(frozen=True)
class SlopeBands:
    """Slope rms of wavelengths longer than each cut-off.

    Parameters
    ----------
    cutoff : ndarray, shape (n,)
        Shortest wavelength counted. [um]
    slope_rms : list of Estimate
        Per axis, from the fitted form. [1]
    measured : ndarray of bool, shape (n,)
        False where the cut-off lies beyond what noise and spacing let the data say: there
        the fitted form is extrapolated.
    """

    cutoff: Array
    slope_rms: list[Estimate]
    measured: Array


def line_spectrum(lines: Array, spacing: float) -> tuple[Array, Array]:
    """One-sided spectrum averaged over lines (last axis along the line), Hann window.

    Parameters
    ----------
    lines : ndarray, shape (n_lines, n)
        Residual heights; lines with missing points are left out unless all have some, in
        which case gaps count as zero height. [um]
    spacing : float
        [um]

    Returns
    -------
    frequency, psd : ndarray
        [1/um], [um³]

    Examples
    --------
    A sine of amplitude 2 um carries a variance of 2 um²:

    >>> x = np.arange(1000) * 0.5
    >>> f, psd = line_spectrum(2 * np.sin(2 * np.pi * x / 10)[None, :], 0.5)
    >>> round(float(psd.sum() * (f[1] - f[0])), 6)
    2.0
    """
    n = lines.shape[1]
    known = np.isfinite(lines)
    whole = known.all(axis=1)
    if whole.any():
        used, mask = lines[whole], np.ones((1, n))
    else:
        used, mask = np.where(known, lines, 0.0), known.astype(float)
    window = np.hanning(n + 2)[1:-1]
    power = np.zeros(n // 2 + 1)
    block = max(1, 4_000_000 // n)
    for start in range(0, used.shape[0], block):
        transform = fft.rfft(used[start : start + block] * window, axis=1)
        power += np.sum(transform.real**2 + transform.imag**2, axis=0)
    weight = np.mean(np.sum((mask * window) ** 2, axis=1))
    psd = 2 * power / used.shape[0] * spacing / weight
    return fft.rfftfreq(n, spacing)[1:], psd[1:]


def measured_cutoff(
    spectrum_at: "np.ufunc | object", noise: float, spacing: float, corr_length: float
) -> float:
    """Shortest wavelength at which the surface stands above noise and sampling. [um]

    Parameters
    ----------
    spectrum_at : callable
        Two-sided spectrum of the heights against frequency. [um³]
    noise : float
        Variance of noise and rounding on each height. [um²]
    spacing, corr_length : float
        [um]
    """
    nyquist = 0.5 / spacing
    if noise <= 0:
        return 1 / nyquist
    lowest = min(0.05 / corr_length, nyquist / 2)
    f = np.geomspace(lowest, nyquist, 600)
    below = spectrum_at(f) < noise * spacing  # type: ignore[operator]
    return float(1 / f[np.argmax(below)]) if below.any() else 1 / nyquist
