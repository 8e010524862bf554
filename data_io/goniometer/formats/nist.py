"""The NIST table of the Mueller BRDF of sintered PTFE.

Columns lambda, thetai, phi, thetar, phir, f_r11 and fifteen elements divided by f_r11.

Notes
-----
Its conventions [1]_ differ from the project's in four ways:

- A negative thetai at azimuth 0 is a source at azimuth 180 degrees, so phir = 0 is forward.
- Elements are divided by f_r11.
- The Stokes frame of the scattered beam is the "xyxy" basis of SCATMECH, the meridian frame
  turned back by the azimuth phir, so that it stays fixed when the viewing direction crosses
  the normal: ``M = R(phir) M_file`` with R the rotation into the meridian frame. Both
  frames agree in plane. Taken as they stand the elements break reciprocity out of plane,
  M12 = -M21 where M12 = M21 must hold.
- The fourth Stokes parameter is positive for left-circular light [2]_, so the elements with
  one index V change sign. The first difference, S1 = Is - Ip, is that of the project.

References
----------
.. [1] T. A. Germer, Full four-dimensional and reciprocal Mueller matrix bidirectional
   reflectance distribution function of sintered polytetrafluoroethylene, Appl. Opt. 56,
   9333 (2017), and the model ZernikeExpansion_BRDF_Model of SCATMECH.
.. [2] SCATMECH, Conventions: (1, 0, 0, 1) is left-circularly polarized light.
"""

import re
from pathlib import Path

import numpy as np

from data_io.goniometer.declarations import Declared
from data_io.goniometer.frames import rotation
from data_io.goniometer.scan import ELEMENTS, Scan
from data_io.text.text import Line, Rows, content_of, read_numbers, without_comments
from pbrdf.errors import DataFileError

_GEOMETRY = ("lambda", "thetai", "phii", "thetar", "phir")
_ELEMENTS = tuple(f"{i}{j}" for i in range(1, 5) for j in range(1, 5))
# The table writes 0.001 degrees for 0, where its author's model has no azimuth
_ZERO_DEG = 1.5e-3


NAME, TAKES = "nist", ()


def looks_like(lines: list[Line]) -> bool:
    """Tell whether the header is that of the NIST table."""
    header = next(content_of(lines))
    return header.text.replace(" ", "").lower().startswith("lambda,thetai")


def read(path: Path, lines: list[Line], declared: Declared) -> Scan:
    """Read the table."""
    content = without_comments(lines)
    names = [cell.strip() for cell in content[0].text.split(",")]
    _check_header(path, content[0], names)
    if len(content) < 2:
        problem = "expected rows below the header, found none"
        raise DataFileError(path, problem, "The file is truncated.")
    table = read_numbers(path, Rows.of(content[1:]), names)
    numbers = [line.number for line in content[1:]]
    if table.shape[1] != len(names):
        problem = f"expected {len(names)} cells as in the header, got {table.shape[1]}"
        raise DataFileError(path, problem, "Separate cells by commas.", line=numbers[0])
    if np.isnan(table).any():
        row, column = (int(i) for i in np.argwhere(np.isnan(table))[0])
        problem = "expected a number, got nan"
        cure = "Remove the row or restore the value."
        raise DataFileError(path, problem, cure, line=numbers[row], column=names[column])
    wavelength, theta_i, phi_i, theta_s, phi_s = table[:, :5].T
    # A negative zenith is the opposite azimuth
    phi_i = np.where(theta_i < 0, phi_i + 180.0, phi_i)
    brdf = _to_conventions(table[:, 5:], np.radians(phi_s), np.radians(phi_i))
    return Scan(
        path=path,
        lines=numbers,
        theta_i=_snap(np.abs(theta_i)),
        theta_s=_snap(theta_s),
        # Multiples of 1e-14 degrees stand for 0
        dphi=np.mod(np.round(phi_s - phi_i, 9), 360.0),
        values={name: brdf[:, int(name[1]), int(name[2])] for name in ELEMENTS},
        wavelength=wavelength,
        names={
            "theta_i": "thetai",
            "theta_s": "thetar",
            "dphi": "phir",
            "wavelength": "lambda",
            "M00": "f_r11",
        },
        attrs={"format": "nist", "title": "Mueller BRDF of sintered PTFE, NIST"},
    )


def _to_conventions(
    elements: np.ndarray, phi_s: np.ndarray, phi_i: np.ndarray
) -> np.ndarray:
    """Return Mueller BRDFs, shape (n, 4, 4), from f_r11 and normalised elements. [1/sr]"""
    mueller = elements.reshape(-1, 4, 4) * elements[:, :1, None]
    mueller[:, 0, 0] = elements[:, 0]
    into_meridian = rotation(np.cos(phi_s), np.sin(phi_s))
    # The beam comes down: its frame turns against its azimuth, seen along the beam
    from_meridian = rotation(np.cos(phi_i), np.sin(phi_i))
    mueller = into_meridian @ mueller @ from_meridian
    left_to_right = np.array([1.0, 1.0, 1.0, -1.0])
    return mueller * np.outer(left_to_right, left_to_right)


def _snap(zenith: np.ndarray) -> np.ndarray:
    return np.where(zenith < _ZERO_DEG, 0.0, zenith)


def _check_header(path: Path, header: Line, names: list[str]) -> None:
    """Compare the column names, in either of the two spellings in circulation."""
    expected = (*_GEOMETRY, *(f"f_r{ij}" for ij in _ELEMENTS))
    plain = []
    for name in names:
        element = re.fullmatch(r"(?:f_?r|m)(\d\d)(?:/f_?r11)?", name)
        plain.append(f"f_r{element[1]}" if element else "phii" if name == "phi" else name)
    for i, column in enumerate(expected):
        found = plain[i] if i < len(plain) else "nothing"
        if found != column:
            problem = f"expected this as column {i + 1}, found {found}"
            cure = "Restore the header and order of columns of the published table."
            raise DataFileError(path, problem, cure, line=header.number, column=column)
    if len(plain) > len(expected):
        problem = f"expected {len(expected)} columns, got {len(plain)}"
        raise DataFileError(path, problem, "Remove the others.", line=header.number)
