"""In-plane scans of a spacecraft chassis: here phi is the zenith and theta the azimuth.

Columns phi_i, theta_i, phi_o, theta_o, brdf, named in a comment. The outgoing zenith is
signed: -20 at azimuth 0 is 20 at azimuth 180 degrees. Values at the floor of the instrument
are not measured, and become NaN.
"""

from pathlib import Path

import numpy as np

from data_io.goniometer.declarations import Declared
from data_io.goniometer.remarks.settings import one_wavelength
from data_io.goniometer.scan import Scan
from data_io.text.text import Line, Rows, is_comment, read_numbers, without_comments
from pbrdf.errors import DataFileError

_COLUMNS = ["phi_i", "theta_i", "phi_o", "theta_o", "brdf"]
# So many equal values at the bottom are the instrument's floor
_FLOOR_REPEATS = 3


NAME, TAKES = "spacecraft", ()


def looks_like(lines: list[Line]) -> bool:
    """Tell whether a comment names the columns."""
    return any(
        is_comment(line) and line.text.strip("#% \t").split() == _COLUMNS
        for line in lines
        if _COLUMNS[0] in line.text
    )


def read(path: Path, lines: list[Line], declared: Declared) -> Scan:
    """Read the five columns."""
    comments = [line.text.strip("#% \t") for line in lines if is_comment(line)]
    data = without_comments(lines)
    if not data:
        problem = "expected rows below the comments, found none"
        raise DataFileError(path, problem, "The file is truncated.")
    table = read_numbers(path, Rows.of(data), _COLUMNS)
    numbers = [line.number for line in data]
    if table.shape[1] != len(_COLUMNS):
        problem = f"expected {len(_COLUMNS)} columns, got {table.shape[1]}"
        raise DataFileError(path, problem, "Keep five columns.", line=numbers[0])
    if np.isnan(table).any():
        row, column = (int(i) for i in np.argwhere(np.isnan(table))[0])
        problem, cure = "expected a number, got nan", "Remove the row."
        raise DataFileError(path, problem, cure, line=numbers[row], column=_COLUMNS[column])
    zenith_i, azimuth_i, zenith_s, azimuth_s, brdf = table.T
    lowest = brdf.min()
    at_floor = (brdf == lowest) & ((brdf == lowest).sum() >= _FLOOR_REPEATS)
    wavelength = one_wavelength(path, comments)
    attrs: dict[str, object] = {
        "format": "spacecraft",
        "title": comments[0] if comments else path.stem,
        "comments": "\n".join(comments),
    }
    if at_floor.any():
        attrs |= {"floor": float(lowest), "not_measured": int(at_floor.sum())}
    return Scan(
        path=path,
        lines=numbers,
        theta_i=np.abs(zenith_i),
        theta_s=np.abs(zenith_s),
        dphi=np.mod(
            azimuth_s - azimuth_i + 180.0 * (zenith_s < 0) - 180.0 * (zenith_i < 0), 360.0
        ),
        values={"M00": np.where(at_floor, np.nan, brdf)},
        wavelength=None if wavelength is None else np.full(brdf.size, wavelength),
        names={"theta_i": "phi_i", "theta_s": "phi_o", "dphi": "theta_o", "M00": "brdf"},
        attrs=attrs,
    )
