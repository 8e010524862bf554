"""The polarised clear sky: light scattered by air once, or as often as it is."""

import warnings
from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np
import numpy.typing as npt

from pbrdf.conventions import direction, meridian_frame
from pbrdf.errors import AccuracyWarning, one_number, require
from pbrdf.signatures.multiple import Air, field, once, scatter
from pbrdf.signatures.planck import Spectrum, spectral
from pbrdf.signatures.sun import Sun

__all__ = ["ClearSky", "RayleighSky", "rayleigh_optical_depth"]

# Of the standard atmosphere at sea level [hPa]
PRESSURE = 1013.25
# Clean air has less at all wavelengths of the formula, thicker layers are not resolved
MOST_DEPTH = 10.0
# Errors above this part of I are warned of
MOST_ERROR = 1e-3
# So are air masses of plane air that are too large by this part
MOST_BENT = 0.05


def rayleigh_optical_depth(
    wavelength: npt.ArrayLike, pressure: float = PRESSURE
) -> np.ndarray:
    """Vertical optical depth of clean air with 360 ppm of CO2, 45 degrees north.

    Parameters
    ----------
    wavelength : array_like
        Vacuum wavelength, in [0.25, 1]. [um]
    pressure : float
        At the ground: the depth is proportional to it. 1013.25 at sea level. [hPa]

    References
    ----------
    .. [1] B. Bodhaine et al., J. Atmos. Oceanic Technol. 16, 1854 (1999), eq. (30).

    Examples
    --------
    >>> float(rayleigh_optical_depth(0.55).round(4))
    0.0971
    >>> float(rayleigh_optical_depth(0.55, 700.0).round(4))
    0.0671
    """
    pressure = one_number(
        "pressure", pressure, lambda v: (v > 0) & (v <= 1200), "lie in (0, 1200] hPa",
        "That at sea level is 1013.25 hPa.",
    )  # fmt: skip
    wave = require(
        "wavelength", wavelength, lambda v: (v >= 0.25) & (v <= 1.0), "lie in [0.25, 1] um",
        "The formula of Rayleigh scattering ends there; give optical_depth.",
    )  # fmt: skip
    square = wave * wave
    above = 1.0455996 - 341.29061 / square - 0.90230850 * square
    at_sea = 0.0021520 * above / (1.0 + 0.0027059889 / square - 85.968563 * square)
    return np.asarray(pressure / PRESSURE * at_sea)


def _tell_low(sun: Sun) -> None:
    """Warn of a sun that shines through another air mass than that of plane air.

    The air mass of the round Earth after F. Kasten and A. T. Young, Appl. Opt. 28, 4735
    (1989).
    """
    zenith = float(np.rad2deg(sun.theta))
    plane = 1.0 / max(cos(sun.theta), 1e-12)
    curved = 1.0 / (cos(sun.theta) + 0.50572 * (96.07995 - zenith) ** -1.6364)
    if plane > (1.0 + MOST_BENT) * curved:
        msg = (
            f"sun is {90.0 - zenith:.3g} degrees high, where plane air has an air mass of "
            f"{plane:.3g} and that of the Earth {curved:.3g}: sun and sky are wrong by as "
            "much in their optical depth. Take a higher sun, or a sky table."
        )
        warnings.warn(msg, AccuracyWarning, stacklevel=4)


@dataclass(frozen=True, kw_only=True)
class _CleanAir:
    """Plane-parallel air that scatters and does not absorb."""

    sun: Sun
    optical_depth: Spectrum | None = None
    depolarisation: float = 0.0279
    pressure: float | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.sun, Sun):
            msg = f"sun must be a pbrdf.signatures.Sun, got {type(self.sun).__name__}."
            raise TypeError(msg)
        one_number(
            "depolarisation", self.depolarisation, lambda v: (v >= 0) & (v < 1),
            "lie in [0, 1) [1]", "That of air is 0.0279.",
        )  # fmt: skip
        if self.pressure is not None:
            if self.optical_depth is not None:
                msg = (
                    "pressure must be left out where optical_depth is given, got "
                    f"{self.pressure!r}. Give one of them."
                )
                raise ValueError(msg)
            rayleigh_optical_depth(0.5, self.pressure)
        _tell_low(self.sun)

    @property
    def relative(self) -> bool:
        """Whether radiances are relative to the sun's irradiance."""
        return self.sun.relative

    def depth(self, wavelength: float | None) -> float:
        """Optical depth of the air along the vertical. [1]"""
        if self.optical_depth is not None:
            return spectral("optical_depth", self.optical_depth, wavelength)
        pressure = PRESSURE if self.pressure is None else self.pressure
        return spectral(
            "optical_depth",
            lambda w: float(rayleigh_optical_depth(w, pressure)),
            wavelength,
        )


