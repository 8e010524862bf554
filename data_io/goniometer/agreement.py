"""Columns of one file that must agree, because one follows from others."""

from collections.abc import Iterator, Mapping

import numpy as np

from data_io.goniometer.scan import INTENSITIES, NORMALISED, STDERR, Scan
from data_io.goniometer.scatter import standard_errors

__all__ = ["check_agreement", "check_fractions", "check_parts", "errors_of"]

# Two columns of one quantity may differ by rounding and calibration [M00]
_TOLERANCE, _DOLP_TOLERANCE = 0.02, 0.05
# Where nothing tells the noise
_UNKNOWN = 0.05
# Rows whose differences tell their own noise
_ENOUGH = 8
# Standard errors that are beyond noise
_FAR = 5.0
# Standard deviation of a normal number over the median of its size
_MEDIAN = 1.4826
# Part of the brightest reading below which two columns may differ
_DARK = 1e-3
# What follows from light behind polarisers
_SUMS: dict[str, tuple[dict[str, float], ...]] = {
    "M00": ({"I_s": 1.0, "I_p": 1.0}, {"f_ss": 0.5, "f_sp": 0.5, "f_ps": 0.5, "f_pp": 0.5}),
    "M10": ({"I_s": 1.0, "I_p": -1.0},
            {"f_ss": 0.5, "f_sp": 0.5, "f_ps": -0.5, "f_pp": -0.5}),
    "M01": ({"f_ss": 0.5, "f_sp": -0.5, "f_ps": 0.5, "f_pp": -0.5},),
    "M11": ({"f_ss": 0.5, "f_sp": -0.5, "f_ps": -0.5, "f_pp": 0.5},),
    "I_s": ({"f_ss": 0.5, "f_sp": 0.5}, {"M00": 0.5, "M10": 0.5}),
    "I_p": ({"f_ps": 0.5, "f_pp": 0.5}, {"M00": 0.5, "M10": -0.5}),
}  # fmt: skip


def errors_of(scan: Scan, name: str) -> np.ndarray:
    """Return the standard errors of a column: as stated, by its scatter, or NaN."""
    stated = scan.values.get(name + STDERR)
    brightness = scan.values.get("M00")
    return standard_errors(scan.values[name], stated, *scan.curves, brightness=brightness)


def check_agreement(scan: Scan) -> None:
    """Refuse a column that others of the file contradict, by the worst row.

    Raises
    ------
    DataFileError
        Where M00 is not I_s + I_p, M10 not m10 M00, and so on, in a reading or in the sum
        of all, by more than five standard errors and 2 % of M00.
    """
    for name, text, parts, expected, error in _told_twice(scan):
        value = scan.values[name]
        size = np.ones(value.size) if name == "m10" else np.abs(_brightness(scan, value))
        off = value - expected
        known = np.isfinite(off)
        if not known.any():
            continue
        stated = any(part + STDERR in scan.values for part in (name, *parts))
        if not stated and known.sum() >= _ENOUGH:
            spread = np.median(np.abs(off[known]) / np.maximum(size[known], 1e-300))
            error = np.minimum(error, _MEDIAN * spread * size)
        floor = _DARK * float(np.nanmax(np.abs(size[known]), initial=0.0))
        part = np.where(error > 0.0, _TOLERANCE, _UNKNOWN)
        allowed = part * size + _FAR * error + floor
        beyond = known & (np.abs(off) > allowed)
        total = abs(float(off[known].sum()))
        noise = _FAR * float(np.sqrt(np.sum(error[known] ** 2)))
        together = total > float(np.sum((part * size + floor)[known])) + noise
        if not beyond.any() and not together:
            continue
        excess = np.abs(off) / np.maximum(allowed, 1e-300)
        worst = int(np.argmax(np.where(known, excess, -np.inf)))
        count = f"; {beyond.sum()} of {known.sum()} rows differ" if beyond.any() else (
            f"; {known.sum()} rows differ in their sum"
        )  # fmt: skip
        problem = f"expected {text} = {expected[worst]:.6g}, got {value[worst]:.6g}{count}"
        cure = (
            "Leave out the column that is wrong, --columns NAME=ignore. Here I_s = (M00 + "
            "M10)/2, I_p = (M00 - M10)/2, and m10 = M10/M00."
        )
        raise scan.fault(np.arange(value.size) == worst, name, problem, cure)


def check_parts(scan: Scan) -> None:
    """Refuse light behind an analyser that is more than all light."""
    if "M00" not in scan.values:
        return
    whole = scan.values["M00"]
    floor = _DARK * float(np.nanmax(np.abs(whole), initial=0.0))
    # Of an unpolarised source a polariser before the surface passes half
    for name, most in {
        "I_s": 1.0,
        "I_p": 1.0,
        **dict.fromkeys(INTENSITIES[2:], 2.0),
    }.items():
        if name not in scan.values:
            continue
        error = _joint(scan, {name: 1.0, "M00": most})
        part = most * np.where(error > 0.0, _TOLERANCE, _UNKNOWN) * np.abs(whole)
        beyond = scan.values[name] - most * whole > part + _FAR * error + floor
        if beyond.any():
            row = int(np.argmax(beyond))
            problem = (
                f"expected at most {'2 ' if most > 1.0 else ''}M00 = "
                f"{most * whole[row]:.6g}, got {scan.values[name][row]:.6g}"
            )
            cure = "Behind an analyser is a part of all light: I_s + I_p = M00."
            if most > 1.0:
                cure = "M00 is half of f_ss + f_sp + f_ps + f_pp."
            raise scan.fault(beyond, name, problem, cure)


