"""What a scan and a surface leave open, in words."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

    from fitting.result.fit_result import FitResult
    from fitting.statistics.result import SurfaceStatistics

__all__ = ["what_hangs_together", "what_is_not_read"]

# Correlations, and shares of a variance, that a reader is told of
_TOGETHER = 0.8
_SHARE = 0.1


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


def what_hangs_together(fit: "FitResult") -> Iterator[str]:
    """Name parameters that stand and fall together, and errors that the scan did not make.

    Correlations from 0.8 on; sources, other than the noise of the readings, of a tenth or
    more of a parameter's variance.
    """
    names = list(fit.values)
    for i, j in zip(*np.triu_indices(len(names), 1), strict=True):
        together = float(fit.correlation[i, j])
        pair = f"{names[j]} and {names[i]} are", f"{names[i]} and {names[j]} are"
        warned = any(words in warning for words in pair for warning in fit.warnings)
        if abs(together) >= _TOGETHER and not warned:
            way = "the other is too high" if together > 0 else "the other is too low"
            yield (
                f"{names[i]} and {names[j]} are correlated at {together:.2f}: where one is "
                f"too high, {way}."
            )
    for name, parts in fit.stderr_parts.items():
        whole = float(sum(part**2 for part in parts.values()))
        for source, part in parts.items():
            if source != "noise" and np.isfinite(whole) and part**2 > _SHARE * whole:
                yield (
                    f"The standard error of {name} is {fit.stderr[name]:.2g}, of which "
                    f"{part:.2g} come from the uncertain {source} and "
                    f"{parts.get('noise', 0.0):.2g} from the noise of the readings, added "
                    "in squares."
                )
