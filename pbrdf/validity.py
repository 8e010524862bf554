"""Where geometric optics stops to hold for a rough surface; warnings, never corrections."""

import numpy as np

from pbrdf.surface import GaussianSurface, MeasuredSurface


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
