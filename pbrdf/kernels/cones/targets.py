"""The cones at the far end of a scan, and the light that a diffuse base sends to them."""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.cones.lens import cap_direction, leave
from pbrdf.kernels.cones.record import A_SX, A_SY, A_X, A_Y, A_Z, catch_path
from pbrdf.kernels.meshes.search import across_of
from pbrdf.kernels.optics.frames import PARALLEL
from pbrdf.kernels.paths.random import uniform_pair
from pbrdf.kernels.paths.shading import COS_OUT, N_SEGMENTS
from pbrdf.kernels.paths.transport import normal_of_facet
from pbrdf.kernels.terrain.heightfield import ESCAPED

# Columns of a target: sine and cosine of zenith, of azimuth from the bundle, of half-angle,
# cosine of the angle within which a path was near, and the mean square of what it adds then
T_SIN, T_COS, T_COS_PHI, T_SIN_PHI, T_COS_HALF, T_SIN_HALF = 0, 1, 2, 3, 4, 5
T_COS_NEAR, T_CHANCE, N_TARGET = 6, 7, 8


@jit(inline="always")
def place_axes(bundle, targets, cos_phi, sin_phi, axes):
    """Axes of the targets as they stand about the azimuth of the bundles."""
    for target in range(targets.shape[0]):
        c = cos_phi * targets[target, T_COS_PHI] - sin_phi * targets[target, T_SIN_PHI]
        s = sin_phi * targets[target, T_COS_PHI] + cos_phi * targets[target, T_SIN_PHI]
        axes[target, A_X] = targets[target, T_SIN] * c
        axes[target, A_Y] = targets[target, T_SIN] * s
        axes[target, A_Z] = targets[target, T_COS]
        # z x k of a beam that leaves towards the target
        axes[target, A_SX] = -s
        axes[target, A_SY] = c


@jit(allocates=False)
def light_from_base(
    terrain, mesh, i, j, facet, u, v, z, weight, targets, axes, stream, name, event,
    record, bounces, optics, catch,
):  # fmt: skip
    """Ask each target for its light on the base under a facet: one ray into its cone."""
    n_x, n_y, n_z, steep = normal_of_facet(terrain, mesh, i, j, facet)
    for target in range(targets.shape[0]):
        draw_a, draw_b = uniform_pair(stream, name, event)
        event += 1
        k_x, k_y, k_z = cap_direction(
            axes[target, A_X], axes[target, A_Y], axes[target, A_Z],
            axes[target, A_SX], axes[target, A_SY], targets[target, T_COS_HALF],
            draw_a, draw_b,
        )  # fmt: skip
        cosine = n_x * k_x + n_y * k_y + n_z * k_z
        if cosine <= 0.0:
            continue
        fate = leave(terrain, mesh, i, j, facet, u, v, z, k_x, k_y, k_z, cosine * steep)[0]
        catch.counts[N_SEGMENTS] += 1
        if fate != ESCAPED:
            continue
        s_x = k_y * n_z - k_z * n_y
        s_y = k_z * n_x - k_x * n_z
        s_z = k_x * n_y - k_y * n_x
        square = s_x * s_x + s_y * s_y + s_z * s_z
        if square > PARALLEL:
            scale = 1.0 / math.sqrt(square)
            s_x, s_y, s_z = s_x * scale, s_y * scale, s_z * scale
        else:
            # Along the normal every axis across it serves
            s_x, s_y, s_z, _, _, _ = across_of(n_x, n_y, n_z)
        record[bounces, 0, COS_OUT] = cosine
        # The solid angle of the cone over pi: the base spreads its light as cosine / pi
        share = 2.0 * (1.0 - targets[target, T_COS_HALF])
        catch_path(
            weight * share * cosine, target, axes, record, bounces + 1,
            k_x, k_y, k_z, s_x, s_y, s_z, optics, catch,
        )  # fmt: skip
    return event
