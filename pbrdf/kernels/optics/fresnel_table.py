"""Fresnel elements of many materials and wavelengths, tabulated in the local incidence.

A table holds A, B, C, D at even steps of cos(beta); cubic Lagrange interpolation between
four of them costs a tenth of the formulas. Where the interpolation has not been shown to be
good (near grazing, for an index like 1e6) `floor` sends the reader back to the formulas.
"""

from collections import namedtuple

import numpy as np

from pbrdf.kernels import jit
from pbrdf.kernels.optics.fresnel import reflection_elements

STEPS = 1024
# Largest error of an element, as a fraction of A
TOLERANCE = 1e-8

# values (wavelengths, materials, STEPS + 1, 4) at cos(beta) = k / STEPS; floor
# (wavelengths, materials): the smallest cos(beta) at which they serve; n and kappa
# (wavelengths, materials)
FresnelTable = namedtuple("FresnelTable", "values floor n kappa")


@jit(forceinline=True)
def interpolate(values, w, m, cos_beta):
    """Elements A, B, C, D from the four nearest entries of a table."""
    place = cos_beta * STEPS
    k = min(max(int(place) - 1, 0), STEPS - 3)
    x = place - k
    p = x * (x - 3.0)
    q = (x - 1.0) * (x - 2.0)
    w0 = q * (3.0 - x) / 6.0
    w1 = 0.5 * p * (x - 2.0)
    w2 = -0.5 * p * (x - 1.0)
    w3 = x * q / 6.0
    a = w0 * values[w, m, k, 0] + w1 * values[w, m, k + 1, 0]
    b = w0 * values[w, m, k, 1] + w1 * values[w, m, k + 1, 1]
    c = w0 * values[w, m, k, 2] + w1 * values[w, m, k + 1, 2]
    d = w0 * values[w, m, k, 3] + w1 * values[w, m, k + 1, 3]
    a += w2 * values[w, m, k + 2, 0] + w3 * values[w, m, k + 3, 0]
    b += w2 * values[w, m, k + 2, 1] + w3 * values[w, m, k + 3, 1]
    c += w2 * values[w, m, k + 2, 2] + w3 * values[w, m, k + 3, 2]
    d += w2 * values[w, m, k + 2, 3] + w3 * values[w, m, k + 3, 3]
    return a, b, c, d


@jit(forceinline=True)
def table_elements(table, w, m, cos_beta):
    """Elements A, B, C, D of `reflection_elements`, to TOLERANCE times A."""
    if cos_beta >= table.floor[w, m]:
        return interpolate(table.values, w, m, cos_beta)
    return reflection_elements(cos_beta, table.n[w, m], table.kappa[w, m])


@jit
def build_table(n, kappa):
    """Tabulate the materials and find from where on the table serves."""
    values = np.empty((n.shape[0], n.shape[1], STEPS + 1, 4))
    floor = np.empty(n.shape)
    for w in range(n.shape[0]):
        for m in range(n.shape[1]):
            for k in range(STEPS + 1):
                a, b, c, d = reflection_elements(k / STEPS, n[w, m], kappa[w, m])
                values[w, m, k, 0] = a
                values[w, m, k, 1] = b
                values[w, m, k, 2] = c
                values[w, m, k, 3] = d
            # Down from normal incidence; the middle of a step is where the error is largest
            k = STEPS
            while k > 0:
                cos_beta = (k - 0.5) / STEPS
                a, b, c, d = reflection_elements(cos_beta, n[w, m], kappa[w, m])
                a_, b_, c_, d_ = interpolate(values, w, m, cos_beta)
                error = max(max(abs(a - a_), abs(b - b_)), max(abs(c - c_), abs(d - d_)))
                if error > TOLERANCE * a:
                    break
                k -= 1
            floor[w, m] = k / STEPS
    return FresnelTable(values, floor, n, kappa)
