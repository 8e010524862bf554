"""What makes the rows of a goniometer file wrong: ranges, units, normalisation, noise."""

import numpy as np

from data_io.goniometer.agreement import (
    check_agreement,
    check_fractions,
    check_parts,
    errors_of,
)
from data_io.goniometer.scan import ELEMENTS, INTENSITIES, NORMALISED, RATIOS, STDERR, Scan
from pbrdf.errors import DataFileError

__all__ = ["check"]

# Angles below this many degrees, all of them, are radians under a wrong name
_RADIAN_LIMIT_DEG = 1.6
# Plausible wavelengths; 532 would be nanometres [um]
_WAVELENGTH_RANGE = (0.01, 100.0)
# A mirror within a microradian [1/sr]
_BRIGHTEST = 1e9
# Part of the brightest reading below which noise may exceed the signal
_DARK = 1e-3
# Standard errors that are beyond noise
_FAR = 5.0


def check(scan: Scan) -> None:
    """Raise the DataFileError of the first row that breaks a rule."""
    _check_angles(scan)
    _check_wavelength(scan)
    _check_values(scan)
    check_fractions(scan)
    _check_ratios(scan)
    check_agreement(scan)
    check_parts(scan)


def _check_angles(scan: Scan) -> None:
    for column, low, high in (
        ("theta_i", 0, 90),
        ("theta_s", 0, 90),
        ("dphi", -720, 720),
        ("phi_i", -720, 720),
        ("source_half_angle", 0, 45),
        ("detector_half_angle", 0, 45),
    ):
        values = getattr(scan, column)
        if values is None:
            continue
        wrong = ~((values >= low) & (values <= high))
        if wrong.any():
            value = values[np.argmax(wrong)]
            problem = f"expected an angle in [{low}, {high}] deg, got {value:.9g}"
            cure = (
                "Zeniths are counted from the normal; below the horizon is no reflection."
            )
            if column.endswith("half_angle"):
                cure = "It is half the opening of a cone of light; beyond 45 no beam is."
            if column == "theta_i":
                cure = "theta_i is positive; signs belong to theta_view_deg or dphi_deg."
            raise scan.fault(wrong, column, problem, cure)
    if not scan.angles_declared:
        _refuse_radians(scan)


def _refuse_radians(scan: Scan) -> None:
    """Refuse angles that are radians by their looks, under names that say degrees."""
    cure = (
        "Write degrees: 1.5708 rad are 90 deg. Or give --angles rad; deg if they are so "
        "small."
    )
    small = max(scan.theta_i.max(), scan.theta_s.max()) < _RADIAN_LIMIT_DEG
    for column in ("theta_i", "theta_s"):
        values = getattr(scan, column)
        # One value below the limit beside larger angles may be meant so, a scan may not
        several = np.unique(values[values > 0]).size > (0 if small else 1)
        if several and values.max() < _RADIAN_LIMIT_DEG:
            problem = (
                f"expected degrees, got values up to {values.max():.6g} only, which look "
                "like radians"
            )
            raise scan.fault(values == values.max(), column, problem, cure)
    # 0.5236 is no incidence that one sets in degrees; in radians it is 30 degrees
    turned = np.degrees(scan.theta_i)
    round_as_radians = np.abs(turned - 5 * np.rint(turned / 5)) < 0.06
    fine_as_degrees = np.abs(100 * scan.theta_i - np.rint(100 * scan.theta_i)) > 1e-6
    small = (scan.theta_i > 0) & (scan.theta_i < _RADIAN_LIMIT_DEG)
    looks_radian = small & round_as_radians & fine_as_degrees
    if looks_radian.any():
        row = int(np.argmax(looks_radian))
        problem = (
            f"expected degrees, got {scan.theta_i[row]:.6g}, which looks like "
            f"{turned[row]:.0f} degrees in radians"
        )
        raise scan.fault(looks_radian, "theta_i", problem, cure)
    # pi/2, pi and 3 pi/2 do not occur by chance in degrees
    quarters = np.abs(scan.dphi[:, None] - np.array([0.5, 1, 1.5, 2]) * np.pi).min(axis=1)
    looks_radian = (quarters < 2e-3) & (np.abs(scan.dphi) <= 2 * np.pi + 2e-3)
    if looks_radian.any() and np.abs(scan.dphi).max() <= 2 * np.pi + 2e-3:
        value = scan.dphi[np.argmax(looks_radian)]
        problem = f"expected degrees, got {value:.6g}, which looks like radians"
        raise scan.fault(looks_radian, "dphi", problem, cure)


