"""Polarised reflectance (4 x 4 Mueller BRDF) of real rough surfaces."""

__version__ = "0.1.0"

from pbrdf import materials
from pbrdf.analytic import MicrofacetModel
from pbrdf.errors import AccuracyWarning, DataFileError
from pbrdf.optics.materials import Material
from pbrdf.scene import Scene, load_scene
from pbrdf.simulate import simulate
from pbrdf.surface import GaussianSurface, HeightMap

__all__ = [
    "AccuracyWarning",
    "DataFileError",
    "GaussianSurface",
    "HeightMap",
    "Material",
    "MicrofacetModel",
    "Scene",
    "load_scene",
    "materials",
    "simulate",
]
