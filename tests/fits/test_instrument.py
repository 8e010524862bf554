"""What a microscope hid from a map, against rendered interferograms and closed forms."""

import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

import data_io
import fitting
from fitting.prediction.density import slope_table
from fitting.prediction.doubts import place_error
from fitting.prediction.facets import Facets, facets_of
from fitting.prediction.steep import _thin_plate, bridged
from fitting.statistics.mended import mended_once
from pbrdf import GaussianSurface, HeightMap, Material, MicrofacetModel
from pbrdf.cli import main
from studies.predict_coatings.interferometer import Interferometer, digitised
from studies.predict_coatings.true_surfaces import true_surface

GLASS = Material(1.5)
MICROSCOPE = fitting.Instrument(aperture=0.55)


def incoherent(share: float) -> float:
    """Transfer of a filled round pupil at a share of its cut-off (Goodman, eq. 7-30)."""
    return 2 / np.pi * (np.arccos(share) - share * np.sqrt(1 - share**2))


@pytest.mark.parametrize("share", [0.4, 0.55, 0.7])
def test_spread_passes_what_the_pupil_does(share: float) -> None:
    instrument = fitting.Instrument(aperture=0.37, wavelength=0.61, pixel=1e-6)
    frequency = share * 2 * 0.37 / 0.61
    passed = np.exp(-2 * (np.pi * instrument.spread(5.0) * frequency) ** 2)
    assert passed == pytest.approx(incoherent(share), abs=0.08)


def test_no_facet_beyond_the_steepest_mirrors_within_the_cone() -> None:
    rng = np.random.default_rng(3)
    sines = 0.42 * np.sqrt(rng.random((2, 200_000)))
    turns = 2 * np.pi * rng.random((2, 200_000))
    x, y = sines * np.cos(turns), sines * np.sin(turns)
    z = np.sqrt(1 - sines**2)
    slopes = np.hypot(x.sum(0), y.sum(0)) / z.sum(0)
    steepest = fitting.Instrument(aperture=0.42).steepest
    assert slopes.max() < steepest
    assert slopes.max() == pytest.approx(steepest, rel=0.03)


@pytest.mark.parametrize("period", [1.7, 2.9])
def test_rendered_interferometer_passes_waves_as_its_pupil_does(period: float) -> None:
    step, nodes = period / 16, 128
    wave = np.cos(2 * np.pi * np.arange(nodes) / 16)
    true = HeightMap(np.tile(0.004 * wave[:, None], (1, 16)), step, periodic=True)
    seen = Interferometer(aperture=0.3, pixel=2, noise=0.0).image(true).heights
    amplitude = 2 * np.mean(seen * wave[1::2, None])
    # The pixel lies half a node from the node that stands for it
    pixel = np.sinc(2 / 16)
    expected = 0.004 * pixel * incoherent(0.55 / (2 * 0.3 * period))
    assert amplitude == pytest.approx(expected, rel=0.06)


def test_rendered_interferometer_loses_steep_facets_only() -> None:
    x, y = np.mgrid[:160, :160] * 0.2
    hill = 4.5 * np.exp(-((x - 15) ** 2 + (y - 17) ** 2) / 2 / 3.0**2)
    true = HeightMap(hill, 0.2, periodic=True)
    slope = np.hypot(*np.gradient(hill, 0.2))
    seen = Interferometer(aperture=0.55, pixel=1).image(true).heights
    good = np.abs(seen - hill) < 0.05
    assert good[slope < 0.3].mean() > 0.999
    assert good[slope > MICROSCOPE.steepest].mean() < 0.4


def test_thin_plate_is_exact_where_the_laplacian_is_even() -> None:
    x, y = np.meshgrid(np.arange(30) * 0.5, np.arange(40) * 0.3, indexing="ij")
    plane = 1.0 + 0.3 * x - 0.7 * y + 0.05 * x * y
    holed = plane.copy()
    holed[10:17, 12:25] = np.nan
    holed[:3, :2] = np.nan
    np.testing.assert_allclose(_thin_plate(holed, (0.5, 0.3)), plane, atol=1e-8)


