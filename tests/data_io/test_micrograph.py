"""Edges drawn with a known profile, photographed badly, and read back."""

import os
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import fft
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter
from skimage import data, io

from data_io import (
    MicrographWarning,
    Profile,
    read_profile_image,
    read_profile_images,
    write_profile_overlay,
)
from data_io.micrograph.levels import _border_width
from data_io.micrograph.restoration import restore
from examples.micrograph import Camera, Edge, gaussian_edge, photograph
from fitting import surface_statistics
from pbrdf.errors import DataFileError

PIXEL = 0.5
CAMERA = Camera(um_per_pixel=PIXEL, tilt=np.deg2rad(2.5), dust=0.0)
# Skew makes a profile that is upside down visible
RNG_SEED = 11


def slope_rms(x: np.ndarray, z: np.ndarray) -> float:
    return float(np.std(CubicSpline(x, z)(x, 1)))


@cache
def draw(camera: Camera = CAMERA, corr_pixels: float = 20.0, n_corr: float = 40.0):
    """Return a picture and the true edge in it, its mean line removed."""
    rng = np.random.default_rng(RNG_SEED)
    corr_length = corr_pixels * PIXEL
    edge = gaussian_edge(
        rng,
        n_corr * corr_length,
        PIXEL / 8,
        height_rms=0.252 * corr_length / np.sqrt(2),
        corr_length=corr_length,
    )
    # A skewed edge: peaks sharper than valleys
    z = edge.z + 0.15 * edge.z**2 / edge.height_rms
    edge = replace(edge, z=z - np.polyval(np.polyfit(edge.x, z, 1), edge.x))
    turned = edge.x * np.cos(camera.tilt) - edge.z * np.sin(camera.tilt)
    first = np.ceil(turned.min() / PIXEL + 1) * PIXEL
    last = np.floor(turned.max() / PIXEL - 1) * PIXEL
    inside = (turned >= first) & (turned <= last)
    x, z = edge.x[inside], edge.z[inside]
    z = z - np.polyval(np.polyfit(x, z, 1), x)
    return photograph(edge, camera, rng), replace(edge, x=x - x.mean(), z=z)


def save(path: Path, picture: np.ndarray) -> Path:
    io.imsave(path, picture, check_contrast=False)
    return path


def misfit(profile, truth: Edge) -> float:
    """Root mean square distance from the truth. [pixels]"""
    z = np.interp(profile.x - profile.x[-1] / 2, truth.x, truth.z)
    return float(np.std(profile.z - z)) / PIXEL


@pytest.mark.parametrize(
    ("corr_pixels", "blur", "grain", "light", "tilt", "slope_limit", "height_limit"),
    [
        (10, 0.5, 0.02, 0.1, 0.0, 0.02, 0.01),
        (10, 3.0, 0.02, 0.3, 2.0, 0.02, 0.01),
        (30, 1.5, 0.10, 0.5, 5.0, 0.02, 0.01),
        (30, 3.0, 0.05, 0.3, 3.0, 0.02, 0.015),
        (100, 3.0, 0.10, 0.4, 5.0, 0.02, 0.01),
    ],
)
def test_edge_is_read_through_blur_grain_light_and_tilt(
    tmp_path, corr_pixels, blur, grain, light, tilt, slope_limit, height_limit
):
    camera = replace(
        CAMERA, blur=blur, grain=grain, uneven_light=light, tilt=np.deg2rad(tilt)
    )
    picture, truth = draw(camera, corr_pixels, n_corr=60 if corr_pixels < 50 else 20)
    profile = read_profile_image(save(tmp_path / "edge.png", picture), PIXEL)
    # Against this very edge, so that sampling does not blur the verdict
    assert slope_rms(profile.x, profile.z) / slope_rms(truth.x, truth.z) == pytest.approx(
        1, abs=slope_limit
    )
    assert profile.z.std() / truth.z.std() == pytest.approx(1, abs=height_limit)
    assert misfit(profile, truth) < 0.3
    assert np.rad2deg(profile.tilt) == pytest.approx(tilt, abs=0.15)


