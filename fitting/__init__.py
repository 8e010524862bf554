"""Surface statistics, image edges, parameters, objective, solvers and results.

Public names load on first use: importing the package does no work.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

# A module of this name would hide a function loaded on first use
from fitting.fit import fit

if TYPE_CHECKING:
    from fitting.drops.silhouette import ContactAngle, contact_angle
    from fitting.estimate import Estimate
    from fitting.models.simulated import SimulatedModel
    from fitting.objective.parameters import PARAMETERS
    from fitting.readings.aperture import Aperture
    from fitting.readings.noise import Noise
    from fitting.result.fit_result import FitResult
    from fitting.result.likelihood import LikelihoodProfile, profile_likelihood
    from fitting.result.model_comparison import Comparison, FTest, compare, f_test
    from fitting.statistics.result import SurfaceStatistics
    from fitting.statistics.surface import surface_statistics

__all__ = [
    "PARAMETERS",
    "Aperture",
    "Comparison",
    "ContactAngle",
    "Estimate",
    "FTest",
    "FitResult",
    "LikelihoodProfile",
    "Noise",
    "SimulatedModel",
    "SurfaceStatistics",
    "compare",
    "contact_angle",
    "f_test",
    "fit",
    "profile_likelihood",
    "surface_statistics",
]

_MODULES = {
    "readings.aperture": ("Aperture",),
    "drops.silhouette": ("ContactAngle", "contact_angle"),
    "estimate": ("Estimate",),
    "result.likelihood": ("LikelihoodProfile", "profile_likelihood"),
    "result.model_comparison": ("Comparison", "FTest", "compare", "f_test"),
    "readings.noise": ("Noise",),
    "objective.parameters": ("PARAMETERS",),
    "result.fit_result": ("FitResult",),
    "models.simulated": ("SimulatedModel",),
    "statistics.surface": ("surface_statistics",),
    "statistics.result": ("SurfaceStatistics",),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
