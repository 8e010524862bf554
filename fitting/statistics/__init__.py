"""Statistics of a surface from its profile or map, each with an interval."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fitting.statistics.result import SurfaceStatistics
    from fitting.statistics.surface import surface_statistics

__all__ = ["SurfaceStatistics", "surface_statistics"]

_HOME = {
    "SurfaceStatistics": "fitting.statistics.result",
    "surface_statistics": "fitting.statistics.surface",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(_HOME[name]), name)
