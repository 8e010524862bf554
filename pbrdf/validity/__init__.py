"""Where a result is not to be trusted: one judgement for every surface and every entry.

Warnings and numbers, never corrections.
"""

from pbrdf.validity.contaminants import contamination_warnings, judge_contaminants
from pbrdf.validity.facets import roughness_of_mesh
from pbrdf.validity.light import lost_light_warnings, lost_ray_warnings
from pbrdf.validity.limits import Judgement, judge, resolution_warnings, variables
from pbrdf.validity.roughness import Roughness, gaussian_roughness, roughness_of

__all__ = [
    "Judgement",
    "Roughness",
    "contamination_warnings",
    "gaussian_roughness",
    "judge",
    "judge_contaminants",
    "lost_light_warnings",
    "lost_ray_warnings",
    "resolution_warnings",
    "roughness_of",
    "roughness_of_mesh",
    "variables",
]
