"""The clear sky with all orders of scattering, by routes that share nothing with it."""

from math import cos, pi, sin

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

import pbrdf
from pbrdf.errors import AccuracyWarning
from pbrdf.signatures import ClearSky, RayleighSky, Sun, rayleigh_optical_depth
from pbrdf.signatures.multiple import Air, scatter

GAUSS = np.polynomial.legendre.leggauss(200)


def upward(air: Air, mu: float, azimuth: float) -> np.ndarray:
    """I, Q, U leaving the top at an azimuth from the sun, from the sources of the light.

    The matrix of dipoles by its definition: field components along unit vectors.
    """
    x, weight = 0.5 + 0.5 * GAUSS[0], 0.5 * GAUSS[1]
    # Crowded at the top, from where most light leaves at low mu
    x, weight = x**2, weight * 2 * x
    depth = air.depth * x**3 * (10 - 15 * x + 6 * x * x)
    weight = weight * air.depth * 30 * (x * (1 - x)) ** 2
    light = air.at(x) + np.exp(-depth / air.cos_sun)[:, None] * air.sun
    a, b, c, d = (weight * np.exp(-depth / mu) / mu) @ light
    tensor = np.array([[(a + d) / 2, 0, c], [0, (a - d) / 2, 0], [c, 0, b]])
    sight = np.array(
        [np.sqrt(1 - mu**2) * cos(azimuth), np.sqrt(1 - mu**2) * sin(azimuth), mu]
    )
    e_s = np.array([-sin(azimuth), cos(azimuth), 0.0])
    frame = np.stack([e_s, np.cross(sight, e_s)])
    (ss, sp), (_, pp) = 3 * air.dipole / (8 * pi) * frame @ tensor @ frame.T
    even = (1 - air.dipole) / (4 * pi) * (a + b)
    ground = air.ground * np.exp(-air.depth / mu)
    return np.array([ss + pp + even + ground, ss - pp, 2 * sp])


@pytest.mark.parametrize(
    ("mu", "azimuth", "table"),
    [
        (0.02, 30.0, [0.39444956, -0.06485313, 0.04390364]),
        (0.92, 60.0, [0.05643322, -0.01979730, 0.03822653]),
    ],
)
def test_the_tables_of_natraj(mu: float, azimuth: float, table: list[float]) -> None:
    """Natraj, Li and Yung (2009): optical depth 0.5, mu0 0.2, black ground, flux pi.

    Light that leaves the top comes from the same sources as that at the ground. Azimuths
    of the table are counted from the plane of forward scattering, the sun's from the sun.
    """
    found = pi * upward(scatter(0.5, 0.2, 1.0, 0.0), mu, np.deg2rad(180 - azimuth))
    assert_allclose(found, table, atol=1e-8)


@pytest.mark.parametrize("depth", [0.05, 0.5, 3.0])
@pytest.mark.parametrize(("depolarisation", "albedo"), [(0.0, 0.0), (0.3, 0.6), (0.1, 1.0)])
def test_no_light_is_lost(depth: float, depolarisation: float, albedo: float) -> None:
    """What comes in from the sun goes into the ground or out at the top."""
    mu_sun = cos(0.9)
    gamma = depolarisation / (2 - depolarisation)
    air = scatter(depth, mu_sun, (1 - gamma) / (1 + 2 * gamma), albedo)
    mu, weight = np.polynomial.legendre.leggauss(40)
    mu, weight = (0.5 + 0.5 * mu) ** 2, 0.5 * weight * (1 + mu)
    azimuths = 2 * pi * np.arange(8) / 8
    leaving = np.array([[upward(air, m, phi)[0] for phi in azimuths] for m in mu])
    out = 2 * pi * (weight * mu) @ leaving.mean(-1)
    down = mu_sun * np.exp(-depth / mu_sun) + air.diffuse
    assert_allclose(out + (1 - albedo) * down, mu_sun, rtol=1e-6)
    assert_allclose(air.ground, albedo / pi * down, rtol=1e-12)
    # The irradiance is that of the radiances
    sky = ClearSky(
        sun=Sun(theta=0.9), optical_depth=depth, depolarisation=depolarisation,
        ground_albedo=albedo,
    )  # fmt: skip
    theta, phi = np.meshgrid(np.arccos(mu), azimuths, indexing="ij")
    seen = 2 * pi * (weight * mu) @ sky.stokes(theta, phi, None)[..., 0].mean(-1)
    assert_allclose(sky.irradiance(), seen, rtol=1e-6)


