"""How far from the rim of a finite map light must arrive so as not to leave sideways.

Light that leaves a facet at a low elevation needs a long way before it has risen above the
highest node; where it crosses the rim first, its fate is unknown. A few thousand rays tell
how long the ways are, and so which guards are wide enough, before a run is traced.
"""

from collections.abc import Iterator

import numpy as np

from pbrdf.kernels.paths.pilot import ways_to_clear
from pbrdf.kernels.terrain.heightfield import Terrain

# Share of rays that may be expected to leave sideways; hazard B5 tolerates 1e-3
TARGET = 7e-4
# Rays sent ahead, on a square grid, and azimuths of light that comes from all around
RAYS = 160
AZIMUTHS = 16
# Wider and wider guards go as far as all but these shares of the light need
SHARES = np.geomspace(0.1, 1e-4, 25)


def ways(
    terrain: Terrain, theta_i: float, phi_i: float | None, launch: np.ndarray
) -> np.ndarray:
    """Ways (rays, 2) [cells] after the last bounce to where light is clear of the map.

    The light comes from (theta_i, phi_i) [rad] and enters evenly over `launch`.
    """
    azimuths = np.arange(AZIMUTHS) * 2.0 * np.pi / AZIMUTHS
    if phi_i is not None:
        azimuths = np.array([phi_i])
    found = np.empty((RAYS, RAYS, 2))
    ways_to_clear(terrain, np.sin(theta_i), np.cos(theta_i), azimuths, launch, found)
    return found.reshape(-1, 2)


def expected_exits(
    way: np.ndarray, low: np.ndarray, high: np.ndarray, sides: np.ndarray
) -> float:
    """Share of light that leaves the map if it arrives evenly between `low` and `high`."""
    first = np.maximum(low, -way)
    last = np.minimum(high, sides - way)
    return float(1.0 - np.clip((last - first) / (high - low), 0.0, 1.0).prod(axis=1).mean())


def guards(
    way: np.ndarray, least: np.ndarray, sides: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield guards at the lower and the upper rims [cells] that are wide enough.

    They are at least `least` wide, and grow.
    """
    for share in (1.0, *SHARES):
        low, high = least, least
        if share < 1.0:
            low = np.maximum(least, np.quantile(-way, 1.0 - share, axis=0))
            high = np.maximum(least, np.quantile(way, 1.0 - share, axis=0))
        if (low + high >= sides).any():
            return
        if expected_exits(way, low, sides - high, sides) <= TARGET:
            yield low, high
