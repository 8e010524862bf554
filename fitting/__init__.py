"""Surface statistics, image edges, parameters, objective, solvers and results."""

from fitting.estimate import Estimate
from fitting.statistics import surface_statistics
from fitting.statistics_result import SurfaceStatistics

__all__ = ["Estimate", "SurfaceStatistics", "surface_statistics"]