def test_thin_air_scatters_once() -> None:
    """Twice scattered light is of the order depth ln depth, and no larger."""
    sun = Sun(theta=0.8, phi=0.4, irradiance=900.0)
    theta, phi = [0.3, 1.2, 1.5, 0.0], [2.0, -1.0, 0.45, 0.7]
    for depth in (1e-3, 1e-5):
        every, once = (
            kind(sun=sun, optical_depth=depth, depolarisation=0.1).stokes(theta, phi, None)
            for kind in (ClearSky, RayleighSky)
        )
        more = np.abs(every - once) / once[:, :1]
        assert more[:, 0].max() < 10 * depth * -np.log10(depth)
        assert (every[:, 0] > once[:, 0]).all()


def test_the_way_of_the_light_can_be_turned_round() -> None:
    """Reciprocity of transmission: I / mu0 is the same with sun and sight exchanged."""
    for one, other, dphi in [(0.3, 1.1, 0.8), (0.0, 0.7, 2.0), (1.3, 0.9, 2.6)]:
        first, second = (
            ClearSky(sun=Sun(theta=sun, phi=0.5), optical_depth=0.7).stokes(
                sight, 0.5 + dphi, None
            )[0]
            / cos(sun)
            for sun, sight in ((one, other), (other, one))
        )
        assert_allclose(first, second, rtol=1e-7)


def shot(depth: float, zenith: float, rho: float, albedo: float, seed: int) -> tuple:
    """Light at the ground by a Monte Carlo of Stokes vectors: mean and standard error.

    Each scattering turns Q and U into its plane, multiplies with the matrix of Rayleigh,
    and is looked at from the directions of SIGHTS. The sun is at azimuth 0.3.
    """
    rng = np.random.default_rng(seed)
    count = 60_000
    k = np.tile(-unit(zenith, 0.3), (count, 1))
    stokes = np.tile([1.0, 0.0, 0.0], (count, 1))
    optical = -np.log1p(-rng.random(count)) * cos(zenith)
    seen = np.zeros((len(SIGHTS), count, 3))
    alive = np.arange(count)
    flux = cos(zenith)
    for _ in range(40):
        down = optical >= depth
        # Lambertian ground: no polarisation, uniform in the square of the sine
        hit = np.flatnonzero(down)
        mu, phi = np.sqrt(rng.random(hit.size)), 2 * pi * rng.random(hit.size)
        side = np.sqrt(1 - mu**2)
        k[hit] = np.stack([side * np.cos(phi), side * np.sin(phi), mu], -1)
        stokes[hit] = np.stack([albedo * stokes[hit, 0], 0 * mu, 0 * mu], -1)
        optical[hit] = depth
        air = np.flatnonzero(~down)
        for row, (theta, azimuth) in zip(seen, SIGHTS, strict=True):
            out = np.tile(-unit(theta, azimuth), (air.size, 1))
            dimmed = np.exp(-(depth - optical[air]) / cos(theta)) / cos(theta)
            light = scattered(k[air], out, stokes[air], rho) * dimmed[:, None]
            row[alive[air]] += flux * light / (4 * pi)
        mu, phi = 2 * rng.random(air.size) - 1, 2 * pi * rng.random(air.size)
        side = np.sqrt(1 - mu**2)
        new = np.stack([side * np.cos(phi), side * np.sin(phi), mu], -1)
        stokes[air] = scattered(k[air], new, stokes[air], rho)
        k[air] = new
        optical = optical + np.log1p(-rng.random(optical.size)) * k[:, 2]
        keep = (optical > 0) & (stokes[:, 0] > 0)
        alive, k, stokes, optical = alive[keep], k[keep], stokes[keep], optical[keep]
    return seen.mean(1), seen.std(1) / np.sqrt(count)


def unit(theta: float, phi: float) -> np.ndarray:
    return np.array([sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)])


def turned(
    stokes: np.ndarray, k: np.ndarray, old: np.ndarray, new: np.ndarray
) -> np.ndarray:
    """Stokes vectors in axes whose first is `new`, both first axes across k."""
    cosine = (old * new).sum(-1)
    sine = (np.cross(k, old) * new).sum(-1)
    c2, s2 = cosine**2 - sine**2, 2 * sine * cosine
    i, q, u = stokes.T
    return np.stack([i, c2 * q + s2 * u, c2 * u - s2 * q], -1)


def right(k: np.ndarray) -> np.ndarray:
    """z x k, as long as 1."""
    across = np.stack([-k[:, 1], k[:, 0], 0 * k[:, 0]], -1)
    return across / np.linalg.norm(across, axis=-1, keepdims=True)


