"""Directions of readings, out of scans."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from pbrdf.errors import real_array

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Geometry", "geometry_of", "joined"]


@dataclass(frozen=True, eq=False)
class Geometry:
    """Directions of N measurements.

    Parameters
    ----------
    theta_i, theta_s, dphi, phi_i : ndarray, shape (N,)
        Angles of the conventions page. [rad]
    wavelength : ndarray, shape (N,)
        NaN where unknown. [um]
    source_half_angle, detector_half_angle : ndarray, shape (N,), optional
        Half-angles of the cones of light, NaN where the scan names none. [rad]
    axis_theta_i, axis_phi_i, axis_theta_s, axis_dphi : ndarray, shape (N,), optional
        Of rays in cones of light the axes of these; what varies slowly is taken there.
        [rad]
    """

    theta_i: np.ndarray
    theta_s: np.ndarray
    dphi: np.ndarray
    phi_i: np.ndarray
    wavelength: np.ndarray
    source_half_angle: np.ndarray | None = None
    detector_half_angle: np.ndarray | None = None
    axis_theta_i: np.ndarray | None = None
    axis_phi_i: np.ndarray | None = None
    axis_theta_s: np.ndarray | None = None
    axis_dphi: np.ndarray | None = None

    @property
    def size(self) -> int:
        """Number of geometries."""
        return len(self.theta_i)

    def at(self, index: np.ndarray) -> "Geometry":
        """Return the directions of these numbers."""
        columns = {column.name: getattr(self, column.name) for column in fields(self)}
        given = {name: one for name, one in columns.items() if one is not None}
        return Geometry(**{name: one[index] for name, one in given.items()})

    def axis(self, name: str) -> np.ndarray:
        """Return an angle of the axes, of a point that angle itself. [rad]"""
        axis = getattr(self, f"axis_{name}")
        return np.asarray(getattr(self, name) if axis is None else axis)

    @property
    def theta_view(self) -> np.ndarray:
        """Signed view angle, positive on the forward side; nan out of plane. [rad]"""
        out = np.abs(np.sin(self.dphi)) * np.sin(self.theta_s) > 1e-9
        return np.where(out, np.nan, -np.sign(np.cos(self.dphi)) * self.theta_s)


def geometry_of(label: str, scan: "xr.Dataset") -> Geometry:
    """Return the directions of a scan."""
    if not hasattr(scan, "data_vars"):
        msg = (
            f"measurement must be an xarray.Dataset with the dimension geometry, got "
            f"{type(scan).__name__} for {label}. Use data_io.read_goniometer."
        )
        raise TypeError(msg)
    missing = [name for name in ("theta_i", "theta_s", "dphi") if name not in scan.coords]
    if "geometry" not in scan.dims or missing:
        lacks = ", ".join(missing) or "geometry"
        msg = (
            f"measurement {label} must have the dimension geometry with theta_i, theta_s "
            f"and dphi [rad], got none of {lacks}. Use data_io.read_goniometer."
        )
        raise ValueError(msg)
    size = scan.sizes["geometry"]

    def column(name: str, default: float) -> np.ndarray:
        if name not in scan.coords:
            return np.full(size, default)
        return np.broadcast_to(real_array(name, scan[name].values), (size,)).copy()

    return Geometry(
        theta_i=column("theta_i", np.nan),
        theta_s=column("theta_s", np.nan),
        dphi=column("dphi", np.nan),
        phi_i=column("phi_i", 0.0),
        wavelength=column("wavelength", np.nan),
        source_half_angle=column("source_half_angle", np.nan),
        detector_half_angle=column("detector_half_angle", np.nan),
    )


def joined(parts: Sequence[Geometry]) -> Geometry:
    """Return the directions of several scans in a row."""
    columns = {
        column.name: [getattr(part, column.name) for part in parts]
        for column in fields(Geometry)
    }
    return Geometry(
        **{
            name: np.concatenate(found)
            for name, found in columns.items()
            if all(one is not None for one in found)
        }
    )
