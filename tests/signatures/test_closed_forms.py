"""Signatures with an answer on paper: plates, mirrors, skies, frames and signs."""

from math import acos, cos, exp, pi, sin

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

import pbrdf
from pbrdf import Material, MicrofacetModel
from pbrdf.errors import AccuracyWarning
from pbrdf.signatures import (
    ClearSky,
    OvercastSky,
    RayleighSky,
    SkyTable,
    SmoothSurface,
    Sun,
    ThermalSky,
    black_body,
    contrast,
    image_axes,
)

WHITE = MicrofacetModel(Material(1.5), 0.2, specular_gain=0.0, diffuse_albedo=0.8)
PAINT = MicrofacetModel(Material(1.45, 0.1), 0.25, diffuse_albedo=0.1)


def fresnel(incidence: float, index: complex) -> np.ndarray:
    """Mueller matrix of a plane from the amplitudes of the book, Q > 0 along s."""
    refracted = np.sqrt(1 - (sin(incidence) / index) ** 2)
    r_s = (cos(incidence) - index * refracted) / (cos(incidence) + index * refracted)
    r_p = (index * cos(incidence) - refracted) / (index * cos(incidence) + refracted)
    a, b = (abs(r_s) ** 2 + abs(r_p) ** 2) / 2, (abs(r_s) ** 2 - abs(r_p) ** 2) / 2
    c = r_s * np.conj(r_p)
    return np.array(
        [[a, b, 0, 0], [b, a, 0, 0], [0, 0, c.real, -c.imag], [0, 0, c.imag, c.real]]
    )


def test_a_lambertian_plate_under_the_sun() -> None:
    sun = Sun(theta=1.0, phi=0.7, irradiance=900.0, optical_depth=0.3)
    seen = pbrdf.signature(WHITE, [0.0, 0.5, 1.2], phi_s=[0.0, 2.0], sun=sun)
    expected = 0.8 / pi * 900.0 * exp(-0.3 / cos(1.0)) * cos(1.0)
    assert seen.radiance.dims == ("theta_s", "phi_s", "stokes")
    # The mean cosine over the disc is lower by half_angle^2 / 4
    assert_allclose(seen.radiance.sel(stokes="I"), expected, rtol=1e-5)
    assert_allclose(seen.radiance.sel(stokes=["Q", "U", "V"]), 0.0, atol=1e-9)


@pytest.mark.parametrize(("horizon", "mean"), [(1.0, 1.0), (1 / 3, 7 / 9)])
def test_a_lambertian_plate_under_clouds(horizon: float, mean: float) -> None:
    """The irradiance of Moon and Spencer's sky is 7/9 pi of its zenith radiance."""
    sky = OvercastSky(radiance=30.0, horizon=horizon)
    seen = pbrdf.signature(WHITE, 0.6, sky=sky)
    assert_allclose(seen.radiance.sel(stokes="I"), 0.8 * mean * 30.0, rtol=1e-6)


def test_the_sky_and_the_sun_share_what_comes_from_above() -> None:
    """Downward diffuse light of one scattering, by its own integral over the layer."""
    depth, zenith = 0.2, 0.9
    sky = RayleighSky(sun=Sun(theta=zenith), optical_depth=depth, depolarisation=0.0)
    seen = pbrdf.signature(WHITE, 0.3, sky=sky)
    mu_sun = cos(zenith)

    def flux(mu: float) -> float:
        """Flux [1] per cosine, phase function averaged over azimuth."""
        mean_cos2 = (mu * mu_sun) ** 2 + 0.5 * (1 - mu**2) * (1 - mu_sun**2)
        phase = 0.75 * (1 + mean_cos2)
        source, _ = quad(
            lambda t: exp(-t / mu_sun) * exp(-(depth - t) / mu) / mu, 0.0, depth
        )
        return 2 * pi * mu * phase / (4 * pi) * source

    expected, _ = quad(flux, 1e-9, 1.0, epsabs=1e-10)
    assert_allclose(seen.radiance.sel(stokes="I"), 0.8 / pi * expected, rtol=1e-5)


