"""The surface as what lies on it sees it: heights, extent, where a body comes to rest."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from pbrdf.contaminants.shapes import Shape
from pbrdf.kernels.bodies import clipping, resting
from pbrdf.kernels.terrain import relief
from pbrdf.surface.heightmap import HeightMap
from pbrdf.surface.periodic import nearest, wrapped

# Azimuths for one period of the grid along the rim of the body, and their bounds
AZIMUTHS_PER_CELL = 4.0
FEWEST, MOST = 512, 2048
# A body that floats free has this share of its size to the surface
TOUCH = 1e-12


class Rest(NamedTuple):
    """A body at rest.

    Height of its plane [um], volume above the surface [um³], wetted area as seen from
    above [um²] and the distance of its outermost point from the axis [um].
    """

    z: float
    volume: float
    wetted: float
    rim: float


@dataclass(frozen=True, eq=False)
class Ground:
    """A height map without holes, on which bodies are set down."""

    surface: HeightMap

    def __post_init__(self) -> None:
        if self.surface.missing > 0.0:
            msg = (
                "heights must be complete under contaminants, got "
                f"{100 * self.surface.missing:.2g} % missing. Fill the holes with "
                "HeightMap.filled()."
            )
            raise ValueError(msg)

    @property
    def size(self) -> tuple[float, float]:
        """Lengths of the period, or of the whole finite map. [um]"""
        return self.surface.size

    @property
    def corner(self) -> tuple[float, float]:
        """Lowest x and y. [um]"""
        return 0.0, 0.0

    @property
    def periodic(self) -> bool:
        """Whether the surface repeats."""
        return self.surface.periodic

    @cached_property
    def lowest(self) -> float:
        """Lowest node. [um]"""
        return float(self.surface.heights.min())

    @cached_property
    def highest(self) -> float:
        """Highest node. [um]"""
        return float(self.surface.heights.max())

    @property
    def flat(self) -> bool:
        """Whether the surface is a horizontal plane."""
        return self.lowest == self.highest

    @property
    def area(self) -> float:
        """Area of one period, or of the whole finite map. [um²]"""
        length_x, length_y = self.size
        return length_x * length_y

    @cached_property
    def wenzel_factor(self) -> float:
        """True area of the facets over the area seen from above. [1]"""
        return float(relief.area_ratio(*self._grid))

    def steep_share(self, slope: float) -> float:
        """Share of the surface that is steeper than a slope. [1]"""
        return float(relief.steep_share(*self._grid, slope))

    def wrapped(self, places: np.ndarray) -> np.ndarray:
        """Move places (..., 2) into the period; on a finite map they stay. [um]"""
        if not self.periodic:
            return places
        return wrapped(places, np.asarray(self.size))

    def nearest(self, offsets: np.ndarray) -> np.ndarray:
        """Offsets (..., 2) to the nearest images; on a finite map they stay. [um]"""
        if not self.periodic:
            return offsets
        return nearest(offsets, np.asarray(self.size))

    @property
    def _grid(self) -> tuple[np.ndarray, bool, float, float]:
        return self.surface.heights, self.surface.periodic, *self.surface.spacing

    def height_at(self, x: float, y: float) -> float:
        """Height of the facets at a place. [um]"""
        return float(clipping.surface_height(*self._grid, x, y))

    def rest(self, x: float, y: float, radius: float) -> float:
        """Height of the centre of a sphere that touches the surface from above. [um]"""
        return float(resting.resting_height(*self._grid, x, y, radius))

    def azimuths(self, radius: float) -> int:
        """Count the azimuths over which volumes of a body this wide are summed."""
        rim = 2 * np.pi * radius / min(self.surface.spacing)
        wanted = 2 ** int(np.ceil(np.log2(max(AZIMUTHS_PER_CELL * rim, 1.0))))
        return min(max(wanted, FEWEST), MOST)

    def volume_above(
        self, shape: Shape, x: float, y: float, z: float, azimuths: int | None = None
    ) -> Rest:
        """Measure a body whose plane lies at height z [um] about the axis (x, y)."""
        count = self.azimuths(shape.radius) if azimuths is None else azimuths
        found = clipping.volume_above(*self._grid, self.lowest, shape.slabs, x, y, z, count)
        return Rest(z, *map(float, found))

    def settle(self, shape: Shape, x: float, y: float) -> Rest:
        """Lay a drop about the axis (x, y), with its volume above the surface true.

        The body keeps its size, and with it the volume that is cut off below: the mean
        plane under the drop is where both are as on a plane.
        """
        if self.flat:
            wetted = np.pi * shape.base_radius**2
            return Rest(self.lowest, shape.volume, wetted, shape.base_radius)
        if shape.sunk_volume <= TOUCH * shape.volume:
            radius = 0.5 * (shape.height - shape.bottom)
            z = self.rest(x, y, radius) - 0.5 * (shape.height + shape.bottom)
            return Rest(z, shape.volume, 0.0, 0.0)
        # The plane of the drop lies between the lowest and the highest point
        margin = 1e-6 * shape.height
        low, high = self.lowest - margin, self.highest + margin
        azimuths = self.azimuths(shape.radius)
        # The mean square distance from the axis of a disc is half that of its rim
        radius = float(np.sqrt(0.5)) * shape.base_radius
        start = float(clipping.mean_near(*self._grid, x, y, radius))
        # Most of the way with few azimuths, the rest with all
        for count in (azimuths // 8, azimuths):
            found = clipping.settled_height(
                *self._grid, self.lowest, shape.slabs, x, y, shape.volume,
                shape.sunk_volume, low, high, start, count,
            )  # fmt: skip
            start = found[0]
        return Rest(*map(float, found))

    def trimmed(self, shape: Shape, x: float, y: float, z: float) -> Shape:
        """Body of a drop; a height map hides all of it that lies below the surface."""
        return shape

    def fill_level(self, thickness: float) -> tuple[float, float]:
        """Level [um] of liquid of a mean thickness in the valleys, and the share wet."""
        area = self.area
        low, high = self.lowest, self.highest + 2.0 * thickness

        def excess(level: float) -> float:
            volume, _ = relief.filled_volume(*self._grid, level)
            return float(volume / area - thickness)

        level = brentq(excess, low, high, xtol=1e-13 * (high - low), rtol=1e-15)
        _, wetted = relief.filled_volume(*self._grid, level)
        return float(level), float(wetted / area)
