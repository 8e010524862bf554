"""Kernels of a profile: waves in one plane, so that s and p stay apart."""

import numpy as np

from pbrdf.kernels import jit
from pbrdf.kernels.wave.amplitudes import (
    LEAST_COSINE,
    Ray,
    first_order,
    medium_of,
    tangent_plane,
)
from pbrdf.kernels.wave.lanes import HORIZON
from pbrdf.kernels.wave.scatter import shadowing

__all__ = ["fill_changes", "fill_profile"]


@jit(part=True)
def plane_ray(lateral):
    """Ray of a signed lateral wave vector."""
    length = min(abs(lateral), 1.0)
    cosine = max(np.sqrt((1.0 - length) * (1.0 + length)), LEAST_COSINE)
    return Ray(length, cosine, 1.0 if lateral >= 0.0 else -1.0, 0.0)


@jit(part=True)
def kernels_between(lateral_in, lateral_out, medium):
    """First-order and tangent-plane kernels b of s and p, in frames that do not turn."""
    ray_in, ray_out = plane_ray(lateral_in), plane_ray(lateral_out)
    scale = ray_in.along * ray_out.along / (ray_in.cos * ray_out.cos)
    rice = first_order(ray_in, ray_out, medium)
    plane = tangent_plane(ray_in, ray_out, medium)
    return scale * rice[0], scale * rice[3], scale * plane[0], scale * plane[3]


@jit
def fill_profile(lateral_in, lateral_out, indices, slope, kernels, shadow):
    """Kernels of the geometries themselves, (N, 4), and Smith's factor."""
    for k in range(lateral_in.size):
        medium = medium_of(indices[0, k], indices[1, k])
        four = kernels_between(lateral_in[k], lateral_out[k], medium)
        for element in range(4):
            kernels[k, element] = four[element]
        shadow[k] = shadowing(plane_ray(lateral_in[k]), plane_ray(lateral_out[k]), slope[k])


@jit
def fill_changes(lateral_in, lateral_out, indices, shifts, changes):
    """First-order less tangent-plane kernel at half a shift about the mean: (N, M, 2).

    Each of the two waves stays within HORIZON, or within the outermost of the rays given:
    then the shift K itself gives the kernels of the geometry.
    """
    for k in range(lateral_in.size):
        medium = medium_of(indices[0, k], indices[1, k])
        middle = 0.5 * (lateral_in[k] + lateral_out[k])
        rim = max(HORIZON, max(abs(lateral_in[k]), abs(lateral_out[k])))
        for m in range(shifts.shape[1]):
            half = min(0.5 * shifts[k, m], rim - abs(middle))
            rice_s, rice_p, plane_s, plane_p = kernels_between(
                middle - half, middle + half, medium
            )
            changes[k, m, 0] = rice_s - plane_s
            changes[k, m, 1] = rice_p - plane_p