def _check_wavelength(scan: Scan) -> None:
    if scan.wavelength is None:
        return
    low, high = _WAVELENGTH_RANGE
    wrong = ~((scan.wavelength >= low) & (scan.wavelength <= high))
    if wrong.any():
        value = scan.wavelength[np.argmax(wrong)]
        problem = f"expected a wavelength in [{low}, {high}] um, got {value:.9g} um"
        cure = "Give micrometres: 532 nm are 0.532."
        raise scan.fault(wrong, "wavelength", problem, cure)


def _check_values(scan: Scan) -> None:
    # Standard errors first: the limits of the values rest on them
    for name in sorted(scan.values, key=lambda name: not name.endswith(STDERR)):
        values = scan.values[name]
        infinite = np.isinf(values)
        if infinite.any():
            raise scan.fault(infinite, name, "expected a finite number, got inf", _LEAVE)
        far = np.abs(values) > _BRIGHTEST
        if far.any() and scan.quantity != "relative":
            problem = f"expected at most {_BRIGHTEST:g}, got {values[np.argmax(far)]:.6g}"
            cure = "No surface is so bright; declare counts by --quantity relative."
            raise scan.fault(far, name, problem, cure)
        if name in ("M00", *INTENSITIES):
            _refuse_marks(scan, name)
        if name in ("M00", "DOLP", *INTENSITIES) or name.endswith(STDERR):
            negative = values < -_noise(scan, name)
            if negative.any():
                value = values[np.argmax(negative)]
                problem = f"expected a value >= 0, got {value:.9g}"
                cure = _negative_cure(name, value)
                # A polariser leaves light, but an offset may be more than that
                if name == "M00" and negative.sum() > max(
                    0.5 * np.isfinite(values).sum(), 2.0
                ):
                    cure = "Of logarithms or decibels write the numbers themselves."
                raise scan.fault(negative, name, problem, cure)
        if name.endswith(STDERR) and name.removesuffix(STDERR) not in scan.values:
            problem = f"expected a column {name.removesuffix(STDERR)} beside it, found none"
            cure = "A standard error needs its value."
            raise DataFileError(scan.path, problem, cure, column=name)
    if all(np.isnan(values).all() for values in scan.values.values()):
        problem = "expected measured values, every cell is empty"
        raise DataFileError(scan.path, problem, "Export the scan again.")
    _check_errors(scan)
    _check_normalisation(scan)


def _check_errors(scan: Scan) -> None:
    """Refuse standard errors that mostly exceed the brightest reading: per cent, mostly."""
    for name, values in scan.values.items():
        error = scan.values.get(name + STDERR)
        ratio = name in RATIOS
        if error is None or not np.isfinite(error).any() or (
            not ratio and name not in ("M00", *INTENSITIES)
        ):  # fmt: skip
            continue
        most = 1.0 if ratio else float(np.nanmax(np.abs(values), initial=0.0))
        typical = float(np.nanmedian(error))
        if most > 0.0 and typical > most:
            below = "1" if ratio else f"the brightest reading, {most:.4g}"
            problem = f"expected standard errors below {below}, got mostly {typical:.4g}"
            column = scan.names.get(name + STDERR, name + STDERR)
            cure = (
                "Of errors in per cent of each reading write the errors themselves; or "
                f"leave the column out, --columns {column}=ignore."
            )
            raise scan.fault(error > most, name + STDERR, problem, cure)


def _refuse_marks(scan: Scan, name: str) -> None:
    """Refuse 9999 and the like, far above all other readings: marks of gaps."""
    values = scan.values[name]
    nines = np.isin(np.round(values, 6), [10.0**k - 1.0 for k in range(2, 10)])
    others = values[~nines & np.isfinite(values)]
    marks = nines & (values > 10.0 * np.max(others, initial=0.0))
    if others.size and marks.any():
        problem = (
            f"expected a reading, got {values[np.argmax(marks)]:g} beside at most "
            f"{others.max():.4g}"
        )
        raise scan.fault(marks, name, problem, "If it marks a gap, leave the cell empty.")


_LEAVE = "Leave what was not measured empty."


