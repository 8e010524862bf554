"""Library of optical constants: `pbrdf.materials.get("water")`."""

from pbrdf.optics.library import get, names
from pbrdf.optics.materials import Material

__all__ = ["Material", "get", "names"]
