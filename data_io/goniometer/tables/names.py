"""What the columns of a goniometer table mean: angle, wavelength, value, error, text."""

import re
from dataclasses import dataclass

from data_io.goniometer.scan import QUANTITIES, STDERR
from data_io.goniometer.tables.units import ANGLE_UNITS, split_bracket, unit_named
from data_io.text.text import LONGEST_NAME
from pbrdf.optics.published.columns import column_of, unit_of

__all__ = [
    "ANGLES", "IGNORE", "TARGETS", "Meaning", "meaning_of", "target_of",
]  # fmt: skip

# What a column may hold beside the quantities; sample_rotation turns the sample
ANGLES = (
    "theta_i", "theta_s", "dphi", "theta_view", "phi_i", "phi_s", "sample_rotation",
    "source_half_angle", "detector_half_angle",
)  # fmt: skip
IGNORE = "ignore"
_SAME_ANGLE = {
    "aoi": "theta_i", "angle of incidence": "theta_i", "incidence angle": "theta_i",
    "incident angle": "theta_i", "incident zenith": "theta_i", "thetai": "theta_i",
    "theta in": "theta_i", "theta r": "theta_s", "theta o": "theta_s",
    "thetas": "theta_s", "thetar": "theta_s", "theta out": "theta_s", "phii": "phi_i",
    "phis": "phi_s", "phir": "phi_s", "phi r": "phi_s", "phi o": "phi_s",
    "phi in": "phi_i", "phi out": "phi_s", "delta phi": "dphi",
}  # fmt: skip
# Stokes vector of the light from an unpolarised source; light behind a linear polariser at
# an angle from e_s
STOKES = ("S0", "S1", "S2", "S3")
POLARISERS = ("I0", "I45", "I90", "I135")
_SAME_VALUE = {
    "brdf": "M00", "bsdf": "M00", "f_r": "M00", "fr": "M00",
    "dolp": "DOLP", "dop_lin": "DOLP",
    "q/i": "m10", "u/i": "m20", "v/i": "m30", "s1/s0": "m10", "s2/s0": "m20",
    "s3/s0": "m30", "is": "I_s", "ip": "I_p", "i_s": "I_s", "i_p": "I_p",
    "i_0": "I0", "i_45": "I45", "i_90": "I90", "i_135": "I135",
    "i0": "I0", "i45": "I45", "i90": "I90", "i135": "I135",
    "s0": "S0", "s1": "S1", "s2": "S2", "s3": "S3",
    "reflectance_factor": "reflectance-factor", "brf": "reflectance-factor",
    "bidirectional_reflectance_factor": "reflectance-factor",
    "brdf_cos": "brdf-cos", "brdf*cos": "brdf-cos",
}  # fmt: skip
VALUES = (*QUANTITIES, "m00", *STOKES, *POLARISERS, "reflectance-factor", "brdf-cos")
TARGETS = (
    *(f"{angle}_{unit}" for angle in ANGLES for unit in ("deg", "rad")),
    "wavelength_um", "wavelength_nm", *VALUES, *(f"{name}{STDERR}" for name in VALUES),
    IGNORE,
)  # fmt: skip

_ANGLE_UNITS = {**ANGLE_UNITS, "grad": None}
_GREEK = {"θ": "theta", "ϑ": "theta", "φ": "phi", "ϕ": "phi", "δ": "delta "}
_DIVIDED = re.compile(r"^[Mm](\d\d)\s*/\s*[Mm]00$|^[Mm](\d\d)_norm(?:alised|alized)?$")
# M00_450nm, 450 nm, brdf_stderr_650nm
_AT_WAVELENGTH = re.compile(
    r"^(?:(.+?)[\s_@]+)?(\d+(?:\.\d+)?)\s*(nm|um|µm)$", re.IGNORECASE
)


@dataclass(frozen=True)
class Meaning:
    """What a column holds.

    Attributes
    ----------
    name : str
        An angle, "wavelength", one of `VALUES`, or "ignore".
    unit : str or None
        "deg" or "rad" of an angle, None where the name does not say; of a wavelength the
        spectral unit; "%" of a percentage.
    stderr : bool
        The standard error of that value.
    wavelength : float or None
        Of one column a wavelength. [um]
    """

    name: str
    unit: str | None = None
    stderr: bool = False
    wavelength: float | None = None