@pytest.mark.parametrize("depolarisation", [0.0, 0.0279, 0.2])
def test_polarisation_of_the_sky_over_the_scattering_angle(depolarisation: float) -> None:
    """At right angles (1 - rho)/(1 + rho); the field lies across the scattering plane."""
    sun = Sun(theta=0.8, phi=0.4)
    sky = RayleighSky(sun=sun, optical_depth=0.1, depolarisation=depolarisation)
    to_sun = np.array([sin(0.8) * cos(0.4), sin(0.8) * sin(0.4), cos(0.8)])
    for theta, phi in [(0.3, 2.0), (1.2, -1.0), (1.5, 0.45), (0.77, 2.2)]:
        to_sky = np.array([sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)])
        angle = acos(to_sun @ to_sky)
        i, q, u, v = sky.stokes(theta, phi, None)
        # Light along the scattering plane over that across it: rho at right angles
        parallel = cos(angle) ** 2 + depolarisation * sin(angle) ** 2
        expected = (1 - parallel) / (1 + parallel)
        assert_allclose(np.hypot(q, u) / i, expected, rtol=1e-9)
        assert v == 0.0
        # By hand: right is z x k, up is k x right, seen by who looks at the sky
        right = np.cross([0, 0, 1.0], -to_sky)
        right /= np.linalg.norm(right)
        up = np.cross(-to_sky, right)
        across = np.cross(to_sun, to_sky)
        turn = np.arctan2(across @ up, across @ right)
        assert_allclose([q, u], np.hypot(q, u) * np.array([cos(2 * turn), sin(2 * turn)]))


def test_a_mirror_turns_the_field_of_the_sky_as_a_conductor_does() -> None:
    """Fields in space: across the plane through the sun, then E' = 2 (E.z) z - E."""
    sun = Sun(theta=0.6, phi=0.3)
    sky = RayleighSky(sun=sun, optical_depth=0.15, depolarisation=0.0)
    to_sun = np.array([sin(0.6) * cos(0.3), sin(0.6) * sin(0.3), cos(0.6)])
    across = np.array([0.3, -0.8, 0.55])
    across /= np.linalg.norm(across)
    # A point of the sky at right angles to the sun, above the horizon
    to_sky = np.cross(to_sun, np.cross(across, to_sun))
    to_sky *= np.sign(to_sky[2]) / np.linalg.norm(to_sky)
    field = np.cross(to_sun, to_sky)
    mirrored = 2 * field[2] * np.array([0, 0, 1.0]) - field
    sight = to_sky * [-1, -1, 1]
    right = np.cross([0, 0, 1.0], sight)
    right /= np.linalg.norm(right)
    along_right, along_up = mirrored @ right, mirrored @ np.cross(sight, right)
    seen = pbrdf.signature(
        SmoothSurface(Material.mirror()),
        acos(sight[2]),
        phi_s=np.arctan2(sight[1], sight[0]),
        sky=sky,
    )
    i, q, u, _ = seen.radiance.to_numpy()
    assert i > 0.01
    assert min(abs(q), abs(u)) > 0.1 * i
    assert_allclose(q / i, along_right**2 - along_up**2, atol=1e-9)
    assert_allclose(u / i, 2 * along_right * along_up, atol=1e-9)


def test_a_mirror_shows_a_point_of_the_sky_by_the_matrix_of_the_book() -> None:
    index = 1.6 + 0.4j
    sky = RayleighSky(sun=Sun(theta=1.1, phi=0.3), optical_depth=0.15)
    mirror = SmoothSurface(Material(1.6, 0.4))
    for theta, phi in [(0.4, 1.3), (1.1, -2.0), (0.9, 2.9)]:
        seen = pbrdf.signature(mirror, theta, phi_s=phi, sky=sky)
        light = sky.stokes(theta, phi + pi, None)
        assert abs(light[2]) > 0.05 * light[0]
        assert_allclose(seen.radiance, fresnel(theta, index) @ light, rtol=1e-10)


def test_a_mirror_shows_the_disc_of_the_sun() -> None:
    sun = Sun(theta=0.7, phi=0.2, irradiance=1000.0)
    mirror = SmoothSurface(Material(1.5))
    inside = pbrdf.signature(mirror, 0.7 + 0.004, phi_s=0.2 + pi, sun=sun)
    outside = pbrdf.signature(mirror, 0.7 + 0.006, phi_s=0.2 + pi, sun=sun)
    disc = 1000.0 / (pi * sin(sun.half_angle) ** 2)
    assert_allclose(inside.radiance, disc * fresnel(0.704, 1.5)[:, 0], rtol=1e-9)
    assert_allclose(outside.radiance, 0.0)


