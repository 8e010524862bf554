"""A height map made ready for tracing: corner heights, block maxima, entry points."""

from dataclasses import dataclass

import numpy as np

from pbrdf.kernels.heightfield import block_maxima
from pbrdf.surface.heightmap import HeightMap

# A finite map keeps a rim this many height ranges wide free of entry points, at most an eighth
# of each side, so that light leaving the interior rises above the map before its edge
GUARD_HEIGHTS = 2.0
GUARD_SHARE = 0.125
# Least share of the area of a finite map that must be left for entry points
LEAST_INTERIOR = 0.1


@dataclass(frozen=True, kw_only=True)
class Field:
    """Arrays of one surface as the kernels take them, built once for all directions.

    Attributes
    ----------
    heights : ndarray, shape (nx, ny)
        Node heights. [um]
    maxima, levels : ndarray
        Pyramid of block maxima, see `pbrdf.kernels.heightfield.block_maxima`.
    z_top, z_bottom : float
        Highest and lowest node. [um]
    pitch : (float, float)
        Grid steps. [um]
    periodic : bool
        Whether the surface repeats.
    """

    heights: np.ndarray
    maxima: np.ndarray
    levels: np.ndarray
    z_top: float
    z_bottom: float
    pitch: tuple[float, float]
    periodic: bool

    @classmethod
    def of(cls, surface: HeightMap) -> "Field":
        """Prepare a height map without missing heights."""
        maxima, levels = block_maxima(surface.heights, surface.periodic)
        return cls(
            heights=surface.heights,
            maxima=maxima,
            levels=levels,
            z_top=float(surface.heights.max()),
            z_bottom=float(surface.heights.min()),
            pitch=surface.spacing,
            periodic=surface.periodic,
        )

    @property
    def cells(self) -> tuple[int, int]:
        """Number of grid cells along x and y."""
        nx, ny = self.heights.shape
        return (nx, ny) if self.periodic else (nx - 1, ny - 1)

    def entry_lines(self, launch: np.ndarray, n_rays: int) -> int:
        """Number of lines that space `n_rays` rays evenly both along and across them."""
        width, depth = launch[2] * self.pitch[0], launch[3] * self.pitch[1]
        aspect = min(width, depth) / max(width, depth)
        return max(1, round(np.sqrt(n_rays * aspect)))

    def entry_rectangle(self, theta_i: float, phi_i: float | None) -> np.ndarray:
        """Corner x, y and lengths [cells] of the entry points in the top plane, shape (4,).

        On a periodic surface it is the whole period. On a finite map it is where light from
        (theta_i, phi_i) [rad] (None: from any azimuth) reaches the lowest point inside the
        map, less a guard rim.

        Raises
        ------
        ValueError
            If less than a tenth of a finite map is left.
        """
        nx, ny = self.heights.shape
        if self.periodic:
            return np.array([0.0, 0.0, nx, ny])
        height_range = self.z_top - self.z_bottom
        sides = np.array([nx - 1.0, ny - 1.0])
        pitch = np.asarray(self.pitch)
        drift = -np.tan(theta_i) * height_range / pitch
        if phi_i is None:
            below, above = -np.abs(drift), np.abs(drift)
        else:
            drift = drift * np.array([np.cos(phi_i), np.sin(phi_i)])
            below, above = np.minimum(drift, 0.0), np.maximum(drift, 0.0)
        guard = np.minimum(GUARD_HEIGHTS * height_range / pitch, GUARD_SHARE * sides)
        # The hits lie between the entry point and the entry point plus the drift
        low = guard - below
        high = sides - guard - above
        lengths = high - low
        if lengths.min() <= 0.0 or lengths.prod() < LEAST_INTERIOR * sides.prod():
            reach = np.tan(theta_i) * height_range
            msg = (
                f"theta_i must suit the size of the finite map, got {theta_i:g} rad: light "
                f"crosses {reach:.3g} um of it on its way down a height range of "
                f"{height_range:.3g} um. Use a larger map, a steeper source or periodic=True."
            )
            raise ValueError(msg)
        return np.concatenate([low, lengths])
