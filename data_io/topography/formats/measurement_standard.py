"""Profiles of software measurement standards: SMD (ISO 5436-2) and PRF files.

Two lines describe the axes: ``CX I 400 MM 1.0e-3 D`` gives the kind of axis (I and M
incremental, A listed), the number of points, the unit, the scale and the type of number.
"""

import math
import re
from pathlib import Path

import numpy as np

from data_io.text.files import read_bytes
from data_io.text.units import unit_factor
from pbrdf.errors import DataFileError

_AXIS = re.compile(
    r"^\s*C([XZ])\s+([A-Z])\s+(\S+)\s+([A-Za-zµ]+)\s+(\S+)\s+[A-Z]\s*$", re.MULTILINE
)
# Records end with EOR, or with the sign ETX
_RECORD = re.compile(r"^\s*EOR\s*$|\x03", re.MULTILINE)


def is_measurement_standard(path: Path) -> bool:
    """Tell whether a file is of this kind, whatever its name."""
    start = read_bytes(path, 2000).decode("latin-1")
    return {found[0] for found in _AXIS.findall(start)} == {"X", "Z"}


def read_measurement_standard(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Read positions and heights of a software measurement standard. [um]

    Raises
    ------
    DataFileError
        If the axes are not understood, or the number of points is another than they say.
    """
    text = read_bytes(path).decode("latin-1")
    axes = {found[0]: found[1:] for found in _AXIS.findall(text)}
    records = [part for part in _RECORD.split(text) if part.strip()]
    try:
        counts = {axis: float(words[1]) for axis, words in axes.items()}
        sizes = {
            axis: float(words[3]) * unit_factor(words[2]) for axis, words in axes.items()
        }
        rows = [line.split() for line in records[1].strip().splitlines() if line.strip()]
        table = np.array([[float(word) for word in row] for row in rows])
    except (ValueError, IndexError) as error:
        problem = f"expected axes CX and CZ with unit and scale, and numbers, got: {error}"
        raise DataFileError(path, problem, "Export the profile as columns x, z.") from error
    for axis, size in sizes.items():
        if not 0.0 < size < math.inf:
            problem = f"expected a scale above 0, got {size:g} um"
            cure = "Mend it, or export the profile as columns x, z."
            raise DataFileError(path, problem, cure, column=f"C{axis}")
    if table.shape[0] != counts["Z"]:
        problem = f"expected {counts['Z']:g} heights as CZ says, got {table.shape[0]}"
        cure = "The file is truncated; or mend the number, or export columns x, z."
        raise DataFileError(path, problem, cure, column="CZ")
    listed = axes["X"][0] == "A"
    if table.shape[1] != (2 if listed else 1):
        problem = f"expected {2 if listed else 1} numbers in a line, got {table.shape[1]}"
        raise DataFileError(path, problem, "Export the profile as columns x, z.")
    x = table[:, 0] if listed else np.arange(table.shape[0])
    return x * sizes["X"], table[:, -1] * sizes["Z"]
