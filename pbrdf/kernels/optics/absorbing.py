"""A smooth interface between two media of which either may absorb.

Behind it the wave is inhomogeneous: planes of equal phase lean, those of equal amplitude
lie along the interface. With k the part of the wave vector along the interface, in units of
the one in vacuum, its normal parts are q_j = sqrt(N_j^2 - k^2), and

    r_s = (q_1 - q_2)/(q_1 + q_2) = (N_1^2 - N_2^2)/(q_1 + q_2)^2
    r_p = r_s (k^2 - q_1 q_2)/(k^2 + q_1 q_2),    t_p/t_s = N_1 N_2/(k^2 + q_1 q_2)

(Born & Wolf, section 14.2). Phase travels along (k, Re q): the beam has the real index
m = sqrt(k^2 + Re(q)^2), obeys Snell's law with it, and weakens by 2 k_0 Im(q) along the
normal, which is the absorption of the medium times n/m along the path.

Of a beam inside an absorber the share 1 - R crosses: what the two waves before the
interface lose or gain by their interference is booked with what has crossed.
"""

import math

from pbrdf.kernels import jit

# Below this a squared length is zero and its direction undefined
TINY = 1e-300
# Cosine of a refracted beam below which its index does not tell it any more. Such a wave
# falls off within a wavelength of the interface, and is booked as absorbed there
SKIMMING = 1e-7


@jit(forceinline=True)
def complex_root(real, imag):
    """Square root in the first quadrant of a number of the upper half plane."""
    modulus = math.sqrt(real * real + imag * imag)
    larger = math.sqrt(0.5 * (modulus + abs(real)))
    smaller = 0.5 * imag / (larger + TINY)
    return complex(larger, smaller) if real >= 0.0 else complex(smaller, larger)


@jit(forceinline=True)
def normal_wave(along2, n, kappa):
    """Find q, the normal part of a wave whose part along the interface squares to k^2."""
    return complex_root(n * n - kappa * kappa - along2, 2.0 * n * kappa)


@jit(forceinline=True)
def bounded(amplitude):
    """Cut an amplitude to the modulus 1, beyond which interference may carry it."""
    square = amplitude.real * amplitude.real + amplitude.imag * amplitude.imag
    return amplitude / math.sqrt(square) if square > 1.0 else amplitude


@jit
def interface_elements(cos_in, index, n_1, kappa_1, n_2, kappa_2):
    """Elements A, B, C, D of what is reflected and of what crosses, and m_2/m_1.

    `index` is m_1, of the arriving beam. The ratio is 0 where no wave leaves the interface;
    n_2 = inf is a perfect mirror.
    """
    if n_2 == math.inf:
        return 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    along2 = index * index * (1.0 - cos_in) * (1.0 + cos_in)
    # In a medium that does not absorb, q is the index times the cosine, to the last digit
    q_1 = complex(index * cos_in, 0.0)
    if kappa_1 > 0.0:
        q_1 = normal_wave(along2, n_1, kappa_1)
    q_2 = normal_wave(along2, n_2, kappa_2)
    step = complex(
        (n_1 - n_2) * (n_1 + n_2) - (kappa_1 - kappa_2) * (kappa_1 + kappa_2),
        2.0 * (n_1 * kappa_1 - n_2 * kappa_2),
    )
    total = q_1 + q_2
    bend = along2 + q_1 * q_2
    r_s = step / (total * total + TINY)
    r_p = bounded(r_s * (along2 - q_1 * q_2) / (bend + TINY))
    r_s = bounded(r_s)
    # Rounding may leave a cut amplitude above 1 in the last digit
    refl_s = min(r_s.real * r_s.real + r_s.imag * r_s.imag, 1.0)
    refl_p = min(r_p.real * r_p.real + r_p.imag * r_p.imag, 1.0)
    cross = r_s * r_p.conjugate()

    ratio = complex(n_1, kappa_1) * complex(n_2, kappa_2) / (bend + TINY)
    length = math.sqrt(ratio.real * ratio.real + ratio.imag * ratio.imag)
    mean = math.sqrt((1.0 - refl_s) * (1.0 - refl_p)) / (length + TINY)
    further = 0.0
    if q_2.real > SKIMMING * index:
        further = math.sqrt(along2 + q_2.real * q_2.real) / index
    return (
        0.5 * (refl_s + refl_p),
        0.5 * (refl_s - refl_p),
        cross.real,
        cross.imag,
        1.0 - 0.5 * (refl_s + refl_p),
        0.5 * (refl_p - refl_s),
        mean * ratio.real,
        -mean * ratio.imag,
        further,
    )


@jit
def shares_into_absorber(n_base, n, kappa, lowest2, highest2, nodes, weights):
    """Mean share of diffuse light of a base of index n_base that gets into an absorber.

    Of the light whose wave vector along the interface has a square from lowest2 to
    highest2; a Lambertian source is even in that square.
    """
    mean = 0.0
    for k in range(nodes.size):
        # Dense at both ends, where the share is a root
        place = 0.5 * (1.0 - math.cos(math.pi * nodes[k]))
        weight = 0.5 * math.pi * math.sin(math.pi * nodes[k]) * weights[k]
        along2 = lowest2 + (highest2 - lowest2) * place
        cos_base = math.sqrt(max(1.0 - along2 / (n_base * n_base), 0.0))
        elements = interface_elements(cos_base, n_base, n_base, 0.0, n, kappa)
        mean += weight * elements[4]
    return mean
