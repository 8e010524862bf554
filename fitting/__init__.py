"""Surface statistics, image edges, parameters, objective, solvers and results.

Public names load on first use: importing the package does no work.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

# A module of this name would hide a function loaded on first use
from fitting.fit import fit

if TYPE_CHECKING:
    from fitting.aperture import Aperture
    from fitting.drop_silhouette import ContactAngle, contact_angle
    from fitting.estimate import Estimate
    from fitting.likelihood import LikelihoodProfile, profile_likelihood
    from fitting.model_comparison import Comparison, FTest, compare, f_test
    from fitting.noise import Noise
    from fitting.parameters import PARAMETERS
    from fitting.result import FitResult
    from fitting.simulated_model import SimulatedModel
    from fitting.statistics import surface_statistics
    from fitting.statistics_result import SurfaceStatistics

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
    "aperture": ("Aperture",),
    "drop_silhouette": ("ContactAngle", "contact_angle"),
    "estimate": ("Estimate",),
    "likelihood": ("LikelihoodProfile", "profile_likelihood"),
    "model_comparison": ("Comparison", "FTest", "compare", "f_test"),
    "noise": ("Noise",),
    "parameters": ("PARAMETERS",),
    "result": ("FitResult",),
    "simulated_model": ("SimulatedModel",),
    "statistics": ("surface_statistics",),
    "statistics_result": ("SurfaceStatistics",),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
