"""Settings that remarks name, where no column does: of all rows, or of those below."""

import re
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from data_io.goniometer.declarations import Declared
from data_io.goniometer.remarks.wavelengths import (
    LIGHT,
    doubtful_wavelength,
    wavelengths_of,
)
from data_io.goniometer.remarks.words import azimuth_of, gain_of, plain, polarisation_of
from data_io.goniometer.scan import STDERR, ConventionWarning
from data_io.goniometer.tables.columns import Columns
from data_io.goniometer.tables.table import RawTable
from data_io.text.text import Line
from pbrdf.errors import DataFileError, shortened

__all__ = ["one_wavelength", "with_settings"]

_BRIGHTNESS = {"M00", "S0", "reflectance-factor", "brdf-cos"}
_BY_FILE = "Give the rows a column {}, or each setting a file."
# A laser tells rows apart, but has lines of several wavelengths
_LASER = re.compile(
    r"(?:he-?ne|nd:?yag|argon|krypton|ruby|co2)(?:[ -]laser)?", re.IGNORECASE
)
_SIDES = {"parallel", "perpendicular", "par", "perp"}
# A band of light is no setting twice, but one colour is not another
_SAME_WAVE = 0.02


def with_settings(
    path: Path, table: RawTable, columns: Columns, declared: Declared
) -> Columns:
    """Return the columns with wavelength and azimuth that remarks give all rows.

    Raises
    ------
    DataFileError
        If remarks among the rows name two settings, with the line of the second; if a
        remark contradicts a column, or names a polarisation of unpolarised readings.

    Warns
    -----
    ConventionWarning
        If a wavelength names no unit.
    """
    waves = columns.wavelength is not None
    turned = bool({"phi_i", "sample_rotation"} & columns.angles.keys())
    gain = "Divide the readings by their gain, if they are not, and remove the remarks."
    # An azimuth without an owner is the detector's where that has a column
    azimuth = _azimuth if not {"dphi", "phi_s"} & columns.angles.keys() else _turn
    polarisation = _polarisation if turned else polarisation_of
    for what, cure, setting, known in (
        ("wavelength", _BY_FILE.format("wavelength_nm"), _wave, waves),
        ("polarisation", _BY_FILE.format("I_s and one I_p"), polarisation, False),
        ("azimuth of the sample", _BY_FILE.format("sample_rotation_deg"), azimuth, turned),
        ("gain", gain, gain_of, False),
    ):  # fmt: skip
        if not known:
            _require_one(path, table, what, cure, setting)
    _require_unpolarised(path, table, columns, declared)
    return _with_azimuth(
        path, table, _with_wavelength(path, table, columns), declared.azimuth_of_forward
    )


def _wave(text: str) -> str | None:
    waves = wavelengths_of(text)
    if not waves and _LASER.fullmatch(plain(text)):
        return plain(text)
    return waves[0].words if len(waves) == 1 else None


def _azimuth(text: str) -> str | None:
    found = azimuth_of(text)
    return f"{found[0].replace('_', ' ')} {found[2]}" if found else None


def _turn(text: str) -> str | None:
    found = _azimuth(text)
    return None if found and found.startswith("azimuth") else found


def _polarisation(text: str) -> str | None:
    # A sample may lie parallel to something, which is no polarisation
    return None if plain(text).lower() in _SIDES else polarisation_of(text)


def _require_one(
    path: Path,
    table: RawTable,
    what: str,
    cure: str,
    setting: Callable[[str], str | None],
) -> None:
    """Refuse a second setting of remarks, one of which stands among the rows."""
    said: dict[str, Line] = {}
    for line in (*table.among, *(Line(table.header, text) for text in table.above)):
        value = setting(line.text)
        if value is not None:
            said.setdefault(value, line)
    among = [line for line in said.values() if line.number > table.header]
    if len(said) < 2 or not among:
        return
    text = shortened(among[-1].text.strip(), 50)
    problem = (
        f"expected one {what}, remarks among the rows name {', '.join(sorted(said))} "
        f"({text!r})"
    )
    raise DataFileError(path, problem, cure, line=among[-1].number)


def _with_wavelength(path: Path, table: RawTable, columns: Columns) -> Columns:
    """Give all rows the wavelength of a remark; refuse one that the column contradicts."""
    one = one_wavelength(path, table.above, columns.wavelength)
    if one is None or columns.wavelength is not None:
        return columns
    return replace(
        columns,
        wavelength=np.full(len(columns.lines), one),
        names={**columns.names, "wavelength": "wavelength"},
    )


