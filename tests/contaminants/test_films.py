"""Checks C3 to C6 and B15: plates and films, against series written out here."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from pbrdf import Film, GaussianSurface, HeightMap, Material, Scene, simulate
from pbrdf.kernels import from_python
from pbrdf.kernels.optics.volume import internal_reflectance
from tests.contaminants.scenes import (
    assert_closed,
    assert_within,
    clean_counters,
    flat_runs,
)
from tests.reference_optics import fresnel

WATER = Material(1.333)
ANGLES = (0.0, 41.4, 60.0)
ALL = tuple(np.deg2rad([*ANGLES, 75.0]))


def reflection(cos_i, n, kappa=0.0):
    """Mueller matrix of an interface in its own frame, from the amplitudes."""
    r_s, r_p = fresnel(cos_i, n, kappa)
    cross = r_s * np.conj(r_p)
    a, b = (abs(r_s) ** 2 + abs(r_p) ** 2) / 2, (abs(r_s) ** 2 - abs(r_p) ** 2) / 2
    c, d = cross.real, cross.imag
    return np.array([[a, b, 0, 0], [b, a, 0, 0], [0, 0, c, -d], [0, 0, d, c]])


def transmission(cos_i, n):
    """The same of what crosses a transparent interface: T = 1 - R for s and p."""
    r_s, r_p = (abs(r) ** 2 for r in fresnel(cos_i, n))
    a, b, c = 1 - (r_s + r_p) / 2, (r_p - r_s) / 2, np.sqrt((1 - r_s) * (1 - r_p))
    return np.array([[a, b, 0, 0], [b, a, 0, 0], [0, 0, c, 0], [0, 0, 0, c]])


def film_matrix(theta, n_film, below, a2=1.0):
    """F12 + T21 F23 (I - F21 F23)^-1 T12 of a film over `below` (n, kappa), or a mirror."""
    cos_i = np.cos(theta)
    cos_t = np.sqrt(1 - (np.sin(theta) / n_film) ** 2)
    f23 = np.diag([1.0, 1, -1, -1])
    if below is not None:
        f23 = reflection(cos_t, below[0] / n_film, below[1] / n_film)
    f12, t12 = reflection(cos_i, n_film), transmission(cos_i, n_film)
    f21, t21 = reflection(cos_t, 1 / n_film), transmission(cos_t, 1 / n_film)
    inner = np.linalg.inv(np.eye(4) - a2 * f21 @ f23)
    return f12 + a2 * t21 @ f23 @ inner @ t12


# Values of the shared page of exact checks: M00, M10, M22
WORKED = {
    (0.0, 1.5): (0.02370816, 0.0, -0.02370816),
    (41.4, 1.5): (0.02876147, 0.02201702, -0.01808358),
    (60.0, 1.5): (0.06345652, 0.05860458, 0.02034122),
}


def test_the_series_of_this_file_has_the_worked_values():
    for (theta, n), (m00, m10, m22) in WORKED.items():
        matrix = film_matrix(np.deg2rad(theta), 1.333, (n, 0.0))
        assert_allclose(matrix[[0, 1, 2], [0, 0, 2]], [m00, m10, m22], atol=6e-9)
    c4c = film_matrix(np.deg2rad(41.4), 1.333, (0.958, 6.69))
    assert_allclose(
        c4c[[0, 1, 2, 3], [0, 0, 2, 2]],
        [0.89732155, 0.01413417, -0.87310105, 0.09616471], atol=6e-9,
    )  # fmt: skip
    for theta, m22 in ((41.4, -0.97922368), (60, -0.83963144), (75, -0.32766579)):
        mirror = film_matrix(np.deg2rad(theta), 1.333, None)
        assert_allclose([mirror[0, 0], mirror[2, 2]], [1.0, m22], atol=6e-9)
    half = [0.50514571, 0.50645370, 0.51580195]
    for theta, m00 in zip(ANGLES, half, strict=True):
        absorbing = film_matrix(np.deg2rad(theta), 1.333, None, a2=0.5)
        assert_allclose(absorbing[0, 0], m00, atol=6e-9)


@pytest.mark.parametrize("theta_deg", ANGLES)
@pytest.mark.parametrize("level", [False, True])
def test_c3_plate_in_air(theta_deg, level):
    theta = np.deg2rad(theta_deg)
    film = Film(thickness=0.1, material=Material(1.5), level=level)
    mean, stderr, result = flat_runs(
        Material(1.0), film, theta, among=ALL, n_rays=4000, n_theta=9, n_dphi=4
    )
    assert_within(mean, stderr, film_matrix(theta, 1.5, (1.0, 0.0)))
    r1 = reflection(np.cos(theta), 1.5)[[0, 0, 1, 1], [0, 1, 0, 1]]
    s, p = r1[0] + r1[1], r1[0] - r1[1]
    plate = (s / (1 + s) + p / (1 + p), s / (1 + s) - p / (1 + p))
    assert_within(mean[[0, 1], 0], stderr[[0, 1], 0], plate)
    clean_counters(result)


@pytest.mark.parametrize("theta_deg", [*ANGLES, 75.0])
@pytest.mark.parametrize(
    ("below", "substrate"),
    [
        ((1.5, 0.0), Material(1.5)),
        ((0.958, 6.69), Material(0.958, 6.69)),
        ((1.333, 0.0), WATER),
        (None, Material.mirror()),
    ],
)
def test_c4_c5_film_on_a_substrate(theta_deg, below, substrate):
    theta = np.deg2rad(theta_deg)
    for level in (False, True):
        mean, stderr, result = flat_runs(
            substrate, Film(thickness=0.2, material=WATER, level=level), theta,
            among=ALL, n_rays=2000, n_theta=9, n_dphi=4, phi_i=0.4,
        )  # fmt: skip
        assert_within(mean, stderr, film_matrix(theta, 1.333, below))
        clean_counters(result)
        assert assert_closed(result) < (1e-9 if below is None else 2e-4)


@pytest.mark.parametrize("theta_deg", ANGLES)
def test_c5b_absorbing_film_on_a_mirror(theta_deg):
    theta = np.deg2rad(theta_deg)
    cos_t = np.sqrt(1 - (np.sin(theta) / 1.333) ** 2)
    # Twice through 100 um leaves a half
    wavelength, thickness = 0.55, 100.0
    kappa = np.log(2) * cos_t / (2 * thickness) * wavelength / (4 * np.pi)
    mean, stderr, result = flat_runs(
        Material.mirror(), Film(thickness=thickness, material=Material(1.333, kappa)),
        theta, n_rays=2000, n_theta=9, n_dphi=4, wavelength=wavelength,
    )  # fmt: skip
    expected = film_matrix(theta, 1.333, None, a2=0.5)
    # Absorption turns the phase between s and p a little, which this series leaves out
    assert_within(mean, stderr, expected, floor=2.0 * kappa)
    assert assert_closed(result) < 2e-4


def test_absorption_needs_a_wavelength():
    scene = Scene(
        HeightMap.flat(),
        Material.mirror(),
        Film(thickness=1.0, material=Material(1.33, 1e-4)),
    )
    with pytest.raises(ValueError, match=r"wavelength must be given \[um\]"):
        simulate(scene, 0.0)


# rho, theta, directional-hemispherical reflectance of the shared page
C6 = (
    (0.13, 0.0, 0.09168454), (0.13, 41.4, 0.09623130), (0.13, 60.0, 0.12814016),
    (1.0, 41.4, 1.0),
)  # fmt: skip


@pytest.mark.parametrize(("rho", "theta_deg", "dhr"), C6)
def test_c6_film_of_the_same_index_on_a_lambertian_base(rho, theta_deg, dhr):
    theta = np.deg2rad(theta_deg)
    substrate = Material(1.333, diffuse_albedo=rho)
    mean, stderr, result = flat_runs(
        substrate, Film(thickness=0.1, material=WATER), theta,
        among=[np.deg2rad(case[1]) for case in C6 if case[0] == rho], n_rays=5000,
        n_theta=9, n_dphi=2,
    )  # fmt: skip
    assert_within(mean[0, 0], stderr[0, 0], dhr, floor=1e-7)
    clean_counters(result)
    # Away from the mirror direction: f = T T rho / (pi n^2 (1 - rho F_i)), bin averaged
    base = rho / (np.pi * 1.333**2 * (1 - rho * 0.47459057))
    t_in = 1 - reflection(np.cos(theta), 1.333)[0, 0]
    nodes, weights = np.polynomial.legendre.leggauss(16)
    edges = np.cos(np.linspace(0, np.pi / 2, 10)) ** 2
    bins = result.brdf_total.isel(stokes_out=0, stokes_in=0, dphi=0)
    for k in range(8):
        # Even in the square of the cosine of exit, as the projected solid angle is
        c = np.sqrt(edges[k + 1] + (edges[k] - edges[k + 1]) * (1 + nodes) / 2)
        t_out = weights @ [1 - reflection(x, 1.333)[0, 0] for x in c] / 2
        specular = theta_deg == 0.0 and k == 0
        if not specular:
            assert_within(
                bins[:, k].mean(), bins[:, k].std(ddof=1) / np.sqrt(len(bins)),
                t_in * t_out * base,
            )  # fmt: skip


def into_base(theta, n_film, n_base):
    """Share of unpolarised light that a film lets into the base under it."""
    cos_t = np.sqrt(1 - (np.sin(theta) / n_film) ** 2)
    ratio = n_base / n_film
    inner = np.linalg.inv(
        np.eye(4) - reflection(cos_t, 1 / n_film) @ reflection(cos_t, ratio)
    )
    t12 = transmission(np.cos(theta), n_film)
    return (transmission(cos_t, ratio) @ inner @ t12)[0, 0]


@pytest.mark.parametrize("theta_deg", ANGLES)
@pytest.mark.parametrize("n_base", [1.2, 1.7])
def test_film_on_a_lambertian_base_of_another_index(theta_deg, n_base):
    """By reciprocity the base sends out 1/n^2 of what it would get from a white sky."""
    theta, rho = np.deg2rad(theta_deg), 0.6
    mean, stderr, result = flat_runs(
        Material(n_base, diffuse_albedo=rho), Film(thickness=0.1, material=WATER), theta,
        among=ALL, n_rays=1000, n_theta=9, n_dphi=2,
    )  # fmt: skip
    # Even in the square of the sine, as light from a white sky is
    nodes, weights = np.polynomial.legendre.leggauss(64)
    sky = np.arcsin(np.sqrt(0.5 * (1 + nodes)))
    sent = 0.5 * weights @ [into_base(t, 1.333, n_base) for t in sky] / n_base**2
    specular = film_matrix(theta, 1.333, (n_base, 0.0))[0, 0]
    diffuse = into_base(theta, 1.333, n_base) * rho * sent / (1 - rho * (1 - sent))
    assert_within(mean[0, 0], stderr[0, 0], specular + diffuse, floor=2e-6)
    clean_counters(result)


@pytest.mark.parametrize("n", [0.7, 0.9, 1.1, 1.275, 2.0])
def test_diffuse_light_inside_is_thrown_back_as_the_integral_says(n):
    def share(square_of_sine):
        return reflection(np.sqrt(1 - square_of_sine), 1 / n)[0, 0]

    kink = [n**-2] if n > 1 else None
    expected = quad(share, 0, 1, points=kink, limit=500)[0]
    assert_allclose(from_python(internal_reflectance)(n, 0.0), expected, atol=3e-8)


ROUGH = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=8.0, slope_rms=0.2)


def test_b15_shallow_water_of_air_is_not_there(measured):
    # Below the highest peak it changes no entry point either: the very same rays
    options = {"n_rays": 4000, "realizations": 8, "phi_i": 0.3, "seed": 3}
    theta = np.deg2rad([20.0, 60.0])
    bare = simulate(
        Scene(ROUGH, Material(1.5)), theta, skips=("walk", "steep"),
        variance_reduction=False, **options,
    )  # fmt: skip
    film = Film(thickness=0.2, material=Material(1.0), level=True)
    covered = simulate(Scene(ROUGH, Material(1.5), film), theta, **options)
    error = np.abs(covered.brdf - bare.brdf).max()
    measured("B15", "BRDF under a film of air [1/sr]", error, 1e-9)
    clean_counters(covered)


def test_b15_film_of_air_is_not_there(measured):
    theta = np.deg2rad(60.0)
    options = {"n_rays": 4000, "realizations": 8, "phi_i": 0.0, "seed": 3}
    bare = simulate(
        Scene(ROUGH, Material(1.5)), theta, skips=("walk", "steep"),
        variance_reduction=False, **options,
    )  # fmt: skip
    # So thick that light drifts by one period on its way through: the very same rays
    film = Film(thickness=64.0 / np.tan(theta), material=Material(1.0))
    covered = simulate(Scene(ROUGH, Material(1.5), film), theta, **options)
    error = np.abs(covered.brdf - bare.brdf).max()
    measured("B15", "BRDF under a film of air [1/sr]", error, 1e-9)
    clean_counters(covered)


def test_films_of_one_surface_close_the_budget_on_rough_ground():
    surface = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=8.0, slope_rms=0.3)
    for level in (False, True):
        film = Film(thickness=1.0, material=WATER, level=level)
        result = simulate(
            Scene(surface, Material.mirror(), film), np.deg2rad([10.0, 75.0]),
            n_rays=4000, realizations=8, phi_i="uniform",
        )  # fmt: skip
        clean_counters(result)
        assert assert_closed(result) < 1e-9
        assert result.truncated.max() < 1e-3
