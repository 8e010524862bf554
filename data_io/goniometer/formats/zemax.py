"""Zemax tabular BSDF files (.bsdf): scatter angles relative to the specular ray.

ScatterRadial is the angle from the specular ray, ScatterAzimuth turns about it, from the
direction towards the surface normal. Directions below the horizon are dropped; a value of
exactly 0 above it means that nothing was measured there, and becomes NaN. SampleRotation is
the azimuth of the plane of incidence on the sample: several become phi_i.
"""

import warnings
from itertools import zip_longest
from pathlib import Path

import numpy as np

from data_io.goniometer.declarations import Declared
from data_io.goniometer.remarks.settings import one_wavelength
from data_io.goniometer.scan import ConventionWarning, Scan
from data_io.text.text import Line, is_comment, is_number, without_comments
from pbrdf.errors import DataFileError

_AXES = ("SampleRotation", "AngleOfIncidence", "ScatterAzimuth", "ScatterRadial")
_REQUIRED = {
    "SpectralContent": ("Monochrome",),
    "ScatterType": ("BRDF",),
    "Symmetry": ("PlaneSymmetrical", "ASymmetrical", "Asymmetrical"),
}
# Files in circulation state a TIS without the cosine, or of half the space; a table in
# other units misses by more
_TIS_FACTOR = 2.5


NAME, TAKES = "zemax", ()


def looks_like(lines: list[Line]) -> bool:
    """Tell whether the lines without comments are a Zemax table."""
    word = "ScatterRadial"
    return any(word in line.text and line.text.split()[:1] == [word] for line in lines)


def read(path: Path, lines: list[Line], declared: Declared) -> Scan:
    """Read the table; warn where its TIS is not its integral."""
    comments = [line.text.strip("# \t") for line in lines if is_comment(line)]
    content = without_comments(lines)
    begin = next((i for i, line in enumerate(content) if _word(line) == "DataBegin"), None)
    end = next((i for i, line in enumerate(content) if _word(line) == "DataEnd"), None)
    if begin is None or end is None:
        missing = "DataBegin" if begin is None else "DataEnd"
        problem = f"expected a line {missing}, found none"
        raise DataFileError(path, problem, "The file is truncated.")
    axes = _header(path, content[:begin])
    blocks, numbers, stated = _values(path, content[begin + 1 : end], axes)
    rotation, theta_i, azimuth, radial = np.meshgrid(
        *(axes[name] for name in _AXES), indexing="ij"
    )
    theta_s, dphi = from_specular(
        np.radians(theta_i), np.radians(radial), np.radians(azimuth)
    )
    # Half a microdegree keeps the horizon itself in spite of rounding
    real = theta_s <= np.pi / 2 + 1e-8
    measured = np.where(blocks == 0, np.nan, blocks)
    scatter = _integrals(axes, blocks, stated)
    _compare_scatter(path, axes, scatter, stated)
    wavelength = one_wavelength(path, comments)
    return Scan(
        path=path,
        lines=[int(n) for n in numbers[real]],
        theta_i=theta_i[real],
        theta_s=np.minimum(np.degrees(theta_s[real]), 90.0),
        dphi=np.degrees(dphi[real]),
        values={"M00": measured[real]},
        phi_i=np.mod(rotation[real], 360.0) if axes["SampleRotation"].any() else None,
        wavelength=None if wavelength is None else np.full(int(real.sum()), wavelength),
        names={"theta_i": "AngleOfIncidence", "theta_s": "ScatterRadial", "M00": "BRDF"},
        attrs={
            "format": "zemax",
            "title": next((c for c in comments if c.startswith("Sample")), path.stem),
            "comments": "\n".join(c for c in comments if c.strip("=")),
            "not_measured": int(np.isnan(measured[real]).sum()),
            "below_horizon": int((~real).sum()),
            **({"tis": stated, "tis_of_table": scatter} if scatter else {}),
        },
    )


