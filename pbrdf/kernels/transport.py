"""Rays from the source to the bins over an opaque height field, one path after another.

The path depends on the facets alone; `pbrdf.kernels.shading` then multiplies the Fresnel
matrices of each material or wavelength along its record.
"""

import math

import numpy as np

from pbrdf.kernels import jit
from pbrdf.kernels.binning import bin_edges
from pbrdf.kernels.entry import entry_line, first_ray, wrap_into
from pbrdf.kernels.frames import PARALLEL, turn_frame
from pbrdf.kernels.heightfield import (
    ESCAPED,
    FACET_HIGH,
    FACET_LOW,
    HIT,
    NEVER,
    SIDE,
    corner_heights,
    facet_gradient,
    plane_height,
    walk,
)
from pbrdf.kernels.shading import N_ESCAPED, N_LEAKED, N_SIDE, N_TRUNCATED, tally_path

MAX_STEPS = 10_000_000
# Smallest cosine of a hit: rounding may leave a grazing ray parallel to the facet it meets
GRAZING = 1e-15


@jit(inline="always")
def reflect(k_x, k_y, k_z, slope_x, slope_y):
    """Mirror direction at a facet, the facet's normal and the cosine of incidence."""
    length = math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    n_x = -slope_x / length
    n_y = -slope_y / length
    n_z = 1.0 / length
    cos_beta = max(-(k_x * n_x + k_y * n_y + k_z * n_z), GRAZING)
    r_x = k_x + 2.0 * cos_beta * n_x
    r_y = k_y + 2.0 * cos_beta * n_y
    r_z = k_z + 2.0 * cos_beta * n_z
    # Keep the direction a unit vector over any number of bounces
    scale = 1.0 / math.sqrt(r_x * r_x + r_y * r_y + r_z * r_z)
    return r_x * scale, r_y * scale, r_z * scale, n_x, n_y, n_z, cos_beta


@jit(inline="always")
def bounce(k_x, k_y, k_z, s_x, s_y, s_z, slope_x, slope_y):
    """Reflect a beam and its frame at a facet.

    Returns the new direction, the new s axis, the speed at which the ray leaves the facet
    upwards, the cosine of incidence and the turn of the frame into the plane of incidence.
    """
    r_x, r_y, r_z, n_x, n_y, n_z, cos_beta = reflect(k_x, k_y, k_z, slope_x, slope_y)
    # The s axis of the facet is k x n, the same before and after
    w_x = k_y * n_z - k_z * n_y
    w_y = k_z * n_x - k_x * n_z
    w_z = k_x * n_y - k_y * n_x
    c2, s2 = turn_frame(k_x, k_y, k_z, s_x, s_y, s_z, w_x, w_y, w_z)
    square = w_x * w_x + w_y * w_y + w_z * w_z
    if square > PARALLEL:
        scale = 1.0 / math.sqrt(square)
        s_x = w_x * scale
        s_y = w_y * scale
        s_z = w_z * scale
    leave_rate = max(r_z - slope_x * r_x - slope_y * r_y, GRAZING)
    return r_x, r_y, r_z, s_x, s_y, s_z, leave_rate, cos_beta, c2, s2


@jit(inline="always")
def exit_turn(k_x, k_y, k_z, s_x, s_y, s_z, cos_phi_i, sin_phi_i):
    """Turn of the frame to the meridian plane of the exit direction, e_s = z x k."""
    m_x = -k_y
    m_y = k_x
    if k_x * k_x + k_y * k_y < PARALLEL:
        # Straight up: the azimuth of the source stands for that of the detector
        m_x = -sin_phi_i
        m_y = cos_phi_i
    return turn_frame(k_x, k_y, k_z, s_x, s_y, s_z, m_x, m_y, 0.0)


