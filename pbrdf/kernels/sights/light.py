"""What single bounces send into cells of directions if Smith's rule hides facets.

The facets of a Gaussian mesh have slopes of a known normal law, so that the light of one
bounce is an integral over the cell: paper, equations (17) and (20), with the height-
correlated factor 1/(1 + Lambda_i + Lambda_s). Gauss-Legendre rules on panels that are
narrow against the law give it to rounding.
"""

from collections import namedtuple
from math import ceil, erfc, exp, log, pi, sqrt, tau

from pbrdf.kernels import jit
from pbrdf.kernels.bins.binning import HALF_PI
from pbrdf.kernels.microfacet.facet import directions, mirror_facet, rotated_elements
from pbrdf.kernels.optics.elementary import cos, sin
from pbrdf.kernels.optics.fresnel import facet_elements

# Normal law of two slopes: inverse of their covariance, factor of the density, covariance
SlopeLaw = namedtuple("SlopeLaw", "inv_xx inv_xy inv_yy norm xx xy yy")
# By cell (cells of theta_s, cells of dphi): flux of unit facets with and without hiding,
# logarithmic change of the first across the cell in theta_s and in dphi
N_CELL = 4
SEEN, ALL, RISE_THETA, RISE_DPHI = range(N_CELL)

# Widest panel, and distance beyond which nothing is left, in standard deviations
PANEL, FARTHEST = 1.5, 12.0
SQRT_PI = sqrt(pi)


@jit(forceinline=True)
def overhang(law, cos_theta, sin_theta, cos_phi, sin_phi):
    """Smith's Lambda of a direction above slopes of the law."""
    variance = (
        law.xx * cos_phi * cos_phi
        + 2.0 * law.xy * cos_phi * sin_phi
        + law.yy * sin_phi * sin_phi
    )
    nu = cos_theta / (sqrt(2.0 * variance) * sin_theta + 1e-30)
    if nu > 27.0:
        return 0.0
    if nu > 4.0:
        # exp(-nu^2) / (nu sqrt(pi)) and erfc(nu) agree to all but 1/(2 nu^2): its series
        x = 1.0 / (nu * nu)
        series = 0.5 - x * (0.75 - x * (1.875 - x * (6.5625 - x * (29.53125 - x * 162.42))))
        return 0.5 * exp(-nu * nu) / (nu * SQRT_PI) * x * series
    return 0.5 * (exp(-nu * nu) / (nu * SQRT_PI) - erfc(nu))


@jit(forceinline=True)
def distance(law, slope_x, slope_y):
    """Distance of slopes from level in standard deviations."""
    square = (
        law.inv_xx * slope_x * slope_x
        + 2.0 * law.inv_xy * slope_x * slope_y
        + law.inv_yy * slope_y * slope_y
    )
    return sqrt(max(square, 0.0))


@jit(forceinline=True)
def strength(law, cos_i, tan2_tilt, slope_x, slope_y):
    """Flux per solid angle and incident flux of facets that reflect all, none hidden."""
    square = distance(law, slope_x, slope_y)
    stretch = 1.0 + tan2_tilt
    return law.norm * exp(-0.5 * square * square) * stretch * stretch / (4.0 * cos_i)


@jit(forceinline=True)
def hidden_share(law, way, cos_d, sin_d, cos_phi, sin_phi):
    """Sum of Smith's Lambda of a source and of a direction at dphi from it."""
    return overhang(law, way.cos_i, way.sin_i, cos_phi, sin_phi) + overhang(
        law, way.cos_s, way.sin_s,
        cos_phi * cos_d - sin_phi * sin_d, sin_phi * cos_d + cos_phi * sin_d,
    )  # fmt: skip


@jit(forceinline=True)
def turned_slopes(facet, cos_phi, sin_phi):
    """Slopes of the facet of a source at azimuth 0, turned with the source."""
    x, y = facet.slope_x, facet.slope_y
    return x * cos_phi - y * sin_phi, x * sin_phi + y * cos_phi


@jit(forceinline=True)
def seen_strength(law, theta_i, theta_s, dphi, cos_phi, sin_phi):
    """Flux per theta_s and dphi of unit facets that Smith's rule leaves in sight."""
    way = directions(theta_i, theta_s, dphi, 1.0, 0.0)
    hidden = hidden_share(law, way, cos(dphi), sin(dphi), cos_phi, sin_phi)
    facet = mirror_facet(way)
    slope_x, slope_y = turned_slopes(facet, cos_phi, sin_phi)
    flux = strength(law, way.cos_i, facet.tan2_tilt, slope_x, slope_y)
    return flux * way.sin_s / (1.0 + hidden)


@jit(part=True)
def slopes_at(theta_i, theta_s, dphi):
    """Slopes of the facet that mirrors into a direction, of a source at azimuth 0."""
    facet = mirror_facet(directions(theta_i, theta_s, dphi, 1.0, 0.0))
    return facet.slope_x, facet.slope_y


@jit
def widths(law, theta_i, low, step, left, turn):
    """Largest extent of a cell along theta_s and along dphi, in standard deviations."""
    narrow = 1.0 / sqrt(0.5 * (law.xx + law.yy) - sqrt(
        0.25 * (law.xx - law.yy) ** 2 + law.xy * law.xy
    ))  # fmt: skip
    along, across = 0.0, 0.0
    for k in range(3):
        x0, y0 = slopes_at(theta_i, low, left + 0.5 * k * turn)
        x1, y1 = slopes_at(theta_i, low + step, left + 0.5 * k * turn)
        along = max(along, sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2) * narrow)
        x0, y0 = slopes_at(theta_i, low + 0.5 * k * step, left)
        x1, y1 = slopes_at(theta_i, low + 0.5 * k * step, left + turn)
        across = max(across, sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2) * narrow)
    return along, across


