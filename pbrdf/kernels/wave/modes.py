"""Jones matrices of many outgoing waves for one incident one."""

import numpy as np

from pbrdf.kernels import jit
from pbrdf.kernels.wave.amplitudes import Ray, lateral_ray, medium_of, tangent_plane

__all__ = ["fill_tangent_plane"]


@jit
def fill_tangent_plane(theta_i, lateral, n, kappa, out):
    """Tangent-plane kernel b cos(theta_s) cos(theta_i), (N, 4), of lateral vectors (2, N).

    The plane of incidence holds the x axis; the light travels towards +x.
    """
    ray_in = Ray(np.sin(theta_i), np.cos(theta_i), 1.0, 0.0)
    medium = medium_of(n, kappa)
    for k in range(out.shape[0]):
        four = tangent_plane(ray_in, lateral_ray(lateral[0, k], lateral[1, k]), medium)
        for element in range(4):
            out[k, element] = four[element]
