"""The pipeline where the roughness is no larger than the wavelength."""

import numpy as np
import pytest
import xarray as xr

from data_io import Profile, read_result, write_result
from fitting import run_pipeline
from fitting.prediction.beside_waves import wave_fit
from fitting.report.write import fit_columns, result_dataset
from pbrdf import Material, WaveModel

HEIGHT, LENGTH, WAVELENGTH, GAIN, DIFFUSE = 0.3, 6.0, 1.6, 0.9, 0.03
THETA = 0.5


def profile() -> Profile:
    """A Gaussian profile of 400 lengths, drawn as a sum of cosines."""
    rng = np.random.default_rng(7)
    x = np.arange(0.0, 400 * LENGTH, 0.5)
    wave = rng.normal(scale=np.sqrt(2) / LENGTH, size=2000)
    z = np.cos(x[:, None] * wave + rng.uniform(0, 2 * np.pi, wave.size)).sum(axis=1)
    return Profile(x, z * HEIGHT * np.sqrt(2 / wave.size))


def scan(wavelength: float) -> xr.Dataset:
    """Readings of waves with 2 % noise, none within 6 degrees of the beam."""
    view = np.deg2rad(np.r_[-50.0:20.0:3.0, 36.0:66.0:3.0])
    theta_s, dphi = np.abs(view), np.where(view > 0, np.pi, 0.0)
    model = WaveModel(Material(1.5), height_rms=HEIGHT, corr_length=LENGTH)
    brdf = GAIN * model.brdf(THETA, theta_s, dphi, wavelength)
    brdf[:, 0, 0] += DIFFUSE / np.pi
    rng, sigma = np.random.default_rng(5), 0.02 * brdf[:, 0, 0]
    data = {}
    for name, value in (("M00", brdf[:, 0, 0]), ("M10", brdf[:, 1, 0])):
        data[name] = ("geometry", value + sigma * rng.standard_normal(view.size))
        data[f"{name}_stderr"] = ("geometry", sigma)
    coords = {
        "theta_i": np.full(view.size, THETA), "theta_s": theta_s, "dphi": dphi,
        "wavelength": np.full(view.size, wavelength),
    }  # fmt: skip
    return xr.Dataset(data, {name: ("geometry", value) for name, value in coords.items()})


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_waves_stand_beside_facets_and_fit_better(tmp_path) -> None:
    readings = scan(WAVELENGTH)
    result = run_pipeline(
        profile(), readings, material=Material(1.5), n_rays=2000, realizations=8, seed=1
    )
    assert result.waves is not None
    fit = result.waves.fit
    assert fit.values["specular_gain"] == pytest.approx(GAIN, rel=0.15)
    assert fit.values["diffuse_albedo"] == pytest.approx(DIFFUSE, abs=0.004)
    assert fit.chi2 < 0.2 * result.analytic.chi2
    # The beam stands apart: it is about that of the surface that was drawn
    true = WaveModel(Material(1.5), height_rms=HEIGHT, corr_length=LENGTH)
    write_result(result_dataset(result), tmp_path / "result.nc")
    beam = read_result(tmp_path / "result.nc").waves_coherent.sel(theta_i=THETA)
    expected = true.coherent(THETA, WAVELENGTH)
    assert np.abs(beam.values - expected).max() < 0.4 * expected[0, 0]
    assert "Waves, height and slope of the surface" in fit_columns(result)
    assert any(text.startswith("Waves matter at 1.6 um") for text in result.unknown)
    figure = result.plot()
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "waves" in labels
    # Where the wavelength is not known, or far below the heights, facets stand alone
    for other in (readings.drop_vars("wavelength"), scan(0.02)):
        given = {"material": Material(1.5), "free": ()}
        assert wave_fit(result.statistics, other, pytest.fail, **given) is None