def test_a_warm_mirror_emits_what_it_does_not_reflect_along_p() -> None:
    seen = pbrdf.signature(
        SmoothSurface(Material(1.5)), 1.0, wavelength=10.0, temperature=300.0
    )
    matrix = fresnel(1.0, 1.5)
    expected = black_body(10.0, 300.0) * np.array([1 - matrix[0, 0], -matrix[0, 1], 0, 0])
    assert expected[1] < 0
    assert_allclose(seen.radiance, expected, rtol=1e-10, atol=1e-14)
    assert_allclose(seen.emitted, seen.radiance)


def test_planck_by_wien_and_stefan_boltzmann() -> None:
    total, _ = quad(lambda w: float(black_body(w, 300.0)), 1.0, 2000.0, limit=200)
    assert_allclose(total, 5.670374419e-8 * 300.0**4 / pi, rtol=2e-6)
    waves = np.linspace(9.0, 10.3, 1301)
    assert_allclose(waves[black_body(waves, 300.0).argmax()], 2897.771955 / 300, atol=1e-3)


def test_the_planck_sun_brings_the_solar_constant() -> None:
    """Nominal irradiance 1361 W/m^2 (IAU 2015 resolution B3), by the size of the disc."""
    sun = Sun.planck(theta=0.0)
    total, _ = quad(lambda w: sun.above(w), 0.05, 100.0, limit=400)
    assert_allclose(total, 1361.0, rtol=1e-3)


def test_a_mirrored_sun_flips_u_and_v() -> None:
    left, right = (
        pbrdf.signature(
            PAINT,
            0.7,
            sun=(sun := Sun(theta=0.8, phi=azimuth, optical_depth=0.2)),
            sky=RayleighSky(sun=sun, optical_depth=0.2),
            rel_error=1e-5,
        )
        for azimuth in (2.0, -2.0)
    )
    assert_allclose(left.radiance[:2], right.radiance[:2], rtol=1e-4)
    assert_allclose(left.radiance[2:], -right.radiance[2:], rtol=1e-3, atol=1e-6)
    assert abs(left.radiance[2]) > 0.01 * left.radiance[0]


@pytest.mark.parametrize(
    "source",
    [
        PAINT,
        MicrofacetModel(Material(1.3, 2.0), (0.1, 0.3)),
        SmoothSurface(Material(1.5, 0.2)),
        pytest.param(
            pbrdf.WaveModel(Material(1.5, 0.5), height_rms=0.4, corr_length=6.0),
            marks=pytest.mark.slow,
        ),
    ],
    ids=["paint", "brushed", "smooth", "waves"],
)
def test_furnace_of_models(source: object) -> None:
    """Reflection comes from the sky forward, emission by reciprocity: they close."""
    sky = ThermalSky(temperature=310.0)
    seen = pbrdf.signature(
        source, 0.9, phi_s=0.6, wavelength=10.0, sky=sky, temperature=310.0, rel_error=1e-5
    )
    body = float(black_body(10.0, 310.0))
    assert_allclose(seen.radiance, [body, 0, 0, 0], atol=1e-4 * body)
    # Neither part is trivial
    assert seen.emissivity[0] < 0.99
    assert abs(seen.reflected_sky[1]) > 1e-3 * body


def test_image_axes_are_those_of_the_meridian_for_an_upright_camera() -> None:
    sky = RayleighSky(sun=Sun(theta=1.1, phi=0.3), optical_depth=0.15)
    mirror = SmoothSurface(Material(1.6, 0.4))
    seen = pbrdf.signature(mirror, [0.4, 1.0], phi_s=[0.1, 1.3], sky=sky)
    upright = image_axes(seen)
    assert_allclose(upright.radiance, seen.radiance, rtol=1e-12, atol=1e-15)
    # A camera turned by 90 degrees: rows and columns change places
    from pbrdf.conventions import direction, meridian_frame

    one = seen.isel(theta_s=1, phi_s=1)
    e_s, e_p = meridian_frame(direction(1.0, 1.3))
    rolled = image_axes(one, up=e_s)
    assert_allclose(rolled.radiance, one.radiance * [1, -1, -1, 1], rtol=1e-9, atol=1e-15)
    # By 45 degrees with up half way from right to up: rows lie along e_s - e_p
    rolled = image_axes(one, up=e_s + e_p)
    i, q, u, v = one.radiance.to_numpy()
    assert_allclose(rolled.radiance, [i, -u, q, v], rtol=1e-9, atol=1e-15)
    with pytest.raises(ValueError, match="Turn it once"):
        image_axes(rolled)


