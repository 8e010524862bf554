"""What facets of a Gaussian surface show on average, none of them hidden, by their law.

Which facets join two cones is a matter of slopes alone, and how often facets have which is
known exactly. So the light that a realisation would show if no facet hid another differs
from its known mean by the noise of this realisation's slopes, and nothing else.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import erfc

from pbrdf.conventions import direction
from pbrdf.kernels.sights.light import SlopeLaw
from pbrdf.observation.look import Look
from pbrdf.simulation.singles.ensemble import facet_ensemble
from pbrdf.surface import GaussianSurface, Surface

__all__ = ["Expected", "expected_of"]

# Rings of points in a cone, doubled until the mean over both cones changes by less than
# this part; where that is not reached nothing is taken off
FEWEST_RINGS, MOST_RINGS, CHANGE = 3, 12, 1e-6
# Local incidence up to which facets show all of both cones [rad]
STEEPEST = np.deg2rad(85.0)
# Azimuths of an average over the circle, exact for a law that changes as cos 2 phi
AZIMUTHS = 8


@dataclass(frozen=True, kw_only=True)
class Expected:
    """Means known beforehand, by geometry.

    Attributes
    ----------
    light : ndarray, shape (geometries,)
        Reading if every facet reflected all and none were hidden. [1/sr]
    seen : ndarray, shape (geometries,)
        Share of it that Smith's height-correlated rule leaves in sight; 0 where nothing is
        known. [1]
    """

    light: np.ndarray
    seen: np.ndarray


def expected_of(surface: Surface, look: Look, *, wanted: bool) -> Expected | None:
    """Return what is known of a look at realisations of a surface, where it helps."""
    if (
        not wanted
        or not isinstance(surface, GaussianSurface)
        or look.estimator not in ("facets", "paths")
        or min(surface.facet_slope_rms) == 0.0
    ):
        return None
    law = facet_ensemble(surface).law
    found = np.array([_of_geometry(law, look, g) for g in range(look.size)])
    light, seen = found.T
    return Expected(light=light, seen=seen) if seen.any() else None


def _of_geometry(law: SlopeLaw, look: Look, g: int) -> tuple[float, float]:
    """Mean light of one geometry, and the share in sight."""
    theta_i, theta_s, dphi = look.theta_i[g], look.theta_s[g], look.dphi[g]
    to_i, to_s = np.array(direction(theta_i, 0.0)), np.array(direction(theta_s, dphi))
    beta = 0.5 * np.arccos(np.clip(to_i @ to_s, -1.0, 1.0))
    if beta + look.source + look.detector > STEEPEST:
        return 0.0, 0.0
    azimuths = np.array([look.phi_i])
    if look.phi_i is None:
        azimuths = np.arange(AZIMUTHS) * (2.0 * np.pi / AZIMUTHS)
    rings, light, change = FEWEST_RINGS, 0.0, np.inf
    while change > CHANGE * light:
        if rings > MOST_RINGS:
            return 0.0, 0.0
        before = light
        light = _mean(law, look, g, azimuths, rings)
        change, rings = abs(light - before), 2 * rings
    hidden = [
        _overhang(law, theta_i, phi) + _overhang(law, theta_s, phi + dphi)
        for phi in azimuths
    ]
    return light, float(np.mean(1.0 / (1.0 + np.array(hidden))))


def _mean(law: SlopeLaw, look: Look, g: int, azimuths: np.ndarray, rings: int) -> float:
    """Mean over both cones: a facet of slopes s shows p(s) / (4 n_z⁴) for each pair."""
    i_x, i_y, i_z, i_w = _cone(look.theta_i[g], 0.0, look.source, rings)
    s_x, s_y, s_z, s_w = _cone(look.theta_s[g], look.dphi[g], look.detector, rings)
    x, y = i_x[:, None] + s_x, i_y[:, None] + s_y
    z = i_z[:, None] + s_z
    # The normal is along the half vector, and the slopes are minus its lean
    x, y = -x / z, -y / z
    factor = i_w[:, None] * s_w * (1.0 + x * x + y * y) ** 2 / 4.0
    total = 0.0
    for phi in azimuths:
        a, b = x * np.cos(phi) - y * np.sin(phi), x * np.sin(phi) + y * np.cos(phi)
        square = law.inv_xx * a * a + 2.0 * law.inv_xy * a * b + law.inv_yy * b * b
        total += float((factor * np.exp(-0.5 * square)).sum())
    omega_i, omega_s = look.solid_angles()
    return law.norm * total / len(azimuths) / float(omega_i[g] * omega_s[g])


def _cone(
    theta: float, phi: float, half: float, rings: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Directions over a cone, and their weights, the parts of its solid angle. [sr]"""
    x, w = np.polynomial.legendre.leggauss(rings)
    height = np.sin(0.5 * half) ** 2
    # Equal steps of 1 - cos are equal solid angles
    lift = height * (1.0 + x)
    turns = 4 * rings
    angle = (np.arange(turns) + 0.5) * (2.0 * np.pi / turns)
    along = np.sqrt(lift * (2.0 - lift))[:, None] * np.cos(angle)
    across = np.sqrt(lift * (2.0 - lift))[:, None] * np.sin(angle)
    up = np.broadcast_to(1.0 - lift[:, None], along.shape)
    forward = up * np.sin(theta) + along * np.cos(theta)
    weight = np.broadcast_to((2.0 * np.pi * height / turns) * w[:, None], along.shape)
    return (
        (forward * np.cos(phi) - across * np.sin(phi)).ravel(),
        (forward * np.sin(phi) + across * np.cos(phi)).ravel(),
        (up * np.cos(theta) - along * np.sin(theta)).ravel(),
        weight.ravel(),
    )


def _overhang(law: SlopeLaw, theta: float, phi: float) -> float:
    """Smith's Lambda of a direction above slopes of the law."""
    c, s = np.cos(phi), np.sin(phi)
    variance = law.xx * c * c + 2.0 * law.xy * c * s + law.yy * s * s
    nu = np.cos(theta) / max(np.sqrt(2.0 * variance) * np.sin(theta), 1e-30)
    if nu > 27.0:
        return 0.0
    return float(0.5 * (np.exp(-nu * nu) / (nu * np.sqrt(np.pi)) - erfc(nu)))
