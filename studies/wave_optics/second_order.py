"""What would exact second order change? Run `python -m studies.wave_optics.second_order`.

The curvature form of profiles with a filter D(xi) that gives first and second order in the
heights exactly: D = d + (E - d(xi) - d(K - xi))/2, where the exact second order through the
wave k0 + xi or k - xi has the kernel -q² (b_KA + E)/2. Glass only: surface waves of metals
need more than second order. Nothing of `pbrdf` uses it.
"""

import numpy as np

from pbrdf.kernels.wave.profile import fill_changes, fill_profile
from tests import wave_reference

K, INDEX, STEEPEST = 2 * np.pi, 1.5, 0.45
# Panels of wave vectors and lags
SHIFTS, FARTHEST = 1201, 6.0
CASES = [(0.05, 0.5), (0.1, 0.5), (0.1, 1.0), (0.2, 1.0), (0.2, 2.0), (0.4, 2.0)]


def through(out, wave, into):
    """Second-order kernel from `into` over `wave` to `out` of s and p (lateral, k = 1).

    Reduced Rayleigh equations, expanded: R2(p) = Int R2(p, q, k) h(p - q) h(q - k) dq/2pi.
    """
    b_out, b, b_in = (np.sqrt(1 - np.asarray(x) ** 2 + 0j) for x in (out, wave, into))
    a_out, a, a_in = (
        np.sqrt(INDEX**2 - np.asarray(x) ** 2 + 0j) for x in (out, wave, into)
    )
    r_s = (b_in - a_in) / (b_in + a_in)
    r_p = (INDEX**2 * b_in - a_in) / (INDEX**2 * b_in + a_in)
    step_s = 1j * (a - b) * (r_s + 1)
    step_p = 1j * (a - b) / (wave * wave + a * b)
    step_p = step_p * ((wave * into + a * b_in) * r_p + wave * into - a * b_in)
    up, down = a_out - b_in, a_out + b_in
    s = (a_out - b_out) * (0.5 * (up * r_s + down) + 1j * step_s)
    p = (
        0.5 * (up * (out * into + a_out * b_in) * r_p + down * (out * into - a_out * b_in))
        + 1j * (out * wave + a_out * b) * step_p
    )
    return np.stack([s, (a_out - b_out) / (out * out + a_out * b_out) * p], axis=-1)


def changes(into, out, shifts):
    """First-order less tangent-plane kernel of s and p at shifts about the mean wave."""
    found = np.empty((1, shifts.size, 2), dtype=complex)
    indices = np.array([[INDEX], [0.0]])
    fill_changes(np.array([into]), np.array([out]), indices, shifts[None, :], found)
    return found[0]


def scattering(height, length, theta, view, *, exact):
    """Power per radian of s and p at one incidence, (N, 2)."""
    height, length = K * height, K * length
    shift = np.linspace(-12, 12, SHIFTS) / length + 1e-7
    density = height**2 * np.sqrt(np.pi) * length * np.exp(-((shift * length) ** 2) / 4)
    density *= (shift[1] - shift[0]) / K
    step = min(0.25 * np.pi * length / 12, 0.25)
    lag = np.arange(-FARTHEST * length, FARTHEST * length + step, step)
    waves = np.exp(1j * np.outer(lag, shift))
    rho = np.exp(-((lag / length) ** 2))
    out = np.empty((view.size, 2))
    into = np.sin(theta)
    for i, angle in enumerate(view):
        leave = np.sin(angle)
        four, shadow = np.empty((1, 4), dtype=complex), np.empty(1)
        fill_profile(
            np.array([into]), np.array([leave]), np.array([[INDEX], [0.0]]),
            np.array([np.sqrt(2) * height / length]), four, shadow,
        )  # fmt: skip
        plane, q, across = four[0, 2:], np.cos(theta) + np.cos(angle), leave - into
        filtered = changes(into, leave, np.abs(shift))
        if exact:
            both = through(leave, into + shift, into) + through(leave, leave - shift, into)
            lacking = 0.5 * both / (np.cos(theta) * q) - plane - filtered
            filtered = filtered + 0.5 * (
                lacking - changes(into, leave, np.abs(across - shift))
            )
        weighted = density[:, None] * filtered
        moving, still = waves @ weighted, weighted.sum(0)
        there, back = (plane - q**2 * (still - part) for part in (moving, moving[::-1]))
        pairs = waves @ (density[:, None] * np.abs(filtered) ** 2)
        rough = np.exp(-((q * height) ** 2) * (1 - rho))[:, None]
        calm = np.exp(-((q * height) ** 2)) * np.abs(plane - q**2 * still) ** 2
        whole = rough * (there * back.conj() + q**2 * pairs) - calm
        power = (np.exp(-1j * across * lag) @ whole).real * step
        factor = 2 / np.pi * np.cos(angle) ** 2 * np.cos(theta) / q**2 * shadow[0]
        out[i] = factor * power
    return out


def main() -> None:
    print("n = 1.5: height, length, incidence; rms error of s and p [dB], mean error of s")
    print("at zeniths 65 to 80 [dB], by the curvature form and with exact second order")
    for (height, length, theta), group in wave_reference.table("n1.5").groupby(
        wave_reference.CASE
    ):
        if (height, length) not in CASES:
            continue
        by = {p: rows.sort_values("theta_s_deg") for p, rows in group.groupby("pol")}
        view = np.deg2rad(by["s"].theta_s_deg.to_numpy(dtype=float))
        angles, weights = wave_reference.beam(theta, 3)
        true = by["s"].mdrc_incoherent.to_numpy()
        low = (np.abs(view) > np.deg2rad(65)) & (np.abs(view) < np.deg2rad(80))
        low &= true > 0.01 * true.max()
        said = []
        for exact in (False, True):
            found = sum(
                weight * scattering(height, length, angle, view, exact=exact)
                for angle, weight in zip(angles, weights, strict=True)
            )
            both = [wave_reference.decibels(found[:, i], by[p]) for i, p in enumerate("sp")]
            beyond = 10 * np.log10(np.maximum(found[low, 0], 1e-300) / true[low])
            mean = f"{beyond.mean():+.1f}" if low.any() else "dark"
            said.append(f"{both[0]:.2f} {both[1]:.2f} {mean}")
        print(f"{height} {length} {theta}: {said[0]} | {said[1]}", flush=True)


if __name__ == "__main__":
    main()