def from_specular(
    theta_i: np.ndarray, radial: np.ndarray, azimuth: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return zenith and dphi of directions given relative to the specular ray. [rad]

    Azimuth 0 points from the specular ray towards the normal. The sense of the azimuth is
    that in which phi_s rises from forward; scalar BRDFs of isotropic samples do not depend
    on it.

    Examples
    --------
    Ten degrees towards the normal from the specular ray at 30 degrees, then 40 degrees,
    which crosses to the source side:

    >>> angles = from_specular(np.radians(30), np.radians([10, 40]), np.zeros(2))
    >>> np.degrees(angles).round(9)
    array([[ 20.,  10.],
           [180.,   0.]])
    """
    # Components along the incident azimuth x, across it y, and along the normal z
    forward = np.cos(radial) * np.sin(theta_i) - np.sin(radial) * np.cos(azimuth) * np.cos(
        theta_i
    )
    across = np.sin(radial) * np.sin(azimuth)
    up = np.cos(radial) * np.cos(theta_i) + np.sin(radial) * np.cos(azimuth) * np.sin(
        theta_i
    )
    theta_s = np.arctan2(np.hypot(forward, across), up)
    # Rounding must not decide the azimuth in plane or at the normal
    across = np.where(np.abs(across) < 1e-12, 0.0, across)
    forward = np.where(np.abs(forward) < 1e-12, 0.0, forward)
    dphi = np.mod(np.arctan2(across, forward) + np.pi, 2 * np.pi)
    return theta_s, dphi


def _word(line: Line) -> str:
    return line.text.split()[0]


def _header(path: Path, header: list[Line]) -> dict[str, np.ndarray]:
    """Return the values of the four axes. [deg]"""
    axes: dict[str, np.ndarray] = {}
    for line, following in zip_longest(header, header[1:]):
        cells = line.text.split()
        if cells[0] in _REQUIRED and cells[1:2] and cells[1] not in _REQUIRED[cells[0]]:
            problem = f"expected {_REQUIRED[cells[0]][0]}, got {cells[1]!r}"
            cure = "Only monochrome reflection tables can be read; export one."
            raise DataFileError(path, problem, cure, line=line.number, column=cells[0])
        if cells[0] in _AXES:
            values = _numbers(path, following or line, cells[0])
            if len(cells) != 2 or cells[1] != str(values.size):
                problem = (
                    f"expected {' '.join(cells[1:])} values as announced, got {values.size}"
                )
                raise DataFileError(
                    path,
                    problem,
                    "The header is damaged.",
                    line=line.number,
                    column=cells[0],
                )
            axes[cells[0]] = values
    for name in _AXES[1:]:
        if name not in axes:
            problem = "expected this axis in the header, found none"
            raise DataFileError(path, problem, "The header is damaged.", column=name)
    return {"SampleRotation": np.zeros(1)} | axes


def _numbers(path: Path, line: Line, column: str) -> np.ndarray:
    cells = line.text.split()
    for cell in cells:
        if not is_number(cell) or not np.isfinite(float(cell)):
            problem = f"expected a finite number, got {cell!r}"
            cure = "Write 0 for what was not measured."
            raise DataFileError(path, problem, cure, line=line.number, column=column)
    return np.array([float(cell) for cell in cells])


def _values(
    path: Path, data: list[Line], axes: dict[str, np.ndarray]
) -> tuple[np.ndarray, np.ndarray, list[float]]:
    """Return the table, shape of the four axes, the line of each value, and every TIS."""
    shape = tuple(axes[name].size for name in _AXES)
    rows, numbers = [], []
    stated: list[float] = []
    for line in data:
        if _word(line) == "TIS":
            cells = Line(line.number, line.text.strip().removeprefix("TIS") or "none")
            stated.extend(_numbers(path, cells, "TIS")[:1].tolist())
            continue
        values = _numbers(path, line, "BRDF")
        if values.size != shape[3]:
            problem = f"expected {shape[3]} values, one a ScatterRadial, got {values.size}"
            raise DataFileError(path, problem, "The row is truncated.", line=line.number)
        rows.append(values)
        numbers.append(line.number)
    if len(rows) != shape[0] * shape[1] * shape[2]:
        problem = (
            f"expected {shape[0]} x {shape[1]} x {shape[2]} rows, rotation x incidence x "
            f"azimuth, got {len(rows)}"
        )
        raise DataFileError(path, problem, "The table is truncated or has extra rows.")
    return (
        np.array(rows).reshape(shape),
        np.broadcast_to(np.array(numbers).reshape(*shape[:3], 1), shape),
        stated,
    )


def _integrals(
    axes: dict[str, np.ndarray], blocks: np.ndarray, stated: list[float]
) -> list[float]:
    """Return the integral of each block that has a TIS beside it, or nothing.

    The integral is taken over what the table covers, by trapezoids in the angles about the
    specular ray; of half a circle the other half counts too.
    """
    azimuth, radial = np.radians(axes["ScatterAzimuth"]), np.radians(axes["ScatterRadial"])
    if (
        len(stated) != blocks.shape[0] * blocks.shape[1]
        or min(azimuth.size, radial.size) < 3
    ):
        return []
    halves = 2.0 if np.isclose(azimuth[-1] - azimuth[0], np.pi) else 1.0
    found = []
    for table, incidence in zip(
        blocks.reshape(-1, *blocks.shape[2:]), _incidences(axes), strict=True
    ):
        beside = np.full((azimuth.size, radial.size), np.radians(incidence))
        theta_s, _ = from_specular(beside, *np.meshgrid(radial, azimuth))
        cosine = np.maximum(np.cos(theta_s), 0.0)
        rings = np.trapezoid(table * cosine, azimuth, axis=0) * halves
        found.append(float(np.trapezoid(rings * np.sin(radial), radial)))
    return found


def _compare_scatter(
    path: Path, axes: dict[str, np.ndarray], found: list[float], stated: list[float]
) -> None:
    """Warn where the integral of the table misses the stated total integrated scatter."""
    ratios = [
        own / tis if tis > 0 else 1.0 for own, tis in zip(found, stated, strict=False)
    ]
    if not ratios or max(ratios) <= 0:
        return
    far = [max(ratio, 1.0 / ratio) if ratio > 0 else 1.0 for ratio in ratios]
    worst = int(np.argmax(far))
    if far[worst] > _TIS_FACTOR:
        msg = (
            f"{path.name}: the BRDF integrates to {ratios[worst]:.3g} times the TIS stated "
            f"beside it, at {_incidences(axes)[worst]:g} deg incidence. The table may be "
            "scaled; --quantity says what it is."
        )
        warnings.warn(msg, ConventionWarning, stacklevel=5)


def _incidences(axes: dict[str, np.ndarray]) -> np.ndarray:
    return np.tile(axes["AngleOfIncidence"], axes["SampleRotation"].size)
