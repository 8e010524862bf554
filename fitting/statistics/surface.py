"""Surface statistics that can be trusted: noise, rounding and finite length corrected."""

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol, TypeGuard, overload

import numpy as np

from fitting.statistics.assembly import assemble
from fitting.statistics.axis.autocorrelation import GAUSSIAN
from fitting.statistics.axis.estimate import axis_statistics
from fitting.statistics.axis.fit import AxisData
from fitting.statistics.axis.problem import fit_axis
from fitting.statistics.axis.rounding import find_step, is_negligible
from fitting.statistics.axis.scatter import form_losses, mean_power_of_correlation
from fitting.statistics.axis.structure_function import (
    Sampling,
    line_sampling,
    profile_sampling,
)
from fitting.statistics.form import (
    FORMS,
    Form,
    form_degree,
    remove_form_map,
    remove_form_profile,
)
from fitting.statistics.mesh import MeshStatistics, mesh_statistics
from fitting.statistics.result import SurfaceStatistics
from fitting.statistics.special_cases import (
    discrete_heights,
    flat_statistics,
    is_flat,
    without_rounding,
)
from pbrdf import MeshSurface
from pbrdf.errors import real_array

Array = np.ndarray

_FEWEST_POINTS = 12
# Bands of one width are corrected as rounding to a step
_SAME_STEP = 0.05


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


@overload
def surface_statistics(
    surface: MeshSurface, *, form: str | int = ..., quantisation: float | None = ...
) -> MeshStatistics: ...


@overload
def surface_statistics(
    surface: ProfileLike | MapLike,
    *,
    form: str | int = ...,
    quantisation: float | None = ...,
) -> SurfaceStatistics: ...


