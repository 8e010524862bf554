"""Mueller matrix of single scattering by a rough interface, from amplitudes and moments.

The scattered field of order n has the Jones matrix B_n; its matrix is the mean of B_n B_n^+
over the orders, built as a sum of Jones matrices with positive weights: it is realisable
whatever the numbers.
"""

from collections import namedtuple
from math import sqrt

import numpy as np

from pbrdf.kernels import jit
from pbrdf.kernels.optics.elementary import erf, exp
from pbrdf.kernels.wave.amplitudes import blend, turn_between
from pbrdf.kernels.wave.lanes import (
    LANES,
    PAIR,
    ROWS,
    fill_amplitudes,
    fill_node_changes,
    jones_of,
    rays_of,
    set_lane,
)

__all__ = [
    "CURVATURE",
    "ORDER_WEIGHTED",
    "RICE",
    "TANGENT",
    "Plan",
    "fill_scattering",
    "shadowing",
]

# Which amplitude an order has: first-order, tangent-plane, the weighted mean, or that with
# the mean and the scatter of the local curvature
RICE, TANGENT, ORDER_WEIGHTED, CURVATURE = range(4)

# kernel: one of the above; dimensions: 1 for a profile; shadowed: apply Smith's factor
Plan = namedtuple("Plan", "kernel dimensions shadowed")

# g = q^2 h^2, rms wave vector of the heights per axis over k, rms slope
Surface = namedtuple("Surface", "g spread slope")

SQRT_2, SQRT_PI = sqrt(2.0), sqrt(np.pi)
SQRT_3 = sqrt(3.0)
# Nodes and weights of a unit Gaussian: three points on a line, a hexagon in the plane; the
# rest of the weight is at zero, where nothing changes
LINE_WEIGHT, HEXAGON_WEIGHT = 1.0 / 6.0, 1.0 / 12.0
HEXAGON = ((2.0, 0.0), (1.0, SQRT_3), (-1.0, SQRT_3))


@jit(forceinline=True)
def power(z):
    """Squared modulus."""
    return z.real * z.real + z.imag * z.imag


@jit(forceinline=True)
def product(weight, a, b):
    """Return weight a b* with a real weight."""
    return complex(
        weight * (a.real * b.real + a.imag * b.imag),
        weight * (a.imag * b.real - a.real * b.imag),
    )


@jit(forceinline=True)
def added(sums, weight, jones):
    """Return sums of the products of Jones elements with those of one more matrix."""
    ss, sp, ps, pp = jones
    return (
        sums[0] + weight * power(ss),
        sums[1] + weight * power(sp),
        sums[2] + weight * power(ps),
        sums[3] + weight * power(pp),
        sums[4] + product(weight, ss, sp),
        sums[5] + product(weight, ps, pp),
        sums[6] + product(weight, ss, ps),
        sums[7] + product(weight, sp, pp),
        sums[8] + product(weight, ss, pp),
        sums[9] + product(weight, sp, ps),
    )


@jit(forceinline=True)
def combined(a, jones_a, b, jones_b):
    """Linear combination of two Jones matrices with real factors."""
    return (
        blend(a, jones_a[0], b, jones_b[0]),
        blend(a, jones_a[1], b, jones_b[1]),
        blend(a, jones_a[2], b, jones_b[2]),
        blend(a, jones_a[3], b, jones_b[3]),
    )


@jit(forceinline=True)
def nothing():
    """Begin sums with no matrix at all."""
    zero = complex(0.0, 0.0)
    return 0.0, 0.0, 0.0, 0.0, zero, zero, zero, zero, zero, zero


@jit(forceinline=True)
def no_jones():
    """Jones matrix that stops all light."""
    zero = complex(0.0, 0.0)
    return zero, zero, zero, zero


@jit(part=True)
def over_orders(sums, plain, per_order, mean, moments):
    """Add the mean square of plain + per_order/n + n mean over the orders.

    The moments of (1, n, 1/n) are a Gram matrix; its Cholesky factor turns the mean into
    three matrices.
    """
    rising, first, total, falling, steep = moments
    if total <= 0.0:
        return sums
    root = sqrt(total)
    b, c = first / root, falling / root
    spread_b = sqrt(max(rising - b * b, 0.0))
    coupling = (total - b * c) / spread_b if spread_b > 1e-7 * sqrt(rising) else 0.0
    spread_c = sqrt(max(steep - c * c - coupling * coupling, 0.0))
    whole = combined(1.0, combined(root, plain, b, mean), c, per_order)
    sums = added(sums, 1.0, whole)
    sums = added(sums, 1.0, combined(spread_b, mean, coupling, per_order))
    return added(sums, spread_c * spread_c, per_order)


