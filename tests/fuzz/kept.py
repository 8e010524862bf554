"""Does what a reader returned stand in the file? Looked up with no code of the readers."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from pbrdf import Material

__all__ = ["check"]

_MARKS = re.compile(r"[,;|\s=\[\]]+")


def check(found: Any, path: Path) -> str | None:
    """Return what is wrong with a scan or with constants, None if nothing is."""
    if isinstance(found, Material):
        return _constants(found)
    if isinstance(found, xr.Dataset) and "geometry" in found.dims:
        return _physics(found) or _lines(found, path)
    return None


def _constants(found: Material) -> str | None:
    if not found.dispersive:
        return "constants without a wavelength"
    low, high = found.valid_range
    n, kappa = found.indices(np.linspace(low, high, 7))
    if not (low > 0.0 and np.isfinite(high)):
        return f"constants from {low} to {high} um"
    if not (np.isfinite(n).all() and np.isfinite(kappa).all()):
        return "constants that are not finite"
    if (n <= 0.0).any() or (np.asarray(kappa) < 0.0).any():
        return "constants below 0"
    return None


def _physics(found: xr.Dataset) -> str | None:
    for name in ("theta_i", "theta_s"):
        angle = found[name].values
        if not ((angle >= 0.0) & (angle <= np.pi / 2 + 1e-12)).all():
            return f"{name} outside 0 to 90 degrees"
    for name, values in {**found.data_vars, **found.coords}.items():
        if np.isinf(values.values).any():
            return f"{name} is infinite"
    if "wavelength" in found.coords and not (found.wavelength.values > 0.0).all():
        return "a wavelength of 0 or less"
    return None


def _lines(found: xr.Dataset, path: Path) -> str | None:
    """Look for M00 and the zenith of the detector on one line of a plain table."""
    text = _text(path)
    plain = found.attrs.get("quantity", "brdf") == "brdf" and "declared" not in found.attrs
    scaled = re.search(r"scale|I_s|rad|%", text or "")
    if text is None or not plain or scaled or "M00" not in found:
        return None
    lines = [_numbers(line) for line in text.splitlines()]
    zenith = np.rad2deg(found.theta_s.values)
    for value, angle in zip(found.M00.values, zenith, strict=True):
        if np.isnan(value):
            continue
        if not any(_holds(line, value) and _holds(np.abs(line), angle) for line in lines):
            return f"M00 = {value!r} at {angle:.6g} degrees stands on no line"
    return None


def _holds(numbers: np.ndarray, value: float) -> bool:
    return bool((np.abs(numbers - value) <= 1e-9 * abs(value) + 1e-9).any())


def _numbers(line: str) -> np.ndarray:
    """Return all numbers of a line, with decimal points or commas."""
    found = []
    for cells in (_MARKS.split(line), re.split(r"[;|\s]+", line.replace(",", "."))):
        for cell in cells:
            try:
                found.append(float(cell.strip("\"'")))
            except ValueError:
                continue
    return np.array(found)


def _text(path: Path) -> str | None:
    """Return the text of a table; None of what lays its numbers out otherwise."""
    content = path.read_bytes()
    if content[:1] == b"t" and content[:12] == b"tensor_file\0":
        return None
    # A text of two bytes a sign may have lost its mark of byte order
    codes = ["latin-1", *(["utf-16-le", "utf-16-be"] if b"\0" in content else [])]
    text = "\n".join(content.decode(code, errors="replace") for code in codes)
    # The mark is nothing wherever it stands
    text = text.replace("\ufeff", "")
    return None if path.suffix in (".bsdf", ".toml") else text
