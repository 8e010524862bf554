"""A height map made ready for tracing: corner heights, block maxima, entry points."""

from dataclasses import dataclass, field

import numpy as np

from pbrdf.kernels.terrain.heightfield import Terrain, block_maxima
from pbrdf.kernels.terrain.horizon import build_horizon
from pbrdf.kernels.terrain.relief import steepest_slope
from pbrdf.surface.heightmap import HeightMap
from pbrdf.tracer.guard import guards, ways

# A finite map keeps at least a rim this many height ranges wide free of entry points, at
# most an eighth of each side
GUARD_HEIGHTS = 2.0
GUARD_SHARE = 0.125
# Least share of the area of a finite map that must be left for entry points
LEAST_INTERIOR = 0.1
# Cells that light may cross on its way down the height range of a periodic surface: the
# first meetings of a line of rays take a walk over all of them, some 10 ns each
MOST_CROSSED = 4e6
# As many times more lines of entry points carry the directions of a source of some width
LINES_OF_A_DISC = 4
NO_LABELS = np.empty((0, 0), dtype=np.uint8)
# As the labels of maps, so that one compiled kernel takes both
NO_LABELS.flags.writeable = False


def cone_rim(
    theta_i: float, phi_i: float, half_angle: float
) -> tuple[np.ndarray, np.ndarray]:
    """Horizontal components of directions on the rim of a cone about (theta_i, phi_i)."""
    turn = np.linspace(0.0, 2.0 * np.pi, 181 if half_angle > 0.0 else 1)
    forward = np.cos(half_angle) * np.sin(theta_i)
    forward = forward + np.sin(half_angle) * np.cos(turn) * np.cos(theta_i)
    across = np.sin(half_angle) * np.sin(turn)
    return (
        forward * np.cos(phi_i) - across * np.sin(phi_i),
        forward * np.sin(phi_i) + across * np.cos(phi_i),
    )


def count_lines(width: float, depth: float, n_rays: int, half_angle: float) -> int:
    """Count the lines that space `n_rays` rays evenly both along and across them.

    All rays of a line come from one direction: a source of some width has more lines.
    """
    lines = round(np.sqrt(n_rays * min(width, depth) / max(width, depth)))
    return max(1, min(lines * (LINES_OF_A_DISC if half_angle > 0.0 else 1), n_rays))


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
    _entries: dict[tuple[float, ...], tuple[np.ndarray, bool]] = field(
        default_factory=dict, repr=False, compare=False
    )

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

    def entry_lines(self, launch: np.ndarray, n_rays: int, half_angle: float = 0.0) -> int:
        """Count the lines of entry points of a launch rectangle; see `count_lines`."""
        width, depth = launch[2] * self.pitch[0], launch[3] * self.pitch[1]
        return count_lines(width, depth, n_rays, half_angle)

    def entry_rectangle(
        self, theta_i: float, phi_i: float | None, half_angle: float = 0.0
    ) -> np.ndarray:
        """Corner x, y and lengths [cells] of the entry points in the top plane, shape (4,).

        On a periodic surface it is the whole period. On a finite map it is where light from
        (theta_i, phi_i) [rad] (None: from any azimuth) reaches the lowest point inside the
        map, for every direction within `half_angle` [rad] of it, less a guard rim: one so
        wide that hardly any light leaves sideways, see `pbrdf.tracer.guard`, or if that
        leaves less than a tenth of the map a narrow one.

        Raises
        ------
        ValueError
            If less than a tenth of a finite map is left, or the light grazes a periodic
            surface so that it crosses millions of cells on its way down.
        """
        nx, ny = self.terrain.heights.shape
        if self.periodic:
            self._refuse_grazing(theta_i + half_angle)
            return np.array([0.0, 0.0, nx, ny])
        return self._entry(theta_i, phi_i, half_angle)[0]

    def is_guarded(self, theta_i: float, phi_i: float | None) -> bool:
        """Whether hardly any light leaves sideways, the entry rectangle being so narrow."""
        return self.periodic or self._entry(theta_i, phi_i, 0.0)[1]

    def _entry(
        self, theta_i: float, phi_i: float | None, half_angle: float
    ) -> tuple[np.ndarray, bool]:
        known = (theta_i, np.inf if phi_i is None else phi_i, half_angle)
        if known not in self._entries:
            self._entries[known] = self._inner_rectangle(theta_i, phi_i, half_angle)
        return self._entries[known]

    def _refuse_grazing(self, theta: float) -> None:
        """Refuse light that crosses too many cells before it has come down."""
        pitch = min(self.pitch)
        reach = np.tan(theta) * self.height_range
        if reach > MOST_CROSSED * pitch:
            highest = np.arctan(MOST_CROSSED * pitch / self.height_range)
            msg = (
                f"theta_i must be at most {highest:.7f} rad over this surface "
                f"({np.rad2deg(highest):.5f} deg), got {theta:.7f}: light would cross "
                f"{reach / pitch:.3g} cells of {pitch:.4g} um on its way down "
                f"{self.height_range:.4g} um of height. Take a steeper source, or look for "
                "heights that are no surface. At grazing every surface is a mirror, which "
                "geometric optics does not know."
            )
            raise ValueError(msg)

    def _inner_rectangle(
        self, theta_i: float, phi_i: float | None, half_angle: float
    ) -> tuple[np.ndarray, bool]:
        nx, ny = self.terrain.heights.shape
        height_range = self.height_range
        sides = np.array([nx - 1.0, ny - 1.0])
        pitch = np.asarray(self.pitch)
        steepest = theta_i + half_angle
        if phi_i is None:
            drift = np.tan(steepest) * height_range / pitch
            below, above = -drift, drift
        else:
            x, y = cone_rim(theta_i, phi_i, half_angle)
            # Height falls from the top to the bottom: cells crossed along x and y
            drift = np.stack([x, y]) / np.sqrt(1.0 - x * x - y * y) * -height_range
            drift /= pitch[:, None]
            below = np.minimum(drift.min(axis=1), 0.0)
            above = np.maximum(drift.max(axis=1), 0.0)
        least = np.minimum(GUARD_HEIGHTS * height_range / pitch, GUARD_SHARE * sides)
        # The hits lie between the entry point and the entry point plus the drift
        low, lengths = least - below, sides - 2.0 * least - above + below
        if lengths.min() <= 0.0 or lengths.prod() < LEAST_INTERIOR * sides.prod():
            reach = np.tan(steepest) * height_range
            msg = (
                f"theta_i must suit the size of the finite map, got {theta_i:g} rad: light "
                f"crosses {reach:.3g} um of it on its way down a height range of "
                f"{height_range:.3g} um. Use a larger map, a steeper source "
                "or periodic=True."
            )
            raise ValueError(msg)
        narrow = np.concatenate([low, lengths])
        for before, behind in guards(
            ways(self.terrain, theta_i, phi_i, narrow), least, sides
        ):
            low, lengths = before - below, sides - before - behind - above + below
            if lengths.min() > 0.0 and lengths.prod() >= LEAST_INTERIOR * sides.prod():
                return np.concatenate([low, lengths]), True
        # None is wide enough: the narrow rim, and what leaves sideways is told
        return narrow, False