def test_contrast_against_noise_drawn_at_random() -> None:
    sun = Sun(theta=0.8, phi=pi, irradiance=1000.0)
    dry = pbrdf.signature(PAINT, [0.5, 0.9], sun=sun)
    wet = pbrdf.signature(PAINT.with_parameters(slope_rms=0.3), [0.5, 0.9], sun=sun)
    noise = 0.5
    found = contrast(wet, dry, noise=noise)
    assert_allclose(found.difference, wet.radiance - dry.radiance)
    assert_allclose(found.ratio, wet.radiance[:, 0] / dry.radiance[:, 0])
    # A camera of four polarisers, many pixels
    rng = np.random.default_rng(3)
    spreads = {"I": [], "Q": [], "DOLP": []}
    for seen in (wet, dry):
        i, q, u, _ = seen.radiance.isel(theta_s=1).to_numpy()
        signal = 0.5 * np.array([i + q, i + u, i - q, i - u])
        c0, c45, c90, c135 = signal[:, None] + noise * rng.normal(size=(4, 100_000))
        whole = 0.5 * (c0 + c45 + c90 + c135)
        spreads["I"].append(whole.std())
        spreads["Q"].append((c0 - c90).std())
        spreads["DOLP"].append((np.hypot(c0 - c90, c45 - c135) / whole).std())
    at = found.isel(theta_s=1)
    change = {
        "I": at.difference[0],
        "Q": at.difference[1],
        "DOLP": at.dolp_difference,
    }
    for name, pair in spreads.items():
        expected = abs(float(change[name])) / np.hypot(*pair)
        assert_allclose(at.detectability.sel(measure=name), expected, rtol=0.02)


def test_a_table_of_the_sky_stands_in_for_its_model() -> None:
    sky = RayleighSky(sun=Sun(theta=0.8, phi=0.3), optical_depth=0.2)
    theta = np.deg2rad(np.arange(0, 90, 1.0))
    phi = np.deg2rad(np.arange(0, 360, 4.0))
    grid = np.meshgrid(theta, phi, indexing="ij")
    table = SkyTable(theta=theta, phi=phi, values=sky.stokes(*grid, None))
    at = np.array([0.4033, 1.2022]), np.array([1.7, -0.03])
    assert_allclose(table.stokes(*at, None), sky.stokes(*at, None), rtol=5e-3, atol=1e-5)


def test_tables_that_leave_a_part_of_the_sky_out_are_refused() -> None:
    theta = np.deg2rad([0.0, 45.0, 90.0])

    def table(phi_deg: object, **change: object) -> SkyTable:
        values = np.tile([1.0, 0.0, 0.0, 0.0], (3, np.size(phi_deg), 1))
        given = {"theta": theta, "phi": np.deg2rad(phi_deg), "values": values}
        return SkyTable(**given | change)

    for phi_deg, left in ((np.arange(0, 181, 30.0), "180"), ([0.0, 90.0], "270")):
        with pytest.raises(ValueError, match=f"leaves {left} out"):
            table(phi_deg)
    # Uneven azimuths all around, and one for all sides
    table([-170.0, 0.0, 10.0, 20.0, 80.0])
    table([40.0])
    light = np.tile([1.0, 0.0, 0.0, 0.0], (3, 1, 1))
    light[1, 0] = [-1.0, 0.0, 0.0, 0.0]
    with pytest.raises(ValueError, match=r"I >= 0, got .* at theta 45, phi 40 degrees"):
        table([40.0], values=light)
    light[1, 0] = [1.0, 0.9, 0.9, 0.0]
    with pytest.raises(ValueError, match=r"within I, got .* at theta 45, phi 40 degrees"):
        table([40.0], values=light)


def test_the_zenith_of_a_table_is_one_point() -> None:
    """Right where Q + iU turns twice with the azimuth, as in the model; told otherwise."""
    sky = RayleighSky(sun=Sun(theta=1.2, phi=0.3), optical_depth=0.2)
    theta, phi = np.deg2rad([0.0, 40.0, 85.0]), np.deg2rad(np.arange(10, 370, 20.0))
    values = sky.stokes(*np.meshgrid(theta, phi, indexing="ij"), None)
    SkyTable(theta=theta, phi=phi, values=values)
    still = values.copy()
    still[0] = values[0, 0]
    other_way = values * [1.0, 1.0, -1.0, 1.0]
    brighter = values.copy()
    brighter[0, 3:6] *= 1.5
    for wrong in (still, other_way, brighter):
        with pytest.warns(AccuracyWarning, match="though it is one point"):
            SkyTable(theta=theta, phi=phi, values=wrong)
    with pytest.warns(AccuracyWarning, match="though it is one point"):
        SkyTable(theta=theta, phi=phi[:1], values=values[:, :1])