def _negative_cure(name: str, value: float) -> str:
    """How to mend a value below zero."""
    if set(f"{value:g}") <= {"-", "9"} or value in (-1.0, -8888.0, -1e30):
        return f"If {value:g} marks a gap, leave the cell empty."
    if name.endswith(STDERR):
        return _LEAVE
    if name == "DOLP":
        return "A signed Q/I is m10 = M10/M00: name the column so."
    if name in INTENSITIES:
        return (
            "A dark signal too large, or of another setting, was subtracted: take that of "
            f"the same setting. Readings below zero within their noise, {name}{STDERR}, "
            "are kept."
        )
    return (
        f"Readings below zero within their noise are kept: give it as {name}{STDERR}. "
        "Leaving them out biases a fit."
    )


def _noise(scan: Scan, name: str) -> np.ndarray:
    """Return how far below zero noise may take each reading: five standard errors."""
    values = scan.values[name]
    if name.endswith(STDERR) or name == "DOLP":
        return np.zeros(values.size)
    stated = scan.values.get(name + STDERR, np.full(values.size, np.nan))
    darkest = _DARK * np.nanmax(values, initial=0.0)
    scatter = _FAR * np.nan_to_num(errors_of(scan, name))
    return np.where(np.isfinite(stated), _FAR * stated, np.maximum(darkest, scatter))


def _check_normalisation(scan: Scan) -> None:
    """Refuse elements divided by M00, or percent: no element exceeds M00 but by noise."""
    intensity = scan.values.get("M00")
    if intensity is None:
        return
    own = np.nan_to_num(errors_of(scan, "M00"))
    for name in ELEMENTS[1:]:
        if name not in scan.values:
            continue
        error = np.hypot(np.nan_to_num(errors_of(scan, name)), own)
        larger = np.abs(scan.values[name]) > intensity + _FAR * error
        compared = np.isfinite(scan.values[name]) & np.isfinite(intensity)
        if compared.any() and larger.sum() > 0.5 * compared.sum():
            row = int(np.argmax(larger))
            problem = (
                f"expected an element in 1/sr, at most M00 = {intensity[row]:.6g}, "
                f"got {scan.values[name][row]:.6g}"
            )
            cure = "If the elements are divided by M00, give --normalised."
            raise scan.fault(larger, name, problem, cure)
        impossible = _beyond(scan, name, intensity, error)
        if impossible.any():
            row = int(np.argmax(impossible))
            problem = (
                f"expected at most M00 = {intensity[row]:.6g} in size, got "
                f"{scan.values[name][row]:.6g}, which no surface reflects"
            )
            cure = f"Mend the row. {_LEAVE}"
            others = [scan.values[n] for n in ELEMENTS[1:] if n in scan.values]
            if max(np.nanmax(np.abs(v), initial=0.0) for v in others) <= 1.0:
                cure = f"If the elements are divided by M00, give --normalised. {cure}"
            raise scan.fault(impossible, name, problem, cure)


def _check_ratios(scan: Scan) -> None:
    """Refuse a ratio to M00 that no surface reflects, or per cent."""
    for name in NORMALISED:
        if name not in scan.values:
            continue
        values = scan.values[name]
        error = np.nan_to_num(scan.values.get(name + STDERR, np.zeros(values.size)))
        wrong = np.abs(values) > np.where(error > 0, 1.02 + 5.0 * error, 2.0)
        if wrong.any():
            problem = (
                f"expected an element divided by M00, in [-1, 1], got "
                f"{values[np.argmax(wrong)]:.6g}"
            )
            cure = f"In 1/sr its name is {name.upper()}; divide per cent by 100."
            raise scan.fault(wrong, name, problem, cure)


def _beyond(scan: Scan, name: str, intensity: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Tell where an element exceeds M00 by more than its error can explain.

    Where neither file nor scatter tells errors, a factor of two above what a detector sees.
    """
    size = np.abs(scan.values[name])
    floor = _DARK * np.nanmax(intensity, initial=0.0)
    stated = np.zeros(size.size, dtype=bool)
    for column in (name + STDERR, "M00" + STDERR):
        stated |= np.nan_to_num(scan.values.get(column, np.zeros(size.size))) > 0.0
    beyond = size > 1.02 * intensity + _FAR * error
    twice = size > 2.0 * np.abs(intensity) + floor
    return np.asarray(np.where(stated, beyond, beyond & twice))
