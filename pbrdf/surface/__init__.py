"""Height maps, random surfaces and what lies on them."""

from pbrdf.surface.bodies import Bodies, PlacedFilm, Placement, place
from pbrdf.surface.drops import Drops
from pbrdf.surface.films import Film
from pbrdf.surface.gaussian import GaussianSurface
from pbrdf.surface.heightmap import HeightMap
from pbrdf.surface.measured import MeasuredSurface
from pbrdf.surface.spheres import Spheres

__all__ = [
    "Bodies",
    "Drops",
    "Film",
    "GaussianSurface",
    "HeightMap",
    "MeasuredSurface",
    "PlacedFilm",
    "Placement",
    "Spheres",
    "place",
]
