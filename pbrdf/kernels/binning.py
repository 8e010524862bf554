"""Detector bins: equal in zenith angle, equal in azimuth and centred on 0 and pi."""

import math

from pbrdf.kernels import jit

HALF_PI = 0.5 * math.pi
TWO_PI = 2.0 * math.pi


@jit(inline="always")
def bin_of_direction(x, y, z, cos_phi_i, sin_phi_i, n_theta, n_dphi):
    """Bin (theta_s, dphi) of a unit direction above the surface."""
    # acos of z loses half its digits near the zenith; atan2 does not
    theta = math.atan2(math.sqrt(x * x + y * y), z)
    i_theta = min(int(theta * (n_theta / HALF_PI)), n_theta - 1)
    # Azimuth from the source: turn the direction by -phi_i
    along = x * cos_phi_i + y * sin_phi_i
    across = y * cos_phi_i - x * sin_phi_i
    turn = math.atan2(across, along) * (n_dphi / TWO_PI) + 0.5
    i_dphi = int(math.floor(turn))
    if i_dphi < 0:
        i_dphi += n_dphi
    return i_theta, min(i_dphi, n_dphi - 1)
