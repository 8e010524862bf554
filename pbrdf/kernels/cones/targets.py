"""The cones at the far end of a scan, and the light that a diffuse base sends to them."""

from pbrdf.kernels import jit
from pbrdf.kernels.cones.lens import cap_direction, leave
from pbrdf.kernels.cones.record import (
    A_SX,
    A_SY,
    A_X,
    A_Y,
    A_Z,
    T_COS,
    T_COS_HALF,
    T_COS_PHI,
    T_SIN,
    T_SIN_PHI,
    axis_of_target,
    catch_path,
)
from pbrdf.kernels.optics.frames import axis_of_exit
from pbrdf.kernels.optics.vectors import dot
from pbrdf.kernels.paths.ground import normal_of_facet
from pbrdf.kernels.paths.random import uniform_pair
from pbrdf.kernels.paths.shading import COS_OUT, N_SEGMENTS
from pbrdf.kernels.terrain.heightfield import ESCAPED


@jit(inline="always")
def place_axes(targets, cos_phi, sin_phi, axes):
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


@jit(part=True, allocates=False)
def light_from_base(terrain, mesh, place, bounces, weight, draw, scan):
    """Ask each target for its light on the base under a facet: one ray into its cone.

    Returns the number of the next draw.
    """
    stream, name, event = draw
    normal, steep = normal_of_facet(terrain, mesh, place)
    for target in range(scan.targets.shape[0]):
        draw_a, draw_b = uniform_pair(stream, name, event)
        event += 1
        cos_half = scan.targets[target, T_COS_HALF]
        axis, axis_s = axis_of_target(scan, target)
        k = cap_direction(axis, axis_s, cos_half, draw_a, draw_b)
        cosine = dot(normal, k)
        if cosine <= 0.0:
            continue
        fate, _ = leave(terrain, mesh, place, k, cosine * steep)
        scan.catch.counts[N_SEGMENTS] += 1
        if fate != ESCAPED:
            continue
        scan.record[bounces, 0, COS_OUT] = cosine
        # The solid angle of the cone over pi: the base spreads its light as cosine / pi
        share = 2.0 * (1.0 - cos_half)
        s = axis_of_exit(k, normal)
        catch_path(weight * share * cosine, target, bounces + 1, k, s, scan)
    return event
