"""Rigorous scattering of one-dimensional surfaces by surface integral equations.

Shares nothing with the forms of `pbrdf.wave`. The wavelength is 1, the time factor
exp(-i w t), a beam of Gaussian profile falls on a piece of the surface. Trapezoid rule with
the corrections of A. Sidi and M. Israeli, J. Sci. Comput. 3, 201 (1988), for logarithms.
Strong absorbers and conductors have the impedance of a plane, an error of 1/(2 |N|^2).
"""

from dataclasses import dataclass

import numpy as np
from scipy import special

K = 2 * np.pi
# Derivative of Riemann's zeta at -2
ZETA = -0.03044845705839327
# Length of a surface, waist of the beam (as of the tables), step
LENGTH, WAIST, STEP = 40.0, 8.0, 1.0 / 12.0
# Half-width of the beam's spectrum in standard deviations, and plane waves in it
WIDTHS, PLANE_WAVES = 4.5, 129
# Index above which a wave inside is gone within a fraction of the step
ABSORBING = 1.5
# Surfaces that give the mean of the control variate
MANY = 4000


@dataclass(frozen=True)
class Profile:
    """Heights with slopes and curvatures at the nodes x."""

    x: np.ndarray
    height: np.ndarray
    slope: np.ndarray
    curvature: np.ndarray


def draw(rng, spectrum) -> Profile:
    """Gaussian profile of a two-sided spectrum W(K) with variance Int W dK/2pi."""
    count = int(LENGTH / STEP)
    whole = 4 * count
    wave = K * np.fft.rfftfreq(whole, STEP)
    amplitude = np.sqrt(np.maximum(spectrum(wave), 0.0) * whole / STEP)
    noise = rng.standard_normal(wave.size) + 1j * rng.standard_normal(wave.size)
    noise *= amplitude / np.sqrt(2)
    noise[0] = noise[0].real * np.sqrt(2)
    parts = [np.fft.irfft(noise * (1j * wave) ** p, whole)[:count] for p in range(3)]
    return Profile((np.arange(count) - 0.5 * count + 0.5) * STEP, *parts)


def layers(profile: Profile, k) -> tuple[np.ndarray, np.ndarray]:
    """Matrices of the single and the double layer of wave number k."""
    x, h, slope = profile.x, profile.height, profile.slope
    across, up = x[:, None] - x, h[:, None] - h
    apart = np.hypot(across, up)
    np.fill_diagonal(apart, 1.0)
    zero, one = (special.hankel1(n, k * apart) for n in (0, 1))
    arc = np.sqrt(1 + slope**2)
    single = 0.25j * zero * arc * STEP
    double = 0.25j * k * one / apart * (up - slope * across) * STEP
    at = np.arange(x.size)
    log = np.log(0.5 * k * arc) + np.euler_gamma + np.log(STEP / K)
    own = 0.25j - log / K
    single[at, at] = STEP * arc * (own + 2 * ZETA / K)
    double[at, at] = profile.curvature / (2 * K * arc**2) * STEP
    beside = at[:-1]
    near = -special.j0(np.real(k) * apart[beside, beside + 1]) / K
    single[beside, beside + 1] += ZETA * STEP * near * arc[1:]
    single[beside + 1, beside] += ZETA * STEP * near * arc[:-1]
    return single, double


def sources(profile: Profile, index, incident: np.ndarray) -> list[tuple]:
    """Field and normal derivative on the surface, of s and of p, for incident columns."""
    single, double = layers(profile, K)
    half = 0.5 * np.eye(profile.x.size)
    if np.isinf(index) or np.imag(index) > ABSORBING:
        inverse = 0.0 if np.isinf(index) else 1.0 / index
        found = []
        for field, derivative in ((1j * inverse / K, 1.0), (1.0, -1j * K * inverse)):
            system = (half - double) * field + single * derivative
            strength = np.linalg.solve(system, incident)
            found.append((field * strength, derivative * strength))
        return found
    inner, twice = layers(profile, K * index)
    found = []
    for ratio in (1.0, index**2):
        system = np.block([[half - double, single], [half + twice, -ratio * inner]])
        both = np.linalg.solve(system, np.concatenate([incident, 0 * incident]))
        found.append((both[: profile.x.size], both[profile.x.size :]))
    return found


