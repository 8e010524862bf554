"""How far a computed power may be from the truth, by what rigorous solutions have shown.

The forms disagree where they fail, and light that leaves or comes along a slope is hidden
or scattered twice in ways that none knows. On rigorous profiles (study `wave_optics`,
tables and fresh cases) the error of "auto" holds the true power of a direction as a
standard error should: 68 % of them or more, and 95 % within twice its value. Those tables
have lengths of half a wavelength or more. Finer roughness lowers the mean field near the
surface in ways that the forms know to second order only; on rigorous profiles of a fifth
and a tenth of a wavelength (`studies.wave_optics.fine`) the error follows k h^2 times the
mean wave vector of what is finer than the wave.
"""

import numpy as np

__all__ = ["MOST", "OF_FINE", "relative_error"]

Array = np.ndarray

# Errors in dB that remain where all forms agree
FLOOR = 0.04
# Shares of the differences to the order-weighted form and to the tangent plane
OF_ORDERS, OF_PLANE = 0.5, 0.2
# Light of second bounces, in dB over the fourth power of the rms slope
OF_BOUNCES = 8.0
# Hiding and second order near the horizon, in dB over slope times tangent of the zenith
OF_GRAZING = 1.2
# Roughness finer than the wave, in dB over k h^2 times its mean wave vector
OF_FINE = 10.0
# Largest zenith of the rigorous solutions; nothing is known of lower rays [rad]
LARGEST_ZENITH = np.deg2rad(80.0)
# What two results differ by at the most, where one has nothing [dB]
MOST = 60.0


def relative_error(
    found: Array, best: Array, orders: Array, plane: Array, slope: Array, fine: Array,
    zenith: Array,
) -> Array:  # fmt: skip
    """Estimate the standard error of a power over the power itself.

    Parameters
    ----------
    found, best, orders, plane : ndarray
        Power by the form asked for, by "auto", "order-weighted" and "kirchhoff".
    slope : ndarray
        Rms slope. [1]
    fine : ndarray
        `Scattering.fineness`. [1]
    zenith : ndarray
        The larger of those of source and detector. [rad]
    """
    steep = slope * np.tan(np.minimum(zenith, LARGEST_ZENITH))
    error = np.sqrt(
        FLOOR**2
        + (OF_ORDERS * decibels(best, orders)) ** 2
        + (OF_PLANE * decibels(best, plane)) ** 2
        + (OF_BOUNCES * slope**4) ** 2
        + (OF_FINE * fine) ** 2
        + (OF_GRAZING * steep**2) ** 2 / (1.0 + steep**2)
        + decibels(best, found) ** 2
    )
    return 10 ** (np.minimum(error, MOST) / 10) - 1.0


def decibels(one: Array, other: Array) -> Array:
    """Difference of two powers in dB."""
    ratio = np.maximum(one, 1e-300) / np.maximum(other, 1e-300)
    return np.minimum(np.abs(10 * np.log10(ratio)), MOST)