@dataclass(frozen=True, kw_only=True)
class RayleighSky(_CleanAir):
    """Clear sky over black ground in single scattering, plane-parallel.

    Parameters
    ----------
    sun : Sun
        Where the light comes from; its irradiance above the atmosphere.
    optical_depth : float, (wavelengths, values) or callable, optional
        Of the scattering air along the vertical; `rayleigh_optical_depth` if not given. [1]
    depolarisation : float
        Depolarisation factor of air for natural light; 0.0279 after Young. [1]
    pressure : float, optional
        At the ground, for `rayleigh_optical_depth`; 1013.25 unless given. [hPa]

    Notes
    -----
    Light scattered twice or more, and light from the ground, is left out; `ClearSky` has
    it. Its share grows with the optical depth; it lowers the degree of polarisation and
    makes the neutral points of Babinet, Brewster and Arago. This sky has none: it is
    unpolarised only towards the sun and opposite to it.

    References
    ----------
    .. [1] S. Chandrasekhar, Radiative Transfer, 1960, sections 16 and 18.
    .. [2] A. T. Young, Appl. Opt. 19, 3427 (1980).
    """

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
        depth = self.depth(wavelength)
        to_sky, to_sun = direction(theta, phi), direction(self.sun.theta, self.sun.phi)
        cos_scatter = to_sky @ to_sun
        light = self.sun.above(wavelength) / (4 * pi) * once(
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


@dataclass(frozen=True, kw_only=True)
class ClearSky(_CleanAir):
    """Clear sky with all orders of scattering over Lambertian ground, plane-parallel.

    Parameters
    ----------
    sun, optical_depth, depolarisation, pressure
        As of `RayleighSky`; the optical depth is at most 10.
    ground_albedo : float, (wavelengths, values) or callable
        Of the ground around, which reflects without polarisation; part of its light comes
        back from the air. 0 is black. [1]

    Notes
    -----
    The air does not absorb and holds no dust. The equation of transfer is solved once for
    each optical depth, sun and ground, by an integral equation for the source of the light
    (`pbrdf.signatures.multiple`); the light from any direction is then a sum along the way,
    without interpolation between directions. `error` tells how exact it is.

    Warns
    -----
    AccuracyWarning
        If the sky is less exact than 0.1 % of I, as under a sun at the horizon; if the sun
        is so low that the round Earth has an air mass 5 % below that of plane air.

    References
    ----------
    .. [1] S. Chandrasekhar, Radiative Transfer, 1960, sections 17, 18 and 69 to 73.
    .. [2] V. Natraj, K.-F. Li, Y. L. Yung, Astrophys. J. 691, 1909 (2009): tables.
    """

    ground_albedo: Spectrum = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (callable(self.ground_albedo) or isinstance(self.ground_albedo, tuple)):
            self._albedo(None)

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
        At right angles to the sun light that was scattered again takes 8 % of polarisation:

        >>> sky = ClearSky(sun=Sun(theta=0.9), optical_depth=0.1, depolarisation=0.0)
        >>> i, q, u, v = sky.stokes(np.pi / 2 - 0.9, np.pi, None)
        >>> round(float(q / i), 2)
        0.92
        """
        air = self._air(wavelength)
        to_sky = direction(theta, phi)
        frame = meridian_frame(-to_sky, np.asarray(phi) + pi)
        # Axes of the solution: x towards the sun's azimuth
        cos_phi, sin_phi = cos(self.sun.phi), sin(self.sun.phi)
        turn = np.array([[cos_phi, -sin_phi, 0], [sin_phi, cos_phi, 0], [0, 0, 1.0]])
        e_s, e_p = (np.asarray(one) @ turn for one in frame)
        ss, pp, sp = field(air, to_sky[..., 2], e_s, e_p)
        light = np.stack([ss + pp, ss - pp, 2 * sp, np.zeros_like(ss)], axis=-1)
        return self.sun.above(wavelength) * light

    def irradiance(self, wavelength: float | None = None) -> float:
        """Irradiance of the sky on horizontal ground, without the sun. [W m-2 um-1]"""
        return self.sun.above(wavelength) * self._air(wavelength).diffuse

    def error(self, wavelength: float | None = None) -> float:
        """Numerical error of I, Q, U in parts of I: what fewer polynomials change. [1]"""
        return self._air(wavelength).error

    def _air(self, wavelength: float | None) -> Air:
        depth = self.depth(wavelength)
        one_number(
            "optical_depth", depth, lambda v: v <= MOST_DEPTH, f"be <= {MOST_DEPTH:g} [1]",
            "Clean air has less; take OvercastSky for clouds.",
        )  # fmt: skip
        gamma = self.depolarisation / (2.0 - self.depolarisation)
        dipole = (1.0 - gamma) / (1.0 + 2.0 * gamma)
        air = scatter(depth, cos(self.sun.theta), dipole, self._albedo(wavelength))
        if air.error > MOST_ERROR:
            msg = (
                f"the clear sky is exact to {100 * air.error:.2g} % of I only, under a sun "
                f"{90 - np.rad2deg(self.sun.theta):.2g} degrees high through an optical "
                f"depth of {depth:.3g}. Take a higher sun or a longer wavelength."
            )
            warnings.warn(msg, AccuracyWarning, stacklevel=3)
        return air

    def _albedo(self, wavelength: float | None) -> float:
        return one_number(
            "ground_albedo", spectral("ground_albedo", self.ground_albedo, wavelength),
            lambda v: v <= 1, "lie in [0, 1] [1]", "It is a share of the light.",
        )  # fmt: skip
