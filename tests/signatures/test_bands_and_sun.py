"""Bands of a sensor, and where the sun stands."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

import pbrdf
from data_io import write_model
from pbrdf.cli import main
from pbrdf.signatures import (
    SmoothSurface,
    Sun,
    in_band,
    read_response,
    sun_distance,
    sun_position,
)

PLATE = pbrdf.MicrofacetModel(
    pbrdf.Material(1.5), 0.2, specular_gain=0.0, diffuse_albedo=0.6
)
WAVES = [0.4, 0.45, 0.52, 0.6, 0.8]
BAND = ([0.43, 0.5, 0.55, 0.7], [0.0, 1.0, 0.4, 0.0])
SPECTRUM = ([0.4, 0.45, 0.52, 0.6, 0.8], [100.0, 900.0, 700.0, 300.0, 350.0])


def test_a_band_of_a_white_plate_in_closed_form() -> None:
    sun = Sun(theta=0.6, irradiance=SPECTRUM)
    seen = pbrdf.signature(PLATE, [0.3, 0.9], wavelength=WAVES, sun=sun)
    band = in_band(seen, BAND)

    def light(wave: float) -> float:
        return float(np.interp(wave, *SPECTRUM))

    def response(wave: float) -> float:
        return float(np.interp(wave, *BAND))

    breaks = sorted({*WAVES[1:4], *BAND[0][1:3]})
    above = quad(lambda w: light(w) * response(w), 0.43, 0.7, points=breaks)[0]
    mean = above / quad(response, 0.43, 0.7, points=breaks)[0]
    wanted = 0.6 / np.pi * np.cos(0.6) * mean
    assert_allclose(band.radiance.sel(stokes="I"), [wanted, wanted], rtol=1e-5)
    assert "wavelength" not in band.dims
    assert 0.5 < float(band.wavelength) < 0.55
    assert band.radiance.units == seen.radiance.units


def test_a_narrow_band_is_one_wavelength() -> None:
    sun = Sun(theta=0.6, irradiance=SPECTRUM)
    seen = pbrdf.signature(PLATE, 0.3, wavelength=WAVES, sun=sun)
    band = in_band(seen, ([0.5199, 0.52, 0.5201], [0.0, 1.0, 0.0]))
    assert_allclose(band.radiance, seen.radiance.sel(wavelength=0.52), rtol=1e-3)


@pytest.mark.parametrize(
    ("response", "message"),
    [
        (([0.35, 0.5], [1.0, 1.0]), "within the wavelengths of the signature, 0.4 to 0.8"),
        (([0.5, 0.9], [1.0, 1.0]), "got one from 0.5 to 0.9 um"),
        (([0.5, 0.45], [1.0, 1.0]), "rising wavelengths"),
        (([0.5, 0.6], [1.0, -1.0]), "response must be finite and >= 0, got -1"),
        (([0.5, 0.6], [0.0, 0.0]), "not be 0"),
        (([0.5, 0.6, 0.6], [1.0, 1.0, 0.0]), "each wavelength once, got 0.6 um twice"),
    ],
)
def test_responses_that_do_not_fit_are_refused(response: tuple, message: str) -> None:
    seen = pbrdf.signature(PLATE, 0.3, wavelength=WAVES, sun=Sun(theta=0.6))
    with pytest.raises(ValueError, match=message):
        in_band(seen, response)


def test_zeros_beyond_the_wavelengths_do_no_harm() -> None:
    seen = pbrdf.signature(PLATE, 0.3, wavelength=WAVES, sun=Sun(theta=0.6))
    padded = ([0.2, 0.43, 0.5, 0.55, 0.7, 1.2], [0.0, 0.0, 1.0, 0.4, 0.0, 0.0])
    assert_allclose(in_band(seen, padded).radiance, in_band(seen, BAND).radiance)


def test_responses_are_read_and_used_on_the_command_line(tmp_path: Path) -> None:
    path = tmp_path / "green.csv"
    pd.DataFrame({"wavelength_um": BAND[0], "response": BAND[1]}).to_csv(path, index=False)
    for held, wanted in zip(read_response(path), BAND, strict=True):
        assert_allclose(held, wanted)
    path.write_text("wavelength_um,transmission\n0.5,1\n")
    with pytest.raises(pbrdf.DataFileError, match=r"green.csv, column response: missing"):
        read_response(path)
    path.write_text("wavelength_um,response\n0.5,1\n0.6,x\n")
    with pytest.raises(pbrdf.DataFileError, match=r"expected numbers in all rows"):
        read_response(path)
    path.write_text("wavelength_um,response\n0.5,1\n0.6,1\n")
    write_model(PLATE, tmp_path / "model.toml")
    light = ["--sun-zenith-deg", "40", "--planck-sun", "--view-zenith-deg", "20"]
    words = ["radiance", str(tmp_path / "model.toml"), *light, "--band", str(path)]
    out = tmp_path / "seen.csv"
    assert main([*words, "--wavelength-um", "0.4,0.55,0.7", "-o", str(out)]) == 0
    row = pd.read_csv(out, comment="#")
    seen = pbrdf.signature(
        PLATE, np.deg2rad(20), wavelength=[0.4, 0.55, 0.7],
        sun=Sun.planck(theta=np.deg2rad(40), phi=np.pi),
    )  # fmt: skip
    wanted = in_band(seen, read_response(path)).radiance.sel(stokes="I")
    assert_allclose(row["I"], float(wanted), rtol=1e-6)
    assert main([*words, "--wavelength-um", "0.4,0.55", "-o", str(out), "--force"]) == 2
    assert main([*words, "--time", "2026-06-21T12:00Z", "-o", str(out), "--force"]) == 2


def test_the_sun_at_noon_of_an_equinox_and_a_solstice() -> None:
    pytest.importorskip("pvlib")
    # Berlin at its solar noon: zenith = latitude - declination, but for refraction
    latitude, longitude = np.deg2rad([52.52, 13.405])
    noon = datetime(2026, 6, 21, 11, 8, 15, tzinfo=UTC)
    theta, phi = sun_position(noon, latitude, longitude)
    assert_allclose(np.rad2deg(theta), 52.52 - 23.435, atol=0.02)
    # South is a quarter turn clockwise from east
    assert_allclose(np.rad2deg(phi), 270.0, atol=0.3)
    later, west = sun_position("2026-06-21T17:00+00:00", latitude, longitude)
    assert later > theta
    assert np.pi / 2 < west < np.pi * 1.1
    _, turned = sun_position(noon, latitude, longitude, x_azimuth=0.0)
    assert_allclose(np.mod(phi - turned, 2 * np.pi), np.pi / 2, atol=1e-9)


def test_a_reference_position_of_the_algorithm() -> None:
    """The worked example of Reda and Andreas (2004): zenith 50.11162, azimuth 194.34024.

    Theirs is at 820 hPa and 11 deg C; refraction there and here is below 0.02 degrees.
    """
    pytest.importorskip("pvlib")
    theta, phi = sun_position(
        "2003-10-17T12:30:30-07:00", np.deg2rad(39.742476), np.deg2rad(-105.1786),
        altitude=1830.14, x_azimuth=0.0,
    )  # fmt: skip
    assert_allclose(np.rad2deg(theta), 50.11162, atol=5e-3)
    assert_allclose(np.rad2deg(-phi) % 360, 194.34024, atol=1e-3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("2026-06-21T12:00", 0.9, 0.2), "time must have a time zone"),
        (("noon", 0.9, 0.2), "time must be ISO 8601"),
        (("2026-06-21T12:00Z", 52.0, 0.2), "latitude must lie in"),
        (("2026-06-21T12:00Z", 0.9, 13.0), "longitude must lie in"),
    ],
)
def test_bad_places_and_times_are_refused(arguments: tuple, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        sun_position(*arguments)


def test_a_sun_below_the_horizon_is_refused() -> None:
    pytest.importorskip("pvlib")
    with pytest.raises(ValueError, match="above the horizon"):
        sun_position("2026-06-21T00:00Z", 0.5, 0.0)


def test_the_sun_is_nearest_in_january() -> None:
    """Perihelion 0.98330 au on 3 January 2026, aphelion 1.01664 au on 6 July (USNO)."""
    pytest.importorskip("pvlib")
    near, far = sun_distance("2026-01-03T17:00Z"), sun_distance("2026-07-06T17:30Z")
    assert_allclose([near, far], [0.98330, 1.01664], atol=1e-5)
    with pytest.raises(ValueError, match="time must have a time zone"):
        sun_distance("2026-07-06T17:30")


def test_light_falls_with_the_square_of_the_distance() -> None:
    far = Sun.planck(theta=0.6, phi=0.3, distance=1.2)
    one = Sun.planck(theta=0.6, phi=0.3)
    dim, bright = (
        pbrdf.signature(PLATE, 0.4, wavelength=0.55, sun=sun).radiance[0]
        for sun in (far, one)
    )
    # Beside the mean cosine over the disc, 1 - radius^2/4
    assert_allclose(float(dim), float(bright) / 1.44, rtol=3e-6)
    # The disc is as bright as before, and smaller
    mirror, at = SmoothSurface(pbrdf.Material(1.5)), {"phi_s": 0.3 + np.pi}
    inside, outside = 0.6 + 0.9 * one.half_angle / 1.2, 0.6 + 1.1 * one.half_angle / 1.2
    kept, same, edge, dark = (
        pbrdf.signature(mirror, view, wavelength=0.55, sun=sun, **at).radiance
        for view, sun in ((inside, one), (inside, far), (outside, one), (outside, far))
    )
    assert_allclose(same, kept, rtol=1e-9, atol=1e-9)
    assert float(edge[0]) > 0
    assert not dark.any()
    assert Sun(theta=0.1, distance=1.2).above(0.5) == 1.0
    with pytest.raises(ValueError, match=r"distance must lie in .* au, got 149600000"):
        Sun(theta=0.1, distance=149.6e6)


def test_a_time_on_the_command_line_brings_the_distance(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("pvlib")
    monkeypatch.chdir(tmp_path)
    write_model(PLATE, "plate.toml")
    noon = ["--latitude-deg", "1", "--longitude-deg", "2", "--planck-sun"]
    moment = "2026-07-06T12:00Z"
    more = ["--wavelength-um", "0.5", "--time", moment, "-o", "seen.csv"]
    assert main(["radiance", "plate.toml", *noon, *more]) == 0
    theta, phi = sun_position(moment, np.deg2rad(1), np.deg2rad(2))
    sun = Sun.planck(theta=theta, phi=phi)
    expected = 0.6 / np.pi * sun.at_ground(0.5) * np.cos(theta) / sun_distance(moment) ** 2
    found = pd.read_csv("seen.csv", comment="#").I[0]
    assert_allclose(found, expected, rtol=1e-4)
    assert abs(found / expected * 1.0166**-2 - 1) > 0.03
