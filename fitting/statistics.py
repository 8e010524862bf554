"""Surface statistics that can be trusted: noise, rounding and finite length corrected."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeGuard

import numpy as np

from fitting.estimate import Estimate
from fitting.statistics_axis import axis_statistics, height_rms
from fitting.statistics_fit import AxisData, AxisFit, fit_axis
from fitting.statistics_form import (
    FORMS,
    Form,
    form_degree,
    remove_form_map,
    remove_form_profile,
)
from fitting.statistics_gaussianity import judge_gaussianity
from fitting.statistics_judgement import Findings, warnings_for
from fitting.statistics_lags import Sampling, line_sampling, profile_sampling
from fitting.statistics_models import GAUSSIAN
from fitting.statistics_quantisation import find_step, is_negligible
from fitting.statistics_result import (
    AxisStatistics,
    PlainStatistics,
    SurfaceStatistics,
)
from fitting.statistics_texture import measure_anisotropy
from fitting.statistics_variance import form_losses, mean_power_of_correlation

Array = np.ndarray

# Estimates along x and y of one isotropic map share a third of their variance: the ratio of
# the integrals of (d²ρ/dxdy)² and (d²ρ/dx²)² for a Gaussian autocorrelation
_SHARED = 1 / 3
_FEWEST_POINTS = 12


class ProfileLike(Protocol):
    """Positions x, rising, and heights z. [um]"""

    @property
    def x(self) -> Array: ...  # noqa: D102
    @property
    def z(self) -> Array: ...  # noqa: D102


class MapLike(Protocol):
    """Heights (nx, ny), NaN where missing, and spacing (dx, dy). [um]"""

    @property
    def heights(self) -> Array: ...  # noqa: D102
    @property
    def spacing(self) -> tuple[float, float]: ...  # noqa: D102


def surface_statistics(
    surface: ProfileLike | MapLike,
    *,
    form: str | int = "tilt",
    quantisation: float | None = None,
) -> SurfaceStatistics:
    """Height, length, slope and noise of a measured surface, each with its uncertainty.

    Parameters
    ----------
    surface : Profile or HeightMap
        Profile with x, z, evenly spaced or not; or map with heights (nx, ny), NaN where
        missing, and spacing. [um]
    form : str or int
        What to remove first: ``none``, ``mean``, ``tilt``, ``curvature`` or the degree of a
        polynomial. What it takes from the roughness is made good.
    quantisation : float, optional
        Step of the lattice that heights were rounded to, such as the pixel of an image
        whose edge was found to whole pixels. [um] Found from the heights by default; 0 for
        none.

    Returns
    -------
    SurfaceStatistics

    Raises
    ------
    TypeError
        If `surface` is neither.
    ValueError
        If it has too few heights, does not vary, or `form` is unknown.

    Notes
    -----
    The structure function D(r) = ⟨(z(x + r) - z(x))²⟩ up to 1.5 correlation lengths and the
    mean square height are fitted together by a model autocorrelation, white noise and the
    closed-form effect of rounding (see `fitting.statistics_quantisation`), weighted by
    their theoretical covariance. That covariance, which counts independent correlation
    lengths, gives the intervals. A Gaussian autocorrelation is kept unless the data reject
    it for a Matérn form or two scales.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> rng = np.random.default_rng(3)
    >>> x = np.arange(2000.0)
    >>> kernel = np.exp(-2 * (np.arange(-60, 61) / 15) ** 2)
    >>> z = np.convolve(rng.normal(size=2120), kernel, "valid")[:2000]
    >>> profile = SimpleNamespace(x=x, z=z + rng.normal(scale=0.3, size=2000))
    >>> found = surface_statistics(profile)
    >>> found.corr_length.low < 15 < found.corr_length.high
    True
    """
    degree = form_degree(form)
    if _is_map(surface):
        return _map_statistics(surface, degree, _form_name(degree), quantisation)
    if _is_profile(surface):
        return _profile_statistics(surface, degree, _form_name(degree), quantisation)
    msg = (
        f"surface must be a Profile (x, z) or a HeightMap (heights, spacing), "
        f"got {type(surface).__name__}. See data_io.read_profile and read_height_map."
    )
    raise TypeError(msg)


def _profile_statistics(
    profile: ProfileLike, degree: int, form: str, quantisation: float | None
) -> SurfaceStatistics:
    x, z = np.asarray(profile.x, dtype=float), np.asarray(profile.z, dtype=float)
    known = ~np.isnan(z)
    x, z = x[known], z[known]
    _check_heights(z, degree)
    residual, removed = remove_form_profile(x, z, degree)
    sampling = profile_sampling(x, residual)
    step = _step(z, quantisation, sampling)
    starts = np.linspace(x[0], x[-1], 65)[:-1, None]

    def form_increments(lags: Array) -> Array:
        begin = np.minimum(starts, x[-1] - lags)
        return removed.along(0, begin + lags) - removed.along(0, begin)

    data = AxisData(sampling, step, form_increments, degree, removed.n_terms)
    along = axis_statistics("x", data, 1.0, None)
    return _assemble(
        "profile", (along,), residual, (sampling.spacing,), form=form, step=step
    )


def _map_statistics(
    surface: MapLike, degree: int, form: str, quantisation: float | None
) -> SurfaceStatistics:
    heights = np.asarray(surface.heights, dtype=float)
    dx, dy = np.broadcast_to(np.asarray(surface.spacing, dtype=float), (2,))
    spacing = (float(dx), float(dy))
    _check_heights(heights[~np.isnan(heights)], degree)
    residual, removed = remove_form_map(heights, spacing, degree)
    lines = (residual.T, residual)
    samplings = [line_sampling(lines[i], spacing[i]) for i in (0, 1)]
    step = _step(heights, quantisation, samplings[0])
    data = [
        AxisData(samplings[i], step, _map_increments(removed, i), degree, removed.n_terms)
        for i in (0, 1)
    ]
    # Each axis needs the other's correlation length to count independent lines
    first = [fit_axis(d, across=0.1, families=(GAUSSIAN,)) for d in data]
    axes = []
    for i, name in enumerate("xy"):
        other, length = first[1 - i].correlation, samplings[1 - i].length
        across = mean_power_of_correlation(other, length, 2)
        losses = form_losses(other, length, degree)
        axes.append(axis_statistics(name, data[i], across, losses))
    return _assemble("map", tuple(axes), residual, spacing, form=form, step=step)


def _map_increments(removed: Form, axis: int) -> Callable[[Array], Array]:
    """Increments of the removed form along an axis, over an 8 x 8 lattice of starts."""
    low, high = removed.ranges[axis]
    starts = np.repeat(np.linspace(low, high, 8), 8)[:, None]
    across = np.tile(np.linspace(*removed.ranges[1 - axis], 8), 8)[:, None]

    def increments(lags: Array) -> Array:
        begin = np.minimum(starts, high - lags)
        side = np.broadcast_to(across, begin.shape)
        return removed.along(axis, begin + lags, side) - removed.along(axis, begin, side)

    return increments


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


def _assemble(
    kind: str,
    axes: tuple[AxisStatistics, ...],
    residual: Array,
    spacing: tuple[float, ...],
    *,
    form: str,
    step: float,
) -> SurfaceStatistics:
    fits = [axis.fit for axis in axes]
    height = height_rms(fits, step)
    slope = _combine([axis.slope_rms for axis in axes], 2)
    counts = _independent(axes)
    sampling_slope = np.sqrt(
        np.mean(
            [a.fit.increments.mean_square[0] / a.fit.increments.lags[0] ** 2 for a in axes]
        )
    )
    noise = _noise_rms(fits)
    known = int(np.isfinite(residual).sum())
    anisotropy = None
    if kind == "map":
        anisotropy = measure_anisotropy(
            residual,
            (spacing[0], spacing[1]),
            min(a.corr_length.value for a in axes) / 5,
            noise.value**2 + step**2 / 12,
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
    if not reliable:
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


def _step(heights: Array, quantisation: float | None, sampling: Sampling) -> float:
    if quantisation is None:
        step = find_step(heights)
    elif np.isfinite(quantisation) and quantisation >= 0:
        step = float(quantisation)
    else:
        msg = (
            f"quantisation must be >= 0 [um], got {quantisation}. Give the step between "
            "height levels, 0 for none, or leave it out to have it found."
        )
        raise ValueError(msg)
    first = float(sampling.increments(0.0, 6).mean_square[0])
    return 0.0 if is_negligible(step, first) else step


def _check_heights(heights: Array, degree: int) -> None:
    fewest = max(_FEWEST_POINTS, 3 * (degree + 1))
    if heights.size < fewest:
        msg = (
            f"surface must have at least {fewest} heights, got {heights.size}. "
            "Measure a longer profile."
        )
        raise ValueError(msg)
    if np.isinf(heights).any():
        msg = "heights must be finite [um], got inf. Mark missing points with NaN."
        raise ValueError(msg)
    if np.ptp(heights) == 0:
        msg = (
            f"heights must vary, got {heights.flat[0]:.9g} um everywhere. "
            "A perfectly flat surface has no statistics; use HeightMap.flat."
        )
        raise ValueError(msg)


def _form_name(degree: int) -> str:
    names = {value: name for name, value in FORMS.items()}
    return names.get(degree, f"polynomial of degree {degree}")


def _is_map(surface: object) -> TypeGuard[MapLike]:
    return hasattr(surface, "heights") and hasattr(surface, "spacing")


def _is_profile(surface: object) -> TypeGuard[ProfileLike]:
    return hasattr(surface, "x") and hasattr(surface, "z")
