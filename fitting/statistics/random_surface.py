"""From statistics to a surface that the simulation can draw."""

from typing import TYPE_CHECKING

import numpy as np
from scipy import special

if TYPE_CHECKING:
    from fitting.statistics.result import SurfaceStatistics
    from pbrdf.surface.gaussian import GaussianSurface
    from pbrdf.surface.measured import MeasuredSurface

Array = np.ndarray

_SCORES = np.linspace(-3, 3, 25)


def gaussian_surface(
    statistics: "SurfaceStatistics",
    shape: tuple[int, int],
    spacing: float | tuple[float, float],
) -> "GaussianSurface":
    """Gaussian surface with the measured slope and correlation length.

    The slope decides the reflectance, so it is the one kept; height_rms follows from the
    Gaussian form. A profile is taken as a cut of an isotropic surface.
    """
    from pbrdf.surface import GaussianSurface

    return GaussianSurface(
        shape=shape,
        spacing=spacing,
        corr_length=_lengths(statistics),
        slope_rms=_known(statistics.slope_rms.value, "slope_rms", statistics),
    )


def measured_surface(
    statistics: "SurfaceStatistics",
    shape: tuple[int, int],
    spacing: float | tuple[float, float],
) -> "MeasuredSurface":
    """Surface with the fitted autocorrelation and, if it is not Gaussian, the histogram.

    The form of the autocorrelation is that of the steeper axis; its length is measured
    along both. Noise and rounding are left out of it. The height distribution is that of
    the residual heights, so it keeps what little shape noise adds.
    """
    from pbrdf.surface.measured import MeasuredSurface

    steeper = max(statistics.axes, key=lambda axis: axis.slope_rms.value)
    correlation = steeper.fit.correlation
    lags = np.geomspace(1e-3, 8, 160)
    rho = np.minimum(correlation.rho(lags * correlation.corr_length), 1 - 1e-12)
    quantiles = None
    if not statistics.gaussianity.is_gaussian:
        quantiles = tuple(_quantiles(statistics))
    return MeasuredSurface(
        shape=shape,
        spacing=spacing,
        height_rms=_known(statistics.height_rms.value, "height_rms", statistics),
        corr_length=_lengths(statistics),
        lags=tuple(lags),
        autocorrelation=tuple(rho),
        quantiles=quantiles,
    )


def _lengths(statistics: "SurfaceStatistics") -> float | tuple[float, float]:
    """One length, or those of x and y where they differ beyond chance."""
    if len(statistics.axes) == 1:
        return statistics.corr_length.value
    x, y = (axis.corr_length for axis in statistics.axes)
    if max(x.low, y.low) < min(x.high, y.high):
        return statistics.corr_length.value
    return x.value, y.value


def _known(value: float, name: str, statistics: "SurfaceStatistics") -> float:
    if statistics.reliable:
        return value
    msg = f"{name} must be determined, got a failed measurement: {statistics.warnings[0]}"
    raise ValueError(msg)


def _quantiles(statistics: "SurfaceStatistics") -> Array:
    """Heights in units of their rms at normal scores -3 to 3, strictly rising."""
    heights = statistics.residual[np.isfinite(statistics.residual)]
    values = np.quantile(heights, special.ndtr(_SCORES)) / heights.std()
    # Rounded heights repeat; a thousandth of the rms keeps the curve monotone
    return np.asarray(np.maximum.accumulate(values + 1e-3 * (_SCORES + 3)))
