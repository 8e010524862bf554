"""Whether scans that were read on one side of the normal belong to the other."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

    from fitting.result.fit_result import FitResult

__all__ = ["beside_the_other_side", "turned_to_the_other_side"]

# Below this incidence forward and backward are one, and below this zenith a reading has no
# side [rad]
_OBLIQUE, _NORMAL = np.radians(8.0), np.radians(2.0)
# sin(theta_s) |sin(dphi)| of a reading that counts as in plane
_PLANE = 2e-3
# By how much the likelihood must rise, in all and for each reading: the misfit falls to 0.7
_RISE, _EACH = 8.0, 0.35
# The same where errors are given, as a part of chi2: it falls to a half
_OF_CHI2 = 0.25


def turned_to_the_other_side(
    scans: "Mapping[str, xr.Dataset]",
) -> "dict[str, xr.Dataset] | None":
    """Return the scans with forward and backward exchanged, or None.

    None where both sides were read, as then the readings themselves tell the sides apart,
    where readings lie out of plane, or all incidences are near the normal.

    Examples
    --------
    >>> import xarray as xr
    >>> angles = {"theta_i": 0.5, "theta_s": 0.3, "dphi": np.pi}
    >>> scan = xr.Dataset(coords={k: ("geometry", [v, v]) for k, v in angles.items()})
    >>> turned_to_the_other_side({"scan": scan})["scan"].dphi.values
    array([0., 0.])
    """
    sides: set[bool] = set()
    for scan in scans.values():
        theta_i, theta_s, dphi = (
            np.asarray(scan[name].values, float) for name in ("theta_i", "theta_s", "dphi")
        )
        across = np.sin(theta_s) * np.abs(np.sin(dphi))
        if (across > _PLANE).any() or (theta_i < _OBLIQUE).all():
            return None
        has_side = (theta_s > _NORMAL) & (theta_i >= _OBLIQUE)
        sides |= set((np.cos(dphi[has_side]) < 0.0).tolist())
    if len(sides) != 1:
        return None
    return {
        label: scan.assign_coords(dphi=np.mod(scan.dphi + np.pi, 2.0 * np.pi))
        for label, scan in scans.items()
    }


def beside_the_other_side(
    result: "FitResult", fit_turned: "Callable[[], FitResult]"
) -> "FitResult":
    """Call a fit poor if the exchanged scans fit far better, and name the option.

    Parameters
    ----------
    result : FitResult
        Of the scans as they were read.
    fit_turned : callable
        Does the same fit to the exchanged scans.
    """
    stated = result.n_estimated == 0
    if not result.converged or (stated and result.misfit.verdict == "good"):
        return result
    other = fit_turned()
    if not other.converged or len(other.residuals) != len(result.residuals):
        return result
    rise = other.log_likelihood - result.log_likelihood
    least = _OF_CHI2 * result.chi2 if stated else _EACH * len(result.residuals)
    if not rise > max(_RISE, least) or other.misfit.verdict not in ("good", "fair"):
        return result
    has_side = result.readings.theta_s.values > _NORMAL
    forward = np.cos(result.readings.dphi.values[has_side]) < 0.0
    side = "forward" if forward.any() else "source's"
    if stated:
        text = f"chi2 falls by {2.0 * rise:.3g} of {result.chi2:.3g}"
    else:
        part = np.exp(-rise / len(result.residuals))
        text = f"the misfit falls to {100.0 * part:.2g} % of it"
    other_side = "source's" if side == "forward" else "forward"
    warning = (
        f"all readings lie on the {side} side, and taken as of the {other_side} side they "
        f"fit far better ({text}): forward lies at another azimuth. Give "
        "--azimuth-of-forward, 0 or 180, as it was not; or --accept exchanged"
    )
    return replace(result, warnings=(warning, *result.warnings), fits_the_other_side=True)
