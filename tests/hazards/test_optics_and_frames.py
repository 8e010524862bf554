"""Hazards B7 to B12, B20, B21, B23: frames, Fresnel digits, drift, tallies, handedness.

B7 and B24 are tested bin by bin in tests/analytic, B12 and B13 in tests/laws, B22 in
tests/statistical.
"""

import mpmath as mp
import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import HeightMap, Material, Scene, simulate
from pbrdf.kernels import from_python
from pbrdf.kernels.optics.fresnel import reflection_elements
from tests.reference_optics import path_mueller


def direction(theta, phi):
    return np.array(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    )


def total(result):
    flux = result.brdf_total * result.projected_solid_angle
    return flux.sum(("theta_s", "dphi")).values[0]


def one_facet(normal, n, kappa, theta, phi_i):
    """Mueller matrix that the tracer gives a plate of this normal."""
    x, y = np.arange(12)[:, None], np.arange(12)[None, :]
    slope = -normal[:2] / normal[2]
    surface = HeightMap(slope[0] * x + slope[1] * y, 1.0, periodic=False)
    result = simulate(
        Scene(surface, Material(n, kappa)), theta, phi_i=phi_i, n_rays=3200,
        n_theta=4, n_dphi=4,
    )  # fmt: skip
    return total(result)


@pytest.mark.parametrize("theta", [1e-1, 1e-3, 1e-5, 1e-8])
def test_b08_source_near_the_zenith(theta, measured):
    """Bound 1e-4; dot products keep nearly all digits."""
    normal = direction(0.12, 1.0)
    expected, _ = path_mueller(direction(theta, 0.4), [normal], 1.5, 0.8, phi_i=0.4)
    error = np.abs(one_facet(normal, 1.5, 0.8, theta, 0.4) - expected).max()
    measured("B8", "Mueller elements, source 1e-8 rad from the zenith", error, 1e-12)


@pytest.mark.parametrize("beta", [1e-1, 1e-3, 1e-5, 1e-7])
def test_b08_facet_met_head_on(beta, measured):
    """The plane of incidence fades as beta goes to 0, and with it the frame's digits."""
    normal = direction(0.2, 1.0)
    dir_i = direction(0.2 + beta, 1.0 + 2 * beta)
    theta, phi_i = 0.2 + beta, 1.0 + 2 * beta
    expected, _ = path_mueller(dir_i, [normal], 1.5, 0.8, phi_i=phi_i)
    error = np.abs(one_facet(normal, 1.5, 0.8, theta, phi_i) - expected).max()
    measured("B8", "Mueller elements, local incidence 1e-7 rad", error, 1e-10)


@pytest.mark.parametrize("theta_deg", [0.0, 10.0, 41.4, 75.0, 89.0])
def test_b09_conductor_of_index_a_million(theta_deg, measured):
    theta = np.deg2rad(theta_deg)
    scene = Scene(HeightMap.flat(), Material(1e6))
    result = simulate(scene, theta, n_rays=64, n_theta=4, n_dphi=4)
    c = np.cos(theta)
    # The bound is 1e-3; leading order in 1/n leaves 4 / (n c)
    error = abs(result.absorbed.item() / (2e-6 * (c + 1 / c)) - 1)
    measured("B9", "n = 1e6: relative error of 1 - M00, times cos", error * c, 5e-6)
    assert_allclose(total(result)[1, 0], 2e-6 * (1 / c - c), rtol=1e-5 / c, atol=1e-16)


def test_b10_total_reflection_from_the_dense_side():
    """n = 1.5 to 1 at 45 degrees: M22 = 0.8, M23 = -0.6, M32 = +0.6 exactly."""
    scene = Scene(HeightMap.flat(), Material(1 / 1.5))
    mueller = total(simulate(scene, np.pi / 4, n_rays=64, n_theta=4, n_dphi=4))
    expected = np.eye(4)
    expected[2:, 2:] = [[0.8, -0.6], [0.6, 0.8]]
    assert_allclose(mueller, expected, atol=1e-12)


@pytest.mark.parametrize("distance", [1e-3, 1e-5, 1e-7, -1e-7, -1e-5, -1e-3])
def test_b10_near_the_critical_angle(distance, measured):
    n = 1 / 1.333
    theta = np.arcsin(n) + distance
    scene = Scene(HeightMap.flat(), Material(n))
    mueller = total(simulate(scene, theta, n_rays=64, n_theta=4, n_dphi=4))
    with mp.workdps(40):
        # The rounded cosine is what the tracer is given
        c = mp.mpf(float(np.cos(theta)))
        cos_t = mp.sqrt(mp.mpc(1 - (1 - c**2) / mp.mpf(n) ** 2))
        r_s = (c - n * cos_t) / (c + n * cos_t)
        r_p = (n * c - cos_t) / (n * c + cos_t)
        cross = r_s * mp.conj(r_p)
        mean = (abs(r_s) ** 2 + abs(r_p) ** 2) / 2
        expected = [float(mean), float(mp.re(cross)), float(mp.im(cross))]
    found = [mueller[0, 0], mueller[2, 2], mueller[3, 2]]
    error = np.abs(np.subtract(found, expected)).max()
    measured("B10", "Mueller elements 1e-7 rad from the critical angle", error, 1e-6)
    assert mueller[0, 0] <= 1 + 1e-15