@jit(forceinline=True)
def write_elements(rows, n_stokes, weight, out):
    """Add weighted rows to out (elements,)."""
    for row in range(n_stokes):
        for column in range(n_stokes):
            out[row * n_stokes + column] += weight * rows[row][column]


@jit(part=True)
def add_panel(law, theta_i, phi, panel, nodes, weights, n, kappa, n_stokes, light, cell):
    """Add the integral over a panel (theta_s, width, dphi, width) of one cell.

    `phi` holds azimuths of the source; only the slopes and what hides them know of it.
    """
    low, step, left, turn = panel
    for a in range(nodes.size):
        theta_s = low + step * nodes[a]
        for b in range(nodes.size):
            dphi = left + turn * nodes[b]
            cos_d, sin_d = cos(dphi), sin(dphi)
            way = directions(theta_i, theta_s, dphi, 1.0, 0.0)
            facet = mirror_facet(way)
            part = way.sin_s * weights[a] * weights[b] * step * turn
            whole = seen = 0.0
            for p in range(phi.size):
                cos_phi, sin_phi = cos(phi[p]), sin(phi[p])
                x, y = turned_slopes(facet, cos_phi, sin_phi)
                if distance(law, x, y) > FARTHEST:
                    continue
                flux = part * strength(law, way.cos_i, facet.tan2_tilt, x, y)
                whole += flux
                seen += flux / (
                    1.0 + hidden_share(law, way, cos_d, sin_d, cos_phi, sin_phi)
                )
            cell[ALL] += whole
            cell[SEEN] += seen
            if seen == 0.0:
                continue
            for w in range(n.size):
                one, two, three, four = facet_elements(
                    facet.cos_beta, facet.sin2_beta, n[w], kappa[w]
                )
                rows = rotated_elements(way, one, two, three, four)
                write_elements(rows, n_stokes, seen, light[w])


@jit(forceinline=True)
def in_reach(law, theta_i, phi, theta_s, dphi, reach):
    """Whether the facets about a direction are found, for some azimuth of the source."""
    x, y = slopes_at(theta_i, theta_s, dphi)
    for p in range(phi.size):
        cos_phi, sin_phi = cos(phi[p]), sin(phi[p])
        if distance(
            law, x * cos_phi - y * sin_phi, x * sin_phi + y * cos_phi
        ) < reach:  # fmt: skip
            return True
    return False


@jit
def rise(first, last):
    """Logarithm of last / first over the middle half, for the whole; 0 in the dark."""
    if first <= 0.0 or last <= 0.0:
        return 0.0
    return min(max(2.0 * log(last / first), -30.0), 30.0)


@jit
def fill_light(theta_i, phi, law, rules, n, kappa, n_stokes, light, cells):
    """Fill light (cells, cells, wavelengths, elements) and cells (cells, cells, N_CELL).

    The mean over the azimuths `phi` of the source; dphi cells are centred as the bins of
    which they are parts: `cells.shape[1]` of them begin at `rules.left`. `rules` is a
    `Rules`.
    """
    n_theta, n_dphi = cells.shape[:2]
    step, turn = HALF_PI / n_theta, tau / n_dphi
    share = 1.0 / phi.size
    light[:] = 0.0
    cells[:] = 0.0
    for i in range(n_theta):
        low = i * step
        for j in range(n_dphi):
            left = rules.left + j * turn
            along, across = widths(law, theta_i, low, step, left, turn)
            rows, columns = max(1, ceil(along / PANEL)), max(1, ceil(across / PANEL))
            reach = FARTHEST + along / rows + across / columns
            fine = max(along / rows, across / columns)
            # The rule of 4 nodes for cells that are small, of 10 for wide ones
            rule = 0 if fine < 0.15 else (1 if fine < 0.5 else 2)
            size = rules.sizes[rule]
            nodes, weights = rules.nodes[rule, :size], rules.weights[rule, :size]
            for a in range(rows):
                for b in range(columns):
                    panel = (
                        low + a * step / rows, step / rows,
                        left + b * turn / columns, turn / columns,
                    )  # fmt: skip
                    theta_s, dphi = panel[0] + 0.5 * panel[1], panel[2] + 0.5 * panel[3]
                    if in_reach(law, theta_i, phi, theta_s, dphi, reach):
                        add_panel(
                            law, theta_i, phi, panel, nodes, weights, n, kappa, n_stokes,
                            light[i, j], cells[i, j],
                        )  # fmt: skip
            if cells[i, j, ALL] == 0.0:
                continue
            first = last = 0.0
            ends = (0.0, 0.0)
            for p in range(phi.size):
                cos_phi, sin_phi = cos(phi[p]), sin(phi[p])
                middle = left + 0.5 * turn
                first += seen_strength(
                    law, theta_i, low + 0.25 * step, middle, cos_phi, sin_phi
                )
                last += seen_strength(
                    law, theta_i, low + 0.75 * step, middle, cos_phi, sin_phi
                )
                centre = low + 0.5 * step
                ends = (
                    ends[0] + seen_strength(
                        law, theta_i, centre, left + 0.25 * turn, cos_phi, sin_phi
                    ),
                    ends[1] + seen_strength(
                        law, theta_i, centre, left + 0.75 * turn, cos_phi, sin_phi
                    ),
                )  # fmt: skip
            cells[i, j, RISE_THETA] = rise(first, last)
            cells[i, j, RISE_DPHI] = rise(ends[0], ends[1])
            for k in (SEEN, ALL):
                cells[i, j, k] *= share
            for w in range(n.size):
                for e in range(light.shape[3]):
                    light[i, j, w, e] *= share