@jit(part=True)
def with_curvature(plane, rice, plan, surface, moments, changes, lane):
    """Sum the order-weighted amplitude with the mean and scatter of the curvature.

    Order n is diffracted n times, by wave vectors xi_i that add up to K. With the change
    d(xi) of the kernel, the amplitude is b_KA + sum d(xi_i) less what the heights contract
    with themselves. For a Gaussian spectrum and quadratic d its mean is
    b_KA + d(K)/n + (n - 1 - g) <d> and its variance (n - 1) var d.
    """
    line = plan.dimensions == 1
    pairs, weight = (1, LINE_WEIGHT) if line else (3, HEXAGON_WEIGHT)
    mean = no_jones()
    for k in range(2 * pairs):
        mean = combined(1.0, mean, weight, jones_of(changes, 8 * k, lane))
    # Scatter about the mean; the node at zero has d = 0
    scatter = max(moments[1] - moments[2], 0.0)
    sums = added(nothing(), scatter * (1.0 - 2 * pairs * weight), mean)
    for k in range(2 * pairs):
        there = jones_of(changes, 8 * k, lane)
        sums = added(sums, scatter * weight, combined(1.0, there, -1.0, mean))
    way = combined(1.0, rice, -1.0, plane)
    plain = combined(1.0, plane, -(1.0 + surface.g), mean)
    return over_orders(sums, plain, way, mean, moments)


@jit(part=True)
def scattered_sums(plan, surface, moments, amplitudes, changes, lane):
    """Products of Jones elements of the scattered light, by the plan's amplitude."""
    plane, rice = jones_of(amplitudes, 0, lane), jones_of(amplitudes, 8, lane)
    if plan.kernel == RICE:
        return added(nothing(), moments[2], rice)
    if plan.kernel == TANGENT:
        return added(nothing(), moments[2], plane)
    if plan.kernel == CURVATURE:
        return with_curvature(plane, rice, plan, surface, moments, changes, lane)
    way = combined(1.0, rice, -1.0, plane)
    return over_orders(nothing(), plane, way, no_jones(), moments)


@jit(forceinline=True)
def overhang(cos_theta, sin_theta, slope):
    """Smith's Lambda of Gaussian slopes."""
    nu = min(cos_theta / (SQRT_2 * slope * sin_theta + 1e-300), 25.0)
    nu = max(nu, 1e-12)
    return max(0.5 * (exp(-nu * nu) / (nu * SQRT_PI) + erf(nu) - 1.0), 0.0)


@jit(forceinline=True)
def shadowing(ray_in, ray_out, slope):
    """Smith's factor; hidings fully dependent at one azimuth, independent at the opposite.

    Between them the weight of van Ginneken et al., Appl. Opt. 37, 130 (1998).
    """
    turn, side = turn_between(ray_in, ray_out)
    azimuth = np.pi - np.arctan2(abs(side), turn)
    weight = azimuth * (1.0 + 4.41 * np.pi) / (np.pi * (1.0 + 4.41 * azimuth))
    one = overhang(ray_in.cos, ray_in.sin, slope)
    other = overhang(ray_out.cos, ray_out.sin, slope)
    return 1.0 / (1.0 + max(one, other) + weight * min(one, other))


@jit(forceinline=True)
def coherence(share, dressing):
    """Return what is left of E_s E_p*, by the logarithm of what one way leaves."""
    size = exp(share * dressing.real)
    turn = share * dressing.imag
    return complex(size * np.cos(turn), size * np.sin(turn))


