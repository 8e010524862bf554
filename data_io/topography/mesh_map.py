"""Meshes of measured surfaces (STL, PLY, OBJ) as height maps; overhangs are counted."""

import warnings
from pathlib import Path

import numpy as np

from data_io.topography.plausible import MOST_HEIGHT
from pbrdf.errors import DataFileError
from pbrdf.surface.heightmap import HeightMap
from pbrdf.surface.mesh.reading import read_mesh_file

Array = np.ndarray

MESHES = {".stl", ".ply", ".obj", ".off", ".glb"}
# Pairs of triangles and nodes that are tested at once
_MOST_PAIRS = 4_000_000
_MOST_NODES = 50_000_000


class OverhangWarning(UserWarning):
    """A mesh lies above itself in places; a map holds the top only."""


def read_mesh_map(
    path: Path, size: float, spacing: tuple[float, float] | None
) -> HeightMap:
    """Resample a mesh z(x, y) to a regular grid, its highest point at every node.

    Parameters
    ----------
    path : Path
        A mesh in any format that trimesh reads.
    size : float
        Of its unit. [um]
    spacing : (float, float), optional
        Grid steps; by default those of the vertices if these lie on a grid, else the
        root of the mean area for each vertex. [um]

    Raises
    ------
    DataFileError
        If it is no mesh of triangles, or a closed body.

    Warns
    -----
    OverhangWarning
        If some nodes have several heights; it says how many.
    """
    raw = read_mesh_file(path)
    try:
        corners = np.asarray(raw.vertices, dtype=np.float64)[raw.faces] * size
    except IndexError as error:
        problem = f"a face names a corner beyond the {len(raw.vertices)} there are"
        raise DataFileError(path, problem, "Export STL, PLY or OBJ again.") from error
    farthest = float(np.abs(corners).max())
    if len(corners) < 2 or not farthest < MOST_HEIGHT:
        problem = f"expected a mesh of triangles, got {len(corners)}, up to {farthest:g} um"
        raise DataFileError(path, problem, "Export STL, PLY or OBJ again.")
    points = np.unique(corners.reshape(-1, 3), axis=0)
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    if (high <= low).any():
        problem = "expected a surface over x and y, got a mesh that stands upright"
        raise DataFileError(path, problem, "Turn the mesh so that z is its height.")
    steps = np.array(spacing) if spacing is not None else _steps(points)
    counts = np.floor((high - low) / steps * (1 + 1e-9) + 1e-6).astype(int) + 1
    if np.prod(counts, dtype=float) > _MOST_NODES or min(counts) < 2:
        problem = f"expected a map, the steps {steps} um give {counts} nodes"
        raise DataFileError(path, problem, "Give spacing= in um.")
    top, bottom = _heights(corners - np.append(low, 0.0), steps, counts)
    known = np.isfinite(top)
    tolerance = 1e-6 * float(np.ptp(points[:, 2])) + 1e-12
    several = known & (top - bottom > tolerance)
    if several.any():
        share = several.sum() / max(known.sum(), 1)
        if share > 0.5:
            problem = f"expected a surface, {share:.0%} of its nodes have several heights"
            cure = (
                "Cut the lower side of the body off, or take it as a mesh: "
                "pbrdf.MeshSurface, pbrdf statistics --kind mesh."
            )
            raise DataFileError(path, problem, cure)
        msg = (
            f"{path.name}: the mesh hangs over at {several.sum()} of {known.sum()} nodes "
            f"({share:.2g}); the map holds the top. pbrdf.MeshSurface traces overhangs."
        )
        warnings.warn(msg, OverhangWarning, stacklevel=4)
    return HeightMap(np.where(known, top, np.nan), (float(steps[0]), float(steps[1])))


def _steps(points: Array) -> Array:
    """Return the steps of a grid that all vertices lie on, or their mean distance. [um]"""
    steps = []
    for axis in (0, 1):
        values = np.unique(points[:, axis])
        span = values[-1] - values[0]
        apart = np.diff(values)
        apart = apart[apart > 1e-5 * span]
        step = span / max(round(span / np.median(apart)), 1) if apart.size else span
        off = (values - values[0]) / step
        # Numbers of a mesh file have the digits of float32
        on_grid = np.abs(off - np.rint(off)).max() < 0.01 + 1e-6 * values.size
        steps.append(step if on_grid else 0.0)
    if min(steps) > 0:
        return np.array(steps)
    area = np.prod(np.ptp(points[:, :2], axis=0))
    return np.full(2, np.sqrt(area / len(points)))


def _heights(corners: Array, steps: Array, counts: Array) -> tuple[Array, Array]:
    """Return the highest and the lowest point of the mesh at every node. [um]"""
    top = np.full(counts, -np.inf)
    bottom = np.full(counts, np.inf)
    scaled = corners[:, :, :2] / steps
    first = np.ceil(scaled.min(axis=1) - 1e-6).astype(int)
    last = np.floor(scaled.max(axis=1) + 1e-6).astype(int)
    first, last = np.maximum(first, 0), np.minimum(last, counts - 1)
    sides = np.maximum(last - first + 1, 0)
    pairs = sides.prod(axis=1)
    ends = np.cumsum(pairs)
    begin = 0
    while begin < len(pairs):
        done = ends[begin - 1] if begin else 0
        stop = max(int(np.searchsorted(ends, done + _MOST_PAIRS)), begin + 1)
        part = slice(begin, stop)
        triangle = np.repeat(np.arange(begin, stop), pairs[part])
        place = np.arange(triangle.size) - np.repeat(
            ends[part] - pairs[part] - done, pairs[part]
        )
        i = first[triangle, 0] + place // np.maximum(sides[triangle, 1], 1)
        j = first[triangle, 1] + place % np.maximum(sides[triangle, 1], 1)
        a, b, c = (scaled[triangle, k] for k in range(3))
        x, y = i - c[:, 0], j - c[:, 1]
        area = _cross(a - c, b - c)
        # Triangles that stand upright have no area; nothing lies inside of them
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            u = (x * (b - c)[:, 1] - y * (b - c)[:, 0]) / area
            v = ((a - c)[:, 0] * y - (a - c)[:, 1] * x) / area
            inside = (u > -1e-6) & (v > -1e-6) & (u + v < 1 + 1e-6)
        z = corners[triangle, :, 2]
        with np.errstate(invalid="ignore", over="ignore"):
            height = u * z[:, 0] + v * z[:, 1] + (1 - u - v) * z[:, 2]
        where = (i[inside], j[inside])
        np.maximum.at(top, where, height[inside])
        np.minimum.at(bottom, where, height[inside])
        begin = stop
    return top, bottom


def _cross(p: Array, q: Array) -> Array:
    return p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
