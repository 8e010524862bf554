"""Density of the slopes of facets: radial, or over both axes where they differ."""

import numpy as np
from scipy import ndimage

from fitting.prediction.facets import Facets
from pbrdf.analytic.slope_table import SlopeTable

Array = np.ndarray

# Width of a radial bin, and of the kernel of a table over both axes, beside the rms slope
_BIN = 0.1
_KERNEL = 0.15
_NODES = (161, 321)
# Nodes along the median slope
_STEPS = 6
# Facets beyond this share of all lie in the last cells of the table
_WITHIN = 0.9995


def slope_table(
    facets: Facets, *, scale: float = 1.0, nodes: int | None = None
) -> SlopeTable:
    """Density of the blurred slopes: radial, or over both axes where they differ.

    Parameters
    ----------
    scale : float
        Factor on all slopes of patches. [1]
    nodes : int, optional
        Along an axis; by default 161, or up to 321 where most slopes are small beside the
        steepest.
    """
    widths, _ = facets.principal
    reach = 1.1 * float(np.quantile(facets.radius, _WITHIN)) + _BIN
    limit = scale * widths.max() * reach + 4 * facets.blur
    if nodes is None:
        # The narrowest that the density can be, of slopes and of their blur
        core = scale * widths.min() * float(np.median(facets.radius))
        needed = _STEPS * 2 * limit / np.hypot(core, float(facets.blurs.min()))
        nodes = int(np.clip(needed, *_NODES)) | 1
    grid = np.linspace(-limit, limit, nodes)
    step = grid[1] - grid[0]
    density = np.zeros((nodes, nodes))
    for blur, group in facets.groups():
        if widths[0] == widths[1]:
            sharp = _rings(scale * widths[0], facets.radius[group], reach, grid)
            spread = blur
        else:
            x, y = scale * facets.slope_x[group], scale * facets.slope_y[group]
            sharp = _cells(x, y, grid)
            spread = np.hypot(blur, _KERNEL * scale * widths.min())
        density += ndimage.gaussian_filter(
            sharp, spread / step, mode="constant", truncate=5
        )
    return SlopeTable(grid, grid, density)


def _rings(width: float, radius: Array, reach: float, grid: Array) -> Array:
    """Facets per slope area at the nodes, from their |slope| in units of `width`."""
    count, edges = np.histogram(
        np.minimum(radius, reach * 0.999), int(reach / _BIN) + 2, (0, reach)
    )
    middle = np.append((edges[1:] + edges[:-1]) / 2, edges[-1])
    ring = np.append(count / np.diff(edges**2), 0.0)
    return np.interp(np.hypot(grid[:, None], grid) / width, middle, ring, right=0.0)


def _cells(slope_x: Array, slope_y: Array, grid: Array) -> Array:
    """Facets at the nearest nodes; those beyond the grid at its rim."""
    half = (grid[1] - grid[0]) / 2
    edges = np.append(grid - half, grid[-1] + half)
    inside = [np.clip(s, grid[0], grid[-1]) for s in (slope_x, slope_y)]
    return np.histogram2d(inside[0], inside[1], bins=[edges, edges])[0]
