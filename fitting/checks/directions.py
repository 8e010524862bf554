"""Whether directions mean what the conventions say: forward side, reciprocity."""

from collections.abc import Sequence

import numpy as np

from fitting.checks.curves import Curve
from fitting.checks.finding import Finding

__all__ = ["check_exchange", "check_reciprocity"]

# Below this incidence forward and backward are one
_OBLIQUE = np.radians(8.0)
# A lobe this much brighter on the source's side than on the other, and this near to where
# the mirror image of the specular direction lies
_BRIGHTER, _FAINTLY, _NEAR = 1.3, 1.02, np.radians(25.0)
_SAME = np.radians(0.25)
# Rise over both ends of one side that makes a lobe
_LOBE = 3.0
# Readings to interpolate between
_APART = np.radians(6.0)
# Departure from reciprocity beyond which it is not noise or an aperture. [1]
_UNEQUAL = 0.15


def check_exchange(curves: Sequence[Curve]) -> list[Finding]:
    """Compare the brightness at equal zeniths on the two sides of the normal.

    Light goes on forward of most surfaces; one that is brighter back, where the mirror
    image of the specular direction lies, is a retro-reflector or has its azimuths turned.
    """
    seen, back, faint = 0, [], []
    for curve in curves:
        ratio, where = _brighter_back(curve)
        if np.isnan(ratio):
            ratio, where = _lobe_back(curve)
        if np.isnan(ratio):
            continue
        seen += 1
        if ratio > _BRIGHTER and abs(where - curve.theta_i) < _NEAR:
            back.append((ratio, curve))
        elif ratio > _FAINTLY:
            faint.append((ratio, curve))
    cure = (
        "If azimuth 0 is the forward side in this file, give --azimuth-of-forward 0; if "
        "the sample sends light back, --accept exchanged."
    )
    if back and 2 * len(back + faint) > seen:
        ratio, curve = max(back, key=lambda pair: pair[0])
        what = (
            f"the source's side is up to {ratio:.3g} times brighter than "
            f"{'the forward side' if _has_both(curve) else 'at its ends'}, "
            f"with its peak where the specular one should be ({curve.place})"
        )
        suspects = "forward and backward exchanged, or a retro-reflector"
        return [
            Finding(
                name="exchanged", severity="error", what=what, suspects=suspects, cure=cure
            )
        ]
    if 2 * len(faint) > seen:
        ratio, curve = max(faint, key=lambda pair: pair[0])
        what = (
            f"the source's side is up to {ratio:.3g} times brighter than the forward side "
            f"({curve.place})"
        )
        suspects = "a rough diffuse sample, or forward and backward exchanged"
        return [
            Finding(
                name="exchanged",
                severity="warning",
                what=what,
                suspects=suspects,
                cure=cure,
            )
        ]
    return []


def _brighter_back(curve: Curve) -> tuple[float, float]:
    """Return the largest significant ratio of backward to forward, and its zenith.

    NaN where the two sides are not both read, or the incidence is too small to tell.
    Below 1 where no zenith is brighter backward than the brightest is forward.
    """
    view, value, stderr = curve.in_plane()
    if curve.theta_i < _OBLIQUE:
        return float("nan"), float("nan")
    forward, backward = view > 0, view < 0
    if forward.sum() < 3 or backward.sum() < 3:
        return float("nan"), float("nan")
    zenith = -view[backward]
    inside = (zenith >= view[forward].min() - _SAME) & (
        zenith <= view[forward].max() + _SAME
    )
    if inside.sum() < 3:
        return float("nan"), float("nan")
    opposite = np.interp(zenith[inside], view[forward], value[forward])
    back, error = value[backward][inside], np.nan_to_num(stderr[backward][inside])
    if opposite.max() >= back.max():
        return 1.0, float("nan")
    peak = int(np.argmax(back))
    ahead = max(opposite[peak], 1e-3 * back[peak])
    if back[peak] - 5.0 * error[peak] <= ahead:
        return 1.0, float("nan")
    return float(back[peak] / ahead), float(zenith[inside][peak])


def _has_both(curve: Curve) -> bool:
    view = curve.in_plane()[0]
    return bool((view > 0).any() and (view < 0).any())


def _lobe_back(curve: Curve) -> tuple[float, float]:
    """Return the rise of a lobe over both ends of a scan of the source's side, its zenith.

    NaN where the forward side was read, or there is no lobe: light that goes back falls or
    rises all the way to grazing angles.
    """
    view, value, stderr = curve.in_plane()
    if curve.theta_i < _OBLIQUE or view.size < 7 or (view > _SAME).any():
        return float("nan"), float("nan")
    k = int(np.argmax(value))
    # Facets of a rough metal make a hump there too
    if not 2 <= k < view.size - 2:
        return float("nan"), float("nan")
    ends = max(float(value[:2].max()), float(value[-2:].max()), 1e-3 * float(value[k]))
    error = float(np.nan_to_num(stderr[k]))
    if value[k] - 5.0 * error <= ends:
        return float("nan"), float("nan")
    ratio = float(value[k]) / ends
    return (ratio, float(-view[k])) if ratio > _LOBE else (float("nan"), float("nan"))


