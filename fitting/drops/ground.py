"""The substrate beside a drop: a line, or an arc of a circle, through its border."""

from dataclasses import dataclass

import numpy as np

# A curve is taken for the line where it lowers the squared misses by so many of their
# variances
CLEARER = 12.0
# Neighbouring points share blur and roughness: one in so many is independent
SHARED = 10


@dataclass(frozen=True)
class Ground:
    """The line between the contacts, and how the substrate leaves it.

    Parameters
    ----------
    level, slope : float
        Of the line, at the middle. [pixels], [1]
    bend : float
        Angle of the substrate's tangents with it, positive where it rises beside the drop.
        [rad]
    level_error, slope_error : float
        Standard errors of the level, and of the tangents. [pixels], [rad]
    """

    level: float
    slope: float
    bend: float
    level_error: float
    slope_error: float


def fit_ground(border: np.ndarray, middle: float, width: float, order: int) -> Ground:
    """Fit the border of the substrate on both sides of a drop.

    Parameters
    ----------
    border : ndarray, shape (n, 2)
        x to the right and y up. [pixels]
    middle, width : float
        Of the drop's base. [pixels]
    order : int
        1 for a line, unless a circle fits better; 2 for a circle.
    """
    x, y = border[:, 0] - middle, border[:, 1]
    straight, bent = _fit(x, y, 1), _fit(x, y, 2)
    if order == 1 and len(x) / SHARED * ((straight[2] / bent[2]) ** 2 - 1) < CLEARER:
        curve, kept, spread = straight
    else:
        curve, kept, spread = bent
    order = len(curve) - 1
    curvature = 2 * curve[0] if order == 2 else 0.0
    half = width / 2
    # Of a curved substrate the line between the contacts is the baseline
    ends = np.polyval(curve, [-half, half]) + beyond_parabola(np.array([half]), curvature)
    # Powers of x over the width, so that their squares may be inverted
    powers = np.vander(x[kept] / width, order + 1)
    count = max(np.count_nonzero(kept) / SHARED, 3)
    covariance = spread**2 / count * np.linalg.inv(powers.T @ powers / len(powers))
    tangent = np.array([1.0, 1.0, 0.0] if order == 2 else [1.0, 0.0]) / width
    at_middle = np.array([0.25, 0.0, 1.0] if order == 2 else [0.0, 1.0])
    return Ground(
        level=float(ends.mean()),
        slope=float((ends[1] - ends[0]) / width),
        bend=float(np.arcsin(np.clip(curvature * half, -0.9, 0.9))),
        level_error=float(np.sqrt(at_middle @ covariance @ at_middle)),
        slope_error=float(np.sqrt(tangent @ covariance @ tangent)),
    )


def _fit(x: np.ndarray, y: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the polynomial, the points it keeps, and their spread."""
    kept = np.ones(x.size, dtype=bool)
    curvature = 0.0
    for _ in range(5):
        height = y - beyond_parabola(x, curvature)
        curve = np.polyfit(x[kept], height[kept], order)
        curvature = 2 * curve[0] if order == 2 else 0.0
        residual = np.abs(height - np.polyval(curve, x))
        spread = float(1.4826 * np.median(residual[kept]) + 0.02)
        kept = residual < 3.5 * spread
    return curve, kept, spread


def beyond_parabola(x: np.ndarray, curvature: float) -> np.ndarray:
    """Height of a circle over the parabola of its curvature. [pixels]"""
    if abs(curvature) < 1e-9:
        return np.zeros_like(x)
    turned = np.clip(curvature * x, -0.95, 0.95)
    return (1 - np.sqrt(1 - turned**2) - turned**2 / 2) / curvature
