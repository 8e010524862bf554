"""A store of a list or a sample of points as a BRDF, and what cannot be one."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose
from scipy.stats import qmc

import pbrdf
from pbrdf.conventions import STOKES, detector_bins
from pbrdf.stored.contents import Contents
from pbrdf.stored.parameters import Cloud, Parameter
from pbrdf.stored.source import StoredBRDF
from pbrdf.sweeps import load_sweep, run_sweep
from tests.stored.test_stated_error import (
    INCIDENCES,
    N_DPHI,
    N_THETA,
    means_over_bins,
    model,
    stated_over_true,
)

pytestmark = pytest.mark.filterwarnings("ignore:.*realization:pbrdf.AccuracyWarning")
SCENE = """
[surface]
type = "gaussian"
shape = [32, 32]
spacing_um = 1.0
corr_length_um = 5.0
slope_rms = 0.15

[substrate]
n = 1.5
"""
SOBOL = """
scene = "scene.toml"

[design]
kind = "sobol"
points = 16
seed = 3

[vary]
"surface.slope_rms" = { from = 0.12, to = 0.3, scale = "log" }
n = { from = 1.4, to = 1.7 }

[simulate]
theta_i_deg = [20, 30, 40]
phi_i_deg = 0
n_rays = 500
realizations = 16
n_theta = 15
n_dphi = 30
"""


def swept(folder: Path, text: str = SOBOL, scene: str = SCENE) -> Path:
    (folder / "scene.toml").write_text(scene)
    (folder / "sweep.toml").write_text(text)
    run_sweep(load_sweep(folder / "sweep.toml"), folder / "s.zarr", workers=1)
    return folder / "s.zarr"


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return swept(tmp_path_factory.mktemp("sobol"))


def known(noise: float) -> StoredBRDF:
    """32 points of a Sobol sequence of the analytical model."""
    shares = qmc.Sobol(2, rng=1).random(32)
    swept = {"slope_rms": 0.12 * 2.5 ** shares[:, 0], "n": 1.4 + 0.3 * shares[:, 1]}
    value = np.array(
        [
            [means_over_bins(model(s, n), t) for t in INCIDENCES]
            for s, n in zip(*swept.values(), strict=True)
        ]
    )
    stderr = noise * np.broadcast_to(value[..., :1, :1], value.shape)
    value = value + stderr * np.random.default_rng(5).standard_normal(value.shape)
    theta_s, dphi, weight = detector_bins(N_THETA, N_DPHI)
    dims = ("point", "theta_i", "theta_s", "dphi", "stokes_out", "stokes_in")
    dataset = xr.Dataset(
        {
            "brdf_total": (dims, value), "brdf_total_stderr": (dims, stderr),
            "state": ("point", np.ones(32, dtype=int)),
            "projected_solid_angle": (("theta_s", "dphi"), weight),
        },
        {name: ("point", one) for name, one in swept.items()}
        | {
            "theta_i": INCIDENCES, "theta_s": theta_s, "dphi": dphi,
            "stokes_out": list(STOKES), "stokes_in": list(STOKES),
        },
    )  # fmt: skip
    held = {
        name: Parameter(name=name, dim=name, unit="", nodes=nodes, number=True)
        for name, nodes in swept.items()
    }
    cloud = Cloud.of(dataset.state, list(held.values()), [{"scale": "linear"}] * 2)
    path = Path("known.zarr")
    return StoredBRDF(Contents(path=path, dataset=dataset, parameters=held, cloud=cloud))


@pytest.mark.parametrize("noise", [pytest.param(0.0, marks=pytest.mark.slow), 0.02])
def test_the_stated_error_is_the_true_one_within_a_factor(noise: float) -> None:
    for name, ratio in stated_over_true(known(noise), places=6).items():
        assert 0.8 < np.median(ratio) < 3.0, (name, ratio)
        assert ratio.min() > 0.4, (name, ratio)
        assert ratio.max() < 8.0, (name, ratio)


def test_at_its_points_it_returns_what_was_computed(store: Path) -> None:
    source = pbrdf.from_store(store)
    assert list(source.ranges) == ["theta_i", "n", "slope_rms"]
    with xr.open_zarr(store) as held:
        point = held.isel(point=5, theta_i=2).load()
    theta_s, dphi = np.meshgrid(point.theta_s, point.dphi, indexing="ij")
    there = {name: float(point[name]) for name in ("slope_rms", "n")}
    found = source.brdf(np.deg2rad(40.0), theta_s, dphi, **there)
    peak = float(point.brdf_total[..., 0, 0].max())
    assert_allclose(found, point.brdf_total, rtol=1e-6, atol=1e-6 * peak)
    here = source.at(np.deg2rad(40.0), **there, interpolated=False)
    assert here.attrs["interpolated_along"] == ""
    moved = source.at(np.deg2rad(40.0), **there | {"n": 1.55}, interpolated=False)
    assert set(moved.attrs["interpolated_along"].split(", ")) == {"n", "slope_rms"}


def test_between_its_points_the_error_holds_a_simulation(store: Path) -> None:
    source = pbrdf.from_store(store)
    scene = pbrdf.Scene(
        pbrdf.GaussianSurface(shape=(32, 32), spacing=1.0, corr_length=5.0, slope_rms=0.2),
        pbrdf.Material(1.52),
    )
    truth = pbrdf.simulate(
        scene, [np.deg2rad(40.0)], n_rays=2000, realizations=32, n_theta=15, n_dphi=30,
        seed=9,
    ).isel(theta_i=0)  # fmt: skip
    result = source.at(np.deg2rad(40.0), slope_rms=0.2, n=1.52).isel(theta_i=0)
    m00 = truth.brdf_total[..., 0, 0]
    lit = m00 > 0.1 * m00.max()
    error = np.hypot(result.brdf_total_stderr, truth.brdf_total_stderr)[..., 0, 0]
    apart = abs(result.brdf_total[..., 0, 0] - m00)
    assert float((apart <= 2 * error).where(lit).sum() / lit.sum()) > 0.9
    assert float((error / m00).where(lit).median()) < 0.15
    assert source.interpolation_error.axis.values.tolist() == ["theta_i", "n, slope_rms"]


@pytest.mark.parametrize(
    ("vary", "message"),
    [
        ('slope_rms = [0.1, 0.2]\nmaterial = ["bk7", "pvc"]', "numbers .* got material"),
        ("slope_rms = [0.1, 0.2]\ntheta_i_deg = [10, 20]", "got theta_i_deg. Give a list"),
        ("slope_rms = [0.1, 0.2]\nseed = [1, 2]", "numbers .* got seed"),
        ("slope_rms = [0.1, 0.2]\nn = [1.4, 1.5]", "6 finished points or more .* got 2"),
        (
            f"slope_rms = {np.linspace(0.1, 0.3, 6).tolist()}\n"
            f"n = {np.linspace(1.4, 1.6, 6).tolist()}",
            "must not lie in a plane, as those over n, slope_rms do",
        ),
    ],
)
def test_points_that_cannot_be_interpolated_are_refused(
    tmp_path: Path, vary: str, message: str
) -> None:
    _, run = SOBOL.split("[simulate]")
    text = f'scene = "scene.toml"\n[design]\nkind = "list"\n[vary]\n{vary}\n[simulate]{run}'
    text = text.replace("n_rays = 500", "n_rays = 50\nwavelength_um = 0.5")
    text = text.replace("theta_i_deg = [20, 30, 40]\n", "") if "theta_i" in vary else text
    scene = SCENE.replace("n = 1.5", 'material = "bk7"') if "material" in vary else SCENE
    with pytest.raises(ValueError, match=message):
        pbrdf.from_store(swept(tmp_path, text, scene))


def test_points_that_failed_are_left_out(store: Path, tmp_path: Path) -> None:
    import zarr

    shutil.copytree(store, tmp_path / "s.zarr")
    zarr.open_array(tmp_path / "s.zarr" / "state", mode="r+")[2] = 2
    with xr.open_zarr(store) as held:
        there = [
            {name: float(held[name][k]) for name in ("slope_rms", "n")} for k in (2, 5)
        ]
    whole, part = pbrdf.from_store(store), pbrdf.from_store(tmp_path / "s.zarr")
    at = (np.deg2rad(40.0), 0.7, 3.0)
    assert_allclose(part.brdf(*at, **there[1]), whole.brdf(*at, **there[1]), rtol=1e-6)
    left, kept = part.brdf(*at, **there[0])[0, 0], whole.brdf(*at, **there[0])[0, 0]
    assert 0.0 < abs(left - kept) < part.error(*at, **there[0])[0, 0] * 2
