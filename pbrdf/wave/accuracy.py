"""How far a computed power may be from the truth, by what rigorous solutions have shown.

The forms disagree where they fail. On the rigorous profiles of the study `wave_optics` the
error of "auto" in a direction lay within the sum of squares below in 80 % of the directions
and within twice that in 95 %.
"""

import numpy as np

__all__ = ["relative_error"]

Array = np.ndarray

# Errors in dB that remain where all forms agree, that of the tables among them
FLOOR = 0.05
# Shares of the differences to the order-weighted form and to the tangent plane
OF_ORDERS, OF_PLANE = 0.7, 0.1
# Light of second bounces, in dB over the square of the rms slope
OF_BOUNCES = 3.0
# What two results differ by at the most, where one has nothing [dB]
MOST = 60.0


def relative_error(
    found: Array, best: Array, orders: Array, plane: Array, slope: Array
) -> Array:
    """Estimate the standard error of a power over the power itself.

    Parameters
    ----------
    found, best, orders, plane : ndarray
        Power by the form asked for, by "auto", "order-weighted" and "kirchhoff".
    slope : ndarray
        Rms slope. [1]
    """
    error = np.sqrt(
        FLOOR**2
        + (OF_ORDERS * decibels(best, orders)) ** 2
        + (OF_PLANE * decibels(best, plane)) ** 2
        + (OF_BOUNCES * slope**2) ** 2
        + decibels(best, found) ** 2
    )
    return 10 ** (np.minimum(error, MOST) / 10) - 1.0


def decibels(one: Array, other: Array) -> Array:
    """Difference of two powers in dB."""
    ratio = np.maximum(one, 1e-300) / np.maximum(other, 1e-300)
    return np.minimum(np.abs(10 * np.log10(ratio)), MOST)
