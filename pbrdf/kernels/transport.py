"""Mueller transport of rays over an opaque height field, from the source to the bins.

The path of a ray depends on the facets alone. It is followed first and kept as one record a
bounce (local incidence and the turn of the frame); each material or wavelength then multiplies
its own Fresnel matrices along the same record.
"""

import math

import numpy as np

from pbrdf.kernels import jit
from pbrdf.kernels.binning import TWO_PI, bin_of_direction
from pbrdf.kernels.frames import PARALLEL, turn_frame
from pbrdf.kernels.fresnel import reflection_elements
from pbrdf.kernels.heightfield import ESCAPED, HIT, SIDE, facet_gradient, walk

# What became of the rays of a batch
N_ESCAPED, N_TRUNCATED, N_LEAKED, N_SIDE, N_SEGMENTS = 0, 1, 2, 3, 4
# Energies of unpolarised light
ABSORBED, TRUNCATED, LEAKED = 0, 1, 2

MAX_STEPS = 10_000_000
# Smallest cosine of a hit: rounding may leave a grazing ray parallel to the facet it meets
GRAZING = 1e-15
# Irrational strides of the lattice that places rays: they fill the tile evenly for any count
STRIDE_Y = 0.6180339887498949
STRIDE_PHI = 0.7548776662466927


@jit(inline="always")
def reflect(k_x, k_y, k_z, slope_x, slope_y):
    """Mirror direction at a facet; returns it, the facet normal and the cosine of incidence."""
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


@jit
def reflect_once(cos_beta, turn, n, kappa, n_stokes, mueller):
    """Mueller matrix R(out) F(beta) R(in) of a path with one bounce, paper eq. (16)."""
    a, b, c, d = reflection_elements(cos_beta[0], n, kappa)
    mueller[0, 0] = a
    if n_stokes == 1:
        return
    c_in, s_in = turn[0, 0], turn[0, 1]
    c_out, s_out = turn[1, 0], turn[1, 1]
    mueller[0, 1] = b * c_in
    mueller[0, 2] = b * s_in
    mueller[1, 0] = c_out * b
    mueller[1, 1] = c_out * a * c_in - s_out * c * s_in
    mueller[1, 2] = c_out * a * s_in + s_out * c * c_in
    mueller[2, 0] = -s_out * b
    mueller[2, 1] = -s_out * a * c_in - c_out * c * s_in
    mueller[2, 2] = -s_out * a * s_in + c_out * c * c_in
    if n_stokes == 4:
        mueller[0, 3] = 0.0
        mueller[1, 3] = -s_out * d
        mueller[2, 3] = -c_out * d
        mueller[3, 0] = 0.0
        mueller[3, 1] = -d * s_in
        mueller[3, 2] = d * c_in
        mueller[3, 3] = c


@jit(inline="always")
def turn_stokes(q, u, turn):
    """Q and U after a turn of the frame whose double angle has cosine and sine `turn`."""
    return turn[0] * q + turn[1] * u, turn[0] * u - turn[1] * q


@jit
def reflect_often(cos_beta, turn, n_bounces, n, kappa, n_stokes, mueller):
    """Mueller matrix of a path with any number of bounces, one column a Stokes element in."""
    for row in range(4):
        for column in range(n_stokes):
            mueller[row, column] = 1.0 if row == column else 0.0
    for bounce in range(n_bounces):
        a, b, c, d = reflection_elements(cos_beta[bounce], n, kappa)
        for column in range(n_stokes):
            i = mueller[0, column]
            v = mueller[3, column]
            # Into the frame of the facet
            q, u = turn_stokes(mueller[1, column], mueller[2, column], turn[bounce])
            # Fresnel reflection
            mueller[0, column] = a * i + b * q
            mueller[1, column] = b * i + a * q
            mueller[2, column] = c * u - d * v
            mueller[3, column] = d * u + c * v
    # Into the meridian frame of the exit direction
    for column in range(n_stokes):
        q, u = turn_stokes(mueller[1, column], mueller[2, column], turn[n_bounces])
        mueller[1, column] = q
        mueller[2, column] = u