def test_without_restoration_blur_and_grain_stay(tmp_path):
    """The two effects that restoration removes, each with its sign."""
    noisy = save(tmp_path / "grain.png", draw(replace(CAMERA, grain=0.10))[0])
    blurred = save(tmp_path / "blur.png", draw(replace(CAMERA, blur=4.0, grain=0.001))[0])
    _, truth = draw()
    true_slope = slope_rms(truth.x, truth.z)
    for path, low, high in ((noisy, 1.3, 5.0), (blurred, 0.5, 0.93)):
        raw = read_profile_image(path, PIXEL, restoring=False)
        assert low < slope_rms(raw.x, raw.z) / true_slope < high


def test_blur_and_noise_are_measured(tmp_path):
    # Without tilt the columns are not read between, which would smooth their noise
    camera = replace(CAMERA, blur=2.0, grain=0.06, tilt=0.0)
    picture, truth = draw(camera, corr_pixels=40)
    path = save(tmp_path / "edge.png", picture)
    profile = read_profile_image(path, PIXEL)
    assert profile.blur / PIXEL == pytest.approx(np.hypot(2.0, np.sqrt(1 / 12)), rel=0.025)
    raw = read_profile_image(path, PIXEL, restoring=False)
    error = raw.z - np.interp(raw.x - raw.x[-1] / 2, truth.x, truth.z)
    # Above the surface's own frequencies the error is the noise
    assert profile.noise_rms == pytest.approx(np.std(np.diff(error)) / np.sqrt(2), rel=0.1)
    assert profile.grain == pytest.approx(0.06, rel=0.15)
    # Dark 0.12, bright 0.75 in full light, which falls off by a quarter at most
    assert 0.75 * 0.435 < profile.threshold < 0.435


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """What is read of the edge as it is drawn."""
    path = tmp_path_factory.mktemp("plain") / "plain.png"
    return read_profile_image(save(path, draw()[0]), PIXEL)


@pytest.mark.parametrize(
    "form", ["dark field", "upright", "colour", "16 bit", "one channel"]
)
def test_kinds_of_pictures_give_the_same_profile(tmp_path, plain, form):
    picture, _ = draw()
    level = np.full_like(picture, 120)
    other = {
        "dark field": 255 - picture,
        "upright": np.ascontiguousarray(picture.T),
        "colour": np.stack([picture, picture, picture], axis=-1),
        "16 bit": picture.astype(np.uint16) * 257,
        "one channel": np.stack([level, level, picture], axis=-1),
    }[form]
    profile = read_profile_image(save(tmp_path / "other.png", other), PIXEL)
    assert_allclose(profile.z, plain.z, atol=0.02)
    if form == "one channel":
        assert profile.channel in ("grey", "blue")


def test_z_points_out_of_the_material(tmp_path, plain):
    """The truth has sharp peaks, skewness > 0; from the other side they are valleys."""
    picture, truth = draw()
    path = save(tmp_path / "edge.png", picture)

    def skewness(z):
        return float(np.mean(z**3) / np.std(z) ** 3)

    expected = skewness(truth.z)
    assert expected > 0.3
    assert skewness(plain.z) == pytest.approx(expected, abs=0.05)
    inverted = read_profile_image(path, PIXEL, material="bright")
    assert skewness(inverted.z) == pytest.approx(-expected, abs=0.05)


def test_dust_is_dropped(tmp_path, plain):
    picture, truth = draw(replace(CAMERA, dust=150.0))
    dusty = read_profile_image(save(tmp_path / "dusty.png", picture), PIXEL)
    ratio = slope_rms(dusty.x, dusty.z) / slope_rms(truth.x, truth.z)
    assert ratio == pytest.approx(1, abs=0.05)
    assert plain.warnings == ()


def test_several_edges_are_separated(tmp_path):
    picture, truth = draw(replace(CAMERA, tilt=0.0))
    # A strip of material between two mirrored edges
    path = save(tmp_path / "strip.png", np.concatenate([picture, picture[::-1]]))
    upper, lower = read_profile_images(path, PIXEL)
    assert misfit(upper, truth) < 0.2
    assert misfit(lower, truth) < 0.2
    with pytest.warns(MicrographWarning, match="shows 2 edges"):
        read_profile_image(path, PIXEL)
    assert_allclose(read_profile_image(path, PIXEL, edge=1).z, lower.z)
    with pytest.raises(ValueError, match=r"edge must lie in \[0, 1\], got 2"):
        read_profile_image(path, PIXEL, edge=2)