def surface_statistics(
    surface: ProfileLike | MapLike | MeshSurface,
    *,
    form: str | int = "tilt",
    quantisation: float | None = None,
) -> SurfaceStatistics | MeshStatistics:
    """Height, length, slope and noise of a measured surface, each with its uncertainty.

    Parameters
    ----------
    surface : Profile, HeightMap or MeshSurface
        Profile with x, z, evenly spaced or not; or map with heights (nx, ny), NaN where
        missing, and spacing [um]; or a mesh, of which the facets are told as they are.
    form : str or int
        What to remove first: ``none``, ``mean``, ``tilt``, ``curvature`` or the degree of a
        polynomial. What it takes from the roughness is made good.
    quantisation : float, optional
        Step of the lattice that heights were rounded to, such as the pixel of an image
        whose edge was found to whole pixels. [um] Found from the heights by default; 0 for
        none.

    Returns
    -------
    SurfaceStatistics, or MeshStatistics of a mesh

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
    closed-form effect of rounding (see `fitting.statistics.axis.rounding`), weighted by
    their theoretical covariance. That covariance, which counts independent correlation
    lengths, gives the intervals. A Gaussian autocorrelation is kept unless the data reject
    it for a Matérn form or two scales.

    Of a profile with an attribute `located`, such as `data_io.EdgeProfile`, that is taken,
    with its blur and its noise: the model is blurred likewise before it is compared, and
    the noise, of known autocorrelation, is found with it. A restored edge would not do:
    what is left of its noise is amplified, band-limited and decided by the noise itself.

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
    if isinstance(surface, MeshSurface):
        return mesh_statistics(surface)
    degree = form_degree(form)
    name = _form_name(degree)
    if not (_is_map(surface) or _is_profile(surface)):
        msg = (
            "surface must be a Profile (x, z), a HeightMap (heights, spacing) or a "
            f"MeshSurface, got {type(surface).__name__}. See data_io.read_profile and "
            "read_height_map."
        )
        raise TypeError(msg)
    if quantisation is None and getattr(surface, "located", None) is None:
        reason = _discrete(surface)
        if reason is not None:
            found = _statistics(surface, degree, name, 0.0)
            return found if found.height_rms.value == 0 else without_rounding(found, reason)
        if _is_map(surface):
            drawn = _under_uneven_bands(surface)
            if drawn is not None:
                text, smooth = drawn
                found = _statistics(smooth, degree, name, 0.0)
                return replace(found, warnings=(text, *found.warnings))
    found = _statistics(surface, degree, name, quantisation)
    if _is_map(surface):
        return _with_offsets_named(found, surface)
    slope = getattr(surface, "slope", None)
    return found if slope is None else _with_slopes(found, surface, slope, degree)


def _discrete(surface: ProfileLike | MapLike) -> str | None:
    """Say why heights are discrete by themselves, for maps and evenly spaced profiles."""
    heights = surface.heights if _is_map(surface) else surface.z  # type: ignore[union-attr]
    values = np.asarray(real_array("heights", heights), dtype=float)
    known = values[np.isfinite(values)]
    if known.size < _FEWEST_POINTS or np.ptp(known) == 0:
        return None
    return discrete_heights(values)


def _under_uneven_bands(surface: MapLike) -> tuple[str, MapLike] | None:
    """Draw the surface under bands that no single step describes, as of a picture."""
    from data_io.mending.bands import find_bands
    from data_io.mending.terraces import deterrace
    from pbrdf.surface.heightmap import HeightMap

    heights = real_array("heights", surface.heights)
    bands = find_bands(heights)
    if bands is None or bands.may_be_real:
        return None
    if abs(find_step(heights) / bands.width - 1) < _SAME_STEP:
        return None
    dx, dy = np.broadcast_to(np.asarray(surface.spacing, dtype=float), (2,))
    drawn = deterrace(HeightMap(heights, (float(dx), float(dy))), bands=bands)
    text = f"terraces: {bands}; statistics are those of a surface drawn between them"
    holes = np.where(np.isfinite(heights), drawn.surface.heights, np.nan)
    return text, HeightMap(holes, drawn.surface.spacing)


def _with_offsets_named(found: SurfaceStatistics, surface: MapLike) -> SurfaceStatistics:
    """Say that scan lines are offset, which passes for slopes across them."""
    from data_io.mending.scan_lines import line_offsets

    heights = real_array("heights", surface.heights)
    for name, lines in (("rows", heights), ("columns", heights.T)):
        offsets = line_offsets(lines)
        if offsets is not None:
            text = (
                f"{name} are offset from each other by {np.std(offsets):.3g} um rms, which "
                "the slope across them holds: mend the map (data_io.mend_map)"
            )
            return replace(found, warnings=(text, *found.warnings), reliable=False)
    return found


def _with_slopes(
    found: SurfaceStatistics, surface: ProfileLike | MapLike, slope: Array, degree: int
) -> SurfaceStatistics:
    """Return statistics of a profile of slopes, whose rms is measured and not derived."""
    from types import SimpleNamespace

    measured = SimpleNamespace(x=surface.x, z=slope)  # type: ignore[union-attr]
    rms = _statistics(measured, max(degree - 1, -1), "mean", None).height_rms
    axes = tuple(replace(one, slope_rms=rms) for one in found.axes)
    return replace(found, slope_rms=rms, axes=axes)


def _statistics(
    surface: ProfileLike | MapLike, degree: int, form: str, quantisation: float | None
) -> SurfaceStatistics:
    if _is_map(surface):
        return _map_statistics(surface, degree, form, quantisation)
    return _profile_statistics(surface, degree, form, quantisation)  # type: ignore[arg-type]


def _profile_statistics(
    profile: ProfileLike, degree: int, form: str, quantisation: float | None
) -> SurfaceStatistics:
    located = getattr(profile, "located", None)
    if located is not None:
        profile = located
    x, z = real_array("x", profile.x), real_array("z", profile.z)
    known = ~(np.isnan(z) | np.isnan(x))
    x, z = x[known], z[known]
    _check_heights(z, degree)
    residual, removed = remove_form_profile(x, z, degree)
    if is_flat(residual, z):
        step = float((x[-1] - x[0]) / (x.size - 1))
        return flat_statistics("profile", residual, (step,), form)
    sampling = profile_sampling(x, residual)
    step = _step(z, quantisation, sampling)
    starts = np.linspace(x[0], x[-1], 65)[:-1, None]

    def form_increments(lags: Array) -> Array:
        begin = np.minimum(starts, x[-1] - lags)
        return removed.along(0, begin + lags) - removed.along(0, begin)

    data = AxisData(sampling, step, form_increments, degree, removed.n_terms)
    if located is not None:
        data = replace(data, blur=located.blur, grain=located.grain)
    along = axis_statistics("x", data, 1.0, None)
    return assemble(
        "profile", (along,), residual, (sampling.spacing,), form=form, step=step
    )


def _map_statistics(
    surface: MapLike, degree: int, form: str, quantisation: float | None
) -> SurfaceStatistics:
    heights = real_array("heights", surface.heights)
    dx, dy = np.broadcast_to(np.asarray(surface.spacing, dtype=float), (2,))
    spacing = (float(dx), float(dy))
    _check_heights(heights[~np.isnan(heights)], degree)
    residual, removed = remove_form_map(heights, spacing, degree)
    if is_flat(residual, heights):
        return flat_statistics("map", residual, spacing, form)
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
    return assemble("map", tuple(axes), residual, spacing, form=form, step=step)


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
