"""The joint law of the heights and slopes of one facet of a Gaussian surface."""

from functools import lru_cache

import numpy as np

from pbrdf.kernels.sights.light import SlopeLaw
from pbrdf.kernels.sights.looks import Ensemble
from pbrdf.kernels.sights.walk import Reach
from pbrdf.surface import GaussianSurface

__all__ = ["facet_ensemble"]


# Runs that differ in their seeds or rays share it
@lru_cache(maxsize=16)
def facet_ensemble(surface: GaussianSurface) -> Ensemble:
    """Law of three corners of a facet, exact for the mesh."""
    pitch = np.broadcast_to(np.asarray(surface.spacing, dtype=float), (2,))
    height = surface.ensemble_height_rms
    along_x, along_y = surface.correlation(0), surface.correlation(1)
    c_x, c_y = along_x[1], along_y[1]
    # Corners (0, 0), (1, 0), (1, 1) and (0, 0), (0, 1), (1, 1); slopes and their mean
    step_x, step_y = 1.0 / pitch
    first, second = np.array([-1.0, 1.0, 0.0]), np.array([0.0, -1.0, 1.0])
    inverse, regression, remainder = np.empty((2, 3, 3)), np.empty((2, 2)), np.empty(2)
    stride = max(4, int(np.min(np.broadcast_to(surface.corr_length, 2) / pitch) / 2))
    half = min(surface.shape) // 2 - 1
    reaches = np.empty((2, -(-half // stride), 2, 3))
    slopes = np.empty((2, 2))
    for k in range(2):
        one, other = (c_x, c_y) if k == 0 else (c_y, c_x)
        among = np.array(
            [[1.0, one, c_x * c_y], [one, 1.0, other], [c_x * c_y, other, 1.0]]
        )
        inverse[k] = np.linalg.inv(among)
        gradients = np.array(
            [first * step_x, second * step_y]
            if k == 0
            else [second * step_x, first * step_y]
        )
        mean = np.full(3, 1.0 / 3.0)
        slopes = gradients @ among @ gradients.T * height**2
        shared = gradients @ among @ mean * height**2
        regression[k] = np.linalg.solve(slopes, shared)
        remainder[k] = np.sqrt(mean @ among @ mean * height**2 - shared @ regression[k])
        corners = np.linalg.inv(np.vstack([gradients, mean]))
        # Corner heights for a unit of slope x, slope y or lift
        for m, change in enumerate(
            ((1.0, 0.0, regression[k, 0]), (0.0, 1.0, regression[k, 1]), (0.0, 0.0, 1.0))
        ):
            factors = inverse[k] @ corners @ change
            reaches[k, ..., m] = _reach(factors, along_x, along_y, k == 0, stride)
    (xx, xy), (_, yy) = slopes
    determinant = xx * yy - xy * xy
    law = SlopeLaw(
        yy / determinant, -xy / determinant, xx / determinant,
        1.0 / (2.0 * np.pi * np.sqrt(determinant)), xx, xy, yy,
    )  # fmt: skip
    return Ensemble(
        law,
        pitch[0],
        pitch[1],
        inverse,
        regression,
        remainder,
        Reach(float(stride), float(half), reaches.max(axis=0)),
    )


def _reach(
    factors: np.ndarray, along_x: np.ndarray, along_y: np.ndarray, low: bool, stride: int
) -> np.ndarray:
    """Largest height and rise of the bending beyond each stride (strides, 2).

    The corners of a facet change by `factors` of the correlation about them.
    """
    x_here, y_here = along_x[:, None], along_y[None, :]
    x_back, y_back = np.roll(x_here, 1), np.roll(y_here, 1)
    middle = x_back * y_here if low else x_here * y_back
    change = (
        factors[0] * x_here * y_here + factors[1] * middle + factors[2] * x_back * y_back
    )
    rise = np.abs(np.roll(change, -1, axis=0) - change)
    rise += np.abs(np.roll(change, -1, axis=1) - change)
    # A node and its neighbours: one less far than it is
    steps = [np.minimum(np.arange(n), n - np.arange(n)) for n in change.shape]
    far = np.maximum(steps[0][:, None], steps[1][None, :]) + 2
    half = min(change.shape) // 2 - 1
    return np.array(
        [
            [np.abs(change[far >= first]).max(), rise[far >= first].max()]
            for first in range(0, half, stride)
        ]
    )
