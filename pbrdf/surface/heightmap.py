"""A height field on a regular grid, triangulated into facets."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pbrdf.errors import real_array, require
from pbrdf.surface.mend import fill_holes, mirror_edges


@dataclass(frozen=True, kw_only=True, eq=False, repr=False, init=False)
class HeightMap:
    """Heights on a regular grid; each grid cell is split into two flat facets.

    The diagonal of every cell runs from node (i, j) to node (i + 1, j + 1), so the slopes
    of a facet are forward differences of the heights.

    Parameters
    ----------
    heights : array_like, shape (nx, ny)
        Height of node (i, j) at x = i dx, y = j dy; NaN or masked where nothing was
        measured. [um]
    spacing : float or (float, float)
        Grid steps dx, dy. [um]
    periodic : bool
        True if the surface repeats with period (nx dx, ny dy): node nx is node 0.
    labels : array_like, optional, shape `cells`
        Number of the material of each grid cell, where the surface has several.

    Raises
    ------
    TypeError
        If the heights are complex or no numbers.
    ValueError
        If the heights are not a two-dimensional array of at least 2 x 2 nodes, are
        infinite, or the spacing is not positive.

    Examples
    --------
    >>> plane = HeightMap([[0.0, 0.0], [0.5, 0.5]], 1.0)
    >>> plane.slopes()[0]
    array([[0.5, 0.5]])
    """

    heights: np.ndarray
    spacing: tuple[float, float]
    periodic: bool
    labels: np.ndarray | None

    def __init__(
        self,
        heights: npt.ArrayLike,
        spacing: float | tuple[float, float],
        *,
        periodic: bool = False,
        labels: npt.ArrayLike | None = None,
    ) -> None:
        # An array that nobody can write to any more is taken as it is
        grid = real_array("heights", heights, "Mark missing points with NaN or a mask.")
        if grid.flags.writeable or grid.base is not None:
            grid = grid.copy()
        if grid.ndim != 2 or min(grid.shape) < 2:
            msg = (
                f"heights must have shape (nx, ny) with at least 2 x 2 nodes, got shape "
                f"{grid.shape}. A profile z(x) is not a height map; use a Profile."
            )
            raise ValueError(msg)
        if np.isinf(grid).any():
            place = tuple(int(i) for i in np.argwhere(np.isinf(grid))[0])
            msg = (
                f"heights must be finite [um], got {grid[place]} at index {place}. "
                "Mark missing points with NaN."
            )
            raise ValueError(msg)
        steps = require(
            "spacing",
            spacing,
            lambda v: (v > 0) & np.isfinite(v),
            "be positive [um]",
            "Give the grid step in micrometres, or (dx, dy).",
        )
        if steps.shape not in ((), (2,)):
            msg = f"spacing must be a number or (dx, dy) [um], got shape {steps.shape}."
            raise ValueError(msg)
        pair = np.broadcast_to(steps, (2,))
        grid.setflags(write=False)
        object.__setattr__(self, "heights", grid)
        object.__setattr__(self, "spacing", (float(pair[0]), float(pair[1])))
        object.__setattr__(self, "periodic", bool(periodic))
        object.__setattr__(self, "labels", None)
        if labels is not None:
            object.__setattr__(self, "labels", _material_numbers(labels, self.cells))

    def __repr__(self) -> str:
        nx, ny = self.heights.shape
        kind = "periodic" if self.periodic else "not periodic"
        return f"HeightMap({nx} x {ny} nodes, spacing={self.spacing} um, {kind})"

    @classmethod
    def flat(cls, size: tuple[float, float] = (1.0, 1.0)) -> "HeightMap":
        """Periodic plane z = 0 with periods `size` = (lx, ly). [um]"""
        lengths = require(
            "size", size, lambda v: v > 0, "be positive [um]", "Give (lx, ly)."
        )
        lx, ly = np.broadcast_to(lengths, (2,))
        return cls(np.zeros((2, 2)), (lx / 2, ly / 2), periodic=True)

    @property
    def shape(self) -> tuple[int, int]:
        """Number of nodes (nx, ny)."""
        nx, ny = self.heights.shape
        return nx, ny

    @property
    def cells(self) -> tuple[int, int]:
        """Number of grid cells along x and y; each holds two facets."""
        nx, ny = self.heights.shape
        return (nx, ny) if self.periodic else (nx - 1, ny - 1)

    @property
    def size(self) -> tuple[float, float]:
        """Lateral lengths of the mapped area along x and y. [um]"""
        return self.cells[0] * self.spacing[0], self.cells[1] * self.spacing[1]

    @property
    def missing(self) -> float:
        """Fraction of nodes without a measured height (NaN). [1]"""
        return float(np.isnan(self.heights).mean())

    def slopes(self) -> tuple[np.ndarray, np.ndarray]:
        """Facet slopes dz/dx, shape (cells_x, ny), and dz/dy, shape (nx, cells_y). [1]

        Each value belongs to the two facets that share that grid edge.
        """
        dx, dy = self.spacing
        if self.periodic:
            along_x = np.roll(self.heights, -1, axis=0) - self.heights
            along_y = np.roll(self.heights, -1, axis=1) - self.heights
        else:
            along_x = np.diff(self.heights, axis=0)
            along_y = np.diff(self.heights, axis=1)
        return along_x / dx, along_y / dy

    def filled(self) -> "HeightMap":
        """Copy with every hole closed by the membrane that its rim spans.

        A missing node takes the mean of its neighbours (Laplace's equation), so that
        heights stay within those of the rim; slopes inside a hole are too low. `missing`
        says how much of the map this concerns.

        Raises
        ------
        ValueError
            If more than half of the heights are missing.

        Examples
        --------
        >>> holed = HeightMap([[0.0, 1.0, 2.0], [0.0, np.nan, 2.0], [0.0, 1.0, 2.0]], 1.0)
        >>> float(holed.filled().heights[1, 1])
        1.0
        """
        heights = fill_holes(self.heights, periodic=self.periodic)
        return HeightMap(heights, self.spacing, periodic=self.periodic, labels=self.labels)

    def mirrored(self) -> "HeightMap":
        """Copy made periodic by reflection at its far edges, without a step at the seam.

        It is twice as long on both axes, and every slope occurs with both signs: the mean
        tilt and any skewness of the slopes are lost.

        Examples
        --------
        >>> HeightMap([[0.0, 1.0, 3.0], [0.0, 1.0, 3.0]], 1.0).mirrored().heights
        array([[0., 1., 3., 1.],
               [0., 1., 3., 1.]])
        """
        labels = self.labels
        if labels is not None:
            labels = np.concatenate([labels, labels[::-1]], axis=0)
            labels = np.concatenate([labels, labels[:, ::-1]], axis=1)
        return HeightMap(
            mirror_edges(self.heights), self.spacing, periodic=True, labels=labels
        )


def _material_numbers(labels: npt.ArrayLike, cells: tuple[int, int]) -> np.ndarray:
    """Check a label map: one whole number from 0 to 255 for each cell."""
    # Two materials may come as a map of truth values
    if np.asanyarray(labels).dtype == bool:
        labels = np.asanyarray(labels).astype(np.uint8)
    numbers = require(
        "labels", labels, lambda v: (v >= 0) & (v <= 255) & (v == np.floor(v)),
        "be whole numbers in [0, 255]", "Number the materials from 0.",
    )  # fmt: skip
    if numbers.shape != cells:
        msg = (
            f"labels must have the shape of the cells {cells}, got {numbers.shape}. "
            "A finite map of (nx, ny) nodes has (nx - 1, ny - 1) cells."
        )
        raise ValueError(msg)
    table = numbers.astype(np.uint8)
    table.setflags(write=False)
    return table