def test_overhang_takes_the_outermost_border_and_says_so(tmp_path):
    rows, columns = np.mgrid[:200, :600]
    material = rows > 120 + 4 * np.sin(columns / 25)
    # A cap on a stem: a cavity lies under its rim
    material |= (np.abs(columns - 300) < 15) & (np.abs(rows - 80) < 8)
    material |= (np.abs(columns - 300) < 5) & (rows > 80)
    picture = 200 - 150 * gaussian_filter(material.astype(float), 1.0)
    path = save(tmp_path / "cap.png", picture.astype(np.uint8))
    profile = read_profile_image(path, 1.0)
    # The rim stands out by ten pixels on either side of the stem
    share, remark = profile.warnings[0].split("%")
    assert "columns overhang: the outermost border is taken" in remark
    assert float(share) / 100 * 600 == pytest.approx(20, abs=4)
    at = np.abs(profile.pixels[:, 1] - 300) < 12
    # The upper border of rows |r - 80| < 8 lies between rows 72 and 73
    assert_allclose(profile.pixels[at, 0], 72.5, atol=0.3)
    assert profile.overhang.any()


def test_straight_edge_has_no_roughness(tmp_path):
    """Grain alone: a reader that trusted its pixels would report noise_rms as height."""
    rng = np.random.default_rng(4)
    x = np.arange(0, 500, PIXEL / 8)
    flat = Edge(x=x, z=np.zeros_like(x), height_rms=0.0, corr_length=1.0)
    path = save(tmp_path / "flat.png", photograph(flat, replace(CAMERA, grain=0.1), rng))
    profile = read_profile_image(path, PIXEL)
    assert profile.z.std() < 0.2 * profile.noise_rms
    assert any("noise" in remark for remark in profile.warnings)


def test_scale_bar_and_text_band(tmp_path):
    picture, _ = draw(replace(CAMERA, tilt=0.0))
    band = np.zeros((24, picture.shape[1]), np.uint8)
    band[12:14, 40:240] = 255
    band[4:20, 300:340:3] = 255
    path = save(tmp_path / "sem.png", np.concatenate([picture, band]))
    profile = read_profile_image(path, scale_bar_um=100)
    assert profile.um_per_pixel == pytest.approx(0.5)
    assert profile.pixels[:, 0].max() < picture.shape[0]
    with pytest.raises(DataFileError, match="expected a scale bar"):
        read_profile_image(save(tmp_path / "plain.png", picture), scale_bar_um=100)


def test_overlay_is_drawn_on_the_edge(tmp_path):
    picture, _ = draw()
    path = save(tmp_path / "edge.png", picture)
    profile = read_profile_image(path, PIXEL, overlay_path=tmp_path / "overlay.png")
    overlay = io.imread(tmp_path / "overlay.png")
    assert overlay.shape == (*picture.shape, 3)
    row, column = profile.pixels.round().astype(int).T
    assert (
        overlay[row, column, 1] > overlay[row, column, 0].astype(int) + 50
    ).mean() > 0.95
    write_profile_overlay(tmp_path / "again.png", path, [profile])
    assert_allclose(io.imread(tmp_path / "again.png"), overlay)


@pytest.mark.parametrize(
    "name",
    ["camera", "astronaut", "brick", "grass", "gravel", "coins", "page", "moon", "text",
     pytest.param("retina", marks=pytest.mark.slow), "immunohistochemistry",
     "chelsea", "coffee"],
)  # fmt: skip
def test_other_pictures_are_refused(tmp_path, name):
    path = save(tmp_path / f"{name}.png", getattr(data, name)())
    with pytest.raises(DataFileError, match="expected"):
        read_profile_images(path, PIXEL)


@pytest.mark.parametrize(
    ("name", "rows", "columns"),
    [
        ("coffee", (18, 280), (178, 317)),  # levels that bend round a cup
        ("coffee", (39, 274), (209, 351)),
        ("chelsea", (56, 172), (290, 433)),
        ("astronaut", (218, 331), (309, 444)),  # a dark table, not quite of one grey
    ],
)
def test_parts_that_two_levels_explain_but_for_some_are_refused(
    tmp_path, name, rows, columns
):
    part = getattr(data, name)()[slice(*rows), slice(*columns)]
    with pytest.raises(DataFileError, match="they explain only"):
        read_profile_images(save(tmp_path / "part.png", part), PIXEL)


def test_a_border_between_equal_levels_is_no_wider_than_the_picture():
    """Its gradient is rounding alone; the filter's kernel once filled the memory."""
    smooth = np.zeros((40, 60))
    smooth[:, :25] = 1.0
    mask = np.arange(60) < 30
    assert _border_width(np.broadcast_to(mask, (40, 60)), smooth) <= 60


