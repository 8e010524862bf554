"""Polarised reflectance (4 x 4 Mueller BRDF) of real rough surfaces.

Public names load on first use: importing the package does no work.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from pbrdf._version import __version__ as __version__

if TYPE_CHECKING:
    from pbrdf import materials, signatures
    from pbrdf.analytic import MicrofacetModel
    from pbrdf.contaminants import Drops, Film, Spheres
    from pbrdf.dew import compare_dew
    from pbrdf.errors import AccuracyWarning, DataFileError
    from pbrdf.observation.run import observe
    from pbrdf.optics.materials import Material
    from pbrdf.scene.read import load_scene
    from pbrdf.scene.scene import Scene
    from pbrdf.signatures.run import signature
    from pbrdf.simulation.run import simulate
    from pbrdf.stored import from_store
    from pbrdf.surface import GaussianSurface, HeightMap, MeasuredSurface, MeshSurface
    from pbrdf.surface.mesh import morphologies
    from pbrdf.wave import WaveModel

__all__ = [
    "AccuracyWarning",
    "DataFileError",
    "Drops",
    "Film",
    "GaussianSurface",
    "HeightMap",
    "Material",
    "MeasuredSurface",
    "MeshSurface",
    "MicrofacetModel",
    "Scene",
    "Spheres",
    "WaveModel",
    "compare_dew",
    "from_store",
    "load_scene",
    "materials",
    "morphologies",
    "observe",
    "signature",
    "signatures",
    "simulate",
]

_HOME = {
    "AccuracyWarning": "pbrdf.errors",
    "DataFileError": "pbrdf.errors",
    "Drops": "pbrdf.contaminants",
    "Film": "pbrdf.contaminants",
    "GaussianSurface": "pbrdf.surface",
    "HeightMap": "pbrdf.surface",
    "Material": "pbrdf.optics.materials",
    "MeasuredSurface": "pbrdf.surface",
    "MeshSurface": "pbrdf.surface",
    "MicrofacetModel": "pbrdf.analytic",
    "Scene": "pbrdf.scene.scene",
    "Spheres": "pbrdf.contaminants",
    "WaveModel": "pbrdf.wave",
    "compare_dew": "pbrdf.dew",
    "from_store": "pbrdf.stored",
    "load_scene": "pbrdf.scene.read",
    "observe": "pbrdf.observation.run",
    "signature": "pbrdf.signatures.run",
    "simulate": "pbrdf.simulation.run",
}

_MODULES = {
    "materials": "pbrdf.materials",
    "morphologies": "pbrdf.surface.mesh.morphologies",
    "signatures": "pbrdf.signatures",
}


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return import_module(_MODULES[name])
    if name not in _HOME:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
