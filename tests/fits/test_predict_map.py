"""Prediction from a map: clean maps follow the Monte Carlo, terraces follow their truth."""

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy import ndimage

import data_io
import fitting
from fitting.prediction.comparison import misfit
from fitting.prediction.density import slope_table
from fitting.prediction.facets import diffraction, facets_of
from fitting.prediction.scan_density import free_density
from pbrdf import (
    GaussianSurface,
    HeightMap,
    Material,
    MicrofacetModel,
    Scene,
    simulate,
)
from pbrdf.cli import main

GLASS = Material(1.5)


def ground(slope: float, *, n: int = 256, spacing: float = 1.0) -> HeightMap:
    surface = GaussianSurface(
        shape=(n, n), spacing=spacing, corr_length=10.0, slope_rms=slope
    )
    return surface.sample(seed=3)


def over_bins(found: fitting.Prediction, run: xr.Dataset, phi_i: float) -> np.ndarray:
    """Mueller BRDF averaged over the bins of a simulation by Gauss's rule."""
    nodes = np.array([-0.774597, 0.0, 0.774597])
    weights = np.array([5, 8, 5]) / 18
    half_theta = np.pi / 4 / run.theta_s.size
    half_phi = np.pi / run.dphi.size
    theta_i = run.theta_i.values[:, None, None]
    return sum(
        w * v * found.brdf(
            theta_i, run.theta_s.values[:, None] + half_theta * x,
            run.dphi.values + half_phi * y, phi_i=phi_i,
        )
        for w, x in zip(weights, nodes, strict=True)
        for v, y in zip(weights, nodes, strict=True)
    )  # fmt: skip


def off_by(surface: HeightMap, phi_i: float | str = "uniform") -> list[float]:
    """Rms of prediction less Monte Carlo over the map, beyond the noise of the latter.

    Of M00, over each M00; and of M10, over the rms M10.
    """
    theta_i = np.deg2rad([10.0, 30.0, 50.0])
    # Bins count that plain rays resolve: dimmer ones show the lumps of single facets
    run = simulate(
        Scene(surface, GLASS), theta_i, phi_i=phi_i, n_rays=100_000, n_theta=15,
        n_dphi=18, stokes="linear", seed=4, variance_reduction=False,
    )  # fmt: skip
    found = fitting.predict(surface, GLASS, wavelength=0.65)
    mean = over_bins(found, run, 0.0 if phi_i == "uniform" else float(phi_i))
    noise = np.sqrt((run.brdf_stderr.values**2).sum(0))
    whole = run.brdf_total.values[..., 0, 0]
    seen = whole > 0.05 * whole.max(axis=(1, 2), keepdims=True)
    seen &= noise[..., 0, 0] < 0.1 * whole
    found_off = []
    for at in ((..., 0, 0), (..., 1, 0)):
        traced = run.brdf_total.values[at]
        size = np.where(seen, whole, 1)
        if at[1:] != (0, 0):
            size = np.full_like(whole, np.sqrt(np.mean(traced[seen] ** 2)))
        off, chance = ((mean[at] - traced) / size)[seen], (noise[at] / size)[seen]
        square = np.mean(off**2) - np.mean(chance**2)
        found_off.append(float(np.sqrt(np.maximum(square, 0))))
    return found_off


@pytest.mark.parametrize(
    "slope",
    [
        pytest.param(0.1, marks=pytest.mark.slow),
        0.3,
        pytest.param(0.5, marks=pytest.mark.slow),
    ],
)
def test_clean_map_has_the_monte_carlo_over_it(slope: float) -> None:
    assert max(off_by(ground(slope))) < 0.08


# A quarter of the facets at 1 um, 256 x 256, are so few that their own lumps make 11 %
@pytest.mark.parametrize(
    ("phi_i", "nodes", "spacing"),
    [(0.0, 384, 0.6), pytest.param(1.0, 512, 1.0, marks=pytest.mark.slow)],
)
def test_each_azimuth_of_a_brushed_map_has_its_own_monte_carlo(
    phi_i: float, nodes: int, spacing: float
) -> None:
    brushed = GaussianSurface(
        shape=(nodes, nodes), spacing=spacing, corr_length=(6.0, 18.0), height_rms=1.2
    ).sample(seed=3)
    assert off_by(brushed, phi_i=phi_i)[0] < 0.08


