r"""Slopes that light sees on a height map: patches, their diffraction, and the density.

A patch of the surface, weighted by a Gaussian of standard deviation s, mirrors light into
its own slope, blurred per axis by its diffraction,

.. math::
   b = \frac{1}{2 s q_z} = \frac{\lambda}{8 \pi s}

at normal incidence (q_z = 4 pi / lambda). A large patch hides the slopes within it, a
small one diffracts. On the patch where both are equal the blur gives back the variance
that the smoothing took. On a smooth map the patch is large against the
wavelength and small against the surface, and both vanish beside the slopes.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from pbrdf.analytic.slope_table import SlopeTable
from pbrdf.surface.heightmap import HeightMap

Array = np.ndarray

# Principal slopes that differ by less than this factor are those of an isotropic surface
_ISOTROPIC = 1.2
# Width of a radial bin beside the rms slope
_BIN = 0.1
_NODES = 161
# Facets beyond this share of all lie in the last cells of the table
_WITHIN = 0.9995
# Nodes an axis from which the size of patches is found
_ENOUGH = 512
# Patches are sought between a twentieth of a wavelength and this many
_LARGEST = 20.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Facets:
    """Slopes of the patches of a map, and the blur of each.

    Parameters
    ----------
    slope_x, slope_y : ndarray, shape (n,)
        Of the patches, about the mean plane. [1]
    patch : float
        Standard deviation of their Gaussian weight. [um]
    blur : float
        Diffraction of a patch, per axis. [1]
    hidden : float
        Rms slope within a patch, per axis. [1]
    """

    slope_x: Array
    slope_y: Array
    patch: float
    blur: float
    hidden: float

    @property
    def slope_rms(self) -> float:
        """Of patches and blur together, per axis. [1]"""
        square = (np.mean(self.slope_x**2) + np.mean(self.slope_y**2)) / 2
        return float(np.sqrt(square + self.blur**2))


def smooth_slopes(surface: HeightMap, smoothing: float = 0.0) -> tuple[Array, Array]:
    """Slopes of a map about its mean plane after a Gaussian smoothing [um].

    Cells near missing heights, and near the rim of the smoothed map, are left out.
    """
    heights = surface.heights
    known = np.isfinite(heights)
    widths = [smoothing / step for step in surface.spacing]
    if smoothing > 0:
        mode = "wrap" if surface.periodic else "nearest"
        weight = ndimage.gaussian_filter(known.astype(float), widths, mode=mode)
        level = float(heights[known].mean())
        filled = np.where(known, heights - level, 0.0)
        with np.errstate(invalid="ignore", divide="ignore"):
            smooth = ndimage.gaussian_filter(filled, widths, mode=mode) / weight
        heights = np.where(known & (weight > 0.98), smooth, np.nan)
    if not surface.periodic:
        # The smoothed rim is drawn towards itself
        rim = [
            min(int(np.ceil(2 * w)), (n - 2) // 3)
            for w, n in zip(widths, heights.shape, strict=True)
        ]
        heights = heights[
            tuple(slice(r, n - r) for r, n in zip(rim, heights.shape, strict=True))
        ]
    x, y = _cell_slopes(heights, surface)
    both = np.isfinite(x) & np.isfinite(y)
    if both.sum() < 100:
        msg = (
            f"surface must have 100 cells of known heights at least, got {both.sum()}. "
            "Give a larger map."
        )
        raise ValueError(msg)
    x, y = x[both], y[both]
    return x - x.mean(), y - y.mean()


def hidden_slope(surface: HeightMap, patch: float) -> float:
    """Rms slope along an axis within a patch, about that of the patch; median over the map.

    The mean over the map would be that of its few cliffs.
    """
    slopes = _cell_slopes(surface.heights, surface)
    known = np.isfinite(slopes[0]) & np.isfinite(slopes[1])
    widths = [patch / step for step in surface.spacing]
    mode = "wrap" if surface.periodic else "nearest"

    def mean(values: Array) -> Array:
        filled = np.where(known, values, 0.0)
        return np.asarray(ndimage.gaussian_filter(filled, widths, mode=mode))

    weight = np.where(known, np.maximum(mean(np.ones(known.shape)), 1e-9), 1.0)
    within = [mean(s**2) / weight - (mean(s) / weight) ** 2 for s in slopes]
    median = np.mean([np.median(np.sqrt(np.maximum(w[known], 0.0))) for w in within])
    return float(median)


def _cell_slopes(heights: Array, surface: HeightMap) -> tuple[Array, Array]:
    """Slopes of the cells of a map, NaN beside missing heights."""
    dx, dy = surface.spacing
    if surface.periodic:
        x = (np.roll(heights, -1, 0) - heights) / dx
        y = (np.roll(heights, -1, 1) - heights) / dy
    else:
        x = np.diff(heights, axis=0)[:, :-1] / dx
        y = np.diff(heights, axis=1)[:-1] / dy
    return x, y


def find_patch(surface: HeightMap, wavelength: float) -> float:
    """Size of the patch whose diffraction equals the slopes that it hides. [um]"""
    from scipy.optimize import brentq

    extent = min(n * d for n, d in zip(surface.shape, surface.spacing, strict=True))
    low, high = 0.05 * wavelength, min(_LARGEST * wavelength, extent / 12)

    surface = _middle(surface)

    def excess(log_size: float) -> float:
        size = float(np.exp(log_size))
        return hidden_slope(surface, size) - diffraction(size, wavelength)

    if high <= low or excess(np.log(high)) < 0:
        return max(high, low)
    return float(np.exp(brentq(excess, np.log(low), np.log(high), xtol=0.02)))


def _middle(surface: HeightMap) -> HeightMap:
    """Return the middle of a large map: its median is known well enough."""
    begin = [max(n - _ENOUGH, 0) // 2 for n in surface.shape]
    if not any(begin):
        return surface
    inside = tuple(slice(b, b + _ENOUGH) for b in begin)
    return HeightMap(surface.heights[inside], surface.spacing)


def diffraction(patch: float, wavelength: float) -> float:
    """Blur of the slope of a patch per axis, at normal incidence. [1]"""
    return wavelength / (8 * np.pi * patch)


def facets_of(
    surface: HeightMap, wavelength: float, *, patch: float, resolution: float = 0.0
) -> Facets:
    """Slopes of patches of a size on a map that its instrument smoothed already.

    Parameters
    ----------
    resolution : float
        Standard deviation of the instrument's point spread; the map is smoothed by what a
        patch is larger only. [um]
    """
    smoothing = float(np.sqrt(max(patch**2 - resolution**2, 0.0)))
    slopes = smooth_slopes(surface, smoothing)
    hidden = hidden_slope(surface, smoothing) if smoothing > 0 else 0.0
    return Facets(
        slope_x=slopes[0], slope_y=slopes[1], patch=patch,
        blur=diffraction(patch, wavelength), hidden=hidden,
    )  # fmt: skip


def slope_table(facets: Facets, *, scale: float = 1.0, nodes: int = _NODES) -> SlopeTable:
    """Density of the blurred slopes: radial, or elliptical where the axes differ.

    Parameters
    ----------
    scale : float
        Factor on all slopes of patches. [1]
    """
    slopes = scale * np.stack([facets.slope_x, facets.slope_y])
    covariance = slopes @ slopes.T / slopes.shape[1]
    values, axes = np.linalg.eigh(covariance)
    if values[1] < _ISOTROPIC**2 * values[0]:
        values = np.full(2, values.mean())
    widths = np.sqrt(np.maximum(values, 1e-16))
    # Slopes in units of their rms along the principal axes
    to_units = axes / widths @ axes.T
    radius = np.hypot(*(to_units @ slopes))
    reach = 1.1 * float(np.quantile(radius, _WITHIN)) + _BIN
    count, edges = np.histogram(
        np.minimum(radius, reach * 0.999), int(reach / _BIN) + 2, (0, reach)
    )
    ring = count / (np.pi * np.diff(edges**2)) / radius.size
    middle = np.concatenate([(edges[1:] + edges[:-1]) / 2, [edges[-1]]])
    ring = np.append(ring, 0.0)
    limits = np.sqrt((widths.max() * reach) ** 2 + (4 * facets.blur) ** 2)
    grid = np.linspace(-limits, limits, nodes)
    step = grid[1] - grid[0]
    along, across = np.tensordot(
        to_units, np.stack(np.meshgrid(grid, grid, indexing="ij")), 1
    )
    density = np.interp(np.hypot(along, across), middle, ring, right=0.0)
    blurred = ndimage.gaussian_filter(
        density, facets.blur / step, mode="constant", truncate=5
    )
    return SlopeTable(grid, grid, blurred)
