"""How much light the readings account for: at most all of it."""

from collections.abc import Sequence

import numpy as np

from fitting.checks.curves import Curve
from fitting.checks.finding import Finding

__all__ = ["check_energy", "reflectance_bounds"]

# Rounding, calibration and the interpolation between readings [1]
_TOLERANCE = 1.05
# Readings further apart than this leave what lies between unknown
_GAP = np.radians(25.0)
_DARK = 1e-4
_RESOLVED = 0.6


def check_energy(curves: Sequence[Curve]) -> list[Finding]:
    """Compare the integral of each incidence with 1."""
    found = []
    for curve in curves:
        low, middle = reflectance_bounds(curve)
        if np.isfinite(low):
            found.append((low, middle, curve))
    if not found:
        return []
    low, middle, curve = max(found, key=lambda entry: entry[0])
    if low > _TOLERANCE:
        if low / np.pi <= _TOLERANCE:
            suspects = "reflectance factors (pi times the BRDF), or a relative scale"
            option = "--quantity reflectance-factor, or relative"
        else:
            suspects = "a relative scale or counts, per cent, or another unit"
            option = "--quantity relative"
        return [
            Finding(
                name="energy", severity="error",
                what=f"the readings alone integrate to a reflectance of at least {low:.3g} "
                f"at {curve.place}; about {middle:.3g} with what lies between",
                suspects=suspects, cure=f"Give {option}; or --accept energy.",
            )
        ]  # fmt: skip
    middles = [entry[1] for entry in found]
    # A lobe that the readings do not resolve has no estimate worth the name
    resolved = [middle for low, middle, _ in found if low > _RESOLVED * middle]
    if max(resolved, default=0.0) > _TOLERANCE:
        return [
            Finding(
                name="energy", severity="warning",
                what="the readings integrate to a reflectance of about "
                f"{max(resolved):.3g} if the lobe is as wide across the plane as in it, "
                f"at least {low:.3g}",
                suspects="too few readings in a narrow lobe, or values in another unit",
                cure="Compare with a measured total reflectance; --quantity says the unit.",
            )
        ]  # fmt: skip
    if max(middles) < _DARK:
        return [
            Finding(
                name="energy", severity="warning",
                what=f"the readings integrate to a reflectance of {max(middles):.2g} only",
                suspects="a relative scale, or a sample darker than any paint",
                cure="Give --quantity relative if the scale is unknown.",
            )
        ]  # fmt: skip
    return [
        Finding(
            name="energy", severity="note",
            what=f"the readings integrate to a reflectance of {min(middles):.2g} to "
            f"{max(middles):.2g}, at least {low:.2g}",
        )
    ]  # fmt: skip


def reflectance_bounds(curve: Curve) -> tuple[float, float]:
    """Return a lower bound and an estimate of the reflectance that a curve accounts for.

    In plane the profile is turned about the specular ray: the bound takes the lower of two
    neighbouring readings and of the two sides, the estimate what lies between. Out of plane
    every direction takes its nearest readings. What was not read counts as dark.
    """
    if curve.is_planar:
        return _of_profile(curve)
    return _of_cloud(curve)


def _of_profile(curve: Curve) -> tuple[float, float]:
    view, value, _ = curve.in_plane()
    if view.size < 5:
        return float("nan"), float("nan")
    alpha = (np.arange(1440) + 0.5) * np.radians(0.125)
    sides = [_side(curve.theta_i, view, value, sign, alpha) for sign in (-1.0, 1.0)]
    lows, middles = (np.array([side[k] for side in sides]) for k in (0, 1))
    known = np.isfinite(lows)
    low = np.where(known.all(axis=0), np.nanmin(np.where(known, lows, np.inf), axis=0), 0.0)
    count = known.sum(axis=0)
    middle = np.where(count > 0, np.nansum(middles, axis=0) / np.maximum(count, 1), 0.0)
    weight = _cosine_rings(curve.theta_i, alpha) * np.sin(alpha) * np.radians(0.125)
    return float(np.sum(low * weight)), float(np.sum(middle * weight))


def _side(
    theta_i: float, view: np.ndarray, value: np.ndarray, sign: float, alpha: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return lower neighbours and interpolated values at angles from the specular ray."""
    at = theta_i + sign * alpha
    right = np.clip(np.searchsorted(view, at), 1, view.size - 1)
    outside = (at < view[0]) | (at > view[-1]) | (view[right] - view[right - 1] > _GAP)
    lower = np.minimum(value[right - 1], value[right])
    return (
        np.where(outside, np.nan, np.maximum(lower, 0.0)),
        np.where(outside, np.nan, np.interp(at, view, value)),
    )


def _cosine_rings(theta_i: float, alpha: np.ndarray) -> np.ndarray:
    """Return the integral of max(cos theta_s, 0) round rings about the specular ray."""
    turn = (np.arange(180) + 0.5) * np.pi / 180
    cosine = np.cos(alpha)[:, None] * np.cos(theta_i) + np.sin(alpha)[:, None] * np.sin(
        theta_i
    ) * np.cos(turn)
    return np.asarray(2.0 * np.maximum(cosine, 0.0).mean(axis=1) * np.pi)


def _of_cloud(curve: Curve) -> tuple[float, float]:
    from scipy.spatial import cKDTree

    if curve.value.size < 12:
        return float("nan"), float("nan")
    # Both halves of the hemisphere: an isotropic surface mirrors them
    theta = np.concatenate([curve.theta_s, curve.theta_s])
    phi = np.concatenate([curve.dphi, -curve.dphi])
    value = np.concatenate([curve.value, curve.value])
    tree = cKDTree(_unit(theta, phi))
    # Equal projected solid angles: radius sqrt of equal steps
    radius = np.sqrt((np.arange(60) + 0.5) / 60)
    turn = (np.arange(120) + 0.5) * np.pi / 60
    zenith, azimuth = (part.ravel() for part in np.meshgrid(np.arcsin(radius), turn))
    distance, nearest = tree.query(_unit(zenith, azimuth), k=4)
    near = distance < 2 * np.sin(_GAP / 2)
    known = near[:, 0]
    low = np.where(known, np.where(near, value[nearest], np.inf).min(axis=1), 0.0)
    middle = np.where(known, value[nearest[:, 0]], 0.0)
    return float(np.pi * np.maximum(low, 0.0).mean()), float(np.pi * middle.mean())


def _unit(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    across = np.sin(theta)
    return np.column_stack([across * np.cos(phi), across * np.sin(phi), np.cos(theta)])
