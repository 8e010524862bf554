"""Shapes of bodies that lie on a plane: spheres and spherical caps."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize_scalar

from pbrdf.kernels.bodies.profile import moment_between, radius_squared, widest_above


@dataclass(frozen=True, eq=False)
class Shape:
    """Convex body of revolution cut by the plane z = 0, as a stack of quadric slabs.

    Attributes
    ----------
    slabs : ndarray, shape (m, 5)
        low, high, a, b, c of each, from below: r² = a + b s + c s² for heights s between
        low and high above the plane. [um]
    """

    slabs: np.ndarray

    @cached_property
    def bottom(self) -> float:
        """Lowest point, of the part under the plane. [um]"""
        return float(self.slabs[0, 0])

    @cached_property
    def height(self) -> float:
        """Height above the plane. [um]"""
        return float(self.slabs[-1, 1])

    @cached_property
    def base_radius(self) -> float:
        """Radius of the wetted circle on the plane. [um]"""
        return float(np.sqrt(max(radius_squared(self.slabs, 0.0), 0.0)))

    @cached_property
    def radius(self) -> float:
        """Largest radius above the plane. [um]"""
        return float(widest_above(self.slabs, 0.0))

    @property
    def curvature(self) -> float:
        """Radius of curvature at the top. [um]"""
        _, top, _, b, c = self.slabs[-1]
        return float(-0.5 * (b + 2 * c * top))

    @cached_property
    def whole_volume(self) -> float:
        """Volume of the whole body. [um³]"""
        return float(2 * np.pi * moment_between(self.slabs, self.bottom, self.height))

    @cached_property
    def sunk_volume(self) -> float:
        """Volume of the part under the plane. [um³]"""
        return float(2 * np.pi * moment_between(self.slabs, self.bottom, 0.0))

    @cached_property
    def volume(self) -> float:
        """Volume above the plane. [um³]"""
        return float(2 * np.pi * moment_between(self.slabs, 0.0, self.height))

    def above(self, level: float) -> "Shape":
        """Return the part above a height, in two slabs or more. [um]"""
        kept = np.array(self.slabs[self.slabs[:, 1] > level])
        kept[0, 0] = max(kept[0, 0], level)
        if len(kept) == 1 and kept[0, 0] > self.bottom:
            # One slab alone is taken for a closed quadric
            kept = np.repeat(kept, 2, axis=0)
            kept[0, 1] = kept[1, 0] = 0.5 * (kept[0, 0] + kept[1, 1])
        return Shape(kept)


def sphere(radius: float, centre: float) -> Shape:
    """Sphere whose centre lies at a height above the plane, or below. [um]"""
    constant = (radius - centre) * (radius + centre)
    slab = [centre - radius, centre + radius, constant, 2 * centre, -1.0]
    return Shape(np.array([slab]))


def cap(volume: float, contact_angle: float) -> Shape:
    """Spherical cap of a volume [um³] that meets the plane at a contact angle [rad].

    The body is the whole sphere, of which the plane leaves the cap.
    """
    radius = float(cap_radius(volume, contact_angle))
    # Both ends without cancellation: R (1 ± cos θ)
    low = -2 * radius * np.cos(contact_angle / 2) ** 2
    high = 2 * radius * np.sin(contact_angle / 2) ** 2
    base = radius * np.sin(contact_angle)
    return Shape(
        np.array([[low, high, base**2, -2 * radius * np.cos(contact_angle), -1.0]])
    )


def cap_volume(radius: npt.ArrayLike, contact_angle: npt.ArrayLike) -> np.ndarray:
    """Volume of a cap of a sphere: V = (π R³ / 3)(2 + cos θ)(1 - cos θ)². [um³]

    Examples
    --------
    A hemisphere:

    >>> round(float(cap_volume(1.0, np.pi / 2)), 6)
    2.094395
    """
    # 1 - cos θ without cancellation at small angles
    versine = 2 * np.sin(np.asarray(contact_angle) / 2) ** 2
    cubed = np.asarray(radius, dtype=np.float64) ** 3
    volume: np.ndarray = np.pi / 3 * cubed * (2 + np.cos(contact_angle)) * versine**2
    return volume


def cap_radius(volume: npt.ArrayLike, contact_angle: npt.ArrayLike) -> np.ndarray:
    """Radius of the sphere of a cap: R = (3 V / π (2 + cos θ)(1 - cos θ)²)^(1/3). [um]

    Examples
    --------
    >>> cap_radius(1.0, np.deg2rad([15.0, 90.0, 179.0])).round(5)
    array([6.52109, 0.78159, 0.62035])
    """
    radius: np.ndarray = np.cbrt(np.asarray(volume) / cap_volume(1.0, contact_angle))
    return radius


def seen_radius(radius: npt.ArrayLike, contact_angle: npt.ArrayLike) -> np.ndarray:
    """Radius of a cap as seen from above: R sin θ up to 90 degrees, then R. [um]"""
    sine = np.where(
        np.asarray(contact_angle) < np.pi / 2, np.sin(contact_angle), 1.0
    )  # fmt: skip
    seen: np.ndarray = np.asarray(radius) * sine
    return seen


def contact_depth(one: Shape, other: Shape, rise: float) -> float:
    """Distance of the axes at which two bodies touch, the other one higher by `rise`. [um]

    The largest sum of both radii at one height. Radii of convex bodies are concave
    functions of the height, so that there is one maximum.
    """
    low = max(one.bottom, other.bottom + rise)
    high = min(one.height, other.height + rise)
    if low >= high:
        return 0.0

    def apart(height: float) -> float:
        squares = (
            radius_squared(one.slabs, height),
            radius_squared(other.slabs, height - rise),
        )
        return -float(sum(np.sqrt(max(square, 0.0)) for square in squares))

    found = minimize_scalar(
        apart, bounds=(low, high), method="bounded", options={"xatol": 1e-9 * (high - low)}
    )
    return -float(found.fun)
