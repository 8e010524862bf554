"""How far a curve of M00 is from a scan: absolute, and with the gains freed afterwards."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

Array = np.ndarray


@dataclass(frozen=True, kw_only=True)
class Misfit:
    """Root mean squares of (curve - scan)/scan over the readings counted.

    Parameters
    ----------
    absolute : float
        As predicted.
    base_free : float
        With the Lambertian albedo `base` that suits best, gain 1.
    gain_free : float
        With `gain` and `gain_base` that suit best, both >= 0.
    count : int
        Readings.
    """

    absolute: float
    base_free: float
    base: float
    gain_free: float
    gain: float
    gain_base: float
    count: int


def misfit(curve: Array, measured: Array) -> Misfit:
    """Compare a predicted M00 with a measured one, both [1/sr]; measured > 0."""
    columns = np.stack([curve, np.full(curve.shape, 1 / np.pi)], axis=-1)
    columns = columns / measured[:, None]
    lacking = 1 - columns[:, 0]
    base = max(float(columns[:, 1] @ lacking / (columns[:, 1] @ columns[:, 1])), 0.0)
    best, left = nnls(columns, np.ones(measured.size))

    def rms(values: Array) -> float:
        return float(np.sqrt(np.mean(values**2)))

    return Misfit(
        absolute=rms(lacking), base_free=rms(lacking - base * columns[:, 1]), base=base,
        gain_free=float(left / np.sqrt(measured.size)), gain=float(best[0]),
        gain_base=float(best[1]), count=measured.size,
    )  # fmt: skip
