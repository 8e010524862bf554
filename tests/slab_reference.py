"""Slow, independent optics of a flat film that absorbs, on a base, for the tracer's tests.

Amplitudes from the complex angle of refraction, in the textbook form (Born & Wolf, sections
1.5.2 and 14.2); nothing of the package. Powers add up: the film is thick against the
coherence of the light, or its thickness varies. `airy` adds amplitudes instead.
"""

import cmath
import math
from itertools import pairwise

import numpy as np


def along(theta):
    """Part of the wave vector along the film, in units of the one in vacuum."""
    return math.sin(theta)


def normal(k, index):
    """Normal part of the wave vector in a medium, which decays away from the source."""
    q = cmath.sqrt(complex(index) ** 2 - k * k)
    return -q if q.imag < 0 or (q.imag == 0 and q.real < 0) else q


def amplitudes(k, one, two):
    """(r_s, r_p) and the phase of t_s conj(t_p) from medium one into two."""
    if two == math.inf:
        return (-1.0, 1.0), 1.0
    one, two = complex(one), complex(two)
    q_one, q_two = normal(k, one), normal(k, two)
    cos_one, cos_two = q_one / one, q_two / two
    r_s = (one * cos_one - two * cos_two) / (one * cos_one + two * cos_two)
    r_p = (two * cos_one - one * cos_two) / (two * cos_one + one * cos_two)
    t_s = 2 * one * cos_one / (one * cos_one + two * cos_two)
    t_p = 2 * one * cos_one / (two * cos_one + one * cos_two)
    cross = t_s * t_p.conjugate()
    return (r_s, r_p), cross / abs(cross) if abs(cross) > 0 else 1.0


def one_way(k, index, thickness, wavelength):
    """Power that is left after one passage of the film."""
    return math.exp(-4 * math.pi / wavelength * normal(k, index).imag * thickness)


def block(s, p, cross):
    """Mueller matrix, in the plane of incidence, of powers s, p and a complex s-p term."""
    a, b = (s + p) / 2, (s - p) / 2
    c, d = complex(cross).real, complex(cross).imag
    return np.array([[a, b, 0, 0], [b, a, 0, 0], [0, 0, c, -d], [0, 0, d, c]])


def slab(theta, film, base, thickness, wavelength):
    """Mueller matrix of the light reflected by a film on a base of some index."""
    k = along(theta)
    (r_s, r_p), turn = amplitudes(k, 1.0, film)
    (b_s, b_p), _ = amplitudes(k, film, base)
    both = one_way(k, film, thickness, wavelength) ** 2
    powers = []
    for r, b in ((abs(r_s) ** 2, abs(b_s) ** 2), (abs(r_p) ** 2, abs(b_p) ** 2)):
        powers.append(r + (1 - r) ** 2 * b * both / (1 - r * b * both))
    outer, inner = r_s * np.conj(r_p), b_s * np.conj(b_p)
    open_s, open_p = 1 - abs(r_s) ** 2, 1 - abs(r_p) ** 2
    through = (math.sqrt(open_s * open_p) * turn) ** 2
    # The film sees the outer interface with both signs turned
    cross = outer + through * inner * both / (1 - outer * inner * both)
    return block(*powers, cross)


def airy(theta, film, base, thickness, wavelength):
    """Reflectances (s, p) of the same film in coherent light."""
    k = along(theta)
    outer, _ = amplitudes(k, 1.0, film)
    inner, _ = amplitudes(k, film, base)
    phase = cmath.exp(4j * math.pi / wavelength * normal(k, film) * thickness)
    return [
        abs((r + b * phase) / (1 + r * b * phase)) ** 2
        for r, b in zip(outer, inner, strict=True)
    ]


def slab_on_lambertian(theta, film, n_base, albedo, thickness, wavelength):
    """Mueller matrix of all light from a film on a Lambertian base under an interface.

    Summed over the hemisphere, each direction in its meridian frame. The base is even in
    the square of the wave vector along the film; an interface reflects at most all.
    """

    def ways(k):
        """For s and p: into the base, out of it to the air, and back to it."""
        (r_s, r_p), _ = amplitudes(k, 1.0, film)
        (b_s, b_p), _ = amplitudes(k, film, n_base)
        one = one_way(k, film, thickness, wavelength)
        found = []
        for r, b in ((abs(r_s) ** 2, abs(b_s) ** 2), (abs(r_p) ** 2, abs(b_p) ** 2)):
            r, b = min(r, 1.0), min(b, 1.0)
            series = 1 / (1 - r * b * one**2)
            out = (1 - b) * one * (1 - r) * series if k < 1 else 0.0
            found.append((out, b + (1 - b) ** 2 * one**2 * r * series))
        return np.array(found)

    # Even in the square of k, dense at the ends of each part
    nodes, weights = np.polynomial.legendre.leggauss(200)
    turn = 0.5 * np.pi * (1 + nodes)
    place, share = 0.5 * (1 - np.cos(turn)), 0.25 * np.pi * np.sin(turn) * weights
    joints = sorted({0.0, min(1.0, n_base), min(complex(film).real, n_base), n_base})
    sent = np.zeros((2, 2))
    for low, high in pairwise(joints):
        squares = low**2 + (high**2 - low**2) * place
        part = sum(w * ways(math.sqrt(u)) for w, u in zip(share, squares, strict=True))
        sent += part * (high**2 - low**2) / n_base**2
    (out_s, out_p), (back_s, back_p) = sent.T
    (in_s, in_p), _ = ways(along(theta)).T
    gain = albedo / (1 - albedo * (back_s + back_p) / 2)
    matrix = slab(theta, film, n_base, thickness, wavelength)
    entering = np.array([(in_s + in_p) / 2, (in_s - in_p) / 2, 0, 0])
    leaving = np.array([(out_s + out_p) / 2, (out_s - out_p) / 2, 0, 0])
    return matrix + gain * np.outer(leaving, entering)
