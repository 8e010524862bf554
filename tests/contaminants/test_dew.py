"""The comparison of dew: its numbers, its errors and its files."""

import csv

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import GaussianSurface, HeightMap, Material
from pbrdf.cli import main
from pbrdf.cli.dew_figures import signature_figure
from pbrdf.dew import compare_dew, jackknife
from pbrdf.errors import AccuracyWarning
from tests.pictures.readable import unreadable

PAINT, WATER = Material(1.5), Material(1.333)
SURFACE = GaussianSurface(shape=(64, 64), spacing=2.0, corr_length=30.0, slope_rms=0.05)
AMOUNT = {"volume_per_area": 1.0, "number_density": 4e-4}


@pytest.fixture(scope="module")
def result():
    return compare_dew(
        SURFACE, PAINT, np.deg2rad([30.0, 150.0]), np.deg2rad([0.0, 50.0]), amount=AMOUNT,
        water=WATER, runs=6, n_rays=3000, n_theta=18, n_dphi=24, seed=2,
    )  # fmt: skip


def test_states_regions_and_energy(result):
    assert list(result.state.values) == ["dry", "30 deg", "150 deg"]
    assert_allclose(np.rad2deg(result.contact_angle), [np.nan, 30.0, 150.0])
    whole = result.albedo + result.absorbed + result.truncated + result.leaked
    assert_allclose(whole, 1.0, atol=1e-6)
    # The mean over the hemisphere is the albedo over pi
    mean = result.signature.sel(region="hemisphere", quantity="M00")
    assert_allclose(mean * np.pi, result.albedo, rtol=1e-9)
    # Lobe, skirt and wings make up the hemisphere: what they add sums to its whole
    weight = result.projected_solid_angle
    added = (result.brdf - result.brdf.isel(state=0))[..., 0, 0]
    total = (added * weight).sum(("theta_s", "dphi")) / np.pi
    assert_allclose(
        result.added.sel(region="hemisphere", quantity="M00"), total, atol=1e-12
    )
    assert_allclose(result.added.isel(state=0), 0.0)


def test_water_darkens_the_lobe_of_a_smooth_paint(result):
    lobe = result.signature.sel(region="lobe", quantity="M00")
    error = result.signature_stderr.sel(region="lobe", quantity="M00")
    assert (lobe[0] - lobe[1] > 4 * np.hypot(error[0], error[1])).all()
    # At normal incidence the frame has no preferred direction: M20 over the circle cancels
    upright = result.brdf.isel(theta_i=0, stokes_out=2, stokes_in=0)
    spread = result.brdf_stderr.isel(theta_i=0, stokes_out=2, stokes_in=0)
    sums = upright.sum(("theta_s", "dphi"))
    assert (abs(sums) < 6 * np.sqrt((spread**2).sum(("theta_s", "dphi")))).all()


def test_a_bin_without_rays_has_the_error_of_one(result):
    dry = result.isel(state=0, theta_i=1, stokes_out=0, stokes_in=0)
    dark = (dry.brdf == 0.0).values
    assert 0.5 < dark.mean() < 1.0
    one = (dry.brdf_stderr * dry.projected_solid_angle).values[dark]
    # 6 runs of 3000 rays that bounce once: each carries the mean reflectance
    assert_allclose(one, float(dry.albedo) / 18_000, rtol=0.02)
    assert result.brdf_stderr.dims == result.brdf.dims


def test_a_region_without_rays_has_the_error_of_one(result):
    dark = result.isel(state=0).sel(region="wings").isel(theta_i=0)
    assert float(dark.signature.sel(quantity="M00")) == 0.0
    error = float(dark.signature_stderr.sel(quantity="M00"))
    # One of 6 runs x 3000 rays, each with a reflectance of about 0.04, over the wings' area
    area = float(result.projected_solid_angle.sum()) * np.cos(np.deg2rad(30.0)) ** 2
    assert_allclose(error, 0.04 / 18_000 / area, rtol=0.1)
    assert float(dark.signature_stderr.sel(quantity="DOLP")) == 1.0


def test_the_peak_of_the_whole_is_that_of_a_part(result):
    for name in ("peak M00", "peak P"):
        peak = result.signature.sel(quantity=name)
        parts = peak.sel(region=["lobe", "skirt", "wings"]).max("region")
        assert_allclose(peak.sel(region="hemisphere"), parts)
        added = result.added.sel(quantity=name, region="hemisphere")
        assert_allclose(added, peak.sel(region="hemisphere") - parts.isel(state=0))


