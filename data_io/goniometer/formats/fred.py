"""FRED text files: blocks of one incident direction, absolute scatter angles.

A block starts with a line of two numbers, theta_i and phi_i; lines of three numbers follow,
theta_s, phi_s and the BRDF. phi_i is the azimuth in which the incident light travels, so
phi_s = phi_i is forward and dphi = phi_s - phi_i + 180 degrees. Where a file has sources at
several azimuths they are kept as phi_i: the sample's own x axis is then half a turn from
the file's.
"""

import re
import warnings
from itertools import pairwise
from pathlib import Path

import numpy as np

from data_io.goniometer.declarations import Declared
from data_io.goniometer.scan import ConventionWarning, Scan
from data_io.goniometer.tables.angles import relative_azimuth
from data_io.text.text import Line, content_of, is_number
from pbrdf.errors import DataFileError

_OPTION = re.compile(r"(\w+)\s*=\s*(\S+)")
_OPTIONS = {"angles": ("deg", "rad"), "bsdf": ("value",), "scale": None}


NAME, TAKES = "fred", ("azimuth_of_forward",)


def looks_like(lines: list[Line]) -> bool:
    """Tell whether the first line is that of a FRED scatter table."""
    return next(content_of(lines)).text.split()[:2] == ["type", "bsdf_data"]


def read(path: Path, lines: list[Line], declared: Declared) -> Scan:
    """Read the blocks of a FRED text file."""
    content = [line for line in lines if line.text.strip()]
    options = {"angles": "deg", "bsdf": "value", "scale": "1"}
    rows: list[tuple[float, ...]] = []
    numbers: list[int] = []
    heads: list[int] = []
    incident: tuple[float, float] | None = None
    for line in content[1:]:
        cells = line.text.split()
        if cells[0] == "format":
            options |= _options(path, line)
            continue
        row = _row(path, line, cells)
        if len(row) == 2:
            incident = row[0], row[1]
            heads.append(line.number)
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
    _warn_of_broken_blocks(path, heads, numbers, rows)
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


def _warn_of_broken_blocks(
    path: Path, heads: list[int], lines: list[int], rows: list[tuple[float, ...]]
) -> None:
    """Warn where a row that lost its value seems to count as the head of a block.

    It stands halfway between its neighbours, and the halves of its block share nothing.
    """
    ends = np.searchsorted(lines, [*heads, np.inf])
    blocks = [rows[a:b] for a, b in pairwise(ends.tolist())]
    for head, one, other in zip(heads[1:], blocks[:-1], blocks[1:], strict=True):
        if not one or not other or {r[2:4] for r in one} & {r[2:4] for r in other}:
            continue
        if np.allclose(np.add(one[-1][2:4], other[0][2:4]), np.multiply(2, other[0][:2])):
            msg = (
                f"{path.name} line {head}: two numbers begin a block of a new source, but "
                "these continue the directions above: a row seems to have lost its value."
            )
            warnings.warn(msg, ConventionWarning, stacklevel=4)


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
