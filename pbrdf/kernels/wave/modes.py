"""Jones matrices of many outgoing waves for one incident one."""

import numpy as np

from pbrdf.kernels import jit
from pbrdf.kernels.wave.amplitudes import (
    Ray,
    first_order,
    lateral_ray,
    medium_of,
    tangent_plane,
)

__all__ = ["fill_modes"]


@jit
def fill_modes(theta_i, lateral, n, kappa, plane, first):
    """Kernels b cos(theta_s) cos(theta_i), (N, 4), of lateral vectors (2, N).

    `plane` takes that of the tangent plane, `first` that of first order. The plane of
    incidence holds the x axis; the light travels towards +x.
    """
    ray_in = Ray(np.sin(theta_i), np.cos(theta_i), 1.0, 0.0)
    medium = medium_of(n, kappa)
    for k in range(plane.shape[0]):
        ray_out = lateral_ray(lateral[0, k], lateral[1, k])
        four, rice = (
            tangent_plane(ray_in, ray_out, medium),
            first_order(ray_in, ray_out, medium),
        )
        for element in range(4):
            plane[k, element] = four[element]
            first[k, element] = rice[element]
