"""`ds.pbrdf` against values computed by hand."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pbrdf.accessor
from pbrdf.derived.elements import folded
from pbrdf.errors import AccuracyWarning
from tests.pictures.results import hand_made


@pytest.fixture
def ds():
    return hand_made()


def test_dolp_and_aolp_of_unpolarised_light(ds):
    place = {"theta_i": 1, "wavelength": 0, "theta_s": 2, "dphi": 3}
    u = 0.4 * np.sin(3 * np.pi / 4 + 0.2)
    assert_allclose(ds.pbrdf.dolp().isel(place), np.sqrt(0.09 + u**2))
    assert_allclose(np.tan(2 * ds.pbrdf.aolp().isel(place)), u / 0.3)
    assert ds.pbrdf.dolp().attrs["units"] == "1"
    assert ds.pbrdf.aolp().attrs["units"] == "rad"


def test_stokes_of_a_polarised_source(ds):
    here = {"theta_i": 0, "wavelength": 1, "theta_s": 4, "dphi": 6}
    m00 = 1.0 + 0.1 + 0.2 + 0.06
    seen = ds.pbrdf.stokes([2.0, -1.0, 0.5, 0.0]).isel(here)
    assert_allclose(
        seen, m00 * np.array([1.8, -0.1, 0.8 * np.sin(1.5 * np.pi + 0.2), 0.075])
    )
    assert_allclose(
        ds.pbrdf.dolp([2.0, -1.0, 0.5, 0.0]).isel(here),
        np.hypot(seen[1], seen[2]) / seen[0],
    )


def test_errors_follow_from_those_of_the_elements(ds):
    # AOLP: d(½ atan2(U, Q)) = ½ dU/P across, by finite steps
    here = {"theta_i": 0, "wavelength": 0, "theta_s": 0, "dphi": 1}
    m00, q, u = 1.01, 0.303, 0.404 * np.sin(np.pi / 4 + 0.2)
    step = 1e-6

    def aolp(q, u):
        return 0.5 * np.arctan2(u, q)

    def dolp(i, q, u):
        return np.hypot(q, u) / i

    slopes = [
        (aolp(q + step, u) - aolp(q, u)) / step,
        (aolp(q, u + step) - aolp(q, u)) / step,
    ]
    assert_allclose(ds.pbrdf.stderr("AOLP").isel(here), 0.02 * np.hypot(*slopes), rtol=1e-5)
    slopes = [
        (dolp(m00 + step, q, u) - dolp(m00, q, u)) / step,
        (dolp(m00, q + step, u) - dolp(m00, q, u)) / step,
        (dolp(m00, q, u + step) - dolp(m00, q, u)) / step,
    ]
    assert_allclose(
        ds.pbrdf.stderr("DOLP").isel(here), 0.02 * np.linalg.norm(slopes), rtol=1e-5
    )


def test_errors_of_polarisation_are_what_can_be_known(ds):
    ds.brdf_total_stderr[0, 0, 1, 2] = 0.9
    ds.brdf_total_stderr[0, 0, 1, 3] = 0.4
    ds.brdf_total[0, 0, 1, 3, 1:3, 0] = 1e-9
    here = ds.isel(theta_i=0, wavelength=0, theta_s=1)
    for name, most in (("DOLP", 1.0), ("AOLP", np.pi / 2)):
        error = here.pbrdf.stderr(name)
        # M00 of 1.07 is below two errors of 0.9; with errors of 0.4 Q and U are unknown
        assert np.isnan(error[2])
        assert error.max() <= most
        assert np.isfinite(error.isel(dphi=[0, 1, 3, 4, 5, 6, 7])).all()
    assert_allclose(error[3], np.pi / 2)


def test_nothing_known_is_nan(ds):
    ds.brdf_total[0, 0, 1, 2] = 0.0
    ds.brdf_total[0, 0, 1, 3] = np.nan
    for name in ("dolp", "aolp"):
        found = getattr(ds.pbrdf, name)()[0, 0, 1]
        assert np.isnan(found[2:4]).all()
        assert np.isfinite(found[4:]).all()


def test_in_plane_has_signed_view_angles(ds):
    cut = ds.pbrdf.in_plane()
    assert_allclose(np.rad2deg(cut.theta_view), np.arange(-82.5, 90, 15))
    m00 = cut.pbrdf.element("M00").isel(theta_i=0, wavelength=0)
    # Forward is dphi = pi, the fifth of eight bins; behind is dphi = 0
    assert_allclose(m00.sel(theta_view=np.deg2rad(37.5)), 1.0 + 0.05 * 2 + 0.01 * 4)
    assert_allclose(m00.sel(theta_view=np.deg2rad(-37.5)), 1.0 + 0.05 * 2)


def test_at_says_how_it_interpolates_and_refuses_beyond(ds):
    with pytest.warns(AccuracyWarning, match="M00 changes by"):
        middle = ds.pbrdf.at(theta_i=0.45)
    m00 = middle.pbrdf.element("M00").isel(wavelength=0, theta_s=0, dphi=0)
    assert_allclose(m00, 1.0 + 0.3 * 0.25)
    assert "theta_i: linear between 17.1887 deg and 51.5662 deg" in middle.interpolation
    exact = ds.pbrdf.at(theta_i=0.9, wavelength=0.85)
    assert "as computed at" in exact.interpolation
    assert_allclose(exact.brdf_total, ds.brdf_total.isel(theta_i=1, wavelength=1))
    with pytest.raises(ValueError, match="theta_i must lie in what was computed"):
        ds.pbrdf.at(theta_i=1.2)
    with pytest.raises(ValueError, match="m is no numbered dimension"):
        ds.pbrdf.at(m=1.2)
    # The circle of dphi is closed: between the last bin and the first
    wrapped = ds.pbrdf.at(dphi=-np.pi / 16).pbrdf.element("M00")
    assert_allclose(wrapped[0, 0, 0], 1.0 + 0.01 * 7 / 4)


def test_folding_takes_the_mirror_image_with_its_sign(ds):
    assert not folded(ds)[1]
    both, done = folded(ds.assign_attrs(isotropic=True))
    assert done
    here = {"theta_i": 0, "wavelength": 0, "theta_s": 0}
    m00 = both.pbrdf.element("M00").isel(here)
    assert_allclose(m00[1], 1.0 + 0.01 * 4)
    m20 = both.pbrdf.element("M20").isel(here)
    first, last = np.pi / 4 + 0.2, 7 * np.pi / 4 + 0.2
    assert_allclose(m20[1], 0.2 * (1.01 * np.sin(first) - 1.07 * np.sin(last)))
    assert_allclose(m20[7], -m20[1])
    # In the plane M20 of a symmetric scene is none
    assert_allclose(m20[4], 0.0, atol=1e-15)
    assert_allclose(both.pbrdf.stderr("M00").isel(here)[:2], [0.02, 0.02 / np.sqrt(2)])


def test_what_was_not_computed_is_refused_by_name(ds):
    less = ds.isel(stokes_out=[0, 1], stokes_in=[0, 1])
    with pytest.raises(ValueError, match="DOLP was not computed"):
        less.pbrdf.dolp()
    with pytest.raises(ValueError, match="source must have no U"):
        less.pbrdf.stokes([1.0, 0.0, 0.3, 0.0])
    with pytest.raises(ValueError, match="polarised part of at most I"):
        ds.pbrdf.stokes([1.0, 1.0, 0.3, 0.0])
    with pytest.raises(ValueError, match=r"one of 17.1887 deg, 51.5662 deg, .* got 60 deg"):
        ds.pbrdf.polar("M00", theta_i=np.deg2rad(60), wavelength=0.45)
    with pytest.raises(ValueError, match=r"chosen by wavelength of 0\.45 um, 0\.85 um"):
        ds.pbrdf.polar("M00", theta_i=0.3)
    assert pbrdf.accessor.Accessor is not None


class Cosines:
    """A model whose means over bins are known: cos theta_s cos dphi, and factors."""

    def brdf(self, theta_i, theta_s, dphi, wavelength=None, *, phi_i=0.0):
        rows = np.arange(1.0, 17.0).reshape(4, 4)
        shape = np.cos(theta_s) * np.cos(dphi) * theta_i * wavelength * (1 + phi_i)
        return shape[..., None, None] * rows


def test_a_model_beside_a_result_is_averaged_over_its_bins(ds):
    both = ds.assign_coords(phi_i=0.7).pbrdf.beside(Cosines(), "cosines")
    assert list(both.state.values) == ["simulated", "cosines"]
    assert_allclose(both.brdf_total.sel(state="simulated"), ds.brdf_total)
    model = both.sel(state="cosines")
    assert not model.brdf_total_stderr.any()
    # Bin 2 of 6 in zenith, 3 of 8 in azimuth, by the integrals of cos^2 sin and cos sin
    low, high, half = np.pi / 6, np.pi / 4, np.pi / 8
    zenith = (np.cos(low) ** 3 - np.cos(high) ** 3) / 3
    zenith /= (np.sin(high) ** 2 - np.sin(low) ** 2) / 2
    azimuth = np.cos(3 * np.pi / 4) * np.sin(half) / half
    here = model.brdf_total.isel(theta_i=1, wavelength=0, theta_s=2, dphi=3)
    expected = zenith * azimuth * 0.9 * 0.45 * 1.7
    assert_allclose(here.sel(stokes_out="Q", stokes_in="U"), 7 * expected, rtol=1e-9)
    assert_allclose(here.sel(stokes_out="V", stokes_in="I"), 13 * expected, rtol=1e-9)


def test_a_model_has_no_value_over_other_dimensions(ds):
    with pytest.raises(ValueError, match=r"a result over slope_rms too.*\.sel"):
        ds.expand_dims(slope_rms=[0.1, 0.2]).pbrdf.beside(Cosines())
