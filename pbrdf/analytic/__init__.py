"""The closed-form model: slope distributions, shadowing, the microfacet BRDF."""

from pbrdf.analytic.bounces import second_bounce
from pbrdf.analytic.hemisphere import HemisphericalReflectance, emissivity, reflectance
from pbrdf.analytic.microfacet import MicrofacetModel
from pbrdf.analytic.named import (
    beard_maxwell,
    generalised,
    priest_germer,
    torrance_sparrow,
)
from pbrdf.analytic.slope_table import SlopeTable
from pbrdf.analytic.tables import (
    GRAZING_FORMS,
    SHADOWING,
    SLOPE_DISTRIBUTIONS,
    VOLUME_FORMS,
)

__all__ = [
    "GRAZING_FORMS",
    "SHADOWING",
    "SLOPE_DISTRIBUTIONS",
    "VOLUME_FORMS",
    "HemisphericalReflectance",
    "MicrofacetModel",
    "SlopeTable",
    "beard_maxwell",
    "emissivity",
    "generalised",
    "priest_germer",
    "reflectance",
    "second_bounce",
    "torrance_sparrow",
]
