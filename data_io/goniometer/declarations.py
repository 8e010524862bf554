"""What the person who reads a file says about it, because the file does not."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pbrdf.errors import DataFileError
from pbrdf.files import read_toml

__all__ = ["QUANTITY_NAMES", "Declared", "declared", "read_mapping"]

QUANTITY_NAMES = ("brdf", "reflectance-factor", "brdf-cos", "relative")
_MAPPING_KEYS = (
    "columns", "azimuth_of_forward_deg", "angles", "quantity", "normalised",
    "source_half_angle_deg", "detector_half_angle_deg",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Declared:
    """Conventions of one file; None leaves it to the file.

    Attributes
    ----------
    columns : mapping of str to str
        Name in the file -> name of the project, or "ignore".
    azimuth_of_forward : float, optional
        Azimuth of the forward side, 0 or 180. [deg]
    angles : {"deg", "rad"}, optional
        Unit of all angles.
    quantity : str, optional
        One of `QUANTITY_NAMES`.
    normalised : bool, optional
        All elements but M00 are divided by it, or are not.
    source_half_angle, detector_half_angle : float, optional
        Half-angles of the cones of light. [deg]
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    azimuth_of_forward: float | None = None
    angles: str | None = None
    quantity: str | None = None
    normalised: bool | None = None
    source_half_angle: float | None = None
    detector_half_angle: float | None = None

    def words(self) -> str:
        """Return what was declared, for the record of the dataset."""
        said = []
        if self.columns:
            pairs = ",".join(f"{name}={meaning}" for name, meaning in self.columns.items())
            said.append(f"columns {pairs}")
        for name in ("azimuth_of_forward", "source_half_angle", "detector_half_angle"):
            value = getattr(self, name)
            if value is not None:
                said.append(f"{name} {value:g} deg")
        for name in ("angles", "quantity", "normalised"):
            value = getattr(self, name)
            if value is not None:
                said.append(f"{name} {str(value).lower()}")
        return "; ".join(said)


def declared(
    *,
    columns: Mapping[str, str] | str | Path | None,
    azimuth_of_forward: float | None,
    angles: str | None,
    quantity: str | None,
    normalised: bool | None,
    source_half_angle: float | None,
    detector_half_angle: float | None,
) -> Declared:
    """Check what was declared; angles in radians, as everywhere in Python.

    A mapping file gives what the other arguments do not.

    Raises
    ------
    ValueError
        If a word is none of those allowed.
    """
    given: dict[str, Any] = {
        "azimuth_of_forward": None
        if azimuth_of_forward is None
        else _turn(azimuth_of_forward),
        "angles": angles,
        "quantity": quantity,
        "normalised": normalised,
        "source_half_angle": _degrees("source_half_angle", source_half_angle),
        "detector_half_angle": _degrees("detector_half_angle", detector_half_angle),
    }
    _one_of("angles", angles, ("deg", "rad"))
    _one_of("quantity", quantity, QUANTITY_NAMES)
    if columns is None or isinstance(columns, Mapping):
        return Declared(columns=dict(columns or {}), **given)
    of_file = read_mapping(columns)
    return Declared(
        columns=of_file.columns,
        **{
            name: getattr(of_file, name) if value is None else value
            for name, value in given.items()
        },
    )


def read_mapping(path: str | Path) -> Declared:
    """Read conventions from a TOML file, for a series of files of one instrument.

    Keys: azimuth_of_forward_deg, angles, quantity, normalised, source_half_angle_deg,
    detector_half_angle_deg, and a table [columns] of names.

    Raises
    ------
    DataFileError
        If the file is not TOML, or a key is unknown or has a wrong value.
    """
    document = read_toml(path)
    unknown = [key for key in document if key not in _MAPPING_KEYS]
    if unknown:
        problem = f"expected known keys, got {', '.join(map(repr, unknown))}"
        raise DataFileError(path, problem, f"Known: {', '.join(_MAPPING_KEYS)}.")
    columns = document.get("columns", {})
    if not isinstance(columns, dict) or not all(
        isinstance(v, str) for v in columns.values()
    ):
        problem = "expected [columns] to be a table of names"
        raise DataFileError(path, problem, "Write AOI = 'theta_i_deg'.", column="columns")
    try:
        return declared(
            columns=columns,
            azimuth_of_forward=_radians(document, "azimuth_of_forward_deg"),
            angles=document.get("angles"),
            quantity=document.get("quantity"),
            normalised=document.get("normalised"),
            source_half_angle=_radians(document, "source_half_angle_deg"),
            detector_half_angle=_radians(document, "detector_half_angle_deg"),
        )
    except (TypeError, ValueError) as error:
        raise DataFileError(path, str(error).rstrip("."), "Mend the key.") from error


def _radians(document: Mapping[str, Any], key: str) -> float | None:
    value = document.get(key)
    if value is not None and (
        isinstance(value, bool) or not isinstance(value, int | float)
    ):
        msg = f"{key} must be a number, got {value!r}"
        raise ValueError(msg)
    return None if value is None else math.radians(value)


def _one_of(name: str, value: Any, allowed: tuple[str, ...]) -> None:
    if value is not None and value not in allowed:
        msg = f"{name} must be one of {', '.join(allowed)}, got {value!r}."
        raise ValueError(msg)


def _turn(azimuth: float) -> float:
    """Return 0 or 180 for an azimuth of 0 or pi. [deg]"""
    degrees = math.degrees(azimuth)
    for right in (0.0, 180.0):
        if abs(degrees - right) < 1e-9:
            return right
    msg = f"azimuth_of_forward must be 0 or pi rad (180 degrees), got {azimuth:g} rad."
    raise ValueError(msg)


def _degrees(name: str, angle: float | None) -> float | None:
    if angle is None:
        return None
    degrees = math.degrees(angle)
    if not 0 <= degrees <= 45:
        msg = f"{name} must lie in [0, 45] degrees, got {degrees:g}."
        raise ValueError(msg)
    return round(degrees, 12)
