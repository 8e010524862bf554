"""Surfaces that no correction applies to: exact planes, and discrete heights."""

from dataclasses import replace
from typing import cast

import numpy as np

from fitting.estimate import Estimate
from fitting.statistics.axis.fit import AxisFit
from fitting.statistics.axis.parts import Autocorrelation, AxisStatistics, PlainStatistics
from fitting.statistics.gaussianity import Gaussianity
from fitting.statistics.result import SurfaceStatistics

Array = np.ndarray

# What is left of a plane by the rounding of its numbers
_ROUNDING = 1e-10
# A surface of two levels may be a wave of steps, or one rounded beyond recognition; more
# levels are what coarse rounding leaves, which is corrected
_FEW_LEVELS = 2
_ONE_STEP = 0.95
_BLOCKS = 16
TWO_LEVELS = "they have two levels only"


def is_flat(residual: Array, heights: Array) -> bool:
    """Tell whether nothing is left of the heights when their form is taken off."""
    known = heights[np.isfinite(heights)]
    left = residual[np.isfinite(residual)]
    scale = max(float(np.ptp(known)), 1e-6 * float(np.abs(known).max()))
    return bool(np.abs(left).max() <= _ROUNDING * scale)


def flat_statistics(
    kind: str, residual: Array, spacing: tuple[float, ...], form: str
) -> SurfaceStatistics:
    """Return the statistics of a surface that its form describes exactly: zeros."""
    zero, unknown = Estimate(0.0, 0.0, 0.0, 0.0), Estimate.undetermined(np.nan)
    one = np.ones(1)
    none = Autocorrelation(
        form="flat", description="none: the heights are those of the form",
        parameters={}, lag=np.zeros(1), measured=one, fitted=one,
    )  # fmt: skip
    axes = tuple(
        AxisStatistics(
            axis=name, corr_length=unknown, slope_rms=zero, curvature_rms=zero,
            cutoff=2 * step, autocorrelation=none, spacing=step, length=step * n,
            plain_corr_length=np.nan, fit=cast(AxisFit, None),
        )
        for name, step, n in zip("xy", spacing, residual.shape, strict=False)
    )  # fmt: skip
    return SurfaceStatistics(
        kind=kind, height_rms=zero, corr_length=unknown, slope_rms=zero, noise_rms=zero,
        curvature_rms=zero, gaussianity=Gaussianity(unknown, unknown, 0.0, np.nan),
        anisotropy=None, axes=axes, quantisation=0.0, cutoff=2 * max(spacing),
        correlation_lengths=np.nan, n_points=int(np.isfinite(residual).sum()), form=form,
        plain=PlainStatistics(height_rms=0.0, corr_length=np.nan, slope_rms=0.0),
        warnings=(
            f"nothing is left of the heights when their form ({form}) is taken off: the "
            "surface is exact to the digits of its file",
        ),
        reliable=True, residual=np.zeros_like(residual), spacing=spacing,
    )  # fmt: skip


def discrete_heights(heights: Array) -> str | None:
    """Say why heights are discrete by themselves and not by rounding, or None.

    A surface of few levels (a square wave), or one whose neighbours all differ by one step
    (facets on a lattice), has its steps in the surface.
    """
    known = heights[np.isfinite(heights)]
    tolerance = 1e-6 * float(np.ptp(known))
    levels = 1 + int(np.sum(np.diff(np.sort(known)) > tolerance))
    if levels <= _FEW_LEVELS:
        return TWO_LEVELS
    for axis in range(heights.ndim):
        steps = np.abs(np.diff(heights, axis=axis))
        steps = steps[np.isfinite(steps)]
        usual = float(np.median(steps)) if steps.size else 0.0
        same = np.abs(steps - usual) <= 1e-3 * usual
        if usual > tolerance and same.mean() > _ONE_STEP:
            return f"neighbours differ by {usual:.3g} um almost everywhere"
    return None


def without_rounding(found: SurfaceStatistics, reason: str) -> SurfaceStatistics:
    """Return statistics of discrete heights as they are: no noise and no rounding off them.

    Parameters
    ----------
    found : SurfaceStatistics
        Of the same heights, taken as not rounded.
    reason : str
        Why they are discrete.
    """
    known = found.residual[np.isfinite(found.residual)]
    height = float(np.sqrt(np.mean(known**2)))
    error = found.height_rms.stderr / max(found.height_rms.value, 1e-300)
    slopes = [_slope(found.residual, axis, step) for axis, step in enumerate(found.spacing)]
    axes = tuple(
        replace(one, slope_rms=slope) for one, slope in zip(found.axes, slopes, strict=True)
    )
    values = np.array([slope.value for slope in slopes])
    total = float(np.sqrt(np.mean(values**2)))
    errors = np.array([slope.stderr for slope in slopes])
    log = (
        2 * float(np.sqrt(np.sum((values * errors) ** 2))) / max(np.sum(values**2), 1e-300)
    )
    text = (
        f"heights are discrete: {reason}; rounding and noise are not taken off, heights "
        "and slopes are those of the points as they are"
    )
    return replace(
        found,
        height_rms=Estimate.root_mean_square(height, 4 * min(error, 1.0) ** 2),
        slope_rms=Estimate.root_mean_square(total, log**2),
        noise_rms=Estimate(0.0, 0.0, 0.0, 0.0),
        axes=axes,
        quantisation=0.0,
        warnings=(text, *found.warnings),
        # Of a surface rounded to two levels nothing is known
        reliable=found.reliable and reason != TWO_LEVELS,
    )


def _slope(residual: Array, axis: int, step: float) -> Estimate:
    """Root mean square of forward differences, its error from blocks along the axis."""
    squares = np.moveaxis(np.diff(residual, axis=axis) / step, axis, 0) ** 2
    parts = [part[np.isfinite(part)] for part in np.array_split(squares, _BLOCKS)]
    means = np.array([part.mean() for part in parts if part.size])
    mean = float(np.nanmean(squares))
    if mean == 0 or means.size < 2:
        return Estimate(
            float(np.sqrt(mean)), 0.0, float(np.sqrt(mean)), float(np.sqrt(mean))
        )
    log_variance = float(means.var(ddof=1)) / means.size / mean**2
    return Estimate.root_mean_square(float(np.sqrt(mean)), log_variance)
