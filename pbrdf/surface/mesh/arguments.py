"""Labels and period of a mesh, as a user gives them."""

from typing import Any

import numpy as np
import numpy.typing as npt

from pbrdf.errors import require

__all__ = ["check_extent", "checked_labels", "checked_period", "is_parts"]

# Labels of faces by the part of a file that they come from
PARTS = "parts"
# A mesh may reach over so many of its periods
MOST_LAPS = 8


def is_parts(labels: npt.ArrayLike | str | None) -> bool:
    """Whether the parts of a file number the materials."""
    if isinstance(labels, str) and labels != PARTS:
        msg = f'labels must be numbers of materials or "{PARTS}", got {labels!r}.'
        raise ValueError(msg)
    return isinstance(labels, str)


def checked_labels(labels: Any, faces: int) -> np.ndarray | None:
    """One number of a material for each face."""
    if labels is None:
        return None
    numbers = require(
        "labels", labels, lambda v: (v >= 0) & (v <= 255) & (v == np.floor(v)),
        "be whole numbers in [0, 255]", "Number the materials from 0.",
    )  # fmt: skip
    if numbers.shape != (faces,):
        msg = (
            f"labels must have one number for each of the {faces} faces, got shape "
            f"{numbers.shape}. Number the materials of faces from 0."
        )
        raise ValueError(msg)
    return numbers.astype(np.uint8)


def checked_period(period: tuple[float, float]) -> tuple[float, float]:
    """Two positive lengths. [um]"""
    lengths = require(
        "period", period, lambda v: (v > 0) & np.isfinite(v), "be positive [um]",
        "Give (lx, ly), or None for a mesh that does not repeat.",
    )  # fmt: skip
    if lengths.shape != (2,):
        msg = f"period must be (lx, ly) [um], got shape {lengths.shape}."
        raise ValueError(msg)
    return float(lengths[0]), float(lengths[1])


def check_extent(vertices: np.ndarray, period: tuple[float, float]) -> None:
    """Refuse a mesh that overlaps so many of its images that the period must be wrong."""
    widths = np.ptp(vertices[:, :2], axis=0)
    laps = float((widths / period).max())
    if laps > MOST_LAPS:
        msg = (
            f"period must be no less than an {MOST_LAPS}th of the mesh [um], got {period} "
            f"for a mesh of {widths[0]:.4g} x {widths[1]:.4g} um. Check the unit."
        )
        raise ValueError(msg)