def test_the_beam_of_grooves_depends_on_the_azimuth() -> None:
    """Disc of the sun in brushed metal: the mean field of that azimuth, not of 0."""
    grooves = pbrdf.WaveModel(Material(1.2, 4.0), height_rms=0.06, corr_length=(0.6, 3.0))
    sun = Sun(theta=0.9, phi=1.2 - pi)
    seen = pbrdf.signature(grooves, 0.9, phi_s=1.2, wavelength=0.6, sun=sun)
    along, beam = (grooves.coherent(0.9, 0.6, phi_i=phi)[:, 0] for phi in (0.0, 1.2))
    assert abs(beam - along)[1] > 0.03
    assert abs(beam[2]) > 0.01
    disc = pi * sin(sun.half_angle) ** 2
    assert_allclose(seen.radiance * disc, beam, rtol=0, atol=1e-3)


class Grooved:
    """A surface of no wavelength whose BRDF goes as 1 + cos(2 phi_i)/2."""

    def brdf(
        self, theta_i: object, theta_s: object, dphi: object, *, phi_i: object = 0.0
    ) -> np.ndarray:
        shape = np.broadcast_shapes(*map(np.shape, (theta_i, theta_s, dphi, phi_i)))
        found = np.zeros((*shape, 4, 4))
        found[..., 0, 0] = 0.1 * (1.0 + 0.5 * np.cos(2 * np.asarray(phi_i)))
        return found


def test_sources_of_others_are_asked_for_what_they_take() -> None:
    """The azimuth where they know it, no wavelength where they do not."""
    sun = Sun(theta=0.6, phi=0.4, irradiance=100.0)
    seen = pbrdf.signature(
        Grooved(), 0.5, phi_s=2.0, wavelength=10.0, temperature=300.0, sun=sun
    )  # fmt: skip
    lit = 10.0 * cos(0.6) * (1.0 + 0.5 * cos(0.8))
    assert_allclose(seen.reflected_sun[0], lit, rtol=1e-4)
    assert_allclose(seen.emissivity[0], 1 - 0.1 * pi * (1 + 0.5 * cos(4.0)), rtol=1e-5)


