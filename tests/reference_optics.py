"""Slow, independent reflection optics for the tracer's tests: fields and vectors only.

Written from Born & Wolf (Fresnel amplitudes from Snell's law) and from the definition of
the Stokes vector; shares no code and no formula of the package. The Mueller matrix of a
path is found by sending four fields along it and measuring the Stokes vectors behind it.
"""

import cmath
import math

import numpy as np

# Fields (E_s, E_p) whose Stokes vectors span all of them, for exp(-i w t)
HALF = math.sqrt(0.5)
PROBES = ((1, 0), (0, 1), (HALF, HALF), (HALF, -1j * HALF))


def fresnel(cos_i, n, kappa=0.0):
    """(r_s, r_p) after Born & Wolf, section 1.5.2; r_p = -r_s at normal incidence."""
    index = complex(n, kappa)
    cos_t = cmath.sqrt(1 - (1 - cos_i**2) / index**2)
    # The transmitted wave must decay
    if (index * cos_t).imag < 0:
        cos_t = -cos_t
    r_s = (cos_i - index * cos_t) / (cos_i + index * cos_t)
    r_p = (index * cos_i - cos_t) / (index * cos_i + cos_t)
    return r_s, r_p


def stokes(e_s, e_p):
    """(I, Q, U, V) of a field along k, seen by the receiver; exp(-i w t).

    V is positive where the field turns clockwise for who looks against k: with e_s to the
    right and e_p up, cos wt to the right and -sin wt up, that is E_p = -i E_s.
    """
    return np.array(
        [
            abs(e_s) ** 2 + abs(e_p) ** 2,
            abs(e_s) ** 2 - abs(e_p) ** 2,
            abs(e_s + e_p) ** 2 / 2 - abs(e_s - e_p) ** 2 / 2,
            abs(e_s + 1j * e_p) ** 2 / 2 - abs(e_s - 1j * e_p) ** 2 / 2,
        ]
    )


def meridian(k, azimuth):
    """e_s = z x k / |z x k|, e_p = k x e_s; on the axis the limit at this azimuth of k."""
    e_s = np.cross([0.0, 0.0, 1.0], k)
    if np.linalg.norm(e_s) < 1e-12:
        e_s = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    e_s = e_s / np.linalg.norm(e_s)
    return e_s, np.cross(k, e_s)


def reflect_field(field, k, normal, n, kappa):
    """Field vector and direction after a facet: split into s and p, scale, reassemble."""
    cos_i = -float(k @ normal)
    out = k + 2 * cos_i * normal
    s = np.cross(k, normal)
    s = np.cross(k, [1.0, 0.3, 0.2]) if np.linalg.norm(s) < 1e-12 else s
    s = s / np.linalg.norm(s)
    r_s, r_p = fresnel(cos_i, n, kappa)
    return r_s * (field @ s) * s + r_p * (field @ np.cross(k, s)) * np.cross(out, s), out


def path_mueller(dir_i, normals, n, kappa=0.0, *, phi_i=0.0, phi_s=None):
    """Mueller matrix (out, in) of a path over facets, in meridian frames; its direction.

    `phi_i`, `phi_s` name the azimuths that stand for beams along z.
    """
    k_in = -np.asarray(dir_i, dtype=float)
    # The incident beam travels towards phi_i + pi
    in_s, in_p = meridian(k_in, phi_i + math.pi)
    sent, received = [], []
    for a, b in PROBES:
        field, k = a * in_s + b * in_p, k_in
        for normal in normals:
            field, k = reflect_field(field, k, np.asarray(normal, dtype=float), n, kappa)
        out_s, out_p = meridian(k, phi_i if phi_s is None else phi_s)
        sent.append(stokes(a, b))
        received.append(stokes(field @ out_s, field @ out_p))
    return np.linalg.solve(np.array(sent), np.array(received)).T, k


def spherical(direction):
    """Zenith and azimuth of a direction."""
    x, y, z = direction
    return math.atan2(math.hypot(x, y), z), math.atan2(y, x) % (2 * math.pi)
