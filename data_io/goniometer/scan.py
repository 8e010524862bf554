"""Measured geometries and values in the conventions, and what makes them wrong."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import xarray as xr

from pbrdf.errors import DataFileError

ELEMENTS = tuple(f"M{i}{j}" for i in range(4) for j in range(4))
QUANTITIES = (*ELEMENTS, "DOLP")
STDERR = "_stderr"

# Angles below this many degrees, all of them, are radians under a wrong name
_RADIAN_LIMIT_DEG = 1.6
# Plausible wavelengths; 532 would be nanometres [um]
_WAVELENGTH_RANGE = (0.01, 100.0)
# Two columns of one quantity may differ by rounding and noise
_DOLP_TOLERANCE = 0.05
_SAME_DEG = 1e-6
# Part of the brightest reading below which noise may exceed the signal
_DARK = 1e-3

CONVENTIONS = (
    "Angles in rad, dphi = phi_s - phi_i, specular at dphi = pi. "
    "Stokes frames of the meridian planes, Q > 0 is s (perpendicular), "
    "V > 0 right-circular for the receiver. "
    "M in 1/sr without the cosine, M[out][in]. NaN: not measured."
)


@dataclass(frozen=True, kw_only=True)
class Scan:
    """Rows of a goniometer file, converted to the conventions but not yet checked.

    Attributes
    ----------
    path : Path
        The file.
    lines : sequence of int
        Line of each row.
    theta_i, theta_s, dphi : ndarray, shape (n,)
        Geometry; degrees, because the checks and their messages speak the file's language.
    values : mapping of str to ndarray, shape (n,)
        Quantities by name, M00..M33 and DOLP, and standard errors. [1/sr or 1]
    wavelength : ndarray, shape (n,), optional
        Vacuum wavelength. [um]
    names : mapping of str to str
        What the file calls the angles, for messages.
    attrs : mapping
        What the dataset keeps beside the numbers.
    """

    path: Path
    lines: Sequence[int]
    theta_i: np.ndarray
    theta_s: np.ndarray
    dphi: np.ndarray
    values: Mapping[str, np.ndarray]
    wavelength: np.ndarray | None = None
    names: Mapping[str, str] = field(default_factory=dict)
    attrs: Mapping[str, object] = field(default_factory=dict)

    def fault(
        self, rows: np.ndarray, column: str, problem: str, cure: str
    ) -> DataFileError:
        """Return the error for the first of the marked rows."""
        row = int(np.argmax(rows))
        name = self.names.get(column, column)
        return DataFileError(self.path, problem, cure, line=self.lines[row], column=name)


def to_dataset(scan: Scan) -> xr.Dataset:
    """Check a scan and return it as a dataset with the one dimension `geometry`.

    Raises
    ------
    DataFileError
        For the first row that breaks a rule: angles in range and in degrees, M00 >= 0,
        elements in 1/sr, 0 <= DOLP <= 1 and in agreement with M10, M20, standard errors
        >= 0, a plausible wavelength, and one value for one geometry.
    """
    _check_angles(scan)
    _check_wavelength(scan)
    _check_values(scan)
    _check_dolp(scan)
    keep = _distinct(scan)
    coords = {
        "theta_i": ("geometry", np.radians(scan.theta_i[keep]), _angle("incident zenith")),
        "theta_s": ("geometry", np.radians(scan.theta_s[keep]), _angle("scattered zenith")),
        "dphi": ("geometry", wrap(scan.dphi[keep]), _angle("azimuth difference")),
    }
    if scan.wavelength is not None:
        units = {"units": "um", "long_name": "vacuum wavelength"}
        coords["wavelength"] = ("geometry", scan.wavelength[keep], units)
    data = {
        name: ("geometry", values[keep], {"units": _units(name)})
        for name, values in scan.values.items()
    }
    attrs: dict[str, object] = {"source": scan.path.name, "conventions": CONVENTIONS}
    return xr.Dataset(data, coords, attrs | dict(scan.attrs))


def wrap(dphi_deg: np.ndarray) -> np.ndarray:
    """Return azimuth differences in [0, 2 pi). [rad]"""
    return np.radians(np.mod(dphi_deg, 360.0))


def _angle(long_name: str) -> dict[str, str]:
    return {"units": "rad", "long_name": long_name}


def _units(name: str) -> str:
    return "1" if name.startswith("DOLP") else "sr-1"


def _check_angles(scan: Scan) -> None:
    for column, low, high in (("theta_i", 0, 90), ("theta_s", 0, 90), ("dphi", -720, 720)):
        values = getattr(scan, column)
        wrong = ~((values >= low) & (values <= high))
        if wrong.any():
            value = values[np.argmax(wrong)]
            problem = f"expected an angle in [{low}, {high}] deg, got {value:.9g}"
            cure = (
                "Zeniths are counted from the normal; below the horizon is no reflection."
            )
            if column == "theta_i":
                cure = "theta_i is positive; signs belong to theta_view_deg or dphi_deg."
            raise scan.fault(wrong, column, problem, cure)
    cure = "Write degrees: 1.5708 rad are 90 deg."
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
    for name, values in scan.values.items():
        infinite = np.isinf(values)
        if infinite.any():
            raise scan.fault(infinite, name, "expected a finite number, got inf", _LEAVE)
        negative = values < 0
        if negative.any() and (name in ("M00", "DOLP") or name.endswith(STDERR)):
            value = values[np.argmax(negative)]
            problem = f"expected a value >= 0, got {value:.9g}"
            raise scan.fault(negative, name, problem, _LEAVE)
        if name.endswith(STDERR) and name.removesuffix(STDERR) not in scan.values:
            problem = f"expected a column {name.removesuffix(STDERR)} beside it, found none"
            cure = "A standard error needs its value."
            raise DataFileError(scan.path, problem, cure, column=name)
    if all(np.isnan(values).all() for values in scan.values.values()):
        problem = "expected measured values, every cell is empty"
        raise DataFileError(scan.path, problem, "Export the scan again.")
    _check_normalisation(scan)


_LEAVE = "Leave what was not measured empty."


def _check_normalisation(scan: Scan) -> None:
    """Refuse elements divided by M00, or percent: no element exceeds M00 but by noise."""
    intensity = scan.values.get("M00")
    if intensity is None:
        return
    for name in ELEMENTS[1:]:
        if name not in scan.values:
            continue
        margin = 5 * np.nan_to_num(scan.values.get(name + STDERR, np.zeros(intensity.size)))
        larger = np.abs(scan.values[name]) > intensity + margin
        compared = np.isfinite(scan.values[name]) & np.isfinite(intensity)
        if compared.any() and larger.sum() > 0.5 * compared.sum():
            row = int(np.argmax(larger))
            problem = (
                f"expected an element in 1/sr, at most M00 = {intensity[row]:.6g}, "
                f"got {scan.values[name][row]:.6g}"
            )
            cure = "Elements divided by M00 must be multiplied by it."
            raise scan.fault(larger, name, problem, cure)
        impossible = _beyond(scan, name, intensity)
        if impossible.any():
            row = int(np.argmax(impossible))
            problem = (
                f"expected at most M00 = {intensity[row]:.6g} in size, got "
                f"{scan.values[name][row]:.6g}, which no surface reflects"
            )
            raise scan.fault(impossible, name, problem, f"Mend the row. {_LEAVE}")


def _beyond(scan: Scan, name: str, intensity: np.ndarray) -> np.ndarray:
    """Tell where an element exceeds M00 by more than its error can explain.

    Where the file states no errors, a factor of two above what a detector still sees.
    """
    size = np.abs(scan.values[name])
    nothing = np.zeros(size.size)
    error = np.hypot(
        np.nan_to_num(scan.values.get(name + STDERR, nothing)),
        np.nan_to_num(scan.values.get("M00" + STDERR, nothing)),
    )
    floor = _DARK * np.nanmax(intensity, initial=0.0)
    stated = size > 1.02 * intensity + 5.0 * error
    unstated = size > 2.0 * intensity + floor
    return np.asarray(np.where(error > 0.0, stated, unstated))


def _check_dolp(scan: Scan) -> None:
    """DOLP is a fraction, and sqrt(M10^2 + M20^2) / M00 where these are given too."""
    dolp = scan.values.get("DOLP")
    if dolp is None:
        return
    noise = 5 * np.nan_to_num(scan.values.get("DOLP" + STDERR, np.zeros(dolp.size)))
    wrong = dolp > 1 + noise
    if wrong.any():
        problem = f"expected a fraction in [0, 1], got {dolp[np.argmax(wrong)]:.9g}"
        raise scan.fault(wrong, "DOLP", problem, "Divide per cent by 100.")
    if not {"M00", "M10", "M20"} <= scan.values.keys():
        return
    m00, m10, m20 = (scan.values[name] for name in ("M00", "M10", "M20"))
    lit = m00 > 0
    ratio = np.hypot(m10, m20)[lit] / m00[lit]
    for name in ("M10", "M20"):
        error = scan.values.get(name + STDERR, np.zeros(dolp.size))
        noise[lit] += 5 * np.nan_to_num(error[lit]) / m00[lit]
    wrong[lit] = np.abs(ratio - dolp[lit]) > _DOLP_TOLERANCE + noise[lit]
    if wrong.any():
        row = int(np.argmax(wrong))
        expected = np.hypot(m10[row], m20[row]) / m00[row]
        problem = f"expected sqrt(M10^2 + M20^2)/M00 = {expected:.4g}, got {dolp[row]:.4g}"
        raise scan.fault(wrong, "DOLP", problem, "Mend or drop one of the columns.")


def _distinct(scan: Scan) -> np.ndarray:
    """Return the rows to keep: the first of each geometry, if repeats say the same."""
    parts = [scan.theta_i, scan.theta_s, np.mod(scan.dphi, 360.0)]
    if scan.wavelength is not None:
        parts.append(scan.wavelength)
    keys = np.rint(np.column_stack(parts) / _SAME_DEG).astype(np.int64)
    keys[:, 2] %= round(360.0 / _SAME_DEG)
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    original = first[inverse.ravel()]
    for name, values in scan.values.items():
        reference = values[original]
        differs = (values != reference) & ~(np.isnan(values) & np.isnan(reference))
        if differs.any():
            row = int(np.argmax(differs))
            problem = (
                f"expected one value a geometry, got {values[row]:.6g}, "
                f"line {scan.lines[original[row]]} has {reference[row]:.6g}"
            )
            cure = "Average repeats into one row with its standard error."
            raise scan.fault(differs, name, problem, cure)
    return np.sort(first)
