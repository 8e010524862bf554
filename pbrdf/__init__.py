"""Polarised reflectance (4 x 4 Mueller BRDF) of real rough surfaces.

Public names load on first use: importing the package does no work.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pbrdf import materials
    from pbrdf.analytic import MicrofacetModel
    from pbrdf.errors import AccuracyWarning, DataFileError
    from pbrdf.observation import observe
    from pbrdf.optics.materials import Material
    from pbrdf.scene import Scene
    from pbrdf.scene_file import load_scene
    from pbrdf.simulation import simulate
    from pbrdf.surface import (
        Drops,
        Film,
        GaussianSurface,
        HeightMap,
        MeasuredSurface,
        Spheres,
    )

__version__ = "0.1.0"

__all__ = [
    "AccuracyWarning",
    "DataFileError",
    "Drops",
    "Film",
    "GaussianSurface",
    "HeightMap",
    "Material",
    "MeasuredSurface",
    "MicrofacetModel",
    "Scene",
    "Spheres",
    "load_scene",
    "materials",
    "observe",
    "simulate",
]

_HOME = {
    "AccuracyWarning": "pbrdf.errors",
    "DataFileError": "pbrdf.errors",
    "Drops": "pbrdf.surface",
    "Film": "pbrdf.surface",
    "GaussianSurface": "pbrdf.surface",
    "HeightMap": "pbrdf.surface",
    "Material": "pbrdf.optics.materials",
    "MeasuredSurface": "pbrdf.surface",
    "MicrofacetModel": "pbrdf.analytic",
    "Scene": "pbrdf.scene",
    "Spheres": "pbrdf.surface",
    "load_scene": "pbrdf.scene_file",
    "observe": "pbrdf.observation",
    "simulate": "pbrdf.simulation",
}


def __getattr__(name: str) -> Any:
    if name == "materials":
        return import_module("pbrdf.materials")
    if name not in _HOME:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
