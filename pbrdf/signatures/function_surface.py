"""A surface whose BRDF is a function of the geometry, looked at from one direction."""

import inspect
from collections.abc import Callable
from math import pi
from typing import Any

import numpy as np

from pbrdf.signatures.sun import Sun

__all__ = ["EXCHANGED", "FunctionSurface", "Light", "mirrored_sun"]

# Stokes radiance of the light from zeniths and azimuths [rad], shape (..., 4)
Light = Callable[[np.ndarray, np.ndarray], np.ndarray]
Value = tuple[np.ndarray, np.ndarray]

# Exchange of source and detector, the P of the conventions page
EXCHANGED = np.array([1.0, 1.0, -1.0, 1.0])
BLACK = np.array([1.0, 0.0, 0.0, 0.0])


class FunctionSurface:
    """Integrals of a BRDF over the sky by adaptive quadrature, each with its error.

    Parameters
    ----------
    source : object
        With `brdf(theta_i, theta_s, dphi[, wavelength, phi_i])` as `MicrofacetModel`; with
        `coherent(theta_i, wavelength[, phi_i])` where part of the light stays a specular
        beam.
    theta, phi : float
        Direction to the sensor. [rad]
    wavelength : float or None
        [um]
    rel_error : float
        Error to reach, in units of the largest part.
    """

    statistical = False

    def __init__(
        self,
        source: Any,
        theta: float,
        phi: float,
        wavelength: float | None,
        rel_error: float,
    ) -> None:
        self.source = source
        self.theta, self.phi, self.wavelength = theta, phi, wavelength
        self.rel_error = rel_error
        self.asked = _asked(source.brdf, wavelength)
        self.beam = np.zeros((4, 4))
        if hasattr(source, "coherent"):
            more = {"phi_i": phi} if "phi_i" in _asked(source.coherent, wavelength) else {}
            self.beam = np.asarray(source.coherent(theta, wavelength, **more))

    def facing(self, sun: Sun, irradiance: float) -> Value:
        """Stokes radiance of sunlight off the surface; irradiance facing the sun."""

        def integrand(points: np.ndarray) -> np.ndarray:
            x, y = points[:, 0], points[:, 1]
            theta, phi, weight = sun.disc(self.theta, self.phi + pi, x, y)
            # What lies below the horizon lights nothing
            column = self._brdf(
                np.minimum(theta, pi / 2), self.theta, self.phi - phi, phi
            )[:, :, 0]  # fmt: skip
            return column * (weight * np.maximum(np.cos(theta), 0.0))[:, None]

        value, error = self._integral(integrand, [1.0])
        at = self.theta, self.phi
        mirrored = mirrored_sun(self.beam, at, sun, irradiance)
        return irradiance * value + mirrored, irradiance * error

    def gather(self, light: Light) -> Value:
        """Stokes radiance that the surface makes of the light of the whole sky."""

        def integrand(theta: np.ndarray, dphi: np.ndarray) -> np.ndarray:
            phi_i = self.phi - dphi
            matrices = self._brdf(theta, self.theta, dphi, phi_i)
            return np.einsum("nij,nj->ni", matrices, light(theta, phi_i))

        value, error = self._hemisphere(integrand)
        mirrored = light(np.array([self.theta]), np.array([self.phi + pi]))[0]
        return value + self.beam @ mirrored, error

    def emissivity(self) -> Value:
        """Stokes vector emitted to the sensor over the radiance of a black body.

        Kirchhoff's law with reciprocity: what would be absorbed of light sent back along
        the way, (1, 0, 0, 0) - P R[0], R[0] the first row of what the hemisphere gets.
        """

        def integrand(theta: np.ndarray, dphi: np.ndarray) -> np.ndarray:
            return self._brdf(self.theta, theta, dphi, self.phi)[:, 0]

        row, error = self._hemisphere(integrand)
        return BLACK - EXCHANGED * (row + self.beam[0]), error

    def _brdf(self, theta_i: Any, theta_s: Any, dphi: Any, phi_i: Any) -> np.ndarray:
        known = {"phi_i": np.mod(phi_i, 2 * pi), "wavelength": self.wavelength}
        more = {name: known[name] for name in self.asked}
        found = np.asarray(self.source.brdf(theta_i, theta_s, np.mod(dphi, 2 * pi), **more))
        if found.shape[-2:] != (4, 4):
            msg = (
                "brdf of the source must return (..., 4, 4) Mueller matrices [1/sr], got "
                f"shape {found.shape}."
            )
            raise ValueError(msg)
        if not np.isfinite(found).all():
            _refuse_gaps(found, theta_i, theta_s, dphi)
        return found

    def _hemisphere(
        self, function: Callable[[np.ndarray, np.ndarray], np.ndarray]
    ) -> Value:
        """Integrate a function of zenith and dphi over the projected hemisphere."""

        def integrand(points: np.ndarray) -> np.ndarray:
            # Cubes of the variables crowd the nodes about the specular direction
            x, y = np.abs(points[:, 0]), points[:, 1]
            side = np.where(points[:, 0] > 0, pi / 2 - self.theta, -self.theta)
            theta = np.clip(self.theta + side * x**3, 0.0, pi / 2)
            dphi = pi + pi * y**3
            weight = np.abs(side) * 3 * x**2 * pi * 3 * y**2 * np.sin(theta) * np.cos(theta)
            return function(theta, dphi) * weight[:, None]

        ends = [
            end for end, side in ((-1.0, self.theta), (1.0, pi / 2 - self.theta)) if side
        ]
        return self._integral(integrand, ends)

    def _integral(
        self, integrand: Callable[[np.ndarray], np.ndarray], ends: list[float]
    ) -> Value:
        """Integrate over x from 0 to each of the ends and y from -1 to 1."""
        from scipy.integrate import cubature

        boxes = [
            ([min(end, 0.0), low], [max(end, 0.0), low + 1.0])
            for end in ends
            for low in (-1.0, 0.0)
        ]
        scale = sum(np.abs(_rough(integrand, *box)).max() for box in boxes)
        total, error = np.zeros(4), np.zeros(4)
        for low, high in boxes:
            found = cubature(
                integrand, low, high, rule="gk15", rtol=0.0,
                atol=self.rel_error * max(scale, 1e-300), max_subdivisions=500,
            )  # fmt: skip
            total, error = total + found.estimate, error + np.abs(found.error)
        return total, error


