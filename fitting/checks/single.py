"""Single readings that stand out of their curve: spikes, and zeros beside light."""

from collections.abc import Sequence

import numpy as np

from fitting.checks.curves import Curve
from fitting.checks.finding import Finding

__all__ = ["REPEATS", "check_single"]

# So many equal readings of a curve are no single ones
REPEATS = 3
# Times both neighbours, and this far from the specular direction [rad]: no lobe
_SPIKE, _LOBE = 10.0, np.radians(20.0)
# Part of the brightest reading that is far above 0
_BRIGHT = 0.01


def check_single(curves: Sequence[Curve]) -> list[Finding]:
    """Look for single readings that their neighbours belie."""
    return [*_zeros(curves), *_spikes(curves)]


def _zeros(curves: Sequence[Curve]) -> list[Finding]:
    """Look for single readings of exactly 0 beside bright ones: marks of gaps."""
    found = []
    for curve in curves:
        view, value, _ = curve.in_plane()
        zero = value == 0.0
        if not zero.any() or zero.all() or zero.sum() >= REPEATS:
            continue
        lit, bright = np.flatnonzero(~zero), _BRIGHT * float(value.max())
        for k in np.flatnonzero(zero):
            nearest = float(value[lit[np.argmin(np.abs(view[lit] - view[k]))]])
            if nearest > bright:
                found.append((curve, float(view[k]), nearest))
    if not found:
        return []
    curve, view_at, nearest = found[0]
    return [
        Finding(
            name="floor", severity="warning",
            what=f"{len(found)} readings are exactly 0 beside bright ones, first at view "
            f"{np.degrees(view_at):.4g} deg beside {nearest:.4g}, {curve.place}",
            suspects="places that were not measured",
            cure="Leave these cells empty; exact zeros are left out by the commands.",
        )
    ]  # fmt: skip


def _spikes(curves: Sequence[Curve]) -> list[Finding]:
    """Look for single readings far above both neighbours, away from the specular lobe."""
    found = []
    for curve in curves:
        view, value, _ = curve.in_plane()
        beside = np.maximum(value[:-2], value[2:])
        away = np.abs(view[1:-1] - curve.theta_i) > _LOBE
        sharp = (value[1:-1] > _SPIKE * np.maximum(beside, 0.0)) & (beside > 0.0) & away
        found += [(curve, float(view[k + 1]), k + 1) for k in np.flatnonzero(sharp)]
    if not found:
        return []
    curve, view_at, k = found[0]
    return [
        Finding(
            name="spike", severity="warning",
            what=f"{len(found)} readings exceed both neighbours over {_SPIKE:g} times, "
            f"first {curve.in_plane()[1][k]:.4g} at view {np.degrees(view_at):.4g} deg, "
            f"{curve.place}",
            suspects="a glint, a mark of a gap, or a slip of the pen",
            cure="Leave the cell empty if it is no reading.",
        )
    ]  # fmt: skip
