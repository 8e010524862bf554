"""Energy: mirrors against facet counting, volume terms against closed forms, Kirchhoff."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.special import erf, erfc

from pbrdf import Material, MicrofacetModel
from pbrdf.analytic import (
    SHADOWING,
    beard_maxwell,
    emissivity,
    generalised,
    priest_germer,
    reflectance,
    torrance_sparrow,
)
from pbrdf.kernels import from_python
from pbrdf.kernels.optics.volume import internal_reflectance

MIRROR = Material.mirror()


def overhang(theta, slope):
    """Smith's Lambda written out once more."""
    nu = 1 / (np.tan(theta) * slope * np.sqrt(2))
    return 0.5 * (np.exp(-nu * nu) / (nu * np.sqrt(np.pi)) - erfc(nu))


def below_horizon(theta, slope):
    """Light that facets turned to the source mirror downwards, per light on the mean plane.

    Over facet slopes (x, y), the Gaussian in y done by erf: a facet gets 1 - x tan(theta)
    and sends light down where x^2 + y^2 > 1 - 2 x tan(theta).
    """
    tangent = np.tan(theta)

    def over_y(x):
        limit = max(1 - 2 * x * tangent - x * x, 0.0)
        outside = 1 - erf(np.sqrt(limit / 2) / slope)
        density = np.exp(-x * x / (2 * slope**2)) / (np.sqrt(2 * np.pi) * slope)
        return density * (1 - x * tangent) * outside

    edge = 1 / tangent
    kinks = np.sort([-tangent - np.hypot(1, tangent), -tangent + np.hypot(1, tangent)])
    points = [k for k in kinks if -12 * slope < k < edge]
    low = -12 * slope
    return quad(over_y, low, min(edge, 12 * slope), points=points, epsabs=1e-12, limit=400)[
        0
    ]


@pytest.mark.parametrize("slope", [0.05, 0.15, 0.3, 0.47])
@pytest.mark.parametrize("theta_deg", [10, 41.4, 60, 75, 85])
def test_mirror_energy_is_reflected_or_sent_below_the_horizon(slope, theta_deg):
    theta = np.deg2rad(theta_deg)
    lit = reflectance(MicrofacetModel(MIRROR, slope, shadowing="none"), theta)
    # All facets turned to the source, as if none hid another: 1 + Lambda
    total = 1 + overhang(theta, slope)
    assert_allclose(lit.value + below_horizon(theta, slope), total, rtol=3e-8)
    assert lit.error[0, 0] < 3e-8


def test_reflectance_of_the_errata_page():
    model = MicrofacetModel(MIRROR, 0.3, shadowing="none")
    angles = np.deg2rad([1e-3, 10, 41.4, 60, 75, 85])
    values = [reflectance(model, t, rel_error=1e-6).value for t in angles]
    assert_allclose(values, [0.996, 0.994, 0.955, 0.940, 1.067, 1.908], atol=6e-4)


@pytest.mark.parametrize("theta_deg", [0, 45, 75, 85, 89])
def test_which_models_stay_within_the_light_they_get(theta_deg):
    """The table of pbrdf.analytic.named, and the statistical shadowings, at slope 0.3."""
    theta = np.deg2rad(theta_deg)

    def mirror_reflectance(model):
        return reflectance(model, theta, rel_error=1e-5).value

    bounded = [torrance_sparrow(MIRROR, 0.3)]
    bounded += [
        MicrofacetModel(MIRROR, 0.3, shadowing=s) for s in SHADOWING if "smith" in s
    ]
    assert max(map(mirror_reflectance, bounded)) < 1
    if theta_deg >= 85:
        grows = [
            priest_germer(MIRROR, 0.3),
            generalised(MIRROR, 0.3),
            beard_maxwell(MIRROR, 0.3),
        ]
        assert min(map(mirror_reflectance, grows)) > 1


def walsh(n):
    """External diffuse reflectance in closed form: Duntley 1942, eq. after Walsh."""
    m = n * n
    return (
        0.5
        + (n - 1) * (3 * n + 1) / (6 * (n + 1) ** 2)
        + m * (m - 1) ** 2 / (m + 1) ** 3 * np.log((n - 1) / (n + 1))
        - 2 * n**3 * (m + 2 * n - 1) / ((m + 1) * (m * m - 1))
        + 8 * n**4 * (m * m + 1) / ((m + 1) * (m * m - 1) ** 2) * np.log(n)
    )


@pytest.mark.parametrize("n", [1.333, 1.5, 2.4])
def test_internal_reflectance_is_walsh_and_duntley(n):
    assert_allclose(
        from_python(internal_reflectance)(n, 0.0), 1 - (1 - walsh(n)) / n**2, rtol=1e-9
    )


