"""A store of a rough surface over slope, index and material's name, made once."""

from pathlib import Path

import pytest

from pbrdf.sweeps import load_sweep, run_sweep

SCENE = """
[surface]
type = "gaussian"
shape = [48, 48]
spacing_um = 1.0
corr_length_um = 5.0
slope_rms = 0.1

[substrate]
n = 1.5
kappa = 0.05
"""
SWEEP = """
scene = "scene.toml"

[vary]
"surface.slope_rms" = [0.12, 0.16, 0.22, 0.3]
n = [1.4, 1.5, 1.7]

[simulate]
theta_i_deg = [10, 25, 40, 55]
n_rays = 2000
realizations = 16
n_theta = 30
n_dphi = 60
seed = 3
"""


@pytest.fixture(scope="package")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stored")
    (folder / "scene.toml").write_text(SCENE)
    (folder / "sweep.toml").write_text(SWEEP)
    run_sweep(load_sweep(folder / "sweep.toml"), folder / "s.zarr", workers=1)
    return folder / "s.zarr"
