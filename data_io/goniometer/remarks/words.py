"""What one remark of a scan says: quantity, polarisation, azimuth, gain.

Its punctuation does not matter: a mark of comments, quotation marks, cells of its own; a
colon, an equals sign, a separator or nothing behind the name.
"""

import math
import re
from typing import NamedTuple

from data_io.goniometer.declarations import QUANTITY_NAMES

__all__ = [
    "POLARISATIONS", "UNPOLARISED", "Quantity", "azimuth_of", "bare_quantity_of", "gain_of",
    "plain", "polarisation_of", "quantity_of",
]  # fmt: skip

# Light along e_s and along e_p, or words of which nobody knows which is which
POLARISATIONS = {
    "s": "s", "te": "s", "perpendicular": "s", "perp": "s", "senkrecht": "s", "s-pol": "s",
    "p": "p", "tm": "p", "parallel": "p", "par": "p", "p-pol": "p",
    "ss": "ss", "sp": "sp", "ps": "ps", "pp": "pp",
    "co": "co", "cross": "cross", "co-pol": "co", "cross-pol": "cross",
    "copolarised": "co", "copolarized": "co",
}  # fmt: skip
UNPOLARISED = {"u", "unpol", "unpol.", "unpolarised", "unpolarized", "none"}
# What is longer is no setting, and may be a line without end
_LONGEST = 400
# Of a number no more digits are looked at, in so much of a remark
_DIGITS, _CUT = re.compile(r"(\d{40})\d+"), 5000
_QUANTITY = re.compile(
    r"(?P<key>(?:measured |measurement )?(?:quantity|type|values?)|data type)\b"
    r"\s*(?P<mark>[:=;,|\t]?)\s*(?P<value>.+)",
    re.IGNORECASE,
)
_PER_CENT = re.compile(r"%|\bper ?cent\b", re.IGNORECASE)
_NAMES = {
    "brf": "reflectance-factor", "bidirectional-reflectance-factor": "reflectance-factor",
    "bsdf": "brdf", "bidirectional-reflectance-distribution-function": "brdf",
    "brdf*cos": "brdf-cos", "cosine-corrected-brdf": "brdf-cos",
    **{name: name for name in QUANTITY_NAMES},
}  # fmt: skip

_LINEAR = re.compile(r"(?<![\w-])([sp])[\s-]*pol(?:ari[sz]|\b)", re.IGNORECASE)
_BOTH = re.compile(r"\bs\s*(?:and|or|,|/|\+|&)\s*p\b", re.IGNORECASE)
_POLARISER = re.compile(
    r"\b(?:pol|polari[sz]ation|polari[sz]er|analy[sz]er)"
    r"(?:[ _]+(?:of|the|source|incident|state|angle|detector|detection|light|laser|deg))*"
    r"\s*[:=;,|\s]\s*(-?\d+(?:[.,]\d+)?|[a-z.-]+)"
    r"(?=\s*(?:$|[.;)\]°]|deg|pol|\(?(?:light|source|incident|analy|detect)))",
    re.IGNORECASE,
)
_LETTERS = {"h": "h", "v": "v", "horizontal": "h", "vertical": "v"}
_AZIMUTH = re.compile(
    r"\b(?:(?P<source>phi_?i(?:_(?P<of_name>deg|rad))?)"
    r"|(?P<sample>sample[ _]?(?:azimuth|rotation)|rotation|azimuth))"
    r"(?:\s*[\[(](?P<of_key>deg|rad|°)[\])])?\s*[:=;,|]?\s*"
    r"(?P<value>[-+]?\d+(?:[.,]\d+)?)(?:\s*(?P<unit>deg|rad|°))?"
    r"\w*\s*(?:$|[,;.)\]](?!\d))",
    re.IGNORECASE,
)
_GAIN = re.compile(r"\bgain\s*[:=;,]?\s*[x×]?\s*(\d+(?:[.,]\d+)?)", re.IGNORECASE)


class Quantity(NamedTuple):
    """One of `QUANTITY_NAMES`, or what nobody knows; in per cent or not."""

    name: str
    per_cent: bool = False


def plain(text: str) -> str:
    """Return a remark without marks of comments and quotation marks."""
    text = _DIGITS.sub(r"\1", text.strip()[:_CUT])
    return text[:_LONGEST].lstrip("#%!/;' \t").replace('"', "").rstrip(",; \t")


