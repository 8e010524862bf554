"""Library of optical constants: `pbrdf.materials.get("water")`."""

from pbrdf.optics import library
from pbrdf.optics.materials import Material

__all__ = ["Material", "get", "names"]

get = library.get
names = library.names
