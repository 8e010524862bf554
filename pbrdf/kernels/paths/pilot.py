"""A few rays ahead of a run over a finite map: how far light must go to be clear of it."""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.optics.vectors import Vec
from pbrdf.kernels.paths.ground import first_facet, next_facet, normal_of_facet
from pbrdf.kernels.paths.ray_bounce import mirror_at
from pbrdf.kernels.terrain.heightfield import ESCAPED, HIT, SIDE

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
            k = Vec(-sin_theta * math.cos(phi), -sin_theta * math.sin(phi), -cos_theta)
            x = launch[0] + launch[2] * ((a + 0.5) / rows)
            y = launch[1] + launch[3] * ((b + 0.5) / columns)
            i = min(int(x), terrain.heights.shape[0] - 2)
            j = min(int(y), terrain.heights.shape[1] - 2)
            fate, place = first_facet(terrain, None, i, j, x - i, y - j, k)
            foot = place.z
            for _bounce in range(MOST_BOUNCES):
                if fate != HIT:
                    break
                foot = place.z
                normal, steep = normal_of_facet(terrain, None, place)
                k, _, cosine = mirror_at(k, normal)
                fate, place = next_facet(terrain, None, None, place, k, cosine * steep)
            level = math.sqrt(k.x * k.x + k.y * k.y)
            if fate in (ESCAPED, SIDE) and k.z < terrain.steepest * level:
                time = (terrain.z_top - foot) / max(k.z, 1e-9)
                ways[a, b, 0] = k.x * time / terrain.pitch_x
                ways[a, b, 1] = k.y * time / terrain.pitch_y
