"""Texture direction and anisotropy of a height map."""

from dataclasses import dataclass

import numpy as np
from scipy import special

from fitting.estimate import Estimate

Array = np.ndarray

_BLOCKS = 4


@dataclass(frozen=True)
class Anisotropy:
    """Steepest and gentlest direction of a map.

    Parameters
    ----------
    ratio : Estimate
        Slope rms across the texture over slope rms along it, at least 1. [1]
    direction : Estimate
        Angle of the texture (its ridges and grooves run along it, slopes are least), from
        +x counter-clockwise, in (-pi/2, pi/2]; not determined on an isotropic map. [rad]
    p_value : float
        Probability of as large a ratio on an isotropic surface.
    lag : float
        Distance over which increments were taken. [um]
    """

    ratio: Estimate
    direction: Estimate
    p_value: float
    lag: float

    @property
    def is_isotropic(self) -> bool:
        """Whether isotropy is not rejected at the 5 % level."""
        return self.p_value >= 0.05


def measure_anisotropy(
    heights: Array, spacing: tuple[float, float], lag: float, noise: float
) -> Anisotropy:
    """Principal axes of the slope tensor, with errors from blocks of the map.

    Parameters
    ----------
    heights : ndarray, shape (nx, ny)
        Residual heights, NaN where missing. [um]
    spacing : (float, float)
        [um]
    lag : float
        Wanted length of the increments; white noise is taken off their squares. [um]
    noise : float
        Variance of white noise and rounding on each height. [um²]
    """
    near, far = (
        [
            max(1, min(round(stretch * lag / d), n // 16))
            for d, n in zip(spacing, heights.shape, strict=True)
        ]
        for stretch in (1, 2)
    )
    lags = np.array(near) * spacing
    blocks = []
    for rows in np.array_split(heights, _BLOCKS, axis=0):
        for part in np.array_split(rows, _BLOCKS, axis=1):
            tensor = _tensor(part, near, spacing, noise)
            if far == [2 * i for i in near]:
                # What differences over a distance lack of the slope grows as its square
                tensor = (4 * tensor - _tensor(part, far, spacing, noise)) / 3
            blocks.append(tensor)
    tensors = np.array([t for t in blocks if np.isfinite(t).all()])
    if len(tensors) < 4:
        return Anisotropy(
            Estimate.undetermined(np.nan, low=1.0),
            Estimate.undetermined(np.nan, low=-np.pi / 2),
            np.nan,
            lag,
        )
    mean = tensors.mean(axis=0)
    total = max(mean[0] + mean[1], 1e-300)
    # Deviator of the tensor: (xx - yy, 2 xy) / trace turns with twice the texture's angle
    parts = np.column_stack([tensors[:, 0] - tensors[:, 1], 2 * tensors[:, 2]]) / total
    deviator = parts.mean(axis=0)
    # Blocks differ in roughness too; only what turns the axes counts
    own = (tensors[:, 0] + tensors[:, 1]) / total
    scatter = np.cov(parts - own[:, None] * deviator, rowvar=False) / len(tensors)
    size = float(np.clip(np.hypot(*deviator), 1e-12, 0.999999))
    along = deviator / size
    radial = float(np.sqrt(along @ scatter @ along))
    turned = np.array([-along[1], along[0]])
    tangential = float(np.sqrt(turned @ scatter @ turned))
    p_value = _p_value(deviator, scatter, len(tensors))
    # Slopes are least at right angles to the steepest direction
    angle = float(np.angle(np.exp(1j * (np.arctan2(deviator[1], deviator[0]) + np.pi))) / 2)
    if p_value < 0.05:
        direction = Estimate.symmetric(angle, tangential / (2 * size))
    else:
        direction = Estimate(angle, np.inf, -np.pi / 2, np.pi / 2)
    ends = [_ratio(np.clip(size + k * radial, 0, 0.999999)) for k in (0, -1.96, 1.96)]
    stderr = (ends[2] - ends[1]) / (2 * 1.96)
    ratio = Estimate(ends[0], stderr, ends[1] if p_value < 0.05 else 1.0, ends[2])
    return Anisotropy(ratio, direction, p_value, float(np.sqrt(np.prod(lags))))


def _ratio(size: float) -> float:
    return float(np.sqrt((1 + size) / (1 - size)))


def _p_value(deviator: Array, scatter: Array, n: int) -> float:
    """Hotelling's test that the deviator is zero."""
    squared = float(deviator @ np.linalg.solve(scatter + 1e-12 * np.eye(2), deviator))
    return float(special.fdtrc(2, n - 2, squared * (n - 2) / (2 * (n - 1))))


def _tensor(
    part: Array, steps: list[int], spacing: tuple[float, float], noise: float
) -> Array:
    """Mean squares and product of slopes (xx, yy, xy) of one block. [1]"""
    i, j = steps
    nx, ny = part.shape
    if nx <= i + 1 or ny <= j + 1:
        return np.full(3, np.nan)
    a, b = i * spacing[0], j * spacing[1]
    xx = _mean_square(part[i:] - part[:-i])
    yy = _mean_square(part[:, j:] - part[:, :-j])
    # D(a, b) - D(a, -b) = 4 a b <z_x z_y>; white noise drops out of the difference
    rising = _mean_square(part[i:, j:] - part[:-i, :-j])
    falling = _mean_square(part[i:, :-j] - part[:-i, j:])
    return np.array(
        [(xx - 2 * noise) / a**2, (yy - 2 * noise) / b**2, (rising - falling) / (4 * a * b)]
    )


def _mean_square(difference: Array) -> float:
    known = np.isfinite(difference)
    return float(np.mean(difference[known] ** 2)) if known.any() else np.nan
