"""From statistics to a surface that the simulation can draw."""

from typing import TYPE_CHECKING

import numpy as np
from scipy import special

from fitting.statistics.axis.autocorrelation import Correlation

if TYPE_CHECKING:
    from pbrdf.surface import GaussianSurface, MeasuredSurface

Array = np.ndarray

_SCORES = np.linspace(-3, 3, 25)


def gaussian_surface(
    shape: tuple[int, int],
    spacing: float | tuple[float, float],
    *,
    corr_length: float | tuple[float, float],
    slope_rms: float,
) -> "GaussianSurface":
    """Gaussian surface with the measured slope and correlation length.

    The slope decides the reflectance, so it is the one kept; height_rms follows from the
    Gaussian form.
    """
    from pbrdf.surface import GaussianSurface

    return GaussianSurface(
        shape=shape, spacing=spacing, corr_length=corr_length, slope_rms=slope_rms
    )


def measured_surface(
    shape: tuple[int, int],
    spacing: float | tuple[float, float],
    *,
    corr_length: float | tuple[float, float],
    height_rms: float,
    correlation: Correlation,
    heights: Array | None,
) -> "MeasuredSurface":
    """Surface with the fitted autocorrelation, and the histogram of `heights` if given.

    Noise and rounding are left out of the autocorrelation. The height distribution is that
    of the residual heights, so it keeps what little shape noise adds.
    """
    from pbrdf.surface import MeasuredSurface

    lags = np.geomspace(1e-3, 8, 160)
    rho = np.minimum(correlation.rho(lags * correlation.corr_length), 1 - 1e-12)
    return MeasuredSurface(
        shape=shape,
        spacing=spacing,
        height_rms=height_rms,
        corr_length=corr_length,
        lags=tuple(lags),
        autocorrelation=tuple(rho),
        quantiles=None if heights is None else tuple(_quantiles(heights)),
    )


def _quantiles(residual: Array) -> Array:
    """Heights in units of their rms at normal scores -3 to 3, strictly rising."""
    heights = residual[np.isfinite(residual)]
    values = np.quantile(heights, special.ndtr(_SCORES)) / heights.std()
    # Rounded heights repeat; a thousandth of the rms keeps the curve monotone
    return np.asarray(np.maximum.accumulate(values + 1e-3 * (_SCORES + 3)))
