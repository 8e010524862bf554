"""What lies on a surface: drops, spheres and films."""

from pbrdf.contaminants.bodies import Bodies, PlacedFilm, Placement, place
from pbrdf.contaminants.drops import Drops
from pbrdf.contaminants.films import Film
from pbrdf.contaminants.spheres import Spheres

__all__ = ["Bodies", "Drops", "Film", "PlacedFilm", "Placement", "Spheres", "place"]