def test_sources_that_cannot_be_asked_are_named() -> None:
    class Scalar:
        def brdf(self, theta_i: object, theta_s: object, dphi: object) -> float:
            return 0.1

    waves = pbrdf.WaveModel(Material(1.5), height_rms=0.02, corr_length=2.0)
    with pytest.raises(ValueError, match=r"must return \(\.\.\., 4, 4\) Mueller matrices"):
        pbrdf.signature(Scalar(), 0.5, sun=Sun(theta=0.3))
    with pytest.raises(ValueError, match="wavelength must be given, the source depends"):
        pbrdf.signature(waves, 0.5, sun=Sun(theta=0.3))
    with pytest.raises(TypeError, match="sun must be a"):
        RayleighSky(sun=0.3)
    seen = pbrdf.signature(WHITE, 0.5, sun=Sun(theta=0.3))
    with pytest.raises(ValueError, match=r"background .* lacks radiance_stderr"):
        contrast(seen, seen.drop_vars("radiance_stderr"))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({}, "must have light"),
        ({"sun": Sun(theta=0.3), "temperature": 300.0}, "irradiance of the sun"),
        ({"temperature": 300.0}, "wavelength must be given"),
        ({"temperature": -1.0, "wavelength": 10.0}, "temperature must lie"),
        ({"sky": RayleighSky(sun=Sun(theta=0.3)), "wavelength": 4.0}, "give optical_depth"),
        ({"sun": Sun(theta=0.3), "simulation": {"n_rays": 1}}, "belongs to a Scene"),
    ],
)
def test_what_cannot_be_answered_is_named(change: dict, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        pbrdf.signature(PAINT, 0.5, **change)


def test_a_sensor_in_degrees_is_refused() -> None:
    with pytest.raises(ValueError, match="theta_s must lie in"):
        pbrdf.signature(PAINT, 30.0, sun=Sun(theta=0.3))
    with pytest.raises(ValueError, match="theta must lie in"):
        Sun(theta=60.0)


def test_a_sky_in_degrees_celsius_is_told() -> None:
    with pytest.warns(AccuracyWarning, match="7 K. Temperatures are kelvins: add 273.15"):
        ThermalSky(temperature=7.0)


def test_a_temperature_in_degrees_celsius_is_told():
    with pytest.warns(AccuracyWarning, match="temperature is 20 K.*add 273.15"):
        pbrdf.signature(PAINT, 0.5, wavelength=10.0, temperature=20.0)


def light_of_a_disc(model, view: float, azimuth: float, sun: Sun, rings: int) -> np.ndarray:
    """Stokes radiance of a disc of unit irradiance, point by point on a fine grid."""
    share = (np.arange(rings) + 0.5) / rings
    radius, turn = sun.radius * np.sqrt(share), 2 * pi * share
    # The disc about the vertical, tilted to the sun
    x = np.sin(radius)[:, None] * np.cos(turn)
    y = np.sin(radius)[:, None] * np.sin(turn)
    z = np.cos(radius)[:, None] + 0 * turn
    x, z = cos(sun.theta) * x + sin(sun.theta) * z, cos(sun.theta) * z - sin(sun.theta) * x
    zenith, phi = np.arccos(z).ravel(), sun.phi + np.arctan2(y, x).ravel()
    column = model.brdf(zenith, view, np.mod(azimuth - phi, 2 * pi))[:, :, 0]
    return (column * np.cos(zenith)[:, None]).mean(0)


@pytest.mark.parametrize(
    ("slope", "off"), [(1e-3, 0.006), (7e-4, 0.002), (7e-4, 0.006), (5e-4, 0.006)]
)
def test_glints_narrower_than_the_sun(slope: float, off: float) -> None:
    model, sun = MicrofacetModel(Material(1.5), slope), Sun(theta=0.9, phi=0.4)
    view, azimuth = 0.9 + off, 0.4 + pi + 1e-3
    seen = pbrdf.signature(model, view, phi_s=azimuth, sun=sun)
    expected = light_of_a_disc(model, view, azimuth, sun, 400)
    assert_allclose(seen.radiance.to_numpy().ravel(), expected, rtol=2e-4, atol=1e-4)
    assert float(seen.radiance_stderr.max()) < 1e-3 * float(seen.radiance.max())


@pytest.mark.parametrize("slope", [1e-4, 1e-6])
def test_glints_become_the_mirrored_sun(slope: float) -> None:
    sun = Sun(theta=0.9, phi=0.4)
    there = {"theta_s": 0.902, "phi_s": 0.4 + pi, "sun": sun}
    found = pbrdf.signature(MicrofacetModel(Material(1.5), slope), **there).radiance
    mirror = pbrdf.signature(SmoothSurface(Material(1.5)), **there, wavelength=0.5).radiance
    assert_allclose(
        found.to_numpy().ravel(), mirror.to_numpy().ravel(), rtol=1e-5, atol=1e-5
    )


def test_a_plate_gets_all_of_a_wide_sun() -> None:
    sun = Sun(theta=1.0, half_angle=0.19)
    seen = pbrdf.signature(WHITE, 0.3, sun=sun).radiance.sel(stokes="I")
    assert_allclose(seen, 0.8 * cos(1.0) / pi, rtol=1e-10)


@pytest.mark.parametrize(
    ("other", "words"),
    [
        ({"theta": 0.3}, "sun has theta 0.2, but the sun of ClearSky has 0.3"),
        ({"theta": 0.2, "phi": 4.0}, "phi 1, but the sun of ClearSky has 4"),
        ({"theta": 0.2, "irradiance": 7.0}, "irradiance 2, but the sun of ClearSky has 7"),
    ],
)
def test_skies_of_another_sun_are_told(other: dict, words: str) -> None:
    one = {"theta": 0.2, "phi": 1.0, "irradiance": 2.0, "optical_depth": 0.1}
    sky = ClearSky(sun=Sun(**{**one, **other}), optical_depth=0.1)
    with pytest.warns(AccuracyWarning, match=words):
        pbrdf.signature(PAINT, 0.6, sun=Sun(**one), sky=sky)


def test_the_ratio_of_a_dark_target_has_an_error() -> None:
    sun = Sun(theta=0.9)
    bright = pbrdf.signature(WHITE, 0.3, sun=sun)
    dark = bright.assign(radiance=0.0 * bright.radiance)
    assert np.isfinite(contrast(dark, bright).ratio_stderr).all()