def check_reciprocity(curves: Sequence[Curve]) -> list[Finding]:
    """Compare readings whose source and detector are exchanged.

    An isotropic surface has f(a -> b) = f(b -> a). Readings times cos(theta_s) differ by
    the ratio of the cosines, which tells them from noise.
    """
    pairs = [pair for a in curves for b in curves for pair in _exchanged(a, b)]
    if len(pairs) < 2:
        return []
    ratio, cosines, error = np.array(pairs).T
    deviation = np.abs(np.log(ratio))
    far = (deviation > _UNEQUAL) & (deviation > 5.0 * error)
    if 2 * far.sum() <= len(pairs):
        return []
    slope = float(np.sum(np.log(ratio) * np.log(cosines)) / np.sum(np.log(cosines) ** 2))
    rest = np.median(np.abs(np.log(ratio) - slope * np.log(cosines)))
    what = (
        f"{far.sum()} of {len(pairs)} pairs of readings with source and detector exchanged "
        f"differ, by a median of {np.expm1(np.median(deviation)):.0%}"
    )
    if 0.7 < slope < 1.3 and rest < 0.3 * np.median(deviation):
        return [
            Finding(
                name="reciprocity", severity="error",
                what=f"{what}, as the cosines of the detector's zenith do",
                suspects="values that contain cos(theta_s)",
                cure="Give --quantity brdf-cos, or --accept reciprocity.",
            )
        ]  # fmt: skip
    return [
        Finding(
            name="reciprocity", severity="warning", what=what,
            suspects="an anisotropic sample, a spot larger than it at grazing angles, or "
            "angles of one column that belong to the other",
            cure="Look at these pairs; mask grazing angles.",
        )
    ]  # fmt: skip


def _exchanged(a: Curve, b: Curve) -> list[tuple[float, float, float]]:
    """Return ratio, ratio of cosines and error of pairs with a.theta_i < b.theta_i."""
    same_wave = a.wavelength == b.wavelength or (
        np.isnan(a.wavelength) and np.isnan(b.wavelength)
    )
    if not same_wave or b.theta_i - a.theta_i < np.radians(5.0):
        return []
    if a.is_planar and b.is_planar:
        return _exchanged_in_plane(a, b)
    found = []
    for k in np.flatnonzero(np.abs(a.theta_s - b.theta_i) < _SAME):
        turn = np.cos(b.dphi - a.dphi[k])
        mirrored = np.cos(b.dphi + a.dphi[k])
        near = (np.abs(b.theta_s - a.theta_i) < _SAME) & (
            np.maximum(turn, mirrored) > np.cos(_SAME)
        )
        for j in np.flatnonzero(near):
            if a.value[k] > 0 and b.value[j] > 0:
                relative = np.hypot(a.stderr[k] / a.value[k], b.stderr[j] / b.value[j])
                cosines = np.cos(a.theta_s[k]) / np.cos(b.theta_s[j])
                found.append(
                    (
                        a.value[k] / b.value[j],
                        float(cosines),
                        float(np.nan_to_num(relative)),
                    )
                )
    return found


def _exchanged_in_plane(a: Curve, b: Curve) -> list[tuple[float, float, float]]:
    """Return the same of curves in plane, interpolated between neighbouring readings."""
    found = []
    cosines = float(np.cos(b.theta_i) / np.cos(a.theta_i))
    for side in (-1.0, 1.0):
        first, second = _read_at(a, side * b.theta_i), _read_at(b, side * a.theta_i)
        if first[0] > 0 and second[0] > 0:
            relative = np.hypot(first[1] / first[0], second[1] / second[0])
            found.append((first[0] / second[0], cosines, float(np.nan_to_num(relative))))
    return found


def _read_at(curve: Curve, view: float) -> tuple[float, float]:
    """Return value and error at a view angle between two readings; NaN outside or apart."""
    views, values, errors = curve.in_plane()
    k = int(np.clip(np.searchsorted(views, view), 1, max(views.size - 1, 1)))
    if views.size < 2 or not views[k - 1] - _SAME <= view <= views[k] + _SAME:
        return float("nan"), float("nan")
    nearest = int(np.argmin(np.abs(views - view)))
    if abs(views[nearest] - view) < _SAME:
        return float(values[nearest]), float(errors[nearest])
    if views[k] - views[k - 1] > _APART:
        return float("nan"), float("nan")
    value = float(np.interp(view, views, values))
    return value, float(np.interp(view, views, errors))
