"""Single bounces of a gentle surface against the closed-form model."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import GaussianSurface, Material, MicrofacetModel, Scene, observe

LOSSY = Material(1.9, 0.4)
SURFACE = GaussianSurface(shape=(256, 256), spacing=1.0, corr_length=16.0, slope_rms=0.1)
# In the plane, out of it to both sides, towards the zenith, from the zenith
SCAN = {
    "theta_i": np.array([0.5, 0.5, 0.4, 0.2, 0.0]),
    "theta_s": np.array([0.55, 0.4, 0.35, 0.0, 0.25]),
    "dphi": np.array([np.pi, 2.8, -2.7, 2.0, 0.7]),
}


@pytest.mark.parametrize("estimator", ["facets", "paths"])
def test_matrix_of_narrow_cones_is_that_of_the_model(estimator):
    """All elements over M00, also at the zenith, where dphi names the frame."""
    half = 0.004
    seen = observe(
        Scene(SURFACE, LOSSY), **SCAN, max_bounces=1, realizations=8, n_rays=2000,
        source_half_angle=half, detector_half_angle=half, estimator=estimator,
    ).brdf_total.values  # fmt: skip
    model = MicrofacetModel(LOSSY, slope_rms=0.1).brdf(**SCAN)
    assert_allclose(
        seen / seen[:, :1, :1], model / model[:, :1, :1],
        atol=3e-4 if estimator == "facets" else 4e-3,
    )  # fmt: skip
    # What a wrong frame would spoil is there
    turned = np.hypot(model[1:, 2, 0], model[1:, 0, 2]) / model[1:, 0, 0]
    assert turned.min() > 1e-3


def test_brightness_is_that_of_the_model():
    """Slopes this gentle at these angles hide nothing: no rule of shadowing matters."""
    scene, options = Scene(SURFACE, LOSSY), {"max_bounces": 1, "phi_i": "uniform"}
    seen = observe(
        scene, **SCAN, **options, realizations=64, n_rays=2000, target_rel_error=0.02,
        variance_reduction=False,
    )  # fmt: skip
    model = MicrofacetModel(LOSSY, slope_rms=0.1).brdf(**SCAN)[:, 0, 0]
    # Without the noise of the slopes what is left is the mean over the cones
    known = observe(
        scene, **SCAN, **options, realizations=8, n_rays=2000,
        source_half_angle=0.002, detector_half_angle=0.002,
    ).brdf_total[:, 0, 0]  # fmt: skip
    assert_allclose(known, model, rtol=3e-4)
    z = (seen.brdf_total[:, 0, 0] - model) / seen.brdf_total_stderr[:, 0, 0]
    assert np.abs(z).max() < 4
    # The error asked for was reached, by readings above a tenth of the brightest
    reached = (seen.brdf_total_stderr / seen.brdf_total)[:, 0, 0].values
    assert reached[model > 0.12 * model.max()].max() <= 0.021
    assert seen.rel_error <= 0.02
    assert seen.realizations >= 64


def test_fewer_stokes_elements_are_those_of_all():
    options = {
        "n_rays": 1000, "realizations": 8, "source_half_angle": 0.015,
        "detector_half_angle": 0.02,
    }  # fmt: skip
    scene = Scene(SURFACE, Material(1.5, diffuse_albedo=0.5))
    full = observe(scene, 0.5, [0.55, 0.9], np.pi, **options)
    for stokes, count in (("linear", 3), ("unpolarized", 1)):
        part = observe(scene, 0.5, [0.55, 0.9], np.pi, **options, stokes=stokes)
        assert_allclose(
            part.brdf.values, full.brdf.values[..., :count, :count], rtol=1e-9, atol=1e-15
        )
