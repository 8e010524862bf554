"""Single readings: limits of the instrument, noise, repeats, wavelengths."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from fitting.checks.curves import READ_BACK, Curve, brightness, scatter_of, together
from fitting.checks.finding import Finding
from fitting.checks.single import REPEATS, check_single

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "check_limits", "check_missing", "check_noise", "check_repeats", "check_wavelengths",
]  # fmt: skip

# Darker than any reading [1/sr]
_LEAST = 1e-150
# Below this albedo no diffuse base is as level as a floor
_NO_BASE = 2e-3


def check_limits(curves: Sequence[Curve]) -> list[Finding]:
    """Look for a ceiling and a floor: the same extreme number several times."""
    findings = []
    ceilings = [curve for curve in curves if _is_clipped(curve)]
    if ceilings:
        curve = ceilings[0]
        findings.append(
            Finding(
                name="saturation", severity="warning",
                what=f"{_repeated(curve, np.max)} readings have the highest value, "
                f"{curve.value.max():.6g}, at {curve.place}",
                suspects="a saturated detector", cure="Leave them out: saturated(limit) of "
                "fitting.readings.masks, or empty cells.",
            )
        )  # fmt: skip
    findings += [*_floor(curves), *check_single(curves)]
    values = np.concatenate([curve.value for curve in curves])
    negative = int((values < 0).sum())
    if negative:
        findings.append(
            Finding(
                name="negative", severity="note",
                what=f"{negative} readings lie below zero, down to {values.min():.4g}; "
                "they are kept: leaving them out would lift the albedo",
            )
        )  # fmt: skip
    return findings


def _floor(curves: Sequence[Curve]) -> list[Finding]:
    """Look for the lowest value several times, far below the peak.

    Wings of a diffuse base are level too. They are told from a floor by their level, or
    where a lobe bends down into one as it does in a floor alone.
    """
    floors = [
        curve
        for curve in curves
        if _repeated(curve, np.min) and curve.value.min() < 0.05 * curve.value.max()
    ]
    if not floors:
        return []
    sure = [curve for curve in floors if _is_cut_off(curve)]
    curve = (sure or floors)[0]
    bottom = curve.value.min()
    what = "exactly 0" if bottom == 0 else f"the lowest value, {bottom:.6g}"
    found = Finding(
        name="floor", severity="warning" if sure else "note",
        what=f"{_repeated(curve, np.min)} readings have {what}, at {curve.place}",
        suspects="the floor of the instrument, or places that were not measured"
        if sure else "a diffuse base, or the floor of the instrument",
        cure="Leave these cells empty; exact zeros are left out by the commands."
        if sure else "Leave the cells of a floor empty.",
    )  # fmt: skip
    return [found]


def _is_cut_off(curve: Curve) -> bool:
    """Tell whether the lowest value is no light, or less than any base, or cuts a lobe."""
    bottom = float(curve.value.min())
    if bottom * np.pi < _NO_BASE:
        return True
    _, value, _ = curve.in_plane()
    for side in (value, value[::-1]):
        level = np.flatnonzero(side == bottom)
        peak = int(np.argmax(side))
        inner = level[level < peak]
        flank = side[inner[-1] + 1 : peak] if inner.size else side[:0]
        if flank.size < 4:
            continue
        # Beside a base the flank flattens, beside a floor it falls ever faster
        bend = np.diff(np.log(flank[:4]), n=2)
        if (bend < 0.0).all():
            return True
    return False


def _is_clipped(curve: Curve) -> bool:
    """Tell whether a curve ends in a ceiling, and is not flat or coarsely rounded."""
    count, top = _repeated(curve, np.max), float(curve.value.max(initial=0.0))
    middle = float(np.median(curve.value)) if count else 0.0
    if not count or not top > 1.05 * min(middle, float(curve.value.mean())):
        return False
    _, others = np.unique(curve.value[curve.value < top], return_counts=True)
    return top > 1.2 * middle or count >= REPEATS * int(others.max(initial=1))


def _repeated(curve: Curve, extreme: Callable[[np.ndarray], float]) -> int:
    """Return how often the extreme value occurs, or 0 where that is by chance."""
    count = int((curve.value == extreme(curve.value)).sum())
    return count if count >= REPEATS else 0


def check_noise(curves: Sequence[Curve]) -> list[Finding]:
    """Compare the scatter about a smooth curve with the stated errors."""
    beside, parts, stated = [], [], []
    for curve in curves:
        view, value, stderr = curve.in_plane()
        steps = np.diff(view)
        if view.size < 12 or np.ptp(steps) > 0.05 * steps.mean():
            continue
        beside.append(scatter_of(value, stderr))
        stated.append(float(np.median(stderr)))
        parts.append(scatter_of(value, np.maximum(np.abs(value), _LEAST)))
    if np.isfinite(beside).any():
        ratio = float(np.nanmedian(beside))
        error = float(np.nanmedian(stated))
        if ratio > 3.0:
            return [
                Finding(
                    name="noise", severity="warning",
                    what=f"neighbouring readings scatter by {ratio:.3g} times the stated "
                    f"errors (median {error:.3g} 1/sr)",
                    suspects="errors of the mean where those of a reading are meant, or "
                    "drift",
                    cure="Let the fit estimate the noise: leave the column of errors out.",
                )
            ]  # fmt: skip
    if not np.isfinite(parts).any():
        return []
    return [
        Finding(
            name="noise", severity="note",
            what="neighbouring readings scatter by about "
            f"{float(np.nanmedian(parts)):.2g} of themselves",
        )
    ]  # fmt: skip


def check_repeats(scan: "xr.Dataset") -> list[Finding]:
    """Count geometries that stand more than once, or did in the file."""
    same = int(scan.attrs.get("repeated_rows", 0))
    found = []
    if same:
        found.append(
            Finding(
                name="repeated", severity="note",
                what=f"rows that repeat a geometry with the same values count once: {same}",
            )
        )  # fmt: skip
    names = [
        n for n in ("theta_i", "theta_s", "dphi", "phi_i", "wavelength") if n in scan.coords
    ]
    size = scan.sizes["geometry"]
    columns = [np.broadcast_to(np.asarray(scan[n].values, float), (size,)) for n in names]
    keys = np.rint(np.nan_to_num(np.column_stack(columns)) * 1e7)
    repeats = size - len(np.unique(keys, axis=0))
    if repeats:
        found.append(
            Finding(
                name="duplicates", severity="warning",
                what=f"{repeats} readings repeat a geometry",
                suspects="repeated measurements, or a file joined twice",
                cure="Average repeats into one row with its standard error.",
            )
        )  # fmt: skip
    return found


def check_missing(scan: "xr.Dataset") -> list[Finding]:
    """Count what was not measured, by column."""
    said = []
    for name in map(str, scan.data_vars):
        gaps = int(np.isnan(np.asarray(scan[name].values, float)).sum())
        if gaps:
            said.append(f"{gaps} of {scan.sizes['geometry']} of {name}")
    if not said:
        return []
    more = f" and {len(said) - 6} more columns" if len(said) > 6 else ""
    what = f"readings that are missing: {', '.join(said[:6])}{more}"
    return [Finding(name="missing", severity="note", what=what)]


def check_wavelengths(scan: "xr.Dataset") -> list[Finding]:
    """Say how many wavelengths there are, and that a relative scan has no scale."""
    findings = []
    if "wavelength" in scan.coords:
        each = np.atleast_1d(np.asarray(scan["wavelength"].values, float))
        waves = np.unique(each.round(9))
        apart = np.unique(together(each, READ_BACK)).size
        if apart < waves.size:
            findings.append(
                Finding(
                    name="wavelengths", severity="warning",
                    what=f"{waves.size} wavelengths, of which only {apart} lie further "
                    f"apart than {1e3 * READ_BACK:g} nm",
                    suspects="one setting, read back in each row",
                    cure="Write the setting in each row; each wavelength is fitted apart.",
                )
            )  # fmt: skip
        elif waves.size > 1:
            findings.append(
                Finding(
                    name="wavelengths", severity="note",
                    what=f"{waves.size} wavelengths, {waves.min():g} to {waves.max():g} um",
                    cure="Each has an albedo of its own; --wavelength-um takes one.",
                )
            )  # fmt: skip
    found = brightness(scan)
    if scan.attrs.get("quantity") == "relative" or found is None:
        findings.append(
            Finding(
                name="scale", severity="note",
                what="the readings have no absolute scale: no albedo or gain follows from "
                "them, but ratios",
            )
        )  # fmt: skip
    elif np.nanmax(found[0], initial=0.0) in (1.0, 100.0) and np.ptp(found[0]) > 0.0:
        findings.append(
            Finding(
                name="scale", severity="warning",
                what=f"the brightest reading is exactly {np.nanmax(found[0]):g}",
                suspects="a scan divided by its peak, which tells no gain or albedo",
                cure="Give --quantity relative.",
            )
        )  # fmt: skip
    stated, own = scan.attrs.get("tis"), scan.attrs.get("tis_of_table")
    if stated is not None and own is not None:
        ratio = np.atleast_1d(own) / np.maximum(np.atleast_1d(stated), 1e-300)
        if (np.abs(ratio - 1.0) > 0.25).any():
            worst = ratio[np.argmax(np.abs(np.log(np.maximum(ratio, 1e-9))))]
            findings.append(
                Finding(
                    name="tis", severity="warning",
                    what=f"the table integrates to {worst:.3g} times the total scatter "
                    "that the file states",
                    suspects="a TIS without the cosine or of half the space, or a scaled "
                    "table",
                    cure="Compare with a measured total reflectance.",
                )
            )  # fmt: skip
    return findings
