"""A mesh as what lies on it sees it: where bodies come to rest, what of them is outside."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pbrdf.contaminants.columns import Crossings, crossings, spans, triangles_near
from pbrdf.contaminants.ground import Ground, Rest
from pbrdf.contaminants.shapes import Shape
from pbrdf.kernels.bodies.profile import widest_above
from pbrdf.surface.heightmap import HeightMap
from pbrdf.surface.mesh import MeshSurface

__all__ = ["MeshGround"]

# Lines along one side of the square under a body: so many for each facet, within bounds
LINES_PER_FACET = 8
FEWEST, MOST = 96, 384
# How much wider than a drop the square under it is
AROUND = 1.5
# Shift of the lines off the middle, in their spacing, so that none meets an edge
ASIDE = (0.0037, 0.0053)
# Heights under a drop that differ by less than this share of its size are level
LEVEL = 1e-12
# Mean slope under a drop up to which its axis may stand upright
STEEPEST = 0.3
# Share of its height that a drop goes on below the lowest point under it
MARGIN = 1e-3


@dataclass(frozen=True, eq=False)
class MeshGround(Ground):
    """A mesh on which bodies are set down from above, at given places."""

    surface: MeshSurface  # type: ignore[assignment]

    def __post_init__(self) -> None:
        """Take any mesh: it has no holes."""

    @property
    def size(self) -> tuple[float, float]:
        """Lengths of the period, or of the whole finite mesh. [um]"""
        return self.surface.size

    @property
    def corner(self) -> tuple[float, float]:
        """Lowest x and y. [um]"""
        return float(self.surface.bounds[0, 0]), float(self.surface.bounds[0, 1])

    @property
    def periodic(self) -> bool:
        """Whether the mesh repeats."""
        return self.surface.periodic

    @cached_property
    def lowest(self) -> float:
        """Lowest vertex. [um]"""
        return float(self.surface.bounds[0, 2])

    @cached_property
    def highest(self) -> float:
        """Highest vertex. [um]"""
        return float(self.surface.bounds[1, 2])

    @property
    def flat(self) -> bool:
        """Of what lies elsewhere the contact angle of a drop knows nothing."""
        return True

    def rest(self, x: float, y: float, radius: float) -> float:
        """Height of the centre of a sphere that touches the mesh from above. [um]"""
        triangles, _ = triangles_near(self.surface, x, y, radius)
        height = touching_height(triangles, radius)
        if not np.isfinite(height):
            msg = (
                f"positions must lie over the mesh [um], got ({x:.6g}, {y:.6g}), below "
                "which there is nothing. Move the sphere, or give its centre (x, y, z)."
            )
            raise ValueError(msg)
        return height

    def volume_above(
        self, shape: Shape, x: float, y: float, z: float, azimuths: int | None = None
    ) -> Rest:
        """Measure what of a body about the axis (x, y) is not in solids of the mesh."""
        widest = float(widest_above(shape.slabs, shape.bottom))
        view = self._columns(x, y, widest)
        low, high = (end + z for end in spans(shape, view.distance))
        sunk = _inside(view.met, low, high)
        volume = shape.whole_volume - float(sunk.sum()) * view.cell
        # What is left of a body wholly in a solid is rounding of the columns
        volume = max(volume, 0.0) if (sunk < (high - low))[high > low].any() else 0.0
        wetted = float(np.count_nonzero(sunk)) * view.cell
        return Rest(z, volume, wetted, widest)

    def settle(self, shape: Shape, x: float, y: float) -> Rest:
        """Lay a drop about the axis (x, y), with its volume above the mesh true.

        The surface seen from above, sampled as a height map, is what it lies on.
        """
        half = AROUND * shape.radius
        view = self._columns(x, y, half)
        top = view.highest()
        under = view.distance <= shape.radius
        if not np.isfinite(top[under]).all():
            msg = (
                f"positions must leave a drop wholly over the mesh [um], got ({x:.6g}, "
                f"{y:.6g}) for one of radius {shape.radius:.4g} um, part of which has "
                "nothing below. Move it, or take less volume."
            )
            raise ValueError(msg)
        level = float(top[under].max())
        if level - top[under].min() <= LEVEL * shape.height:
            wetted = float(np.pi * shape.base_radius**2)
            return Rest(level, shape.volume, wetted, shape.base_radius)
        self._check_gentle(view, top, under, shape, (x, y))
        known = np.where(np.isfinite(top), top, top[under].min())
        side = len(view.axis)
        patch = HeightMap(known.reshape(side, side), view.spacing)
        return Ground(patch).settle(shape, -view.axis[0], -view.axis[0])

    def _check_gentle(
        self,
        view: "Columns",
        top: np.ndarray,
        under: np.ndarray,
        shape: Shape,
        place: tuple[float, float],
    ) -> None:
        """Refuse places that are too steep or uneven for a drop with an upright axis."""
        base = under & (view.distance <= max(shape.base_radius, 2.0 * view.spacing))
        count = len(view.axis)
        x, y = np.repeat(view.axis, count), np.tile(view.axis, count)
        plane = np.column_stack([x, y, np.ones(len(top))])[base]
        fitted = np.linalg.lstsq(plane, top[base], rcond=None)[0]
        slope = float(np.hypot(fitted[0], fitted[1]))
        relief = float(np.ptp(top[base]))
        if slope > STEEPEST or relief > shape.height:
            msg = (
                "drops on a mesh must lie on flat or gently curved places, got a mean "
                f"slope of {slope:.3g} (at most {STEEPEST:g}) and {relief:.4g} um of "
                f"relief under the drop at ({place[0]:.6g}, {place[1]:.6g}) um, "
                f"{shape.height:.4g} um high. Move it, or take less volume."
            )
            raise ValueError(msg)

    def trimmed(self, shape: Shape, x: float, y: float, z: float) -> Shape:
        """Body of a drop that ends a little below the surface under it.

        Raises
        ------
        ValueError
            If it would still come out of the solid below, or something hangs into it.
        """
        view = self._columns(x, y, AROUND * shape.radius)
        low, high = (end + z for end in spans(shape, view.distance))
        top = view.highest()
        wet = high > top
        floor = float(top[wet].min()) - z
        margin = MARGIN * shape.height + float(np.ptp(top[wet])) / LINES_PER_FACET
        trimmed = shape.above(floor - margin)
        if float(widest_above(trimmed.slabs, trimmed.bottom)) > AROUND * shape.radius:
            msg = (
                "drops on a mesh must lie on flat or gently curved places, got a surface "
                f"that falls away by {float(np.ptp(top[wet])):.4g} um under the drop at "
                f"({x:.6g}, {y:.6g}) um, {shape.height:.4g} um high. Move it, or take "
                "less volume."
            )
            raise ValueError(msg)
        low = np.maximum(low, trimmed.bottom + z)
        met, count = view.met, _depth(view.met)
        comes_out = (met.side < 0) & (count <= 0)
        comes_out &= (met.z > low[met.line]) & (met.z < high[met.line])
        if comes_out.any():
            msg = (
                "drops on a mesh must end in the solid under them, got a face that looks "
                f"down at z = {met.z[comes_out].max():.6g} um in the drop at ({x:.6g}, "
                f"{y:.6g}) um, on z = {z:.6g} um. Move it from overhangs and thin plates, "
                "or take less volume."
            )
            raise ValueError(msg)
        return trimmed

    def _columns(self, x: float, y: float, half: float) -> "Columns":
        """Lines over a square of half side `half` around a place."""
        triangles, faces = triangles_near(self.surface, x, y, half)
        facet = float(np.sqrt(np.median(self.surface.areas[faces]))) if len(faces) else half
        wanted = int(np.ceil(LINES_PER_FACET * 2.0 * half / facet))
        count = min(max(wanted, FEWEST), MOST)
        spacing = 2.0 * half / (count - 1)
        axis = (np.arange(count) - 0.5 * (count - 1)) * spacing
        shifted = triangles + np.array([*ASIDE, 0.0]) * spacing
        return Columns(axis, spacing, crossings(shifted, axis))


class Columns(NamedTuple):
    """Lines over a square around a place: their axis and spacing, and what they meet."""

    axis: np.ndarray
    spacing: float
    met: Crossings

    @property
    def cell(self) -> float:
        """Area of the square around each line. [um²]"""
        return self.spacing**2

    @property
    def distance(self) -> np.ndarray:
        """Distance of each line from the place. [um]"""
        return np.hypot(self.axis[:, None], self.axis[None, :]).ravel()

    def highest(self) -> np.ndarray:
        """Highest point of the mesh on each line, -inf where there is none. [um]"""
        top = np.full(len(self.axis) ** 2, -np.inf)
        np.maximum.at(top, self.met.line, self.met.z)
        return top


def _depth(met: Crossings) -> np.ndarray:
    """How many solids hold the part of its line below each crossing."""
    total = np.cumsum(met.side)
    first = np.r_[True, met.line[1:] != met.line[:-1]]
    before = (total - met.side)[first]
    starts = np.cumsum(first) - 1
    depth: np.ndarray = total - before[starts]
    return depth


def _inside(met: Crossings, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Length of each line between two heights that is in solids. [um]"""
    last = np.r_[met.line[1:] != met.line[:-1], True]
    below = np.where(last, -np.inf, np.r_[met.z[1:], -np.inf])
    part = np.minimum(met.z, high[met.line]) - np.maximum(below, low[met.line])
    part = np.where(_depth(met) > 0, np.maximum(part, 0.0), 0.0)
    return np.bincount(met.line, weights=part, minlength=len(low))