def _refuse_gaps(found: np.ndarray, *angles: Any) -> None:
    """Refuse a BRDF that is nan or infinite somewhere."""
    gaps = ~np.isfinite(found).all((-2, -1))
    at = [float(np.broadcast_to(one, gaps.shape)[gaps][0]) for one in angles]
    theta_i, theta_s, dphi = np.rad2deg(at)
    msg = (
        f"brdf of the source must be finite, {int(gaps.sum())} of {gaps.size} matrices are "
        f"not, the first at theta_i {theta_i:.4g}, theta_s {theta_s:.4g}, dphi "
        f"{np.mod(dphi, 360.0):.4g} degrees. Mend it there."
    )
    raise ValueError(msg)


def _asked(function: Callable[..., Any], wavelength: float | None) -> tuple[str, ...]:
    """Return what a function takes beside its angles: wavelength and azimuth."""
    takes = inspect.signature(function).parameters
    asked = ("phi_i",) if "phi_i" in takes else ()
    wave = takes.get("wavelength")
    if wavelength is None:
        if wave is not None and wave.default is wave.empty:
            msg = (
                "wavelength must be given, the source depends on it. Pass wavelength=0.55."
            )
            raise ValueError(msg)
        return asked
    # What passes all on may pass it on to one that asks for it
    anything = any(one.kind is one.VAR_KEYWORD for one in takes.values())
    return (*asked, "wavelength") if wave is not None or anything else asked


def mirrored_sun(
    beam: np.ndarray, at: tuple[float, float], sun: Sun, irradiance: float
) -> np.ndarray:
    """Stokes radiance of the sun in a specular beam, seen from (theta, phi).

    `beam` (4, 4) is its Mueller reflectance. Where the mirror direction lies in the disc it
    is the radiance of the disc, dimmed by the surface.
    """
    theta, phi = at
    if _angle(theta, phi + pi, sun.theta, sun.phi) > sun.radius:
        return np.zeros(4)
    return np.asarray(irradiance / (pi * np.sin(sun.radius) ** 2) * beam[:, 0])


def _rough(integrand: Any, low: list[float], high: list[float]) -> np.ndarray:
    """Integral over a box by a fixed rule, for the scale of the error."""
    node, weight = np.polynomial.legendre.leggauss(16)
    x, y = (a + (b - a) * (0.5 + 0.5 * node) for a, b in zip(low, high, strict=True))
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    both = 0.25 * np.outer(weight, weight).ravel()
    return np.asarray((integrand(points) * both[:, None]).sum(0))


def _angle(theta_a: float, phi_a: float, theta_b: float, phi_b: float) -> float:
    """Angle between two directions, exact also for small ones."""
    from pbrdf.conventions import direction

    a, b = direction(theta_a, phi_a), direction(theta_b, phi_b)
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
