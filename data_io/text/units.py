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
# Sizes of the units of slopes that are lengths over lengths. [1]
RATIO_UNITS = {
    f"{rise}/{run}": LENGTH_UNITS[rise] / LENGTH_UNITS[run]
    for rise in ("nm", "um", "mm", "m")
    for run in ("nm", "um", "mm", "m")
}
_SPELLED = re.compile(r"^(nano|micro|milli|)(met(?:er|re)|rad(?:ian)?)s?$")
_SHORT = {"nano": "n", "micro": "u", "milli": "m", "": ""}
_OTHER_UNITS = {
    "px", "pixel", "pixels", "v", "mv", "s", "ms", "a.u.", "au", "arb. units", "in",
    "counts", "cts", "%", "°c", "hz",
}  # fmt: skip

_NAME = r"([A-Za-zµμÅå]+)"
# A unit in a header stands after an underscore (x_um), in brackets (z [nm], z (nm)), after
# a stroke (x/mm) or after the word itself (unit: nm)
_UNIT_IN_HEADER = re.compile(
    rf"_{_NAME}\b|[\[(]\s*{_NAME}\s*[\])]|/\s*{_NAME}\b|\bunits?\s*[:=]\s*{_NAME}\b"
)
# What a remark says of an axis: "X unit: mm", "x, y in um", "height in nm", "z [nm]"
_HEIGHTS = "height heights elevation elevations depth depths topography value values data"
_AXIS = rf"(?:xy|[xyz]|laterally|lateral|{'|'.join(_HEIGHTS.split())})"
_SAID = rf"\s*(?:[:=]|(?:(?:are|is)\s+)?(?:(?:given|measured|stored)\s+)?\bin\b)\s*{_NAME}"
_AXIS_UNIT = re.compile(
    rf"(?<![A-Za-z])({_AXIS}(?:\s*(?:,|and|&)\s*{_AXIS})*)"
    r"(?:[ _-]*(?:units?|values?|data|coordinates?|axis|axes))*"
    rf"(?:{_SAID}|\s*[\[(]\s*{_NAME}\s*[\])]|_{_NAME}|\s*/\s*{_NAME})(?![\w-])",
    re.IGNORECASE,
)
_ALL_UNITS = re.compile(
    rf"(?:(?:^|[#%,;(])\s*units?|\b(?:lengths|everything|all(?: \w+)?)){_SAID}(?![\w-])",
    re.IGNORECASE,
)
_UNIT_OF = re.compile(r"\bunits? of (?:the )?", re.IGNORECASE)


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
    """Tell what a unit measures: ``length``, ``angle``, ``ratio``, ``other``, or nothing.

    Examples
    --------
    >>> unit_kind("microns"), unit_kind("µrad"), unit_kind("a.u."), unit_kind("raw")
    ('length', 'angle', 'other', '')
    """
    key = normalise_unit(name)
    kinds = {
        "length": LENGTH_UNITS, "angle": ANGLE_UNITS, "ratio": RATIO_UNITS,
        "other": _OTHER_UNITS,
    }  # fmt: skip
    return next((kind for kind, units in kinds.items() if key in units), "")


def unit_size(name: str) -> float:
    """Return the size of a unit of length [um], of angle [rad] or of a ratio [1]."""
    key = normalise_unit(name)
    if key in RATIO_UNITS:
        return RATIO_UNITS[key]
    return ANGLE_UNITS[key] if key in ANGLE_UNITS else unit_factor(name)


def warn_missing_unit(
    path: str | Path, *, stacklevel: int, example: str = "x_um,z_um"
) -> None:
    """Say that a file without unit is taken as micrometres."""
    msg = (
        f"{Path(path).name}: no length unit is named, micrometres are assumed. "
        f"Name units in the header ({example}), or give unit=."
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


def axis_units(path: str | Path, texts: list[str]) -> dict[str, str]:
    """Return what lines such as "X unit: mm" or "height in nm" say, by axis.

    Raises
    ------
    DataFileError
        If they name two units of one axis.

    Examples
    --------
    >>> axis_units("map.csv", ["# x, y in um, height in nm, step 1 um"])
    {'x': 'um', 'y': 'um', 'z': 'nm'}
    """
    found: dict[str, str] = {}
    for text in texts:
        for names, *units in _AXIS_UNIT.findall(_UNIT_OF.sub("", text)):
            unit = _said_unit("".join(units))
            if unit is None:
                continue
            for name in re.split(r"\s*(?:,|and\b|&)\s*", names.lower()):
                plane = name.startswith(("xy", "lateral"))
                for axis in "xy" if plane else name if name in ("x", "y") else "z":
                    known = found.setdefault(axis, unit)
                    _check_one(path, f"unit of {axis}", {known, unit})
    return found


def height_unit(path: str | Path, texts: list[str]) -> str | None:
    """Return the unit of the heights of a matrix that remarks of its header name.

    Raises
    ------
    DataFileError
        If they name several.
    """
    units = {u for axis, u in axis_units(path, texts).items() if axis == "z"}
    units |= common_units(texts)
    _check_one(path, "unit of heights", units)
    return next(iter(units), None)


def common_units(texts: list[str]) -> set[str]:
    """Return the units of everything that remarks name: "unit: nm", "all in um"."""
    rest = [_AXIS_UNIT.sub("", _UNIT_OF.sub("", text)) for text in texts]
    said = (_said_unit(name) for text in rest for name in _ALL_UNITS.findall(text))
    return {unit for unit in said if unit is not None}


def _said_unit(name: str) -> str | None:
    """Return the length unit of a remark; "Data: M 12" is of another kind."""
    unit = normalise_unit(name)
    return unit if unit in LENGTH_UNITS and name not in ("M", "PM") else None


def _check_one(path: str | Path, what: str, units: set[str]) -> None:
    """Refuse units of different size."""
    if len({LENGTH_UNITS[unit] for unit in units}) > 1:
        problem = f"expected one {what}, the header names {', '.join(sorted(units))}"
        raise DataFileError(path, problem, "Mend the header.")


def sole_unit(path: str | Path, texts: list[str]) -> str | None:
    """Return the one unit that lines about units, or without numbers, name.

    A line such as "Cut-off (mm): 0.8" is about something else than the columns.
    """
    about = [
        t for t in texts if re.search(r"\bunits?\b", t, re.I) or not re.search(r"\d", t)
    ]
    units = {unit for text in about for unit in header_units(text)}
    units |= common_units(texts)
    if len(units) > 1:
        problem = f"expected units that belong to columns, got {', '.join(sorted(units))}"
        raise DataFileError(path, problem, "Head the columns, for example x_um,z_nm.")
    return next(iter(units), None)
