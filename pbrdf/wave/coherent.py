"""Mean field of the specular beam to second order in the heights, summed to all heights.

Reduced Rayleigh equations of a surface that light enters or not, in two dimensions with
both polarisations (G. Brown, V. Celli, M. Haller, A. Marvin, Surf. Sci. 136, 381 (1984);
A. Soubret, G. Berginc, C. Bourrely, Phys. Rev. B 63, 245411 (2001)); a profile is the same
with waves in one plane. Lengths are in units of 1/k.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pbrdf.wave.statistics import panels

__all__ = ["MeanField", "Medium", "mean_field"]

Array = np.ndarray

# Widths of the spectrum, in units of 1/l, at which panels of the integral begin
WIDTHS = np.array([0.0, 1.5, 4.0, 8.0, 13.0])
# Evanescent waves beyond this lateral wave vector are left out where a spectrum falls by a
# power law: its integral over finer and finer roughness has no end
FARTHEST_WAVE = 3.0
# Panels of azimuth to a ratio of lengths, and the ratio from which a surface is a profile
FAN, LARGEST_RATIO = 2.0, 50.0


@dataclass(frozen=True)
class Medium:
    """What is below the surface: eps = (n + i kappa)^2, or a perfect conductor."""

    eps: complex
    perfect: bool = False

    @classmethod
    def of(cls, n: float, kappa: float) -> "Medium":
        """Medium of an index; n = inf is the perfect conductor."""
        return cls(1.0 + 0j, True) if np.isinf(n) else cls(complex(n, kappa) ** 2)


@dataclass(frozen=True)
class MeanField:
    """Flat amplitudes (s, p), their second-order change, and 2 (k h cos theta)^2.

    `cross` are the amplitudes from p to s and from s to p, of the second order: of heights
    that differ from direction to direction, unless the plane of incidence is their mirror.
    """

    flat: Array
    second: Array
    cross: Array
    exponent: float
    perfect: bool

    @property
    def amplitudes(self) -> Array:
        """Reflection amplitudes r_s, r_p of the mean field at any height.

        exp(-g) (r (1 + g) + second), which stays finite where r vanishes; for p on a
        perfect conductor, where it does not, the exponential of the second order. Each is
        the better of the two on rigorous profiles. What departs from exp(-g) r is damped
        where it is no small change, and the whole does not exceed a flat surface by it.
        """
        g = self.exponent
        change = self.departure
        damped = change / np.sqrt(1.0 + np.abs(change) ** 4)
        amplitudes = np.exp(-g) * (self.flat + damped)
        if self.perfect:
            amplitudes[1] = self.flat[1] * np.exp(self.second[1] / self.flat[1])
        size = np.abs(amplitudes)
        most = np.maximum(np.abs(self.flat), np.exp(-g) * np.abs(damped))
        return amplitudes * np.minimum(1.0, most / np.maximum(size, 1e-300))

    @property
    def departure(self) -> Array:
        """Second order less that of the Kirchhoff factor, of s and p."""
        return self.second + self.exponent * self.flat

    @property
    def doubt(self) -> float:
        """Largest amplitude by which the beam departs from the Kirchhoff factor."""
        changes = np.abs(np.r_[self.departure, self.cross])
        return float(np.exp(-self.exponent) * changes.max())

    @property
    def jones(self) -> Array:
        """Jones matrix of the mean field, (2, 2); no light gains by being turned."""
        r_s, r_p = self.amplitudes
        turned = self.cross / np.sqrt(1.0 + np.abs(self.cross) ** 4)
        p_to_s, s_to_p = np.exp(-self.exponent) * turned
        whole = np.array([[r_s, p_to_s], [s_to_p, r_p]])
        if not turned.any():
            return whole
        most = max(np.abs(self.flat).max(), np.abs(self.amplitudes).max())
        largest = np.linalg.svd(whole, compute_uv=False)[0]
        return whole * min(1.0, most / max(largest, 1e-300))

    @property
    def dressing(self) -> complex:
        """Logarithm of what one way through the mean field leaves of E_s E_p*.

        Half of what departs from the Kirchhoff factor, times the reflectance: the phase of
        s over p, and what either loses. The other half is that of the way back.
        """
        s, p = 0.5 * self.departure * self.flat.conj()
        # What one gains the other has not lost
        return complex(min(s.real, 0.0) + min(p.real, 0.0), s.imag - p.imag)


@dataclass(frozen=True)
class Waves:
    """Heights as waves of wave number 1 meet them.

    Parameters
    ----------
    height : float
        k h.
    lengths : tuple of float
        k l of the shortest and of the longest direction.
    spectrum : callable
        W at lateral wave vectors (K_x, K_y)/k, x along the propagation of the light.
    dimensions : int
        1 for a profile, 2 for a surface.
    bounded : bool
        Whether the spectrum falls fast enough to need no end.
    mirrored : bool
        Whether the plane of incidence is a mirror of the spectrum.
    """

    height: float
    lengths: tuple[float, float]
    spectrum: Callable[[Array, Array], Array]
    dimensions: int
    bounded: bool
    mirrored: bool = True


def mean_field(sine: float, medium: Medium, heights: Waves) -> MeanField:
    """Mean field of one incidence.

    Parameters
    ----------
    sine : float
        Sine of the incidence. [1]
    medium : Medium
        What is below.
    heights : Waves
        The heights.
    """
    wave, turn, side, weight = _waves(sine, heights)
    spectrum = heights.spectrum(wave * turn - sine, wave * side)
    weight = weight * spectrum / (2 * np.pi) ** heights.dimensions
    cosine = np.sqrt((1.0 - sine) * (1.0 + sine))
    g = 2.0 * (heights.height * cosine) ** 2
    solve = _conductor if medium.perfect else _penetrable
    flat, second, cross = solve(
        sine, cosine, medium.eps, (wave, turn, side, weight), heights.height
    )
    if heights.mirrored:
        cross = np.zeros(2, dtype=complex)
    return MeanField(flat, second, cross, g, medium.perfect)


def _waves(sine: float, heights: Waves) -> tuple[Array, Array, Array, Array]:
    """Lateral wave vectors, cosine and sine of their azimuth, weights of the quadrature.

    Zenith angles of propagating waves and hyperbolic angles of evanescent ones take away
    the square root at the horizon.
    """
    short, long = heights.lengths
    widths = np.unique(np.outer(WIDTHS, [1.0 / short, 1.0 / long]))
    far = sine + widths[-1]
    far = max(far, 1.0) if heights.bounded else FARTHEST_WAVE
    cuts = np.clip(np.r_[sine - widths, sine + widths, 0.0, 1.0], 0.0, far)
    cuts = np.unique(np.r_[cuts, far])
    zenith, step = panels(np.arcsin(cuts[cuts <= 1.0]))
    wave, weight = [np.sin(zenith)], [step * np.cos(zenith)]
    beyond = cuts[cuts >= 1.0]
    if beyond.size > 1:
        steep, step = panels(np.arccosh(beyond))
        wave.append(np.cosh(steep))
        weight.append(step * np.sinh(steep))
    waves, weights = np.concatenate(wave), np.concatenate(weight)
    if heights.dimensions == 1:
        turns = np.repeat([1.0, -1.0], waves.size)
        return np.tile(waves, 2), turns, np.zeros(turns.size), np.tile(weights, 2)
    # Azimuths from that of the incident wave, as narrow as the spectrum seen from there
    span = np.minimum(widths[1:] / max(sine, 1e-9), np.pi)
    edges = np.r_[0.0, span, np.pi]
    if heights.mirrored:
        azimuth, step = panels(np.unique(edges))
        step = 2.0 * step
    else:
        # Seen from the zenith a long spectrum is a narrow fan
        fan = int(np.ceil(FAN * min(long / short, LARGEST_RATIO)))
        edges = np.r_[edges, np.linspace(0.0, np.pi, fan + 1)]
        azimuth, step = panels(np.unique(edges))
        azimuth, step = np.r_[azimuth, -azimuth], np.r_[step, step]
    grid = np.broadcast_to(waves[:, None], (waves.size, azimuth.size))
    turns, sides = (
        np.broadcast_to(part(azimuth), grid.shape).ravel() for part in (np.cos, np.sin)
    )
    return grid.ravel(), turns, sides, ((weights * waves)[:, None] * step).ravel()


# Wave, cosine and sine of its azimuth, weight
Steps = tuple[Array, Array, Array, Array]


def _conductor(
    sine: float, cosine: float, _eps: complex, steps: Steps, _height: float
) -> tuple[Array, Array, Array]:
    """Second order of a perfect conductor: two first-order steps through every wave."""
    wave, turn, side, weight = steps
    normal = np.sqrt(1.0 - wave**2 + 0j)
    through_s = turn**2 * normal * weight
    over = weight / normal
    through_p = (wave * sine - turn) ** 2 * over
    second_s = 2.0 * cosine * (through_s + side**2 * over).sum()
    second_p = -2.0 / cosine * (side**2 * normal * weight + through_p).sum()
    cross = 2.0 * (side * (turn * normal * weight + (wave * sine - turn) * over)).sum()
    flat = np.array([-1.0, 1.0], dtype=complex)
    return flat, np.array([second_s, second_p]), np.array([-cross, cross])


def _penetrable(
    sine: float, cosine: float, eps: complex, steps: Steps, height: float
) -> tuple[Array, Array, Array]:
    """Second order of a medium with finite eps from the reduced Rayleigh equations.

    M+-(u|p) = [[c, -+ b x], [a x, u p +- a b c]] in (s, p), with c, x the cosine and sine
    from u to p, b the normal component of p outside and a that of u inside.
    """
    wave, turn, side, weight = steps
    outside, inside = np.sqrt(1.0 - wave**2 + 0j), np.sqrt(eps - wave**2)
    b, a = complex(cosine), np.sqrt(eps - sine**2)
    flat = np.array([(b - a) / (b + a), (eps * b - a) / (eps * b + a)])
    r_s, r_p = flat
    side2 = side**2

    # First order into every wave from s (with side = x) and from p: i (a - b) M+^-1 (...)
    gap = 1j * (inside - outside)
    norm_p = wave**2 + inside * outside
    s_to_s = gap * turn * (1.0 + r_s)
    s_to_p = gap * inside * (1.0 + r_s) / norm_p
    p_to_s = gap * b * (1.0 - r_p)
    up, down = wave * sine + inside * b * turn, wave * sine - inside * b * turn
    p_to_p = gap * (down + up * r_p) / norm_p

    # Back into the specular beam; the sine of the azimuth changes sign on the way back
    onward = wave * sine + a * outside * turn
    back_s = turn * s_to_s + outside * side2 * s_to_p
    back_p = -a * side2 * p_to_s + onward * p_to_p
    norm_s, norm_p0 = 1.0, sine**2 + a * b
    half = 0.5 * height**2
    direct_s = half * ((a + b) + (a - b) * r_s)
    direct_p = half * ((a + b) * (sine**2 - a * b) + (a - b) * norm_p0 * r_p)
    second_s = (a - b) / norm_s * (direct_s + 1j * (weight * back_s).sum())
    second_p = (a - b) / norm_p0 * (direct_p + 1j * (weight * back_p).sum())
    # From the wave to the beam the azimuth turns by -side
    odd = -side * weight
    to_s = (odd * (turn * p_to_s + outside * p_to_p)).sum()
    to_p = (odd * (onward * s_to_p - a * s_to_s)).sum()
    # One is minus the other, by reciprocity; the quadrature leaves a difference
    cross = 0.5j * (a - b) * (to_s / norm_s - to_p / norm_p0)
    return flat, np.array([second_s, second_p]), np.array([cross, -cross])
