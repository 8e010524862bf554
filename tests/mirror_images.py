"""Results and their mirror images in the plane of incidence."""

import numpy as np
from numpy.testing import assert_allclose

# Elements that couple (I, Q) and (U, V): they change sign with dphi
ODD = np.array([[0, 0, 1, 1], [0, 0, 1, 1], [1, 1, 0, 0], [1, 1, 0, 0]], dtype=bool)


def image_of(brdf):
    """BRDF seen in a mirror, its last dimensions dphi and both Stokes indices."""
    return brdf.isel(dphi=-np.arange(brdf.sizes["dphi"])).values * np.where(ODD, -1.0, 1.0)


def assert_folded(fold, plain):
    """Every bin is the average of a plain run and its image, and its own image."""
    assert_allclose(fold.brdf, 0.5 * (plain.brdf.values + image_of(plain.brdf)), atol=1e-12)
    assert_allclose(fold.brdf, image_of(fold.brdf), rtol=1e-13, atol=1e-15)
    assert_allclose(fold.albedo, plain.albedo, rtol=1e-12)