class Beam:
    """Beam of one incidence [rad], as plane waves."""

    def __init__(self, theta: float) -> None:
        self.lateral = K * np.sin(theta)
        steps = np.linspace(-WIDTHS, WIDTHS, PLANE_WAVES) * np.sqrt(2) / WAIST * np.sqrt(2)
        waves = self.lateral + steps
        inside = np.abs(waves) < K
        self.waves, self.step = waves[inside], steps[1] - steps[0]
        self.weights = np.exp(-(((self.waves - self.lateral) * WAIST) ** 2) / 4)
        normal = np.sqrt(K**2 - self.waves**2)
        self.power = (self.weights**2 * normal).sum() * self.step / K

    def on(self, profile: Profile) -> np.ndarray:
        """Incident field on a surface."""
        normal = np.sqrt(K**2 - self.waves**2)
        phase = np.outer(profile.x, self.waves) - np.outer(profile.height, normal)
        return np.exp(1j * phase) @ self.weights * self.step / K

    def simple(self, profile: Profile, waves: np.ndarray) -> np.ndarray:
        """Phase integral of the surface, times exp(-i a x - i b h) that is given."""
        normal = np.sqrt(K**2 - self.lateral**2)
        shape = np.exp(-((profile.x / WAIST) ** 2) + 1j * self.lateral * profile.x)
        return waves @ (shape * np.exp(-1j * normal * profile.height)) * STEP


def outgoing(profile: Profile, view: np.ndarray) -> np.ndarray:
    """Conjugate plane waves that leave at angles, on the surface."""
    along, up = K * np.sin(view), K * np.cos(view)
    phase = np.outer(along, profile.x) + np.outer(up, profile.height)
    return np.exp(-1j * phase)


def amplitudes(profile: Profile, index, beams, view: np.ndarray) -> np.ndarray:
    """Plane waves that the surface sends to angles, (beams, s and p, views)."""
    incident = np.stack([beam.on(profile) for beam in beams], axis=1)
    leaving = outgoing(profile, view) * STEP
    along, up = K * np.sin(view)[:, None], K * np.cos(view)[:, None]
    of_field = -1j * (up - along * profile.slope) * leaving
    of_derivative = np.sqrt(1 + profile.slope**2) * leaving
    found = [
        0.5j / up * (of_field @ field - of_derivative @ derivative)
        for field, derivative in sources(profile, index, incident)
    ]
    return np.moveaxis(np.array(found), -1, 0)


def scattering(spectrum, index, thetas, view, count, *, seed=1, many=MANY):
    """Incoherent power per radian, and its standard error: (incidences, views, 4).

    s, p, Re and Im of <F_s F_p*>. Each surface is seen from both sides; the phase integral
    of the same surface is a control variate. `view` must be symmetric about 0.
    """
    rng = np.random.default_rng(seed)
    beams = [Beam(sign * theta) for theta in thetas for sign in (1, -1)]
    fields = np.empty((count, len(beams), 2, view.size), dtype=complex)
    control = np.empty((count, len(beams), view.size), dtype=complex)
    for k in range(count):
        profile = draw(rng, spectrum)
        fields[k] = amplitudes(profile, index, beams, view)
        leaving = outgoing(profile, view)
        control[k] = [beam.simple(profile, leaving) for beam in beams]
    others = np.empty((many, len(beams), view.size), dtype=complex)
    for row in others:
        profile = draw(rng, spectrum)
        leaving = outgoing(profile, view)
        row[:] = [beam.simple(profile, leaving) for beam in beams]
    # Both sides are one
    for one in (fields, control, others):
        one[:, 1::2] = one[:, 1::2, ..., ::-1].copy()
    centre = others.mean(0)
    truth = (np.abs(others - centre) ** 2).mean(0).reshape(-1, 2, view.size).mean(1)
    simple = np.abs(control - centre) ** 2
    simple = simple.reshape(count, -1, 2, view.size).mean(2)
    fields = (fields - fields.mean(0)) * np.sqrt(count / (count - 1))
    s, p = fields[:, :, 0], fields[:, :, 1]
    cross = s * p.conj()
    parts = np.stack([abs(s) ** 2, abs(p) ** 2, cross.real, cross.imag], axis=-1)
    parts = parts.reshape(count, -1, 2, view.size, 4).mean(2)
    known = (simple - simple.mean(0))[..., None]
    slope = ((parts - parts.mean(0)) * known).sum(0) / (known**2).sum(0)
    parts = parts - slope * (simple - truth)[..., None]
    power = np.array([beam.power for beam in beams[::2]])
    scale = (K * np.cos(view)) ** 2 / K / power[:, None]
    error = parts.std(0, ddof=1) / np.sqrt(count)
    return parts.mean(0) * scale[..., None], error * scale[..., None]
