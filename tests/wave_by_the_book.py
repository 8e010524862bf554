"""First order and tangent plane, written from the books with vectors; shares no code.

Fields are vectors, directions those of propagation, the time factor exp(-i w t).
"""

import numpy as np

UP = np.array([0.0, 0.0, 1.0])


def frame(direction, azimuth):
    """e_s = z x k/|z x k| and e_p = k x e_s; the azimuth stands for beams along z."""
    e_s = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    return e_s, np.cross(direction, e_s)


def beams(theta_i, theta_s, dphi):
    """Propagation vectors in and out, and their azimuths."""
    azimuth_in, azimuth_out = np.pi, dphi
    k_in = np.array([-np.sin(theta_i), 0.0, -np.cos(theta_i)])
    lateral = np.sin(theta_s) * np.array([np.cos(dphi), np.sin(dphi), 0.0])
    return k_in, lateral + np.cos(theta_s) * UP, azimuth_in, azimuth_out


def fresnel(cosine, index):
    """Amplitudes r_s, r_p of Born and Wolf, 1.5.2."""
    inside = np.sqrt(1 - (1 - cosine**2) / index**2 + 0j)
    r_s = (cosine - index * inside) / (cosine + index * inside)
    return r_s, (index * cosine - inside) / (index * cosine + inside)


def first_order(theta_i, theta_s, dphi, index):
    """First-order kernel as a Jones matrix, from Lorentz's reciprocity.

    A thin step in height is a sheet of polarisation current (eps - 1) E in the field of the
    flat interface. What it radiates in one direction is its product with the field of a
    test wave that comes from there. Tangential E is continuous; of the normal parts one is
    that inside, E_z/eps.
    """
    k_in, k_out, azimuth_in, azimuth_out = beams(theta_i, theta_s, dphi)
    driven = fields(k_in, azimuth_in, index, falling=True)
    tests = fields(k_out, azimuth_out, index, falling=False)
    jones = np.empty((2, 2), dtype=complex)
    for j, field in enumerate(driven):
        for i, test in enumerate(tests):
            jones[i, j] = test[:2] @ field[:2] + test[2] * field[2] / index**2
    return (index**2 - 1) * jones / (4 * k_out[2] * -k_in[2])


def fields(k, azimuth, index, *, falling):
    """Field on the flat interface of unit s and p waves that fall in along k (or leave)."""
    other = k * [1, 1, -1]
    r_s, r_p = fresnel(-k[2] if falling else k[2], index)
    (e_s, e_p), (m_s, m_p) = frame(k, azimuth), frame(other, azimuth)
    return e_s + r_s * m_s, e_p + r_p * m_p


def stokes(e_s, e_p):
    """Stokes vector of a field, V = 2 Im(E_s E_p*)."""
    cross = e_s * np.conj(e_p)
    return np.array(
        [abs(e_s) ** 2 + abs(e_p) ** 2, abs(e_s) ** 2 - abs(e_p) ** 2,
         2 * cross.real, 2 * cross.imag]
    )  # fmt: skip


def mueller(jones):
    """Mueller matrix of a Jones matrix, by sending four polarisations through it."""
    probes = [(1, 0), (0, 1), (1, 1), (1, -1j)]
    sent = np.array([stokes(*p) for p in probes])
    received = np.array([stokes(*(jones @ p)) for p in probes])
    return np.linalg.solve(sent, received).T


def gaussian_first_order(theta_i, theta_s, dphi, wavelength, index, height, length):
    """Mueller BRDF (16 pi^2/lambda^4) cos_i cos_s |b|^2 S(f) of Gaussian statistics."""
    k_in, k_out, _, _ = beams(theta_i, theta_s, dphi)
    frequency = np.hypot(*(k_out - k_in)[:2]) / wavelength
    density = np.pi * height**2 * length**2 * np.exp(-((np.pi * frequency * length) ** 2))
    factor = 16 * np.pi**2 / wavelength**4 * np.cos(theta_i) * np.cos(theta_s)
    return factor * density * mueller(first_order(theta_i, theta_s, dphi, index))
