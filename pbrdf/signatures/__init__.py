"""What a sensor sees: Stokes radiance of a surface under sun, sky and its own warmth."""

from pbrdf.signatures.bands import in_band, read_response
from pbrdf.signatures.comparison import contrast
from pbrdf.signatures.image import image_axes
from pbrdf.signatures.planck import black_body
from pbrdf.signatures.rayleigh import ClearSky, RayleighSky, rayleigh_optical_depth
from pbrdf.signatures.run import signature
from pbrdf.signatures.skies import OvercastSky, SkyTable, ThermalSky, read_sky
from pbrdf.signatures.smooth import SmoothSurface
from pbrdf.signatures.sun import Sun
from pbrdf.signatures.sun_place import sun_distance, sun_position

__all__ = [
    "ClearSky",
    "OvercastSky",
    "RayleighSky",
    "SkyTable",
    "SmoothSurface",
    "Sun",
    "ThermalSky",
    "black_body",
    "contrast",
    "image_axes",
    "in_band",
    "rayleigh_optical_depth",
    "read_response",
    "read_sky",
    "signature",
    "sun_distance",
    "sun_position",
]
