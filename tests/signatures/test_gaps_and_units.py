"""What would make a signature nan, or a wavelength wrong by a thousand, is told."""

import warnings

import numpy as np
import pytest

import pbrdf
from pbrdf.errors import AccuracyWarning
from pbrdf.signatures import OvercastSky, Sun

PAINT = pbrdf.MicrofacetModel(pbrdf.Material(1.5), 0.2, diffuse_albedo=0.1)
SCENE = pbrdf.Scene(
    pbrdf.GaussianSurface(shape=(24, 24), spacing=1.0, corr_length=5.0, slope_rms=0.2),
    pbrdf.Material(1.5, 0.1),
)


@pytest.fixture(scope="module")
def result():
    return pbrdf.simulate(
        SCENE, [0.3, 0.8], phi_i="uniform", n_rays=200, realizations=8, n_theta=9,
        n_dphi=18,
    )  # fmt: skip


def test_gaps_of_a_result_are_refused_with_their_place(result) -> None:
    hurt = result.copy(deep=True)
    hurt.brdf_total[1, 2, 5, 0, 1] = np.nan
    hurt.brdf_total[1, 3, 5, 2, 1] = np.inf
    words = r"2 of 162 bins of brdf_total are not, the first at theta_s 25, dphi 100 deg"
    for light in ({"sun": Sun(theta=0.4)}, {"sky": OvercastSky(radiance=1.0)}):
        with pytest.raises(ValueError, match=words):
            pbrdf.signature(hurt, 0.8, **light)
        assert np.isfinite(pbrdf.signature(hurt, 0.3, **light).radiance).all()
    # Sunlight by the incidence of the sun
    with pytest.raises(ValueError, match=r"of the incidence 45.84. Simulate them"):
        pbrdf.signature(hurt, 0.5, sun=Sun(theta=0.8))


def test_errors_that_are_not_known_are_told(result) -> None:
    hurt = result.copy(deep=True)
    hurt.brdf_total_stderr[1, 2, 5] = np.nan
    with pytest.warns(AccuracyWarning, match="16 standard errors of the result are nan"):
        pbrdf.signature(hurt, 0.8, sun=Sun(theta=0.4))


def test_a_function_with_gaps_is_refused_with_their_place() -> None:
    class Torn:
        def brdf(self, theta_i, theta_s, dphi):
            whole = PAINT.brdf(theta_i, theta_s, dphi)
            return np.where((np.asarray(theta_i) > 1.4)[..., None, None], np.nan, whole)

    with pytest.raises(ValueError, match=r"matrices are not, the first at theta_i 8\d"):
        pbrdf.signature(Torn(), 0.4, sky=OvercastSky(radiance=1.0))
    assert pbrdf.signature(Torn(), 0.4, sun=Sun(theta=0.4)).radiance[0] > 0


def test_a_sky_with_gaps_is_refused_with_their_place(result) -> None:
    class Torn:
        def stokes(self, theta, phi, wavelength):
            light = OvercastSky(radiance=1.0).stokes(theta, phi, wavelength)
            return np.where((np.asarray(theta) > 1.3)[..., None], np.nan, light)

    for source in (PAINT, result):
        with pytest.raises(ValueError, match=r"directions of Torn .* at theta (7[5-9]|8)"):
            pbrdf.signature(source, 0.3, sky=Torn())


@pytest.mark.parametrize(
    ("wavelength", "words"),
    [
        (550.0, r"550 um, 5.5 times the longest of light .* 550 nm are 0.55 um"),
        ([0.5, 1500.0], r"1500 um, 15 times the longest .* 1500 nm are 1.5 um"),
        (0.00055, r"0.00055 um, 0.0055 of the shortest .* 0.00055 mm are 0.55 um"),
    ],
)
def test_wavelengths_of_another_unit_are_told(wavelength, words: str) -> None:
    with pytest.warns(AccuracyWarning, match=words):
        pbrdf.signature(PAINT, 0.4, wavelength=wavelength, sun=Sun(theta=0.4))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pbrdf.signature(PAINT, 0.4, wavelength=[0.1, 100.0], sun=Sun(theta=0.4))
