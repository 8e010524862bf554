"""What light sees of a surface: heights, slopes, curvature and lengths, from itself."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from scipy import special

from pbrdf.surface import GaussianSurface, HeightMap, MeasuredSurface

# Lines of a map that are looked at along each axis, and heights of it that are kept
LINES, HEIGHTS = 256, 8192
# A facet that deviates less than this from the mean plane mirrors as the plane does [1]
FLAT = 1e-4
# Share of a Gaussian variable within its rms: the typical curvature of a map is this
# quantile. Edges between flat facets do not move it; they move the mean
WITHIN_RMS = float(special.erf(np.sqrt(0.5)))


@dataclass(frozen=True, kw_only=True)
class Roughness:
    """Scales of one surface, of the axis on which each is worst.

    Attributes
    ----------
    height_rms : float
        About the mean plane. [um]
    slope_rms : float
        Of the facets about the mean plane, per axis. [1]
    corr_length : float
        Where the autocorrelation falls to 1/e; inf where it does not. [um]
    cell : float
        Grid step. [um]
    steps, radii : ndarray
        Distances [um] over which the surface bends, rising, and the typical radius of
        curvature over each [um].
    smooth : float
        Correlation of slopes from one cell to the next: near 1 where the grid follows the
        surface, near 0 where structure goes on below the cells. [1]
    cells, lengths : float
        Cells a correlation length, and correlation lengths on a side. [1]
    heights : ndarray
        Heights about the mean plane, equally likely; empty for a Gaussian. [um]
    generated : bool
        Whether the surface between the nodes is known, as that of a formula is.
    flat : float
        Share of the area that is parallel to the mean plane, and mirrors as it does. [1]
    facets : bool
        Whether it is a mesh: cells are its facets, and what they stand for is not known.
    bodies : bool
        Whether it is bodies without a ground, and so without a mean plane.
    """

    height_rms: float
    slope_rms: float
    corr_length: float
    cell: float
    steps: np.ndarray
    radii: np.ndarray
    smooth: float
    cells: float
    lengths: float
    heights: np.ndarray
    generated: bool
    flat: float = 0.0
    facets: bool = False
    bodies: bool = False

    def curvature_radius(self, scale: np.ndarray) -> np.ndarray:
        """Typical radius of curvature over a distance, not below the first step. [um]"""
        place = np.searchsorted(self.steps, scale, side="right") - 1
        return self.radii[np.clip(place, 0, len(self.steps) - 1)]

    def coherent_share(self, phase: np.ndarray) -> np.ndarray:
        """Share of the light of a mean plane that stays coherent, at phases [1/um].

        |<exp(i phase h)>|² over the heights h: exp(-(phase h_rms)²) of a Gaussian (Davies
        1954). Of a map, whose mean is one of few independent places, what chance would
        leave is taken off.
        """
        gaussian: np.ndarray = np.exp(-((phase * self.height_rms) ** 2))
        if not self.heights.size:
            return gaussian
        waves = [np.exp(1j * one * self.heights).mean() for one in np.ravel(phase)]
        share = np.abs(np.reshape(waves, np.shape(phase))) ** 2
        if self.generated:
            return share
        return np.maximum(share - 5.0 / max(self.lengths, 1.0) ** 2, gaussian)


def roughness_of(surface: HeightMap | GaussianSurface | MeasuredSurface) -> Roughness:
    """Find the scales of a surface: from its formula, or from the heights of a map."""
    if isinstance(surface, HeightMap):
        return _of_map(surface)
    return _of_ensemble(surface)


def gaussian_roughness(height_rms: float, slope_rms: float) -> Roughness:
    """Scales of a continuous Gaussian surface of autocorrelation exp(-r²/l²)."""
    length = np.sqrt(2.0) * height_rms / slope_rms
    bend = 2 * np.sqrt(3) * height_rms / length**2
    return Roughness(
        height_rms=height_rms, slope_rms=slope_rms, corr_length=length, cell=0.0,
        steps=np.zeros(1), radii=np.array([(1 + slope_rms**2) ** 1.5 / bend]),
        smooth=1.0, cells=np.inf, lengths=np.inf, heights=np.empty(0), generated=True,
    )  # fmt: skip


def _of_ensemble(surface: GaussianSurface | MeasuredSurface) -> Roughness:
    """Scales of a random surface, from its autocorrelation."""
    heights = np.empty(0)
    if isinstance(surface, MeasuredSurface) and surface.quantiles is not None:
        heights = surface.likely_heights(2001)
    rms = surface.ensemble_height_rms
    steps = np.broadcast_to(np.asarray(surface.spacing, dtype=np.float64), 2)
    sides = np.asarray(surface.shape) * steps
    slope = float(np.sqrt(np.mean(np.square(surface.facet_slope_rms))))
    worst = []
    for axis in (0, 1):

        def drop(lag: np.ndarray, axis: int = axis) -> np.ndarray:
            return surface.decorrelation(axis, lag)

        lags = _steps(float(steps[axis]), float(sides[axis]))
        # <(h(x + s) - 2 h(x) + h(x - s))²> = rms² (8 drop(s) - 2 drop(2 s))
        bend = rms * np.sqrt(np.maximum(8 * drop(lags) - 2 * drop(2 * lags), 0.0)) / lags**2
        first, second = drop(lags[:1])[0], drop(2 * lags[:1])[0]
        worst.append(
            (lags, _radius(bend, slope), second / (2 * first) - 1, _fall(drop, lags))
        )
    length = min(one[3] for one in worst)
    steps_of, radii, _, _ = min(worst, key=lambda one: one[1][0])
    return Roughness(
        height_rms=rms, slope_rms=slope, corr_length=length, cell=float(steps.max()),
        steps=steps_of, radii=radii, smooth=float(min(one[2] for one in worst)),
        cells=float(min(one[3] / step for step, one in zip(steps, worst, strict=True))),
        lengths=_fewest(sides, [one[3] for one in worst]),
        heights=heights, generated=True,
    )  # fmt: skip


def _of_map(surface: HeightMap) -> Roughness:
    """Scales of a map, from lines of it along both axes."""
    tilts = _tilts(surface)
    heights = _about_plane(surface, tilts)
    slopes = surface.slopes()
    slope = float(np.sqrt(np.mean([np.nanvar(s) for s in slopes])))
    found = []
    for axis in (0, 1):
        lines = np.moveaxis(heights, axis, -1)
        lines = lines[:: max(1, -(-len(lines) // LINES))]
        found.append(_of_lines(lines, surface.spacing[axis], surface.periodic, slope))
    steps, radii, _, _ = min(found, key=lambda one: one[1][0])
    kept = heights.ravel()[:: max(1, -(-heights.size // HEIGHTS))]
    return Roughness(
        height_rms=float(heights.std()), slope_rms=slope,
        corr_length=float(min(one[3] for one in found)), cell=max(surface.spacing),
        steps=steps, radii=radii, smooth=float(min(one[2] for one in found)),
        cells=float(min(
            one[3] / d for d, one in zip(surface.spacing, found, strict=True)
        )),
        lengths=_fewest(surface.size, [one[3] for one in found]),
        heights=kept, flat=_parallel_share(surface, tilts), generated=False,
    )  # fmt: skip


def _parallel_share(surface: HeightMap, tilts: tuple[float, float]) -> float:
    """Share of the cells that are parallel to a plane of these slopes. [1]"""
    (nx, ny), (along_x, along_y) = surface.cells, surface.slopes()
    level = np.abs(along_x - tilts[0])[:, :ny] <= FLAT
    level &= np.abs(along_y - tilts[1])[:nx] <= FLAT
    return float(level.mean())


def _tilts(surface: HeightMap) -> tuple[float, float]:
    """Slopes of the plane that the map lies about, which has none if it is periodic.

    The plane that most of the map is parallel to, if there is one; the mean plane of a few
    terraces is none of theirs.
    """
    if surface.periodic:
        return 0.0, 0.0
    along_x, along_y = surface.slopes()
    common = float(np.nanmedian(along_x)), float(np.nanmedian(along_y))
    if _parallel_share(surface, common) > 0.5:
        return common
    return float(np.nanmean(along_x)), float(np.nanmean(along_y))


def _about_plane(surface: HeightMap, tilts: tuple[float, float]) -> np.ndarray:
    """Heights about a plane of these slopes. [um]"""
    heights = surface.heights - np.nanmean(surface.heights)
    if not surface.periodic:
        for axis, tilt in enumerate(np.multiply(tilts, surface.spacing)):
            n = heights.shape[axis]
            ramp = tilt * (np.arange(n) - (n - 1) / 2)
            heights = heights - np.expand_dims(ramp, 1 - axis)
    return np.nan_to_num(heights)


def _of_lines(
    lines: np.ndarray, step: float, periodic: bool, slope: float
) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Find steps, radii of curvature, correlation of slopes and length of lines."""
    count = lines.shape[-1]
    whole = np.concatenate([lines, lines], axis=-1) if periodic else lines
    lags = _steps(1, count if periodic else (count - 1) // 2)
    bends = []
    for lag in lags.astype(int):
        end = count if periodic else count - 2 * lag
        second = np.abs(
            whole[:, 2 * lag : 2 * lag + end]
            - 2 * whole[:, lag : lag + end]
            + whole[:, :end]
        )
        # The mean of a Gaussian is 0.8 of its rms. It exceeds the quantile where flat
        # facets meet at edges: then 1/mean is the width of a facet over the turn of an edge
        bend = max(np.quantile(second, WITHIN_RMS), second.mean())
        bends.append(bend / (lag * step) ** 2)
    first = np.diff(whole[:, : count + 1] if periodic else lines)
    square = float((first**2).mean())
    change = float((np.diff(first) ** 2).mean()) if first.shape[-1] > 1 else 0.0
    smooth = 1 - change / (2 * square) if square > 0.0 else 1.0
    variance = float((lines**2).mean())

    def drop(distance: np.ndarray) -> np.ndarray:
        found = []
        for lag in np.rint(distance / step).astype(int):
            end = count if periodic else count - lag
            apart = whole[:, lag : lag + end] - whole[:, :end]
            found.append(float((apart**2).mean()) / max(2 * variance, 1e-300))
        return np.array(found)

    length = _fall(drop, lags * step) if variance > 0.0 else np.inf
    return lags * step, _radius(np.array(bends), slope), smooth, length


def _steps(step: float, side: float) -> np.ndarray:
    """Distances of 1, 2, 4, ... steps up to half of a side."""
    count = max(1, int(np.log2(max(side / (2 * step), 1.0))) + 1)
    return step * 2.0 ** np.arange(count)


def _radius(bend: np.ndarray, slope: float) -> np.ndarray:
    """Radius of curvature of second derivatives, on a surface of this slope. [um]"""
    with np.errstate(divide="ignore"):
        radius: np.ndarray = (1 + slope**2) ** 1.5 / bend
    return radius


def _fall(drop: Callable[[np.ndarray], np.ndarray], steps: np.ndarray) -> float:
    """Distance at which an autocorrelation has fallen to 1/e, between the steps. [um]"""
    fallen = 1 - np.exp(-1)
    values = drop(steps)
    beyond = np.flatnonzero(values >= fallen)
    if not beyond.size:
        return float(np.inf)
    k = int(beyond[0])
    if k == 0:
        # Within the first step the form is taken as a Gaussian
        return float(steps[0] / np.sqrt(-np.log1p(-min(values[0], 0.999))))
    between = np.linspace(steps[k - 1], steps[k], 17)
    return float(np.interp(fallen, np.maximum.accumulate(drop(between)), between))


def _fewest(sides: Iterable[float], lengths: Iterable[float]) -> float:
    """Correlation lengths on the side that holds fewest, of those that vary. [1]"""
    counts = [
        side / length
        for side, length in zip(sides, lengths, strict=True)
        if np.isfinite(length)
    ]
    return float(min(counts, default=np.inf))
