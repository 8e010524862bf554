"""Laws every microfacet BRDF obeys, whatever its parameters."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from pbrdf.analytic import SHADOWING, SLOPE_DISTRIBUTIONS, MicrofacetModel
from pbrdf.optics import Material, coherency_eigenvalues

zenith = st.floats(0, 1.5)
azimuth = st.floats(-3.1, 3.1)
models = st.builds(
    MicrofacetModel,
    st.builds(Material, st.floats(0.5, 3), st.sampled_from([0.0, 1e-8, 0.4, 3.0])),
    st.tuples(st.floats(0.05, 0.6), st.floats(0.05, 0.6)),
    st.sampled_from(list(SLOPE_DISTRIBUTIONS)),
    st.sampled_from(list(SHADOWING)),
)
SWAP = np.diag([1.0, 1.0, -1.0, 1.0])
MIRROR = np.diag([1.0, 1.0, -1.0, -1.0])


@given(models, zenith, zenith, azimuth, azimuth)
def test_reciprocity(model, theta_i, theta_s, dphi, phi_i):
    forth = model.brdf(theta_i, theta_s, dphi, phi_i=phi_i)
    back = model.brdf(theta_s, theta_i, -dphi, phi_i=phi_i + dphi)
    # The exponent of the slope density magnifies rounding where little light goes
    atol = 1e-11 * forth[0, 0]
    assert_allclose(back, SWAP @ forth.T @ SWAP, rtol=1e-10, atol=atol)


@given(models, zenith, zenith, azimuth, azimuth)
def test_single_facets_are_jones_matrices(model, theta_i, theta_s, dphi, phi_i):
    matrix = model.brdf(theta_i, theta_s, dphi, phi_i=phi_i)
    eigenvalues = coherency_eigenvalues(matrix)
    assert np.abs(eigenvalues[:3]).max() <= 1e-14 * max(matrix[0, 0], 1e-300)


@given(models, zenith, zenith, azimuth)
def test_isotropic_surfaces_are_mirror_symmetric(model, theta_i, theta_s, dphi):
    isotropic = model.with_parameters(slope_rms=0.3)
    left = isotropic.brdf(theta_i, theta_s, dphi)
    right = isotropic.brdf(theta_i, theta_s, -dphi)
    assert_allclose(right, MIRROR @ left @ MIRROR, rtol=1e-13, atol=1e-14 * left[0, 0])


@given(models, zenith, zenith, azimuth, azimuth)
def test_turning_the_axes_with_the_light_changes_nothing(
    model, theta_i, theta_s, dphi, phi_i
):
    x, y = model.slope_rms
    turned = model.with_parameters(slope_rms=(y, x))
    before = model.brdf(theta_i, theta_s, dphi, phi_i=phi_i)
    after = turned.brdf(theta_i, theta_s, dphi, phi_i=phi_i + np.pi / 2)
    assert_allclose(after, before, rtol=1e-9, atol=1e-11 * before[0, 0])


@given(models, zenith, zenith, azimuth)
def test_hidden_facets_only_take_light_away(model, theta_i, theta_s, dphi):
    lit = model.with_parameters(shadowing="none").brdf(theta_i, theta_s, dphi)[0, 0]
    assert 0 <= model.brdf(theta_i, theta_s, dphi)[0, 0] <= lit * (1 + 1e-12)


@pytest.mark.parametrize("law", SLOPE_DISTRIBUTIONS)
@pytest.mark.parametrize("slopes", [(0.1, 0.1), (0.3, 0.3), (0.5, 0.2), (1.2, 1.2)])
def test_projected_facet_area_is_one(law, slopes):
    """Equation (18): the facets cover the mean plane once, however the axes differ."""
    node, weight = np.polynomial.legendre.leggauss(400)
    # tan(tilt) = z/(1 - z) takes in the far tails; azimuth by the trapezium rule
    z, w = 0.5 + 0.5 * node, 0.5 * weight
    tangent = z / (1 - z)
    phi = np.linspace(0, 2 * np.pi, 128, endpoint=False)
    tilt = np.arctan(tangent)[:, None]
    # In retro-reflection the facet faces the source: brdf = P / (4 cos^2) for a mirror
    model = MicrofacetModel(Material.mirror(), slopes, law, "none")
    density = 4 * np.cos(tilt) ** 2 * model.brdf(tilt, tilt, 0.0, phi_i=phi)[..., 0, 0]
    solid_angle = np.sin(tilt) * np.cos(tilt) ** 2 / (1 - z[:, None]) ** 2
    total = (density * np.cos(tilt) * solid_angle * w[:, None]).sum() * (
        2 * np.pi / phi.size
    )
    assert_allclose(total, 1.0, rtol=2e-6)
