"""Points of a store that failed, the beam of waves, and a store before a sensor."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import zarr
from numpy.testing import assert_allclose

import pbrdf
from pbrdf.cli import main
from pbrdf.errors import AccuracyWarning
from pbrdf.signatures import ClearSky, RayleighSky, Sun
from pbrdf.sweeps import load_sweep, run_sweep
from tests.stored.conftest import SCENE

pytestmark = pytest.mark.filterwarnings("ignore:.*realization:pbrdf.AccuracyWarning")


def test_errors_between_nodes_do_not_ask_for_points_that_count_for_nothing(
    store: Path, tmp_path: Path
) -> None:
    """One end of an axis failed; at its other end values and errors are as before."""
    shutil.copytree(store, tmp_path / "s.zarr")
    whole = pbrdf.from_store(store)
    # Along n the last of three, at the slopes about the place
    state = zarr.open_group(tmp_path / "s.zarr", mode="r+")["state"]
    state[0, 2], state[1, 2] = 2, 0
    hurt = pbrdf.from_store(tmp_path / "s.zarr")
    at = (0.5, 0.6, np.pi)
    place = {"slope_rms": 0.16, "n": 1.45}
    size = len(whole.interpolation_error.axis)
    assert size == 3
    scheme = str(whole.interpolation_error.scheme.sel(axis="n").item())
    assert scheme.startswith("linear"), scheme
    assert_allclose(hurt.brdf(*at, **place), whole.brdf(*at, **place), rtol=1e-12)
    stated, before = hurt.error(*at, **place), whole.error(*at, **place)
    assert np.isfinite(stated).all()
    # Two nodes are left: what is missed at other slopes stands for what was here
    assert 0.2 < stated[0, 0] / before[0, 0] < 5
    assert_allclose(
        hurt.at(0.5, **place).brdf_total, whole.at(0.5, **place).brdf_total, rtol=1e-12
    )
    with pytest.raises(ValueError, match=r"n=1.7, which is"):
        hurt.error(*at, slope_rms=0.16, n=1.6)


WAVES = """
[vary]
n = [1.4, 1.5, 1.7]

[simulate]
theta_i_deg = [10, 40, 55]
wavelength_um = [2.0, 3.0]
wave = "auto"
n_rays = 100
realizations = 8
n_theta = 9
n_dphi = 18
seed = 3
"""


def test_the_beam_of_waves_is_that_of_computed_points(tmp_path: Path) -> None:
    smooth = SCENE.replace("slope_rms = 0.1", "slope_rms = 0.02")
    (tmp_path / "scene.toml").write_text(smooth)
    (tmp_path / "sweep.toml").write_text(f'scene = "scene.toml"\n{WAVES}')
    run_sweep(load_sweep(tmp_path / "sweep.toml"), tmp_path / "s.zarr", workers=1)
    source = pbrdf.from_store(tmp_path / "s.zarr")
    incidences = np.deg2rad([10.0, 40.0, 55.0])
    scene = pbrdf.load_scene(tmp_path / "scene.toml")
    wet = pbrdf.Scene(scene.surface, pbrdf.Material(1.7, 0.05))
    direct = pbrdf.simulate(
        wet, incidences, phi_i="uniform", wavelength=[2.0, 3.0], wave="auto", n_rays=100,
        realizations=8, n_theta=9, n_dphi=18, seed=3,
    )  # fmt: skip
    found = source.at(n=1.7)
    assert (direct.coherent[..., 0, 0] > 0.03).all()
    order = ("theta_i", "wavelength", "stokes_out", "stokes_in")
    assert_allclose(found.coherent, direct.coherent.transpose(*order), rtol=1e-9)
    one = source.coherent(np.round(incidences[1], 7), 3.0, n=1.7)
    assert_allclose(one, found.coherent[1, 1], rtol=1e-12)
    sun = Sun(theta=0.6, optical_depth=0.1)
    seen, wanted = (
        pbrdf.signature(held, incidences[1], wavelength=3.0, sun=sun, temperature=None,
                        sky=RayleighSky(sun=sun, optical_depth=0.1))
        for held in (found, direct)
    )  # fmt: skip
    assert_allclose(seen.radiance, wanted.radiance, rtol=1e-9, atol=1e-12)
    # Between them it is missing, which is told
    with pytest.raises(ValueError, match=r"is not interpolated along n\. Take one"):
        source.coherent(incidences, 2.0, n=1.45)
    with pytest.warns(AccuracyWarning, match="beam of waves is left out"):
        between = source.at(n=1.45)
    with pytest.raises(ValueError, match="must hold its specular beam"):
        pbrdf.signature(between, incidences[1], wavelength=3.0, sun=sun)
    with pytest.raises(ValueError, match="wavelength must"):
        source.at(wavelength=9.0, n=1.5)


def test_rays_have_no_beam(store: Path) -> None:
    source = pbrdf.from_store(store)
    assert not source.coherent([0.3, 0.4], slope_rms=0.16, n=1.45).any()
    with pytest.raises(ValueError, match="the store must have the axis 'wavelength'"):
        source.at(wavelength=0.55, slope_rms=0.16, n=1.5)


def test_a_store_on_the_command_line_of_a_sensor(
    store: Path, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    """Interpolated at --at and, by reciprocity, at the zeniths of the sensor."""
    out = tmp_path / "seen.csv"
    light = ["--sun-zenith-deg", "40", "--sky", "clear", "--optical-depth", "0.2"]
    at = ["--at", "slope_rms=0.2", "--at", "n=1.55"]
    view = ["--view-zenith-deg", "30,50"]
    command = ["radiance", str(store)]
    assert main([*command, *light, *at, *view, "-o", str(out)]) == 0
    sun = Sun(theta=np.deg2rad(40), phi=np.pi, optical_depth=0.2)
    views = np.deg2rad([30, 50])
    surface = pbrdf.from_store(store).at(views, slope_rms=0.2, n=1.55)
    sky = ClearSky(sun=sun, optical_depth=0.2)
    wanted = pbrdf.signature(surface, views, sun=sun, sky=sky).radiance
    table = pd.read_csv(out, comment="#")
    assert_allclose(table[list("IQUV")], wanted, rtol=1e-6, atol=1e-10)
    assert (table.I_stderr > 0).all()
    # A sun alone, and words for what is wrong
    assert main([*command, *light[:2], *at, *view, "-o", str(out), "--force"]) == 0
    capsys.readouterr()
    for more, words in (
        ([*light, *at], "--view-zenith-deg must lie within the incidences of the store"),
        ([*light, *at[:2], *view], "n must be given"),
        ([*light, *at, *view, "--at", "wavelength_um=1"], "--at must leave the wavelength"),
    ):
        extra = [] if "--view-zenith-deg" in more else ["--view-zenith-deg", "80"]
        assert main([*command, *more, *extra, "-o", str(out), "--force"]) == 2
        assert words in capsys.readouterr().err
