"""Surface statistics, image edges, parameters, objective, solvers and results.

Public names load on first use: importing the package does no work.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fitting.drops.silhouette import ContactAngle, contact_angle
    from fitting.estimate import Estimate
    from fitting.models.simulated import SimulatedModel
    from fitting.models.waves import WaveSurface
    from fitting.objective.parameters import PARAMETERS
    from fitting.pipeline import PipelineResult, run_pipeline
    from fitting.prediction.instrument import Instrument
    from fitting.prediction.prediction import Prediction
    from fitting.prediction.run import predict
    from fitting.readings import masks
    from fitting.readings.aperture import Aperture
    from fitting.readings.noise import Noise
    from fitting.result.fit_result import FitResult
    from fitting.result.likelihood import LikelihoodProfile, profile_likelihood
    from fitting.result.model_comparison import Comparison, FTest, compare, f_test
    from fitting.run import fit
    from fitting.statistics.result import SurfaceStatistics
    from fitting.statistics.slopes import SlopeDistribution, slope_distribution
    from fitting.statistics.surface import surface_statistics

__all__ = [
    "PARAMETERS",
    "Aperture",
    "Comparison",
    "ContactAngle",
    "Estimate",
    "FTest",
    "Finding",
    "FitResult",
    "Instrument",
    "LikelihoodProfile",
    "Noise",
    "PhysicsError",
    "PipelineResult",
    "Prediction",
    "SimulatedModel",
    "SlopeDistribution",
    "SurfaceStatistics",
    "WaveSurface",
    "check_scan",
    "compare",
    "contact_angle",
    "f_test",
    "fit",
    "masks",
    "predict",
    "profile_likelihood",
    "run_pipeline",
    "slope_distribution",
    "surface_statistics",
]

_MODULES = {
    "statistics.slopes": ("SlopeDistribution", "slope_distribution"),
    "readings.aperture": ("Aperture",),
    "drops.silhouette": ("ContactAngle", "contact_angle"),
    "estimate": ("Estimate",),
    "pipeline": ("PipelineResult", "run_pipeline"),
    "prediction.instrument": ("Instrument",),
    "prediction.prediction": ("Prediction",),
    "prediction.run": ("predict",),
    "run": ("fit",),
    "checks.scan": ("check_scan",),
    "checks.finding": ("Finding", "PhysicsError"),
    "result.likelihood": ("LikelihoodProfile", "profile_likelihood"),
    "result.model_comparison": ("Comparison", "FTest", "compare", "f_test"),
    "readings.noise": ("Noise",),
    "objective.parameters": ("PARAMETERS",),
    "result.fit_result": ("FitResult",),
    "models.simulated": ("SimulatedModel",),
    "models.waves": ("WaveSurface",),
    "statistics.surface": ("surface_statistics",),
    "statistics.result": ("SurfaceStatistics",),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name == "masks":
        return import_module("fitting.readings.masks")
    if name not in _HOME:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
