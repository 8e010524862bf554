"""Mueller matrix of a mirror that joins two cones: of one path, and the mean over both."""

import math
from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.optics.frames import carried_axis, turn_frame
from pbrdf.kernels.optics.fresnel import reflection_elements
from pbrdf.kernels.optics.vectors import Vec, combined, cross, dot, opposite
from pbrdf.kernels.paths.ray_bounce import bounce_at
from pbrdf.kernels.paths.shading import reflect_once

# Axes of the cones of detector d and source i, their horizontal s axes (of the detector's
# beam sent backwards and of the source's beam likewise), and their half-angles with cosines
# and sines
Cones = namedtuple("Cones", "d d_s i i_s half_d cos_d sin_d half_i cos_i sin_i")


@jit(part=True, allocates=False)
def facet_mueller(cones, k, normal, index, w, m, n_stokes, mueller):
    """Matrix of light sent from the detector along -k to a facet and on to the source.

    In the frames of the instrument, whose polarisers keep to the axes of the cones.
    """
    s = carried_axis(cones.d, cones.d_s, k)
    r, s, cos_beta, turn_in = bounce_at(opposite(k), s, normal)
    turn_out = turn_frame(r, s, carried_axis(cones.i, cones.i_s, r))
    elements = reflection_elements(cos_beta, index.n[w, m], index.kappa[w, m])
    reflect_once(elements, turn_in, turn_out, n_stokes, mueller)


@jit(allocates=False)
def mean_mueller(cones, across, optics, n_stokes, mueller, out):
    """Mean matrix (wavelengths, materials, stokes, stokes) of mirrors joining two cones.

    across      (k, 3) coordinates in the unit disc and weights of a rule for means over it

    F' of equation (16) for every pair of directions of the two cones, added to `out`; the
    facet that joins them is the one normal to their half vector.
    """
    for p in range(across.shape[0]):
        k = disc_direction(
            cones.d, cones.d_s, cones.half_d * across[p, 0], cones.half_d * across[p, 1]
        )
        for q in range(across.shape[0]):
            to_i = disc_direction(
                cones.i, cones.i_s, cones.half_i * across[q, 0], cones.half_i * across[q, 1]
            )
            half = Vec(k.x + to_i.x, k.y + to_i.y, k.z + to_i.z)
            length = math.sqrt(dot(half, half))
            normal = Vec(half.x / length, half.y / length, half.z / length)
            weight = across[p, 2] * across[q, 2]
            for w in range(out.shape[0]):
                for m in range(out.shape[1]):
                    facet_mueller(cones, k, normal, optics, w, m, n_stokes, mueller)
                    for row in range(n_stokes):
                        for column in range(n_stokes):
                            out[w, m, row, column] += weight * mueller[row, column]


@jit(forceinline=True)
def disc_direction(a, s, angle_s, angle_p):
    """Direction at the angles (along s, along a x s) from the axis a."""
    angle = math.sqrt(angle_s * angle_s + angle_p * angle_p)
    share = math.sin(angle) / angle if angle > 0.0 else 1.0
    return combined(math.cos(angle), a, share * angle_s, s, share * angle_p, cross(a, s))
