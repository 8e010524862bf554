"""Fresnel optics, Mueller algebra and optical constants."""

from pbrdf.optics.dispersion import Dispersion, Polynomial, Sellmeier, Table
from pbrdf.optics.materials import Material

__all__ = ["Dispersion", "Material", "Polynomial", "Sellmeier", "Table"]