@pytest.mark.parametrize("form", ["base", "polarised-base"])
def test_white_base_returns_all_light_that_enters(form):
    """A base of albedo 1 under glass: DHR = T(theta_i), whatever the internal bounces."""
    model = MicrofacetModel(
        Material(1.5), 0.2, specular_gain=0, volume_albedo=1.0, volume_form=form
    )
    for theta in (0.0, 0.7, 1.3):
        cos_t = np.sqrt(1 - (np.sin(theta) / 1.5) ** 2)
        c = np.cos(theta)
        r_s = ((c - 1.5 * cos_t) / (c + 1.5 * cos_t)) ** 2
        r_p = ((1.5 * c - cos_t) / (1.5 * c + cos_t)) ** 2
        assert_allclose(reflectance(model, theta).value, 1 - (r_s + r_p) / 2, rtol=1e-7)


def test_material_base_is_the_volume_albedo():
    over_base = MicrofacetModel(Material(1.5, diffuse_albedo=0.4), 0.2)
    named = MicrofacetModel(Material(1.5), 0.2, volume_albedo=0.4)
    assert_allclose(over_base.brdf(0.3, 0.9, 2.0), named.brdf(0.3, 0.9, 2.0), rtol=0)
    with pytest.raises(ValueError, match="give one of them"):
        named.with_parameters(material=Material(1.5, diffuse_albedo=0.4))


def test_light_from_the_volume_is_polarised_on_its_way_out():
    """Malus' pile in reverse: Q/I = (T_s - T_p)/(T_s + T_p) at the exit, along e_p."""
    model = MicrofacetModel(Material(1.5), 0.2, specular_gain=0, volume_albedo=0.6)
    theta = 1.1
    cos_t = np.sqrt(1 - (np.sin(theta) / 1.5) ** 2)
    t_s = 4 * 1.5 * np.cos(theta) * cos_t / (np.cos(theta) + 1.5 * cos_t) ** 2
    t_p = 4 * 1.5 * np.cos(theta) * cos_t / (1.5 * np.cos(theta) + cos_t) ** 2
    matrix = model.brdf(0.2, theta, 1.0)
    assert_allclose(matrix[1, 0] / matrix[0, 0], (t_s - t_p) / (t_s + t_p), rtol=1e-13)
    assert matrix[1, 0] < 0
    paper = model.with_parameters(volume_form="paper").brdf(0.2, theta, 1.0)
    assert np.count_nonzero(paper) == 1


def test_partly_depolarised_volume_keeps_a_share_of_the_incident_polarisation():
    model = MicrofacetModel(
        Material(1.0001), 0.2, specular_gain=0, volume_albedo=0.5, volume_depolarization=0.3
    )
    # Hardly any interface: diag(1, 0.7, 0.7, 0.7) albedo/pi
    expected = np.diag([1, 0.7, 0.7, 0.7]) * 0.5 / np.pi
    assert_allclose(model.brdf(0.4, 0.5, 1.0), expected, atol=1e-4)


def test_grazing_terms_follow_their_formulas():
    plain = MicrofacetModel(Material(1.5), 0.2, specular_gain=0, grazing_albedo=0.2)
    ci, cs = np.cos(0.4), np.cos(1.2)
    assert_allclose(plain.brdf(0.4, 1.2, 1.0)[0, 0], 0.4 / np.pi / (ci + cs))
    paper = plain.with_parameters(grazing_form="paper").brdf(0.4, 1.2, 1.0)
    assert_allclose(paper[0, 0], 0.2 / np.pi / (ci * cs))


def test_smooth_surface_emits_what_fresnel_lets_out():
    model = MicrofacetModel(Material(1.4, 0.3), 0.004, shadowing="none")
    theta = 1.0
    index = 1.4 + 0.3j
    cos_t = np.sqrt(1 - (np.sin(theta) / index) ** 2)
    r_s = abs((np.cos(theta) - index * cos_t) / (np.cos(theta) + index * cos_t)) ** 2
    r_p = abs((index * np.cos(theta) - cos_t) / (index * np.cos(theta) + cos_t)) ** 2
    expected = [1 - (r_s + r_p) / 2, -(r_s - r_p) / 2, 0, 0]
    assert_allclose(emissivity(model, theta), expected, atol=1e-4)


def test_source_beyond_the_horizon_is_refused():
    with pytest.raises(ValueError, match="theta_i must lie"):
        reflectance(MicrofacetModel(MIRROR, 0.3), 1.6)
