"""A slope distribution as measured: a table of densities instead of a formula."""

from dataclasses import dataclass
from functools import cached_property
from math import pi

import numpy as np
import numpy.typing as npt

from pbrdf.errors import real_array, require

__all__ = ["SlopeTable"]

AZIMUTHS = 72
HEIGHTS = 257


@dataclass(frozen=True, eq=False)
class SlopeTable:
    """Density of facet slopes over a grid, linear between its nodes and 0 outside.

    Parameters
    ----------
    slope_x, slope_y : ndarray, shapes (nx,), (ny,)
        Evenly spaced nodes. [1]
    density : ndarray, shape (nx, ny)
        Relative frequency at the nodes; scaled to integrate to 1. [1]

    Raises
    ------
    ValueError
        If a grid is uneven or a density negative.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> table = SlopeTable.from_slopes(*rng.normal(0, [[0.1], [0.3]], (2, 100_000)))
    >>> [round(s, 2) for s in table.slope_rms]
    [0.1, 0.3]
    """

    slope_x: np.ndarray
    slope_y: np.ndarray
    density: np.ndarray

    def __post_init__(self) -> None:
        density = require(
            "density", self.density, lambda v: (v >= 0) & np.isfinite(v),
            "be finite and >= 0", "",
        )  # fmt: skip
        for name, size in zip(("slope_x", "slope_y"), density.shape, strict=True):
            grid = require(
                name, getattr(self, name), np.isfinite, "be finite [1]", "Give the nodes."
            )
            steps = np.diff(grid)
            even = grid.shape == (size,) and size > 2 and steps.min() > 0
            if not even or not np.allclose(steps, steps[0], rtol=1e-6):
                msg = f"{name} must rise evenly, one value per row of density, at least 3."
                raise ValueError(msg)
            object.__setattr__(self, name, grid)
        area = (self.slope_x[1] - self.slope_x[0]) * (self.slope_y[1] - self.slope_y[0])
        object.__setattr__(self, "density", density / (density.sum() * area))

    @classmethod
    def from_slopes(
        cls, slope_x: npt.ArrayLike, slope_y: npt.ArrayLike, *, bins: int = 101
    ) -> "SlopeTable":
        """Histogram of measured facet slopes, over all of their range about 0.

        Parameters
        ----------
        slope_x, slope_y : array_like
            Slopes of the same facets; masked ones, and NaN, are missing. [1]
        bins : int
            Cells along each axis: enough to resolve the peak, few enough to fill.
        """
        x, y = real_array("slope_x", slope_x), real_array("slope_y", slope_y)
        if x.shape != y.shape:
            msg = (
                f"slope_x and slope_y must have one shape, got {x.shape} and {y.shape}. "
                "Give both slopes of each facet."
            )
            raise ValueError(msg)
        known = ~(np.isnan(x) | np.isnan(y))
        x, y = x[known], y[known]
        if not x.size:
            msg = "slope_x must hold a slope at least, got none that is not missing."
            raise ValueError(msg)
        reach = [1.02 * float(np.abs(v).max()) for v in (x, y)]
        limits = [(-r, r) for r in reach]
        count, edges_x, edges_y = np.histogram2d(x, y, bins=bins, range=limits)
        # A node of no facets at each rim, so that the density ends where the slopes do
        step = [e[1] - e[0] for e in (edges_x, edges_y)]
        nodes = [
            np.arange(-1, bins + 1) * s + e[0] + s / 2
            for s, e in zip(step, (edges_x, edges_y), strict=True)
        ]
        return cls(nodes[0], nodes[1], np.pad(count, 1))

    @cached_property
    def slope_rms(self) -> tuple[float, float]:
        """Rms slope along x and y about 0. [1]"""
        share = self.density / self.density.sum()
        return (
            float(np.sqrt((share * self.slope_x[:, None] ** 2).sum())),
            float(np.sqrt((share * self.slope_y**2).sum())),
        )

    def density_at(self, slope_x: np.ndarray, slope_y: np.ndarray) -> np.ndarray:
        """Density at any slopes, 0 outside the table."""
        points = np.stack([slope_x, slope_y], axis=-1)
        return self._interpolator(points)

    def overhang(self, theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
        """Smith's Lambda, <max(z' - cot theta, 0)>/cot theta with slopes z' along phi."""
        cot = np.cos(theta) / np.maximum(np.sin(theta), 1e-30)
        height, table = self._overhangs
        points = np.stack([np.mod(phi, 2 * pi), np.minimum(cot, height[-1])], axis=-1)
        return table(points) / cot

    @cached_property
    def _interpolator(self):  # type: ignore[no-untyped-def]
        from scipy.interpolate import RegularGridInterpolator

        return RegularGridInterpolator(
            (self.slope_x, self.slope_y), self.density, bounds_error=False, fill_value=0.0
        )

    @cached_property
    def _overhangs(self):  # type: ignore[no-untyped-def]
        """<max(z' - h, 0)> over azimuths and heights h, as an interpolator."""
        from scipy.interpolate import RegularGridInterpolator

        share = (self.density / self.density.sum()).ravel()
        filled = share > 0
        x = np.repeat(self.slope_x, self.slope_y.size)[filled]
        y = np.tile(self.slope_y, self.slope_x.size)[filled]
        azimuth = np.linspace(0, 2 * pi, AZIMUTHS + 1)
        reach = float(np.hypot(x, y).max())
        # Crowded towards 0, where grazing rays look
        height = reach * np.linspace(0, 1, HEIGHTS) ** 2
        values = np.empty((azimuth.size, height.size))
        for row, phi in zip(values, azimuth, strict=True):
            along = x * np.cos(phi) + y * np.sin(phi)
            order = np.argsort(along)
            rest = np.concatenate([np.cumsum(share[filled][order][::-1])[::-1], [0.0]])
            first = np.concatenate(
                [np.cumsum((share[filled] * along)[order][::-1])[::-1], [0.0]]
            )
            start = np.searchsorted(along[order], height)
            row[:] = first[start] - height * rest[start]
        table = RegularGridInterpolator((azimuth, height), np.maximum(values, 0.0))
        return height, table
