"""A few rays ahead of a run over a finite map: how far light must go to be clear of it."""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.paths.ray_bounce import mirror
from pbrdf.kernels.paths.transport import MAX_STEPS
from pbrdf.kernels.terrain.heightfield import (
    ESCAPED,
    HIT,
    SIDE,
    facet_slopes,
    leave_facet,
    walk,
)

MOST_BOUNCES = 8


@jit(allocates=False)
def ways_to_clear(terrain, sin_theta, cos_theta, azimuths, launch, ways):
    """Fill the way (rays, rays, 2) [cells] that each path has to go after its last bounce.

    The rays enter on an even grid over `launch` (corner x, y and lengths [cells]) and take
    the azimuths in turn. The way leads to where the ray is above the highest node; it is
    none where the ray is steeper than every facet.
    """
    rows, columns = ways.shape[:2]
    for a in range(rows):
        for b in range(columns):
            ways[a, b, 0] = 0.0
            ways[a, b, 1] = 0.0
            phi = azimuths[(a * columns + b) % azimuths.shape[0]]
            k_x = -sin_theta * math.cos(phi)
            k_y = -sin_theta * math.sin(phi)
            k_z = -cos_theta
            x = launch[0] + launch[2] * ((a + 0.5) / rows)
            y = launch[1] + launch[3] * ((b + 0.5) / columns)
            i = min(int(x), terrain.heights.shape[0] - 2)
            j = min(int(y), terrain.heights.shape[1] - 2)
            fate, i, j, facet, u, v, z = walk(
                terrain, i, j, -1, x - i, y - j, terrain.z_top, k_x / terrain.pitch_x,
                k_y / terrain.pitch_y, k_z, 0.0, MAX_STEPS,
            )  # fmt: skip
            foot = z
            for _ in range(MOST_BOUNCES):
                if fate != HIT:
                    break
                foot = z
                slope_x, slope_y = facet_slopes(terrain, i, j, facet)
                k_x, k_y, k_z, _, _, _, leave_rate, _ = mirror(
                    k_x, k_y, k_z, slope_x, slope_y
                )
                fate, i, j, facet, u, v, z = leave_facet(
                    terrain, i, j, facet, u, v, z, k_x, k_y, k_z, leave_rate, MAX_STEPS
                )
            level = math.sqrt(k_x * k_x + k_y * k_y)
            if fate in (ESCAPED, SIDE) and k_z < terrain.steepest * level:
                time = (terrain.z_top - foot) / max(k_z, 1e-9)
                ways[a, b, 0] = k_x * time / terrain.pitch_x
                ways[a, b, 1] = k_y * time / terrain.pitch_y
