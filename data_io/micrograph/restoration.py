"""Undo what camera and grain did to an edge: noise subtracted, blur divided out."""

from dataclasses import dataclass

import numpy as np
from scipy import fft, ndimage, special

# Frequencies are given up where blur leaves less than this part of an amplitude ...
MIN_TRANSFER = 0.2
# ... or where the spectrum no longer exceeds the noise by this many standard errors ...
MIN_SIGNIFICANCE = 4.0
MIN_SIGNAL_TO_NOISE = 0.3
# ... in one piece with what noise of that strength exceeds in so few cases
MAX_FALSE_ALARM = 1e-5


@dataclass(frozen=True, kw_only=True)
class Restored:
    """An edge as it was before the camera.

    Parameters
    ----------
    height : ndarray, shape (n,)
        Restored heights. [pixels]
    blur : float
        Standard deviation of the blur, pixel included. [pixels]
    noise_rms : float
        Noise of the heights before restoration. [pixels]
    cutoff : float
        Shortest wavelength kept. [pixels]
    slope_gain : float
        Slope rms with over without the blur divided out, noise left apart. [1]
    """

    height: np.ndarray
    blur: float
    noise_rms: float
    cutoff: float
    slope_gain: float


def restore(height: np.ndarray, grain: np.ndarray, step_width: float) -> Restored:
    """Give an edge the spectrum that it had before blur and grain.

    The measured spectrum is P = G² S + N, with G = exp(-k² σ² / 2) the transfer function of
    the blur along the edge and N the noise spectrum, measured on the grain beside the edge.
    Each cosine is multiplied by sqrt(1 - N / P) / G, which gives the expected spectrum S
    whatever its form: a Wiener filter would leave the slope too small, division by G alone
    too large.

    The width of the step through the edge holds, beside the blur, the heights that blur
    took away (Var z before less Var z after) and the noise: σ is found with both taken off.

    Parameters
    ----------
    height : ndarray, shape (n,)
        Evenly spaced heights without trend. [pixels]
    grain : ndarray, shape (2, n)
        Noise series of the two phases; the noise of the heights is half of each. [pixels]
    step_width : float
        Standard deviation of the mean step through the edge. [pixels]
    """
    n = height.size
    # A cosine series mirrors the edge at its ends, so that they need not meet
    amplitude = fft.dct(height, norm="ortho")
    wavenumber = np.pi * np.arange(n) / n
    power = _smooth_spectrum(amplitude**2)
    grain_power = (
        fft.dct(grain - grain.mean(axis=1, keepdims=True), norm="ortho", axis=1) ** 2
    )
    noise = ndimage.uniform_filter1d(grain_power.mean(axis=0), _noise_window(n))
    noise = noise * _excess(power, noise, wavenumber, step_width)
    noise = np.minimum(noise, power)
    noise_rms = float(np.sqrt(noise.mean()))
    blur = step_width
    for _ in range(20):
        gain = _gain(power, noise, wavenumber, blur)
        # Parseval: what the filter adds to the variance, noise left apart
        lost = (gain**2 * power - (power - noise))[gain > 0].sum() / n
        update = np.sqrt(max(step_width**2 - lost - noise_rms**2, 1 / 12))
        if abs(update - blur) < 1e-3:
            break
        blur = 0.5 * (blur + update)
    gain = _gain(power, noise, wavenumber, blur)
    kept = np.flatnonzero(gain)
    gain[0] = 1.0
    signal = np.where(gain > 0, power - noise, 0.0)
    slope_before = np.sum(wavenumber**2 * signal)
    slope_after = np.sum(wavenumber**2 * gain**2 * power)
    return Restored(
        height=fft.idct(gain * amplitude, norm="ortho"),
        blur=float(blur),
        noise_rms=noise_rms,
        cutoff=float(2 * np.pi / wavenumber[max(kept[-1], 1)])
        if kept.size
        else float(2 * n),
        slope_gain=float(np.sqrt(slope_after / slope_before)) if slope_before > 0 else 1.0,
    )


def _gain(
    power: np.ndarray, noise: np.ndarray, wavenumber: np.ndarray, blur: float
) -> np.ndarray:
    """Return sqrt(1 - N / P) / G up to the last wavenumber that stands out of the noise."""
    transfer = np.exp(-((wavenumber * blur) ** 2) / 2)
    usable = np.arange(power.size) <= _last_clear(power, noise, transfer > MIN_TRANSFER)
    share = np.clip(1 - noise / np.maximum(power, 1e-300), 0, 1)
    return np.where(usable, np.sqrt(share) / np.maximum(transfer, MIN_TRANSFER), 0.0)


def _last_clear(power: np.ndarray, noise: np.ndarray, seen: np.ndarray) -> int:
    """Index of the last wavenumber, among those seen, that stands out of the noise.

    Noise alone does so somewhere in one picture of six, as both spectra are averages of few
    squares: a stretch counts only if a part of it exceeds what their ratio, distributed as
    F, would reach by chance.
    """
    n = power.size
    index, half = np.arange(n), _half_window(n)
    count = np.minimum(index + half + 1, n) - np.maximum(index - half, 0)
    # A squared cosine amplitude has twice its mean as variance
    scatter = np.sqrt(2 / (1 + 2 * half))
    strength = power / np.maximum(noise, 1e-300)
    clear = strength > 1 + MIN_SIGNAL_TO_NOISE + MIN_SIGNIFICANCE * scatter
    chance = special.fdtri(count, 2 * _noise_window(n), 1 - MAX_FALSE_ALARM)
    sure = clear & (strength > (1 + MIN_SIGNAL_TO_NOISE) * chance)
    stretches, _ = ndimage.label(clear & seen)
    kept = np.isin(stretches, stretches[sure & seen])
    return int(np.flatnonzero(kept)[-1]) if kept.any() else 0


def _noise_window(n: int) -> int:
    """Wavenumbers in an average of the noise: its spectrum is broad, so they are many."""
    return max(n // 12, 16)


def _excess(
    power: np.ndarray, noise: np.ndarray, wavenumber: np.ndarray, blur: float
) -> float:
    """Return by what factor the edge is noisier than the phases beside it.

    Clipped levels have no grain while the edge between them has; there, beyond the reach of
    the optics, the spectrum of the edge is noise alone.
    """
    beyond = wavenumber * blur > 2.2  # less than 1 % of a signal's power
    if np.count_nonzero(beyond) < 16:
        return 1.0
    return float(
        np.clip(power[beyond].mean() / max(noise[beyond].mean(), 1e-300), 1.0, 1e6)
    )


def _smooth_spectrum(power: np.ndarray) -> np.ndarray:
    """Average a periodogram over a window that grows with the wavenumber."""
    n = power.size
    index = np.arange(n)
    half = _half_window(n)
    total = np.concatenate([[0.0], np.cumsum(power)])
    low, high = np.maximum(index - half, 0), np.minimum(index + half + 1, n)
    return (total[high] - total[low]) / (high - low)


def _half_window(n: int) -> np.ndarray:
    """Half the width of the averaging window at each wavenumber."""
    return 2 + (0.12 * np.arange(n)).astype(int)