def test_small_patches_where_rugged_and_large_where_smooth() -> None:
    x = np.arange(400)
    rugged = np.where(x < 200, 0.02, 0.4)[:, None] * np.random.default_rng(1).normal(
        size=(400, 200)
    )
    smooth = ndimage.gaussian_filter(rugged, 3.0)
    facets = facets_of(HeightMap(smooth, 0.3), 0.65)
    blur = np.concatenate([np.full(g.stop - g.start, b[0]) for b, g in facets.groups()])
    sharp, broad = np.quantile(blur, [0.1, 0.9])
    assert broad > 3 * sharp


def test_blur_vanishes_with_the_wavelength() -> None:
    surface = ground(0.2)
    blurs = [facets_of(surface, w).blur for w in (0.2, 0.8, 3.2)]
    assert blurs[0] < 0.025
    # Within a small patch slopes grow as its size: the blur goes as the root
    assert np.allclose(np.divide(blurs[1:], blurs[:-1]), 2.0, rtol=0.15)


def test_diffraction_of_a_patch_by_transform() -> None:
    """The far field of a Gaussian patch, by a sum over the patch."""
    wavelength, patch = 0.65, 1.7
    x = np.linspace(-12, 12, 2001)
    field = np.exp(-(x**2) / (4 * patch**2))
    slope = np.linspace(-0.1, 0.1, 401)
    q_z = 4 * np.pi / wavelength
    power = np.abs(np.exp(1j * q_z * np.outer(slope, x)) @ field) ** 2
    rms = np.sqrt(np.sum(power * slope**2) / np.sum(power))
    assert rms == pytest.approx(diffraction(np.array(patch), wavelength), rel=1e-3)


def test_table_keeps_the_slopes_of_each_axis() -> None:
    i, j = np.mgrid[:192, :192]
    rng = np.random.default_rng(2)
    heights = np.zeros((192, 192))
    for _ in range(60):
        k, m = rng.integers(1, 5), rng.integers(4, 16)
        heights += np.cos(2 * np.pi * (k * i + m * j) / 192 + rng.uniform(0, 7)) / m
    surface = HeightMap(0.3 * heights, 0.9, periodic=True)
    facets = facets_of(surface, 0.5)
    rms = slope_table(facets).slope_rms
    blurs = np.sqrt(np.average(facets.blurs**2, axis=0, weights=facets.counts))
    expected = np.hypot([facets.slope_x.std(), facets.slope_y.std()], blurs)
    assert rms[1] > 1.3 * rms[0]
    np.testing.assert_allclose(rms, expected, rtol=0.04)


def test_terraces_follow_their_truth() -> None:
    true = ground(0.3, n=160)
    step = 0.35 * true.heights.std()
    digitised = HeightMap(np.round(true.heights / step) * step, true.spacing)
    views = np.deg2rad(np.arange(0.0, 71.0, 5.0))
    at = (np.deg2rad(30.0), views, np.pi)
    with pytest.warns(UserWarning, match="equal"):
        found = fitting.predict(digitised, GLASS, wavelength=0.65, resolution=0.1)
    whole = fitting.predict(true, GLASS, wavelength=0.65)
    off = found.brdf(*at)[:, 0, 0] / whole.brdf(*at)[:, 0, 0] - 1
    assert np.sqrt(np.mean(off**2)) < 0.12


def test_interval_holds_the_prediction_and_grows_with_doubt() -> None:
    surface = ground(0.25, n=96)
    at = (0.6, np.array([0.2, 0.6, 0.9]), np.pi)
    found = fitting.predict(surface, GLASS, wavelength=0.65, base_albedo=0.0)
    low, high = found.interval(*at)
    value = found.brdf(*at)[:, 0, 0]
    assert np.all((low < value) & (value < high))
    sure = fitting.predict(
        surface, GLASS, wavelength=0.65, base_albedo=0.0, place=0.0, index_stderr=0.0
    )
    narrow = np.subtract(*sure.interval(*at)[::-1])
    assert np.all(narrow < 0.8 * (high - low))


def test_misfit_frees_gain_and_base_of_what_they_made() -> None:
    curve = np.array([0.5, 0.2, 0.05, 0.01, 0.3])
    off = misfit(curve, 0.7 * curve + 0.03 / np.pi)
    assert off.gain == pytest.approx(0.7)
    assert off.gain_base == pytest.approx(0.03)
    assert off.gain_free < 1e-9
    assert off.absolute > 0.2


