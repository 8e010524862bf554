"""The surface as what lies on it sees it: heights, extent, where a body comes to rest."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import brentq

from pbrdf.kernels import clipping
from pbrdf.surface.heightmap import HeightMap
from pbrdf.surface.shapes import Shape

# Azimuths for one period of the grid along the rim of the body, and their bounds
AZIMUTHS_PER_CELL = 2.0
FEWEST, MOST = 64, 1024
# A body that floats free has this share of its size to the surface
TOUCH = 1e-12


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
        length_x, length_y = self.surface.size
        return length_x * length_y

    @property
    def _grid(self) -> tuple[np.ndarray, bool, float, float]:
        return self.surface.heights, self.surface.periodic, *self.surface.spacing

    def height_at(self, x: float, y: float) -> float:
        """Height of the facets at a place. [um]"""
        return float(clipping.surface_height(*self._grid, x, y))

    def rest(self, x: float, y: float, radius: float) -> float:
        """Height of the centre of a sphere that touches the surface from above. [um]"""
        return float(clipping.resting_height(*self._grid, x, y, radius))

    def azimuths(self, radius: float) -> int:
        """Count the azimuths over which volumes of a body this wide are summed."""
        rim = 2 * np.pi * radius / min(self.surface.spacing)
        wanted = 2 ** int(np.ceil(np.log2(max(AZIMUTHS_PER_CELL * rim, 1.0))))
        return min(max(wanted, FEWEST), MOST)

    def volume_above(
        self, shape: Shape, x: float, y: float, z: float, azimuths: int | None = None
    ) -> tuple[float, float]:
        """Volume [um³] of a body above the surface, and the area [um²] that it wets.

        z is where the plane of the shape lies; seen from above, the wetted area is a
        projected one.
        """
        count = self.azimuths(shape.radius) if azimuths is None else azimuths
        volume, wetted = clipping.volume_above(
            *self._grid, self.lowest, shape.slabs, x, y, z, count
        )
        return float(volume), float(wetted)

    def settle(self, shape: Shape, x: float, y: float) -> tuple[float, float, float]:
        """Find the height [um] of a shape's plane at which its volume above is true.

        The body keeps its size, and with it the volume that is cut off below: only the
        mean plane under a drop is replaced by the surface. Returns the height, the volume
        above and the wetted area.
        """
        if self.flat:
            return self.lowest, shape.volume, np.pi * shape.base_radius**2
        if shape.sunk_volume <= TOUCH * shape.volume:
            radius = 0.5 * (shape.height - shape.bottom)
            z = self.rest(x, y, radius) - 0.5 * (shape.height + shape.bottom)
            return z, shape.volume, 0.0
        # The plane of the drop lies between the lowest and the highest point, unless the
        # surface is steep enough to pierce it
        margin = 1e-6 * shape.height
        z, volume, wetted = clipping.settled_height(
            *self._grid, self.lowest, shape.slabs, x, y, shape.sunk_volume,
            self.lowest - margin, self.highest + margin, self.azimuths(shape.radius),
        )  # fmt: skip
        return float(z), float(volume), float(wetted)

    def fill_level(self, thickness: float) -> tuple[float, float]:
        """Level [um] of liquid of a mean thickness in the valleys, and the share wet."""
        area = self.area
        low, high = self.lowest, self.highest + thickness

        def excess(level: float) -> float:
            volume, _ = clipping.filled_volume(*self._grid, level)
            return float(volume / area - thickness)

        level = brentq(excess, low, high, xtol=1e-13 * (high - low), rtol=1e-15)
        _, wetted = clipping.filled_volume(*self._grid, level)
        return float(level), float(wetted / area)
