"""Mueller matrix of a recorded path, and its place in the tally.

A path is recorded as the cosine of the local incidence at each bounce and the turns of the
frame before each bounce and at the exit. Materials and wavelengths share one record.
"""

from pbrdf.kernels import jit
from pbrdf.kernels.binning import bin_of_direction
from pbrdf.kernels.fresnel import reflection_elements

# What became of the rays of a sample, the path segments they took, and the hits of a facet
# just left (impossible but for rounding inside the intersector)
N_ESCAPED, N_TRUNCATED, N_LEAKED, N_SIDE, N_SEGMENTS, N_SELF, N_COUNTS = 0, 1, 2, 3, 4, 5, 6
# Energies of unpolarised light
ABSORBED, TRUNCATED, LEAKED = 0, 1, 2


@jit(inline="always")
def turn_stokes(q, u, turn):
    """Q and U after a turn of the frame whose double angle has cosine and sine `turn`."""
    return turn[0] * q + turn[1] * u, turn[0] * u - turn[1] * q


@jit(inline="always")
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


@jit(inline="always")
def tally_path(
    fate_count, cos_beta, turn, bounces, k_x, k_y, k_z, cos_phi_i, sin_phi_i,
    n, kappa, n_stokes, zenith, azimuth, mueller, brdf, energy, counts,
):  # fmt: skip
    """Count one path and add its light to its bin, or to what was lost.

    `fate_count` is one of the N_ constants, `zenith` and `azimuth` are `bin_edges`; brdf,
    energy and counts are added to.
    """
    counts[fate_count] += 1
    counts[N_SEGMENTS] += bounces + 1
    # Rays that left a finite map sideways belong to neither part of the fraction
    if fate_count == N_SIDE:
        return
    escaped = fate_count == N_ESCAPED
    i_theta, i_dphi = 0, 0
    if escaped:
        i_theta, i_dphi = bin_of_direction(
            k_x, k_y, k_z, cos_phi_i, sin_phi_i, zenith, azimuth
        )
    order = min(bounces, brdf.shape[1]) - 1
    for w in range(n.shape[0]):
        if bounces == 1:
            reflect_once(cos_beta, turn, n[w], kappa[w], n_stokes, mueller)
        else:
            reflect_often(cos_beta, turn, bounces, n[w], kappa[w], n_stokes, mueller)
        energy[w, ABSORBED] += 1.0 - mueller[0, 0]
        if not escaped:
            energy[w, TRUNCATED if fate_count == N_TRUNCATED else LEAKED] += mueller[0, 0]
            continue
        place = brdf[w, order, i_theta, i_dphi]
        if n_stokes == 4:
            for row in range(4):
                for column in range(4):
                    place[row, column] += mueller[row, column]
        else:
            for row in range(n_stokes):
                for column in range(n_stokes):
                    place[row, column] += mueller[row, column]