def test_bad_arguments_are_named() -> None:
    found = fitting.predict(ground(0.2, n=96), GLASS, wavelength=0.65)
    with pytest.raises(ValueError, match=r"prediction, 0\.65 um, got 0\.5\."):
        found.brdf(0.3, 0.3, np.pi, 0.5)
    with pytest.raises(TypeError, match="surface must be a HeightMap"):
        fitting.predict(3.0, GLASS, wavelength=0.65)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="wavelength must be positive"):
        fitting.predict(ground(0.2, n=64), GLASS, wavelength=-1.0)
    with pytest.raises(ValueError, match="surface must be rough"):
        fitting.predict(HeightMap(np.zeros((64, 64)), 1.0), GLASS, wavelength=0.65)
    with pytest.raises(ValueError, match="100 cells of known heights"):
        fitting.predict(
            HeightMap(ground(0.2, n=64).heights[:8, :8], 1.0), GLASS, wavelength=0.65
        )


@pytest.mark.parametrize("along", [0, 1])
def test_a_grating_scatters_along_its_wave_vector(along: int) -> None:
    wave = np.sin(np.arange(128) * 2 * np.pi / 32)
    heights = np.broadcast_to(wave[:, None], (128, 128))
    surface = HeightMap(heights if along == 0 else heights.T, 1.0, periodic=True)
    found = fitting.predict(surface, GLASS, wavelength=0.65)
    phi_i = np.array([0.0, np.pi / 2])
    m00 = found.brdf(0.5, 0.3, np.pi, phi_i=phi_i)[:, 0, 0]
    assert m00[along] > 10 * m00[1 - along]


def test_free_density_of_a_scan_is_that_of_its_facets() -> None:
    angles = np.deg2rad(
        np.meshgrid([10.0, 45.0], np.arange(0.0, 76.0, 3.0), [180, 140, 60])
    )
    theta_i, theta_s, dphi = (a.ravel() for a in angles)
    truth = MicrofacetModel(GLASS, slope_rms=0.22)
    readings = 0.8 * truth.brdf(theta_i, theta_s, dphi)[..., 0, 0] + 0.03 / np.pi
    found = free_density(theta_i, theta_s, dphi, readings, GLASS)
    assert found.error < 0.02
    assert found.gain == pytest.approx(0.8, rel=0.06)
    assert found.diffuse_albedo == pytest.approx(0.03, rel=0.05)
    # Rayleigh's law of |slope|
    median = found.quantile(np.array([0.5]))[0]
    assert median == pytest.approx(0.22 * np.sqrt(2 * np.log(2)), rel=0.05)


def test_command_tells_what_any_slopes_would_leave(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    angles = np.deg2rad(np.meshgrid([10.0, 45.0], np.arange(0.0, 76.0, 3.0), [180, 140]))
    theta_i, theta_s, dphi = (a.ravel() for a in angles)
    model = MicrofacetModel(GLASS, slope_rms=0.2)
    readings = 0.8 * model.brdf(theta_i, theta_s, dphi)[..., 0, 0] + 0.02 / np.pi
    coords = {"theta_i": theta_i, "theta_s": theta_s, "dphi": dphi}
    scan = xr.Dataset(
        {"M00": ("geometry", readings)},
        coords={k: ("geometry", v) for k, v in coords.items()},
    )
    data_io.write_goniometer(scan, tmp_path / "scan.csv")
    np.save(tmp_path / "map.npy", ground(0.3, n=96).heights)
    words = ["predict", str(tmp_path / "map.npy"), "--spacing-um", "1", "--n", "1.5"]
    words += ["--scan", str(tmp_path / "scan.csv"), "--wavelength-um", "0.65"]
    words += ["--resolution-um", "0.1"]
    assert main(words) == 0
    told = capsys.readouterr().out
    left = re.search(r"Any isotropic slopes .* off by (\d+)% with gain ([\d.]+)", told)
    assert left is not None, told
    assert int(left[1]) <= 3
    assert float(left[2]) == pytest.approx(0.8, rel=0.06)
    # Rayleigh's median of 0.2 in the scan, and of 0.3 on the map
    halves = re.search(r"scan [\d.]+ / ([\d.]+) .* map [\d.]+ / ([\d.]+)", told)
    assert halves is not None, told
    assert float(halves[1]) == pytest.approx(0.2 * 1.177, rel=0.06)
    assert float(halves[2]) == pytest.approx(0.3 * 1.177, rel=0.12)
