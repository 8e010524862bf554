"""Which readings of a scan to leave out, each reason as a mask for `fit(mask=...)`.

A mask takes a goniometer Dataset and returns what to keep: a boolean array over `geometry`,
or a Dataset of boolean arrays for single observables.
"""

from typing import TYPE_CHECKING

import numpy as np

from fitting.readings.observations import Mask

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["blocked_detector", "grazing", "saturated", "zeros"]


def blocked_detector(half_angle: float) -> Mask:
    """Leave out directions within `half_angle` of retro-reflection. [rad]

    The detector of a goniometer shades the source there, or the source the detector.
    """

    def keep(scan: "xr.Dataset") -> np.ndarray:
        across = np.sin(scan.theta_i) * np.sin(scan.theta_s) * np.cos(scan.dphi)
        cosine = np.cos(scan.theta_i) * np.cos(scan.theta_s) + across
        return np.asarray(cosine.values < np.cos(half_angle))

    return keep


def grazing(limit: float) -> Mask:
    """Leave out scattered zeniths above `limit`, where the spot leaves the sample. [rad]"""

    def keep(scan: "xr.Dataset") -> np.ndarray:
        return np.asarray(scan.theta_s.values <= limit)

    return keep


def saturated(limit: float) -> Mask:
    """Leave out directions whose M00 reaches `limit`, a peak cut off. [1/sr]"""

    def keep(scan: "xr.Dataset") -> np.ndarray:
        return ~np.asarray(scan["M00"].values >= limit)

    return keep


def zeros() -> Mask:
    """Leave out exact zeros, which in some formats mean "not measured"."""

    def keep(scan: "xr.Dataset") -> "xr.Dataset":
        names = [name for name in scan.data_vars if not str(name).endswith("_stderr")]
        return scan[names] != 0.0

    return keep
