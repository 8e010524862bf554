"""One judgement of validity for random surfaces, maps, models and what lies on them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import (
    AccuracyWarning,
    Film,
    GaussianSurface,
    HeightMap,
    Material,
    MeasuredSurface,
    MicrofacetModel,
    Scene,
    materials,
    observe,
    simulate,
)
from pbrdf.conventions import RESULT_VARIABLES
from pbrdf.validity import judge, judge_contaminants, resolution_warnings, roughness_of

LENGTH, SLOPE = 9.0, 0.25
SURFACE = GaussianSurface(
    shape=(512, 512), spacing=0.75, corr_length=LENGTH, slope_rms=SLOPE
)
GLASS = Material(1.5)


def words(surface, theta_i, wavelength):
    return " ".join(judge(roughness_of(surface), np.atleast_1d(theta_i), wavelength).notes)


def test_numbers_of_a_random_surface_are_those_of_the_formulas():
    theta, wave = 0.7, 3.3
    height = SURFACE.ensemble_height_rms
    found = judge(roughness_of(SURFACE), np.array([theta]), np.array([wave])).numbers
    coherent = np.exp(-((4 * np.pi * height * np.cos(theta) / wave) ** 2))
    assert_allclose(found["coherent_share"], [[coherent]], rtol=1e-9)
    # Second derivatives of exp(-x²/l²) have the rms √12 h / l²; over half a wavelength
    # they are a little less
    radius = (1 + SLOPE**2) ** 1.5 * LENGTH**2 / (np.sqrt(12) * height)
    number = 2 * np.pi * radius / wave * np.cos(theta) ** 3
    assert_allclose(found["curvature_number"], [[number]], rtol=0.06)
    assert_allclose(found["corr_length_in_waves"], [LENGTH / wave], rtol=0.01)
    assert_allclose(found["cell_in_waves"], [0.75 / wave], rtol=1e-12)


def test_a_sample_is_judged_as_its_ensemble():
    theta, waves = np.array([0.2, 1.1]), np.array([0.55, 8.0])
    whole = judge(roughness_of(SURFACE), theta, waves)
    sample = judge(roughness_of(SURFACE.sample(4)), theta, waves)
    part = HeightMap(SURFACE.sample(4).heights[:300, :400], 0.75)
    for one in (sample, judge(roughness_of(part), theta, waves)):
        assert len(one.notes) == len(whole.notes) > 0
        for name in ("curvature_number", "corr_length_in_waves"):
            assert_allclose(one.numbers[name], whole.numbers[name], rtol=0.12)
        assert_allclose(
            one.numbers["coherent_share"], whole.numbers["coherent_share"], atol=0.06
        )


def test_tilt_of_a_map_is_no_roughness():
    x, y = np.meshgrid(np.arange(40.0), np.arange(30.0), indexing="ij")
    plate = HeightMap(0.2 * x - 0.1 * y, 1.0)
    assert words(plate, 0.4, 0.5) == ""
    assert words(HeightMap.flat(), 0.4, 0.5) == ""


def test_the_tangent_plane_fails_towards_grazing():
    assert words(SURFACE, 0.3, 0.5) == ""
    assert "The tangent plane errs" in words(SURFACE, 1.2, 0.5)


def test_white_noise_and_coarse_pixels_are_told():
    noise = np.random.default_rng(1).normal(0.0, 0.4, (256, 256))
    fine = words(HeightMap(0.1 * noise, 0.1, periodic=True), 0.2, 0.55)
    for part in ("coherent specular beam", "tangent plane", "below the wavelength"):
        assert part in fine
    coarse = words(HeightMap(noise, 40.0, periodic=True), 0.2, 0.55)
    assert "wider than half the wavelength" in coarse
    # A grid of the same pixels that follows the surface holds all of it
    smooth = GaussianSurface(shape=(128, 128), spacing=8.0, corr_length=80, slope_rms=0.2)
    assert words(smooth.sample(2), 0.2, 0.55) == ""


def test_heights_that_are_no_gaussian_keep_their_coherent_beam():
    """Waviness of 0.02 um with pits of 3 um on 4 % of it: heights say (1 - 0.04)² or so."""
    base = GaussianSurface(
        shape=(256, 256), spacing=1.0, corr_length=10, height_rms=0.02
    ).sample(1)
    heights = base.heights.copy()
    heights[::5, ::5] -= 3.0
    found = judge(
        roughness_of(HeightMap(heights, 1.0, periodic=True)), np.array([0.0]), 0.6
    )
    phase = 4 * np.pi / 0.6
    expected = np.exp(-((phase * 0.02) ** 2)) * abs(0.96 + 0.04 * np.exp(-3j * phase)) ** 2
    assert_allclose(found.numbers["coherent_share"], [[expected]], rtol=0.02)


def test_measured_surfaces_are_judged_from_their_table():
    lags = np.geomspace(1e-3, 6, 400)
    same = MeasuredSurface(
        shape=(512, 512), spacing=0.75, height_rms=SURFACE.ensemble_height_rms,
        corr_length=LENGTH, lags=lags, autocorrelation=np.exp(-(lags**2)),
    )  # fmt: skip
    one, other = roughness_of(same), roughness_of(SURFACE)
    assert_allclose(one.radii[:4], other.radii[:4], rtol=0.02)
    assert_allclose(one.corr_length, other.corr_length, rtol=0.01)


@pytest.mark.filterwarnings("ignore:The tangent plane errs")
def test_results_carry_numbers_and_sentences():
    with pytest.warns(AccuracyWarning, match="coherent specular beam"):
        result = simulate(
            Scene(SURFACE.sample(1), GLASS), [0.2, 0.9], n_rays=320, wavelength=[0.5, 8.0],
            n_theta=6, n_dphi=8,
        )  # fmt: skip
    assert result.coherent_share.dims == ("theta_i", "wavelength")
    assert result.coherent_share.attrs["units"] == RESULT_VARIABLES["coherent_share"].units
    assert float(result.coherent_share.sel(wavelength=0.5).max()) < 1e-6
    assert any("coherent specular beam" in note for note in result.attrs["warnings"])
    with pytest.warns(AccuracyWarning, match="tangent plane"):
        seen = observe(
            Scene(SURFACE.sample(1), GLASS), [1.1, 1.2], 1.1, np.pi, n_rays=320,
            wavelength=0.5, source_half_angle=0.02, detector_half_angle=0.02,
        )  # fmt: skip
    assert seen.curvature_number.dims == ("geometry",)


def test_a_model_is_judged_where_its_heights_are_known():
    slopes = MicrofacetModel(GLASS, slope_rms=SLOPE)
    assert "cannot be judged" in slopes.judge(0.3, 0.5).notes[0]
    known = slopes.with_parameters(height_rms=SURFACE.ensemble_height_rms)
    ours = judge(roughness_of(SURFACE), np.array([1.2]), np.array([0.5])).numbers
    assert_allclose(
        known.judge(1.2, 0.5).numbers["curvature_number"],
        ours["curvature_number"],
        rtol=0.02,
    )
    with pytest.warns(AccuracyWarning, match="tangent plane"):
        warned = known.brdf(1.2, 1.1, np.pi, wavelength=0.5)
    assert_allclose(warned, slopes.brdf(1.2, 1.1, np.pi, wavelength=0.5), rtol=1e-14)
    known.brdf(0.2, 1.1, np.pi, wavelength=0.5)


def test_films_interfere_only_where_light_comes_back():
    waves = np.array([0.55, 2.95])
    report = [{"kind": "film", "thickness": 20.0}]
    kappa = np.array([0.05, 0.28])
    clear = judge_contaminants(report, waves, [Material(1.33)])
    black = judge_contaminants(
        report, waves, [Material.from_table(wavelength=waves, n=[1.33, 1.33], kappa=kappa)]
    )
    assert_allclose(clear.numbers["film_field"], [1.0, 1.0])
    back = np.exp(-4 * np.pi * kappa * 20 / waves)
    assert_allclose(black.numbers["film_field"], back)
    assert clear.notes
    assert not black.notes
    scene = Scene(HeightMap.flat((9.0, 9.0)), GLASS, Film(thickness=3.0))
    with pytest.warns(AccuracyWarning, match="it interferes"):
        result = simulate(scene, 0.3, n_rays=320, wavelength=0.55)
    n, under = materials.get("water").indices(0.55)[0], GLASS.n
    assert result.film_field.item() == pytest.approx((under - n) / (under + n), abs=1e-3)


@pytest.mark.parametrize(
    ("film", "ground"),
    [
        (Material.black(), GLASS), (Material(1.0), GLASS), (Material(GLASS.n), GLASS),
        (Material(1.33), Material.black()), (Material.mirror(), GLASS),
    ],
)  # fmt: skip
def test_a_film_with_one_reflecting_side_does_not_interfere(film, ground):
    report = [{"kind": "film", "thickness": 3.0}]
    assert not judge_contaminants(report, 0.55, [film], [ground]).notes


def test_the_size_of_interference_is_that_of_the_wave_solution():
    # |r + (1 - r²) s exp(iδ)|² over all δ, without further passes
    r, s = (1.33 - 1.0) / 2.33, (1.5 - 1.33) / 2.83
    waves = np.abs(r + (1 - r * r) * s * np.exp(1j * np.linspace(0, 2 * np.pi, 721))) ** 2
    size = 100 * (waves.max() - waves.mean()) / waves.mean()
    report = [{"kind": "film", "thickness": 3.0}]
    note = judge_contaminants(report, 0.55, [Material(1.33)], [Material(1.5)]).notes[0]
    assert f"by up to {size:.2g} %" in note


@pytest.mark.parametrize("periodic", [True, False])
def test_narrow_flats_at_different_heights_interfere(periodic):
    high = np.random.default_rng(0).integers(0, 2, (8, 8))
    steps = np.kron(high, np.ones((8, 8))) * 0.1375

    def notes(width, wave=0.55, rise=1.0):
        stepped = HeightMap(rise * steps, width / 8, periodic=periodic)
        return " ".join(judge(roughness_of(stepped), np.array([0.3]), wave).notes)

    assert "parts lie at different heights and interfere: 11 % of the light" in notes(1.6)
    assert "tangent plane" in notes(1.6)
    # Wide ones keep what they diffract in the beam's bin, and low ones add in phase
    assert "interfere" not in notes(160.0) + notes(1.6, rise=1e-2)
    assert "tangent plane" not in notes(160.0)


def test_coarse_and_small_surfaces_are_warned_of_with_the_size():
    def of(cells, lengths, slope=0.3):
        side = round(cells * lengths)
        return resolution_warnings(roughness_of(GaussianSurface(
            shape=(side, side), spacing=1.0, corr_length=cells, slope_rms=slope,
        )))  # fmt: skip

    assert of(6, 8) == of(16, 16) == []
    assert "of three and more by up to 28 %" in of(1, 16)[0]
    assert "by up to 45 %" in of(0.5, 32)[0]
    assert "by up to 0.5 %" in of(8, 4)[0]
    # Where hardly any light bounces twice, a short period does no harm
    assert of(8, 4, slope=0.05) == []
    with pytest.warns(AccuracyWarning, match="cells a correlation length are too few"):
        simulate(
            Scene(GaussianSurface(
                shape=(32, 32), spacing=1.0, corr_length=2, slope_rms=0.2), GLASS),
            0.2, n_rays=320, realizations=8,
        )  # fmt: skip


def test_light_that_goes_nowhere_is_warned_of():
    # Between a spike and its images
    heights = SURFACE.sample(1).heights[:16, :16].copy()
    heights[7, 7] = 1e4
    spiked = Scene(HeightMap(heights, 0.75, periodic=True), Material.mirror())
    with pytest.warns(
        AccuracyWarning, match=r"still on its way after 64 bounces"
    ) as caught:
        result = simulate(spiked, 0.3, n_rays=640)
    assert result.truncated.item() > 0.1
    assert any("look for heights" in str(one.message) for one in caught)
    # One who sets the limit is told in the result only
    plain = Scene(SURFACE.sample(1), Material.mirror())
    cut = simulate(plain, 1.0, n_rays=640, max_bounces=1)
    assert "after 1 bounces" in cut.attrs["warnings"][0]
