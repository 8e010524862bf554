"""Fresnel reflection and transmission of a smooth facet, in its own (s, p) frame.

Everything follows from q = N cos(theta_t), the normal component of the wave vector behind
the interface in units of the one in vacuum. With c = cos(beta), s = sin(beta)

    r_s = (c - q) / (c + q) = (1 - N^2) / (c + q)^2
    r_p = r_s (s^2 - q c) / (s^2 + q c)

The second forms are identities of the paper's equations (1) and (2), with the labels s and
p put right, in which nothing cancels: they keep full accuracy for an index near 1, for
n = 1e6 and for kappa of 1e-8. (3) to (8) are the squared moduli of the same two numbers.

`select` stands for an if, so that the same source can be evaluated on symbols
(`pbrdf.analytic.symbolic`).
"""

from math import inf, sqrt

from pbrdf.kernels import jit

__all__ = [
    "fill_amplitudes",
    "fill_reflection",
    "fill_transmission",
    "reflection_amplitudes",
    "reflection_elements",
    "select",
    "transmission_elements",
    "transmission_parts",
    "wave_normal",
]

# Below this a squared length is zero and its direction undefined
TINY = 1e-300


@jit(forceinline=True)
def select(condition, value, otherwise):
    """`value` where the condition holds, else `otherwise`."""
    return value if condition else otherwise


@jit(forceinline=True)
def wave_normal(cos_beta, n, kappa):
    """Real and imaginary part of q = sqrt(N^2 - sin^2 beta), both >= 0.

    Equations (5), (6) of the paper with the 4 n^2 kappa^2 it lost; the smaller part comes
    from q_re q_im = n kappa instead of a difference.
    """
    # (n - 1)(n + 1) + cos^2 keeps the digits that n^2 - sin^2 loses at grazing
    real = (n - 1.0) * (n + 1.0) - kappa * kappa + cos_beta * cos_beta
    imag = 2.0 * n * kappa
    modulus = sqrt(real * real + imag * imag)
    larger = sqrt(0.5 * (modulus + abs(real)))
    smaller = 0.5 * imag / (larger + TINY)
    return select(real >= 0.0, larger, smaller), select(real >= 0.0, smaller, larger)


@jit(forceinline=True)
def elements_from_wave(cos_beta, sin2_beta, excess_re, excess_im, q_re, q_im):
    """Elements A, B, C, D from q and N^2 - 1 = excess_re + i excess_im."""
    forward = cos_beta + q_re
    norm = forward * forward + q_im * q_im + TINY
    refl_s = (excess_re * excess_re + excess_im * excess_im) / norm / norm

    # r_p / r_s = (s^2 - q c)/(s^2 + q c), multiplied out
    q_abs2_c2 = cos_beta * cos_beta * (q_re * q_re + q_im * q_im)
    twice_re = 2.0 * sin2_beta * cos_beta * q_re
    sin4 = sin2_beta * sin2_beta
    scale = refl_s / (sin4 + twice_re + q_abs2_c2 + TINY)
    return (
        scale * (sin4 + q_abs2_c2),
        scale * twice_re,
        scale * (sin4 - q_abs2_c2),
        scale * 2.0 * sin2_beta * cos_beta * q_im,
    )


@jit(forceinline=True)
def facet_elements(cos_beta, sin2_beta, n, kappa):
    """Elements A, B, C, D without a branch, from cos and sin^2 each to full accuracy."""
    perfect = n == inf
    index = select(perfect, 1.0, n)
    q_re, q_im = wave_normal(cos_beta, index, kappa)
    excess_re = (index - 1.0) * (index + 1.0) - kappa * kappa
    excess_im = 2.0 * index * kappa
    a, b, c, d = elements_from_wave(cos_beta, sin2_beta, excess_re, excess_im, q_re, q_im)
    return (
        select(perfect, 1.0, a),
        select(perfect, 0.0, b),
        select(perfect, -1.0, c),
        select(perfect, 0.0, d),
    )


@jit(part=True)
def reflection_elements(cos_beta, n, kappa):
    """Elements of the reflection matrix: [[A, B], [B, A]] over [[C, -D], [D, C]].

    A = (R_s + R_p)/2, B = (R_s - R_p)/2, C + iD = r_s conj(r_p): equation (10) of the paper
    with the factor 1/2 it lacks and Q = I_s - I_p. n = inf is a perfect mirror.
    """
    if n == inf:
        return 1.0, 0.0, -1.0, 0.0

    sin2_beta = (1.0 - cos_beta) * (1.0 + cos_beta)
    if kappa == 0.0:
        # A transparent medium below its critical angle: q is real
        excess = (n - 1.0) * (n + 1.0)
        q2 = excess + cos_beta * cos_beta
        if q2 >= 0.0:
            return elements_from_wave(cos_beta, sin2_beta, excess, 0.0, sqrt(q2), 0.0)
    return facet_elements(cos_beta, sin2_beta, n, kappa)


