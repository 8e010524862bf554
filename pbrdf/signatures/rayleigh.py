"""The polarised clear sky, each photon scattered once by air."""

from dataclasses import dataclass
from math import cos, exp, pi

import numpy as np
import numpy.typing as npt

from pbrdf.conventions import direction, meridian_frame
from pbrdf.errors import one_number, require
from pbrdf.signatures.planck import Spectrum, spectral
from pbrdf.signatures.sun import Sun

__all__ = ["RayleighSky", "rayleigh_optical_depth"]


def rayleigh_optical_depth(wavelength: npt.ArrayLike) -> np.ndarray:
    """Vertical optical depth of clean air above sea level, 1013.25 hPa, 45 degrees north.

    Parameters
    ----------
    wavelength : array_like
        Vacuum wavelength, in [0.25, 1]. [um]

    References
    ----------
    .. [1] B. Bodhaine et al., J. Atmos. Oceanic Technol. 16, 1854 (1999), eq. (30).

    Examples
    --------
    >>> float(rayleigh_optical_depth(0.55).round(4))
    0.0971
    """
    wave = require(
        "wavelength", wavelength, lambda v: (v >= 0.25) & (v <= 1.0), "lie in [0.25, 1] um",
        "The formula of Rayleigh scattering ends there; give optical_depth.",
    )  # fmt: skip
    square = wave * wave
    above = 1.0455996 - 341.29061 / square - 0.90230850 * square
    return 0.0021520 * above / (1.0 + 0.0027059889 / square - 85.968563 * square)


@dataclass(frozen=True, kw_only=True)
class RayleighSky:
    """Clear sky over black ground in single scattering, plane-parallel.

    Parameters
    ----------
    sun : Sun
        Where the light comes from; its irradiance above the atmosphere.
    optical_depth : float, (wavelengths, values) or callable, optional
        Of the scattering air along the vertical; `rayleigh_optical_depth` if not given. [1]
    depolarisation : float
        Depolarisation factor of air for natural light; 0.0279 after Young. [1]

    Notes
    -----
    Light scattered twice or more, and light from the ground, is left out. Its share grows
    with the optical depth; it lowers the degree of polarisation and makes the neutral
    points of Babinet, Brewster and Arago. This sky has none: it is unpolarised only
    towards the sun and opposite to it.

    References
    ----------
    .. [1] S. Chandrasekhar, Radiative Transfer, 1960, sections 16 and 18.
    .. [2] A. T. Young, Appl. Opt. 19, 3427 (1980).
    """

    sun: Sun
    optical_depth: Spectrum | None = None
    depolarisation: float = 0.0279

    def __post_init__(self) -> None:
        if not isinstance(self.sun, Sun):
            msg = f"sun must be a pbrdf.signatures.Sun, got {type(self.sun).__name__}."
            raise TypeError(msg)
        one_number(
            "depolarisation", self.depolarisation, lambda v: (v >= 0) & (v < 1),
            "lie in [0, 1) [1]", "That of air is 0.0279.",
        )  # fmt: skip

    @property
    def relative(self) -> bool:
        """Whether radiances are relative to the sun's irradiance."""
        return self.sun.relative

    def stokes(
        self, theta: npt.ArrayLike, phi: npt.ArrayLike, wavelength: float | None
    ) -> np.ndarray:
        """Stokes radiance of the light from (theta, phi), in its meridian frame.

        Parameters
        ----------
        theta, phi : array_like
            Direction to the point of the sky. [rad]
        wavelength : float or None
            Vacuum wavelength. [um]

        Returns
        -------
        ndarray, shape (..., 4)
            Frame of the propagation vector, which points down. [W m-2 sr-1 um-1]

        Examples
        --------
        At right angles to the sun the field stands perpendicular to the scattering plane:

        >>> sky = RayleighSky(sun=Sun(theta=0.0), optical_depth=0.1, depolarisation=0.0)
        >>> i, q, u, v = sky.stokes(np.pi / 2 - 1e-9, 0.3, None)
        >>> round(float(q / i), 6), round(float(u / i), 6) + 0.0
        (1.0, 0.0)
        """
        depth = self._depth(wavelength)
        to_sky, to_sun = direction(theta, phi), direction(self.sun.theta, self.sun.phi)
        cos_scatter = to_sky @ to_sun
        light = self.sun.above(wavelength) / (4 * pi) * _once(
            depth, to_sky[..., 2], cos(self.sun.theta)
        )  # fmt: skip
        gamma = self.depolarisation / (2.0 - self.depolarisation)
        norm = 3.0 / (4.0 * (1.0 + 2.0 * gamma))
        # The normal of the scattering plane, as long as the sine of the scattering angle
        normal = np.cross(to_sun, to_sky)
        intensity = norm * (1.0 + 3.0 * gamma + (1.0 - gamma) * cos_scatter**2)
        e_s, e_p = meridian_frame(-to_sky, np.asarray(phi) + pi)
        along_s, along_p = (normal * e_s).sum(-1), (normal * e_p).sum(-1)
        # sin^2 of the scattering angle times cos and sin of twice the angle of the normal
        q = norm * (1.0 - gamma) * (along_s**2 - along_p**2)
        u = norm * (1.0 - gamma) * 2.0 * along_s * along_p
        return np.stack([intensity, q, u, np.zeros_like(q)], axis=-1) * light[..., None]

    def _depth(self, wavelength: float | None) -> float:
        if self.optical_depth is not None:
            return spectral("optical_depth", self.optical_depth, wavelength)
        return spectral(
            "optical_depth", lambda w: float(rayleigh_optical_depth(w)), wavelength
        )


def _once(depth: float, mu: np.ndarray, mu_sun: float) -> np.ndarray:
    """Light scattered once and transmitted, mu_sun (e^-t/mu_sun - e^-t/mu)/(mu_sun - mu).

    Chandrasekhar, section 16: with x = t (mu_sun - mu)/(mu mu_sun) it is
    (t/mu) e^(-t/mu_sun) (1 - e^-x)/x, which does not cancel where mu = mu_sun.
    """
    mu = np.maximum(mu, 1e-12)
    x = depth * (mu_sun - mu) / (mu * mu_sun)
    small = np.abs(x) < 1e-9
    safe = np.where(small, 1.0, x)
    # Below the sun x > 0; above it x > -depth/mu_sun, so nothing overflows
    quotient = np.where(small, 1.0 - 0.5 * x, -np.expm1(-safe) / safe)
    return depth / mu * exp(-depth / mu_sun) * quotient
