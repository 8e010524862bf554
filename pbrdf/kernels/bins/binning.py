"""Detector bins: equal in zenith angle, equal in azimuth and centred on 0 and pi.

A cheap approximation of the angle names a bin, and a comparison with the exact edges of the
bin then corrects it; no inverse trigonometric function is called.
"""

import math

import numpy as np

from pbrdf.kernels import jit

HALF_PI = 0.5 * math.pi
PI = math.pi


def bin_edges(n_theta, n_dphi):
    """Cosines of the zenith edges, and unit vectors along the lower azimuth edges."""
    zenith = np.empty(n_theta + 1)
    for k in range(n_theta + 1):
        zenith[k] = math.cos(HALF_PI * k / n_theta)
    # Light exactly along the horizon or the zenith stays in the outermost bins
    zenith[0] = 2.0
    zenith[n_theta] = -1.0
    azimuth = np.empty((n_dphi, 2))
    for k in range(n_dphi):
        azimuth[k, 0] = math.cos(math.tau * (k - 0.5) / n_dphi)
        azimuth[k, 1] = math.sin(math.tau * (k - 0.5) / n_dphi)
    return zenith, azimuth


@jit(forceinline=True)
def rough_arccos(x):
    """Arccos of x in [0, 1] to 7e-5 (Abramowitz and Stegun, eq. 4.4.45)."""
    series = 1.5707288 + x * (-0.2121144 + x * (0.0742610 - 0.0187293 * x))
    return math.sqrt(max(1.0 - x, 0.0)) * series


@jit(forceinline=True)
def rough_azimuth(x, y):
    """Angle of (x, y) in [0, 2 pi) to 1e-3, after Abramowitz and Stegun, eq. 4.4.49."""
    a = abs(x)
    b = abs(y)
    large = max(a, b)
    if large == 0.0:
        return 0.0
    t = min(a, b) / large
    angle = t * (0.9998660 - t * t * (0.3302995 - t * t * (0.1801410 - 0.0851330 * t * t)))
    if b > a:
        angle = HALF_PI - angle
    if x < 0.0:
        angle = PI - angle
    return math.tau - angle if y < 0.0 else angle


@jit(forceinline=True)
def rough_place(x, y, z, cos_phi_i, sin_phi_i, n_theta, n_dphi):
    """Zenith angle and azimuth from the source of a unit direction, counted in bins."""
    # Turn the direction by -phi_i
    along = x * cos_phi_i + y * sin_phi_i
    across = y * cos_phi_i - x * sin_phi_i
    return (
        rough_arccos(z) * (n_theta / HALF_PI),
        rough_azimuth(along, across) * (n_dphi / math.tau) + 0.5,
    )


@jit(forceinline=True)
def exact_bin(theta, dphi, x, y, z, cos_phi_i, sin_phi_i, zenith, azimuth):
    """Bin (theta_s, dphi) of a unit direction above the surface, from its rough place."""
    i_theta = min(int(theta), zenith.shape[0] - 2)
    while z > zenith[i_theta]:
        i_theta -= 1
    while z <= zenith[i_theta + 1]:
        i_theta += 1

    n_dphi = azimuth.shape[0]
    along = x * cos_phi_i + y * sin_phi_i
    across = y * cos_phi_i - x * sin_phi_i
    i_dphi = int(dphi)
    if i_dphi >= n_dphi:
        i_dphi -= n_dphi
    # Clockwise of the lower edge, or not clockwise of the upper one
    while across * azimuth[i_dphi, 0] < along * azimuth[i_dphi, 1]:
        i_dphi = i_dphi - 1 if i_dphi > 0 else n_dphi - 1
    upper = i_dphi + 1 if i_dphi + 1 < n_dphi else 0
    for _ in range(n_dphi):
        # With two bins what lies along their edge is past both of them
        past = across * azimuth[upper, 0] >= along * azimuth[upper, 1]
        if not past or (along == 0.0 and across == 0.0):
            break
        i_dphi = upper
        upper = i_dphi + 1 if i_dphi + 1 < n_dphi else 0
    return i_theta, i_dphi


@jit(forceinline=True)
def bin_of_direction(x, y, z, cos_phi_i, sin_phi_i, zenith, azimuth):
    """Bin (theta_s, dphi) of a unit direction above the surface, by `bin_edges`."""
    n_theta, n_dphi = zenith.shape[0] - 1, azimuth.shape[0]
    theta, dphi = rough_place(x, y, z, cos_phi_i, sin_phi_i, n_theta, n_dphi)
    return exact_bin(theta, dphi, x, y, z, cos_phi_i, sin_phi_i, zenith, azimuth)