@jit(inline="always")
def follow_path(
    heights, maxima, levels, z_top, periodic, pitch_x, pitch_y,
    fate, i, j, facet, u, v, z, cos_phi, sin_phi, sin_theta_i, cos_theta_i,
    max_bounces, cos_beta, turn,
):  # fmt: skip
    """Follow a ray from its first meeting with the surface until it leaves for good.

    `fate` says what became of it so far: HIT on the facet given, or what `walk` returned.
    Fills column 0 of `cos_beta` (bounces, 1) and `turn` (bounces + 1, 1, 2). Returns the count to which the path
    belongs, the number of bounces and the exit direction.
    """
    # The beam travels against dir_i; its frame has e_s horizontal
    k_x = -sin_theta_i * cos_phi
    k_y = -sin_theta_i * sin_phi
    k_z = -cos_theta_i
    s_x = sin_phi
    s_y = -cos_phi
    s_z = 0.0
    bounces = 0
    while fate == HIT and bounces < max_bounces:
        step_x, step_y = facet_gradient(heights, i, j, facet, periodic)
        k_x, k_y, k_z, s_x, s_y, s_z, leave_rate, cosine, c2, s2 = bounce(
            k_x, k_y, k_z, s_x, s_y, s_z, step_x / pitch_x, step_y / pitch_y
        )
        cos_beta[bounces, 0] = cosine
        turn[bounces, 0, 0] = c2
        turn[bounces, 0, 1] = s2
        bounces += 1
        fate, i, j, facet, u, v, z = walk(
            heights, maxima, levels, z_top, periodic,
            i, j, facet, u, v, z, k_x / pitch_x, k_y / pitch_y, k_z, leave_rate, MAX_STEPS,
        )  # fmt: skip

    c2, s2 = exit_turn(k_x, k_y, k_z, s_x, s_y, s_z, cos_phi, sin_phi)
    turn[bounces, 0, 0] = c2
    turn[bounces, 0, 1] = s2
    count = N_LEAKED
    if fate == HIT:
        count = N_TRUNCATED
    elif fate == SIDE:
        count = N_SIDE
    elif fate == ESCAPED and bounces > 0:
        count = N_ESCAPED
    return count, bounces, k_x, k_y, k_z


@jit
def trace_batch(
    heights, maxima, levels, z_top, periodic, pitch_x, pitch_y, launch, n_lines,
    sin_theta_i, cos_theta_i, phi_i, uniform_phi, n_rays, shifts, max_bounces,
    n, kappa, n_stokes, brdf, energy, counts,
):  # fmt: skip
    """Trace rays of one incident direction and add their Mueller matrices to the bins.

    Every ray walks from its entry point in the top plane; see `sweep_batch`.

    launch, n_lines, shifts  entry rectangle, lines and random shifts of `entry_line`
    n, kappa        refractive index (wavelengths,)
    brdf            flux by bin (wavelengths, bounces, n_theta, n_dphi, stokes, stokes), added to
    energy          (wavelengths, 3), by what took it: ABSORBED, TRUNCATED, LEAKED, added to
    counts          rays by fate, path segments and self hits (6,), added to
    """
    cos_beta = np.empty((max_bounces, 1))
    turn = np.empty((max_bounces + 1, 1, 2))
    mueller = np.zeros((4, 4))
    zenith, azimuth = bin_edges(brdf.shape[2], brdf.shape[3])
    for line in range(n_lines):
        start_x, start_y, speed_x, speed_y, length, _, offset, cos_phi, sin_phi = entry_line(
            line, n_lines, launch, shifts, phi_i, uniform_phi, pitch_x, pitch_y
        )
        first = first_ray(line, n_lines, n_rays)
        rays = first_ray(line + 1, n_lines, n_rays) - first
        for ray in range(rays):
            s = length * ((ray + offset) / rays)
            x = wrap_into(start_x + speed_x * s, launch[0], launch[2])
            y = wrap_into(start_y + speed_y * s, launch[1], launch[3])
            i = min(int(x), heights.shape[0] - 1)
            j = min(int(y), heights.shape[1] - 1)
            fate, i, j, facet, u, v, z = walk(
                heights, maxima, levels, z_top, periodic, i, j, -1, x - i, y - j, z_top,
                -sin_theta_i * cos_phi / pitch_x, -sin_theta_i * sin_phi / pitch_y,
                -cos_theta_i, 0.0, MAX_STEPS,
            )  # fmt: skip
            count, bounces, k_x, k_y, k_z = follow_path(
                heights, maxima, levels, z_top, periodic, pitch_x, pitch_y,
                fate, i, j, facet, u, v, z, cos_phi, sin_phi, sin_theta_i, cos_theta_i,
                max_bounces, cos_beta, turn,
            )  # fmt: skip
            tally_path(
                count, 1, 0, bounces, cos_beta, turn, k_x, k_y, k_z, cos_phi, sin_phi,
                n, kappa, n_stokes, zenith, azimuth, mueller, brdf, energy, counts,
            )  # fmt: skip


