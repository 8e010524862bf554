"""What follows from a result: elements, polarisation, cuts, places between."""

from pbrdf.derived.bins import beside, bin_averages
from pbrdf.derived.elements import NAMES, Element, element, folded, light
from pbrdf.derived.places import choose, interpolate
from pbrdf.derived.plane import in_plane

__all__ = [
    "NAMES",
    "Element",
    "beside",
    "bin_averages",
    "choose",
    "element",
    "folded",
    "in_plane",
    "interpolate",
    "light",
]
