"""A small scene to sweep over, and what a store of it holds."""

from pathlib import Path

import xarray as xr

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


def opened(path: Path) -> xr.Dataset:
    """All of a store, in memory."""
    with xr.open_zarr(path) as stored:
        return stored.load()
