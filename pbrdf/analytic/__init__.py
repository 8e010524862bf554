"""The closed-form model: slope distributions, shadowing, the microfacet BRDF."""

from pbrdf.analytic.microfacet import MicrofacetModel
from pbrdf.analytic.tables import SHADOWING, SLOPE_DISTRIBUTIONS

__all__ = ["SHADOWING", "SLOPE_DISTRIBUTIONS", "MicrofacetModel"]
