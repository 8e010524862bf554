"""Flat and tilted plates: every ray meets one known facet, so all 16 elements are known."""

import mpmath as mp
import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import HeightMap, Material, Scene, simulate
from tests.reference_optics import path_mueller, spherical

RAYS = 640
BINS = (31, 22)
BREWSTER = {n: float(np.rad2deg(np.arctan(n))) for n in (1.333, 1.5)}
# Glass, aluminium and a lossy dielectric as one material of three wavelengths
WAVES = np.array([0.4, 0.5, 0.6])
INDEX = np.array([1.5, 0.958, 1.9]), np.array([0.0, 6.69, 0.4])
MATERIAL = Material.from_table(wavelength=WAVES, n=INDEX[0], kappa=INDEX[1])


def run(surface, theta, phi_i, skips):
    return simulate(
        Scene(surface, MATERIAL), theta, phi_i=phi_i, n_rays=RAYS, wavelength=WAVES,
        n_theta=BINS[0], n_dphi=BINS[1], skips=skips,
    )  # fmt: skip


def spot(result):
    """Index of the one bin with light, and the Mueller matrices of all bins together."""
    flux = (result.brdf_total * result.projected_solid_angle).isel(theta_i=0)
    bright = flux.sel(stokes_out="I", stokes_in="I")
    lit = np.argwhere(bright.sum(set(bright.dims) - {"theta_s", "dphi"}).values > 0)
    assert len(lit) == 1
    return lit[0], flux.sum(("theta_s", "dphi")).values


def direction(theta, phi):
    return np.array(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    )


@pytest.mark.parametrize("theta_deg", [0.0, 1e-6, 10.0, 41.4, 56.3, 75.0, 89.0])
@pytest.mark.parametrize("skips", [True, False])
def test_flat_plate_has_the_fresnel_matrix_in_the_specular_bin(theta_deg, skips):
    theta = np.deg2rad(theta_deg)
    result = run(HeightMap.flat(size=(3.0, 2.0)), theta, 0.7, skips)
    place, mueller = spot(result)
    assert place[0] == int(theta_deg / 90 * BINS[0])
    # Straight back along the normal is specular and retro-reflection; both frames agree
    assert place[1] == 11 or (theta_deg == 0 and place[1] == 0)
    for w in range(len(WAVES)):
        expected, _ = path_mueller(
            direction(theta, 0.7), [[0, 0, 1]], INDEX[0][w], INDEX[1][w], phi_i=0.7
        )
        assert_allclose(mueller[w], expected, atol=1e-12)
    assert result.albedo.sel(bounces=["2", "3+"]).values.max() == 0


# Worked values of the shared table of exact checks
@pytest.mark.parametrize(
    ("n", "theta_deg", "element", "value"),
    [
        (1.333, 0.0, (0, 0), 0.02037319), (1.333, 41.4, (0, 0), 0.02527691),
        (1.333, 41.4, (1, 0), 0.02031179), (1.333, 60.0, (0, 0), 0.05969092),
        (1.333, 60.0, (1, 0), 0.05537701), (1.5, 41.4, (0, 0), 0.04677307),
        (1.5, 41.4, (1, 0), 0.03411235), (1.5, 41.4, (2, 2), -0.03200105),
        (1.333, BREWSTER[1.333], (0, 0), 0.0391355),
        (1.333, BREWSTER[1.333], (1, 0), 0.0391355),
        (1.5, BREWSTER[1.5], (0, 0), 0.0739645), (1.5, BREWSTER[1.5], (1, 0), 0.0739645),
    ],
)  # fmt: skip
def test_c01_single_interface(n, theta_deg, element, value):
    scene = Scene(HeightMap.flat(), Material(n))
    _, mueller = spot(
        simulate(scene, np.deg2rad(theta_deg), n_rays=RAYS, n_theta=9, n_dphi=6)
    )
    assert_allclose(mueller[element], value, atol=6e-8)


def plate(slope_x, slope_y):
    """Plane z = slope_x x + slope_y y on unequal grid steps, not periodic."""
    x, y = np.arange(9)[:, None] * 0.7, np.arange(12)[None, :] * 1.3
    return HeightMap(slope_x * x + slope_y * y, (0.7, 1.3), periodic=False)


@pytest.mark.parametrize(
    ("axis_deg", "theta_deg", "phi_i"),
    [
        # About +x: the normal leans towards -y
        (0.0, 33.0, 0.0), (0.0, 33.0, 1.1), (0.0, 51.3, 4.0), (0.0, 0.0, 0.4),
        # About an oblique axis
        (37.0, 33.0, 0.0), (37.0, 61.2, 2.2), (-112.0, 20.5, 5.1), (-112.0, 0.0, 2.0),
    ],
)  # fmt: skip
@pytest.mark.parametrize("skips", [True, False])
@pytest.mark.filterwarnings("ignore:.*left the finite map sideways")
def test_plate_tilted_by_10_deg(axis_deg, theta_deg, phi_i, skips):
    tilt, axis = np.deg2rad(10.0), np.deg2rad(axis_deg)
    # Turning z by +10 deg about (cos a, sin a, 0), right-handed
    normal = direction(tilt, axis - np.pi / 2)
    surface = plate(-normal[0] / normal[2], -normal[1] / normal[2])
    theta = np.deg2rad(theta_deg)
    place, mueller = spot(run(surface, theta, phi_i, skips))

    for w in range(len(WAVES)):
        expected, exit_direction = path_mueller(
            direction(theta, phi_i), [normal], INDEX[0][w], INDEX[1][w], phi_i=phi_i
        )
        assert_allclose(mueller[w], expected, atol=1e-12)
        # The elements that a mirrored axis would flip are not small
        assert theta == 0 or abs(expected[2, 0]) > 1e-4
    theta_s, phi_s = spherical(exit_direction)
    assert place[0] == int(theta_s / (np.pi / 2) * BINS[0])
    assert place[1] == round((phi_s - phi_i) / (2 * np.pi) * BINS[1]) % BINS[1]


def test_c15_nearly_perfect_conductor_keeps_its_digits():
    n = 1e6
    theta = np.deg2rad(41.4)
    scene = Scene(HeightMap.flat(), Material(n))
    result = simulate(scene, theta, n_rays=RAYS, n_theta=9, n_dphi=6)
    _, mueller = spot(result)
    absorbed, polarised = result.absorbed.item(), mueller[1, 0]
    # C15 is the leading order in 1/n; the next is -(4/n^2)(1/c^2 +- c^2)
    c = np.cos(theta)
    assert_allclose(absorbed, 2 / n * (1 / c + c) - 4 / n**2 * (1 / c**2 + c**2), rtol=1e-9)
    assert_allclose(
        polarised, 2 / n * (1 / c - c) - 4 / n**2 * (1 / c**2 - c**2), rtol=1e-9
    )
    assert_allclose([absorbed, polarised], [4.166494e-6, 1.166050e-6], rtol=5 / n)

    with mp.workdps(50):
        cos_i = mp.cos(mp.mpf(float(theta)))
        cos_t = mp.sqrt(1 - (1 - cos_i**2) / mp.mpf(n) ** 2)
        refl_s = ((cos_i - n * cos_t) / (cos_i + n * cos_t)) ** 2
        refl_p = ((n * cos_i - cos_t) / (n * cos_i + cos_t)) ** 2
        exact = float(1 - (refl_s + refl_p) / 2), float((refl_s - refl_p) / 2)
    assert_allclose([absorbed, polarised], exact, rtol=1e-9)
