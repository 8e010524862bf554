"""A small scene to sweep over, and what a store of it holds."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import xarray as xr

from pbrdf.sweeps import layout, load_sweep, run_sweep
from pbrdf.sweeps.report import Report

SCENE = """
[surface]
type = "gaussian"
shape = [24, 24]
spacing_um = 1.0
corr_length_um = 5.0
slope_rms = 0.1

[substrate]
n = 1.5
"""
SWEEP = """
scene = "scene.toml"

[vary]
"surface.slope_rms" = [0.05, 0.1, 0.2]
n = [1.4, 1.6]

[simulate]
theta_i_deg = [20, 50]
n_rays = 200
realizations = 8
n_theta = 6
n_dphi = 8
seed = 3
"""


def written(folder: Path, sweep: str = SWEEP, scene: str = SCENE) -> Path:
    """Write scene.toml and sweep.toml; return the latter."""
    (folder / "scene.toml").write_text(scene)
    path = folder / "sweep.toml"
    path.write_text(sweep)
    return path


@contextmanager
def by_points() -> Iterator[None]:
    """Give each point a group of its own, as points of long runs have."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(layout, "_MOST_SECONDS", 0.0)
        patch.setattr(layout, "_JOINT_BYTES", 0.0)
        yield


def serial_run(folder: Path, sweep: str = SWEEP) -> Report:
    """Compute a sweep into s.zarr point by point, without Dask."""
    with by_points():
        return run_sweep(load_sweep(written(folder, sweep)), folder / "s.zarr", workers=1)


def opened(path: Path) -> xr.Dataset:
    """All of a store, in memory."""
    with xr.open_zarr(path) as stored:
        return stored.load()
