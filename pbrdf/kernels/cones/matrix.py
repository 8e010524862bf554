"""Mueller matrix of a mirror that joins two cones: of one path, and the mean over both."""

import math
from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.cones.lens import carried_axis
from pbrdf.kernels.optics.frames import turn_frame
from pbrdf.kernels.optics.fresnel import reflection_elements
from pbrdf.kernels.paths.ray_bounce import bounce_at
from pbrdf.kernels.paths.shading import reflect_once

# Axes of both cones, their horizontal s axes (x, y; of the detector's beam sent backwards
# and of the source's beam likewise), and their half-angles with cosines and sines
Cones = namedtuple(
    "Cones",
    "d_x d_y d_z d_sx d_sy i_x i_y i_z i_sx i_sy half_d cos_d sin_d half_i cos_i sin_i",
)


@jit(allocates=False)
def facet_mueller(cones, k_x, k_y, k_z, n_x, n_y, n_z, index, w, m, n_stokes, mueller):
    """Matrix of light sent from the detector along -k to a facet and on to the source.

    In the frames of the instrument, whose polarisers keep to the axes of the cones.
    """
    s_x, s_y, s_z = carried_axis(
        cones.d_x, cones.d_y, cones.d_z, cones.d_sx, cones.d_sy, k_x, k_y, k_z
    )
    r_x, r_y, r_z, s_x, s_y, s_z, cos_beta, c_in, s_in = bounce_at(
        -k_x, -k_y, -k_z, s_x, s_y, s_z, n_x, n_y, n_z
    )
    t_x, t_y, t_z = carried_axis(
        cones.i_x, cones.i_y, cones.i_z, cones.i_sx, cones.i_sy, r_x, r_y, r_z
    )
    c_out, s_out = turn_frame(r_x, r_y, r_z, s_x, s_y, s_z, t_x, t_y, t_z)
    a, b, c, d = reflection_elements(cos_beta, index.n[w, m], index.kappa[w, m])
    reflect_once(a, b, c, d, c_in, s_in, c_out, s_out, n_stokes, mueller)


@jit(allocates=False)
def mean_mueller(cones, across, optics, n_stokes, mueller, out):
    """Mean matrix (wavelengths, materials, stokes, stokes) of mirrors joining two cones.

    across      (k, 3) coordinates in the unit disc and weights of a rule for means over it

    F' of equation (16) for every pair of directions of the two cones, added to `out`; the
    facet that joins them is the one normal to their half vector.
    """
    for p in range(across.shape[0]):
        k_x, k_y, k_z = disc_direction(
            cones.d_x, cones.d_y, cones.d_z, cones.d_sx, cones.d_sy,
            cones.half_d * across[p, 0], cones.half_d * across[p, 1],
        )  # fmt: skip
        for q in range(across.shape[0]):
            l_x, l_y, l_z = disc_direction(
                cones.i_x, cones.i_y, cones.i_z, cones.i_sx, cones.i_sy,
                cones.half_i * across[q, 0], cones.half_i * across[q, 1],
            )  # fmt: skip
            n_x, n_y, n_z = k_x + l_x, k_y + l_y, k_z + l_z
            length = math.sqrt(n_x * n_x + n_y * n_y + n_z * n_z)
            weight = across[p, 2] * across[q, 2]
            for w in range(out.shape[0]):
                for m in range(out.shape[1]):
                    facet_mueller(
                        cones, k_x, k_y, k_z, n_x / length, n_y / length, n_z / length,
                        optics, w, m, n_stokes, mueller,
                    )  # fmt: skip
                    for row in range(n_stokes):
                        for column in range(n_stokes):
                            out[w, m, row, column] += weight * mueller[row, column]


@jit(inline="always")
def disc_direction(a_x, a_y, a_z, s_x, s_y, angle_s, angle_p):
    """Direction at the angles (along s, along a x s) from the axis a."""
    angle = math.sqrt(angle_s * angle_s + angle_p * angle_p)
    cosine = math.cos(angle)
    share = math.sin(angle) / angle if angle > 0.0 else 1.0
    c = share * angle_s
    d = share * angle_p
    return (
        cosine * a_x + c * s_x - d * a_z * s_y,
        cosine * a_y + c * s_y + d * a_z * s_x,
        cosine * a_z + d * (a_x * s_y - a_y * s_x),
    )
