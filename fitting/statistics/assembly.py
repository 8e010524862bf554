"""Put the axes of a surface together into its statistics."""

from dataclasses import dataclass

import numpy as np

from fitting.estimate import Estimate
from fitting.statistics.axis.estimate import height_rms
from fitting.statistics.axis.fit import AxisFit
from fitting.statistics.axis.parts import AxisStatistics, PlainStatistics
from fitting.statistics.axis.scatter import mean_power_of_correlation
from fitting.statistics.gaussianity import judge_gaussianity
from fitting.statistics.result import SurfaceStatistics
from fitting.statistics.texture import measure_anisotropy
from fitting.statistics.warnings import Findings, warnings_for

Array = np.ndarray

# Estimates along x and y of one isotropic map share a third of their variance: the ratio of
# the integrals of (d²ρ/dxdy)² and (d²ρ/dx²)² for a Gaussian autocorrelation
_SHARED = 1 / 3


@dataclass(frozen=True)
class _Counts:
    """Independent samples of a map or profile for powers of the autocorrelation."""

    skewness: float
    kurtosis: float


def _independent(axes: tuple[AxisStatistics, ...]) -> _Counts:
    share = [1.0, 1.0]
    for axis in axes:
        for i, power in enumerate((3, 4)):
            share[i] *= mean_power_of_correlation(axis.fit.correlation, axis.length, power)
    return _Counts(1 / share[0], 1 / share[1])


def assemble(
    kind: str,
    axes: tuple[AxisStatistics, ...],
    residual: Array,
    spacing: tuple[float, ...],
    *,
    form: str,
    step: float,
) -> SurfaceStatistics:
    """Combine the axes, judge the heights and collect what a user must be told.

    Parameters
    ----------
    kind : str
        ``profile`` or ``map``.
    axes : tuple of AxisStatistics
        One, or those of x and y.
    residual : ndarray
        Heights without their form. [um]
    spacing : tuple of float
        Along each axis. [um]
    form : str
        What was removed.
    step : float
        Rounding step. [um]
    """
    fits = [axis.fit for axis in axes]
    height = height_rms(fits, step)
    slope = _combine([axis.slope_rms for axis in axes], 2)
    counts = _independent(axes)
    steps = [a.fit.increments for a in axes]
    sampling_slope = np.sqrt(np.mean([s.mean_square[0] / s.lags[0] ** 2 for s in steps]))
    noise = _noise_rms(fits)
    known = int(np.isfinite(residual).sum())
    anisotropy = None
    if kind == "map":
        finest = min(a.corr_length.value for a in axes) / 5
        variance = noise.value**2 + step**2 / 12
        anisotropy = measure_anisotropy(
            residual, (spacing[0], spacing[1]), finest, variance
        )
    findings = Findings(
        kind=kind,
        height=height,
        slope=slope,
        noise=noise,
        axes=axes,
        step=step,
        raw_slope=float(sampling_slope),
        gaussianity=judge_gaussianity(residual, counts.skewness, counts.kurtosis),
        anisotropy=anisotropy,
        missing=1 - known / residual.size,
    )
    warnings, reliable = warnings_for(findings)
    # A height that chance alone puts below the step leaves the interval what it is
    if not reliable and not height.value < step <= height.high:
        slope = Estimate.undetermined(slope.value)
    return SurfaceStatistics(
        kind=kind,
        height_rms=height,
        corr_length=_combine([axis.corr_length for axis in axes], 0),
        slope_rms=slope,
        noise_rms=noise,
        curvature_rms=_combine([axis.curvature_rms for axis in axes], 2),
        gaussianity=findings.gaussianity,
        anisotropy=anisotropy,
        axes=axes,
        quantisation=step,
        cutoff=max(axis.cutoff for axis in axes),
        correlation_lengths=float(
            np.prod([axis.length / axis.corr_length.value for axis in axes])
        ),
        n_points=known,
        form=form,
        plain=PlainStatistics(
            height_rms=float(np.sqrt(fits[0].mean_square)),
            corr_length=float(np.exp(np.mean([np.log(a.plain_corr_length) for a in axes]))),
            slope_rms=float(sampling_slope),
        ),
        warnings=warnings,
        reliable=reliable,
        residual=residual,
        spacing=spacing,
    )


def _combine(parts: list[Estimate], power: int) -> Estimate:
    """Mean over the axes of a map: of squares (power 2), or geometric (power 0)."""
    if len(parts) == 1:
        return parts[0]
    values = np.array([p.value for p in parts])
    logs = np.array([p.stderr for p in parts]) / values
    if power == 0:
        share, value = np.full(2, 0.5), float(np.sqrt(np.prod(values)))
    else:
        share, value = values**2 / np.sum(values**2), float(np.sqrt(np.mean(values**2)))
    shared = 2 * _SHARED * np.prod(share * logs)
    variance = float(np.sum((share * logs) ** 2) + shared)
    if power == 0:
        return Estimate.positive(value, variance)
    return Estimate.root_mean_square(value, 4 * variance)


def _noise_rms(fits: list[AxisFit]) -> Estimate:
    """Root of the mean noise variance; its interval reaches 0 where it may be none."""
    variance = float(np.mean([fit.noise for fit in fits]))
    stderr = float(np.mean([fit.noise_stderr for fit in fits]))
    ends = [np.sqrt(max(variance + k * stderr, 0.0)) for k in (-1.96, 0, 1.96, 1)]
    # d sqrt(v) = dv / (2 sqrt(v)) fails at v = 0, where the interval itself is the scale
    spread = stderr / (2 * ends[1]) if variance > stderr else (ends[3] - ends[1])
    return Estimate(float(ends[1]), float(spread), float(ends[0]), float(ends[2]))
