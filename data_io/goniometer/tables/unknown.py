"""What to say of columns that nobody knows, or whose unit nobody tells."""

import difflib
import re
from collections.abc import Sequence
from pathlib import Path

from data_io.goniometer.scan import STDERR
from data_io.goniometer.tables.names import ANGLES, TARGETS, meaning_of
from data_io.goniometer.tables.table import RawTable
from data_io.goniometer.tables.units import bare_name, is_logarithm, written_units
from pbrdf.errors import DataFileError
from pbrdf.optics.published.columns import column_of

__all__ = ["COLUMNS_CURE", "unknown_columns"]

COLUMNS_CURE = (
    "Known: theta_i_deg; theta_view_deg, or theta_s_deg with dphi_deg, or phi_s_deg with "
    "phi_i_deg; M00..M33, m01..m33 (divided by M00), DOLP, I_s, I_p, I0..I135, S0..S3; "
    "<name>_stderr; wavelength_um, wavelength_nm; sample_rotation_deg, "
    "source_half_angle_deg, detector_half_angle_deg."
)
# Where a slip of the pen is told from another quantity by the name alone: not an azimuth,
# and not a value, of which f_s is no f_ss
_SUGGESTED = tuple(t for t in TARGETS if t.startswith(("theta", "wavelength", "sample")))
_ERROR_WORDS = re.compile(
    r"^u\((.+)\)$|^(.*?)[\s_-]*(?:err|error|unc|uncertainty|sigma|std)$"
)
_OTHER_UNIT = re.compile(r"[\s_\[(](?:[mu]rad|mdeg|gon|grad|arcmin|arcsec)\b")
_ALONG = re.compile(r"^(?:[RrIiPp]|[Rr]efl|BRDF|brdf)[\s_]*([sp])$|^([sp])$")
_COUNTS = re.compile(
    r"^(?:raw|norm\w*|rel\w*)?[\s_]*(?:intensity|counts?|cts|signal|power|voltage|radiance|"
    r"detector|current|flux)\b", re.IGNORECASE,
)  # fmt: skip
_WITH_COSINE = re.compile(
    r"^(?:ars|dsd|ccbrdf|ccbsdf|cos\w*[\s_-]*corr\w*[\s_-]*bs?r?df)$", re.IGNORECASE
)
_REFLECTANCE = re.compile(r"^(?:r|refl|reflectance|reflectivity)$", re.IGNORECASE)
_SPECTRAL = re.compile(r"^(?:photon[\s_]*)?energy$|^wave[\s_]*numbers?$|^frequency$", re.I)
_ELEMENT = re.compile(r"^([Mm])([1-4])([1-4])(/[Mm]11)?((?:_stderr)?)$")
_FROM_ONE = re.compile(r"^m(?:4[1-4]|[1-3]4|[1-4]{2}/m11)$", re.IGNORECASE)


def unknown_columns(
    path: Path, table: RawTable, unknown: Sequence[str], without_unit: Sequence[str]
) -> DataFileError:
    """Return the error that names every column without a meaning or a unit."""
    constants = "n" in map(str.lower, unknown) and all(map(column_of, unknown))
    if constants and not without_unit:
        problem = f"expected a scan, got columns {', '.join(map(repr, unknown))}"
        cure = "Optical constants are given by --material-file, material_file= or file =."
        raise DataFileError(path, problem, cure, line=table.header)
    said = []
    if unknown:
        said.append(f"expected known columns, got {', '.join(map(repr, unknown))}")
    if without_unit:
        listed = ", ".join(map(repr, without_unit))
        said.append(f"expected the unit of the angles {listed}, found none")
    cures = _cures(unknown, without_unit, table.names)
    return DataFileError(
        path, "; ".join(said), " ".join([*cures, COLUMNS_CURE]), line=table.header
    )


def _from_one(names: Sequence[str]) -> str:
    """Return the mapping of all elements that a table counts from 1.

    >>> _from_one(["BRDF", "m12 [1]", "M34_stderr", "m33/m11"])
    'm12=m01,M34_stderr=M23_stderr,m33/m11=m22'
    """
    pairs = []
    for name in map(bare_name, names):
        found = _ELEMENT.match(name)
        if found:
            letter = "m" if found[4] else found[1]
            target = f"{letter}{int(found[2]) - 1}{int(found[3]) - 1}{found[5]}"
            pairs.append(f"{name}={target}")
    return ",".join(pairs)


