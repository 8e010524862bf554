"""Drops on a plane, flattened by gravity where it matters."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from scipy.optimize import brentq

from pbrdf.contaminants.shapes import Shape, cap, cap_radius, cap_volume, seen_radius
from pbrdf.kernels.bodies.sessile import N_POINT, PHI, VOLUME, X, Z, trace_profile

# Step along the profile, about an angle in radians: the rule is of fourth order
STEP = 0.01
# Least distance of the slabs from the true profile, relative to the size of the drop
TOLERANCE = 1e-6
# Apex radii beyond this many capillary lengths are those of puddles, flat to rounding
LARGEST_APEX = 1e6
# The profile is followed to this angle at most; beyond it is horizontal
STEEPEST = np.pi - 1e-3

# Above this Bond number heights change by more than about a third of a per cent
BOND = 0.01
_NO_POINTS = np.empty((0, N_POINT))


def bond_number(volume: float, capillary_length: float) -> float:
    """Bo = (R / l)², with the radius R of the sphere of this volume. [1]

    Examples
    --------
    Water drops of a quarter of a millimetre are still caps:

    >>> round(bond_number(4 / 3 * np.pi * 250.0**3, 2725.7), 4)
    0.0084
    """
    return float(np.cbrt(3 * volume / (4 * np.pi)) / capillary_length) ** 2


def flattened(volume: float, contact_angle: float, capillary_length: float) -> Shape:
    """Drop on a plane by the Young-Laplace equation, as a stack of quadric slabs.

    Below the plane the body goes on as the sphere that touches the profile there.

    Parameters
    ----------
    volume : float
        Volume above the plane. [um³]
    contact_angle : float
        Contact angle, in (0, π]. [rad]
    capillary_length : float
        √(γ/ρg). [um]

    Raises
    ------
    ValueError
        If the drop is a puddle, wider than about 15 capillary lengths.

    Examples
    --------
    A water drop of 1 mm radius at 90 degrees is 3 % lower than its cap:

    >>> drop = flattened(4 / 3 * np.pi * 1e9, np.pi / 2, 2725.7)
    >>> round(drop.height / cap(4 / 3 * np.pi * 1e9, np.pi / 2).height, 3)
    0.97
    """
    target = volume / capillary_length**3
    end = min(contact_angle, STEEPEST)

    def excess(log_apex: float) -> float:
        _, found = trace_profile(np.exp(log_apex), end, STEP, _NO_POINTS)
        return float(np.log(found / target))

    # Gravity flattens the apex, so that its radius exceeds that of the cap
    low = float(np.log(0.9 * cap_radius(target, end)))
    high = low + 0.5
    while excess(high) < 0.0:
        high += 1.0
        if high > np.log(LARGEST_APEX):
            msg = (
                f"volume must be that of a drop [um³], got {volume:.4g}, a puddle wider "
                f"than 15 capillary lengths of {capillary_length:g} um. Lay a Film."
            )
            raise ValueError(msg)
    apex = float(np.exp(brentq(excess, low, high, xtol=1e-14, rtol=1e-14)))
    count, _ = trace_profile(apex, end, STEP, _NO_POINTS)
    points = np.empty((count, N_POINT))
    trace_profile(apex, end, STEP, points)

    # What is left of the tolerance of the root goes into the scale: V to rounding
    scale = float(np.cbrt(volume / points[-1, VOLUME]))
    x, phi = points[:, X] * scale, points[:, PHI]
    height = (points[-1, Z] - points[:, Z]) * scale
    slope = np.full(count, -2 * apex * scale)
    slope[1:] = -2 * x[1:] * np.cos(phi[1:]) / np.sin(phi[1:])
    order = slice(None, None, -1)
    slabs = quadric_slabs(height[order], x[order] ** 2, slope[order])
    shape = Shape(np.vstack([_tangent_sphere(x[-1] ** 2, slope[-1]), slabs]))
    # The slabs hold the volume to their tolerance; a last scale makes it exact
    return _scaled(shape, float(np.cbrt(volume / shape.volume)))


def quadric_slabs(height: np.ndarray, squared: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Quadratic spline through squared radii with their slopes, as slabs (m, 5).

    Takes as few of the rising heights as the tolerance allows. Between two of them two
    parabolas meet in the middle (Schumaker, SIAM J. Numer. Anal. 20, 854, 1983), so that
    value and slope are continuous.
    """
    size = max(height[-1], float(np.sqrt(squared.max())))
    slabs: list[np.ndarray] = []
    pending = [(0, len(height) - 1)]
    while pending:
        first, last = pending.pop()
        pair = _two_parabolas(height, squared, slope, first, last)
        inner = slice(first, last + 1)
        off = _value(pair, height[inner]) - squared[inner]
        # Distance along the normal, from r² = q(s): δq / √(4 q + q'²)
        distance = np.abs(off) / np.sqrt(4 * squared[inner] + slope[inner] ** 2)
        if last - first < 2 or distance.max() <= TOLERANCE * size:
            slabs.append(pair)
        else:
            middle = (first + last) // 2
            pending += [(middle, last), (first, middle)]
    return np.vstack(slabs)


