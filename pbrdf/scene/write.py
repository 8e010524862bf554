"""Scenes into TOML files."""

import hashlib
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import tomli_w

from pbrdf.files import complete_file
from pbrdf.optics.materials import Material
from pbrdf.scene.contaminant_tables import contaminant_table
from pbrdf.scene.toml_tables import material_table, plain
from pbrdf.surface import GaussianSurface, HeightMap, MeasuredSurface, MeshSurface, Surface

# A height map up to this many nodes is written into the TOML file itself
INLINE_NODES = 4096
# And a mesh up to this many vertices
INLINE_VERTICES = 1024


class Written(Protocol):
    """What a text can be made of: a `Scene`."""

    @property
    def surface(self) -> Surface:
        """Its surface."""

    def to_toml(self) -> str:
        """Its text."""


def scene_text(scene: Written) -> str:
    """TOML of the scene; a large map is described instead of written out."""
    try:
        return scene.to_toml()
    except ValueError:
        surface = scene.surface
        if isinstance(surface, MeshSurface):
            return f"# {surface!r}"
        assert isinstance(surface, HeightMap)
        return f"# {surface!r}, height rms {np.std(surface.heights):.6g} um"


def write_scene(
    surface: Surface,
    substrate: Material | Sequence[Material],
    contaminants: Sequence[Any],
    target: Path | None,
) -> str:
    """Write a scene as TOML text, and to `target` if given; see `Scene.to_toml`."""
    document: dict[str, Any] = {
        "surface": _surface_table(surface, target),
        "substrate": (
            material_table(substrate)
            if isinstance(substrate, Material)
            else {"materials": [material_table(m) for m in substrate]}
        ),
    }
    if contaminants:
        document["contaminants"] = [contaminant_table(one) for one in contaminants]
    text = tomli_w.dumps(document)
    if target is not None:
        with complete_file(target) as stage:
            stage.write_text(text, encoding="utf-8")
    return text


def _surface_table(surface: Surface, target: Path | None) -> dict[str, Any]:
    if isinstance(surface, MeshSurface):
        return _mesh_table(surface, target)
    if isinstance(surface, GaussianSurface):
        table = {
            "type": "gaussian",
            "shape": list(surface.shape),
            "spacing_um": plain(surface.spacing),
            "corr_length_um": plain(surface.corr_length),
        }
        if surface.slope_rms is not None:
            return table | {"slope_rms": surface.slope_rms}
        return table | {"height_rms_um": surface.height_rms}
    if isinstance(surface, MeasuredSurface):
        table = {
            "type": "measured",
            "shape": list(surface.shape),
            "spacing_um": plain(surface.spacing),
            "height_rms_um": surface.height_rms,
            "corr_length_um": plain(surface.corr_length),
            "lags": list(surface.lags),
            "autocorrelation": list(surface.autocorrelation),
        }
        if surface.quantiles is not None:
            table["quantiles"] = list(surface.quantiles)
        return table
    table = {
        "type": "height_map",
        "spacing_um": list(surface.spacing),
        "periodic": surface.periodic,
    }
    if surface.labels is not None:
        table["labels"] = surface.labels.tolist()
    if surface.heights.size <= INLINE_NODES:
        return table | {"heights_um": surface.heights.tolist()}
    if target is None:
        msg = (
            f"path must be given for a map of {surface.heights.size} nodes, got None. "
            "Its heights are written beside the TOML file."
        )
        raise ValueError(msg)
    content = io.BytesIO()
    np.save(content, surface.heights)
    return table | {"file": _write_beside(target, ".npy", content, surface.heights).name}


def _mesh_table(surface: MeshSurface, target: Path | None) -> dict[str, Any]:
    table: dict[str, Any] = {"type": "mesh"}
    if surface.period is not None:
        table["period_um"] = list(surface.period)
    if surface.transparent:
        table["transparent"] = list(surface.transparent)
    labels = surface.labels
    if len(surface.vertices) <= INLINE_VERTICES:
        table |= {
            "vertices_um": surface.vertices.tolist(),
            "faces": surface.faces.tolist(),
        }
        return table if labels is None else table | {"labels": labels.tolist()}
    if target is None:
        msg = (
            f"path must be given for a mesh of {len(surface.faces)} faces, got None. "
            "Its faces are written beside the TOML file."
        )
        raise ValueError(msg)
    arrays = {"vertices": surface.vertices, "faces": surface.faces}
    if labels is not None:
        arrays["labels"] = labels
    # Mesh formats hold float32 only
    content = io.BytesIO()
    np.savez(content, **arrays)  # type: ignore[arg-type]
    return table | {"file": _write_beside(target, ".npz", content, *arrays.values()).name}


def _write_beside(
    target: Path, suffix: str, content: io.BytesIO, *arrays: np.ndarray
) -> Path:
    """Write arrays beside a scene, under a name that tells what is in them.

    So no other file is overwritten, and a scene never finds arrays that are not its own:
    they are there before the scene's file is, and an earlier scene keeps its own.
    """
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(repr((array.dtype.str, array.shape)).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    file = target.with_name(f"{target.stem}-{digest.hexdigest()[:12]}{suffix}")
    if not file.exists():
        with complete_file(file) as stage:
            stage.write_bytes(content.getbuffer())
    return file
