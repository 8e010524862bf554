"""Light that two facets mirror in turn, summed over all pairs of facets.

Smith's surface, whose facets know nothing of one another's slope and height, lets the
heights be integrated in closed form. With u the share of the surface below a height, a ray
going down from above is first stopped between u and u + du with density
(1 + L_i) u^L_i, an upgoing ray at u escapes with u^L, and between u and u' survives with
(u/u')^L; E. Heitz et al., ACM Trans. Graph. 35, 58 (2016), section 4. For light that goes
on along w_1 after the first facet this leaves

    1 / (c_i c_o |c_1| (1 + L_i + L_o) (1 + L_1 + L_x)),

L_x = L_i where w_1 goes up, L_o where it goes down, to be multiplied by D_1 D_2 / 16 and
by the product of both facets' matrices, and integrated over w_1. It is reciprocal term by
term.
"""

from math import cos, sin, sqrt

from pbrdf.kernels import jit
from pbrdf.kernels.microfacet.facet import Directions, Facet, rotated_elements
from pbrdf.kernels.microfacet.slopes import mean_overhang, slope_along, slope_density
from pbrdf.kernels.optics.fresnel import facet_elements

__all__ = ["fill_second_bounce"]


@jit
def between(cos_i, sin_i, cos_s, sin_s, cos_dphi, sin_dphi):
    """Directions of two beams from their cosines, for zeniths in [0, pi]."""
    cos_diff = min(1.0, max(-1.0, cos_i * cos_s + sin_i * sin_s))
    sin_diff = sin_i * cos_s - cos_i * sin_s
    sin_d = sqrt(0.5 * (1.0 - cos_diff))
    sin_h = sqrt(0.5 * max(0.0, 1.0 - cos_dphi))
    return Directions(
        cos_i,
        sin_i,
        cos_s,
        sin_s,
        sin_d if sin_diff >= 0.0 else -sin_d,
        sqrt(0.5 * (1.0 + cos_diff)),
        sin_h if sin_dphi >= 0.0 else -sin_h,
        sqrt(0.5 * max(0.0, 1.0 + cos_dphi)),
        1.0,
        0.0,
    )


@jit(part=True)
def facet_matrix(way, cos_beta, n, kappa):
    """Rows of F' of one facet."""
    sin2_beta = max(0.0, (1.0 - cos_beta) * (1.0 + cos_beta))
    a, b, c, d = facet_elements(min(cos_beta, 1.0), sin2_beta, n, kappa)
    return rotated_elements(way, a, b, c, d)


@jit(part=True)
def overhang_of(rough, cos_theta, sin_theta, cos_phi, sin_phi):
    """Lambda of a direction above the horizon."""
    slope = slope_along(rough, cos_phi, sin_phi)
    return mean_overhang(rough, cos_theta, sin_theta, slope)


@jit(part=True)
def add_product(weight, second, first, out):
    """Add weight * second @ first."""
    for i in range(4):
        for j in range(4):
            total = 0.0
            for k in range(4):
                total += second[i][k] * first[k][j]
            out[i, j] += weight * total


@jit(part=True)
def add_facet_pair(slope_x, slope_y, source, detector, n, kappa, rough, scale, out):
    """Add the light that the facet of these slopes sends to the detector by one other.

    source, detector: (cos_theta, sin_theta, cos_phi, sin_phi, Lambda) of each.
    """
    cos_i, sin_i, cos_phi_i, sin_phi_i, lambda_i = source
    cos_o, sin_o, cos_phi_o, sin_phi_o, lambda_o = detector

    # The first facet, if it is turned to the source
    tilted = cos_i - sin_i * (slope_x * cos_phi_i + slope_y * sin_phi_i)
    if tilted <= 0.0:
        return
    length = sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    cos_beta = tilted / length

    # The direction it mirrors to
    twice = 2.0 * cos_beta / length
    x = -twice * slope_x - sin_i * cos_phi_i
    y = -twice * slope_y - sin_i * sin_phi_i
    cos_1 = min(1.0, max(-1.0, twice - cos_i))
    sin_1 = sqrt(x * x + y * y)
    cos_phi, sin_phi = (x / sin_1, y / sin_1) if sin_1 > 1e-14 else (1.0, 0.0)

    # The second facet, whose normal must point upwards
    rise = cos_o - cos_1
    if rise <= 1e-12:
        return
    back_x = (x - sin_o * cos_phi_o) / rise
    back_y = (y - sin_o * sin_phi_o) / rise
    tan2 = back_x * back_x + back_y * back_y
    facet = Facet(back_x, back_y, tan2, 0.0, 0.0)
    density = slope_density(rough, facet) * (1.0 + tan2) * (1.0 + tan2)
    if density < 1e-30:
        return

    level = abs(cos_1) + 1e-12
    lambda_1 = overhang_of(rough, level, sin_1, cos_phi, sin_phi)
    hidden = 1.0 + lambda_1 + (lambda_i if cos_1 > 0.0 else lambda_o)
    weight = scale * tilted * density / (level * hidden)

    # Meridian frames of the light between the facets serve both
    first = between(
        cos_i, sin_i, cos_1, sin_1,
        cos_phi * cos_phi_i + sin_phi * sin_phi_i,
        sin_phi * cos_phi_i - cos_phi * sin_phi_i,
    )  # fmt: skip
    second = between(
        -cos_1, sin_1, cos_o, sin_o,
        -(cos_phi_o * cos_phi + sin_phi_o * sin_phi),
        -(sin_phi_o * cos_phi - cos_phi_o * sin_phi),
    )  # fmt: skip
    cos_beta_2 = 0.5 * rise * sqrt(1.0 + tan2)
    add_product(
        weight,
        facet_matrix(second, cos_beta_2, n, kappa),
        facet_matrix(first, cos_beta, n, kappa),
        out,
    )


@jit
def fill_second_bounce(theta_i, theta_s, dphi, phi_i, n, kappa, rough, nodes, reach, out):
    """Add the second bounce of geometry k to out[k]; trapezium rule over first slopes.

    The rule covers `reach` slope scales to each side with `nodes` points an axis, which for
    a Gaussian converges faster than any power.
    """
    step = 2.0 * reach / nodes
    for k in range(theta_i.size):
        phi_s = phi_i[k] + dphi[k]
        cos_i, sin_i = cos(theta_i[k]), sin(theta_i[k])
        cos_o, sin_o = cos(theta_s[k]), sin(theta_s[k])
        lambda_i = overhang_of(rough, cos_i, sin_i, cos(phi_i[k]), sin(phi_i[k]))
        lambda_o = overhang_of(rough, cos_o, sin_o, cos(phi_s), sin(phi_s))
        source = (cos_i, sin_i, cos(phi_i[k]), sin(phi_i[k]), lambda_i)
        detector = (cos_o, sin_o, cos(phi_s), sin(phi_s), lambda_o)
        # dw_1 D_1 = 4 tilted f(z) d^2z, with the 1/16 of both facets
        scale = 0.25 * step * step * rough.slope_x * rough.slope_y
        scale /= cos_i * cos_o * (1.0 + lambda_i + lambda_o)
        for a in range(nodes):
            slope_x = (-reach + (a + 0.5) * step) * rough.slope_x
            for b in range(nodes):
                slope_y = (-reach + (b + 0.5) * step) * rough.slope_y
                tan2 = slope_x * slope_x + slope_y * slope_y
                share = slope_density(rough, Facet(slope_x, slope_y, tan2, 0.0, 0.0))
                add_facet_pair(
                    slope_x, slope_y, source, detector, n[k], kappa[k],
                    rough, scale * share, out[k],
                )  # fmt: skip
