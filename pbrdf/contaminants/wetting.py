"""Contact angles: from surface energies, and on rough surfaces."""

from typing import Any

import numpy as np
import numpy.typing as npt

from pbrdf.contaminants.arguments import positive
from pbrdf.contaminants.ground import Ground
from pbrdf.errors import percent, require
from pbrdf.surface.gaussian import GaussianSurface
from pbrdf.surface.heightmap import HeightMap

# Surface tension of water at 20 °C in mN/m (IAPWS), and sqrt(γ / ρ g) with ρ = 998.2 kg/m³
WATER_TENSION = 72.75
WATER_CAPILLARY_LENGTH = 2725.7
# Nodes of the Gauss-Hermite rule over each slope
_NODES = 60


def young_contact_angle(
    *, gamma_sv: npt.ArrayLike, gamma_sl: npt.ArrayLike, gamma_lv: npt.ArrayLike
) -> np.ndarray:
    """Contact angle on a smooth solid: cos θ = (γ_SV - γ_SL) / γ_LV. [rad]

    Parameters
    ----------
    gamma_sv, gamma_sl, gamma_lv : array_like
        Energies of the solid-vapour, solid-liquid and liquid-vapour interface, in one unit.

    Returns
    -------
    ndarray
        0 where the liquid spreads and π where it does not wet at all. [rad]

    Examples
    --------
    >>> round(float(np.degrees(young_contact_angle(gamma_sv=40, gamma_sl=22.0,
    ...                                            gamma_lv=72.75))), 2)
    75.67
    """
    solid = [
        require(name, value, lambda v: (v >= 0) & np.isfinite(v), "be >= 0", "Energies.")
        for name, value in (("gamma_sv", gamma_sv), ("gamma_sl", gamma_sl))
    ]
    liquid = require(
        "gamma_lv", gamma_lv, lambda v: (v > 0) & np.isfinite(v), "be positive",
        "Water has 72.75 mN/m at 20 °C.",
    )  # fmt: skip
    cosine = (solid[0] - solid[1]) / liquid
    found: np.ndarray = np.arccos(np.clip(cosine, -1.0, 1.0))
    return found


def wenzel_factor(surface: HeightMap | GaussianSurface | Any) -> float:
    """Compute the true area of a surface over its projected area. [1]

    Of a Gaussian surface the ensemble mean, from the slopes of its facets; for equal slopes
    s it is 1 + s √(π/2) exp(1/2s²) erfc(1/(s√2)). Of a height map that of its facets; of
    another random surface that of one sample.

    Examples
    --------
    >>> surface = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=8, slope_rms=0.3)
    >>> round(wenzel_factor(surface), 4)
    1.0835
    """
    if isinstance(surface, HeightMap):
        return Ground(surface).wenzel_factor
    if not isinstance(surface, GaussianSurface):
        return Ground(surface.sample(0)).wenzel_factor
    nodes, weights = np.polynomial.hermite_e.hermegauss(_NODES)
    along_x, along_y = surface.facet_slope_rms
    squared = (along_x * nodes[:, None]) ** 2 + (along_y * nodes[None, :]) ** 2
    mean = weights @ np.sqrt(1.0 + squared) @ weights / weights.sum() ** 2
    return float(mean)


def wenzel_contact_angle(contact_angle: float, factor: float) -> float:
    """Apparent angle on a surface wetted throughout: cos θ* = r cos θ. [rad]

    0 where the liquid wets completely, π where it does not wet (Wenzel 1936).

    Examples
    --------
    >>> [round(float(np.degrees(wenzel_contact_angle(np.deg2rad(15), r))), 2)
    ...  for r in (1.0024907, 1.0835)]
    [14.46, 0.0]
    """
    return float(np.arccos(np.clip(factor * np.cos(contact_angle), -1.0, 1.0)))


def cassie_contact_angle(contact_angle: float, solid_fraction: float) -> float:
    """Apparent angle on tops of a texture: cos θ* = φ (cos θ + 1) - 1. [rad]

    Cassie & Baxter 1944, with air under the rest of the drop.

    Examples
    --------
    What a solid of 119 degrees needs for 179 degrees is 0.03 % of contact:

    >>> round(float(np.degrees(cassie_contact_angle(np.deg2rad(119.0), 2.96e-4))), 2)
    179.0
    """
    share = positive("solid_fraction", solid_fraction, "1")
    if share > 1.0:
        msg = f"solid_fraction must lie in (0, 1] [1], got {share:g}. 1 is full contact."
        raise ValueError(msg)
    return float(np.arccos(np.clip(share * (np.cos(contact_angle) + 1.0) - 1.0, -1.0, 1.0)))


def hemiwicking_angle(factor: float, solid_fraction: float = 0.0) -> float:
    """Angle below which liquid invades a texture: cos θ_c = (1 - φ) / (r - φ). [rad]

    Bico, Thiele & Quéré, Colloids Surf. A 206, 41 (2002). `solid_fraction` is what stays
    dry on the tops; none on a surface without plateaus.
    """
    if factor <= 1.0:
        return 0.0
    return float(np.arccos((1.0 - solid_fraction) / (factor - solid_fraction)))


# A facet steeper than the contact angle holds no drop; more of them than this are reported
_STEEP_SHARE = 0.01
# Change of the contact angle by roughness that is reported. On smooth coatings already a
# drop rests at any angle between the receding and the advancing one; of 10 degrees between
# them, which is little, this is half: a smaller change nobody could tell [rad]
_CHANGE = np.deg2rad(5.0)


def effective_contact_angle(
    contact_angle: float, ground: Ground, roughness: str
) -> tuple[float, list[str]]:
    """Contact angle to lay drops with, and what roughness has against it.

    `roughness` is "wenzel" to apply Wenzel's law, "warn" to say what it would do, "ignore"
    for neither.
    """
    if roughness == "ignore" or ground.flat or contact_angle == 0.0:
        return contact_angle, []
    rough = wenzel_contact_angle(contact_angle, ground.wenzel_factor)
    if roughness == "wenzel":
        return rough, []
    degrees = f"{np.rad2deg(contact_angle):.4g} deg"
    notes = []
    if rough == 0.0:
        notes.append(
            f"A contact angle of {degrees} is below {_critical(ground):.3g} deg, where "
            "liquid invades this roughness: it would spread to a film."
        )
    elif abs(rough - contact_angle) > _CHANGE:
        notes.append(
            f"By Wenzel's law roughness turns a contact angle of {degrees} into "
            f"{np.rad2deg(rough):.4g} deg; it is taken as the apparent one."
        )
    steep = ground.steep_share(np.tan(contact_angle)) if contact_angle < np.pi / 2 else 0.0
    if steep > _STEEP_SHARE:
        notes.append(
            f"{percent(steep)} of the surface is steeper than the contact angle of "
            f"{degrees}: drops fill valleys and are no caps."
        )
    return contact_angle, notes


def _critical(ground: Ground) -> float:
    return float(np.rad2deg(hemiwicking_angle(ground.wenzel_factor)))
