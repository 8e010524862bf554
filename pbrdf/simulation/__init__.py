"""The hemisphere of a scene: plan, trace, estimate and result."""

from typing import TYPE_CHECKING

from pbrdf._lazy import loader

if TYPE_CHECKING:
    from pbrdf.simulation.parts import simulate_parts
    from pbrdf.simulation.run import simulate

__all__ = ["simulate", "simulate_parts"]

_HOME = {
    "simulate": "pbrdf.simulation.run",
    "simulate_parts": "pbrdf.simulation.parts",
}

__getattr__ = loader(__name__, _HOME)
