"""Rays from the source to the bins over an opaque height field, one path after another.

The path depends on the facets alone; `pbrdf.kernels.shading` then multiplies the Fresnel
matrices of each material or wavelength along its record.
"""

import math

import numpy as np

from pbrdf.kernels import jit
from pbrdf.kernels.binning import TWO_PI
from pbrdf.kernels.frames import PARALLEL, turn_frame
from pbrdf.kernels.heightfield import ESCAPED, HIT, SIDE, facet_gradient, walk
from pbrdf.kernels.shading import N_ESCAPED, N_LEAKED, N_SIDE, N_TRUNCATED, tally_path

MAX_STEPS = 10_000_000
# Smallest cosine of a hit: rounding may leave a grazing ray parallel to the facet it meets
GRAZING = 1e-15
# Irrational strides of the lattice that places rays: they fill the tile evenly for any count
STRIDE_Y = 0.6180339887498949
STRIDE_PHI = 0.7548776662466927


@jit(inline="always")
def entry_point(ray, n_rays, launch, shifts):
    """Place [cells] where a ray enters the top plane.

    Points advance along x and fill y evenly, so that successive rays stay near each other.
    """
    x = launch[0] + launch[2] * ((ray + shifts[0]) / n_rays)
    y = launch[1] + launch[3] * ((ray * STRIDE_Y + shifts[1]) % 1.0)
    return x, y


@jit(inline="always")
def azimuth(ray, phi_i, uniform_phi, shifts):
    """Azimuth of the source for a ray: fixed, or spread evenly over the circle."""
    if uniform_phi:
        return TWO_PI * ((ray * STRIDE_PHI + shifts[2]) % 1.0)
    return phi_i


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


@jit
def trace_path(
    heights, maxima, levels, z_top, periodic, pitch_x, pitch_y,
    x, y, cos_phi, sin_phi, sin_theta_i, cos_theta_i, max_bounces, cos_beta, turn,
):  # fmt: skip
    """Follow one ray that enters the top plane at (x, y) [cells] until it leaves for good.

    Fills `cos_beta` (bounces) and `turn` (bounces + 1, 2). Returns the count to which the path
    belongs, the number of bounces and the exit direction.
    """
    # The beam travels against dir_i; its frame has e_s horizontal
    k_x = -sin_theta_i * cos_phi
    k_y = -sin_theta_i * sin_phi
    k_z = -cos_theta_i
    s_x = sin_phi
    s_y = -cos_phi
    s_z = 0.0

    i = min(int(x), heights.shape[0] - 1)
    j = min(int(y), heights.shape[1] - 1)
    facet = -1
    u = x - i
    v = y - j
    z = z_top
    leave_rate = 0.0
    bounces = 0
    while True:
        fate, i, j, facet, u, v, z = walk(
            heights, maxima, levels, z_top, periodic,
            i, j, facet, u, v, z, k_x / pitch_x, k_y / pitch_y, k_z, leave_rate, MAX_STEPS,
        )  # fmt: skip
        if fate != HIT or bounces == max_bounces:
            break
        step_x, step_y = facet_gradient(heights, i, j, facet, periodic)
        k_x, k_y, k_z, s_x, s_y, s_z, leave_rate, cosine, c2, s2 = bounce(
            k_x, k_y, k_z, s_x, s_y, s_z, step_x / pitch_x, step_y / pitch_y
        )
        cos_beta[bounces] = cosine
        turn[bounces, 0] = c2
        turn[bounces, 1] = s2
        bounces += 1

    c2, s2 = exit_turn(k_x, k_y, k_z, s_x, s_y, s_z, cos_phi, sin_phi)
    turn[bounces, 0] = c2
    turn[bounces, 1] = s2
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
    heights, maxima, levels, z_top, periodic, pitch_x, pitch_y, launch,
    sin_theta_i, cos_theta_i, phi_i, uniform_phi, n_rays, shifts, max_bounces,
    n, kappa, n_stokes, brdf, energy, counts,
):  # fmt: skip
    """Trace rays of one incident direction and add their Mueller matrices to the bins.

    launch          corner x, y and lengths of the rectangle of entry points [cells]
    shifts          random shifts (3,) in [0, 1) of the lattice of entry points and azimuths
    n, kappa        refractive index (wavelengths,)
    brdf            flux by bin (wavelengths, bounces, n_theta, n_dphi, stokes, stokes), added to
    energy          (wavelengths, 3), by what took it: ABSORBED, TRUNCATED, LEAKED, added to
    counts          rays by fate, path segments and self hits (6,), added to
    """
    cos_beta = np.empty(max_bounces)
    turn = np.empty((max_bounces + 1, 2))
    mueller = np.zeros((4, 4))
    cos_phi = math.cos(phi_i)
    sin_phi = math.sin(phi_i)
    for ray in range(n_rays):
        x, y = entry_point(ray, n_rays, launch, shifts)
        if uniform_phi:
            phi = azimuth(ray, phi_i, uniform_phi, shifts)
            cos_phi = math.cos(phi)
            sin_phi = math.sin(phi)
        count, bounces, k_x, k_y, k_z = trace_path(
            heights, maxima, levels, z_top, periodic, pitch_x, pitch_y,
            x, y, cos_phi, sin_phi, sin_theta_i, cos_theta_i, max_bounces, cos_beta, turn,
        )  # fmt: skip
        tally_path(
            count, cos_beta, turn, bounces, k_x, k_y, k_z, cos_phi, sin_phi,
            n, kappa, n_stokes, mueller, brdf, energy, counts,
        )  # fmt: skip