def _cures(
    unknown: Sequence[str], without_unit: Sequence[str], names: Sequence[str] = ()
) -> list[str]:
    """Return what the reader may do about these columns."""
    pairs, cures = [], []
    for name in (*unknown, *without_unit):
        meaning = meaning_of(name)
        if meaning is not None:
            pairs.append(f"{name}={meaning.name}_deg")
        else:
            pairs += [f"{name}={target}" for target in _close_to(name)]
    for hint in (_of_unit, _of_other_quantity):
        cures += [text for name in unknown if (text := hint(name))]
    waves = [f"{name}=M00_{size}" for name in unknown if (size := _as_wavelength(name))]
    if waves:
        cures.append(f"Where wavelengths head columns, give --columns {','.join(waves)}.")
    if any(map(_FROM_ONE.match, unknown)):
        cures.append(
            f"Elements are counted from 0 here: --columns {_from_one(names or unknown)}."
        )
    if pairs:
        hints = ", ".join(pair.partition("=")[2] for pair in pairs)
        cures.append(f"Did you mean {hints}? Then give --columns {','.join(pairs)}.")
    elif not cures:
        cures.append("Say what they hold by --columns NAME=theta_i_deg, or NAME=ignore.")
    if without_unit:
        cures.append("Or give --angles deg or rad for all.")
    return cures


def _close_to(name: str) -> list[str]:
    """Return the target that a name most likely means, or nothing."""
    spelled = {_letters(target): target for target in TARGETS}
    if _letters(name) in spelled:
        return [spelled[_letters(name)]]
    if _OTHER_UNIT.search(name.lower()):
        return []
    error = _ERROR_WORDS.match(name.lower())
    if error:
        value = meaning_of(error[1] or error[2] or "M00")
        return (
            [f"{value.name}{STDERR}"]
            if value and f"{value.name}{STDERR}" in TARGETS
            else []
        )
    return difflib.get_close_matches(name, _SUGGESTED, n=1, cutoff=0.8)


def _of_unit(name: str) -> str:
    """Return what to do about a known name whose unit is unknown, or nothing."""
    bare = bare_name(name)
    meaning = meaning_of(bare) if bare != name else None
    if meaning is None:
        return ""
    if meaning.name in ANGLES:
        return f"{name} is no angle in degrees or radians: convert it."
    if meaning.name == "wavelength":
        return f"{name} is in no unit of wavelengths that is known: convert it."
    error = STDERR if meaning.stderr else ""
    unit = written_units(name).units[0]
    if is_logarithm(unit):
        return f"{name} holds logarithms: write the numbers themselves."
    if unit == "1/sr":
        target = "M00"
        if meaning.name.startswith("m"):
            target = meaning.name.upper()
        cure = f"--columns {bare}={meaning.name}{error} or {bare}={target}{error}"
        cure += " with --quantity brdf" if target == "M00" else ""
        return f"{name} has no unit by its name, and that of a BRDF behind it: give {cure}."
    return (
        f"{name} is not in 1/sr: give --columns {bare}={meaning.name}{error} with "
        "--quantity relative, or convert it."
    )


def _of_other_quantity(name: str) -> str:
    """Return how to say what a usual name of another quantity holds, or nothing.

    >>> _of_other_quantity("counts [1/s]")
    'counts has no absolute scale: --columns counts=M00 with --quantity relative.'
    """
    bare = bare_name(name)
    along = _ALONG.match(bare)
    if along:
        letter = along[1] or along[2]
        return (
            f"Light of an unpolarised source behind an analyser along {letter} is "
            f"--columns {bare}=I_{letter}; that of a source polarised so is none of these."
        )
    if _COUNTS.match(bare):
        return (
            f"{bare} has no absolute scale: --columns {bare}=M00 with --quantity relative."
        )
    if _WITH_COSINE.match(bare):
        return f"Times cos(theta_s) it is --columns {bare}=M00 with --quantity brdf-cos."
    if _REFLECTANCE.match(bare):
        return (
            f"If {bare} is pi times the BRDF, --columns {bare}=M00 with --quantity "
            "reflectance-factor."
        )
    if _SPECTRAL.match(bare):
        return f"{bare} names no unit: head it energy_ev, wavenumber_cm-1 or frequency_thz."
    return ""


def _as_wavelength(name: str) -> str:
    """Return a bare number as a wavelength with its unit, or nothing.

    >>> _as_wavelength("450"), _as_wavelength("0.65"), _as_wavelength("7")
    ('450nm', '0.65um', '')
    """
    if not re.fullmatch(r"\d+(?:\.\d+)?", name):
        return ""
    size = float(name)
    if 150.0 <= size <= 30_000.0:
        return f"{name}nm"
    return f"{name}um" if "." in name and 0.15 <= size <= 30.0 else ""


def _letters(name: str) -> str:
    # M10 and m10 differ by their case alone
    return re.sub(r"[^A-Za-z0-9]", "", name)