@jit
def trace_path(
    heights, maxima, levels, z_top, periodic, pitch_x, pitch_y,
    x, y, phi_i, sin_theta_i, cos_theta_i, max_bounces, cos_beta, turn,
):  # fmt: skip
    """Follow one ray that enters the top plane at (x, y) [cells] until it leaves for good.

    Fills `cos_beta` (bounces) and `turn` (bounces + 1, 2). Returns
    (fate, bounces, exit direction), with fate ESCAPED, HIT (truncated), SIDE or LOST.
    """
    cos_phi = math.cos(phi_i)
    sin_phi = math.sin(phi_i)
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

        # Reflect at the facet
        step_x, step_y = facet_gradient(heights, i, j, facet, periodic)
        slope_x = step_x / pitch_x
        slope_y = step_y / pitch_y
        r_x, r_y, r_z, n_x, n_y, n_z, cosine = reflect(k_x, k_y, k_z, slope_x, slope_y)

        # Turn the frame to the plane of incidence: its s axis is k x n, the same after it
        w_x = k_y * n_z - k_z * n_y
        w_y = k_z * n_x - k_x * n_z
        w_z = k_x * n_y - k_y * n_x
        c2, s2 = turn_frame(k_x, k_y, k_z, s_x, s_y, s_z, w_x, w_y, w_z)
        cos_beta[bounces] = cosine
        turn[bounces, 0] = c2
        turn[bounces, 1] = s2
        square = w_x * w_x + w_y * w_y + w_z * w_z
        if square > PARALLEL:
            scale = 1.0 / math.sqrt(square)
            s_x = w_x * scale
            s_y = w_y * scale
            s_z = w_z * scale

        k_x, k_y, k_z = r_x, r_y, r_z
        leave_rate = max(k_z - slope_x * k_x - slope_y * k_y, GRAZING)
        bounces += 1

    if fate == ESCAPED:
        # Turn the frame to the meridian plane of the exit direction: e_s = z x k
        m_x = -k_y
        m_y = k_x
        if k_x * k_x + k_y * k_y < PARALLEL:
            m_x = -sin_phi
            m_y = cos_phi
        c2, s2 = turn_frame(k_x, k_y, k_z, s_x, s_y, s_z, m_x, m_y, 0.0)
        turn[bounces, 0] = c2
        turn[bounces, 1] = s2
    return fate, bounces, k_x, k_y, k_z


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
    counts          rays by fate and number of path segments (5,), added to
    """
    n_orders = brdf.shape[1]
    n_theta = brdf.shape[2]
    n_dphi = brdf.shape[3]
    cos_beta = np.empty(max_bounces)
    turn = np.empty((max_bounces + 1, 2))
    mueller = np.zeros((4, 4))
    phi = phi_i
    for ray in range(n_rays):
        # Entry points advance along x and fill y evenly, so that neighbours stay in cache
        x = launch[0] + launch[2] * ((ray + shifts[0]) / n_rays)
        y = launch[1] + launch[3] * ((ray * STRIDE_Y + shifts[1]) % 1.0)
        if uniform_phi:
            phi = TWO_PI * ((ray * STRIDE_PHI + shifts[2]) % 1.0)
        fate, bounces, k_x, k_y, k_z = trace_path(
            heights, maxima, levels, z_top, periodic, pitch_x, pitch_y,
            x, y, phi, sin_theta_i, cos_theta_i, max_bounces, cos_beta, turn,
        )  # fmt: skip
        counts[N_SEGMENTS] += bounces + 1
        if fate == SIDE:
            counts[N_SIDE] += 1
            continue

        lost = -1
        if fate == HIT:
            lost = TRUNCATED
            counts[N_TRUNCATED] += 1
        elif fate != ESCAPED or bounces == 0:
            lost = LEAKED
            counts[N_LEAKED] += 1
        else:
            counts[N_ESCAPED] += 1
        if lost >= 0:
            # The last turn of the frame does not matter to the energy
            turn[bounces, 0] = 1.0
            turn[bounces, 1] = 0.0

        order = min(bounces, n_orders) - 1
        i_theta, i_dphi = 0, 0
        if lost < 0:
            cos_phi = math.cos(phi)
            sin_phi = math.sin(phi)
            i_theta, i_dphi = bin_of_direction(
                k_x, k_y, k_z, cos_phi, sin_phi, n_theta, n_dphi
            )
        for w in range(n.shape[0]):
            if bounces == 1:
                reflect_once(cos_beta, turn, n[w], kappa[w], n_stokes, mueller)
            else:
                reflect_often(cos_beta, turn, bounces, n[w], kappa[w], n_stokes, mueller)
            energy[w, ABSORBED] += 1.0 - mueller[0, 0]
            if lost >= 0:
                energy[w, lost] += mueller[0, 0]
                continue
            place = brdf[w, order, i_theta, i_dphi]
            for row in range(n_stokes):
                for column in range(n_stokes):
                    place[row, column] += mueller[row, column]
