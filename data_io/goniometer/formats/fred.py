"""FRED text files: blocks of one incident direction, absolute scatter angles.

A block starts with a line of two numbers, theta_i and phi_i; lines of three numbers follow,
theta_s, phi_s and the BRDF. phi_i is the azimuth in which the incident light travels, so
phi_s = phi_i is forward and dphi = phi_s - phi_i + 180 degrees. Where a file has sources at
several azimuths they are kept as phi_i: the sample's own x axis is then half a turn from
the file's.
"""

import re
from pathlib import Path

import numpy as np

from data_io.goniometer.declarations import Declared
from data_io.goniometer.scan import Scan
from data_io.goniometer.tables.angles import relative_azimuth
from data_io.text.text import Line, is_number, without_comments
from pbrdf.errors import DataFileError

_OPTION = re.compile(r"(\w+)\s*=\s*(\S+)")
_OPTIONS = {"angles": ("deg", "rad"), "bsdf": ("value",), "scale": None}


NAME, TAKES = "fred", ("azimuth_of_forward",)


def looks_like(lines: list[Line]) -> bool:
    """Tell whether the first line is that of a FRED scatter table."""
    return without_comments(lines)[0].text.split()[:2] == ["type", "bsdf_data"]


def read(path: Path, lines: list[Line], declared: Declared) -> Scan:
    """Read the blocks of a FRED text file."""
    content = [line for line in lines if line.text.strip()]
    options = {"angles": "deg", "bsdf": "value", "scale": "1"}
    rows: list[tuple[float, ...]] = []
    numbers: list[int] = []
    incident: tuple[float, float] | None = None
    for line in content[1:]:
        cells = line.text.split()
        if cells[0] == "format":
            options |= _options(path, line)
            continue
        row = _row(path, line, cells)
        if len(row) == 2:
            incident = row[0], row[1]
        elif incident is None:
            problem = "expected a line 'theta_i phi_i' before the first row, found none"
            cure = "The file is damaged; each block starts with its incident direction."
            raise DataFileError(path, problem, cure, line=line.number)
        else:
            rows.append((*incident, *row))
            numbers.append(line.number)
    if not rows:
        problem = "expected rows 'theta_s phi_s brdf', found none"
        raise DataFileError(path, problem, "The file is truncated.")
    theta_i, phi_i, theta_s, phi_s, brdf = np.array(rows).T
    angles = [theta_i, phi_i, theta_s, phi_s]
    if options["angles"] == "rad":
        angles = [np.degrees(angle) for angle in angles]
    theta_i, phi_i, theta_s, phi_s = angles
    forward = 0.0 if declared.azimuth_of_forward is None else declared.azimuth_of_forward
    return Scan(
        path=path,
        lines=numbers,
        theta_i=theta_i,
        theta_s=theta_s,
        dphi=relative_azimuth(phi_s, phi_i, forward),
        values={"M00": brdf * float(options["scale"])},
        phi_i=np.mod(phi_i, 360.0) if phi_i.any() else None,
        names={"dphi": "phi_s", "M00": "brdf"},
        attrs={"format": "fred", "title": path.stem},
    )


def _row(path: Path, line: Line, cells: list[str]) -> tuple[float, ...]:
    """Return the two or three numbers of a line."""
    names = ("theta_i", "phi_i") if len(cells) == 2 else ("theta_s", "phi_s", "brdf")
    for name, cell in zip(names, cells, strict=False):
        if not is_number(cell) or not np.isfinite(float(cell)):
            problem = f"expected a finite number, got {cell!r}"
            cure = "Leave out what was not measured; spaces or tabs separate columns."
            raise DataFileError(path, problem, cure, line=line.number, column=name)
    if len(cells) not in (2, 3):
        problem = (
            f"expected 'theta_i phi_i' or 'theta_s phi_s brdf', got {len(cells)} cells"
        )
        cure = "The row is truncated or has extra cells."
        raise DataFileError(path, problem, cure, line=line.number)
    return tuple(float(cell) for cell in cells)


def _options(path: Path, line: Line) -> dict[str, str]:
    """Return the options of the format line, each one that this reader understands."""
    found = dict(_OPTION.findall(line.text))
    for key, value in found.items():
        allowed = _OPTIONS.get(key, ())
        if allowed is None:
            good = is_number(value) and float(value) > 0
            expected = "a positive number"
        else:
            good = value in allowed
            expected = " or ".join(allowed) or "angles, bsdf or scale as the option"
        if not good:
            problem = f"expected {expected}, got {value!r}"
            cure = "Export with 'format angles=deg bsdf=value scale=1'."
            raise DataFileError(path, problem, cure, line=line.number, column=key)
    return found