def scattered(k: np.ndarray, out: np.ndarray, stokes: np.ndarray, rho: float) -> np.ndarray:
    """Matrix of Rayleigh with a depolarisation factor, mean over all directions 1."""
    cosine = (k * out).sum(-1)
    normal = np.cross(k, out)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    i, q, u = turned(stokes, k, right(k), normal).T
    part = (1 - rho) / (1 + rho / 2)
    c2 = cosine**2
    # Field across the plane is 1, along it cos; Q counts across
    i_out = 0.75 * part * ((1 + c2) * i + (1 - c2) * q) + (1 - part) * i
    q_out = 0.75 * part * ((1 - c2) * i + (1 + c2) * q)
    u_out = 0.75 * part * 2 * cosine * u
    return turned(np.stack([i_out, q_out, u_out], -1), out, normal, right(out))


SIGHTS = [(0.3, 2.1), (0.9, 0.9), (1.3, -1.2)]


@pytest.mark.parametrize(
    ("depth", "rho", "albedo", "seed"), [(0.4, 0.0, 0.0, 1), (1.0, 0.2, 0.7, 2)]
)
def test_photons_shot_one_by_one(
    depth: float, rho: float, albedo: float, seed: int
) -> None:
    """18 numbers by Monte Carlo; the worst of them within 4 errors (once in 900 tests)."""
    zenith = 0.8
    mean, stderr = shot(depth, zenith, rho, albedo, seed)
    sun = Sun(theta=zenith, phi=0.3)
    every, once = (
        kind(sun=sun, optical_depth=depth, depolarisation=rho, **more)
        for kind, more in ((ClearSky, {"ground_albedo": albedo}), (RayleighSky, {}))
    )
    theta, phi = np.array(SIGHTS).T
    light = every.stokes(theta, phi, None)[:, :3]
    far = np.abs(light - mean) / stderr
    assert far.max() < 4.0
    # The test tells orders of scattering apart
    assert (np.abs(light - once.stokes(theta, phi, None)[:, :3]) / stderr).max() > 12


def neutral(depth: float, sun_deg: float) -> dict[str, float]:
    """Degrees of the neutral points from the sun, or from the point opposite to it."""
    sky = ClearSky(sun=Sun(theta=np.deg2rad(sun_deg), phi=1.0), optical_depth=depth)

    def q(view: float) -> float:
        """Q in the plane of the sun, zenith angles positive on its side. [deg]"""
        side = 1.0 if view >= 0 else 1.0 + pi
        return float(sky.stokes(np.deg2rad(abs(view)), side, None)[1])

    grid = np.arange(-89.75, 89.76, 0.5)
    sides = np.where(grid >= 0, 1.0, 1.0 + pi)
    values = sky.stokes(np.deg2rad(np.abs(grid)), sides, None)[:, 1]
    turns = np.flatnonzero(np.sign(values[1:]) != np.sign(values[:-1]))
    found = {}
    for turn in turns:
        view = float(brentq(q, grid[turn], grid[turn + 1]))
        if view > sun_deg:
            found["Brewster"] = view - sun_deg
        elif view > sun_deg - 90:
            found["Babinet"] = sun_deg - view
        else:
            found["Arago"] = view + 180 - sun_deg
    return found


def test_neutral_points_are_where_they_were_found() -> None:
    """Babinet and Brewster 15 to 20 degrees from a sun in mid sky, Arago about 20.

    As seen by their discoverers, at 0.55 um and less; they close in on the sun as it rises.
    Light that is scattered once has none.
    """
    depth = float(rayleigh_optical_depth(0.5))
    middle, low = neutral(depth, 60.0), neutral(depth, 80.0)
    assert set(middle) == {"Babinet", "Brewster"}
    assert 14.5 < middle["Babinet"] < 20
    assert 15 < middle["Brewster"] < 20
    assert set(low) == {"Babinet", "Arago"}
    assert 15 < low["Babinet"] < 20
    assert 17 < low["Arago"] < 25
    high = neutral(depth, 20.0)
    assert 0 < high["Babinet"] < high["Brewster"] < 8
    assert neutral(2 * depth, 80.0)["Arago"] > low["Arago"] + 2


