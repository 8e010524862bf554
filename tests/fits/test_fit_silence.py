"""No warning of numpy escapes a fit, however far from the minimum it begins."""

import warnings

import numpy as np
import pytest
import xarray as xr

from fitting import fit
from pbrdf import Material, MicrofacetModel

# One line a case
# ruff: noqa: E501
ALL = ("specular_gain", "diffuse_albedo", "slope_rms", "n", "kappa")


def scan(model, incidence, step, *, noise=0.0, floor=0.0, ratios=False):
    view = np.radians(np.arange(-85.0, 86.0, step))
    theta_i = np.full(view.size, np.radians(incidence))
    dphi = np.where(view > 0.0, np.pi, 0.0)
    brdf = model.brdf(theta_i, np.abs(view), dphi)
    m00, m10 = brdf[:, 0, 0], brdf[:, 1, 0]
    rng = np.random.default_rng(4)
    spread = noise * m00 + floor * m00.max()
    m00, m10 = (part + spread * rng.standard_normal(view.size) for part in (m00, m10))
    data = {"m10": m10 / m00} if ratios else {"M00": m00}
    coords = {"theta_i": theta_i, "theta_s": np.abs(view), "dphi": dphi}
    return xr.Dataset(
        {name: ("geometry", values) for name, values in data.items()},
        {name: ("geometry", values) for name, values in coords.items()},
    )


@pytest.mark.parametrize(
    ("model", "given", "start", "free", "relative"),
    [
        # A lobe of noise alone, begun five times too wide
        pytest.param((1.48, 0.3, 0.031), {"incidence": 30, "step": 10, "floor": 0.01}, 5.0, ALL[:3], False, marks=pytest.mark.slow),
        # A lobe between the readings: most of them are exactly 0
        pytest.param((1.4, 7.0, 0.0075), {"incidence": 0, "step": 10, "noise": 0.01}, 6.0, ALL[2:3], True, marks=pytest.mark.slow),
        # Ratios at the normal, which tell nothing of five parameters
        ((1.5, 0.0, 0.83), {"incidence": 0, "step": 10, "noise": 0.1, "ratios": True}, 0.35, ALL, False),
    ],
)  # fmt: skip
def test_no_warning_of_numpy_escapes(model, given, start, free, relative):
    n, kappa, slope = model
    truth = MicrofacetModel(Material(n, kappa), slope_rms=slope, specular_gain=0.5)
    measured = scan(truth, **given)
    if relative:
        measured = (measured * 1e-3).assign_attrs(quantity="relative")
    begin = truth.with_parameters(slope_rms=start * slope)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = fit(measured, begin, free=free, accept=("all",))
        assert result.misfit.verdict in result.summary()
