"""Where a result is not to be trusted: geometric optics fails, or the tracing lost rays.

Warnings, never corrections.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pbrdf.surface import GaussianSurface, MeasuredSurface

# Size parameter 2 π R / λ from which reflection and refraction hold to 1 %
LEAST_SIZE_PARAMETER = 400.0
# Bandwidth of a filter radiometer, where nothing is known of the detector [um]
BANDWIDTH = 0.01
# Share of the rays that rounding may lose: some in ten million, hazard B4
MOST_LOST = 1e-6


def geometric_optics_warnings(
    surface: GaussianSurface | MeasuredSurface, theta_i: np.ndarray, wavelength: float
) -> list[str]:
    """Say which limits of geometric optics a random surface breaks at a wavelength [um].

    Checks the coherent beam that stays specular, exp(-(4π h cosθ / λ)²) above 1 % (Davies
    1954), and the tangent plane: typical radius of curvature below 5 λ or correlation
    length below λ (Thorsos 1988).
    """
    height = surface.ensemble_height_rms
    length = float(np.min(surface.corr_length))
    found = []
    for theta in theta_i:
        coherent = np.exp(-((4 * np.pi * height * np.cos(theta) / wavelength) ** 2))
        if coherent > 0.01:
            found.append(
                f"At theta_i {np.rad2deg(theta):.4g} deg and {wavelength:g} um, "
                f"{100 * coherent:.2g} % of the light stays in a coherent specular beam "
                "that geometric optics does not know."
            )
    # Rms curvature of the autocorrelation exp(-r²/l²) is 2 √3 h / l²
    radius = length**2 * (1 + 2 * (height / length) ** 2) ** 1.5 / (2 * np.sqrt(3) * height)
    if radius < 5 * wavelength:
        found.append(
            f"The typical radius of curvature, {radius:.3g} um, is below 5 wavelengths of "
            f"{wavelength:g} um: the tangent plane does not hold."
        )
    if length < wavelength:
        found.append(
            f"corr_length {length:.3g} um is below the wavelength {wavelength:g} um."
        )
    return found


def contamination_warnings(
    reports: Sequence[Mapping[str, Any]], wavelength: float, bandwidth: float = BANDWIDTH
) -> list[str]:
    """Say which limits of geometric optics drops, spheres and films break.

    Parameters
    ----------
    reports : sequence of mappings
        What contaminants became, from `pbrdf.surface.place`.
    wavelength, bandwidth : float
        Of the light; films are coherent within its coherence length λ²/Δλ. [um]

    Notes
    -----
    A drop or sphere needs a size parameter 2πR/λ of about 400 for 1 % in reflection and
    refraction, more for rainbows. A film needs 2 n d above three coherence lengths; n is
    taken as 4/3.

    Examples
    --------
    >>> print(*contamination_warnings([{"kind": "film", "thickness": 10.0}], 0.55))
    A film of 10 um is thinner than 34 um, three coherence lengths at 0.55 um and a \
bandwidth of 0.01 um: it interferes, which geometric optics does not know.
    """
    found = []
    for report in reports:
        radius = report.get("curvature_radius")
        if radius is not None and 2 * np.pi * radius < LEAST_SIZE_PARAMETER * wavelength:
            found.append(
                f"The median radius of curvature of {report['kind']}, {radius:.3g} um, has "
                f"a size parameter of {2 * np.pi * radius / wavelength:.3g} at "
                f"{wavelength:g} um; geometric optics holds to 1 % above "
                f"{LEAST_SIZE_PARAMETER:g}, and rainbows need more."
            )
        thickness = report.get("thickness")
        least = 3 * wavelength**2 / (2 * 4 / 3 * bandwidth)
        if thickness is not None and thickness < least:
            found.append(
                f"A film of {thickness:.3g} um is thinner than {least:.2g} um, three "
                f"coherence lengths at {wavelength:g} um and a bandwidth of "
                f"{bandwidth:g} um: it interferes, which geometric optics does not know."
            )
    return found


def lost_ray_warnings(lost: int, rays: int) -> list[str]:
    """Say that more rays were lost by a fault of the tracing than rounding explains.

    Parameters
    ----------
    lost : int
        Rays that fell through the surface or met a boundary from the wrong side.
    rays : int
        Rays traced in all.

    Examples
    --------
    >>> lost_ray_warnings(3, 10_000_000)
    []
    >>> print(*lost_ray_warnings(2000, 16_000))
    2000 of 16000 rays were lost by a fault of the tracing: the result lacks their light, \
do not use it.
    """
    # A lone ray of a short run tells nothing
    if lost <= max(3.0, MOST_LOST * rays):
        return []
    return [
        f"{lost} of {rays} rays were lost by a fault of the tracing: the "
        "result lacks their light, do not use it."
    ]