def target_of(name: str) -> Meaning | None:
    """Return the meaning of one of `TARGETS`, as the user writes it behind the sign =."""
    if name not in TARGETS:
        # M00_450nm: what a column headed 450 holds; wavelength_angstrom, energy_ev
        found = meaning_of(name)
        spectral = found is not None and found.name == "wavelength" and found.unit
        return found if found is not None and (spectral or found.wavelength) else None
    return Meaning(IGNORE) if name == IGNORE else meaning_of(name)


def meaning_of(name: str) -> Meaning | None:
    """Return what a column's name says, or None.

    Examples
    --------
    >>> meaning_of("theta_i [rad]")
    Meaning(name='theta_i', unit='rad', stderr=False, wavelength=None)
    >>> meaning_of("M00_450nm")
    Meaning(name='M00', unit=None, stderr=False, wavelength=0.45)
    >>> meaning_of("M00_450nm_stderr") == meaning_of("M00_stderr_450nm")
    True
    >>> meaning_of("M10/M00").name, meaning_of("m10_stderr").stderr
    ('m10', True)
    """
    if len(name) > LONGEST_NAME:
        return None
    plain, bracket = _split(name)
    if _AT_WAVELENGTH.fullmatch(bracket):
        # BRDF (450 nm)
        plain, bracket = f"{plain} {bracket}", ""
    elif inner := split_bracket(plain):
        # BRDF (450 nm) [1/sr]
        plain = " ".join(inner) if _AT_WAVELENGTH.fullmatch(inner[1]) else plain
    found = _angle(plain, bracket)
    if found:
        return found
    spectral = column_of(name)
    if spectral and spectral.role == "wavelength" and _is_spectral(name, spectral.unit):
        return Meaning("wavelength", spectral.unit)
    value = _value(plain, bracket)
    if value:
        return value
    # M00_stderr_450nm or M00_450nm_stderr
    behind = STDERR if plain.endswith(STDERR) else ""
    at = _AT_WAVELENGTH.match(plain.removesuffix(STDERR))
    if at:
        what = _value((at[1] or "M00") + behind, bracket)
        wavelength = float(at[2]) * (1e-3 if at[3].lower() == "nm" else 1.0)
        if what:
            return Meaning(what.name, what.unit, what.stderr, wavelength)
    return None


def _split(name: str) -> tuple[str, str]:
    """Split the unit in brackets from a name."""
    return split_bracket(name) or (name.strip(), "")


def _angle(plain: str, bracket: str) -> Meaning | None:
    words = re.sub(r"[\s_]+", " ", plain).strip().lower()
    for letter, spelled in _GREEK.items():
        words = words.replace(letter, spelled)
    unit = bracket.lower() or None
    last = words.rpartition(" ")[2]
    if last in _ANGLE_UNITS and " " in words:
        words, unit = words.rpartition(" ")[0], last
    key = _SAME_ANGLE.get(words, words.replace(" ", "_"))
    if key not in ANGLES or (unit is not None and _ANGLE_UNITS.get(unit) is None):
        return None
    return Meaning(key, None if unit is None else _ANGLE_UNITS[unit])


def _value(plain: str, bracket: str) -> Meaning | None:
    stderr = plain.endswith(STDERR)
    name = plain.removesuffix(STDERR)
    unit = unit_named(bracket)
    if unit not in ("1", "1/sr", "%"):
        return None
    divided = _DIVIDED.match(name)
    if divided:
        name = f"m{divided[1] or divided[2]}"
    # Case tells M10 in 1/sr from m10, which is divided by M00
    known = name if name in VALUES else _SAME_VALUE.get(re.sub(r"\s+", "_", name.lower()))
    # BRF [1/sr] is pi times a BRDF by its name, a BRDF by its unit
    without_unit = known in ("reflectance-factor", "DOLP") or str(known).startswith("m")
    if known is None or (unit == "1/sr" and without_unit and known != "m00"):
        return None
    return Meaning(known, "%" if unit == "%" else None, stderr)


def _is_spectral(name: str, unit: str | None) -> bool:
    # "E", "e" and "nu" head other things in tables of light
    plain = _split(name)[0].lower()
    if plain.startswith(("wavelength", "wl", "lambda", "λ", "vacuum")):
        return True
    heads = ("wave", "energy", "photon", "frequency")
    return (unit is not None and plain.startswith(heads)) or unit_of(name) is not None