@pytest.mark.parametrize("band", [0.0, 0.2])
def test_a_flank_wrong_by_a_fringe_is_bridged(band: float) -> None:
    x, y = np.mgrid[:140, :120] * 0.25
    hill = 2.6 * np.exp(-((x - 15) ** 2 / 3.0**2 + (y - 17) ** 2 / 3.6**2) / 2)
    hill += 0.3 * np.sin(x / 3) + 0.2 * np.sin(y / 2.5)
    slope = np.hypot(*np.gradient(hill, 0.25))
    wrong = hill + np.where(slope > 0.45, 0.29 * np.round(4 * np.sin(9 * x + 7 * y)), 0.0)
    seen = HeightMap(wrong, 0.25)
    seen = digitised(seen, band) if band else seen
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", data_io.MendWarning)
        found = bridged(seen, fitting.Instrument(aperture=0.45))
    assert found.lost[slope > 0.47].mean() > 0.9
    assert found.lost[slope < 0.3].mean() < 0.05
    flank = slope > 0.45
    bridges = np.hypot(*np.gradient(found.surface.heights, 0.25))
    assert bridges[flank].mean() == pytest.approx(slope[flank].mean(), rel=0.12)
    assert np.hypot(*np.gradient(wrong, 0.25))[flank].mean() > 1.5 * slope[flank].mean()


