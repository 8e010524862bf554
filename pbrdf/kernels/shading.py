"""Mueller matrix of a recorded path, and its place in the tally.

A path is recorded as the cosine of the local incidence at each bounce and the turns of the
frame before each bounce and at the exit. Materials and wavelengths share one record. Records of
many rays lie in one array; `ray` is the column of the path at hand. (Elements are read one by one:
a slice would cost more than the arithmetic on it.)
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
def reflect_once(a, b, c, d, c_in, s_in, c_out, s_out, n_stokes, mueller):
    """Mueller matrix R(out) F(beta) R(in) of a path with one bounce, paper eq. (16)."""
    mueller[0, 0] = a
    if n_stokes == 1:
        return
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
def reflect_often(ray, bounces, cos_beta, turn, n, kappa, n_stokes, mueller):
    """Mueller matrix of a path with any number of bounces, all its columns side by side."""
    for row in range(4):
        for column in range(n_stokes):
            mueller[row, column] = 1.0 if row == column else 0.0
    for bounce in range(bounces + 1):
        c2 = turn[bounce, ray, 0]
        s2 = turn[bounce, ray, 1]
        for column in range(n_stokes):
            # Into the frame of the facet, or after the last bounce of the exit direction
            q = mueller[1, column]
            u = mueller[2, column]
            mueller[1, column] = c2 * q + s2 * u
            mueller[2, column] = c2 * u - s2 * q
        if bounce == bounces:
            break
        a, b, c, d = reflection_elements(cos_beta[bounce, ray], n, kappa)
        for column in range(n_stokes):
            # Fresnel reflection
            i = mueller[0, column]
            q = mueller[1, column]
            u = mueller[2, column]
            v = mueller[3, column]
            mueller[0, column] = a * i + b * q
            mueller[1, column] = b * i + a * q
            mueller[2, column] = c * u - d * v
            mueller[3, column] = d * u + c * v


@jit(inline="always")
def path_mueller(ray, bounces, cos_beta, turn, n, kappa, n_stokes, mueller):
    """Mueller matrix of a path, by the closed form where it has one bounce."""
    if bounces == 1:
        a, b, c, d = reflection_elements(cos_beta[0, ray], n, kappa)
        reflect_once(
            a, b, c, d, turn[0, ray, 0], turn[0, ray, 1], turn[1, ray, 0], turn[1, ray, 1],
            n_stokes, mueller,
        )  # fmt: skip
    else:
        reflect_often(ray, bounces, cos_beta, turn, n, kappa, n_stokes, mueller)


@jit(inline="always")
def tally_path(
    end, rays, ray, bounces, cos_beta, turn, k_x, k_y, k_z, cos_phi_i, sin_phi_i,
    n, kappa, n_stokes, zenith, azimuth, mueller, brdf, energy, counts,
):  # fmt: skip
    """Count a path that `rays` rays share and add its light to its bin, or to what was lost.

    `end` is one of the N_ constants, `zenith` and `azimuth` are `bin_edges`; brdf, energy and
    counts are added to.
    """
    counts[end] += rays
    counts[N_SEGMENTS] += rays * (bounces + 1)
    # Rays that left a finite map sideways belong to neither part of the fraction
    if end == N_SIDE:
        return
    if end != N_ESCAPED:
        lost = TRUNCATED if end == N_TRUNCATED else LEAKED
        for w in range(n.shape[0]):
            path_mueller(ray, bounces, cos_beta, turn, n[w], kappa[w], 1, mueller)
            energy[w, ABSORBED] += rays * (1.0 - mueller[0, 0])
            energy[w, lost] += rays * mueller[0, 0]
        return
    i_theta, i_dphi = bin_of_direction(k_x, k_y, k_z, cos_phi_i, sin_phi_i, zenith, azimuth)
    order = min(bounces, brdf.shape[1]) - 1
    for w in range(n.shape[0]):
        path_mueller(ray, bounces, cos_beta, turn, n[w], kappa[w], n_stokes, mueller)
        energy[w, ABSORBED] += rays * (1.0 - mueller[0, 0])
        if n_stokes == 4:
            for row in range(4):
                for column in range(4):
                    brdf[w, order, i_theta, i_dphi, row, column] += rays * mueller[row, column]
        else:
            for row in range(n_stokes):
                for column in range(n_stokes):
                    brdf[w, order, i_theta, i_dphi, row, column] += rays * mueller[row, column]
