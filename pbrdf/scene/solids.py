"""A scene as triangle meshes, for viewing, printing or another tracer."""

from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.contaminants.bodies import place
from pbrdf.contaminants.shapes import Shape
from pbrdf.errors import require
from pbrdf.scene.scene import Scene
from pbrdf.surface import FixedSurface, HeightMap, MeshSurface
from pbrdf.surface.mesh.morphologies import turned_body

# Rings of a body of revolution for each facet around it
RINGS = 0.5
# Formats of one file, with nothing beside it
WRITTEN = (".glb", ".stl", ".ply", ".off")


def scene_solids(
    scene: Scene, *, seed: int = 0, base: float | None = None, sections: int = 48
) -> dict[str, Any]:
    """Meshes of a scene by name: its surface and what lies on it.

    Parameters
    ----------
    scene : Scene
        Of a random scene one realisation is made.
    seed : int
        Of the realisation.
    base : float, optional
        Thickness of a block below the lowest point of a height map, closed all around, as
        for printing; without it the surface is a sheet. [um]
    sections : int
        Facets around drops and spheres.

    Returns
    -------
    dict of trimesh.Trimesh
        "surface"; "body 0", "body 1", ..., closed, with the part of them that is in the
        surface; "film", a sheet. Lengths are micrometres.
    """
    import trimesh

    def made(points: np.ndarray, faces: np.ndarray) -> Any:
        return trimesh.Trimesh(points, faces, process=False)

    heights, drops = np.random.SeedSequence(seed).spawn(2)
    surface = scene.surface
    if not isinstance(surface, FixedSurface):
        surface = surface.sample(heights)
    if isinstance(surface, MeshSurface) and base is not None:
        msg = f"base must be left out for a mesh, got {base}. It is what it is."
        raise ValueError(msg)
    sheet = surface if isinstance(surface, MeshSurface) else MeshSurface.of_map(surface)
    solids = {"surface": made(np.array(sheet.vertices), np.array(sheet.faces))}
    if base is not None and isinstance(surface, HeightMap):
        thick = float(require("base", base, lambda v: v > 0, "be positive [um]", "Um."))
        solids["surface"] = made(*_block(sheet, surface, thick))
    if not scene.contaminants:
        return solids
    listed: Any = scene.contaminants
    placement = place(listed, surface, drops)
    bodies = placement.bodies
    for k in range(len(bodies)):
        points, faces = _body(bodies.shape(k), sections)
        move = np.array([bodies.x[k], bodies.y[k], bodies.z[k]])
        solids[f"body {k}"] = made(points + move, faces)
    if placement.film is not None:
        level, value, _ = placement.film
        points = np.array(sheet.vertices)
        points[:, 2] = np.maximum(points[:, 2], value) if level else points[:, 2] + value
        solids["film"] = made(points, np.array(sheet.faces))
    return solids


def export_scene(
    scene: Scene, path: str | Path, *, seed: int = 0, base: float | None = None,
    sections: int = 48,
) -> None:  # fmt: skip
    """Write a scene as a mesh file: GLB keeps its parts apart, by name.

    Arguments as of `scene_solids`. Numbers are micrometres in every format.

    Raises
    ------
    ValueError
        If the suffix is of no mesh format.
    """
    import trimesh

    target = Path(path)
    if target.suffix.lower() not in WRITTEN:
        msg = (
            f"path must end in one of {', '.join(WRITTEN)}, got {target.name!r}. "
            "Choose GLB for viewing, STL for printing."
        )
        raise ValueError(msg)
    solids = scene_solids(scene, seed=seed, base=base, sections=sections)
    written = trimesh.Scene(solids) if len(solids) > 1 else solids["surface"]
    written.export(target)


def _body(shape: Shape, sections: int) -> tuple[np.ndarray, np.ndarray]:
    """Body of revolution with a point at each end, its rings even along the profile."""
    slabs = shape.slabs
    low, high = shape.bottom, shape.height
    # Rings crowd where the profile turns to the axis
    rings = max(int(RINGS * sections), 4)
    turn = np.linspace(0.0, np.pi, rings + 1)[1:-1]
    z = 0.5 * (low + high) - 0.5 * (high - low) * np.cos(turn)
    slab = np.clip(np.searchsorted(slabs[:, 1], z), 0, len(slabs) - 1)
    a, b, c = slabs[slab, 2:].T
    r = np.sqrt(np.maximum(a + b * z + c * z * z, 0.0))
    points, faces = turned_body(r, z, sections)
    # The ends close in a point, the bottom of a body that is cut flat in its middle
    points[-1, 2] = high
    points[-2, 2] = low
    return points, faces


def _block(
    sheet: MeshSurface, surface: HeightMap, thick: float
) -> tuple[np.ndarray, np.ndarray]:
    """Heights on a block with walls and a flat bottom."""
    nx, ny = (k + 1 for k in surface.cells)
    top = np.array(sheet.vertices)
    number = np.arange(nx * ny).reshape(nx, ny)
    rim = np.concatenate(
        [number[:-1, 0], number[-1, :-1], number[:0:-1, -1], number[0, :0:-1]]
    )
    below = top[rim].copy()
    below[:, 2] = top[:, 2].min() - thick
    middle = below.mean(axis=0)
    first = len(top)
    a = np.arange(len(rim))
    b = np.roll(a, -1)
    centre = np.full(len(rim), first + len(rim))
    faces = [
        np.asarray(sheet.faces),
        np.stack([rim[b], rim[a], first + a], axis=1),
        np.stack([rim[b], first + a, first + b], axis=1),
        np.stack([first + b, first + a, centre], axis=1),
    ]
    return np.concatenate([top, below, middle[None]]), np.concatenate(faces)
