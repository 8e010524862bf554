"""Length units, as headers of text files and callers name them."""

import math
import re
import warnings
from pathlib import Path

from pbrdf.errors import DataFileError


class MissingUnitWarning(UserWarning):
    """A file names no length unit and none was given: micrometres are assumed."""


# Sizes of the length units that headers and callers may name. [um]
LENGTH_UNITS = {
    "pm": 1e-6,
    "angstrom": 1e-4,
    "å": 1e-4,
    "nm": 1e-3,
    "um": 1.0,
    "micron": 1.0,
    "microns": 1.0,
    "mm": 1e3,
    "cm": 1e4,
    "m": 1e6,
    "uin": 0.0254,
    "mil": 25.4,
    "inch": 25400.0,
}
KNOWN_UNITS = "nm, um, mm, m"
# Sizes of the units of slope profiles. [rad]
ANGLE_UNITS = {
    "rad": 1.0,
    "mrad": 1e-3,
    "urad": 1e-6,
    "nrad": 1e-9,
    "deg": math.pi / 180,
    "degree": math.pi / 180,
    "degrees": math.pi / 180,
    "°": math.pi / 180,
    "arcmin": math.pi / 10_800,
    "arcsec": math.pi / 648_000,
}
_SPELLED = re.compile(r"^(nano|micro|milli|)(met(?:er|re)|rad(?:ian)?)s?$")
_SHORT = {"nano": "n", "micro": "u", "milli": "m", "": ""}
_OTHER_UNITS = {
    "px", "pixel", "pixels", "v", "mv", "s", "ms", "a.u.", "au", "arb. units", "in",
    "counts", "cts", "%", "°c", "hz", "um/mm", "nm/mm", "um/m",
}  # fmt: skip

_NAME = r"([A-Za-zµμÅå]+)"
# A unit in a header stands after an underscore (x_um), in brackets (z [nm], z (nm)), after
# a stroke (x/mm) or after the word itself (unit: nm)
_UNIT_IN_HEADER = re.compile(
    rf"_{_NAME}\b|[\[(]\s*{_NAME}\s*[\])]|/\s*{_NAME}\b|\bunits?\s*[:=]\s*{_NAME}\b"
)
_AXIS_UNIT = re.compile(rf"\b([xyz])[ _-]*units?\s*[:=]\s*{_NAME}", re.IGNORECASE)


def normalise_unit(name: str) -> str:
    """Return a length unit in lower case and with a plain u for micro."""
    key = name.strip().replace("µ", "u").replace("μ", "u").lower()
    spelled = _SPELLED.match(key)
    if spelled:
        return _SHORT[spelled[1]] + ("m" if spelled[2].startswith("m") else "rad")
    return key


def unit_factor(name: str) -> float:
    """Return the size of a length unit named by the caller. [um]"""
    key = normalise_unit(name)
    if key not in LENGTH_UNITS:
        msg = f"unit must be one of {KNOWN_UNITS}, got {name!r}. Name the unit in the file."
        raise ValueError(msg)
    return LENGTH_UNITS[key]


def unit_kind(name: str) -> str:
    """Tell what a unit measures: ``length``, ``angle``, ``other``; empty if unknown.

    Examples
    --------
    >>> unit_kind("microns"), unit_kind("µrad"), unit_kind("a.u."), unit_kind("raw")
    ('length', 'angle', 'other', '')
    """
    key = normalise_unit(name)
    kinds = {"length": LENGTH_UNITS, "angle": ANGLE_UNITS, "other": _OTHER_UNITS}
    return next((kind for kind, units in kinds.items() if key in units), "")


def unit_size(name: str) -> float:
    """Return the size of a unit of length [um] or of angle [rad]."""
    key = normalise_unit(name)
    return ANGLE_UNITS[key] if key in ANGLE_UNITS else unit_factor(name)


def warn_missing_unit(path: str | Path, *, stacklevel: int) -> None:
    """Say that a file without unit is taken as micrometres."""
    msg = (
        f"{Path(path).name}: no length unit is named, micrometres are assumed. "
        "Name units in the header (x_um,z_um), or give unit=."
    )
    warnings.warn(msg, MissingUnitWarning, stacklevel=stacklevel)


def header_units(text: str) -> list[str]:
    """Return the length units a header line names, in order of appearance.

    Examples
    --------
    >>> header_units("# x_um, z [nm] (dx assumed)")
    ['um', 'nm']
    """
    found = (normalise_unit("".join(names)) for names in _UNIT_IN_HEADER.findall(text))
    return [unit for unit in found if unit in LENGTH_UNITS]


def axis_units(texts: list[str]) -> dict[str, str]:
    """Return what lines such as "X unit: mm" say, by axis."""
    found = {
        axis.lower(): normalise_unit(name)
        for text in texts
        for axis, name in _AXIS_UNIT.findall(text)
    }
    return {axis: unit for axis, unit in found.items() if unit in LENGTH_UNITS}


def sole_unit(path: str | Path, texts: list[str]) -> str | None:
    """Return the one unit that lines about units, or without numbers, name.

    A line such as "Cut-off (mm): 0.8" is about something else than the columns.
    """
    about = [
        t for t in texts if re.search(r"\bunits?\b", t, re.I) or not re.search(r"\d", t)
    ]
    units = {unit for text in about for unit in header_units(text)}
    if len(units) > 1:
        problem = f"expected units that belong to columns, got {', '.join(sorted(units))}"
        raise DataFileError(path, problem, "Head the columns, for example x_um,z_nm.")
    return next(iter(units), None)
