"""Wave optics of random surfaces, from polished to as rough as rays can take."""

from pbrdf.wave.maps import map_scattering
from pbrdf.wave.methods import METHODS
from pbrdf.wave.model import WaveModel
from pbrdf.wave.two_scale import TwoScaleModel

__all__ = ["METHODS", "TwoScaleModel", "WaveModel", "map_scattering"]
