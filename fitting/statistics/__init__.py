"""Statistics of a surface from its profile or map, each with an interval."""

from typing import TYPE_CHECKING

from pbrdf._lazy import loader

if TYPE_CHECKING:
    from fitting.statistics.result import SurfaceStatistics
    from fitting.statistics.surface import surface_statistics

__all__ = ["SurfaceStatistics", "surface_statistics"]

_HOME = {
    "SurfaceStatistics": "fitting.statistics.result",
    "surface_statistics": "fitting.statistics.surface",
}

__getattr__ = loader(__name__, _HOME)
