"""What a scene over a mesh may not hold, each with what to do instead."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pbrdf.contaminants import Drops, Film, Spheres
from pbrdf.optics.materials import Material
from pbrdf.surface import MeshSurface

__all__ = ["check_clear", "check_on_mesh"]


def check_clear(surface: MeshSurface, materials: tuple[Material, ...]) -> None:
    """Refuse transparent solids of what no light goes through."""
    for label in surface.transparent:
        material = materials[label]
        n = np.asarray(material.n if not callable(material.n) else 1.0, dtype=float)
        if material.absorbs_all or material.has_base or np.isinf(n).any():
            msg = (
                f"substrate must be a material that light goes through for label {label}, "
                f"which the mesh has as transparent, got {material.summary()}. Leave the "
                "label out of transparent, or give n and kappa alone."
            )
            raise ValueError(msg)


def check_on_mesh(surface: MeshSurface, contaminants: Sequence[Any]) -> None:
    """Refuse contaminants that a mesh does not take, each with what to do instead.

    Raises
    ------
    ValueError
        If there is one.
    """
    if contaminants and surface.kind == "bodies" and not surface.periodic:
        msg = (
            f"contaminants must be left out on bodies that stand alone, got "
            f"{len(contaminants)}. Give the mesh a period or a sheet under the bodies, or "
            "join what lies on them to the mesh as solids of their own label."
        )
        raise ValueError(msg)
    for one in contaminants:
        problem = _refusal(surface, one)
        if problem is not None:
            what, cure = problem
            name = type(one).__name__
            msg = f"contaminants on a MeshSurface must not hold {what}, got {name}. {cure}"
            raise ValueError(msg)


def _refusal(surface: MeshSurface, contaminant: Any) -> tuple[str, str] | None:
    """Say what of a contaminant a mesh does not take, and what to do."""
    if isinstance(contaminant, Film):
        return (
            "films",
            "Lay it on a HeightMap, or join it to the mesh as a closed layer whose label "
            "is transparent.",
        )
    if isinstance(contaminant, Drops) and contaminant.positions is None:
        return (
            "drops at random places",
            "Lay them at given places with Drops.at, or on a HeightMap.",
        )
    if isinstance(contaminant, Drops) and contaminant.roughness == "wenzel":
        return (
            'drops with roughness="wenzel"',
            "Give the contact angle at the place where each lies; "
            "pbrdf.contaminants.wetting has Wenzel's law.",
        )
    thrown = isinstance(contaminant, Spheres) and contaminant.positions is None
    if thrown and surface.kind != "ground":
        return (
            f"spheres at random places where the mesh is no closed ground but "
            f"{surface.kind}",
            "Lay them at given places with Spheres.at.",
        )
    return None
