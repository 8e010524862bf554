"""What a user must be told before surface statistics are used."""

from dataclasses import dataclass

import numpy as np

from fitting.estimate import Estimate
from fitting.statistics.axis.parts import AxisStatistics
from fitting.statistics.gaussianity import Gaussianity
from fitting.statistics.texture import Anisotropy


@dataclass(frozen=True, kw_only=True)
class Findings:
    """The numbers that warnings rest on; see `SurfaceStatistics` for each."""

    kind: str
    height: Estimate
    slope: Estimate
    noise: Estimate
    axes: tuple[AxisStatistics, ...]
    step: float
    raw_slope: float
    gaussianity: Gaussianity
    anisotropy: Anisotropy | None
    missing: float


def warnings_for(found: Findings) -> tuple[tuple[str, ...], bool]:
    """Warnings in the order of their weight, and whether the slope can be trusted."""
    fatal = [*_rounding(found), *_drowned(found)]
    texts = [
        *fatal,
        *_instrument(found),
        *_resolution(found),
        *_length(found),
        *_shape(found),
        *_map(found),
    ]
    return tuple(texts), not fatal


def _rounding(found: Findings) -> list[str]:
    if found.step <= found.height.value:
        return []
    return [
        f"height step {found.step:.3g} um exceeds height_rms {found.height.value:.3g} um: "
        "the heights are lost in the rounding, its correction fails and slope_rms cannot "
        "be trusted. "
        "Measure with a finer height step."
    ]


def _drowned(found: Findings) -> list[str]:
    if found.noise.value <= 3 * found.height.value and found.slope.value > 0:
        return []
    return [
        f"noise {found.noise.value:.3g} um hides heights of {found.height.value:.3g} um: "
        "slope_rms cannot be recovered. Average more measurements."
    ]


def _instrument(found: Findings) -> list[str]:
    """Noise and rounding decide what plain formulas would call the slope."""
    texts = []
    excess = found.raw_slope / max(found.slope.value, 1e-12)
    if excess > 1.05:
        source = "rounding" if found.step**2 / 12 > found.noise.value**2 else "noise"
        texts.append(
            f"{source} decides the slope between neighbours: {found.raw_slope:.3g} as "
            f"measured, {found.slope.value:.3g} corrected"
        )
    for axis in found.axes:
        fit = axis.fit
        whole = axis.slope_rms.value**2
        seen = fit.variance * fit.correlation.band_variance(axis.cutoff)
        if seen < 0.9 * whole:
            texts.append(
                f"along {axis.axis} noise hides wavelengths below {axis.cutoff:.3g} um; "
                f"{1 - seen / whole:.0%} of the slope variance rests on the "
                f"{axis.autocorrelation.form} form alone"
            )
    return texts


def _resolution(found: Findings) -> list[str]:
    texts = []
    for axis in found.axes:
        length = axis.fit.correlation.shortest_length()
        if axis.autocorrelation.form in ("matern", "multi-scale"):
            texts.append(
                f"along {axis.axis} the autocorrelation is not Gaussian "
                f"({axis.autocorrelation.description}): slope_rms is that of wavelengths "
                f"above {axis.cutoff:.3g} um and changes with the cut-off"
            )
        elif axis.autocorrelation.form == "two-scale":
            texts.append(
                f"along {axis.axis} the surface has {axis.autocorrelation.description}: "
                "the short one decides the slope"
            )
        if length < 4 * axis.spacing:
            texts.append(
                f"along {axis.axis} the resolution decides the slope: points every "
                f"{axis.spacing:.3g} um against a correlation length of {length:.3g} um"
            )
    return texts


def _length(found: Findings) -> list[str]:
    texts = []
    lengths = [a.length / a.corr_length.value for a in found.axes]
    if np.prod(lengths) < 10:
        texts.append(
            f"only {np.prod(lengths):.1f} correlation lengths: form removal and chance "
            "decide height_rms and corr_length; intervals are rough"
        )
    for axis, length in zip(found.axes, lengths, strict=True):
        if length < 3:
            texts.append(
                f"along {axis.axis} the heights are correlated over the whole "
                f"{axis.length:.3g} um: corr_length there is a guess"
            )
    error = found.slope.stderr / max(found.slope.value, 1e-300)
    if not np.isfinite(error):
        texts.append("slope_rms is not determined by these data")
    elif error > 0.3:
        texts.append(f"slope_rms is known to {error:.0%} only")
    return texts


def _shape(found: Findings) -> list[str]:
    gaussianity = found.gaussianity
    if gaussianity.is_gaussian or gaussianity.effective_samples < 20:
        return []
    return [
        f"heights are not Gaussian: skewness {gaussianity.skewness.value:.2g}, excess "
        f"kurtosis {gaussianity.kurtosis.value:.2g} (p = {gaussianity.p_value:.1g})"
    ]


def _map(found: Findings) -> list[str]:
    texts = []
    if found.anisotropy is not None and found.anisotropy.p_value < 0.05:
        ratio, angle = found.anisotropy.ratio.value, found.anisotropy.direction.value
        slopes = sorted(axis.slope_rms.value for axis in found.axes)
        along_axis = min(abs(angle), np.pi / 2 - abs(angle)) < np.pi / 12
        if along_axis and ratio > 2 * slopes[-1] / max(slopes[0], 1e-300):
            texts.append(
                f"differences between neighbouring lines are {ratio:.3g} times those along "
                f"them, the slopes only {slopes[-1] / slopes[0]:.3g}: lines are offset, or "
                "noise differs between them"
            )
        elif ratio > 1.1:
            texts.append(
                f"anisotropic: slopes {ratio:.3g} times larger across the texture, which "
                f"runs at {np.rad2deg(angle):.0f} degrees from +x"
            )
    if found.missing > 0.2:
        texts.append(f"{found.missing:.0%} of the heights are missing")
    return texts