def touching_height(triangles: np.ndarray, radius: float) -> float:
    """Height of a sphere's centre over x = y = 0 that comes to rest on facets (n, 3, 3).

    It touches a corner, an edge or the inside of a facet: the highest of all; -inf if there
    is none.
    """
    found = [np.array([-np.inf])]
    room = radius**2 - (triangles[..., :2] ** 2).sum(axis=-1)
    found.append(triangles[..., 2][room >= 0.0] + np.sqrt(room[room >= 0.0]))
    for p, q in ((0, 1), (1, 2), (2, 0)):
        start, step = triangles[:, p], triangles[:, q] - triangles[:, p]
        length = np.hypot(step[:, 0], step[:, 1])
        lying = length > 0.0
        start, step, length = start[lying], step[lying], length[lying]
        slope = step[:, 2] / length
        along = (start[:, :2] * step[:, :2]).sum(axis=1) / length
        room = radius**2 - (start[:, :2] ** 2).sum(axis=1) + along**2
        root = np.sqrt(np.maximum(room, 0.0))
        # Where the slope of the sphere's lower side is that of the edge
        place = root * slope / np.sqrt(1.0 + slope**2)
        on_it = (room > 0.0) & (place >= along) & (place <= along + length)
        height = start[:, 2] + (place - along) * slope
        found.append((height + np.sqrt(np.maximum(root**2 - place**2, 0.0)))[on_it])
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    size = np.linalg.norm(normal, axis=1)
    facing = normal[:, 2] > 0.0
    normal, corner = normal[facing] / size[facing, None], triangles[facing]
    touch = -radius * normal[:, :2]
    on_it = np.ones(len(corner), dtype=bool)
    for p, q in ((0, 1), (1, 2), (2, 0)):
        edge, to_it = (corner[:, q] - corner[:, p])[:, :2], touch - corner[:, p, :2]
        on_it &= edge[:, 0] * to_it[:, 1] - edge[:, 1] * to_it[:, 0] >= 0.0
    fall = ((touch - corner[:, 0, :2]) * normal[:, :2]).sum(axis=1) / normal[:, 2]
    found.append((corner[:, 0, 2] - fall + radius * normal[:, 2])[on_it])
    return float(np.concatenate(found).max())
