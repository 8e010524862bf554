"""Statistics of triangle meshes: slopes, overhangs and area, from the facets alone."""

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.estimate import Estimate
from pbrdf import MeshSurface
from pbrdf.surface.mesh.probes import exposed_shares

if TYPE_CHECKING:
    import pandas as pd

# Parts of the area, along each axis, whose scatter tells the errors
PARTS = 4
# Facets steeper than this are walls, which have no slope to speak of [rad]
WALL = np.deg2rad(80.0)
# Tilts at which the distribution is told [rad]
TILTS = np.deg2rad(np.arange(0.0, 181.0, 5.0))


@dataclass(frozen=True, kw_only=True)
class MeshStatistics:
    """Statistics of the facets of a mesh, each with a 95 % interval.

    Errors are the scatter between 16 parts of the mesh: they tell how well the mesh
    stands for more of the same surface. Where bodies intersect, what of a face lies inside
    another body does not count; 100 000 points tell how much that is.

    Attributes
    ----------
    area_ratio : Estimate
        Area of the surface over the area of the period, or of the rectangle around. [1]
    overhang_share : Estimate
        Share of the area that looks down. [1]
    wall_share : Estimate
        Share of the area within 10 degrees of upright. [1]
    slope_rms : Estimate
        PER AXIS, of facets that look up and are no walls, as seen from above. [1]
    slope_rms_x, slope_rms_y : Estimate
        The same along each axis. [1]
    tilt : ndarray
        Ends of the bins of `tilt_share`: zenith angles of normals. [rad]
    tilt_share : ndarray
        Share of the area in each bin. [1]
    warnings : tuple of str
        What a user must know before the numbers are used.
    """

    area_ratio: Estimate
    overhang_share: Estimate
    wall_share: Estimate
    slope_rms: Estimate
    slope_rms_x: Estimate
    slope_rms_y: Estimate
    tilt: np.ndarray
    tilt_share: np.ndarray
    warnings: tuple[str, ...]

    def __str__(self) -> str:
        lines = [
            f"{entry.name:>18}  {getattr(self, entry.name)}"
            for entry in fields(self)
            if isinstance(getattr(self, entry.name), Estimate)
        ]
        return "\n".join([*lines, *(f"warning: {text}" for text in self.warnings)])

    def to_frame(self) -> "pd.DataFrame":
        """Estimates as a table with one row each."""
        import pandas as pd

        return pd.DataFrame.from_dict(self._estimates(), orient="index")

    def tilts(self) -> "pd.DataFrame":
        """Return the share of the area by zenith angles of normals, one row a bin."""
        import pandas as pd

        edges = np.rad2deg(self.tilt).round(6)
        return pd.DataFrame(
            {
                "tilt_low_deg": edges[:-1],
                "tilt_high_deg": edges[1:],
                "area_share": self.tilt_share,
            }
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, strings, lists and dicts, as for a report or a TOML file."""
        numbers: dict[str, Any] = {
            name: {**row, "units": "1"} for name, row in self._estimates().items()
        }
        return numbers | {
            "tilt_deg": np.rad2deg(self.tilt).round(6).tolist(),
            "tilt_share": self.tilt_share.tolist(),
            "warnings": list(self.warnings),
        }

    def _estimates(self) -> dict[str, dict[str, float]]:
        return {
            entry.name: getattr(self, entry.name).as_dict()
            for entry in fields(self)
            if isinstance(getattr(self, entry.name), Estimate)
        }


def mesh_statistics(mesh: MeshSurface) -> MeshStatistics:
    """Measure the facets of a mesh.

    Parameters
    ----------
    mesh : MeshSurface
        The mesh.
    """
    normals, areas = mesh.normals, mesh.areas
    if mesh.intersecting:
        areas = areas * exposed_shares(
            mesh.vertices, mesh.faces, normals, areas, mesh.period
        )
    up = normals[:, 2]
    tilt = np.arccos(np.clip(up, -1.0, 1.0))
    gentle = tilt < WALL
    # Slopes count by the area as seen from above
    level = np.where(gentle, areas * up, 0.0)
    slopes = -normals[:, :2] / np.where(gentle, up, 1.0)[:, None]
    size = np.asarray(mesh.size)
    place = (mesh.vertices[mesh.faces].mean(axis=1)[:, :2] - mesh.bounds[0, :2]) / size
    cell = np.clip((np.mod(place, 1.0) * PARTS).astype(int), 0, PARTS - 1)
    part = cell[:, 0] * PARTS + cell[:, 1]

    def sums(weights: np.ndarray) -> np.ndarray:
        return np.bincount(part, weights=weights, minlength=PARTS**2)

    whole, seen = sums(areas), sums(level)
    square_x, square_y = (sums(level * slopes[:, axis] ** 2) for axis in (0, 1))
    ground = np.full(PARTS**2, size.prod() / PARTS**2)
    share = np.histogram(tilt, bins=TILTS, weights=areas)[0] / areas.sum()
    notes = []
    if mesh.kind == "bodies":
        notes.append("Bodies without a ground: slopes are those of their upper sides.")
    walls = float(areas[np.abs(tilt - np.pi / 2) < np.pi / 2 - WALL].sum() / areas.sum())
    if walls > 0.05:
        notes.append(
            f"{100 * walls:.3g} % of the area is within 10 degrees of upright and is left "
            "out of the slopes."
        )
    return MeshStatistics(
        area_ratio=_ratio(whole, ground),
        overhang_share=_ratio(sums(np.where(up < -1e-9, areas, 0.0)), whole),
        wall_share=_ratio(
            sums(np.where(np.abs(tilt - np.pi / 2) < np.pi / 2 - WALL, areas, 0.0)), whole
        ),
        slope_rms=_root(_ratio(0.5 * (square_x + square_y), seen)),
        slope_rms_x=_root(_ratio(square_x, seen)),
        slope_rms_y=_root(_ratio(square_y, seen)),
        tilt=TILTS,
        tilt_share=share,
        warnings=tuple(notes),
    )


def _ratio(over: np.ndarray, under: np.ndarray) -> Estimate:
    """Ratio of two sums, with the error that its parts show when left out one by one."""
    value = float(over.sum() / under.sum())
    rest = under.sum() - under
    if (rest <= 0.0).any():
        return Estimate.undetermined(value)
    left = (over.sum() - over) / rest
    n = len(over)
    stderr = float(np.sqrt((n - 1) / n * ((left - left.mean()) ** 2).sum()))
    return Estimate.symmetric(value, stderr, lowest=0.0)


def _root(square: Estimate) -> Estimate:
    """Root of an estimate of a mean square."""
    value = float(np.sqrt(square.value))
    if not np.isfinite(square.stderr):
        return Estimate.undetermined(value)
    stderr = 0.5 * square.stderr / value if value > 0.0 else 0.0
    return Estimate.symmetric(value, stderr, lowest=0.0)
