"""Slow, independent reference in 50-digit arithmetic, from vectors and textbook formulas.

Shares no code and no algebra with the package: directions are vectors, frames are cross
products, Fresnel amplitudes come from Snell's law, Mueller matrices from Jones matrices.
"""

import mpmath as mp

mp.mp.dps = 50


def fresnel_jones(cos_i, n, kappa):
    """Amplitudes (r_s, r_p) after Born and Wolf, section 1.5.2, for fields exp(-i w t)."""
    index = mp.mpc(n, kappa)
    cos_t = mp.sqrt(1 - (1 - cos_i**2) / index**2)
    r_s = (cos_i - index * cos_t) / (cos_i + index * cos_t)
    r_p = (index * cos_i - cos_t) / (index * cos_i + cos_t)
    return r_s, r_p


def mueller_of_jones(jones):
    """Mueller matrix of a Jones matrix in (s, p): M_ab = tr(sigma_a J sigma_b J^dagger)/2.

    S = (|s|^2 + |p|^2, |s|^2 - |p|^2, 2 Re s p*, V). Of a wave exp(-i w t) whose p field
    lags by a quarter period, p = i s, the field seen against k turns from e_s away from
    e_p = k x e_s, clockwise: V = 2 Im(p s*) > 0 is right-circular for the receiver.
    """
    i = mp.mpc(0, 1)
    pauli = [
        mp.matrix([[1, 0], [0, 1]]),
        mp.matrix([[1, 0], [0, -1]]),
        mp.matrix([[0, 1], [1, 0]]),
        mp.matrix([[0, i], [-i, 0]]),
    ]
    out = mp.matrix(4, 4)
    for a in range(4):
        for b in range(4):
            product = pauli[a] * jones * pauli[b] * jones.H
            out[a, b] = mp.re(product[0, 0] + product[1, 1]) / 2
    return out


def _cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a, b):
    return mp.fsum(x * y for x, y in zip(a, b, strict=True))


def _unit(a):
    length = mp.sqrt(_dot(a, a))
    return [x / length for x in a]


def _frame(azimuth, prop, incident):
    """Meridian frame (e_s, e_p); on the axis the limit at the azimuth."""
    sign = 1 if incident else -1
    e_s = [sign * mp.sin(azimuth), -sign * mp.cos(azimuth), mp.mpf(0)]
    return e_s, _cross(prop, e_s)


def facet_geometry(theta_i, theta_s, dphi, phi_i=0.0):
    """Vectors of both beams and of the facet between them."""
    ti, ts, dp, pi_ = (mp.mpf(float(v)) for v in (theta_i, theta_s, dphi, phi_i))
    phi_s = pi_ + dp
    dir_i = [mp.sin(ti) * mp.cos(pi_), mp.sin(ti) * mp.sin(pi_), mp.cos(ti)]
    dir_s = [mp.sin(ts) * mp.cos(phi_s), mp.sin(ts) * mp.sin(phi_s), mp.cos(ts)]
    normal = _unit([a + b for a, b in zip(dir_i, dir_s, strict=True)])
    return dir_i, dir_s, pi_, phi_s, normal


def brdf(theta_i, theta_s, dphi, n, kappa, slope_x, slope_y=None, phi_i=0.0, shadow=None):
    """Gaussian facet BRDF; `shadow(theta_i, theta_s)` multiplies it."""
    slope_x = mp.mpf(float(slope_x))
    slope_y = slope_x if slope_y is None else mp.mpf(float(slope_y))
    dir_i, dir_s, phi_in, phi_out, normal = facet_geometry(theta_i, theta_s, dphi, phi_i)
    prop_i = [-x for x in dir_i]
    plane = _cross(normal, prop_i)
    # In exact retro-reflection any plane of incidence serves
    plane = (
        _frame(phi_in, prop_i, True)[0] if _dot(plane, plane) < mp.mpf(10) ** -80 else plane
    )
    facet_s = _unit(plane)

    # Project the field on the facet's frame, reflect, project back
    beam_s, beam_p = _frame(phi_in, prop_i, True)
    facet_p = _cross(prop_i, facet_s)
    into = mp.matrix(
        [
            [_dot(facet_s, beam_s), _dot(facet_s, beam_p)],
            [_dot(facet_p, beam_s), _dot(facet_p, beam_p)],
        ]
    )
    out_s, out_p = _frame(phi_out, dir_s, False)
    facet_p_out = _cross(dir_s, facet_s)
    back = mp.matrix(
        [
            [_dot(out_s, facet_s), _dot(out_s, facet_p_out)],
            [_dot(out_p, facet_s), _dot(out_p, facet_p_out)],
        ]
    )
    r_s, r_p = fresnel_jones(_dot(normal, dir_i), n, kappa)
    matrix = mueller_of_jones(back * mp.matrix([[r_s, 0], [0, r_p]]) * into)

    x, y = normal[0] / normal[2] / slope_x, normal[1] / normal[2] / slope_y
    density = mp.exp(-(x * x + y * y) / 2) / (2 * mp.pi * slope_x * slope_y)
    strength = density / normal[2] ** 4 / (4 * dir_i[2] * dir_s[2])
    if shadow is not None:
        strength *= shadow(dir_i[2], dir_s[2])
    return strength * matrix


def smith_correlated(slope):
    """Height-correlated Smith factor of a Gaussian surface."""

    def overhang(cosine):
        cot = cosine / mp.sqrt(1 - cosine**2) if cosine < 1 else mp.inf
        if cot == mp.inf:
            return mp.mpf(0)
        nu = cot / (mp.sqrt(2) * mp.mpf(float(slope)))
        return (mp.exp(-nu * nu) / (nu * mp.sqrt(mp.pi)) - mp.erfc(nu)) / 2

    return lambda ci, cs: 1 / (1 + overhang(ci) + overhang(cs))
