"""What was written behind an option: numbers, angles, names of files."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

__all__ = [
    "angles",
    "azimuths",
    "form",
    "incidences",
    "names",
    "numbers",
    "picture",
    "recorded",
    "result_file",
    "wavelengths",
]

# Options whose unit is part of their name on the command line
_UNITS = {
    "wavelength": "wavelength_um",
    "spacing": "spacing_um",
    "blocked": "blocked_deg",
    "source_half_angle": "source_half_angle_deg",
    "detector_half_angle": "detector_half_angle_deg",
}
# What has no part in the numbers, or is recorded with a hash
_UNRECORDED = {
    "scans",
    "scan",
    "surface",
    "scene",
    "source",
    "material_file",
    "output",
    "force",
    "workers",
}


def recorded(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of a command by the names that say their units."""
    kept = {name: value for name, value in given.items() if name not in _UNRECORDED}
    return {_UNITS.get(name, name): value for name, value in kept.items()}


def result_file(target: Path) -> Path:
    """Return the name of a result file.

    Raises
    ------
    ValueError
        If its ending is that of another format than the one that is written.
    """
    if target.suffix not in (".nc", ".zarr"):
        msg = (
            "--output must end in .nc (netCDF) or .zarr (a store), got "
            f"{target.name!r}. No other is written."
        )
        raise ValueError(msg)
    return target


def picture(target: Path, option: str = "--output") -> Path:
    """Return the name of a figure.

    Raises
    ------
    ValueError
        If its ending is none that figures are written by.
    """
    from matplotlib.backend_bases import FigureCanvasBase

    known = FigureCanvasBase.get_supported_filetypes()
    if target.suffix[1:].lower() not in known:
        others = ", ".join(f".{end}" for end in known if end not in ("png", "pdf", "svg"))
        msg = (
            f"{option} must end in .png, .pdf, .svg or another of {others}, got "
            f"{str(target)!r}."
        )
        raise ValueError(msg)
    return target


def names(text: str) -> tuple[str, ...]:
    """Return the names of a list separated by commas."""
    return tuple(word.strip() for word in text.split(",") if word.strip())


def numbers(text: str, option: str) -> list[float]:
    """Return the numbers of a list separated by commas.

    Raises
    ------
    ValueError
        If a word is no number, or there is none.
    """
    if not names(text):
        msg = f"{option} must be numbers separated by commas, got {text!r}."
        raise ValueError(msg)
    found = []
    for word in names(text):
        try:
            found.append(float(word))
        except ValueError:
            msg = f"{option} must be numbers separated by commas, got {word!r} in {text!r}."
            raise ValueError(msg) from None
    return found


def wavelengths(text: str | None) -> list[float] | None:
    """Return the wavelengths of a list, None without one. [um]"""
    return None if text is None else numbers(text, "--wavelength-um")


def incidences(text: str) -> list[float]:
    """Return zenith angles of a list in degrees. [rad]

    Raises
    ------
    ValueError
        If one is not below the horizon's 90 degrees.
    """
    return angles(text, "--theta-i-deg", below=90.0)


def angles(text: str, option: str, *, below: float) -> list[float]:
    """Return the angles of a list in degrees, from 0 on and below a limit. [rad]

    Raises
    ------
    ValueError
        If one is not.
    """
    found = numbers(text, option)
    for value in found:
        if not 0.0 <= value < below:
            msg = f"{option} must lie in [0, {below:g}) degrees, got {value:g} in {text!r}."
            raise ValueError(msg)
    return [math.radians(value) for value in found]


def azimuths(text: str) -> "str | float | list[float]":
    """Return "uniform", one azimuth, or a list of several. [rad]"""
    if text.strip() == "uniform":
        return "uniform"
    found = [math.radians(value) for value in numbers(text, "--phi-i-deg")]
    return found[0] if len(found) == 1 else found


def form(text: str) -> str | int:
    """Return the degree of a polynomial as a number, any other form as it is."""
    return int(text) if text.isdigit() else text
