"""Residuals that run together along a scan: a misfit of the model, not noise."""

from collections.abc import Mapping

import numpy as np

__all__ = ["running_together"]

# Independent residuals have a lag-one correlation of 0 +- 1/sqrt(count)
_LEAST, _SPREADS = 0.4, 4.0
_FEWEST = 12


def running_together(readings: Mapping[str, np.ndarray]) -> list[tuple[str, float]]:
    """Return the observables whose residuals run together, and the correlation.

    Parameters
    ----------
    readings : mapping of str to ndarray, shape (m,)
        observable, scan, wavelength, theta_i, theta_view (nan out of plane) and residual.
        Neighbours are those in view angle of one scan, incidence and wavelength.
    """
    plane = np.isfinite(readings["theta_view"])
    _, scan = np.unique(readings["scan"], return_inverse=True)
    wave = np.nan_to_num(readings["wavelength"])
    keys = np.stack([scan, readings["theta_i"].round(6), wave], axis=1)
    found = []
    for name in dict.fromkeys(readings["observable"].tolist()):
        members = np.flatnonzero((readings["observable"] == name) & plane)
        above = below = 0.0
        for key in np.unique(keys[members], axis=0):
            one = members[(keys[members] == key).all(axis=1)]
            along = readings["residual"][one[np.argsort(readings["theta_view"][one])]]
            above += float(along[1:] @ along[:-1])
            below += float(along @ along)
        count = max(len(members), 1)
        limit = max(_LEAST, _SPREADS / np.sqrt(count)) * below
        if count >= _FEWEST and below > 0.0 and above > limit:
            found.append((str(name), above / below))
    return found
