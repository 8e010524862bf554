"""Sweeps: many scenes into one Zarr store; `pbrdf.stored` opens it as a BRDF."""

from typing import TYPE_CHECKING

from pbrdf._lazy import loader

if TYPE_CHECKING:
    from pbrdf.sweeps.description import Sweep, load_sweep, sweep_of
    from pbrdf.sweeps.report import Report
    from pbrdf.sweeps.running import run_sweep

__all__ = ["Report", "Sweep", "load_sweep", "run_sweep", "sweep_of"]

_HOME = {
    "Report": "pbrdf.sweeps.report",
    "Sweep": "pbrdf.sweeps.description",
    "load_sweep": "pbrdf.sweeps.description",
    "run_sweep": "pbrdf.sweeps.running",
    "sweep_of": "pbrdf.sweeps.description",
}

__getattr__ = loader(__name__, _HOME)
