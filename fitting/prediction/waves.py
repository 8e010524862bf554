"""Smooth maps, predicted by waves: their spectral density, and models drawn about it."""

from collections.abc import Iterator

import numpy as np
import scipy.fft

from pbrdf import HeightMap, Material, WaveModel

__all__ = ["density_of", "is_smooth", "smooth_notes", "wave_model"]

Array = np.ndarray

# Share of the specular beam that heights leave at normal incidence: below it facets do
_SHARE = 0.01
# Blur of an instrument is undone as far as it left this part of the density
_LEAST_LEFT = 0.2
# Rings of frequencies, a factor apart, and waves that one holds at the least, for speckle
_RING, _FEWEST = 1.12, 40
# Ratio of the slopes along the axes above which a map is no isotropic surface
_UNEQUAL = 1.3


def is_smooth(surface: HeightMap, wavelength: float) -> bool:
    """Tell whether the specular beam of a map has to be counted with."""
    phase = 4 * np.pi * float(_levelled(surface).std()) / wavelength
    return bool(np.exp(-(phase**2)) > _SHARE)


def density_of(surface: HeightMap, resolution: float) -> tuple[Array, Array]:
    """Two-sided density of an isotropic surface over frequencies without 2 pi.

    Parameters
    ----------
    surface : HeightMap
        Without holes. One that is not periodic is faded to its rims.
    resolution : float
        Standard deviation of the point spread that blurred it. [um]

    Returns
    -------
    frequency, density : ndarray
        [1/um], [um^4]; ``Int density d2f`` is the variance of the heights.
    """
    heights = _levelled(surface)
    steps = [float(s) for s in surface.spacing]
    if not surface.periodic:
        fades = [np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2 for n in heights.shape]
        window = np.outer(*fades)
        window /= np.sqrt(np.mean(window**2))
        heights = (heights - (heights * window).sum() / window.sum()) * window
    power = np.abs(scipy.fft.fft2(heights, workers=1)) ** 2
    power *= steps[0] * steps[1] / heights.size
    east, north = (
        scipy.fft.fftfreq(n, step) for n, step in zip(heights.shape, steps, strict=True)
    )
    frequency = np.hypot(east[:, None], north).ravel()
    order = np.argsort(frequency)
    order = order[(frequency[order] > 0) & (frequency[order] <= 0.5 / max(steps))]
    ends = _rings(frequency[order])
    centre, density = (
        np.add.reduceat(one[order], ends) / np.diff(np.r_[ends, order.size])
        for one in (frequency, power.ravel())
    )
    left = np.maximum(np.exp(-((2 * np.pi * centre * resolution) ** 2)), _LEAST_LEFT)
    density = density / left
    above = density > 0
    return centre[above], density[above]


def _rings(frequency: Array) -> Array:
    """Where rings of rising frequencies begin: of several waves, and a factor apart."""
    starts, last = [0], frequency.size
    while True:
        at = starts[-1] + _FEWEST
        if at >= last:
            break
        at = max(at, int(np.searchsorted(frequency, _RING * frequency[starts[-1]])))
        if at + _FEWEST > last:
            break
        starts.append(at)
    return np.array(starts)


def wave_model(
    density: tuple[Array, Array], material: Material, *, scale: float = 1.0
) -> WaveModel:
    """Waves over a density; `scale` multiplies the heights."""
    frequency, power = density
    return WaveModel(material, psd=(frequency, power * scale**2))


def smooth_notes(
    surface: HeightMap, model: WaveModel, wavelength: float, resolution: float
) -> Iterator[str]:
    """Yield what was found and what the map leaves open."""
    heights = model.surface.heights
    share = np.exp(-((4 * np.pi * heights.height_rms / wavelength) ** 2))
    yield (
        f"the map is smooth: rms height {heights.height_rms:.3g} um, correlation length "
        f"{heights.corr_length:.3g} um; {share:.0%} of the specular beam remain at normal "
        "incidence. Waves are used, not facets; the beam is `coherent`, apart from the BRDF"
    )
    coarse = max(surface.spacing)
    if coarse > 0.5 * wavelength:
        yield (
            f"steps of {coarse:.3g} um leave out the roughness that scatters beyond "
            f"{np.rad2deg(np.arcsin(0.5 * wavelength / coarse)):.0f} degrees at normal "
            "incidence; the prediction is 0 there"
        )
    blurred = 2 * np.pi * resolution * 2 / wavelength
    if resolution > 0 and np.exp(-(blurred**2)) < _LEAST_LEFT:
        yield (
            f"the instrument blurs by {resolution:.3g} um: densities are corrected by a "
            f"factor {1 / _LEAST_LEFT:.0f} at the most, finer roughness is missing"
        )
    slopes = [np.std(np.diff(surface.heights, axis=a)) / surface.spacing[a] for a in (0, 1)]
    if max(slopes) > _UNEQUAL * min(slopes):
        yield (
            f"slopes along the axes differ, {slopes[0]:.3g} and {slopes[1]:.3g}: waves "
            "take the map as isotropic"
        )


def _levelled(surface: HeightMap) -> Array:
    """Heights about their plane; a periodic map has none. [um]"""
    heights = np.asarray(surface.heights, dtype=np.float64)
    if surface.periodic:
        return heights - heights.mean()
    x, y = (np.linspace(-1.0, 1.0, n) for n in heights.shape)
    tilt_x = (heights * x[:, None]).sum() / (x**2).sum() / y.size
    tilt_y = (heights * y).sum() / (y**2).sum() / x.size
    return heights - heights.mean() - tilt_x * x[:, None] - tilt_y * y