def test_a_zenith_sun_leaves_rings() -> None:
    """No azimuth is special: I of one zenith is one number, U is 0."""
    sky = ClearSky(sun=Sun(theta=0.0), optical_depth=0.3, ground_albedo=0.2)
    light = sky.stokes(0.7, np.linspace(0, 6, 7), None)
    assert_allclose(light[:, 0], light[0, 0], rtol=1e-12)
    assert_allclose(light[:, 2:], 0.0, atol=1e-15)
    # The zenith is one point: Q + iU turns as exp(2i phi), whatever the sun
    sky = ClearSky(sun=Sun(theta=0.9, phi=0.2), optical_depth=0.3)
    phi = np.array([0.2, 1.0, 2.5])
    top = sky.stokes(0.0, phi, None)
    still = (top[:, 1] + 1j * top[:, 2]) * np.exp(-2j * phi)
    assert_allclose(still, still[0], rtol=1e-12)
    assert abs(still[0]) > 0.3 * top[0, 0]


def test_pressure_thins_the_air() -> None:
    sun = Sun(theta=0.7)
    high = ClearSky(sun=sun, pressure=700.0).stokes(0.5, 1.0, 0.45)
    depth = 700.0 / 1013.25 * float(rayleigh_optical_depth(0.45))
    assert_allclose(high, ClearSky(sun=sun, optical_depth=depth).stokes(0.5, 1.0, 0.45))
    with pytest.raises(ValueError, match="pressure must be left out where optical_depth"):
        ClearSky(sun=sun, pressure=700.0, optical_depth=0.1)
    with pytest.raises(
        ValueError, match=r"pressure must lie in \(0, 1200\] hPa, got 70000"
    ):
        RayleighSky(sun=sun, pressure=70000.0)


def test_what_is_no_clear_sky_is_refused_or_told() -> None:
    sun = Sun(theta=0.7)
    with pytest.raises(ValueError, match=r"optical_depth must be <= 10 \[1\], got 30"):
        ClearSky(sun=sun, optical_depth=30.0).stokes(0.5, 1.0, None)
    with pytest.raises(
        ValueError, match=r"ground_albedo must lie in \[0, 1\] \[1\], got 3"
    ):
        ClearSky(sun=sun, optical_depth=0.3, ground_albedo=3.0)
    assert ClearSky(sun=sun, optical_depth=0.5).error() < 1e-6
    with pytest.warns(AccuracyWarning, match="has an air mass of 57.3 and that of the E"):
        low = ClearSky(sun=Sun(theta=np.deg2rad(89)), optical_depth=8.0)
    with pytest.warns(AccuracyWarning, match="under a sun 1 degrees high through"):
        low.stokes(0.5, 1.0, None)
    # Kasten and Young: 5.60 at 80 degrees, where plane air has 5.76
    ClearSky(sun=Sun(theta=np.deg2rad(80)), optical_depth=0.1)
    with pytest.warns(AccuracyWarning, match=r"mass of 11\.5 and that of the Earth 10\.3"):
        RayleighSky(sun=Sun(theta=np.deg2rad(85)), optical_depth=0.1)


def test_light_that_is_counted_twice_is_told() -> None:
    white = pbrdf.MicrofacetModel(
        pbrdf.Material(1.5), 0.2, specular_gain=0.0, diffuse_albedo=0.3
    )
    bare = Sun(theta=0.7)
    with pytest.warns(AccuracyWarning, match=r"depth of 0, .* of 0\.2: 23 % of the direct"):
        pbrdf.signature(white, 0.4, sun=bare, sky=ClearSky(sun=bare, optical_depth=0.2))
    half = Sun(theta=0.7, optical_depth=([0.4, 0.6], [0.4, 0.1]))
    with pytest.warns(AccuracyWarning, match=r"Give Sun\(optical_depth=0\.3\)"):
        pbrdf.signature(
            white, 0.4, wavelength=[0.4, 0.6], sun=half,
            sky=RayleighSky(sun=half, optical_depth=0.3),
        )  # fmt: skip


def test_a_plate_under_sun_and_sky_over_ground_like_it() -> None:
    """A white plate sends up what falls on it; spectra of the ground are read."""
    sun = Sun(theta=0.7, phi=0.3, optical_depth=0.2)
    ground = ([0.4, 0.6], [0.2, 0.4])
    sky = ClearSky(sun=sun, optical_depth=0.2, ground_albedo=ground)
    white = pbrdf.MicrofacetModel(
        pbrdf.Material(1.5), 0.2, specular_gain=0.0, diffuse_albedo=0.3
    )
    seen = pbrdf.signature(white, 0.4, wavelength=0.5, sun=sun, sky=sky, rel_error=1e-4)
    gamma = 0.0279 / (2 - 0.0279)
    air = scatter(0.2, cos(0.7), (1 - gamma) / (1 + 2 * gamma), 0.3)
    assert_allclose(seen.radiance.sel(stokes="I"), air.ground, rtol=1e-4)
