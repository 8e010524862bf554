"""The hemisphere of a scene: plan, trace, estimate and result."""

from typing import TYPE_CHECKING

from pbrdf._lazy import loader

if TYPE_CHECKING:
    from pbrdf.simulation.run import simulate

__all__ = ["simulate"]

_HOME = {"simulate": "pbrdf.simulation.run"}

__getattr__ = loader(__name__, _HOME)