@jit
def sweep_batch(
    heights, maxima, levels, z_top, periodic, pitch_x, pitch_y, launch, n_lines,
    sin_theta_i, cos_theta_i, phi_i, uniform_phi, n_rays, shifts, max_bounces,
    n, kappa, n_stokes, brdf, energy, counts,
):  # fmt: skip
    """`trace_batch` over a periodic field, without a search for the first facets.

    The rays of a line travel in one vertical plane. There a ray is the line of constant
    s + (z - z_top) tan(theta_i) / unit; the first point of the surface, in the direction of the
    light, at which this lag reaches the ray's value is where the ray arrives. One pass along
    the surface thus serves all rays of the line in their order.
    """
    nx, ny = heights.shape
    cos_beta = np.empty((max_bounces, 1))
    turn = np.empty((max_bounces + 1, 1, 2))
    mueller = np.zeros((4, 4))
    zenith, azimuth = bin_edges(brdf.shape[2], brdf.shape[3])
    for line in range(n_lines):
        start_x, start_y, speed_x, speed_y, length, unit, offset, cos_phi, sin_phi = entry_line(
            line, n_lines, launch, shifts, phi_i, uniform_phi, pitch_x, pitch_y
        )
        first = first_ray(line, n_lines, n_rays)
        rays = first_ray(line + 1, n_lines, n_rays) - first
        drift = sin_theta_i / cos_theta_i / unit  # in s per height
        forward_x = speed_x >= 0.0
        forward_y = speed_y >= 0.0
        per_x = 1.0 / speed_x if speed_x != 0.0 else NEVER
        per_y = 1.0 / speed_y if speed_y != 0.0 else NEVER
        x0 = start_x
        y0 = start_y
        i = min(int(x0), nx - 1)
        j = min(int(y0), ny - 1)
        s = 0.0
        ray = 0
        lag = length * (offset / max(rays, 1))
        while ray < rays:
            t_x = (i + (1 if forward_x else 0) - x0) * per_x
            t_y = (j + (1 if forward_y else 0) - y0) * per_y
            s_out = max(min(t_x, t_y), s)
            z00, z10, z01, z11 = corner_heights(heights, i, j, periodic)
            highest = max(max(z00, z10), max(z01, z11))
            if s_out + (highest - z_top) * drift >= lag:
                # The light reaches into this cell: through its one or two facets
                u_in = x0 + speed_x * s - i
                v_in = y0 + speed_y * s - j
                u_out = x0 + speed_x * s_out - i
                v_out = y0 + speed_y * s_out - j
                side_in = u_in - v_in
                side_out = u_out - v_out
                split = side_in * side_out < 0.0
                side = side_in if split else side_in + side_out
                facet = FACET_LOW if side > 0.0 else FACET_HIGH
                s_a = s
                u_a = u_in
                v_a = v_in
                for part in range(2):
                    s_b = s_out
                    if split and part == 0:
                        s_b = s + (s_out - s) * (side_in / (side_in - side_out))
                    u_b = x0 + speed_x * s_b - i
                    v_b = y0 + speed_y * s_b - j
                    z_a = plane_height(z00, z10, z01, z11, facet, u_a, v_a)
                    z_b = plane_height(z00, z10, z01, z11, facet, u_b, v_b)
                    lag_a = s_a + (z_a - z_top) * drift
                    lag_b = s_b + (z_b - z_top) * drift
                    while ray < rays and lag <= lag_b:
                        share = 0.0
                        if lag_b > lag_a:
                            share = min(max((lag - lag_a) / (lag_b - lag_a), 0.0), 1.0)
                        count, bounces, k_x, k_y, k_z = follow_path(
                            heights, maxima, levels, z_top, periodic, pitch_x, pitch_y,
                            HIT, i, j, facet, u_a + share * (u_b - u_a),
                            v_a + share * (v_b - v_a), z_a + share * (z_b - z_a),
                            cos_phi, sin_phi, sin_theta_i, cos_theta_i,
                            max_bounces, cos_beta, turn,
                        )  # fmt: skip
                        tally_path(
                            count, 1, 0, bounces, cos_beta, turn, k_x, k_y, k_z, cos_phi, sin_phi,
                            n, kappa, n_stokes, zenith, azimuth, mueller, brdf, energy, counts,
                        )  # fmt: skip
                        ray += 1
                        lag = length * ((ray + offset) / rays)
                    if not split:
                        break
                    facet = 1 - facet
                    s_a = s_b
                    u_a = u_b
                    v_a = v_b

            # Into the next cell, round the period
            if t_x <= t_y:
                i += 1 if forward_x else -1
                if i == nx:
                    i = 0
                    x0 -= nx
                elif i < 0:
                    i = nx - 1
                    x0 += nx
            else:
                j += 1 if forward_y else -1
                if j == ny:
                    j = 0
                    y0 -= ny
                elif j < 0:
                    j = ny - 1
                    y0 += ny
            s = s_out
