"""The hemisphere of a scene: plan, trace, estimate and result."""

from typing import TYPE_CHECKING

from pbrdf._lazy import loader

if TYPE_CHECKING:
    from pbrdf.simulation.parts import simulate_parts, simulate_together
    from pbrdf.simulation.run import simulate

__all__ = ["simulate", "simulate_parts", "simulate_together"]

_HOME = {
    "simulate": "pbrdf.simulation.run",
    "simulate_parts": "pbrdf.simulation.parts",
    "simulate_together": "pbrdf.simulation.parts",
}

__getattr__ = loader(__name__, _HOME)