def _told_twice(
    scan: Scan,
) -> Iterator[tuple[str, str, tuple[str, ...], np.ndarray, np.ndarray]]:
    """Yield each column that others give: name, rule, others, their value, joint error."""
    values = scan.values
    for name, sums in _SUMS.items():
        for weights in sums:
            if name in values and weights.keys() <= values.keys():
                expected = np.asarray(sum(w * values[p] for p, w in weights.items()))
                yield (
                    name,
                    _words(weights),
                    (*weights,),
                    expected,
                    _joint(scan, {name: 1.0, **weights}),
                )
    for ratio in NORMALISED:
        element = ratio.upper()
        if {ratio, element, "M00"} <= values.keys():
            expected = values[ratio] * values["M00"]
            own, of_ratio, of_m00 = (
                np.nan_to_num(errors_of(scan, one)) for one in (element, ratio, "M00")
            )
            product = np.hypot(of_ratio * values["M00"], of_m00 * values[ratio])
            error = np.hypot(own, np.nan_to_num(product))
            yield element, f"{ratio} M00", (ratio, "M00"), expected, error
    if {"m10", "I_s", "I_p"} <= values.keys() and not {"M00", "M10"} <= values.keys():
        light = values["I_s"] + values["I_p"]
        with np.errstate(divide="ignore", invalid="ignore"):
            expected = np.where(
                light > 0.0, (values["I_s"] - values["I_p"]) / light, np.nan
            )
            both = _joint(scan, {"I_s": 1.0, "I_p": 1.0}) * np.sqrt(2.0) / np.abs(light)
        error = np.hypot(
            np.nan_to_num(errors_of(scan, "m10")), np.nan_to_num(both, posinf=0)
        )
        yield "m10", "(I_s - I_p)/(I_s + I_p)", ("I_s", "I_p"), expected, error


def _brightness(scan: Scan, other: np.ndarray) -> np.ndarray:
    """Return M00, from whatever gives it; else another column."""
    if "M00" in scan.values:
        return scan.values["M00"]
    for weights in _SUMS["M00"]:
        if weights.keys() <= scan.values.keys():
            return np.asarray(sum(w * scan.values[p] for p, w in weights.items()))
    return other


def _words(weights: Mapping[str, float]) -> str:
    """Return a sum as one writes it.

    >>> _words({"I_s": 1.0, "I_p": -1.0}), _words({"f_ss": 0.5, "f_sp": 0.5})
    ('I_s - I_p', '(f_ss + f_sp)/2')
    """
    text = " ".join(f"{'-' if w < 0 else '+'} {name}" for name, w in weights.items())
    text = text.removeprefix("+ ")
    return text if abs(next(iter(weights.values()))) == 1.0 else f"({text})/2"


def _joint(scan: Scan, weights: Mapping[str, float]) -> np.ndarray:
    """Return the error of a sum of columns, zero where nothing tells it."""
    parts = [w * np.nan_to_num(errors_of(scan, name)) for name, w in weights.items()]
    return np.sqrt(np.sum(np.square(parts), axis=0))


def check_fractions(scan: Scan) -> None:
    """Refuse a DOLP beyond 1, or one that is not sqrt(M10^2 + M20^2)/M00."""
    dolp = scan.values.get("DOLP")
    if dolp is None:
        return
    noise = 5 * np.nan_to_num(scan.values.get("DOLP" + STDERR, np.zeros(dolp.size)))
    wrong = dolp > 1 + noise
    if wrong.any():
        problem = f"expected a fraction in [0, 1], got {dolp[np.argmax(wrong)]:.9g}"
        raise scan.fault(wrong, "DOLP", problem, "Divide per cent by 100.")
    if {"M00", "M10", "M20"} <= scan.values.keys():
        m00, m10, m20 = (scan.values[name] for name in ("M00", "M10", "M20"))
        text = "sqrt(M10^2 + M20^2)/M00"
    elif {"m10", "m20"} <= scan.values.keys():
        m00, m10, m20 = np.ones(dolp.size), scan.values["m10"], scan.values["m20"]
        text = "sqrt(m10^2 + m20^2)"
    else:
        return
    lit = m00 > 0
    ratio = np.full(dolp.size, np.nan)
    ratio[lit] = np.hypot(m10, m20)[lit] / m00[lit]
    for name in ("M10", "M20") if text.startswith("sqrt(M") else ("m10", "m20"):
        error = scan.values.get(name + STDERR, np.zeros(dolp.size))
        noise[lit] += 5 * np.nan_to_num(error[lit]) / m00[lit]
    off = np.nan_to_num(np.abs(ratio - dolp) - _DOLP_TOLERANCE - noise, nan=-1.0)
    if (off > 0.0).any():
        row = int(np.argmax(off))
        problem = f"expected {text} = {ratio[row]:.4g}, got {dolp[row]:.4g}"
        worst = np.arange(off.size) == row
        raise scan.fault(worst, "DOLP", problem, "Mend or drop one of the columns.")