def one_wavelength(
    path: Path, texts: Iterable[str], column: np.ndarray | None = None
) -> float | None:
    """Return the wavelength that remarks on all rows name. [um]

    Raises
    ------
    DataFileError
        If they name several, or one that is far from all of the column's.

    Warns
    -----
    ConventionWarning
        If it names no unit, is of no light, or a length may be one, and no column holds it.
    """
    texts = list(texts)
    waves = [wave for text in texts for wave in wavelengths_of(text)]
    known = {wave.size: wave.words for wave in waves if wave.size}
    listed = ", ".join(known.values())
    if column is not None:
        sizes = np.fromiter(known, float)
        apart = np.abs(sizes[:, None] / column - 1.0) > _SAME_WAVE
        if sizes.size == 1 and apart.all():
            problem = (
                f"expected the wavelength of the remark, {listed}, in the column, got "
                f"{1e3 * column[0]:.6g} nm"
            )
            raise DataFileError(path, problem, "Mend the remark, or the column.")
        return None
    if len(known) > 1:
        problem = f"expected one wavelength, remarks name {listed}"
        cure = (
            "Keep the remark of the light that was measured, or give the rows a column "
            "wavelength_nm."
        )
        raise DataFileError(path, problem, cure)
    bare = [wave.words for wave in waves if not wave.size]
    doubtful = [length for text in texts if (length := doubtful_wavelength(text))]
    if not known and (bare or doubtful):
        if bare:
            said = shortened(bare[0], 40)
            what, words = f"the wavelength {said} names no unit", "633 nm"
            if " " in bare[0]:
                what = (
                    f"the wavelength {said} is not between {LIGHT[0]} and {LIGHT[1]:g} um"
                )
        else:
            what, words = f"{doubtful[0]} may be the wavelength", doubtful[0]
        msg = f"{path.name}: {what} and is left out: write wavelength {words}."
        warnings.warn(msg, ConventionWarning, stacklevel=7)
    return next(iter(known), None)


def _with_azimuth(
    path: Path, table: RawTable, columns: Columns, forward: float | None
) -> Columns:
    """Give all rows the azimuth of source or sample that a remark names."""
    said: Mapping[tuple[str, float | None], str] = {
        found[:2]: found[2] for text in table.above if (found := azimuth_of(text))
        and found[0] in ("phi_i", "sample_rotation")
    }  # fmt: skip
    columned = {"phi_i", "sample_rotation"} & columns.angles.keys()
    if len(said) != 1 or columned:
        if len(said) > 1 and not columned:
            listed = ", ".join(f"{name} {words}" for (name, _), words in said.items())
            problem = f"expected one azimuth of the source, remarks name {listed}"
            cure = "Keep one of the remarks, or give the rows a column phi_i_deg."
            raise DataFileError(path, problem, cure)
        for (name, value), words in said.items():
            column = columns.angles.get(name)
            if len(said) > 1 or column is None or value is None:
                continue
            if (np.abs((column - value + 180.0) % 360.0 - 180.0) > 0.01).all():
                problem = (
                    f"expected the {name} of the remark, {words}, in the column, got "
                    f"{column[0]:g}"
                )
                raise DataFileError(path, problem, "Mend the remark, or the column.")
        return columns
    ((name, value), words) = next(iter(said.items()))
    if value is None:
        problem = f"expected the unit of {name}, got {words} in a remark"
        cure = f"Write {name} = {words} deg (or rad)."
        raise DataFileError(path, problem, cure)
    if name == "phi_i" and forward is not None and "phi_s" in columns.angles:
        # The azimuths of the detector are declared to be relative to the source
        name, value = "sample_rotation", -value
    angles = {**columns.angles, name: np.full(len(columns.lines), np.mod(value, 360.0))}
    return replace(columns, angles=angles, names={**columns.names, name: name})


def _brightness_only(columns: Columns) -> bool:
    """Tell whether all readings are of unpolarised light, by their names."""
    read = {name for name in columns.values if not name.endswith(STDERR)}
    return bool(read) and read <= _BRIGHTNESS


def _require_unpolarised(
    path: Path, table: RawTable, columns: Columns, declared: Declared
) -> None:
    """Refuse a remark on the polarisation of all rows over readings that have none."""
    if not _brightness_only(columns):
        return
    said = {p: text for text in table.above if (p := _polarisation(text))}
    said.pop("unpolarised", None)
    read = {name: columns.names[name] for name in columns.values if name in _BRIGHTNESS}
    if not said or set(read.values()) & declared.columns.keys():
        return
    letter, text = next(iter(said.items()))
    key, column = next(iter(read.items()))
    quantity = f" --quantity {key}" if key in ("reflectance-factor", "brdf-cos") else ""
    end = letter if letter in ("s", "p") else "s"
    problem = (
        f"expected unpolarised light in {column}, a remark says "
        f"{shortened(plain(text), 30)!r}"
    )
    cure = (
        f"Behind an analyser: --columns {column}=I_{end}{quantity}; source and analyser: "
        f"{column}=f_{end}{end}{quantity}; unpolarised: {column}=M00{quantity}. Of a "
        "polarised source alone, average s and p."
    )
    raise DataFileError(path, problem, cure, line=table.header)