@jit(forceinline=True)
def write_matrix(sums, factor, into, away, out):
    """Write the Mueller matrix of the sums.

    On the ways in and out E_s E_p* is multiplied by `into` and `away`, at most 1.
    """
    ss, sp, ps, pp, ss_sp, ps_pp, ss_ps, sp_pp, ss_pp, sp_ps = sums
    ss_sp, ps_pp = ss_sp * into, ps_pp * into
    ss_ps, sp_pp = ss_ps * away, sp_pp * away
    ss_pp, sp_ps = ss_pp * into * away, sp_ps * away * into.conjugate()
    half = 0.5 * factor
    out[0] = half * (ss + sp + ps + pp)
    out[1] = half * (ss - sp + ps - pp)
    out[2] = factor * (ss_sp + ps_pp).real
    out[3] = -factor * (ss_sp + ps_pp).imag
    out[4] = half * (ss + sp - ps - pp)
    out[5] = half * (ss - sp - ps + pp)
    out[6] = factor * (ss_sp - ps_pp).real
    out[7] = -factor * (ss_sp - ps_pp).imag
    out[8] = factor * (ss_ps + sp_pp).real
    out[9] = factor * (ss_ps - sp_pp).real
    out[10] = factor * (ss_pp + sp_ps).real
    out[11] = factor * (sp_ps - ss_pp).imag
    out[12] = factor * (ss_ps + sp_pp).imag
    out[13] = factor * (ss_ps - sp_pp).imag
    out[14] = factor * (ss_pp + sp_ps).imag
    out[15] = factor * (ss_pp - sp_ps).real


@jit(part=True)
def fill_matrix(lanes, lane, statistics, moments, dressing, plan, amplitudes, changes, out):
    """Fill 16 elements from one lane."""
    ray_in, ray_out = rays_of(lanes, lane)
    rise = ray_in.cos + ray_out.cos
    height = statistics[0] * rise
    surface = Surface(height * height, statistics[1], statistics[2])
    sums = scattered_sums(plan, surface, moments, amplitudes, changes, lane)
    factor = 1.0 / (np.pi * np.pi * ray_in.cos * ray_out.cos * rise * rise)
    if plan.dimensions == 1:
        factor = 2.0 / (np.pi * ray_in.cos * rise * rise)
    if plan.shadowed:
        factor *= shadowing(ray_in, ray_out, surface.slope)
    # Of an order n of scattering one step in n is the mean field's; as an amplitude
    share = sqrt(moments[3] / moments[2]) if moments[2] > 0.0 else 0.0
    into, away = coherence(share, dressing[0]), coherence(share, dressing[1])
    write_matrix(sums, factor, into, away, out)


@jit
def fill_scattering(angles, indices, statistics, moments, dressing, plan, out):
    """Fill the rows of `out` with Mueller matrices, 16 elements each.

    Parameters
    ----------
    angles : (3, N)
        theta_i, theta_s, dphi of the conventions page.
    indices : (2, N)
        n and kappa; n = inf is a perfect conductor.
    statistics : (3, N)
        k h; rms wave vector of the heights per axis over k; rms slope.
    moments : (5, N)
        Of n^2, n, 1, 1/n, 1/n^2.
    dressing : (2, N)
        Logarithm of what the mean field leaves of E_s E_p* on its way in and out, complex.
    out : (N, 16)
        1/sr; of a profile, power per radian over incident power.
    """
    lanes, amplitudes = np.zeros(ROWS * LANES), np.empty(PAIR * LANES)
    nodes = 1 if plan.dimensions == 1 else 3
    changes = np.empty(nodes * PAIR * LANES)
    for start in range(0, out.shape[0], LANES):
        count = min(LANES, out.shape[0] - start)
        for lane in range(count):
            k = start + lane
            set_lane(
                lanes, lane, angles[0, k], angles[1, k], angles[2, k], statistics[1, k],
                indices[0, k], indices[1, k],
            )  # fmt: skip
        fill_amplitudes(lanes, amplitudes)
        if plan.kernel == CURVATURE:
            for node in range(nodes):
                u, v = HEXAGON[node] if nodes == 3 else (SQRT_3, 0.0)
                rows = changes[node * PAIR * LANES : (node + 1) * PAIR * LANES]
                fill_node_changes(lanes, u, v, nodes == 3, rows)
        for lane in range(count):
            k = start + lane
            given = (statistics[0, k], statistics[1, k], statistics[2, k])
            five = (
                moments[0, k], moments[1, k], moments[2, k], moments[3, k], moments[4, k],
            )  # fmt: skip
            ways = dressing[0, k], dressing[1, k]
            fill_matrix(lanes, lane, given, five, ways, plan, amplitudes, changes, out[k])
