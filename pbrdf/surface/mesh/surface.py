"""A surface of triangles, overhangs included."""

import copy
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from pbrdf.errors import AccuracyWarning, DataFileError
from pbrdf.surface.heightmap import HeightMap
from pbrdf.surface.mesh.arguments import (
    check_extent,
    checked_labels,
    checked_period,
    is_parts,
)
from pbrdf.surface.mesh.crossings import check_crossings
from pbrdf.surface.mesh.mending import (
    checked_arrays,
    mend,
    rounding_note,
    size_note,
    without_flat_faces,
)
from pbrdf.surface.mesh.reading import Raw, micrometres, raw_mesh
from pbrdf.surface.mesh.sides import with_sides
from pbrdf.surface.mesh.solids import transparent_solids
from pbrdf.surface.mesh.topology import face_vectors


@dataclass(frozen=True, eq=False, repr=False, init=False)
class MeshSurface:
    """Triangles that look out of a solid; they may hang over and hide each other.

    Parameters
    ----------
    mesh : trimesh.Trimesh, str, Path or (vertices, faces)
        The triangles, or a file of them: STL, PLY, OBJ, GLB, glTF or OFF. z points up.
        Numbers are micrometres unless `unit` or the units of the Trimesh say otherwise.
    period : (float, float), optional
        Periods lx, ly along x and y; all images of the mesh are there. Without it the mesh
        is alone: closed bodies in the open, or a sheet of which the rim is left out. [um]
    labels : array_like of shape (faces,) or "parts", optional
        Number of the material of each face, or those of the parts of a file in their order:
        objects and materials of OBJ, meshes of GLB, solids of STL, a face property such as
        `label` of PLY.
    unit : {"um", "nm", "mm", "cm", "m", "inch"}, optional
        Unit of the numbers in `mesh`; `period` stays in micrometres.
    transparent : bool or sequence of int
        Labels of closed solids that light goes through, True for all; it is refracted by
        them, weakened in them and comes out again. What enters the others is absorbed, or
        scattered by their diffuse base.

    Attributes
    ----------
    vertices : ndarray, shape (vertices, 3)
        Corners of the faces. [um]
    faces : ndarray, shape (faces, 3)
        Their corners, counter-clockwise as seen from outside.
    kind : {"ground", "bodies", "sheet"}
        Whether the mesh is closed towards below, so that no light passes; or bodies with
        nothing under them; or an open sheet.
    parts : int
        Number of parts that hang together.
    intersecting : bool
        Whether facets may cut through each other: there are several parts, or one cuts
        through itself or its images.
    transparent : tuple of int
        Labels of the solids that light goes through.
    solids : ndarray of int, shape (faces,), or None
        Number, from 1 on, of the solid that light goes through and each face bounds; 0
        where a face is opaque, None where all are.
    solid_labels : tuple of int
        Label of each of these solids.
    repairs : tuple of str
        What was mended, and where a part cuts through itself, with counts and places; each
        is also a warning.

    Raises
    ------
    DataFileError
        If a file is damaged or its mesh is one that this class refuses.
    TypeError, ValueError
        If the mesh has holes, one-sided parts, faces back to back, a wrong period, vertices
        that are not finite; a label is missing; or what shall be transparent is not closed.

    Warns
    -----
    AccuracyWarning
        If faces were left out or turned, or the numbers of a file are coarse where the
        mesh lies.

    Examples
    --------
    >>> pyramid = ([(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0), (2, 2, 1)],
    ...            [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])
    >>> MeshSurface(pyramid, period=(4, 4))
    MeshSurface(4 faces, ground, period=(4.0, 4.0) um)
    """

    vertices: np.ndarray
    faces: np.ndarray
    labels: np.ndarray | None
    period: tuple[float, float] | None
    kind: str
    repairs: tuple[str, ...] = field(repr=False)
    parts: int = field(repr=False)
    intersecting: bool = field(repr=False)
    transparent: tuple[int, ...]
    solids: np.ndarray | None = field(repr=False)
    solid_labels: tuple[int, ...] = field(repr=False)

    def __init__(
        self,
        mesh: Any,
        period: tuple[float, float] | None = None,
        labels: npt.ArrayLike | str | None = None,
        *,
        unit: str | None = None,
        transparent: bool | Sequence[int] = False,
    ) -> None:
        raw = raw_mesh(mesh)
        lengths = None if period is None else checked_period(period)
        try:
            doubts = self._build(
                raw, lengths, labels, micrometres(unit, raw.unit), transparent,
                unit_known=unit is not None or raw.unit is not None,
            )  # fmt: skip
        except DataFileError:
            raise
        except (TypeError, ValueError) as error:
            if not isinstance(mesh, str | Path):
                raise
            problem, _, cure = str(error).rstrip(".").rpartition(". ")
            if not problem:
                problem, cure = cure, "Change that argument"
            raise DataFileError(Path(mesh), problem, f"{cure}.") from error
        for note in (*doubts, *self.repairs):
            warnings.warn(note, AccuracyWarning, stacklevel=2)

    def _build(
        self,
        raw: Raw,
        period: tuple[float, float] | None,
        labels: npt.ArrayLike | str | None,
        unit: float,
        transparent: bool | Sequence[int],
        *,
        unit_known: bool,
    ) -> tuple[str, ...]:
        vertices, faces = checked_arrays(raw.vertices, raw.faces)
        if is_parts(labels):
            labels = raw.parts
            if labels is None:
                msg = (
                    'labels must be numbers, got "parts" of a file that numbers polygons. '
                    "Cut them into triangles."
                )
                raise ValueError(msg)
        elif labels is None:
            labels = raw.labels
        numbers = checked_labels(labels, len(faces))
        sided = with_sides(mend(vertices * unit, faces, numbers), period)
        done = without_flat_faces(sided.mesh)
        if period is not None:
            check_extent(done.vertices, period)
        clear = transparent_solids(transparent, sided, period)
        kept = np.isin(sided.mesh.source, done.source)
        solids = clear.number[kept] if clear.labels else None
        cut = check_crossings(done, sided.body[kept], solids, period)
        table = done.faces.astype(np.int32)
        for array in (done.vertices, table, done.labels, solids):
            if array is not None:
                array.setflags(write=False)
        for name, value in (
            ("vertices", done.vertices), ("faces", table), ("labels", done.labels),
            ("period", period), ("kind", sided.kind),
            ("repairs", (*done.notes, *cut.notes)), ("parts", len(sided.closed)),
            ("solids", solids), ("intersecting", len(sided.closed) > 1 or cut.found),
            ("solid_labels", clear.labels), ("transparent", tuple(sorted({*clear.labels}))),
        ):  # fmt: skip
            object.__setattr__(self, name, value)
        return rounding_note(vertices, faces) + size_note(done.vertices, known=unit_known)

    def __repr__(self) -> str:
        lies = "alone" if self.period is None else f"period={self.period} um"
        clear = ", light goes through" if self.transparent else ""
        return f"MeshSurface({len(self.faces)} faces, {self.kind}, {lies}{clear})"

    @classmethod
    def of_map(cls, surface: HeightMap) -> "MeshSurface":
        """Triangles of a height map, the same facets."""
        if surface.missing > 0.0:
            msg = (
                f"heights must be complete, got {100 * surface.missing:.2g} % missing. "
                "Fill the holes with HeightMap.filled()."
            )
            raise ValueError(msg)
        nx, ny = (k + 1 for k in surface.cells)
        dx, dy = surface.spacing
        i, j = np.arange(nx), np.arange(ny)
        heights = surface.heights[np.ix_(i % surface.shape[0], j % surface.shape[1])]
        x, y = np.meshgrid(i * dx, j * dy, indexing="ij")
        number = np.arange(nx * ny).reshape(nx, ny)
        z00, z10 = number[:-1, :-1], number[1:, :-1]
        z01, z11 = number[:-1, 1:], number[1:, 1:]
        low = np.stack([z00, z10, z11], axis=-1)
        high = np.stack([z00, z11, z01], axis=-1)
        labels = None if surface.labels is None else np.repeat(surface.labels.ravel(), 2)
        return cls(
            (
                np.stack([x, y, heights], axis=-1).reshape(-1, 3),
                np.stack([low, high], axis=2).reshape(-1, 3),
            ),
            surface.size if surface.periodic else None,
            labels,
        )

    @cached_property
    def bounds(self) -> np.ndarray:
        """Lowest and highest x, y and z of the mesh, shape (2, 3). [um]"""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    @cached_property
    def normals(self) -> np.ndarray:
        """Unit normals of the faces, out of the solid, shape (faces, 3). [1]"""
        vectors = face_vectors(self.vertices, self.faces)
        unit: np.ndarray = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
        return unit

    @cached_property
    def areas(self) -> np.ndarray:
        """Areas of the faces, shape (faces,). [um²]"""
        areas: np.ndarray = 0.5 * np.linalg.norm(
            face_vectors(self.vertices, self.faces), axis=1
        )
        return areas

    @property
    def periodic(self) -> bool:
        """Whether the mesh repeats."""
        return self.period is not None

    def moved(self, shift: npt.ArrayLike) -> "MeshSurface":
        """Return the same mesh, moved along x and y. [um]"""
        other = copy.copy(self)
        other.__dict__.pop("bounds", None)
        vertices = self.vertices + np.append(np.asarray(shift, dtype=float), 0.0)
        vertices.setflags(write=False)
        object.__setattr__(other, "vertices", vertices)
        return other

    @property
    def size(self) -> tuple[float, float]:
        """Period, or lateral lengths of the mesh, along x and y. [um]"""
        if self.period is not None:
            return self.period
        low, high = self.bounds
        return float(high[0] - low[0]), float(high[1] - low[1])

    def to_trimesh(self) -> Any:
        """Trimesh of the same faces, for viewing, printing and all else it can do."""
        import trimesh

        return trimesh.Trimesh(
            np.array(self.vertices), np.array(self.faces), process=False, units="um"
        )
