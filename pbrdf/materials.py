"""Optical constants: of the library, `get("water")`, and of files, `read("paint.csv")`."""

from pbrdf.optics import library
from pbrdf.optics.materials import Material
from pbrdf.optics.published import read

__all__ = ["Material", "get", "names", "read"]

get = library.get
names = library.names
