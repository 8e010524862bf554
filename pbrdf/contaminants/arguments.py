"""Checks of what contaminants are given."""

from typing import Any

import numpy as np
import numpy.typing as npt

from pbrdf.errors import require
from pbrdf.optics import library
from pbrdf.optics.materials import Material

# Lengths beyond are slips of units [um]
LONGEST = 1e9
UNIT_CURE = "Lengths are micrometres, areas and volumes their powers."


def material_of(value: Material | str) -> Material:
    """Return a material, or that of a name in the library."""
    if isinstance(value, str):
        return library.get(value)
    if not isinstance(value, Material):
        msg = (
            "material must be a Material or the name of one, got "
            f"{type(value).__name__}. Write Material(n, kappa)."
        )
        raise TypeError(msg)
    return value


def positive(name: str, value: Any, unit: str = "um") -> float:
    """Return one positive finite number; lengths [um] end at a kilometre."""
    number = require(
        name, value, lambda v: (v > 0) & np.isfinite(v), f"be positive [{unit}]", UNIT_CURE
    )
    if number.ndim:
        msg = f"{name} must be one number [{unit}], got shape {number.shape}. {UNIT_CURE}"
        raise ValueError(msg)
    if unit == "um":
        require(name, number, lambda v: v <= LONGEST, "be at most 1e9 um, 1 km", UNIT_CURE)
    return float(number)


def angle(name: str, value: Any) -> float:
    """Return one contact angle. [rad]"""
    number = require(
        name, value, lambda v: (v >= 0) & (v <= np.pi), "lie in [0, 3.1416] rad",
        "Angles are radians; use np.deg2rad.",
    )  # fmt: skip
    if number.ndim:
        msg = f"{name} must be one angle [rad], got shape {number.shape}. Lay one each."
        raise ValueError(msg)
    return float(number)


def fraction(name: str, value: Any, highest: float = 1.0) -> float:
    """Return one number between 0 and `highest`, which may be reached."""
    number = require(
        name, value, lambda v: (v >= 0) & (v <= highest), f"lie in [0, {highest:g}] [1]",
        "It is a fraction.",
    )  # fmt: skip
    if number.ndim:
        msg = f"{name} must be one number [1], got shape {number.shape}. Lay one each."
        raise ValueError(msg)
    return float(number)


def choice(name: str, value: Any, known: tuple[Any, ...]) -> Any:
    """Return a value that must be one of a few."""
    # True and 1 are equal, so the type counts as well
    if not any(value == one and type(value) is type(one) for one in known):
        listed = ", ".join(repr(one) for one in known)
        msg = f"{name} must be one of {listed}, got {value!r}. Write one of them."
        raise ValueError(msg)
    return value


def places(value: npt.ArrayLike, columns: tuple[int, ...]) -> np.ndarray:
    """Return positions as an array (N, 2), or (N, 3) where allowed. [um]"""
    array = require("positions", value, np.isfinite, "be finite [um]", "Give x, y of each.")
    if array.ndim != 2 or array.shape[0] == 0 or array.shape[1] not in columns:
        allowed = " or ".join(f"(N, {count})" for count in columns)
        msg = (
            f"positions must have shape {allowed} with N > 0 [um], got shape "
            f"{array.shape}. One row for each body."
        )
        raise ValueError(msg)
    return frozen(array)


def per_body(name: str, value: npt.ArrayLike, count: int, unit: str) -> np.ndarray:
    """Return one positive value for each of `count` bodies."""
    array = require(
        name, value, lambda v: (v > 0) & np.isfinite(v), f"be positive [{unit}]", UNIT_CURE
    )
    if array.shape not in ((), (count,)):
        msg = (
            f"{name} must be a number or one for each of the {count} positions [{unit}], "
            f"got shape {array.shape}. Give as many as positions."
        )
        raise ValueError(msg)
    return frozen(np.broadcast_to(array, (count,)))


def frozen(array: np.ndarray) -> np.ndarray:
    """Return a copy that cannot be written to."""
    copy = np.array(array, dtype=np.float64)
    copy.setflags(write=False)
    return copy
