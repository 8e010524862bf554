"""Readings of every kind as elements of the Mueller BRDF, or as ratios to M00."""

import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from data_io.goniometer.declarations import Declared
from data_io.goniometer.scan import (
    ELEMENTS,
    INTENSITIES,
    STDERR,
    ConventionWarning,
    Scan,
)
from data_io.goniometer.tables.names import POLARISERS, STOKES
from pbrdf.errors import DataFileError

__all__ = ["as_declared", "mueller_elements"]

Values = dict[str, np.ndarray]
# M_i0 from light behind polarisers at 0 (along e_s), 45, 90 and 135 degrees
_ALL_FOUR = {
    "M00": {"I0": 0.5, "I45": 0.5, "I90": 0.5, "I135": 0.5},
    "M10": {"I0": 1.0, "I90": -1.0},
    "M20": {"I45": 1.0, "I135": -1.0},
}


def mueller_elements(values: Mapping[str, np.ndarray]) -> tuple[Values, str | None]:
    """Return values under the project's names, and the quantity that a name declares.

    The Stokes vector from an unpolarised source is the first column of the matrix. Of four
    polarisers M00 is half the sum of all; two of them are I_s and I_p.

    Examples
    --------
    >>> light = {"I0": np.array([3.0]), "I45": np.array([2.5]),
    ...          "I90": np.array([1.0]), "I135": np.array([1.5])}
    >>> {name: float(value[0]) for name, value in mueller_elements(light)[0].items()}
    {'M00': 4.0, 'M10': 2.0, 'M20': 1.0}
    """
    found = dict(values)
    _rename(found, {name: f"M{k}0" for k, name in enumerate(STOKES)})
    if set(POLARISERS) <= found.keys():
        found |= _combined(found)
        for name in POLARISERS:
            found.pop(name)
            found.pop(name + STDERR, None)
    _rename(found, {"I0": "I_s", "I90": "I_p"})
    quantity = next((q for q in ("reflectance-factor", "brdf-cos") if q in found), None)
    if quantity is not None:
        _rename(found, {quantity: "M00"})
    return found, quantity


def _rename(values: Values, names: Mapping[str, str]) -> None:
    """Give values and their errors other names, in place."""
    for name, other in names.items():
        for end in ("", STDERR):
            if name + end in values:
                values[other + end] = values.pop(name + end)


def _combined(values: Mapping[str, np.ndarray]) -> Values:
    """Return M00, M10, M20 of four polarisers, with errors where all four have them."""
    found: Values = {}
    stated = all(name + STDERR in values for name in POLARISERS)
    for element, weights in _ALL_FOUR.items():
        found[element] = np.asarray(sum(w * values[name] for name, w in weights.items()))
        if stated:
            squares = ((w * values[name + STDERR]) ** 2 for name, w in weights.items())
            found[element + STDERR] = np.sqrt(sum(squares))
    return found


def as_declared(scan: Scan, declared: Declared) -> Scan:
    """Convert a scan to 1/sr, or mark it relative, as declared; detect ratios to M00.

    Warns
    -----
    ConventionWarning
        If elements are taken as divided by M00, or a DOLP below zero as signed Q/I.
    """
    values, note = _ratios(scan, declared)
    values, signed = _signed_dolp(scan, values)
    for text in (note, signed):
        if text:
            warnings.warn(f"{scan.path.name}: {text}", ConventionWarning, stacklevel=4)
    quantity = declared.quantity or scan.quantity
    attrs = dict(scan.attrs)
    if quantity in ("reflectance-factor", "brdf-cos"):
        factor = np.full(scan.theta_s.size, 1.0 / np.pi)
        if quantity == "brdf-cos":
            with np.errstate(divide="ignore"):
                # cos 90 degrees is 6e-17 in floating point
                cosine = np.cos(np.radians(scan.theta_s))
                factor = np.where(cosine > 1e-9, 1.0 / np.maximum(cosine, 1e-9), np.nan)
        values = {
            name: value if name.removesuffix(STDERR) not in _SCALED else value * factor
            for name, value in values.items()
        }
        attrs["converted_from"] = quantity
        quantity = "brdf"
    words = declared.words()
    if words:
        attrs["declared"] = words
    cones: dict[str, Any] = {}
    for name in ("source_half_angle", "detector_half_angle"):
        angle = getattr(declared, name)
        if angle is not None:
            cones[name] = np.full(scan.theta_i.size, angle)
    return replace(scan, values=values, quantity=quantity, attrs=attrs, **cones)


_SCALED = {*ELEMENTS, *INTENSITIES}


def _ratios(scan: Scan, declared: Declared) -> tuple[Values, str]:
    """Return values with elements divided by M00 under their own names, and a remark."""
    values = dict(scan.values)
    others = [name for name in ELEMENTS[1:] if name in values]
    if declared.normalised is False or not others:
        return values, ""
    intensity = values.get("M00")
    told = declared.quantity is not None or scan.declares_quantity
    unit = intensity is not None and intensity.size > 1 and _all_one(intensity)
    within = all(_within_one(values, name) for name in others)
    absent = intensity is None and not set(INTENSITIES) & values.keys() and within
    if declared.normalised or ((unit or absent) and not told):
        twice = [name for name in others if name.lower() in values]
        if twice:
            problem = f"expected one column of {twice[0].lower()}, found {twice[0]} too"
            cure = (
                "In 1/sr it needs M00 beside it; or leave one out, --columns NAME=ignore."
            )
            raise DataFileError(scan.path, problem, cure, column=twice[0])
        _rename(values, {name: name.lower() for name in others})
        if intensity is not None and _all_one(intensity):
            values.pop("M00")
            values.pop("M00" + STDERR, None)
    else:
        return values, ""
    if declared.normalised:
        return values, ""
    why = "M00 is 1 in every row" if unit else "there is no M00 and no element beyond 1"
    listed = ", ".join(others)
    return values, (
        f"{listed} are taken as divided by M00, because {why}; they tell no absolute gain "
        "or albedo. If they are in 1/sr, give --quantity brdf."
    )


def _all_one(intensity: np.ndarray) -> bool:
    known = intensity[np.isfinite(intensity)]
    return known.size > 0 and bool((np.abs(known - 1.0) < 1e-6).all())


def _within_one(values: Mapping[str, np.ndarray], name: str) -> bool:
    margin = 5.0 * np.nan_to_num(values.get(name + STDERR, np.zeros(values[name].size)))
    size = np.abs(values[name])
    return bool((size[np.isfinite(size)] <= (1.0 + margin)[np.isfinite(size)]).all())


def _signed_dolp(scan: Scan, values: Values) -> tuple[Values, str]:
    """Take a DOLP with signs as Q/I, which it can be in the plane of incidence only."""
    dolp = values.get("DOLP")
    if dolp is None or not (dolp < 0).any() or "m10" in values:
        return values, ""
    out = np.abs(np.sin(np.radians(scan.dphi))) * np.sin(np.radians(scan.theta_s)) > 1e-3
    if out.any() or np.nanmax(np.abs(dolp)) > 2.0:
        return values, ""
    values = dict(values)
    _rename(values, {"DOLP": "m10"})
    return values, (
        "a DOLP below zero is taken as signed Q/I, positive for light along e_s (s); it is "
        "kept as m10. A degree of polarisation has no sign: name such a column m10."
    )
