"""Height maps and random surfaces."""

from pbrdf.surface.gaussian import GaussianSurface
from pbrdf.surface.heightmap import HeightMap
from pbrdf.surface.measured import MeasuredSurface

__all__ = ["GaussianSurface", "HeightMap", "MeasuredSurface", "Surface"]

# What a scene may stand on
Surface = HeightMap | GaussianSurface | MeasuredSurface