@pytest.mark.slow
def test_named_instrument_predicts_the_true_surface() -> None:
    """Non-Gaussian grains, imaged and in bands: curves of M00 and M10."""
    true = true_surface(
        "grains", slope_rms=0.2, corr_length=7.0, nodes=320, step=0.2268, seed=2
    )
    seen = Interferometer(aperture=0.55, pixel=2).image(true)
    seen = digitised(seen, 0.15 * float(true.heights.std()))
    at = (np.deg2rad(30.0), np.deg2rad(np.arange(2.5, 70.0, 5.0)), np.deg2rad(140.0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", data_io.MendWarning)
        found, drawn = bridged(seen, MICROSCOPE), mended_once(seen)
    spread = MICROSCOPE.spread(seen.spacing[0])
    facets = {
        "true": facets_of(true, 0.65),
        "no": facets_of(drawn, 0.65),
        "named": facets_of(found.surface, 0.65, resolution=spread, lost=found.lost),
    }
    curves = {
        name: MicrofacetModel(GLASS, slope_distribution=slope_table(one)).brdf(*at)
        for name, one in facets.items()
    }
    whole, errors = curves.pop("true"), {}
    for name, curve in curves.items():
        off = (curve - whole)[:, :2, 0] / whole[:, :1, 0]
        errors[name] = np.sqrt(np.mean(off**2, axis=0))
    assert np.all(errors["named"] < 0.08)
    assert errors["no"][0] > 2 * errors["named"][0]


def rugged(nodes: int, step: float) -> HeightMap:
    """Slopes whose variance within a distance grows as the distance, p = 1."""
    rng = np.random.default_rng(5)
    f = np.hypot(np.fft.fftfreq(nodes, step)[:, None], np.fft.fftfreq(nodes, step))
    waves = np.fft.fft2(rng.standard_normal((nodes, nodes))) / (0.003 + f**2) ** 1.25
    heights = np.fft.ifft2(waves).real
    heights *= 0.35 / np.std(np.diff(heights, axis=0) / step)
    return HeightMap(heights, step, periodic=True)


def test_hidden_slopes_come_back_with_the_resolution() -> None:
    """Roughness with slopes at all scales, p = 1, seen through a point spread."""
    sharp = rugged(256, 0.06)
    spread = 0.25
    blurred = HeightMap(
        ndimage.gaussian_filter(sharp.heights, spread / 0.06, mode="wrap"), 0.06,
        periodic=True,
    )  # fmt: skip
    truth = facets_of(sharp, 0.65).slope_rms
    blind = facets_of(blurred, 0.65).slope_rms
    told = facets_of(blurred, 0.65, resolution=spread).slope_rms
    assert blind < 0.95 * truth
    assert abs(told - truth) < 0.5 * abs(blind - truth)


def test_hidden_slopes_follow_the_power_of_the_distance() -> None:
    common = {
        "slope_x": np.zeros(4), "slope_y": np.zeros(4), "sizes": np.array([0.2, 0.9]),
        "counts": np.array([3, 1]), "wavelength": 0.65, "resolution": 0.4,
    }  # fmt: skip
    blur = 0.65 / (8 * np.pi * 0.2)
    for exponent, share in ((0.0, 0.0), (1.0, 1.0), (2.0, 3.0)):
        found = Facets(**common, exponent=exponent)
        # Patches larger than the resolution hide nothing
        assert found.hidden == pytest.approx(blur * np.sqrt(0.75 * share), abs=1e-12)


def test_error_of_a_place_is_the_scatter_of_places() -> None:
    surface = GaussianSurface(
        shape=(512, 512), spacing=1.0, corr_length=9.0, slope_rms=0.2
    ).sample(seed=1)
    pieces = [
        HeightMap(surface.heights[i : i + 64, j : j + 64], 1.0)
        for i in range(0, 512, 64)
        for j in range(0, 512, 64)
    ]
    slopes = [np.hypot(*(np.std(s) for s in one.slopes())) for one in pieces]
    scatter = np.std(slopes) / np.mean(slopes)
    stated = np.sqrt(np.mean([place_error(one) ** 2 for one in pieces]))
    assert stated == pytest.approx(scatter, rel=0.25)


def test_doubts_are_told_with_their_size() -> None:
    surface = HeightMap(rugged(96, 0.2).heights[:90], 0.2)
    with pytest.warns(
        UserWarning, match=r"not known.* rms 0\.\d+ per axis instead of 0\.\d"
    ):
        fitting.predict(surface, GLASS, wavelength=0.65)
    with pytest.warns(UserWarning, match=r"hide slopes.*is added, between 0 and 0\.\d"):
        fitting.predict(surface, GLASS, wavelength=0.65, resolution=0.4)
    wide = GaussianSurface(
        shape=(256, 256), spacing=1.0, corr_length=16.0, slope_rms=0.2
    ).sample(seed=4)
    small = HeightMap(wide.heights[:64, :64], 1.0, periodic=True)
    with pytest.warns(UserWarning, match=r"64 um leave the rms slope uncertain by \d+%"):
        found = fitting.predict(small, GLASS, wavelength=0.65, resolution=0.1)
    assert any("uncertain by" in note for note in found.notes)


def test_what_makes_no_instrument_is_refused() -> None:
    with pytest.raises(ValueError, match=r"aperture must lie between 0 and 1, got 1\.[34]"):
        fitting.Instrument(aperture=1.4)
    with pytest.raises(ValueError, match="pixel must be positive"):
        fitting.Instrument(aperture=0.4, pixel=0.0)
    surface = GaussianSurface(shape=(128, 128), spacing=0.5, corr_length=5.0, slope_rms=0.3)
    steep = surface.sample(seed=2)
    with pytest.raises(ValueError, match="aperture must let the instrument see half"):
        fitting.predict(
            steep, GLASS, wavelength=0.65, instrument=fitting.Instrument(aperture=0.1)
        )
    with pytest.raises(ValueError, match="resolution must be 0 beside an instrument"):
        fitting.predict(
            steep, GLASS, wavelength=0.65, instrument=MICROSCOPE, resolution=0.2
        )


def test_command_takes_the_instrument(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    surface = GaussianSurface(shape=(128, 128), spacing=0.3, corr_length=3.0, slope_rms=0.2)
    np.save(tmp_path / "map.npy", surface.sample(seed=3).heights)
    words = ["predict", str(tmp_path / "map.npy"), "--spacing-um", "0.3", "--n", "1.5"]
    words += ["--wavelength-um", "0.65"]
    assert main([*words, "--pixel-um", "0.3"]) == 2
    assert "--pixel-um must come with --na" in capsys.readouterr().err
    assert main([*words, "--na", "0.5", "--instrument-wavelength-um", "0.6"]) == 0
    hid = re.search(r"of which ([\d.]+) that the instrument hid", capsys.readouterr().out)
    assert hid is not None
    assert float(hid[1]) > 0.005
