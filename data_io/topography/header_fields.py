"""Fields of a header: grid steps, sizes and units, in the words of many programs."""

import re
from pathlib import Path

import numpy as np

from data_io.text.text import Line
from data_io.text.units import LENGTH_UNITS, height_unit, normalise_unit, unit_factor
from pbrdf.errors import DataFileError

# "# spacing_um = 0.5", "# dx_um: 0.5", and, as Gwyddion writes them, "# Width: 10.0 µm",
# "# Height: ...", "# Value units: m"
_FIELD = re.compile(
    r"^[#%\s]*([^\W\d_][^\W\d_ ]*(?: [^\W\d_]+)*?)(?:_([A-Za-zµμ]+))?\s*[:=]\s*(.+?)\s*$"
)
# Gwyddion writes in the language of its user
_TRANSLATED = {
    "width": "breite largeur larghezza anchura largura šířka ширина",
    "height": "höhe hauteur altezza altura výška высота",
    "unit": "einheiten|unités|unità valore|unidades de valor|jednotky hodnot",
}
_ENGLISH = {
    word: key
    for key, words in _TRANSLATED.items()
    for word in re.split(r"\|" if "|" in words else " ", words)
}
_QUANTITY = re.compile(r"^([-+0-9.,eE]+)\s*([A-Za-zµμÅå]*)(?:\s*/\s*(?:\w+|px))?$")
# "Resolution,0.156 um/sample", "Sampling interval: 0.5 µm", "Step (mm) = 0.001"
_STEP = re.compile(
    r"^[#%\s]*(?:[xX][ _-]*)?(?:lateral\s+)?(spacing|step(?:\s*(?:size|width))?|pitch|"
    r"increment|d[xX]|delta[ _]?[xX]|(?:sampling|sample|point|data)\s*"
    r"(?:interval|spacing|distance|step|pitch)|(?:lateral\s+)?resolution|"
    r"pixel\s*(?:size|pitch|width))(?![A-Za-z])"
    r"[_\s]*[\[(]?\s*([A-Za-zµμ]*)\s*[\])]?\s*[:=,;\t]\s*(.+?)[,;\s]*$",
    re.IGNORECASE,
)
# In the middle of a remark: "height in nm, step 1 um", "pixel size of 0.5 um"
_STEP_SAID = re.compile(
    r"\b(?:step|spacing|pitch|pixel|sampling|increment)s?(?:\s+(?:size|width|interval|"
    r"distance))?\s*(?:of|is|[:=])?\s*(\d[\d.]*(?:e[-+]?\d+)?)\s*([A-Za-zµμÅå]+)(?!\w)",
    re.IGNORECASE,
)


def matrix_header(
    path: Path, header: list[Line], shape: tuple[int, ...]
) -> tuple[tuple[float, float] | None, float | None]:
    """Return (dx, dy) and the size of the height unit that the header names. [um]"""
    found: dict[str, float] = {}
    factor = None
    for line in header:
        match = _FIELD.match(line.text)
        if not match:
            continue
        key, unit_of_name, value = match[1].strip().lower(), match[2], match[3]
        key = _ENGLISH.get(key, key)
        if key in ("unit", "units", "value units", "z unit"):
            factor = unit_factor(_length_unit(path, line, key, value))
        elif key in ("spacing", "dx", "dy", "width", "height"):
            found[key] = _length(path, line, key, unit_of_name, value)
    dx = found.get("dx", found.get("spacing"))
    dy = found.get("dy", found.get("spacing", dx))
    if dx is None:
        dx = dy = said_step(path, header)
    if dx is None and {"width", "height"} <= found.keys():
        dx, dy = found["width"] / shape[1], found["height"] / shape[0]
    said = height_unit(path, [line.text for line in header])
    if said is not None and factor not in (None, unit_factor(said)):
        problem = f"expected one unit of heights, the header names {said} and another"
        raise DataFileError(path, problem, "Mend the header.")
    if said is not None:
        factor = unit_factor(said)
    return (None if dx is None or dy is None else (dx, dy)), factor


def said_step(path: str | Path, header: list[Line]) -> float | None:
    """Return the one step of a grid that remarks name in passing. [um]

    Raises
    ------
    DataFileError
        If they name several.
    """
    steps = {
        float(value) * unit_factor(unit)
        for line in header
        for value, unit in _STEP_SAID.findall(line.text)
        if normalise_unit(unit) in LENGTH_UNITS
    }
    if len(steps) > 1:
        named = ", ".join(f"{step:g}" for step in sorted(steps))
        problem = f"expected one step of the grid, the header names {named} um"
        raise DataFileError(path, problem, "Write '# dx_um = ...' and '# dy_um = ...'.")
    return next(iter(steps), None)


def profile_step(path: str | Path, header: list[Line]) -> float | None:
    """Return the distance of points that the header of a profile names. [um]"""
    for line in header:
        match = _STEP.match(line.text)
        if match and re.match(r"[-+.\d]", match[3]):
            return _length(path, line, match[1].strip().lower(), match[2], match[3])
    return said_step(path, header)


def _length_unit(path: str | Path, line: Line, key: str, value: str) -> str:
    if normalise_unit(value) not in LENGTH_UNITS:
        problem = f"expected a length unit, got {value!r}"
        cure = "Heights are needed; known units: nm, um, mm, m."
        raise DataFileError(path, problem, cure, line=line.number, column=key)
    return value


def _length(path: str | Path, line: Line, key: str, unit: str | None, value: str) -> float:
    """Return a positive length of the header. [um]"""
    match = _QUANTITY.match(value)
    name = unit or (match[2] if match else "")
    try:
        if match is None:
            raise ValueError(value)
        length = float(match[1].replace(",", ".")) * unit_factor(name)
    except ValueError as error:
        problem = f"expected a length with its unit, got {value!r}"
        cure = "Write for example '# spacing_um = 0.5' or '# Width: 10 um'."
        raise DataFileError(path, problem, cure, line=line.number, column=key) from error
    if not length > 0 or not np.isfinite(length):
        problem = f"expected a positive length, got {value!r}"
        raise DataFileError(path, problem, "Mend the header.", line=line.number, column=key)
    return length
