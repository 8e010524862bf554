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
from pbrdf.surface import GaussianSurface, HeightMap, MeasuredSurface, Surface

# A height map up to this many nodes is written into the TOML file itself
INLINE_NODES = 4096


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
    return table | {"file": _write_heights(surface.heights, target).name}


def _write_heights(heights: np.ndarray, target: Path) -> Path:
    """Write heights beside a scene, under a name that tells what is in them.

    So no other file is overwritten, and a scene never finds heights that are not its own:
    they are there before the scene's file is, and an earlier scene keeps its own.
    """
    content = io.BytesIO()
    np.save(content, heights)
    digest = hashlib.sha256(content.getbuffer()).hexdigest()[:12]
    file = target.with_name(f"{target.stem}-{digest}.npy")
    if not file.exists():
        with complete_file(file) as stage:
            stage.write_bytes(content.getbuffer())
    return file
