"""Two lines of nodes, from a facet towards the source and away from it: their joint law.

What hides a facet stands along two lines. The heights of a Gaussian mesh at nodes near
these are jointly normal, and so are they less what the corners of the facet let expect
(kriging), whose covariance is known. Looks along such lines need no surface: the heights
are drawn by themselves, with Cholesky's factor of their covariance (Ripley, Stochastic
Simulation, 1987, section 4.1).
"""

from collections import namedtuple
from math import cos, floor, sin, sqrt, tau

from pbrdf.kernels import jit
from pbrdf.kernels.bins.binning import HALF_PI
from pbrdf.kernels.microfacet.facet import directions, mirror_facet
from pbrdf.kernels.sights.light import RISE_DPHI, RISE_THETA, overhang
from pbrdf.kernels.sights.spread import tilted, tilted_density
from pbrdf.kernels.sights.walk import LEAST_GAIN

# By path (columns x azimuths of each x 2 facets of a cell) and node: offset from the
# facet's first node (2,), weights of the corners' heights (3,), and the lift that a ray
# needs to clear it, `bent`; by number drawn and node: `factor`, the heights in lifts; first
# of the rows that a node may hide. By column and azimuth, step of zenith and number:
# `rows` (rows,). The first `sources` of the nodes lie towards the source.
Profiles = namedtuple("Profiles", "nodes weights bent factor first rows sources columns")
# A ray needs gain * (height) + by_x * slope_x + by_y * slope_y - way * rise
GAIN, BY_X, BY_Y, WAY, N_BENT = 0, 1, 2, 3, 4
SLOPE_X, SLOPE_Y, RISE_I, RISE_S, LAMBDAS, WEIGHT, N_ROW = 0, 1, 2, 3, 4, 5, 6
# What they are made of: see `pbrdf.simulation.singles.profiles`
Lines = namedtuple(
    "Lines", "ways_i ways_s length_x length_y height_rms theta_i phi left change"
)
# Standard deviations of height above the facet beyond which nothing hides it here
CLEAR = 5.0
# Least variance of a node by itself, in parts of that of height: lines may meet again
LEAST_VARIANCE = 1e-10


@jit(forceinline=True)
def corner_heights_by_slopes(ensemble, k):
    """Heights of a facet's first corner by a unit of slope, and steps to the others."""
    low = k == 0
    pitch_x, pitch_y = ensemble.pitch_x, ensemble.pitch_y
    # The mean of the corners is the regression's
    first_x = ensemble.regression[k, 0] - (2.0 if low else 1.0) * pitch_x / 3.0
    first_y = ensemble.regression[k, 1] - (1.0 if low else 2.0) * pitch_y / 3.0
    return first_x, first_y, pitch_x if low else 0.0, 0.0 if low else pitch_y


@jit(forceinline=True)
def correlation_at(along_x, along_y, i, j):
    """Autocorrelation of heights (i, j) nodes apart, round the period."""
    return along_x[1 + i % (along_x.size - 2)] * along_y[1 + j % (along_y.size - 2)]


@jit(part=True)
def place_nodes(ensemble, lines, along_x, along_y, k, dphi, sources, nodes, weights, bent):
    """Fill in the nodes of one path and what they depend on, but for their own heights."""
    u, v = (2.0 / 3.0, 1.0 / 3.0) if k == 0 else (1.0 / 3.0, 2.0 / 3.0)
    px, py = ensemble.pitch_x, ensemble.pitch_y
    first_x, first_y, step_x, step_y = corner_heights_by_slopes(ensemble, k)
    start_x, start_y = first_x + u * px, first_y + v * py
    inverse = ensemble.inverse
    for a in range(nodes.shape[0]):
        azimuth = lines.phi if a < sources else lines.phi + dphi
        x, y = cos(azimuth), sin(azimuth)
        way = lines.ways_i[a] if a < sources else lines.ways_s[a - sources]
        # Ways are in correlation lengths of the direction
        way /= sqrt((x / lines.length_x) ** 2 + (y / lines.length_y) ** 2)
        nodes[a, 0] = floor(u + way * x / px + 0.5)
        nodes[a, 1] = floor(v + way * y / py + 0.5)
        i, j = nodes[a, 0], nodes[a, 1]
        near = correlation_at(along_x, along_y, i, j)
        middle = (
            correlation_at(along_x, along_y, i - 1, j)
            if k == 0
            else correlation_at(along_x, along_y, i, j - 1)
        )
        last = correlation_at(along_x, along_y, i - 1, j - 1)
        for c in range(3):
            weights[a, c] = inverse[k, c, 0] * near + inverse[k, c, 1] * middle
            weights[a, c] += inverse[k, c, 2] * last
        w0, w1, w2 = weights[a, 0], weights[a, 1], weights[a, 2]
        by_x = w0 * first_x + w1 * (first_x + step_x) + w2 * (first_x + px)
        by_y = w0 * first_y + w1 * (first_y + step_y) + w2 * (first_y + py)
        gain = 1.0 / max(1.0 - (w0 + w1 + w2), LEAST_GAIN)
        bent[a, GAIN] = gain
        bent[a, BY_X], bent[a, BY_Y] = gain * (by_x - start_x), gain * (by_y - start_y)
        bent[a, WAY] = gain * ((i - u) * px * x + (j - v) * py * y)


