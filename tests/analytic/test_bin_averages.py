"""Means of a model over wide bins, however narrow its lobe is."""

import numpy as np
import pytest

from pbrdf import Material, MicrofacetModel
from pbrdf.derived.bins import bin_averages
from tests.reference_optics import fresnel


@pytest.mark.parametrize("slope_rms", [0.001, 0.01, 0.03])
@pytest.mark.parametrize("theta_i", [0.0, 0.6, np.deg2rad(60.0)])
def test_a_narrow_lobe_reflects_what_fresnel_says(theta_i, slope_rms):
    """On the edge of bins (60 degrees) and inside of one."""
    n_theta, n_dphi = 18, 36
    model = MicrofacetModel(Material(1.5), slope_rms)
    means = bin_averages(model, theta_i, n_theta, n_dphi)
    edges = np.sin(np.linspace(0.0, np.pi / 2, n_theta + 1)) ** 2
    total = np.einsum("t,tpmn->mn", np.diff(edges) * np.pi / n_dphi, means)
    r_s, r_p = (abs(one) ** 2 for one in fresnel(np.cos(theta_i), 1.5, 0.0))
    # Facets tilted by the slope are met at other angles, to second order in it
    off = 1e-3 + 10 * slope_rms**2
    assert total[0, 0] == pytest.approx(0.5 * (r_s + r_p), rel=off)
    assert total[1, 0] == pytest.approx(0.5 * (r_s - r_p), rel=off, abs=1e-4)
