r"""A white-light interference microscope, rendered: from a true surface to its map.

Light of wavenumber k comes through the pupil along d_i, leaves through it along d_s, and
carries the Fourier component K = k (d_s - d_i) of the surface. The facets mirror into

.. math::
   u(r, K_z) = \int d^2K_\perp \, T(K_\perp, K_z) \, e^{i K_\perp r}
               \int d^2r' \, e^{-i K_\perp r' - i K_z h(r')},

the scalar Kirchhoff field of a surface of even reflectance (the foil model). The transfer T
is how many pairs of directions and wavenumbers meet in K. A pixel averages over its width.
The height is where the fringes' envelope is highest, then their phase there.

References: J. Coupland et al., Applied Optics 52, 3662 (2013); P. de Groot, X. Colonna de
Lega, R. Su, R. Leach, Proc. SPIE 11102, 111020G (2019).
"""

from dataclasses import dataclass

import numpy as np
import scipy.fft

from pbrdf import HeightMap

Array = np.ndarray

_PAIRS = 1_000_000
# Steps of K_z [1/um], so close that heights 18 um apart do not pass for one
_STEP = 0.35
_LATERAL = 120
# Steps of the scan along z, a tenth of a fringe or less [um]
_SCAN = 0.03
_BLOCK = 20_000


@dataclass(frozen=True, kw_only=True)
class Interferometer:
    """Objective, light and camera.

    Parameters
    ----------
    aperture : float
        Numerical aperture of illumination and imaging. [1]
    pixel : int
        Nodes of the true surface along a pixel.
    wavelength, bandwidth : float
        Of the light, mean and full width at half height. [um]
    noise : float
        Of the fringes of a pixel, beside the contrast on a flat surface. [1]
    contrast : float
        Least contrast of fringes that gives a height. [1]
    """

    aperture: float
    pixel: int
    wavelength: float = 0.55
    bandwidth: float = 0.12
    noise: float = 0.02
    contrast: float = 0.06

    def transfer(self, seed: int = 0) -> tuple[Array, Array, Array]:
        """Return K_z, |K_perp| [1/um], and T over both."""
        rng = np.random.default_rng(seed)
        mean = 2 * np.pi / self.wavelength
        width = mean * self.bandwidth / self.wavelength / 2.355
        k = mean + width * rng.standard_normal(_PAIRS)
        sines = []
        for _ in range(2):
            # An aplanatic objective fills its pupil evenly in the sines
            radius = self.aperture * np.sqrt(rng.random(_PAIRS))
            sines.append(radius * np.exp(2j * np.pi * rng.random(_PAIRS)))
        cosines = [np.sqrt(1 - np.abs(s) ** 2) for s in sines]
        axial, lateral = k * (cosines[0] + cosines[1]), k * np.abs(sines[0] - sines[1])
        low, high = np.quantile(axial, [0.01, 0.99])
        planes = int((high - low) / _STEP) + 1
        furthest = lateral.max() * 1.001
        count, _, edges = np.histogram2d(
            axial, lateral, bins=[planes, _LATERAL],
            range=[[low, low + planes * _STEP], [0, furthest]],
        )  # fmt: skip
        middle = low + _STEP * (np.arange(planes) + 0.5)
        return middle, (edges[1:] + edges[:-1]) / 2, count / np.diff(edges**2)

    def image(self, surface: HeightMap, *, seed: int = 0) -> HeightMap:
        """Return the map that it makes of a periodic surface, NaN without contrast."""
        axial, lateral, transfer = self.transfer()
        fields = self._fields(surface, axial, lateral, transfer)
        flat = float(transfer[:, 0].sum())
        rng = np.random.default_rng(seed)
        white = rng.standard_normal((2, *fields.shape))
        fields = fields + self.noise * flat / np.sqrt(2 * axial.size) * (
            white[0] + 1j * white[1]
        )
        heights, contrast = _envelope(fields.reshape(axial.size, -1), axial, surface)
        # Fringes shift the height within the one that the envelope chose
        turns = np.exp(1j * axial[:, None] * heights)
        carrier = float(np.average(axial, weights=transfer[:, 0]))
        phase = np.angle(np.sum(fields.reshape(axial.size, -1) * turns, axis=0))
        heights = np.where(
            contrast > self.contrast * flat, heights - phase / carrier, np.nan
        )
        return HeightMap(heights.reshape(fields.shape[1:]), surface.spacing[0] * self.pixel)

    def _fields(
        self, surface: HeightMap, axial: Array, lateral: Array, transfer: Array
    ) -> Array:
        """Field u of every pixel, a plane for each K_z."""
        step, heights = surface.spacing[0], surface.heights
        across = [2 * np.pi * scipy.fft.fftfreq(n, step) for n in heights.shape]
        kx, ky = across[0][:, None], across[1]
        along = np.hypot(kx, ky)
        half = step * self.pixel / (2 * np.pi)
        pixel = np.sinc(kx * half) * np.sinc(ky * half)
        begin = slice(self.pixel // 2, None, self.pixel)
        planes = []
        for k_z, row in zip(axial, transfer, strict=True):
            passed = pixel * np.interp(along, lateral, row, right=0.0)
            spectrum = scipy.fft.fft2(np.exp(-1j * k_z * heights))
            planes.append(scipy.fft.ifft2(passed * spectrum)[begin, begin])
        return np.stack(planes)


def _envelope(fields: Array, axial: Array, surface: HeightMap) -> tuple[Array, Array]:
    """Height of the highest envelope of each pixel, by a parabola, and how high it is."""
    heights = surface.heights
    scan = np.arange(heights.min() - 0.5, heights.max() + 0.5, _SCAN)
    turns = np.exp(1j * np.outer(scan, axial))
    found, contrast = np.empty(fields.shape[1]), np.empty(fields.shape[1])
    for begin in range(0, fields.shape[1], _BLOCK):
        block = slice(begin, begin + _BLOCK)
        envelope = np.abs(turns @ fields[:, block])
        top = np.clip(envelope.argmax(axis=0), 1, scan.size - 2)
        at = np.arange(top.size)
        below, peak, above = (envelope[top + i, at] for i in (-1, 0, 1))
        shift = (below - above) / (2 * (below - 2 * peak + above))
        found[block] = scan[top] + _SCAN * np.clip(shift, -1, 1)
        contrast[block] = peak
    return found, contrast


def digitised(surface: HeightMap, band: float) -> HeightMap:
    """Return a map as a picture in false colour keeps it: in bands. [um]"""
    return HeightMap(np.round(surface.heights / band) * band, surface.spacing)
