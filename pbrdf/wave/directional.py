"""Statistics of heights that differ from direction to direction, as of a brushed surface.

In the sum over orders they enter through their spectrum at the lateral wave vector K, in
Smith's hiding through the slope along the azimuth of each way.
"""

from typing import Any

import numpy as np
from scipy import interpolate, special

from pbrdf.errors import require
from pbrdf.wave.statistics import Gaussian, Statistics

__all__ = ["Directional", "GaussianAxes", "PlaneDensity", "directional_heights", "smith"]

Array = np.ndarray

# What two ends of one line through the origin may differ by, as part of the largest density
ODD = 1e-6


class Directional(Statistics):
    """Heights whose spectrum depends on the direction of K. Axes are those of phi = 0."""

    # The methods that need no more than the spectrum
    methods: tuple[str, ...] = ("first-order",)

    # Lengths of the spectrum's features along its axes [um]
    lengths: tuple[float, float]

    def lateral(self, k_x: Array, k_y: Array) -> Array:
        """Return what stands for K [rad/um] in sums over orders and in `spectrum`."""
        raise NotImplementedError

    def slopes(self, limit: float, azimuth: Array) -> Array:
        """Rms slope along azimuths, of components up to `limit` [rad/um]. [1]"""
        raise NotImplementedError


class GaussianAxes(Gaussian, Directional):
    """Autocorrelation exp(-(x/l_x)² - (y/l_y)²).

    Of K it knows |(K_x l_x, K_y l_y)|: that of an isotropic surface of length √(l_x l_y),
    in every order.
    """

    methods = (
        "auto", "first-order", "kirchhoff", "small-slope", "order-weighted", "geometric"
    )  # fmt: skip

    def __init__(self, height_rms: float, lengths: tuple[float, float]) -> None:
        sides = require(
            "corr_length", lengths, lambda v: (v > 0) & np.isfinite(v), "be positive [um]",
            "One length, or one along x and one along y.",
        )  # fmt: skip
        self.lengths = float(sides[0]), float(sides[1])
        super().__init__(height_rms, float(np.sqrt(sides[0] * sides[1])))

    def lateral(self, k_x: Array, k_y: Array) -> Array:
        """See `Directional`."""
        scaled: Array = np.hypot(k_x * self.lengths[0], k_y * self.lengths[1])
        return scaled / self.corr_length

    def slopes(self, limit: float, azimuth: Array) -> Array:
        """See `Directional`.

        In (K_x l_x, K_y l_y) the spectrum is round, and the limit an ellipse.
        """
        turn = np.linspace(0.0, 2 * np.pi, 512, endpoint=False)
        x, y = np.cos(turn) / self.lengths[0], np.sin(turn) / self.lengths[1]
        share = 4.0 * special.gammainc(2.0, 0.25 * limit**2 / (x**2 + y**2))
        along_x, along_y = ((share * part**2).mean() for part in (x, y))
        square = along_x * np.cos(azimuth) ** 2 + along_y * np.sin(azimuth) ** 2
        found: Array = self.height_rms * np.sqrt(square)
        return found


class PlaneDensity(Directional):
    """Measured two-sided density over a grid of frequencies, without 2 pi. [um⁴]

    Linear between the points, nothing beyond them.
    """

    def __init__(self, f_x: Array, f_y: Array, density: Array) -> None:
        self._density = interpolate.RegularGridInterpolator(
            (f_x, f_y), density, bounds_error=False, fill_value=0.0
        )
        variance = float(np.trapezoid(np.trapezoid(density, f_y, axis=1), f_x))
        at_zero = float(self._density((0.0, 0.0)))
        # The length of a Gaussian surface of this height and this density at 0
        length = np.sqrt(max(at_zero, 1e-300) / (np.pi * variance))
        super().__init__(float(np.sqrt(variance)), float(length))
        self.lengths = 2 * (self.corr_length,)

    def lateral(self, k_x: Array, k_y: Array) -> Array:
        """See `Directional`: both parts in one complex number."""
        return k_x + 1j * k_y

    def spectrum(self, wave_vector: Array, dimensions: int) -> Array:
        """See `Statistics`; of complex K."""
        del dimensions
        frequency = np.asarray(wave_vector) / (2 * np.pi)
        found: Array = self._density((frequency.real, frequency.imag))
        return found

    def spread(self, limit: float, dimensions: int) -> float:
        """See `Statistics`; the methods that may be used here take no part in it."""
        del limit, dimensions
        return 0.0


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


def directional_heights(
    height_rms: float | None, corr_length: Any, psd: Any, autocorrelation: Any
) -> Directional | None:
    """Return statistics of two axes or of a plane of frequencies, None of isotropic ones.

    Raises
    ------
    ValueError
        If what was given is half of it, or a density is no real surface's.
    """
    if isinstance(psd, tuple | list) and len(psd) == 3:
        return _plane(psd, height_rms, corr_length)
    if not _is_sequence(corr_length):
        return None
    if len(corr_length) != 2:
        msg = f"corr_length must be one length or two, got {len(corr_length)}."
        raise ValueError(msg)
    if autocorrelation != "gaussian":
        msg = (
            "autocorrelation must be 'gaussian' with two lengths, got "
            f"{autocorrelation!r}. Other ones come as a psd over a plane of frequencies."
        )
        raise ValueError(msg)
    if height_rms is None:
        msg = "height_rms must be given [um] with corr_length, got none."
        raise ValueError(msg)
    return GaussianAxes(height_rms, tuple(corr_length))


def _is_sequence(value: Any) -> bool:
    return isinstance(value, tuple | list | np.ndarray) and np.ndim(value) != 0


def _plane(psd: Any, height_rms: float | None, corr_length: Any) -> PlaneDensity:
    """Check a density over a plane of frequencies."""
    if height_rms is not None or corr_length is not None:
        msg = "height_rms and corr_length must be left out with a psd over a plane."
        raise ValueError(msg)
    f_x, f_y, density = (
        require(f"psd {name}", one, np.isfinite, "be finite", "Leave gaps out.")
        for name, one in zip(("f_x", "f_y", "density"), psd, strict=True)
    )
    if density.shape != (f_x.size, f_y.size) or f_x.ndim != 1 or f_y.ndim != 1:
        msg = (
            f"psd must be (f_x, f_y, density), got shapes {f_x.shape}, {f_y.shape}, "
            f"{density.shape}."
        )
        raise ValueError(msg)
    require("psd density", density, lambda v: v >= 0, "be >= 0 [um4]", "It is a power.")
    for name, f in (("f_x", f_x), ("f_y", f_y)):
        if (np.diff(f) <= 0).any() or not np.allclose(f, -f[::-1], atol=1e-9 * f.max()):
            msg = (
                f"psd {name} must rise from -f to f, got {f[0]:.4g} to {f[-1]:.4g} 1/um. "
                "Use numpy.fft.fftshift, and both ends."
            )
            raise ValueError(msg)
    if np.abs(density - density[::-1, ::-1]).max() > ODD * density.max():
        msg = "psd density must be the same at f and -f, as of real heights."
        raise ValueError(msg)
    if not density.max() > 0.0:
        msg = "psd density must be above 0 somewhere: a flat surface has a beam only."
        raise ValueError(msg)
    return PlaneDensity(f_x, f_y, density)