@pytest.mark.parametrize("kappa", [0.0, 1e-8, 1e-3, 1.0, 1e3])
@pytest.mark.parametrize("n", [0.1, 1.0, 1.5, 1e3])
def test_b11_any_absorption_to_twelve_digits(n, kappa, measured):
    for c in (1.0, 0.7, 0.05, 1e-6):
        with mp.workdps(50):
            index, cosine = mp.mpc(n, kappa), mp.mpf(c)
            cos_t = mp.sqrt(1 - (1 - cosine**2) / index**2)
            if mp.im(index * cos_t) < 0:
                cos_t = -cos_t
            r_s = (cosine - index * cos_t) / (cosine + index * cos_t)
            r_p = (index * cosine - cos_t) / (index * cosine + cos_t)
            refl_s, refl_p, cross = abs(r_s) ** 2, abs(r_p) ** 2, r_s * mp.conj(r_p)
            expected = np.array(
                [(refl_s + refl_p) / 2, (refl_s - refl_p) / 2, mp.re(cross), mp.im(cross)],
                dtype=float,
            )
        found = np.array(from_python(reflection_elements)(c, n, kappa))
        assert found[0] <= 1 + 1e-15
        error = np.abs(found - expected).max() / max(expected[0], 1e-300)
        measured("B11", "elements over M00, n 0.1 to 1e3, kappa 0 to 1e3", error, 1e-12)


@pytest.mark.parametrize("skips", [True, False])
@pytest.mark.parametrize("phi_i", [0.0, 0.5])
def test_b20_a_thousand_bounces_in_a_narrow_groove(skips, phi_i, measured):
    """Every path comes back out; the component along the groove never changes."""
    heights = np.tile([[0.0], [600.0]], (2, 4))
    scene = Scene(HeightMap(heights, 1.0, periodic=True), Material.mirror())
    theta = np.deg2rad(40.0)
    result = simulate(
        scene, theta, phi_i=phi_i, n_rays=640, max_bounces=4000, n_theta=45, n_dphi=8,
        skips=skips,
    )  # fmt: skip
    assert np.isfinite(result.brdf).all()
    assert result.attrs["path_segments"] > 100 * 640
    lost = result.truncated.item() + result.leaked.item()
    error = abs(result.albedo.sum("bounces").item() + lost - 1.0)
    measured("B20", "energy after a thousand bounces in a groove", error, 1e-9)
    assert result.truncated.item() == 0
    if skips:
        assert result.leaked.item() == 0
    # sin(theta_s) is at least the component along y, up to the bin's width
    along = abs(np.sin(theta) * np.sin(phi_i))
    lit = (result.brdf_total.isel(stokes_out=0, stokes_in=0) > 0).any("dphi").values[0]
    assert np.sin(result.theta_s.values[lit].min() + np.pi / 180) >= along


def test_b21_tallies_count_every_ray(measured):
    scene = Scene(HeightMap.flat(), Material.mirror())
    result = simulate(
        scene, 0.5, n_rays=1_000_000, n_theta=3, n_dphi=2, stokes="unpolarized"
    )
    assert result.brdf.dtype == np.float64
    flux = (result.brdf_total * result.projected_solid_angle).sum().item()
    measured("B21", "rays missing in a bin of 1e6", abs(flux * 1e6 - 1e6), 1e-3)


def test_b23_tilt_about_x_gives_the_sign_of_u(measured):
    """A facet turned +10 degrees about x, seen from +x: its normal leans towards -y.

    Light from (30 degrees, phi 0) goes to dphi below pi turned clockwise or not, and the
    facet's s axis turns with it; the signs are those of the fields (conventions page).
    """
    tilt = np.deg2rad(10.0)
    normal = np.array([0.0, -np.sin(tilt), np.cos(tilt)])
    mueller = one_facet(normal, 1.5, 0.0, np.deg2rad(30.0), 0.0)
    expected, out = path_mueller(direction(np.deg2rad(30.0), 0.0), [normal], 1.5)
    assert out[1] < 0
    error = np.abs(mueller - expected).max()
    measured("B23", "Mueller elements of a tilted facet, signs included", error, 1e-12)
    # By hand: the facet's axis k x n against e_s and e_p of the exit
    k = -direction(np.deg2rad(30.0), 0.0)
    axis = np.cross(k, normal)
    e_s = np.cross([0, 0, 1], out)
    e_s = e_s / np.linalg.norm(e_s)
    e_p = np.cross(out, e_s)
    # Q along the facet's axis: the sign of U is that of the product of its components
    assert np.sign(mueller[2, 0]) == np.sign((axis @ e_s) * (axis @ e_p))
    assert abs(mueller[2, 0]) > 1e-3
    # The mirrored tilt flips U and leaves I and Q
    mirrored = one_facet(normal * [1, -1, 1], 1.5, 0.0, np.deg2rad(30.0), 0.0)
    assert_allclose(mirrored[2, 0], -mueller[2, 0], rtol=1e-9)
    assert_allclose(mirrored[:2, 0], mueller[:2, 0], rtol=1e-9)
