"""Fresnel optics, Mueller algebra and optical constants."""

from pbrdf.optics.dispersion import Dispersion, Polynomial, Sellmeier, Table
from pbrdf.optics.exchange import CONVENTIONS, Convention, convert_brdf
from pbrdf.optics.fresnel import fresnel_amplitudes, specular_mueller, transmission_mueller
from pbrdf.optics.materials import Material
from pbrdf.optics.mueller import (
    aolp,
    coherency_eigenvalues,
    depol_index,
    docp,
    dolp,
    is_physical,
)
from pbrdf.optics.published import read as read_material

__all__ = [
    "CONVENTIONS",
    "Convention",
    "Dispersion",
    "Material",
    "Polynomial",
    "Sellmeier",
    "Table",
    "aolp",
    "coherency_eigenvalues",
    "convert_brdf",
    "depol_index",
    "docp",
    "dolp",
    "fresnel_amplitudes",
    "is_physical",
    "read_material",
    "specular_mueller",
    "transmission_mueller",
]