@jit(part=True)
def factorise(ensemble, lines, along_x, along_y, k, nodes, weights, bent, factor):
    """Cholesky's factor of what the corners leave open of the nodes, in lifts."""
    count = nodes.shape[0]
    for a in range(count):
        for b in range(a + 1):
            i, j = nodes[a, 0] - nodes[b, 0], nodes[a, 1] - nodes[b, 1]
            value = correlation_at(along_x, along_y, i, j)
            i, j = nodes[b, 0], nodes[b, 1]
            value -= weights[a, 0] * correlation_at(along_x, along_y, i, j)
            value -= weights[a, 1] * (
                correlation_at(along_x, along_y, i - 1, j)
                if k == 0
                else correlation_at(along_x, along_y, i, j - 1)
            )
            value -= weights[a, 2] * correlation_at(along_x, along_y, i - 1, j - 1)
            for c in range(b):
                value -= factor[c, a] * factor[c, b]
            if a == b:
                factor[a, a] = sqrt(max(value, LEAST_VARIANCE))
            else:
                factor[b, a] = value / factor[b, b]
    for a in range(count):
        for b in range(a + 1):
            factor[b, a] *= lines.height_rms * bent[a, GAIN]


@jit(part=True)
def fill_rows(law, lines, cells, wanted, column, b, share, rows):
    """Fill in the directions of the cells of a column at place b of it, and their slopes.

    rows  (steps of zenith, N_ROW, rows)

    Returns how many cells are wanted.
    """
    n_theta, n_dphi = wanted.shape
    steps = rows.shape[0]
    dphi = lines.left + tau / n_dphi * (column + b)
    cos_phi, sin_phi = cos(lines.phi), sin(lines.phi)
    cos_o, sin_o = cos(lines.phi + dphi), sin(lines.phi + dphi)
    cos_i, sin_i = cos(lines.theta_i), sin(lines.theta_i)
    hidden_i = overhang(law, cos_i, sin_i, cos_phi, sin_phi)
    n = 0
    for row in range(n_theta):
        if not wanted[row, column]:
            continue
        cell = cells[row, column]
        for s in range(steps):
            a = tilted((s + 0.5) / steps, cell[RISE_THETA])
            theta_s = HALF_PI / n_theta * (row + a)
            way = directions(lines.theta_i, theta_s, dphi, cos_phi, sin_phi)
            facet = mirror_facet(way)
            rows[s, SLOPE_X, n], rows[s, SLOPE_Y, n] = facet.slope_x, facet.slope_y
            rows[s, RISE_I, n] = cos_i / max(sin_i, 1e-12)
            rows[s, RISE_S, n] = way.cos_s / max(way.sin_s, 1e-12)
            hidden_s = overhang(law, way.cos_s, way.sin_s, cos_o, sin_o)
            rows[s, LAMBDAS, n] = 1.0 + hidden_i + hidden_s
            rows[s, WEIGHT, n] = share * tilted_density(b, cell[RISE_DPHI])
        n += 1
    return n


@jit
def fill_profiles(ensemble, lines, along_x, along_y, cells, wanted, profiles):
    """Fill in `Profiles` for the cells (cells, cells, N_CELL) that are wanted."""
    n_dphi = wanted.shape[1]
    turns = profiles.rows.shape[0] // profiles.columns
    steps, sources = profiles.rows.shape[1], profiles.sources
    for column in range(n_dphi):
        for turn in range(turns):
            b = tilted((turn + 0.5) / turns, lines.change[column])
            share = 1.0 / tilted_density(b, lines.change[column])
            rows = profiles.rows[column * turns + turn]
            n = fill_rows(ensemble.law, lines, cells, wanted, column, b, share, rows)
            if n == 0:
                continue
            dphi = lines.left + tau / n_dphi * (column + b)
            for k in range(2):
                path = 2 * (column * turns + turn) + k
                nodes, weights = profiles.nodes[path], profiles.weights[path]
                bent, factor = profiles.bent[path], profiles.factor[path]
                place_nodes(
                    ensemble, lines, along_x, along_y, k, dphi, sources, nodes, weights,
                    bent,
                )  # fmt: skip
                factorise(
                    ensemble, lines, along_x, along_y, k, nodes, weights, bent, factor
                )
                for a in range(nodes.shape[0]):
                    # Rows are ever lower, the last step of each lowest
                    rise = rows[steps - 1, RISE_I if a < sources else RISE_S]
                    way = bent[a, WAY] / bent[a, GAIN]
                    first = 0
                    while first < n and rise[first] * way > CLEAR * lines.height_rms:
                        first += 1
                    profiles.first[path, a] = first
