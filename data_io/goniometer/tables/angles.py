"""Directions of a table in the conventions, from whichever angles it gives."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from data_io.goniometer.declarations import Declared
from data_io.goniometer.tables.columns import Columns
from pbrdf.errors import DataFileError

__all__ = ["directions", "relative_azimuth"]

_NEEDED = (
    "Give theta_i_deg and theta_view_deg (signed), or theta_s_deg with dphi_deg, or with "
    "phi_s_deg and phi_i_deg."
)


def relative_azimuth(
    phi_s: np.ndarray, phi_i: np.ndarray | float, azimuth_of_forward: float
) -> np.ndarray:
    """Return dphi of absolute azimuths; forward lies at phi_i + azimuth_of_forward. [deg]

    Examples
    --------
    >>> relative_azimuth(np.array([40.0, 220.0]), 40.0, 0.0)
    array([180.,   0.])
    """
    return np.mod(phi_s - phi_i - azimuth_of_forward + 180.0, 360.0)


def directions(
    path: Path, columns: Columns, declared: Declared, header: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None, str]:
    """Return theta_i, theta_s, dphi, phi_i [deg] and what named the detector's zenith.

    Raises
    ------
    DataFileError
        If a direction is missing, stands twice, or needs to be told which side is forward.
    """
    angles = columns.angles
    forward = 180.0 if declared.azimuth_of_forward is None else declared.azimuth_of_forward
    _require(path, angles.keys(), header)
    phi_i = angles.get("phi_i")
    if "sample_rotation" in angles:
        # The sample turned by +a sees a source that stands still at the azimuth -a
        phi_i = np.mod(-angles["sample_rotation"], 360.0)
    if "phi_s" in angles:
        if phi_i is None and declared.azimuth_of_forward is None:
            problem = (
                "expected the azimuth of the source or of the forward side beside absolute "
                "azimuths, found neither"
            )
            cure = (
                "Give a column phi_i_deg, or --azimuth-of-forward 0 or 180: the phi_s_deg "
                "at which the specular reflection lies."
            )
            raise DataFileError(
                path, problem, cure, line=header, column=columns.names["phi_s"]
            )
        source = 0.0 if phi_i is None or "phi_i" not in angles else phi_i
        dphi = relative_azimuth(angles["phi_s"], source, forward)
        return angles["theta_i"], angles["theta_s"], dphi, phi_i, "theta_s"
    theta_s, dphi, name = _view(path, columns)
    if forward == 0.0:
        dphi = np.mod(dphi + 180.0, 360.0)
    return angles["theta_i"], theta_s, dphi, phi_i, name


def _require(path: Path, names: Iterable[str], header: int) -> None:
    """Refuse a table that lacks an angle, or has two that may contradict each other."""
    have = set(names)
    needed = ["theta_i"]
    # The signed view angle stands for both others, but half a pair stands for nothing
    if "theta_view" not in have or have & {"theta_s", "dphi", "phi_s"}:
        needed.append("theta_s")
        if "phi_s" not in have:
            needed.append("dphi")
    for angle in needed:
        if angle not in have:
            problem = "expected this column, found none"
            raise DataFileError(path, problem, _NEEDED, line=header, column=f"{angle}_deg")
    for one, other in (
        ("phi_s", "dphi"), ("phi_s", "theta_view"), ("phi_i", "sample_rotation"),
    ):  # fmt: skip
        if {one, other} <= have:
            problem = f"expected {other}_deg or {one}_deg, found both"
            cure = f"Leave one out: --columns {one}_deg=ignore."
            raise DataFileError(path, problem, cure, line=header)


def _view(path: Path, columns: Columns) -> tuple[np.ndarray, np.ndarray, str]:
    """Return theta_s, dphi [deg] and the column they came from.

    The signed view angle is positive on the forward side, where dphi is 180 degrees.
    """
    angles = columns.angles
    view = angles.get("theta_view")
    if view is None:
        return angles["theta_s"], angles["dphi"], "theta_s"
    theta_s, dphi = np.abs(view), np.where(view >= 0, 180.0, 0.0)
    if "theta_s" not in angles:
        return theta_s, dphi, "theta_view"
    turn = np.mod(angles["dphi"] - dphi + 180.0, 360.0) - 180.0
    # At the normal every azimuth is right
    at_odds = (np.abs(angles["theta_s"] - theta_s) > 1e-3) | (
        (np.abs(turn) > 1e-3) & (theta_s > 1e-3)
    )
    if at_odds.any():
        row = int(np.argmax(at_odds))
        problem = (
            f"expected the direction theta_s_deg = {angles['theta_s'][row]:.6g}, "
            f"dphi_deg = {angles['dphi'][row]:.6g}, got {view[row]:.6g}"
        )
        cure = "Keep theta_view_deg, or theta_s_deg with dphi_deg."
        raise DataFileError(
            path, problem, cure, line=columns.lines[row], column=columns.names["theta_view"]
        )
    return angles["theta_s"], angles["dphi"], "theta_s"
