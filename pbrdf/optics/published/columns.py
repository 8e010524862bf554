"""What the columns of a table of optical constants mean, and in which unit."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

__all__ = ["Column", "column_of", "unit_of"]

# Wavelength in vacuum times photon energy, h c / e. [um eV]
_UM_EV = 1.239841984

# Each spectral unit -> micrometres
_TO_UM: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "um": lambda v: v,
    "nm": lambda v: v / 1e3,
    "angstrom": lambda v: v / 1e4,
    "mm": lambda v: 1e3 * v,
    "m": lambda v: 1e6 * v,
    "ev": lambda v: _UM_EV / v,
    "mev": lambda v: 1e3 * _UM_EV / v,
    "cm-1": lambda v: 1e4 / v,
    "thz": lambda v: 299.792458 / v,
}
_SPELLINGS = {
    "micron": "um", "microns": "um", "micrometer": "um", "micrometers": "um",
    "micrometre": "um", "micrometres": "um", "nanometer": "nm", "nanometers": "nm",
    "nanometre": "nm", "nanometres": "nm", "a": "angstrom", "å": "angstrom",
    "angstroms": "angstrom", "ang": "angstrom", "1/cm": "cm-1", "cm^-1": "cm-1",
    "cm⁻¹": "cm-1", "cm**-1": "cm-1", "electronvolt": "ev", "electronvolts": "ev",
}  # fmt: skip
_SPECTRAL = {
    "wavelength", "wavelengths", "wave", "wl", "wvl", "wvls", "lambda", "lam", "λ",
    "vacuum wavelength", "energy", "photon energy", "e", "hv", "hnu", "wavenumber",
    "wavenumbers", "wave number", "nu", "frequency",
}  # fmt: skip
_ROLES = {
    "n": {"n", "index", "refractive index", "n real", "real", "re(n)", "index n", "nr",
          "real index", "refractive index n", "re n"},
    "kappa": {"k", "kappa", "κ", "extinction", "extinction coefficient", "ext coeff",
              "extinction coeff", "ext", "k ext", "im(n)", "imag", "n imag", "im n", "ni",
              "extinction coefficient k"},
    "diffuse_albedo": {"diffuse albedo", "albedo"},
    "eps1": {"eps1", "e1", "epsilon1", "ε1", "eps real", "re(eps)", "epsilon 1", "eps 1"},
    "eps2": {"eps2", "e2", "epsilon2", "ε2", "eps imag", "im(eps)", "epsilon 2", "eps 2"},
}  # fmt: skip
_IN_BRACKETS = re.compile(r"^(.*?)[\s,]*[\[(]\s*([^\[\]()]+?)\s*[\])]$")
_BEHIND = re.compile(r"^(.*?)(?:\s*,\s*|\s*/\s*|_|\s+)([^\s,/_]+)$")


@dataclass(frozen=True)
class Column:
    """A column: its name in the file, what it is (n, kappa, eps1, ...), its unit."""

    name: str
    role: str
    unit: str | None = None

    def to_um(self, values: Sequence[float]) -> np.ndarray:
        """Return vacuum wavelengths. [um]"""
        with np.errstate(divide="ignore"):
            return _TO_UM[self.unit or "um"](np.asarray(values, dtype=np.float64))


def unit_of(text: str) -> str | None:
    """Return a spectral unit in one spelling, or None if the text is none.

    Examples
    --------
    >>> unit_of("µm"), unit_of("cm^-1"), unit_of("Angstroms"), unit_of("1")
    ('um', 'cm-1', 'angstrom', None)
    """
    key = text.strip().strip("[]()").replace("µ", "u").replace("μ", "u").lower()
    key = _SPELLINGS.get(key, key)
    # meV is an energy of the far infrared, MeV is none of optics
    return None if key not in _TO_UM or text.strip().startswith("MeV") else key


def column_of(name: str) -> Column | None:
    """Return the meaning of a column's name, or None if nobody knows it.

    Examples
    --------
    >>> column_of("Wavelength, µm"), column_of("wavelength_nm").unit, column_of("K").role
    (Column(name='Wavelength, µm', role='wavelength', unit='um'), 'nm', 'kappa')
    >>> column_of("absorption") is None
    True
    """
    plain, unit = _without_unit(name)
    key = re.sub(r"[\s_]+", " ", plain).strip().lower()
    for role, words in _ROLES.items():
        # A constant has no unit: k in 1/cm is an absorption coefficient
        if key in words and unit is None:
            return Column(name, role)
    if key in _SPECTRAL:
        return Column(name, "wavelength", unit or _sure_unit(plain))
    # The unit alone, as in "nm,n,k"
    if unit_of(name) and len(name.strip()) > 1:
        return Column(name, "wavelength", unit_of(name))
    return None


def _without_unit(name: str) -> tuple[str, str | None]:
    """Split a name such as "wavelength (nm)", "wavelength, nm" or "wavelength_nm"."""
    for pattern in (_IN_BRACKETS, _BEHIND):
        found = pattern.match(name.strip())
        if found and found[1]:
            unit = unit_of(found[2])
            if unit:
                return found[1], unit
            if pattern is _IN_BRACKETS and found[2].strip() in ("-", "1"):
                return found[1], None
    return name.strip(), None


def _sure_unit(plain: str) -> str | None:
    # The export of refractiveindex.info heads its wavelengths, in micrometres, with "wl"
    return "um" if plain == "wl" else None
