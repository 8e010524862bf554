"""What a scan and a surface leave open, in words."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

    from fitting.statistics.result import SurfaceStatistics

__all__ = ["what_is_not_read"]


def what_is_not_read(
    measurement: "xr.Dataset", statistics: "SurfaceStatistics"
) -> Iterator[str]:
    """Name what this scan and this surface cannot tell."""
    names = {
        str(name) for name in measurement.data_vars if not str(name).endswith("_stderr")
    }
    polarised = names - {"M00"}
    if not polarised:
        yield (
            "Only unpolarised reflectance was measured. M10 and DOLP of both curves follow "
            "from the index that was given; no measurement supports them. specular_gain "
            "and diffuse_albedo are told apart by the shape of M00 alone."
        )
    if names == {"DOLP"}:
        yield (
            "Only DOLP was measured. It fixes the ratio of diffuse_albedo to "
            "specular_gain, and neither of the two."
        )
    if polarised and not any("3" in name[1:] for name in polarised if name[0] == "M"):
        yield "No element with V was measured; the circular part is a prediction."
    if np.unique(measurement.theta_i.values.round(6)).size == 1:
        yield "One incidence was measured; others are predictions."
    if not np.isfinite(statistics.slope_rms.stderr):
        yield "The surface does not determine the slope; it was fitted to the scan instead."
