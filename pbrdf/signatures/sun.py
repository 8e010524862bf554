"""The sun: a disc of unpolarised light behind an atmosphere that only dims it."""

from dataclasses import dataclass
from math import asin, cos, exp, pi, sin

import numpy as np

from pbrdf.conventions import direction
from pbrdf.errors import one_number
from pbrdf.signatures.planck import Spectrum, black_body, spectral

__all__ = ["Sun"]

# Nominal solar radius over the astronomical unit (IAU 2015 resolution B3, 2012 B2)
HALF_ANGLE = asin(6.957e8 / 1.495978707e11)
# Nominal effective temperature (IAU 2015 resolution B3) [K]
TEMPERATURE = 5772.0


@dataclass(frozen=True, kw_only=True)
class Sun:
    """Direct sunlight.

    Parameters
    ----------
    theta, phi : float
        Zenith and azimuth of the direction to the sun. [rad]
    irradiance : float, (wavelengths, values) or callable, optional
        Spectral irradiance above the atmosphere on a plane that faces the sun, at 1 au
        [W m-2 um-1]. Without it the irradiance is 1, at whatever distance, and radiances
        are relative to it.
    optical_depth : float, (wavelengths, values) or callable
        Of the atmosphere along the vertical: the direct light falls by
        exp(-optical_depth / cos theta), which holds for zeniths up to about 80 degrees. [1]
    half_angle : float
        Angular radius of the disc, of uniform radiance, at 1 au. [rad]
    distance : float
        To the sun: `sun_distance(time)`. The irradiance falls with its square, the disc
        with it; over the year it makes 6.9 %. [au]

    Raises
    ------
    ValueError
        If the sun is not above the horizon, or a value leaves its range.

    Examples
    --------
    >>> sun = Sun(theta=np.pi / 3, irradiance=1000.0, optical_depth=0.1)
    >>> round(sun.at_ground(0.55), 3)
    818.731
    """

    theta: float
    phi: float = 0.0
    irradiance: Spectrum | None = None
    optical_depth: Spectrum = 0.0
    half_angle: float = HALF_ANGLE
    distance: float = 1.0

    def __post_init__(self) -> None:
        one_number(
            "theta", self.theta, lambda v: (v >= 0) & (v < pi / 2), "lie in [0, 1.571) rad",
            "It is the sun's zenith in radians; below the horizon leave the sun out.",
        )  # fmt: skip
        one_number(
            "phi", self.phi, lambda v: np.abs(v) <= 4 * pi, "lie in [-12.57, 12.57] rad",
            "Angles are radians; use np.deg2rad.",
        )  # fmt: skip
        one_number(
            "half_angle", self.half_angle, lambda v: (v > 0) & (v < 0.2),
            "lie in (0, 0.2) rad", "That of the sun is 0.00465.",
        )  # fmt: skip
        one_number(
            "distance", self.distance, lambda v: (v >= 0.05) & (v <= 100),
            "lie in [0.05, 100] au", "That of the Earth is 0.983 to 1.017.",
        )  # fmt: skip

    @classmethod
    def planck(
        cls,
        *,
        theta: float,
        phi: float = 0.0,
        temperature: float = TEMPERATURE,
        optical_depth: Spectrum = 0.0,
        distance: float = 1.0,
    ) -> "Sun":
        """Return a sun that is a black body of the sun's size; it has no spectral lines.

        Examples
        --------
        >>> round(Sun.planck(theta=0.0).at_ground(0.55))
        1749
        """
        solid_angle = pi * sin(HALF_ANGLE) ** 2

        def irradiance(wavelength: float) -> float:
            return float(black_body(wavelength, temperature)) * solid_angle

        return cls(
            theta=theta, phi=phi, irradiance=irradiance, optical_depth=optical_depth,
            distance=distance,
        )  # fmt: skip

    @property
    def relative(self) -> bool:
        """Whether radiances are relative to the sun's irradiance."""
        return self.irradiance is None

    def above(self, wavelength: float | None) -> float:
        """Irradiance above the atmosphere, facing the sun. [W m-2 um-1]"""
        if self.irradiance is None:
            return 1.0
        return spectral("irradiance", self.irradiance, wavelength) / self.distance**2

    @property
    def radius(self) -> float:
        """Angular radius of the disc at its distance. [rad]"""
        # As seen from the centre of its sphere, so that the disc keeps its radiance
        return asin(min(sin(self.half_angle) / self.distance, 1.0))

    def at_ground(self, wavelength: float | None) -> float:
        """Direct irradiance at the ground, facing the sun. [W m-2 um-1]"""
        depth = spectral("optical_depth", self.optical_depth, wavelength)
        return self.above(wavelength) * exp(-depth / cos(self.theta))

    def disc(
        self, theta: float, phi: float, x: np.ndarray, y: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Map the square of x in [0, 1] and y in [-1, 1] onto the disc.

        Parameters
        ----------
        theta, phi : float
            Direction near which the points crowd, as a cube of x: a mirror's, whose glint
            may be far narrower than the disc. [rad]
        x, y : ndarray
            Points of the square.

        Returns
        -------
        zenith, azimuth, weight : ndarray
            Directions to points of the disc [rad], and the solid angle of dx dy there over
            the projected solid angle of the disc, pi sin^2 of its radius: irradiance times
            weight is radiance times solid angle. [1]
        """
        pole, axis = direction(theta, phi), direction(self.theta, self.phi)
        across = np.cross(pole, axis)
        apart = float(np.arctan2(np.linalg.norm(across), pole @ axis))
        if apart > 1e-12:
            across /= np.linalg.norm(across)
        else:
            across = np.array([-sin(phi), cos(phi), 0.0])
        along = np.cross(across, pole)
        # Turn about the pole, and the radii at which a way from it crosses the rim
        inside = apart < self.radius
        widest = pi if inside else asin(min(sin(self.radius) / sin(apart), 1.0))
        turn = widest * (y if inside else np.sin(0.5 * pi * y))
        slope = widest * (1.0 if inside else 0.5 * pi * np.cos(0.5 * pi * y))
        middle = np.arctan2(sin(apart) * np.cos(turn), cos(apart))
        closest = np.hypot(cos(apart), sin(apart) * np.cos(turn))
        half = np.arccos(np.minimum(cos(self.radius) / closest, 1.0))
        first = np.zeros_like(middle) if inside else middle - half
        radius = first + (middle + half - first) * x**3
        points = np.cos(radius)[:, None] * pole + np.sin(radius)[:, None] * (
            np.cos(turn)[:, None] * along + np.sin(turn)[:, None] * across
        )
        area = np.sin(radius) * (middle + half - first) * 3 * x**2 * slope
        zenith = np.arctan2(np.hypot(points[:, 0], points[:, 1]), points[:, 2])
        azimuth = np.arctan2(points[:, 1], points[:, 0])
        return zenith, azimuth, area / (pi * sin(self.radius) ** 2)
