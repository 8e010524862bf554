"""Units that stand in or beside the name of a column, whatever the name means."""

import re
from typing import NamedTuple

from pbrdf.optics.published.columns import unit_of

__all__ = [
    "ANGLE_UNITS",
    "Written",
    "bare_name",
    "is_logarithm",
    "unit_named",
    "written_units",
]

ANGLE_UNITS = {
    **dict.fromkeys(("deg", "degree", "degrees", "°", "º"), "deg"),
    **dict.fromkeys(("rad", "radian", "radians"), "rad"),
}
_PER_CENT = (
    "%", "percent", "per cent", "pct", "percents", "percentage", "prozent", "in %",
    "in percent", "in per cent",
)  # fmt: skip
_PER_SR = re.compile(r"(?:1?/|per)(?:sr|steradians?)|sr(?:\^|\*\*)?[-\u2212]1|sr⁻¹")
# What may stand behind a name without brackets and is nothing but a unit
_BEHIND = re.compile(
    r"^(.*[^\d\s_/,.-])(?:[\s_/,]+|(?=[%°º]))(%|°|º|deg|degrees?|[mu]?rads?|"
    r"(?:milli)?radians?|gons?|grads?|gradians?|turns?|arcmin|arcsec|nm|um|µm|μm|"
    r"angstroms?|(?:in )?per ?cent|in %|percents|percentage|pct|prozent|‰|ppm|"
    r"per ?mille|promille|[mµu]V|a\.u\.?|[x×*·] ?10+|[x×*·]? ?10(?:\^[-+]?|[-+])\d+|"
    r"\d?e[-+]\d+|(?:(?:10\^|\d?e)[-+]?\d+ ?)?1?/ ?[mµuk]?sr|[mµuk]?sr\^?-1)$|"
    r"^(.*\d)[\s_]+(%|percent|pct)$",
    re.IGNORECASE,
)
_BASE = (
    r"sr|rads?|deg|gons?|grad(?:ian)?s?|turns?|steps?|per ?mille|promille|arcmin|arcsec|eV|"
    r"Hz|W|V|A|J|K|m|s|g|cts?|counts?|ppm|dB|bits?|px|a\.?u\.?|"
    r"arb\.?(?: ?u(?:nits?)?\.?)?|inch|in|mil|°|%|‰|lm|lx|cd|rel\.?|relative"
)
_POWER = r"(?:\^?[-+\u2212⁻]?[\d⁰¹²³⁴]+|[⁻¹²³]+)?"
_ONE = rf"(?:[fpnuµμmckMGT]?(?:{_BASE}){_POWER}|1)"
_UNIT = re.compile(rf"{_ONE}(?:(?: ?[*·/.] ?| ){_ONE})*|/ ?{_ONE}")
# "x 1000", "10^-3", "1e-3", "E-3"
_SCALE = re.compile(
    r"(?:[x×*·/]? ?(?:10+|10 ?(?:(?:\^|\*\*) ?[-+\u2212]?|[-+\u2212])\d+|"
    r"10[⁻⁺]?[¹²³⁴⁵⁶⁷⁸⁹]|\d?(?:\.\d+)?[eE][-+]?\d+)|[x×*·/] ?\d+)"
    rf"(?:[ ·*/]*(?:{_UNIT.pattern}))?"
)
# Of these single letters polarisations are meant
_NO_UNIT = ("s", "p", "h")


class Written(NamedTuple):
    """A name without its units, and these, each in one spelling, "1" for none."""

    name: str
    units: tuple[str, ...]


def unit_named(text: str) -> str | None:
    """Return a unit in one spelling, or None of a text that is none.

    Examples
    --------
    >>> unit_named("degrees"), unit_named("sr^-1"), unit_named("pct"), unit_named("Å")
    ('deg', '1/sr', '%', 'angstrom')
    >>> unit_named("1/msr"), unit_named("x 100"), unit_named("450 nm"), unit_named("BRDF")
    ('1/msr', 'x 100', None, None)
    """
    bare = text.strip().strip("[]()").strip()
    key = bare.lower()
    if key in ("", "-", "1", "–", "—"):
        return "1"
    if key in _PER_CENT:
        return "%"
    if _PER_SR.fullmatch(key.replace(" ", "")):
        return "1/sr"
    if key in _NO_UNIT:
        return None
    known = ANGLE_UNITS.get(key) or unit_of(bare)
    return known or (bare if _UNIT.fullmatch(bare) or _SCALE.fullmatch(bare) else None)


def split_bracket(name: str) -> tuple[str, str] | None:
    """Split what stands in the last brackets behind a name from it, or return None.

    Examples
    --------
    >>> split_bracket("R (450 nm) [%]"), split_bracket("[deg]")
    (('R (450 nm)', '%'), None)
    """
    name = name.strip()
    start = max(name.rfind("["), name.rfind("("))
    inside = name[start + 1 : -1]
    if start < 1 or name[-1] not in "])" or {*inside} & {*"])"}:
        return None
    head = name[:start].rstrip()
    return (head, inside.strip()) if head else None


def written_units(name: str) -> Written:
    """Take from a name the units in brackets behind it, and one that ends it.

    Examples
    --------
    >>> written_units("wavelength_nm [um]")
    Written(name='wavelength', units=('um', 'nm'))
    >>> written_units("R (450 nm) [%]"), written_units("R_s").units
    (Written(name='R (450 nm)', units=('%',)), ())
    """
    units = []
    while found := split_bracket(name):
        unit = unit_named(found[1])
        if unit is None and not _is_unit_by_place(name, found[1]):
            break
        units.append(unit or found[1])
        name = found[0]
    behind = _BEHIND.match(name.strip())
    if behind:
        unit = behind[2] or behind[4]
        units.append(unit_named(unit) or unit)
        name = behind[1] or behind[3]
    return Written(name.strip(), tuple(dict.fromkeys(units)))


def spectral_unit_behind(name: str) -> str | None:
    """Return the unit that ends the name of a column of wavelengths, or None.

    Examples
    --------
    >>> spectral_unit_behind("L_A"), spectral_unit_behind("E/eV"), spectral_unit_behind("A")
    ('angstrom', 'ev', None)
    """
    words = re.split(r"[\s_/,]+", name.strip())
    # "lambda_a" is rather one of several
    return unit_of(words[-1]) if len(words) > 1 and words[-1] != "a" else None


def is_logarithm(unit: str) -> bool:
    """Tell whether a unit is one of logarithms, whose numbers are no multiples.

    >>> is_logarithm("dB"), is_logarithm("log10(1/sr)"), is_logarithm("lm")
    (True, True, False)
    """
    return unit.lower().startswith(("db", "log", "lg", "ln"))


def _is_unit_by_place(name: str, text: str) -> bool:
    """Tell whether a word in square brackets is a unit that nobody knows.

    >>> _is_unit_by_place("AOI [steps]", "steps"), _is_unit_by_place("u(BRDF)", "BRDF")
    (True, False)
    """
    word = text.lower() not in _NO_UNIT and not re.search(r"\d\s*(?:nm|[uµμ]m)$|=", text)
    return word and name.rstrip().endswith("]")


def bare_name(name: str) -> str:
    """Return a name without units in brackets behind it, as one types it.

    Examples
    --------
    >>> bare_name("M00 [1/sr]"), bare_name("[deg]"), bare_name("u(BRDF)")
    ('M00', '[deg]', 'u(BRDF)')
    """
    while found := split_bracket(name):
        if unit_named(found[1]) is None and not _is_unit_by_place(name, found[1]):
            break
        name = found[0]
    return name
