"""Physical optics of a given map."""

from pbrdf.wave.maps.scattered import map_scattering

__all__ = ["map_scattering"]
