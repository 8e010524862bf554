"""The checked rows of a goniometer file as a dataset."""

import warnings
from hashlib import sha256

import numpy as np
import xarray as xr

from data_io.goniometer.checks import check
from data_io.goniometer.scan import (
    CONVENTIONS,
    RATIOS,
    STDERR,
    ConventionWarning,
    Scan,
)

__all__ = ["to_dataset"]

_SAME_DEG = 1e-6
# Two computations of one value differ by this [largest value]
_ROUNDING = 1e-9
# Standard errors that are beyond noise
_FAR = 5.0
_OPTIONAL = {
    "phi_i": "azimuth of the source",
    "source_half_angle": "half-angle of the source",
    "detector_half_angle": "half-angle of the detector",
}


def to_dataset(scan: Scan) -> xr.Dataset:
    """Check a scan and return it as a dataset with the one dimension `geometry`.

    Raises
    ------
    DataFileError
        For the first row that breaks a rule: angles in range and in degrees, M00 >= 0,
        elements in 1/sr or divided by M00, 0 <= DOLP <= 1 and in agreement with M10, M20,
        standard errors >= 0, a plausible wavelength, and one value for one geometry.
    """
    check(scan)
    keep = _distinct(scan)
    coords = {
        "theta_i": ("geometry", np.radians(scan.theta_i[keep]), _angle("incident zenith")),
        "theta_s": ("geometry", np.radians(scan.theta_s[keep]), _angle("scattered zenith")),
        "dphi": ("geometry", wrap(scan.dphi[keep]), _angle("azimuth difference")),
    }
    if scan.wavelength is not None:
        units = {"units": "um", "long_name": "vacuum wavelength"}
        coords["wavelength"] = ("geometry", scan.wavelength[keep], units)
    for name, long_name in _OPTIONAL.items():
        angle = getattr(scan, name)
        if angle is not None:
            coords[name] = ("geometry", np.radians(angle[keep]), _angle(long_name))
    data = {
        name: ("geometry", values[keep], {"units": _units(name, scan.quantity)})
        for name, values in scan.values.items()
    }
    attrs: dict[str, object] = {
        "repeated_rows": len(scan.dphi) - len(keep),
        "source": scan.path.name,
        "sha256": sha256(scan.path.read_bytes()).hexdigest(),
        "conventions": CONVENTIONS,
        "quantity": scan.quantity,
    }
    return xr.Dataset(data, coords, attrs | dict(scan.attrs))


def wrap(dphi_deg: np.ndarray) -> np.ndarray:
    """Return azimuth differences in [0, 2 pi). [rad]"""
    return np.radians(np.mod(dphi_deg, 360.0))


def _angle(long_name: str) -> dict[str, str]:
    return {"units": "rad", "long_name": long_name}


def _units(name: str, quantity: str) -> str:
    ratio = name.removesuffix(STDERR) in RATIOS
    return "1" if ratio or quantity == "relative" else "sr-1"


def _distinct(scan: Scan) -> np.ndarray:
    """Return the rows to keep: the first of each geometry, if repeats say the same.

    A turn that ends where it began, at 0 and 360 degrees, repeats a reading within its
    standard error.
    """
    azimuths = [scan.dphi] + ([] if scan.phi_i is None else [scan.phi_i])
    others = [scan.theta_i, scan.theta_s]
    others += [] if scan.wavelength is None else [scan.wavelength]
    turns = np.rint(np.column_stack(azimuths) / _SAME_DEG).astype(np.int64)
    turns %= round(360.0 / _SAME_DEG)
    keys = np.column_stack([np.rint(np.column_stack(others) / _SAME_DEG), turns])
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    original = first[inverse.ravel()]
    closing = np.abs(scan.dphi - scan.dphi[original]) > 180.0
    noisy = np.zeros(original.size, dtype=bool)
    for name, values in scan.values.items():
        reference = values[original]
        apart = np.abs(values - reference)
        largest = max(
            np.nanmax(np.abs(scan.values.get(n, values)), initial=0.0)
            for n in (name, "M00")
        )
        equal = apart <= _ROUNDING * (1.0 if name in RATIOS else largest)
        equal |= np.isnan(values) & np.isnan(reference)
        error = scan.values.get(name + STDERR, np.zeros(values.size))
        within = apart <= _FAR * np.hypot(error, error[original])
        within |= np.full(values.size, name.endswith(STDERR))
        noisy |= ~equal & closing & within
        differs = ~equal & ~(closing & within)
        if differs.any():
            row = int(np.argmax(differs))
            problem = (
                f"expected one value a geometry, got {values[row]:.6g}, "
                f"line {scan.lines[original[row]]} has {reference[row]:.6g}"
            )
            cure = "Average repeats into one row with its standard error."
            if "left_out" in scan.attrs:
                cure = (
                    f"If the text of {scan.attrs['left_out']} tells the rows apart, give "
                    f"each kind a file. Else: {cure[0].lower()}{cure[1:]}"
                )
            raise scan.fault(differs, name, problem, cure)
    if noisy.any():
        row = int(np.argmax(noisy))
        msg = (
            f"{scan.path.name}: {noisy.sum()} readings repeat the direction of another a "
            f"turn apart, within their standard errors, first line {scan.lines[row]}; the "
            "first of each counts."
        )
        warnings.warn(msg, ConventionWarning, stacklevel=4)
    return np.sort(first)
