"""Whether a map can be what an instrument measured: its field, pixel and slope."""

import warnings
from pathlib import Path

import numpy as np

from pbrdf.errors import DataFileError
from pbrdf.surface.heightmap import HeightMap


class ScaleWarning(UserWarning):
    """Lengths of a file that can hardly be what was measured."""


# The widest field of an instrument, and steps below which there is nothing to measure. [um]
_WIDEST = 1e6
# The longest mirror that is measured in one piece. [um]
_LONGEST = 1e7
_FINEST = 1e-5
# Slopes of neighbours, in the middle of their distribution
_STEEPEST = 30.0
_FLATTEST = 1e-9
# Readers take a unit for another a thousand or a million times as large
_FACTORS = (1e-3, 1e-6, 1e-9, 1e3, 1e6, 1e9)
# Heights of a kilometre are none of a surface. [um]
MOST_HEIGHT = 1e9


def check_scale(path: str | Path, surface: HeightMap, *, stated: bool) -> HeightMap:
    """Return a map whose field, pixel and slope are plausible.

    Parameters
    ----------
    path : str or Path
        For the message.
    surface : HeightMap
        As its reader gave it. [um]
    stated : bool
        Whether the caller gave the scale; then it is warned of, not refused.

    Raises
    ------
    DataFileError
        If the field exceeds a metre, the pixel is below an atom, or the slopes are those of
        no surface, with the reading that would be plausible.

    Warns
    -----
    ScaleWarning
        The same, for a scale that the caller gave.
    """
    field = max(n * d for n, d in zip(surface.shape, surface.spacing, strict=True))
    known = surface.heights[np.isfinite(surface.heights)]
    fault = _fault(
        field, max(surface.spacing), typical_slope(surface), float(np.ptp(known))
    )
    if fault is None:
        return surface
    problem, cure = fault
    if not stated:
        raise DataFileError(path, problem, cure)
    warnings.warn(f"{Path(path).name}: {problem}. {cure}", ScaleWarning, stacklevel=4)
    return surface


def check_heights(path: str | Path, heights: np.ndarray) -> None:
    """Refuse heights beyond a kilometre, which markers of missing points may have been.

    Raises
    ------
    DataFileError
        With the largest.
    """
    highest = float(np.nanmax(np.abs(heights), initial=0.0))
    if highest > MOST_HEIGHT:
        problem = f"expected heights of a surface, got {highest:.3g} um"
        cure = "Check the unit (unit=); mark missing points with NaN."
        raise DataFileError(path, problem, cure)


def with_spacing(
    path: str | Path, surface: HeightMap, spacing: float | tuple[float, float]
) -> HeightMap:
    """Return a map with the steps of the caller, if those of its file cannot be right.

    Raises
    ------
    DataFileError
        If the steps of the file are plausible.
    """
    try:
        check_scale(path, surface, stated=False)
    except DataFileError:
        return HeightMap(surface.heights, spacing)
    dx, dy = surface.spacing
    problem = (
        f"expected no spacing argument, the file names its own: {dx:.6g} x {dy:.6g} um"
    )
    raise DataFileError(path, problem, "Leave the argument out.")


def check_profile_scale(path: str | Path, x: np.ndarray, z: np.ndarray) -> None:
    """Warn of a profile whose length, step or slope can hardly be what was measured.

    Warns
    -----
    ScaleWarning
        With the reading that would be plausible. Profiles of large mirrors are metres long.
    """
    length, step = float(x[-1] - x[0]), float(np.median(np.diff(x)))
    with np.errstate(over="ignore", invalid="ignore"):
        slopes = np.abs(np.diff(z) / np.diff(x))
    slopes = slopes[slopes > 0]
    slope = float(np.median(slopes)) if slopes.size else 0.0
    fault = _fault(length, step, slope, float(np.ptp(z)), widest=_LONGEST)
    if fault is not None:
        problem = fault[0].replace("field", "length").replace("pixel", "step")
        msg = f"{Path(path).name}: {problem}. Check the units of both columns (unit=)."
        warnings.warn(msg, ScaleWarning, stacklevel=3)


def _fault(
    field: float, pixel: float, slope: float, height: float, *, widest: float = _WIDEST
) -> tuple[str, str] | None:
    """Return what is implausible and how to mend it."""
    if field > widest or pixel < _FINEST:
        other = next(
            (f for f in _FACTORS if field * f < _WIDEST / 10 and pixel * f > 1e-3), None
        )
        problem = (
            f"expected the field of an instrument, got {_length(field)} with a pixel of "
            f"{_length(pixel)}"
        )
        if other is not None:
            problem += (
                f"; in another unit it would be {_length(field * other)} with a pixel of "
                f"{_length(pixel * other)}"
            )
        return problem, "Say which by spacing= in um."
    if slope > _STEEPEST or 0 < slope < _FLATTEST:
        problem = (
            f"expected slopes of a surface, got {slope:.3g} in the middle, of a height "
            f"range of {_length(height)} over pixels of {_length(pixel)}"
        )
        return problem, (
            "Check the units of both, and give the right pixel by spacing= in um."
        )
    return None


def typical_slope(surface: HeightMap) -> float:
    """Median of the slopes of neighbours that differ. [1]"""
    # Heights near the largest number there is
    with np.errstate(over="ignore", invalid="ignore"):
        parts = [np.abs(part[np.isfinite(part)]).ravel() for part in surface.slopes()]
    slopes = np.concatenate(parts)
    slopes = slopes[slopes > 0]
    return float(np.median(slopes)) if slopes.size else 0.0


def _length(value: float) -> str:
    """Return a length in a unit that reads well."""
    for size, unit in ((1e6, "m"), (1e3, "mm"), (1.0, "um"), (1e-3, "nm")):
        if value >= size:
            return f"{value / size:.4g} {unit}"
    return f"{value / 1e-3:.3g} nm"
