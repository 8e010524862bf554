"""Height maps, random surfaces and meshes."""

from pbrdf.surface.gaussian import GaussianSurface
from pbrdf.surface.heightmap import HeightMap
from pbrdf.surface.measured import MeasuredSurface
from pbrdf.surface.mesh import MeshSurface

__all__ = [
    "FixedSurface",
    "GaussianSurface",
    "HeightMap",
    "MeasuredSurface",
    "MeshSurface",
    "Surface",
]

# One surface, and not an ensemble of which realisations are drawn
FixedSurface = HeightMap | MeshSurface
# What a scene may stand on
Surface = FixedSurface | GaussianSurface | MeasuredSurface
