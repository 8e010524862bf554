"""The slopes of a map beside a Gaussian: the scan of either surface tells them apart."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import data_io
from fitting.pipeline import PipelineResult, run_pipeline
from fitting.prediction.beside_gaussian import (
    ENSEMBLE,
    GAUSSIAN,
    MEASURED,
    OVER_MAP,
    REDRAWN,
)
from fitting.prediction.random_phases import redrawn
from fitting.report.write import write_report
from pbrdf import GaussianSurface, HeightMap, Material, Scene, simulate

GLASS = Material(1.5)
THETA_I = np.deg2rad([10.0, 40.0])


def gaussian_map() -> HeightMap:
    surface = GaussianSurface(
        shape=(384, 384), spacing=1.0, corr_length=10.0, slope_rms=0.3
    )
    return surface.sample(seed=3)


def terrain() -> HeightMap:
    """Smooth plains and rugged hills: slopes with a peak and a tail."""
    broad = GaussianSurface(
        shape=(384, 384), spacing=1.0, corr_length=60.0, height_rms=1.0
    ).sample(seed=5)
    return HeightMap(
        gaussian_map().heights * np.exp(np.minimum(broad.heights, 2.0) - 0.7), 1.0,
        periodic=True,
    )  # fmt: skip


def scan_of(surface: HeightMap) -> xr.Dataset:
    """M00 over the map, half of it and a base of 0.02, by a Monte Carlo of its own."""
    run = simulate(
        Scene(surface, GLASS), THETA_I, phi_i="uniform", n_rays=300_000, n_theta=30,
        n_dphi=36, stokes="unpolarized", seed=11, variance_reduction=False,
    )  # fmt: skip
    m00 = 0.5 * run.brdf_total.values[..., 0, 0] + 0.02 / np.pi
    axes = (THETA_I, run.theta_s.values[:24], run.dphi.values[::6])
    theta_i, theta_s, dphi = (a.ravel() for a in np.meshgrid(*axes, indexing="ij"))
    coords = {"theta_i": theta_i, "theta_s": theta_s, "dphi": dphi}
    coords["wavelength"] = np.full(theta_i.size, 0.65)
    return xr.Dataset(
        {"M00": ("geometry", m00[:, :24, ::6].ravel())},
        coords={name: ("geometry", values) for name, values in coords.items()},
    )


def piped(surface: HeightMap) -> PipelineResult:
    return run_pipeline(
        surface, scan_of(surface), material=GLASS, n_rays=50_000, realizations=16, seed=2
    )


@pytest.fixture(scope="module")
def rugged() -> PipelineResult:
    return piped(terrain())


def test_own_slopes_describe_their_scan(rugged: PipelineResult) -> None:
    own = rugged.measured_slopes
    assert own is not None
    off = {name: one.gain_free for name, one in own.misfits.items()}
    assert off[MEASURED] < 0.1
    assert off[OVER_MAP] < 0.1
    assert min(off[GAUSSIAN], off[ENSEMBLE]) > 2 * max(off[MEASURED], off[OVER_MAP])
    assert own.misfits[MEASURED].gain == pytest.approx(0.5, rel=0.05)
    assert own.misfits[OVER_MAP].gain_base == pytest.approx(0.02, rel=0.15)
    # Random phases scatter the hills over the plains, as a Gaussian does
    for name in (ENSEMBLE, REDRAWN):
        assert np.sqrt(own.apart[name] ** 2 - own.noise[name] ** 2) > 0.3
    assert off[REDRAWN] > 2 * off[OVER_MAP]
    texts = list(own.texts)
    assert texts[0].startswith(MEASURED)
    assert REDRAWN in texts[2]


@pytest.mark.slow
def test_a_gaussian_map_has_the_slopes_of_its_gaussian() -> None:
    own = piped(gaussian_map()).measured_slopes
    assert own is not None
    off = {name: one.gain_free for name, one in own.misfits.items()}
    assert abs(off[GAUSSIAN] - off[MEASURED]) < 0.06
    # The one map is a sample of some 400 hills
    for name in (ENSEMBLE, REDRAWN):
        assert np.sqrt(max(own.apart[name] ** 2 - own.noise[name] ** 2, 0)) < 0.1


@pytest.mark.parametrize("periodic", [True, False])
def test_redrawn_surface_keeps_heights_and_spectrum(periodic: bool) -> None:
    pits = -np.exp(0.25 * gaussian_map().heights[:160, :200])
    surface = HeightMap(pits, (1.0, 0.7), periodic=periodic)
    other = redrawn(surface, seed=4)
    assert other.periodic is periodic
    shares = [0.02, 0.2, 0.5, 0.8, 0.98]
    quantiles = [np.quantile(one.heights, shares) for one in (surface, other)]
    np.testing.assert_allclose(*quantiles, atol=0.12 * pits.std())
    waves = [np.abs(np.fft.rfft2(one.heights)) for one in (surface, other)]
    if periodic:
        np.testing.assert_allclose(waves[1], waves[0], rtol=1e-6, atol=1e-6)
    slopes = [one.slopes()[0] for one in (surface, other)]
    assert np.std(slopes[1]) == pytest.approx(np.std(slopes[0]), rel=0.1)
    assert abs(np.corrcoef(pits.ravel(), other.heights.ravel())[0, 1]) < 0.2


def test_report_and_result_hold_the_slopes(rugged: PipelineResult, tmp_path: Path) -> None:
    write_report(rugged, tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Slopes as measured" in page
    assert ENSEMBLE in page
    found = data_io.read_result(tmp_path / "result.nc")
    told = found.attrs["measured_slopes"]
    assert told["misfit"][MEASURED]["gain"] == pytest.approx(0.5, rel=0.05)
    own = rugged.measured_slopes
    assert own is not None
    step = float(found.slope[1] - found.slope[0])
    assert float(found.slope_density.sel(slope_axis="x").sum()) * step == pytest.approx(1)
    assert bool((found.slope_density_stderr > 0).any())
    assert found.over_map.shape == own.simulation.brdf_total.shape