def test_jackknife_takes_the_bias_out_of_a_square():
    # Known bias: E[mean²] = μ² + σ²/n; over many samples the jackknife has none
    rng = np.random.default_rng(3)
    samples = 2.0 + rng.standard_normal((4000, 6))
    found = [jackknife(sample, np.square) for sample in samples]
    value, stderr = np.array(found).T
    error = value.std(ddof=1) / np.sqrt(len(value))
    assert abs(value.mean() - 4.0) < 4 * error
    assert (np.mean(samples, axis=1) ** 2).mean() - 4.0 > 10 * error / np.sqrt(6)
    # Its error is the spread of the values
    assert_allclose(np.sqrt(np.mean(stderr**2)), value.std(), rtol=0.05)


def test_errors_of_the_runs_cover_the_truth():
    # A flat paint has one direction and one reflectance: no spread, exact albedo
    flat = compare_dew(
        HeightMap.flat(size=(100.0, 100.0)), PAINT, [np.pi / 2], [0.3], amount=AMOUNT,
        water=WATER, runs=4, n_rays=2000, n_theta=18, n_dphi=24,
    )  # fmt: skip
    inner = np.arcsin(np.sin(0.3) / 1.5)
    r_s = np.sin(0.3 - inner) / np.sin(0.3 + inner)
    r_p = np.tan(0.3 - inner) / np.tan(0.3 + inner)
    assert_allclose(flat.albedo[0, 0], (r_s**2 + r_p**2) / 2, rtol=1e-12)
    assert flat.albedo_stderr[0, 0] < 1e-12
    assert flat.albedo_stderr[1, 0] > 0


# Pictures are what takes long
@pytest.mark.parametrize("angles", ["30", pytest.param("30,50", marks=pytest.mark.slow)])
def test_the_command_writes_its_folder(tmp_path, capsys, angles):
    from pbrdf import Scene

    Scene(SURFACE, PAINT).to_toml(tmp_path / "scene.toml")
    target = tmp_path / "dew"
    code = main(
        ["dew", "--scene", str(tmp_path / "scene.toml"), "--contact-angles-deg", "90",
         "--theta-i-deg", angles, "--n-rays", "1000", "--runs", "4",
         "--volume-per-area-um", "1", "--number-density-per-mm2", "400",
         "-o", str(target)]
    )  # fmt: skip
    assert code == 0
    names = {path.name for path in target.iterdir()}
    assert names == {"dew.nc", "dew.csv", "polarised.png", "model.toml"} | {
        f"hemisphere_{angle}deg.png" for angle in angles.split(",")
    }
    with (target / "dew.csv").open() as file:
        table = list(csv.DictReader(file))
    assert len(table) == 2 * len(angles.split(",")) * 4
    assert {row["state"] for row in table} == {"dry", "90 deg"}
    assert float(table[0]["M00"]) > 10 * float(table[0]["M00_stderr"]) > 0
    assert "hemisphere" in capsys.readouterr().out


def test_a_warning_that_differs_in_its_numbers_is_told_once():
    """Each contact angle has drops of a radius of its own, all too small for 10 um."""
    small = GaussianSurface(shape=(32, 32), spacing=2.0, corr_length=15.0, slope_rms=0.05)
    with pytest.warns(AccuracyWarning) as caught:
        result = compare_dew(
            small, "pvc", np.deg2rad([30.0, 60.0, 90.0]), 0.3,
            amount={"volume_per_area": 0.01, "number_density": 0.04}, runs=2, n_rays=320,
            n_theta=6, n_dphi=8, wavelength=10.0,
        )  # fmt: skip
    told = [str(one.message) for one in caught if "median radius" in str(one.message)]
    assert len(told) == 1
    assert told[0].endswith("(and 2 more with other numbers)")
    assert told[0] in result.attrs["warnings"]


def test_the_figure_of_numbers_says_what_it_shows(result):
    figure = signature_figure(result)
    title = figure.get_suptitle()
    assert "Gaussian surface slope 0.05, n 1.5" in title
    assert "P = √(M10² + M20² + M30²)" in title
    assert "2 standard errors" in title
    lobe = figure.axes[0]
    dry = result.isel(state=0, theta_i=0).sel(region="lobe", quantity="P")
    band = lobe.patches[0].get_bbox()
    assert_allclose(
        [band.y0, band.y1],
        dry.signature.item() + np.array([-2, 2]) * dry.signature_stderr.item(),
    )
    # The legend lies below the axes, whose lines it covered
    legend = figure.legends[0]
    assert {text.get_text() for text in legend.get_texts()} >= {"incidence 50°", "dry"}
    assert unreadable(figure) == []
