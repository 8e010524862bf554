"""Height maps and random surfaces."""

from pbrdf.surface.gaussian import GaussianSurface
from pbrdf.surface.heightmap import HeightMap

__all__ = ["GaussianSurface", "HeightMap"]
