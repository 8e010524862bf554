"""The hemisphere of a scene: plan, trace, estimate and result."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pbrdf.simulation.run import simulate

__all__ = ["simulate"]

_HOME = {"simulate": "pbrdf.simulation.run"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(_HOME[name]), name)
