"""A height map made ready for tracing: corner heights, block maxima, entry points."""

from dataclasses import dataclass

import numpy as np

from pbrdf.kernels.heightfield import Terrain, block_maxima, steepest_slope
from pbrdf.kernels.horizon import build_horizon
from pbrdf.surface.heightmap import HeightMap

# A finite map keeps a rim this many height ranges wide free of entry points, at most an
# eighth of each side, so that light leaving the interior rises above the map before its
# edge
GUARD_HEIGHTS = 2.0
GUARD_SHARE = 0.125
# Least share of the area of a finite map that must be left for entry points
LEAST_INTERIOR = 0.1
NO_LABELS = np.empty((0, 0), dtype=np.uint8)


@dataclass(frozen=True, kw_only=True)
class Field:
    """One surface as the kernels take it, built once for all directions.

    Attributes
    ----------
    terrain : Terrain
        Heights, pyramid of block maxima, grid steps and labels.
    z_bottom : float
        Lowest node. [um]
    """

    terrain: Terrain
    z_bottom: float

    @classmethod
    def of(cls, surface: HeightMap) -> "Field":
        """Prepare a height map without missing heights."""
        maxima, levels = block_maxima(surface.heights, surface.periodic)
        steepest = steepest_slope(surface.heights, surface.periodic, *surface.spacing)
        terrain = Terrain(
            heights=surface.heights,
            maxima=maxima,
            levels=levels,
            z_top=float(surface.heights.max()),
            free_slope=steepest,
            steepest=steepest,
            periodic=surface.periodic,
            pitch_x=surface.spacing[0],
            pitch_y=surface.spacing[1],
            horizon=build_horizon(
                surface.heights, surface.periodic, float(surface.heights.max())
            ),
            labels=NO_LABELS if surface.labels is None else surface.labels,
        )
        return cls(terrain=terrain, z_bottom=float(surface.heights.min()))

    @property
    def periodic(self) -> bool:
        """Whether the surface repeats."""
        return bool(self.terrain.periodic)

    @property
    def pitch(self) -> tuple[float, float]:
        """Grid steps. [um]"""
        return self.terrain.pitch_x, self.terrain.pitch_y

    @property
    def height_range(self) -> float:
        """Height of the highest node above the lowest. [um]"""
        return float(self.terrain.z_top - self.z_bottom)

    def entry_lines(self, launch: np.ndarray, n_rays: int) -> int:
        """Count the lines that space `n_rays` rays evenly both along and across them."""
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
        nx, ny = self.terrain.heights.shape
        if self.periodic:
            return np.array([0.0, 0.0, nx, ny])
        height_range = self.height_range
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
                f"{height_range:.3g} um. Use a larger map, a steeper source "
                "or periodic=True."
            )
            raise ValueError(msg)
        return np.concatenate([low, lengths])
