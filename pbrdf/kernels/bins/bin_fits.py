"""Fresnel elements within a detector bin, as polynomials in the local incidence.

All light that one bounce sends from a source into a bin has a local incidence within a
narrow range, which the geometry gives. Over it A, B, C and D follow the polynomials
through their values at the Chebyshev points of the range; `choose_orders` finds how many
are needed.
"""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.bins.binning import HALF_PI
from pbrdf.kernels.optics.fresnel import reflection_elements
from pbrdf.kernels.optics.fresnel_table import TOLERANCE

MIN_ORDER, MAX_ORDER = 3, 8


@jit(part=True)
def angle_range(theta_i, low, high, dphi_low, dphi_high):
    """Smallest and largest cos(2 beta) from theta_i to a bin with dphi within [0, pi]."""
    least = 1.0
    most = -1.0
    for dphi in (dphi_low, dphi_high):
        # cos(2 beta) = up cos(theta_s) + along sin(theta_s) has one extreme in theta_s
        up = math.cos(theta_i)
        along = math.sin(theta_i) * math.cos(dphi)
        turn = math.atan2(along, up)
        for theta in (low, high, min(max(turn, low), high)):
            value = up * math.cos(theta) + along * math.sin(theta)
            least = min(least, value)
            most = max(most, value)
    return least, most


@jit
def cosine_ranges(theta_i, spread, ranges):
    """Middle and half range of cos(beta) by bin (n_theta, n_dphi, 2) for one bounce.

    The source covers the zenith angle theta_i and what is within `spread` of it [rad].
    """
    n_theta, n_dphi = ranges.shape[:2]
    for i in range(n_theta):
        low = HALF_PI * i / n_theta
        high = HALF_PI * (i + 1) / n_theta
        for j in range(n_dphi):
            # Centred on 0 and pi, and the same on both sides of the plane of incidence
            side = min(j, n_dphi - j)
            dphi_low = max(side - 0.5, 0.0) * math.tau / n_dphi
            dphi_high = min((side + 0.5) * math.tau / n_dphi, math.pi)
            least, most = angle_range(theta_i, low, high, dphi_low, dphi_high)
            wide = min(0.5 * math.acos(max(least, -1.0)) + 0.5 * spread, HALF_PI)
            narrow = max(0.5 * math.acos(min(most, 1.0)) - 0.5 * spread, 0.0)
            ranges[i, j, 0] = 0.5 * (math.cos(narrow) + math.cos(wide))
            ranges[i, j, 1] = max(0.5 * (math.cos(narrow) - math.cos(wide)), 1e-9)


@jit(part=True)
def fit_elements(mid, half, order, n, kappa, points, powers, factors):
    """Factors of the powers of (x - mid) / half in A, B, C, D of one bin."""
    for k in range(order):
        for e in range(4):
            factors[e, k] = 0.0
    for p in range(order):
        x = min(max(mid + half * points[order, p], 0.0), 1.0)
        a, b, c, d = reflection_elements(x, n, kappa)
        for k in range(order):
            share = powers[order, k, p]
            factors[0, k] += share * a
            factors[1, k] += share * b
            factors[2, k] += share * c
            factors[3, k] += share * d


@jit(part=True)
def fit_error(mid, half, order, n, kappa, factors):
    """Largest error of a fit as a fraction of A, where the error of a fit is largest.

    It swings evenly between its points, the most at the end next to grazing.
    """
    worst = 0.0
    for extreme in (order, order - 1, 0):
        t = math.cos(math.pi * extreme / order)
        x = min(max(mid + half * t, 0.0), 1.0)
        a, b, c, d = reflection_elements(x, n, kappa)
        fit_a = fit_b = fit_c = fit_d = 0.0
        for k in range(order - 1, -1, -1):
            fit_a = fit_a * t + factors[0, k]
            fit_b = fit_b * t + factors[1, k]
            fit_c = fit_c * t + factors[2, k]
            fit_d = fit_d * t + factors[3, k]
        error = max(
            max(abs(fit_a - a), abs(fit_b - b)), max(abs(fit_c - c), abs(fit_d - d))
        )
        if error > TOLERANCE * a:
            worst = max(worst, error / a if a > 0.0 else math.inf)
    return worst


@jit
def choose_orders(ranges, table, points, powers, factors, orders):
    """Least number of powers that gives every wavelength and material to TOLERANCE."""
    n_theta, n_dphi = ranges.shape[:2]
    for i in range(n_theta):
        for j in range(n_dphi):
            if j > n_dphi - j:
                orders[i, j] = orders[i, n_dphi - j]
                continue
            order = MIN_ORDER
            for w in range(table.n.shape[0]):
                for m in range(table.n.shape[1]):
                    while order <= MAX_ORDER:
                        mid, half = ranges[i, j, 0], ranges[i, j, 1]
                        n, kappa = table.n[w, m], table.kappa[w, m]
                        fit_elements(mid, half, order, n, kappa, points, powers, factors)
                        if fit_error(mid, half, order, n, kappa, factors) == 0.0:
                            break
                        order += 1
            orders[i, j] = order if order <= MAX_ORDER else 0