@pytest.mark.slow
@pytest.mark.parametrize("name", ["astronaut", "chelsea", "immunohistochemistry", "camera"])
def test_parts_of_other_pictures_are_refused(tmp_path, name):
    """Crops hold fewer things, so more of them look like two phases with an edge."""
    picture, rng = getattr(data, name)(), np.random.default_rng(0)
    taken = []
    for number in range(15):
        rows, columns = rng.integers(120, min(*picture.shape[:2], 400), 2)
        top = rng.integers(0, picture.shape[0] - rows)
        left = rng.integers(0, picture.shape[1] - columns)
        part = save(tmp_path / "part.png", picture[top : top + rows, left : left + columns])
        try:
            read_profile_images(part, PIXEL)
        except DataFileError:
            continue
        taken.append(number)
    assert taken == []


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "none can decode"),
        (b"x_um,z_um\n0,1\n1,2\n", "none can decode"),
        (b"\x89PNG\r\n\x1a\n" + bytes(50), "none can decode"),
    ],
)
def test_unreadable_files_are_refused(tmp_path, content, message):
    path = tmp_path / "broken.png"
    path.write_bytes(content)
    with pytest.raises(DataFileError, match=message):
        read_profile_image(path, PIXEL)


def test_truncated_picture_is_refused(tmp_path):
    path = save(tmp_path / "edge.png", draw()[0])
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(DataFileError, match="none can decode"):
        read_profile_image(path, PIXEL)


@pytest.mark.parametrize(
    ("picture", "message"),
    [
        (np.full((100, 200), 77, np.uint8), "found no two levels"),
        (
            np.random.default_rng(1).integers(0, 255, (120, 300)).astype(np.uint8),
            "expected",
        ),
        (np.zeros((8, 8), np.uint8), "at least 32 x 16 pixels, got 8 x 8"),
    ],
)
def test_pictures_without_an_edge_are_refused(tmp_path, picture, message):
    with pytest.raises(DataFileError, match=message):
        read_profile_image(save(tmp_path / "none.png", picture), PIXEL)


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan"), float("inf"), 1e6])
def test_absurd_scales_are_refused(tmp_path, scale):
    path = save(tmp_path / "edge.png", draw(n_corr=10)[0])
    with pytest.raises(ValueError, match="um_per_pixel must lie in"):
        read_profile_image(path, scale)


def test_missing_scale_and_file_are_refused(tmp_path):
    path = save(tmp_path / "edge.png", draw(n_corr=10)[0])
    with pytest.raises(DataFileError, match=r"edge.png: expected a scale.*Give the size"):
        read_profile_image(path)
    with pytest.raises(DataFileError, match="found none"):
        read_profile_image(tmp_path / "missing.png", PIXEL)


def test_restoration_gives_back_a_known_spectrum():
    """Cosines of known amplitude through a known blur, with and without noise."""
    n, blur = 2000, 2.5
    column = np.arange(n) + 0.5
    wavenumbers = np.pi / n * np.array([40, 90, 150])
    amplitudes = np.array([3.0, 1.0, 0.5])
    transfer = np.exp(-((wavenumbers * blur) ** 2) / 2)
    cosines = np.cos(np.outer(wavenumbers, column))
    true, blurred = amplitudes @ cosines, (amplitudes * transfer) @ cosines
    rng = np.random.default_rng(2)
    grain = 0.2 * rng.standard_normal((2, n))
    measured = blurred + 0.2 * rng.standard_normal(n)
    # The step holds the blur, the heights that blur took away, and the noise
    step_width = np.sqrt(blur**2 + np.var(true) - np.var(blurred) + 0.2**2)
    restored = restore(measured, grain, step_width)
    assert restored.blur == pytest.approx(blur, rel=0.01)
    assert restored.noise_rms == pytest.approx(0.2, rel=0.05)
    # The noise that stays is in the band that is kept
    assert np.std(restored.height - true) < 0.2
    assert np.var(np.diff(restored.height)) == pytest.approx(np.var(np.diff(true)), rel=0.1)