@jit(part=True)
def reflection_amplitudes(cos_beta, n, kappa):
    """Complex (r_s, r_p) of a facet hit at local incidence beta, from vacuum.

    Born & Wolf, Principles of Optics, 7th ed., section 1.5.2; equations (1), (2) of the
    paper with s and p exchanged.
    """
    if n == inf:
        return complex(-1.0, 0.0), complex(1.0, 0.0)
    if n == 1.0 and kappa == 0.0:
        # An index-matched facet reflects nothing; below it would be 0/0 at grazing
        return complex(0.0, 0.0), complex(0.0, 0.0)

    q_re, q_im = wave_normal(cos_beta, n, kappa)
    q = complex(q_re, q_im)
    sin2_beta = (1.0 - cos_beta) * (1.0 + cos_beta)
    excess = complex((n - 1.0) * (n + 1.0) - kappa * kappa, 2.0 * n * kappa)
    r_s = -excess / ((cos_beta + q) * (cos_beta + q))
    r_p = r_s * (sin2_beta - q * cos_beta) / (sin2_beta + q * cos_beta)
    return r_s, r_p


@jit(part=True)
def transmitted_powers(cos_beta, n, kappa):
    """Return T_s = 4 c Re(q)/|c + q|^2 and T_p = T_s (|q|^2 + s^2)/|s^2 + q c|^2.

    The identity behind T_p is r_p of the module's head; neither is a difference.
    """
    q_re, q_im = wave_normal(cos_beta, n, kappa)
    sin2_beta = (1.0 - cos_beta) * (1.0 + cos_beta)
    forward = cos_beta + q_re
    trans_s = 4.0 * cos_beta * q_re / (forward * forward + q_im * q_im + TINY)
    bend_re = sin2_beta + q_re * cos_beta
    bend_im = q_im * cos_beta
    bend2 = bend_re * bend_re + bend_im * bend_im + TINY
    trans_p = trans_s * (q_re * q_re + q_im * q_im + sin2_beta) / bend2
    return trans_s, trans_p


@jit(part=True)
def transmission_parts(cos_beta, n, kappa):
    """Return (T_s + T_p)/2, (T_s - T_p)/2, sqrt(T_s T_p) without a branch."""
    perfect = n == inf
    trans_s, trans_p = transmitted_powers(cos_beta, select(perfect, 1.0, n), kappa)
    open_part = select(perfect, 0.0, 1.0)
    return (
        open_part * 0.5 * (trans_s + trans_p),
        open_part * 0.5 * (trans_s - trans_p),
        open_part * sqrt(trans_s * trans_p),
    )


@jit(part=True)
def transmission_elements(cos_beta, n, kappa):
    """Elements A, B, C, D of the power that crosses: T_s = 1 - R_s, T_p = 1 - R_p.

    C + iD = sqrt(T_s T_p) times the phase of t_s conj(t_p), t_s = 2c/(c + q) and
    t_p = 2Nc/(N^2 c + q): the Jones matrix that carries the right powers. All vanish under
    total reflection and behind a mirror.
    """
    if n == inf:
        return 0.0, 0.0, 0.0, 0.0
    trans_s, trans_p = transmitted_powers(cos_beta, n, kappa)
    q_re, q_im = wave_normal(cos_beta, n, kappa)
    bend = (1.0 - cos_beta) * (1.0 + cos_beta) + complex(q_re, q_im) * cos_beta

    # t_p / t_s = N (c + q)/(N^2 c + q) = N / (s^2 + q c)
    ratio = complex(n, kappa) / (bend + TINY)
    length = sqrt(ratio.real * ratio.real + ratio.imag * ratio.imag)
    mean = sqrt(trans_s * trans_p) / (length + TINY)
    return (
        0.5 * (trans_s + trans_p),
        0.5 * (trans_s - trans_p),
        mean * ratio.real,
        -mean * ratio.imag,
    )


@jit(part=True)
def write_facet_matrix(a, b, c, d, out):
    """Write [[A, B], [B, A]] and [[C, -D], [D, C]] into a zeroed 4x4 matrix."""
    out[0, 0] = out[1, 1] = a
    out[0, 1] = out[1, 0] = b
    out[2, 2] = out[3, 3] = c
    out[2, 3] = -d
    out[3, 2] = d


@jit
def fill_reflection(cos_beta, n, kappa, out):
    """Fill out[k] with the reflection matrix of interface k."""
    for k in range(cos_beta.size):
        a, b, c, d = reflection_elements(cos_beta[k], n[k], kappa[k])
        write_facet_matrix(a, b, c, d, out[k])


@jit
def fill_transmission(cos_beta, n, kappa, out):
    """Fill out[k] with the transmission matrix of interface k."""
    for k in range(cos_beta.size):
        a, b, c, d = transmission_elements(cos_beta[k], n[k], kappa[k])
        write_facet_matrix(a, b, c, d, out[k])


@jit
def fill_amplitudes(cos_beta, n, kappa, out):
    """Fill out[0] with r_s and out[1] with r_p."""
    for k in range(cos_beta.size):
        out[0, k], out[1, k] = reflection_amplitudes(cos_beta[k], n[k], kappa[k])
