"""Wavelengths of light that a remark names, which has other lengths too."""

import re
from typing import NamedTuple

from data_io.goniometer.remarks.words import plain
from pbrdf.optics.published.columns import Column, unit_of

__all__ = ["LIGHT", "Wavelength", "doubtful_wavelength", "wavelengths_of"]

_NUMBER = r"(?<![\w.])(?<!\d,)(\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?)"
_UNIT = r"((?:1/|µ|μ)?[^\W\d_]+(?:\s?(?:\^|\*\*)?-1|⁻¹)?)"
# Units in the name of a wavelength, as in wavelength_nm
_HEADED = r"(nm|um|µm|μm|a|å|angstroms?|ev|cm-1|1/cm|thz)"
_IS = r"[\s:=;,|(\[]*"
# Words that may stand between the name of a wavelength and its number
_BETWEEN = (
    r"(?:\s*(?:\(?vacuum\)?|light|source|line|diode|is|was|of|at|in|used|nominal|red|green|"
    r"blue|lambda|λ|wavelength|he-?ne|nd:?yag|argon|ar)\b)*"
)
# What has a wavelength and is no light
_OTHER = (
    r"(?<!spatial )(?<!cut-off )(?<!cutoff )(?<!surface )(?<!roughness )(?<!design )"
    r"(?<!alignment )(?<!reference )(?<!calibration )(?<!blaze )(?<!ripple )"
)
_KEY = (
    rf"{_OTHER}\b(?:(?:laser[ _])?wavelength|lambda|laser|he-?ne|nd:?yag"
    r"|photon energy|wavenumber)"
    rf"(?![^\W\d_])|{_OTHER}λ"
)
_NAMED = re.compile(
    rf"(?:{_KEY})(?:[ _]*[\[(]?{_HEADED}[\])]?(?=[\s:=;,|]))?{_BETWEEN}{_IS}{_NUMBER}"
    rf"\s*{_UNIT}?(?!\w|\.\d|\s*(?:-|–|to\b|\.\.)\s*\d)",
    re.IGNORECASE,
)
_BEFORE = re.compile(
    rf"{_NUMBER}\s*{_UNIT}\s+(?:\w+\s+)?(?:laser|laser line|wavelength)\b"
    r"(?! ?(?:spot|beam))",
    re.IGNORECASE,
)
# "450 nm", "scan at 450 nm"
_BARE = re.compile(
    rf"(?:(?:scan|measured|now|filter|band|light|run|at|with)[\s:=]+)*{_NUMBER}\s*{_UNIT}"
    r"(?:\s+(?:filter|band|light|laser|line))?",
    re.IGNORECASE,
)
# What may be a wavelength, and may be a length of the sample
_LAST = re.compile(rf".*[,;\s]({_NUMBER}\s*(?:nm|um|µm))", re.IGNORECASE)
_LENGTHS = re.compile(
    r"thick|coat|film|layer|rough|rms|spot|beam|diam|pitch|period|particle|grain|height|"
    r"depth|step|width|range|length|cut-?off|lambda|slit|pinhole|aperture|distance",
    re.IGNORECASE,
)
# Light that anybody measures a BRDF with [um]
LIGHT = (0.05, 1000.0)


class Wavelength(NamedTuple):
    """A wavelength as it is written; its size, None without a unit or of no light. [um]"""

    words: str
    size: float | None


def wavelengths_of(text: str) -> list[Wavelength]:
    """Return the wavelengths of light that a remark names.

    A number counts behind the word wavelength, lambda or laser, before the word laser, and
    where the remark says nothing else: what is thick, rough or wide has a length too.

    Examples
    --------
    >>> wavelengths_of("# Light source: red laser (650 nm, 3.5 mm spot)")
    [Wavelength(words='650 nm', size=0.65)]
    >>> wavelengths_of('"Wavelength [nm]";"633"')
    [Wavelength(words='633 nm', size=0.633)]
    >>> [wave.size for wave in wavelengths_of("lambda: 0.45")]
    [None]
    >>> wavelengths_of("Cr coating 120 nm on glass")
    []
    """
    bare = plain(text)
    found: list[Wavelength] = []
    for match in _NAMED.finditer(bare):
        before, number, behind = match.groups()
        wave = _wavelength(number, behind or before or "")
        # "laser 5 mW", "laser 2": neither is a wavelength
        if wave and (wave.size or not re.match(r"laser\b(?!.wave)", match[0], re.I)):
            found.append(wave)
    pairs = _BEFORE.findall(bare)
    if alone := _BARE.fullmatch(bare):
        pairs.append(alone.groups())
    for number, unit in pairs:
        wave = _wavelength(number, unit)
        if wave and wave.size and unit_of(unit) not in ("m", "mm"):
            found.append(wave)
    return list(dict.fromkeys(found))


def doubtful_wavelength(text: str) -> str | None:
    """Return a length at the end of a remark that may be a wavelength, but does not say so.

    Examples
    --------
    >>> doubtful_wavelength("black paint, 650 nm"), doubtful_wavelength("a film, 90 nm")
    ('650 nm', None)
    """
    match = _LAST.fullmatch(plain(text))
    return match[1] if match and not _LENGTHS.search(text) else None


def _wavelength(number: str, unit: str) -> Wavelength | None:
    """Return a wavelength, None for a number with another unit or of another kind.

    One that no light has is without a size.
    """
    known = unit_of(unit) if unit else None
    if known is None:
        # "0.633 (laser)", "0.633 and", not "5 mW"
        other = re.fullmatch(r"[kmnuµ]?(?:W|J|s|Hz|rad|V)|deg", unit)
        return None if other else Wavelength(number, None)
    value = float(number.replace(",", "."))
    if value <= 0:
        return None
    size = float(Column("wavelength", "wavelength", known).to_um([value])[0])
    within = LIGHT[0] <= size <= LIGHT[1]
    return Wavelength(f"{number} {unit}", size if within else None)