def test_noise_does_not_pass_for_roughness():
    """Averages of few squares scatter; the edge is 5 % noisier than clipped phases."""
    rng = np.random.default_rng(8)
    cutoffs = []
    for _ in range(100):
        wave = np.zeros(500)
        # A Gaussian spectrum of correlation length 10 pixels, the height rms 1.8
        amplitude = np.exp(-((np.pi * np.arange(90) / 50) ** 2) / 8)
        wave[:90] = rng.standard_normal(90) * amplitude
        signal = fft.idct(wave, norm="ortho")
        height = 1.8 * signal / signal.std() + 0.35 * rng.standard_normal(500)
        grain = 0.95 * 0.35 * rng.standard_normal((2, 500))
        cutoffs.append(restore(height, grain, 0.8).cutoff)
    # The signal sinks into the noise at 11 pixels; four of 100 passed 5 before
    assert min(cutoffs) > 8
    assert max(cutoffs) < 20


@pytest.mark.parametrize("tilt", [0.0, 5.0])
def test_statistics_undo_blur_and_grain_together(tmp_path, tilt):
    """Fitted to the located edge; the same fit of the very edge is the truth."""
    camera = replace(CAMERA, blur=3.0, grain=0.1, tilt=np.deg2rad(tilt))
    picture, truth = draw(camera, corr_pixels=30.0)
    read = read_profile_image(save(tmp_path / "edge.png", picture), PIXEL)
    found = surface_statistics(read)
    exact = surface_statistics(Profile(truth.x[::8], truth.z[::8]))
    # Eight others scattered by 1.0 % in slope, 0.4 % in height
    assert found.slope_rms.value == pytest.approx(exact.slope_rms.value, rel=0.035)
    assert found.height_rms.value == pytest.approx(exact.height_rms.value, rel=0.015)
    assert found.noise_rms.value == pytest.approx(read.noise_rms, rel=0.1)
    # Every column is a point, its noise its own
    assert read.located.grain.size == 1
    step = np.diff(read.located.x).min()
    assert step == pytest.approx(PIXEL / np.cos(np.deg2rad(tilt)), rel=1e-3)


@pytest.mark.skipif("PBRDF_SHARED" not in os.environ, reason="PBRDF_SHARED is not set")
@pytest.mark.slow
def test_twelve_edges_of_an_electron_micrograph():
    path = Path(os.environ["PBRDF_SHARED"]) / "data/images/sem_lines_0.1176um_px.jpg"
    profiles = read_profile_images(path, scale_bar_um=120)
    assert len(profiles) == 12
    assert profiles[0].um_per_pixel == pytest.approx(0.1176, rel=0.005)
    across = np.array([p.pixels[:, 1].mean() for p in profiles]) * 0.1176
    # The scan's scale drifts steadily by 0.6 % from left to right
    assert_allclose(np.diff(across[::2]), 20.5, atol=0.2)
    assert_allclose(np.diff(across[1::2]), 20.5, atol=0.2)
    for profile in profiles:
        # Nearly straight: the pixel noise, 0.13 um here, is not reported as roughness
        assert profile.noise_rms > 0.1
        assert profile.z.std() < 0.08
        assert slope_rms(profile.x, profile.z) < 0.06


@pytest.mark.skipif("PBRDF_SHARED" not in os.environ, reason="PBRDF_SHARED is not set")
@pytest.mark.slow
def test_drop_photograph_is_no_edge():
    path = Path(os.environ["PBRDF_SHARED"]) / "data/images/sessile_drop.png"
    with pytest.raises(DataFileError, match="expected"):
        read_profile_image(path, PIXEL)


def test_a_width_that_a_fit_does_not_find_is_tried_again():
    # A JPEG with damaged coefficients: the first fit of its step went round without an end
    case = Path(__file__).parents[1] / "cases" / "surface" / "edge_damaged.jpg"
    found = read_profile_image(case, um_per_pixel=0.5)
    assert 0.0 < found.blur < 1.0


def test_an_edge_unclear_every_few_columns_is_refused_and_not_interpolated():
    """A damaged BMP was taken, and NumPy had no column to interpolate between."""
    from data_io.micrograph.edges import Trace
    from data_io.micrograph.refusals import fault_of

    columns = np.arange(100)
    quality = np.where(columns % 5 == 0, 0.1, 0.99)
    trace = Trace(
        columns=columns,
        height=np.full(100, 20.0),
        quality=quality,
        overhang=np.zeros(100, dtype=bool),
        grain=np.zeros((2, 100)),
        step_width=1.0,
        upside_down=False,
    )
    assert "every few columns" in fault_of(trace)
