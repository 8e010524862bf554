"""Smooth maps are predicted by waves: against the statistics that they were drawn from."""

import numpy as np
import pytest
from typer.testing import CliRunner

import fitting
import pbrdf
from fitting.models.waves import WaveSurface
from fitting.prediction.waves import density_of
from pbrdf import GaussianSurface, HeightMap, Material, MicrofacetModel, WaveModel
from pbrdf.cli.app import app
from pbrdf.signatures import Sun

WAVE, HEIGHT, LENGTH = 0.65, 0.04, 1.5
SURFACE = GaussianSurface(
    shape=(256, 256), spacing=0.2, corr_length=LENGTH, height_rms=HEIGHT
)
TRUTH = WaveModel(Material(1.5), height_rms=HEIGHT, corr_length=LENGTH)
VIEW = np.array([0.1, 0.3, 0.45, 0.6, 0.8, 1.0])


def drawn(*, periodic: bool) -> HeightMap:
    sample = SURFACE.sample(seed=3)
    return HeightMap(sample.heights, sample.spacing, periodic=periodic)


@pytest.mark.parametrize("periodic", [True, False])
def test_a_smooth_map_scatters_by_its_spectrum(periodic):
    found = fitting.predict(drawn(periodic=periodic), Material(1.5), wavelength=WAVE)
    assert isinstance(found.model, WaveModel)
    assert "Waves are used, not facets" in found.notes[0]
    ratio = (
        found.brdf(0.5, VIEW, np.pi)[:, 0, 0] / TRUTH.brdf(0.5, VIEW, np.pi, WAVE)[:, 0, 0]
    )
    # Rings of 40 waves have a speckle of 16 %, of a faded map 25 %
    assert np.abs(ratio - 1).max() < (0.25 if periodic else 0.4)
    assert ratio.mean() == pytest.approx(1.0, abs=0.08 if periodic else 0.25)
    beam = found.coherent([0.2, 0.9])
    share = 0.06 if periodic else 0.2
    assert np.allclose(beam, TRUTH.coherent([0.2, 0.9], WAVE), atol=share * beam[0, 0, 0])
    # The disc of the sun in it is that beam, of its azimuth
    sun = Sun(theta=0.9, phi=0.7)
    seen = pbrdf.signature(found, 0.9, phi_s=0.7 + np.pi, sun=sun)
    disc = np.pi * np.sin(sun.half_angle) ** 2
    alone = found.coherent(0.9, phi_i=0.7)[:, 0]
    assert np.allclose(seen.radiance * disc, alone, atol=0.01 * alone[0])
    fitted = WaveSurface(model=TRUTH, specular_gain=0.5)
    half = pbrdf.signature(fitted, 0.9, phi_s=0.7 + np.pi, sun=sun, wavelength=WAVE)
    whole = TRUTH.coherent(0.9, WAVE)[:, 0]
    assert np.allclose(half.radiance * disc, 0.5 * whole, atol=0.005 * whole[0])
    facets = fitting.predict(
        drawn(periodic=True), Material(1.5), wavelength=WAVE, wave=False
    )
    off = (
        facets.brdf(0.5, VIEW, np.pi)[:, 0, 0] / TRUTH.brdf(0.5, VIEW, np.pi, WAVE)[:, 0, 0]
    )
    assert off.min() < 0.1
    assert not facets.coherent(0.2).any()


def test_the_interval_of_a_smooth_map_holds_its_truth():
    found = fitting.predict(
        drawn(periodic=True), Material(1.5), wavelength=WAVE, base_albedo=0.0
    )
    low, high = found.interval(0.5, VIEW, np.pi)
    true = TRUTH.brdf(0.5, VIEW, np.pi, WAVE)[:, 0, 0]
    assert (low < true).all()
    assert (true < high).all()
    assert (high < 30 * low).all()


def test_the_interval_holds_the_prediction_itself():
    # Each draw has a diffuse part brighter than this mirror's dim directions
    found = fitting.predict(drawn(periodic=True), Material(1.5), wavelength=WAVE)
    low, high = found.interval(0.3, VIEW, 2.0)
    own = found.brdf(0.3, VIEW, 2.0)[:, 0, 0]
    assert (low <= own).all()
    assert (own <= high).all()


def test_rough_maps_stay_with_facets_and_blur_is_undone():
    rough = HeightMap(20 * SURFACE.sample(seed=3).heights, 0.2, periodic=True)
    found = fitting.predict(rough, Material(1.5), wavelength=WAVE)
    assert isinstance(found.model, MicrofacetModel)
    # A Gaussian blur of 0.2 um takes half of the density at 0.66 / um
    sharp = drawn(periodic=True)
    f = [np.fft.fftfreq(256, 0.2)] * 2
    fall = np.exp(-0.5 * (2 * np.pi * 0.2) ** 2 * (f[0][:, None] ** 2 + f[1] ** 2))
    blurred = np.fft.ifft2(np.fft.fft2(sharp.heights) * fall).real
    frequency, whole = density_of(sharp, 0.0)
    _, mended = density_of(HeightMap(blurred, 0.2, periodic=True), 0.2)
    low = frequency < 0.8
    assert np.allclose(mended[low], whole[low], rtol=0.05)
    expected = np.pi * (HEIGHT * LENGTH) ** 2 * np.exp(-((np.pi * frequency * LENGTH) ** 2))
    assert np.mean(whole[low] / expected[low]) == pytest.approx(1.0, abs=0.1)


def test_what_a_coarse_map_leaves_out_is_said():
    coarse = HeightMap(drawn(periodic=True).heights[::3, ::3], 0.6, periodic=True)
    with pytest.warns(UserWarning, match="leave out the roughness that scatters beyond"):
        fitting.predict(coarse, Material(1.5), wavelength=WAVE)


@pytest.mark.slow
def test_the_command_tells_the_beam(tmp_path):
    np.save(tmp_path / "map.npy", drawn(periodic=True).heights[:128, :128])
    words = ["predict", str(tmp_path / "map.npy"), "--spacing-um", "0.2", "--n", "1.5"]
    words += ["--wavelength-um", "0.65", "--theta-i-deg", "30"]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    assert "Waves are used, not facets" in done.output
    assert "incidence 30 deg: reflectance of the specular beam 0.0" in done.output
    facets = CliRunner().invoke(app, [*words, "--facets"])
    assert "specular beam" not in facets.output