def quantity_of(text: str) -> Quantity | None:
    """Return the quantity that a remark names, in the spelling of the options.

    Examples
    --------
    >>> quantity_of('"Quantity";"Reflectance factor (%)"')
    Quantity(name='reflectance-factor', per_cent=True)
    >>> quantity_of("quantity: radiance").name
    'radiance'
    >>> quantity_of("quantity of paint 3 g")
    """
    match = _QUANTITY.fullmatch(plain(text))
    if match is None:
        return None
    name = _quantity_name(match["value"])
    sure = "quantity" in match["key"].lower() and match["mark"] not in ("", ",")
    if name not in QUANTITY_NAMES and not sure:
        return None
    return Quantity(name, bool(_PER_CENT.search(match["value"])))


def bare_quantity_of(text: str) -> Quantity | None:
    """Return the quantity that a remark among rows names, also without a word before it.

    Examples
    --------
    >>> bare_quantity_of("# reflectance factor below").name
    'reflectance-factor'
    >>> bare_quantity_of("# BRDF of the dark side")
    """
    said = quantity_of(text)
    bare = re.sub(r"\s+(?:below|from here)\b.*", "", plain(text), flags=re.IGNORECASE)
    name = _quantity_name(bare)
    if said or name not in QUANTITY_NAMES:
        return said
    return Quantity(name, bool(_PER_CENT.search(text)))


def _quantity_name(text: str) -> str:
    bare = _PER_CENT.sub("", re.sub(r"\s*[\[(#].*|\s+in (?=%|per)", "", text))
    name = re.sub(r"[\s_-]+", "-", bare.strip().rstrip(".")).lower().strip("-")
    return _NAMES.get(name, name)


def polarisation_of(text: str) -> str | None:
    """Return the polarisation of source or analyser that a remark names, if it is one.

    Examples
    --------
    >>> polarisation_of("# Polarization: p"), polarisation_of("s-polarised laser")
    ('p', 's')
    >>> polarisation_of("polarizer 90 deg"), polarisation_of("# TE"), polarisation_of("# H")
    ('90', 's', None)
    >>> polarisation_of("mean of s-polarised and p-polarised readings")
    """
    bare = plain(text)
    word = bare.lower()
    if word in POLARISATIONS:
        return POLARISATIONS[word]
    if _BOTH.search(bare):
        return None
    found = {match.lower() for match in _LINEAR.findall(bare)}
    for said in _POLARISER.findall(bare):
        key = said.lower().strip(".")
        if key in UNPOLARISED:
            found.add("unpolarised")
        elif key[-1:].isdigit():
            found.add(f"{float(key.replace(',', '.')):g}")
        elif key in POLARISATIONS or key in _LETTERS:
            found.add(POLARISATIONS.get(key) or _LETTERS[key])
    if re.search(r"\bunpol", bare, re.IGNORECASE):
        found.add("unpolarised")
    return found.pop() if len(found) == 1 else None


def azimuth_of(text: str) -> tuple[str, float | None, str] | None:
    """Return the name of the angle of a remark, its size, and its words. [deg]

    It is ``phi_i``, ``sample_rotation``, or ``azimuth`` and ``rotation`` of who knows what;
    of a fraction without a unit the size is None.

    Examples
    --------
    >>> azimuth_of("# phi_i = 90"), azimuth_of("phi_i: 1.5")
    (('phi_i', 90.0, '90'), ('phi_i', None, '1.5'))
    """
    match = _AZIMUTH.search(plain(text))
    if match is None:
        return None
    name = "phi_i"
    if match["sample"]:
        word = match["sample"].lower()
        name = "sample_rotation" if word.startswith("sample") else word
    unit = (match["unit"] or match["of_key"] or match["of_name"] or "").lower()
    value = float(match["value"].replace(",", "."))
    words = f"{match['value']} {unit}".strip()
    if not unit and value % 1.0:
        return name, None, words
    return name, math.degrees(value) if unit == "rad" else value, words


def gain_of(text: str) -> str | None:
    """Return the gain of the detector that a remark names.

    Examples
    --------
    >>> gain_of("# gain x10"), gain_of("# gain: 1"), gain_of("# again")
    ('10', '1', None)
    """
    match = _GAIN.search(plain(text))
    return match[1] if match else None