def _two_parabolas(
    height: np.ndarray, squared: np.ndarray, slope: np.ndarray, first: int, last: int
) -> np.ndarray:
    low, high = height[first], height[last]
    h = high - low
    middle = 0.5 * (low + high)
    slope_middle = (
        2 * (squared[last] - squared[first]) / h - (slope[first] + slope[last]) / 2
    )
    value_middle = squared[first] + h / 4 * (slope[first] + slope_middle)
    return np.array(
        [
            _parabola(low, middle, low, squared[first], slope[first],
                      (slope_middle - slope[first]) / h),
            _parabola(middle, high, middle, value_middle, slope_middle,
                      (slope[last] - slope_middle) / h),
        ]
    )  # fmt: skip


def _parabola(
    low: float, high: float, at: float, value: float, slope: float, square: float
) -> list[float]:
    """One slab from value, slope and half the second derivative at one height."""
    constant = value - at * (slope - square * at)
    return [low, high, constant, slope - 2 * square * at, square]


def _value(slabs: np.ndarray, height: np.ndarray) -> np.ndarray:
    low, high = slabs
    rows = np.where((height > low[1])[:, None], high, low)
    value: np.ndarray = rows[:, 2] + height * (rows[:, 3] + height * rows[:, 4])
    return value


def _tangent_sphere(squared: float, slope: float) -> np.ndarray:
    """Slab of the sphere below the plane that has this squared radius and slope on it."""
    low = 0.5 * (slope - np.sqrt(slope**2 + 4 * squared))
    return np.array([low, 0.0, squared, slope, -1.0])


def _scaled(shape: Shape, factor: float) -> Shape:
    slabs = shape.slabs * np.array([factor, factor, factor**2, factor, 1.0])
    slabs[-1, 1] = _top(slabs[-1])
    return Shape(slabs)


def _top(slab: np.ndarray) -> float:
    """Upper end of the last slab, where its radius is zero to rounding."""
    _, high, a, b, c = slab
    # One Newton step from where the profile says; r² is steep there
    return float(high - (a + high * (b + c * high)) / (b + 2 * c * high))


class ShapeMaker:
    """Shapes of drops of one contact angle on a plane, each volume made once.

    Parameters
    ----------
    contact_angle : float
        Contact angle, in (0, π]. [rad]
    gravity : "auto", True or False
        Flatten drops where gravity matters, always, or never.
    capillary_length : float
        √(γ/ρg). [um]
    """

    def __init__(
        self,
        contact_angle: float,
        gravity: bool | Literal["auto"],
        capillary_length: float,
    ) -> None:
        self.contact_angle = contact_angle
        self._gravity = gravity
        self._capillary_length = capillary_length
        self._known: dict[float, Shape] = {}

    def shape(self, volume: float) -> Shape:
        """Shape of one drop. [um³]"""
        if volume not in self._known:
            heavy = self._gravity is True or (
                self._gravity == "auto"
                and bond_number(volume, self._capillary_length) > BOND
            )
            self._known[volume] = (
                flattened(volume, self.contact_angle, self._capillary_length)
                if heavy
                else cap(volume, self.contact_angle)
            )
        return self._known[volume]

    def shapes(self, volumes: np.ndarray) -> Sequence[Shape]:
        """Shapes of many drops."""
        return [self.shape(float(volume)) for volume in volumes]

    def radius_for(self, thickness: float) -> float:
        """Radius seen from above of drops with this volume per area they cover. [um]"""
        unit = float(seen_radius(1.0, self.contact_angle))
        per_area = float(cap_volume(1.0, self.contact_angle)) / (np.pi * unit**2)
        return unit * thickness / per_area

    def volumes_covering(self, radii: np.ndarray, area: float) -> np.ndarray:
        """Volumes of drops in the ratio of these radii cubed that cover an area [um²]."""
        unit = float(seen_radius(1.0, self.contact_angle))
        scale = np.sqrt(area / (np.pi * np.sum(radii**2))) / unit
        volumes = np.asarray(cap_volume(scale * radii, self.contact_angle))

        def excess(log_factor: float) -> float:
            shapes = self.shapes(volumes * np.exp(log_factor))
            covered = sum(np.pi * shape.radius**2 for shape in shapes)
            return float(np.log(covered / area))

        # Caps cover it at once; flattened drops a little more
        if abs(excess(0.0)) > 1e-12:
            volumes = volumes * np.exp(brentq(excess, -3.0, 0.5, xtol=1e-10))
        return volumes
