"""Slope distributions of measured surfaces, with error bars, against the cut-off."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import ndimage

from pbrdf.errors import real_array

if TYPE_CHECKING:
    import pandas as pd

    from pbrdf.analytic.slope_table import SlopeTable

Array = np.ndarray

# A Gaussian filter passes half of the amplitude at its cut-off (ISO 16610-21)
_HALF = np.sqrt(np.log(2) / 2) / np.pi
_BLOCKS = 16


@dataclass(frozen=True, eq=False)
class SlopeDistribution:
    """Density of the slopes of a surface above a cut-off wavelength.

    Parameters
    ----------
    edges : ndarray, shape (n + 1,)
        Of the bins. [1]
    density, stderr : dict of ndarray, shape (n,)
        By axis, ``x`` and of a map ``y``; the integral is 1. Errors are those of 16 pieces
        of the surface. [1]
    rms, rms_stderr : dict of float
        By axis. [1]
    cutoff : float
        Wavelength below which the surface was smoothed; 0 for as it is. [um]
    table : SlopeTable or None
        Of a map: the density over both slopes, for `MicrofacetModel(slope_distribution=)`.
    """

    edges: Array
    density: dict[str, Array]
    stderr: dict[str, Array]
    rms: dict[str, float]
    rms_stderr: dict[str, float]
    cutoff: float
    table: "SlopeTable | None"

    def to_frame(self) -> "pd.DataFrame":
        """One row a bin: its middle, and density and error for each axis."""
        import pandas as pd

        columns = {"slope": (self.edges[1:] + self.edges[:-1]) / 2}
        for axis, values in self.density.items():
            columns[f"density_{axis}"] = values
            columns[f"density_{axis}_stderr"] = self.stderr[axis]
        return pd.DataFrame(columns)


def slope_distribution(
    surface: Any, *, cutoff: float = 0.0, bins: int = 61
) -> SlopeDistribution:
    """Slope distribution of a profile or map, of each axis and of both together.

    Parameters
    ----------
    surface : Profile or HeightMap
        As measured, noise taken off by the cut-off where there is any. A map in bands is
        de-terraced first; a profile of slopes gives its own. [um]
    cutoff : float
        Shortest wavelength that counts; the surface is smoothed by a Gaussian filter that
        passes half at this wavelength. `SurfaceStatistics.cutoff` is what noise and step
        let a measurement resolve. [um]
    bins : int
        Over the range of all slopes.

    Raises
    ------
    ValueError
        If the cut-off is negative, or longer than a quarter of the surface.

    Examples
    --------
    >>> from pbrdf import GaussianSurface
    >>> map = GaussianSurface(shape=(128, 128), spacing=1.0, corr_length=8.0,
    ...                       slope_rms=0.2).sample(seed=1)
    >>> found = slope_distribution(map)
    >>> abs(found.rms["x"] - 0.2) < 3 * found.rms_stderr["x"]
    True
    """
    slopes = _slopes(surface, cutoff)
    reach = max(float(np.nanmax(np.abs(values))) for values in slopes.values())
    edges = np.linspace(-1, 1, bins + 1) * max(reach, 1e-12) * (1 + 1e-9)
    density, stderr, rms, rms_stderr = {}, {}, {}, {}
    for axis, values in slopes.items():
        parts = [part[np.isfinite(part)] for part in _pieces(values)]
        parts = [part for part in parts if part.size]
        each = np.array([_density(part, edges) for part in parts])
        known = values[np.isfinite(values)]
        density[axis] = _density(known, edges)
        stderr[axis] = each.std(axis=0, ddof=1) / np.sqrt(len(parts))
        squares = np.array([np.mean(part**2) for part in parts])
        rms[axis] = float(np.sqrt(np.mean(known**2)))
        error = squares.std(ddof=1) / np.sqrt(len(parts))
        rms_stderr[axis] = float(error / max(2 * rms[axis], 1e-300))
    table = None
    if "y" in slopes:
        from pbrdf.analytic.slope_table import SlopeTable

        # Both slopes of the facet at each node
        table = SlopeTable.from_slopes(slopes["x"][:, :-1], slopes["y"][:-1], bins=bins)
    return SlopeDistribution(edges, density, stderr, rms, rms_stderr, cutoff, table)


def _slopes(surface: Any, cutoff: float) -> dict[str, Array]:
    """Slopes along each axis, of the surface without what is shorter than the cut-off."""
    is_map = hasattr(surface, "heights")
    if is_map:
        heights = _without_bands(surface)
        steps = [float(d) for d in np.broadcast_to(surface.spacing, (2,))]
    else:
        heights, x = np.asarray(surface.z, dtype=float), np.asarray(surface.x, dtype=float)
        steps = [float((x[-1] - x[0]) / (x.size - 1))]
    longest = min(n * d for n, d in zip(heights.shape, steps, strict=True)) / 4
    if not 0 <= cutoff <= longest:
        msg = (
            f"cutoff must lie in [0, {longest:.4g}] um, a quarter of the surface, got "
            f"{cutoff:g}. Take SurfaceStatistics.cutoff, or 0 for the surface as it is."
        )
        raise ValueError(msg)
    widths = [_HALF * cutoff / step for step in steps]
    own = None if is_map else getattr(surface, "slope", None)
    if own is not None:
        return {"x": _smooth(np.asarray(own, dtype=float), widths)}
    if not is_map:
        return {"x": np.diff(_smooth(heights, widths)) / np.diff(x)}
    smooth = _smooth(heights, widths)
    return {
        "x": np.diff(smooth, axis=0) / steps[0],
        "y": np.diff(smooth, axis=1) / steps[1],
    }


def _without_bands(surface: Any) -> Array:
    """Heights of a map; those of one in bands are drawn."""
    from data_io.mending.bands import find_bands
    from data_io.mending.terraces import deterrace
    from pbrdf.surface.heightmap import HeightMap

    heights = real_array("heights", surface.heights)
    bands = find_bands(heights)
    if bands is None or bands.may_be_real:
        return heights
    drawn = deterrace(HeightMap(heights, surface.spacing), bands=bands).surface.heights
    return np.where(np.isfinite(heights), drawn, np.nan)


def _smooth(values: Array, widths: list[float]) -> Array:
    """Gaussian filter that leaves missing points out. Widths in steps."""
    if max(widths) == 0:
        return values
    known = np.isfinite(values)
    weight = ndimage.gaussian_filter(known.astype(float), widths, mode="reflect")
    total = ndimage.gaussian_filter(np.where(known, values, 0.0), widths, mode="reflect")
    return np.where(known, total / np.maximum(weight, 1e-9), np.nan)


def _pieces(values: Array) -> list[Array]:
    """Pieces of a profile or map that are nearly independent."""
    if values.ndim == 1:
        return np.array_split(values, _BLOCKS)
    rows = np.array_split(values, int(np.sqrt(_BLOCKS)), axis=0)
    return [p for row in rows for p in np.array_split(row, int(np.sqrt(_BLOCKS)), axis=1)]


def _density(values: Array, edges: Array) -> Array:
    return np.histogram(values, edges)[0] / (values.size * np.diff(edges))
