"""Places on a plane that repeats."""

import numpy as np


def wrapped(places: np.ndarray, period: np.ndarray) -> np.ndarray:
    """Move places (..., 2) into one period, [0, period). [um]"""
    inside = places % period
    # A tiny negative number leaves the whole period
    return np.where(inside < period, inside, 0.0)


def nearest(offsets: np.ndarray, period: np.ndarray) -> np.ndarray:
    """Offsets (..., 2) to the nearest of all images. [um]"""
    return offsets - period * np.round(offsets / period)
