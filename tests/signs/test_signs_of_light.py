"""One test per sign of the conventions page that Fresnel optics and frames decide."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf.analytic import MicrofacetModel
from pbrdf.optics import Material, aolp, convert_brdf, docp, dolp, specular_mueller

GLASS = MicrofacetModel(Material(1.5), 0.2, shadowing="none")
METAL = MicrofacetModel(Material(1.37, 7.62), 0.2, shadowing="none")


def test_glass_polarises_across_the_plane_of_incidence():
    for theta in (0.3, np.arctan(1.5), 1.3):
        stokes = specular_mueller(np.cos(theta), 1.5) @ [1, 0, 0, 0]
        assert stokes[1] > 0
        assert aolp(stokes) == 0


def test_u_changes_sign_with_the_p_amplitude_at_brewster():
    before, after = (
        specular_mueller(np.cos(np.arctan(1.5) + d), 1.5) for d in (-0.01, 0.01)
    )
    assert before[2, 2] < 0 < after[2, 2]


def test_metal_makes_circular_light_of_diagonal_light():
    """r_s conj(r_p) by hand at 60 deg: cos b = 1/2, N = 1.37 + 7.62i, exp(-i w t)."""
    index = 1.37 + 7.62j
    cos_t = np.sqrt(1 - 0.75 / index**2)
    r_s = (0.5 - index * cos_t) / (0.5 + index * cos_t)
    r_p = (index * 0.5 - cos_t) / (index * 0.5 + cos_t)
    # V = 2 Im(conj(E_s) E_p) sees E_p lag; U in = 1 has E_s = E_p
    out = specular_mueller(0.5, 1.37, 7.62) @ [1, 0, 1, 0]
    assert_allclose(out[3], (r_p.conjugate() * r_s).imag, rtol=1e-13)
    assert out[3] > 0
    assert docp(out) > 0


def test_facet_tilted_aside_turns_the_polarisation_by_the_frames():
    """Light from +x seen at dphi = 90 deg: e_s' = dir_i x dir_s projected by hand."""
    theta_i, theta_s = 0.5, 0.8
    dir_i = np.array([np.sin(theta_i), 0, np.cos(theta_i)])
    dir_s = np.array([0, np.sin(theta_s), np.cos(theta_s)])
    e_s = np.array([-1.0, 0, 0])  # z x dir_s
    e_p = np.cross(dir_s, e_s)
    plane = np.cross(dir_i, dir_s)
    expected = np.arctan2(plane @ e_p, plane @ e_s)
    expected = (expected + np.pi / 2) % np.pi - np.pi / 2
    matrix = GLASS.brdf(theta_i, theta_s, np.pi / 2)
    assert_allclose(aolp(matrix), expected, rtol=1e-12)
    assert matrix[2, 0] * matrix[1, 0] != 0
    assert_allclose(aolp(GLASS.brdf(theta_i, theta_s, -np.pi / 2)), -expected, rtol=1e-12)


def test_exchange_with_scatmech_flips_v_and_counts_azimuth_from_forward():
    ours = METAL.brdf(0.5, 0.9, 2.5)
    theirs, phi = convert_brdf(ours, 0.5, 0.9, 2.5, target="scatmech")
    assert_allclose(phi, 2.5 - np.pi)
    assert_allclose(theirs[3], [-v for v in ours[3, :3]] + [ours[3, 3]])
    assert_allclose(theirs[:3, :3], ours[:3, :3])


def test_exchange_with_mitsuba_uses_the_scattering_plane():
    geometry = (0.5, 0.9, 2.5)
    theirs, _ = convert_brdf(METAL.brdf(*geometry), *geometry, target="mitsuba")
    cosine = np.sqrt(
        0.5 * (1 + np.cos(0.5) * np.cos(0.9) + np.sin(0.5) * np.sin(0.9) * np.cos(2.5))
    )
    facet = specular_mueller(cosine, 1.37, 7.62)
    assert_allclose(theirs / theirs[0, 0], facet / facet[0, 0], rtol=0, atol=1e-13)


def test_paper_counts_q_as_p_minus_s():
    theirs, _ = convert_brdf(specular_mueller(0.5, 1.37, 7.62), 1.0472, 1.0472, np.pi,
                             target="paper")  # fmt: skip
    conjugate = np.conj(1.37 + 7.62j)
    cos_t = np.sqrt(1 - 0.75 / conjugate**2)
    r_s = (0.5 - conjugate * cos_t) / (0.5 + conjugate * cos_t)
    r_p = (conjugate * 0.5 - cos_t) / (conjugate * 0.5 + cos_t)
    assert_allclose(theirs[1, 0], (abs(r_p) ** 2 - abs(r_s) ** 2) / 2, rtol=1e-12)
    assert_allclose(theirs[2, 3], (r_p * r_s.conjugate()).imag, rtol=1e-12)
    assert_allclose(theirs[3, 2], -(r_p * r_s.conjugate()).imag, rtol=1e-12)


@pytest.mark.parametrize("name", ["scatmech", "mitsuba", "paper"])
def test_exchange_returns(name):
    geometry = (0.5, 0.9, 2.5)
    ours = METAL.brdf(*geometry)
    theirs, phi = convert_brdf(ours, *geometry, target=name)
    again, dphi = convert_brdf(theirs, 0.5, 0.9, phi, source=name)
    assert_allclose(again, ours, rtol=1e-13, atol=1e-16)
    assert_allclose(dphi, 2.5)
    with pytest.raises(ValueError, match="source must be one of pbrdf, scatmech"):
        convert_brdf(ours, *geometry, source="scatmek")


def test_summaries_of_light():
    light = np.array([[2.0, 0.6, -0.8, 1.0], [0.0, 0.0, 0.0, 0.0]])
    assert_allclose(dolp(light), [0.5, np.nan])
    assert_allclose(docp(light), [0.5, np.nan])
    assert_allclose(aolp(light[0]), 0.5 * np.arctan2(-0.8, 0.6))
